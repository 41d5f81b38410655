"""Whether a loop as the proof understands it is the loop that was given.

Before anything is said, derivatives and outputs of both are compared, by python-control's own
evaluation (`nlctl.diagrams.points`), at the initial state, around it and wherever a run has been.
What was compared and agreed is remembered by the content of the loop: the same comparison of the
same functions, wiring and values is made at its first point only.  With other values it is made at
every eighth one, if both loops consist of the same functions with the same values, block by block:
they can only differ in their wiring then, and that has no values.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import control as ct
import numpy as np

from nlctl.blocks import Block
from nlctl.diagrams import leaves, state_names
from nlctl.diagrams.points import (
    PointFunction,
    PointValues,
    agree,
    explained,
    first_difference,
    rates_and_outputs,
)
from nlctl.errors import DiagramError, UsageError

from ...loop_record import array_text, text_key
from .roles import UNREAD_CONTENT, LoopContent, Remembered

_Point = tuple[float, np.ndarray]
_COUNT, SPREADS = 8, (0.03, 0.3, 1.0)  # points of each spread
LATEST = 1e4  # s
_AGREED = Remembered()


def points_around(x: np.ndarray, *, seed: int = 0) -> list[_Point]:
    """Return times and states at which loops are compared: the start, and points around it."""
    # Shapes: `x` (n,).
    rng = np.random.default_rng(seed)
    points = [(0.0, x)]
    for spread in SPREADS:
        times = np.concatenate(
            [rng.uniform(0, 20, _COUNT // 2), rng.uniform(0, LATEST, _COUNT // 2)]
        )
        points += [(float(t), x + spread * rng.standard_normal(x.size)) for t in times]
    return points


def check_same(
    given: ct.InterconnectedSystem,
    understood: ct.InterconnectedSystem,
    points: Iterable[_Point],
    params: Mapping[str, Any] | None = None,
    read_params: Mapping[str, Any] | None = None,
    content: LoopContent = UNREAD_CONTENT,
) -> None:
    """Compare a loop with the proof's reading of it, at points; `content` is of the loop."""
    points = list(points)
    comparisons = _comparisons(content, points)
    points = points[:: _step(given, understood, comparisons, len(points))]
    names, u = state_names(given), np.zeros(given.ninputs or 0)
    more = np.zeros((understood.nstates or 0) - (given.nstates or 0))
    shared = [label for label in given.output_labels if label in understood.output_labels]
    rows, others = (
        np.array([s.output_labels.index(label) for label in shared], dtype=int)
        for s in (given, understood)
    )
    what = [*(f"d/dt {name}" for name in names), *(f"output '{label}'" for label in shared)]
    one, other = _named(given, params), _named(understood, read_params)

    def as_given(t: float, x: np.ndarray, u: np.ndarray) -> PointValues:
        rates, outputs = one(t, x, u)
        return (np.concatenate([rates, outputs[rows]]),)

    def read(t: float, x: np.ndarray, u: np.ndarray) -> PointValues:
        rates, outputs = other(t, np.append(x, more), u[:0])
        return (np.concatenate([rates[: x.size], outputs[others]]),)

    with np.errstate(all="ignore"):
        for t, x in points:
            _compare(given, (as_given, read), (t, x, u), what)
    for comparison in comparisons:
        _AGREED.add(comparison)


def _comparisons(content: LoopContent, points: list[_Point]) -> list[str]:
    """Return keys of a comparison: with these values, and with any."""
    where = f" {[(t, array_text(x)) for t, x in points]}"
    return [key and text_key(key + where) for key in (content.key, content.functions)]


def _step(given: object, understood: object, comparisons: list[str], count: int) -> int:
    """Return the step from a point that is still to be compared to the next."""
    if comparisons[0] in _AGREED:
        return max(count, 1)
    return _COUNT if comparisons[1] in _AGREED and _has_same_blocks(given, understood) else 1


def _has_same_blocks(given: Any, understood: Any) -> bool:
    """Whether both consist of the same functions and records, block by block."""
    one, other = ({place.path: place.system for place in leaves(s)} for s in (given, understood))
    return one.keys() == other.keys() and all(
        type(a) is type(other[path]) is Block
        and a.current_spec is other[path].current_spec
        and a.outfcn is other[path].outfcn
        and (not a.nstates or a.updfcn is other[path].updfcn)
        for path, a in one.items()
    )


def _named(system: Any, params: Mapping[str, Any] | None) -> PointFunction:
    """Return what evaluates a system, and says which one where that fails."""
    function = rates_and_outputs(system, params)

    def values(t: float, x: np.ndarray, u: np.ndarray) -> PointValues:
        try:
            return function(t, x, u)
        except UsageError:
            raise
        except Exception as error:  # the blocks' functions may raise whatever they like
            raise DiagramError(
                f"'{system.name}' cannot be evaluated at t = {t:.6g} s, as the proof needs: "
                f"{type(error).__name__}: {error}"
            ) from error

    return values


def _compare(
    given: Any, both: tuple[PointFunction, PointFunction], point: Any, what: list[str]
) -> None:
    """Compare one point; what is not a number in both is the same."""
    (a,), (b,) = (function(*point) for function in both)
    a, b = (np.where(np.isnan(a) & np.isnan(b), 0.0, values) for values in (a, b))
    if agree(a, b).all():
        return
    differ = first_difference([what], (a,), (b,), explained(both[0], point, (a,)))
    if differ is not None:
        label, one, other = differ
        raise DiagramError(
            f"'{given.name}' is not the loop that the proof is about: at t = {point[0]:.6g} s "
            f"{label} is {one:.9g}, and {other:.9g} with the blocks connected by name"
        )
