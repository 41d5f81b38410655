"""What a diagram computes at points, and whether two descriptions of it agree there.

A compiled program, what a proof has read, a response and a record of an earlier run are second
descriptions of a diagram, and second descriptions can be wrong.  Each is compared with
python-control's own rates and outputs, here and nowhere else.  The values are those of a copy of
the diagram, so that nobody else who evaluates it is disturbed.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import control as ct
import numpy as np
import numpy.typing as npt

from ..upstream.control_internals import rates_and_outputs_now
from ..upstream.systems import System
from .parameters import overridden

SAME_FUNCTIONS = 1e-10  # relative difference that rounding explains without a closer look
# what a response may differ by, relative to the largest sample: engines interpolate
OF_RESPONSES = 1e-6
# what processors and versions of libraries may differ by, relative and absolute
OTHER_VERSIONS = 1e-6, 1e-9
SHAKEN = 1e-13  # relative change of states and inputs that shows what rounding does to a value
_TIMES = 100  # as many times as far as states and inputs are shaken
Point = tuple[float, np.ndarray, np.ndarray]  # time (s), states, inputs
PointValues = tuple[np.ndarray, ...]  # rates, outputs, and more where there are more
PointFunction = Callable[[float, np.ndarray, np.ndarray], PointValues]


def values_now(system: System, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Return rates and outputs at a point, with the parameters that a system has now."""
    if isinstance(system, ct.StateSpace):  # connected linear systems have one matrix for all
        rates, outputs = system.dynamics(*point), system.output(*point)
    else:
        rates, outputs = rates_and_outputs_now(system, *point)
    return np.reshape(rates, -1).astype(float), np.reshape(outputs, -1).astype(float)


def rates_and_outputs(system: System, params: Mapping[str, Any] | None = None) -> PointFunction:
    """Return what computes python-control's rates and outputs, with parameters of its own."""
    copied = overridden(system, params)
    return lambda t, x, u: values_now(copied, (t, x, u))


def agree(
    a: npt.ArrayLike, b: npt.ArrayLike, absolute: Any = 0.0, relative: float = SAME_FUNCTIONS
) -> np.ndarray:
    """Return where values are equal to rounding; NaN equals nothing; shapes: `a, b` (m,)."""
    a, b = np.asarray(a), np.asarray(b)
    with np.errstate(invalid="ignore"):
        allowed = relative * np.maximum(np.abs(a), np.abs(b)) + absolute
        return np.asarray((a == b) | (np.abs(a - b) <= allowed))


def first_difference(
    labels: Sequence[Sequence[str]], one: PointValues, other: PointValues, allowed: PointValues
) -> tuple[str, float, float] | None:
    """Return the first of some values that differ by more than is allowed: what it is, and both."""
    for names, a, b, most in zip(labels, one, other, allowed, strict=True):
        differ = np.flatnonzero(~agree(a, b, most))
        if differ.size:
            k = int(differ[0])
            return names[k], float(a[k]), float(b[k])
    return None


def rounded_points(point: Point, later: float = 0.0) -> Iterator[Point]:
    """Yield points as far as rounding may move one."""
    # Sums may cancel: any two numbers are moved apart at one of the points, all alike at another.
    t, x, u = point
    places = np.arange(x.size + u.size)
    for bit in range(int(places.size).bit_length() + 1):
        factors = 1 + SHAKEN * (1 - 2 * (places >> bit & 1))
        yield t + later, x * factors[: x.size], u * factors[x.size :]


def explained(
    function: PointFunction, point: Point, base: PointValues, later: float = 0.0
) -> PointValues:
    """Return by how much rounded states and inputs explain that values are not `base`."""
    moved = [np.zeros_like(returned) for returned in base]
    for near in rounded_points(point, later):
        for place in (near, _opposite(near, point)):
            try:
                returned = function(*place)
                break
            except Exception:  # past the end of what the blocks' functions are defined on
                returned = base
        for total, a, b in zip(moved, base, returned, strict=True):
            np.fmax(total, _TIMES * np.abs(a - b), out=total)
    return tuple(moved)


def _opposite(near: Point, point: Point) -> Point:
    """Return a point as far on the other side, at the same time."""
    (t, *moved), (_, *here) = near, point
    x, u = (2 * a - b for a, b in zip(here, moved, strict=True))
    return t, x, u
