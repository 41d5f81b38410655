"""Functions that are formulas of others, element by element."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from ..masked import Masked, MaskedPlaces
from ..operators import elementwise, floor_quotient
from .complex_numbers import ComplexPair
from .table import ARRAY_METHODS, Facade, formula, of

__all__: list[str] = []


@formula(np.sinc)
def sinc(np: Facade, x: object) -> Any:
    """sin(pi x) / (pi x)."""
    y = np.pi * np.where(x == 0.0, 1.0e-20, x)
    return np.sin(y) / y


@formula(np.angle)
def angle(np: Facade, x: Arithmetic, deg: bool = False) -> Any:
    """The angle of a complex number."""
    phase = np.arctan2(x.imag if isinstance(x, ComplexPair) else 0.0, np.real(x))
    return phase * (180.0 / np.pi) if deg else phase


@formula(np.modf, math.modf)
def parts_of_number(np: Facade, x: object) -> Any:
    """What is behind the point, and what is before it."""
    whole = np.trunc(x)
    rest = np.where(np.isinf(x), 0.0, x - whole)
    return rest, whole


@formula(np.round, np.around)
def _rounded(np: Facade, x: Arithmetic, decimals: int = 0) -> Any:
    """x with so many decimals, as NumPy rounds: by a power of ten there and back."""
    if decimals == 0:
        return np.rint(x)
    ten = 10.0 ** abs(decimals)
    if decimals < 0:
        return np.rint(x / ten) * ten
    return np.rint(x * ten) / ten


@formula(np.unwrap)
def unwrap(np: Facade, x: Arithmetic) -> Any:
    """Angles without jumps by 2 pi."""
    d = np.diff(x)
    full = 2 * np.pi
    kept = (d + np.pi) % full - np.pi
    kept = np.where(np.logical_and(kept == -np.pi, d > 0), np.pi, kept)
    change = np.where(np.abs(d) < np.pi, 0.0, kept - d)
    return np.concatenate([x[:1], x[1:] + np.cumsum(change)])


# -- choices ---------------------------------------------------------------------------------------


@of(np.where)
def where(graph: Graph, condition: object, *values: object) -> Any:
    """Return one or the other."""
    if not values:
        return (flatnonzero(graph, condition),)
    return elementwise(graph, "select", condition, *values)


@of(np.argwhere)
def argwhere(graph: Graph, condition: object) -> Masked:
    """Return where a condition holds, each place in a row of its own."""
    places = flatnonzero(graph, condition)
    rows = np.arange(len(places.mask))[:, None]
    return Masked(traced(graph, rows), places.mask)


@of(np.flatnonzero)
def flatnonzero(graph: Graph, condition: object) -> MaskedPlaces:
    """Return where a condition holds."""
    mask = elementwise(graph, "ne", traced(graph, condition), 0.0)
    if mask.ndim != 1:
        raise Untraceable("the places in a matrix where a condition holds")
    return MaskedPlaces(mask)


@of(np.clip)
def _clip(
    graph: Graph, values: object, low: object = None, high: object = None, *, min: object = None,  # noqa: A002
    max: object = None, a_min: object = None, a_max: object = None, out: Any = None,  # noqa: A002
) -> Any:  # fmt: skip
    """Return values between bounds."""
    low = next((v for v in (low, min, a_min) if v is not None), None)
    high = next((v for v in (high, max, a_max) if v is not None), None)
    clipped = traced(graph, values)
    if low is not None:
        clipped = elementwise(graph, "maximum", clipped, low)
    if high is not None:
        clipped = elementwise(graph, "minimum", clipped, high)
    if out is not None:
        out[...] = clipped
    return clipped


@of(np.select)
def select(
    graph: Graph, conditions: Sequence[Any], choices: Sequence[Any], default: object = 0
) -> Any:
    """Return the first choice whose condition holds."""
    chosen = traced(graph, default)
    for condition, choice in reversed(list(zip(conditions, choices, strict=True))):
        chosen = elementwise(graph, "select", condition, choice, chosen)
    return chosen + 0.0


@of(np.piecewise)
def piecewise(
    graph: Graph,
    x: object,
    conditions: Sequence[Any],
    functions: Any,
    *given: object,
    **named: object,
) -> Any:
    """Return what the function of the last condition that holds makes of x."""
    x = traced(graph, x)
    if isinstance(conditions, Tracer):
        conditions = [conditions] if conditions.ndim == x.ndim else list(conditions)
    conditions, functions = list(conditions), list(functions)
    result = traced(graph, np.zeros(x.shape))
    values = [f(x, *given, **named) if callable(f) else f for f in functions]
    if len(values) == len(conditions) + 1:
        result = result + values.pop()
    for condition, value in zip(conditions, values, strict=True):
        result = elementwise(graph, "select", condition, value, result)
    return result + 0.0


@formula(np.nan_to_num)
def nan_to_num(
    np: Facade,
    x: object,
    copy: bool = True,
    nan: object = 0.0,
    posinf: object = None,
    neginf: object = None,
) -> Any:
    """x with numbers for what is none."""
    largest = 1.7976931348623157e308
    high = largest if posinf is None else posinf
    low = -largest if neginf is None else neginf
    finite = np.where(x != x, nan, np.where(x == math.inf, high, np.where(x == -math.inf, low, x)))
    if not copy:
        raise Untraceable("nan_to_num in place")
    return finite


@formula(np.isclose)
def _isclose(
    np: Facade, a: Arithmetic, b: Arithmetic, rtol: float = 1e-05, atol: float = 1e-08
) -> Any:
    """Whether a is next to b."""
    near = np.logical_and(np.abs(a - b) <= atol + rtol * np.abs(b), np.isfinite(b + 0.0 * a))
    return np.logical_or(near, np.equal(a, b))


def conj(graph: Graph, values: Tracer) -> Tracer:
    """Return an array of real numbers as it is."""
    return values


ARRAY_METHODS.update(clip=_clip, round=np.round, conj=conj, conjugate=conj)

_TWO = math.log(2.0)
# what is one expression: of NumPy, of which `np` has the functions, and of numbers
_FORMULAS = (
    ((np.square,), lambda np, x: x * x),
    ((np.fmax,),
     lambda np, a, b: np.where(b != b, a, np.where(a != a, b, np.maximum(a, b)))),
    ((np.fmin,),
     lambda np, a, b: np.where(b != b, a, np.where(a != a, b, np.minimum(a, b)))),
    ((np.logaddexp2,), lambda np, x, y: np.logaddexp(x * _TWO, y * _TWO) / _TWO),
    ((np.fabs,), lambda np, x: np.abs(x)),
    ((np.reciprocal,), lambda np, x: 1.0 / x),
    ((np.deg2rad, np.radians, math.radians), lambda np, x: x * (np.pi / 180.0)),
    ((np.rad2deg, np.degrees, math.degrees), lambda np, x: x * (180.0 / np.pi)),
    ((np.float_power,), lambda np, x, y: np.power(x * 1.0, y)),
    ((np.real,), lambda np, x: x.real if isinstance(x, ComplexPair) else x),
    ((np.positive,), lambda np, x: +x),
    ((np.conj,), lambda np, x: x.conjugate() if isinstance(x, ComplexPair) else x.copy()),
    ((np.imag,), lambda np, x: x.imag if isinstance(x, ComplexPair) else np.zeros_like(x)),
    ((np.isnan, math.isnan), lambda np, x: x != x),
    ((np.isfinite, math.isfinite), lambda np, x: np.abs(x) < math.inf),
    ((np.isinf, math.isinf), lambda np, x: np.abs(x) == math.inf),
    ((np.signbit,), lambda np, x: np.copysign(1.0, x) < 0.0),
    ((np.remainder, np.mod), lambda np, x, y: x % y),
    ((np.ldexp, math.ldexp), lambda np, x, n: x * 2.0**n),
    ((np.fix,), lambda np, x: np.trunc(x)),
    ((np.allclose,), lambda np, a, b, rtol=1e-05, atol=1e-08: np.all(np.isclose(a, b, rtol, atol))),
    ((np.array_equal,), lambda np, a, b: np.all(np.equal(a, b))),
)  # fmt: skip
for _functions, _written in _FORMULAS:
    formula(*_functions)(_written)

# the same, of the graph
_OF_GRAPHS = (
    ((np.floor_divide,), lambda graph, x, y: floor_quotient(graph, x, y)),
    ((np.divmod,),
     lambda graph, x, y: (floor_quotient(graph, x, y), elementwise(graph, "remainder", x, y))),
    ((np.nonzero,), lambda graph, condition: (flatnonzero(graph, condition),)),
)  # fmt: skip
for _functions, _written in _OF_GRAPHS:
    of(*_functions)(_written)
