"""Proved ranges: branch and bound over boxes, with equations evaluated on balls.

On a box X with centre m the range of a function is enclosed by its value on X, by the mean-value
form f(m) + f'(X)(X - m), and by both.  Where a comparison inside the equation stays undecided,
every branch is followed and the results are united: no branch is ever picked.

A function that can be traced is enclosed by machine code instead, in floats that are rounded
outwards, and the same forms; see `nlctl.analysis.intervals.machine`.  `Proof` and `Range` say
which.

What is proved is about the equation with its parameters as doubles; arithmetic between plain
floats inside it (``2 * np.pi``) is rounded as in every run.
"""

import heapq
import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from flint import arb

from nlctl.annotations import as_annotated
from nlctl.arguments import a_function, integer, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.native.enclosures.divide import Supremum, enclose_supremum
from nlctl.wording import counted

from .agreement import one_number
from .arithmetic import Ball, as_ball, common
from .box import Box, Cell
from .machine import TOO_FEW, Readable, code_for, decided_by_code, readable
from .paths import Undecided, every_way
from .type_questions import is_of_library

__all__ = ["Ball", "Box", "Proof", "Range", "Undecided", "enclose", "prove", "upper"]

_Function = Callable[[tuple[Any, ...]], Any]
HOPELESS = 5_000  # boxes after which a function still without bound somewhere is given up


@described_record(made_by="enclose")
class Range:
    """A proved enclosure of a function's values on a box."""

    low: float  # low <= f <= high on the whole box, proved; infinite where that did not succeed.
    high: float
    # Extreme values that are attained (on boxes with an infinite side: that interval arithmetic
    # gives at a point of the finite ones).
    least: float
    greatest: float
    boxes: int  # Boxes examined, and those left without a finite bound.
    undecided: int
    seconds: float  # How long it took.
    # What proved it: python-flint's balls, or floats rounded outwards in machine code.
    arithmetic: Literal["balls", "floats"] = "balls"

    @property
    def magnitude(self) -> float:
        """Bound of |f|."""
        return float(np.maximum(abs(self.low), abs(self.high)))


@described_record(made_by="prove")
class Proof:
    """The verdict on the claim low <= f <= high on a box."""

    holds: bool | None  # True: proved. False: refuted, at the point `where`. None: undecided.
    boxes: int  # Boxes examined, and those that stayed undecided.
    undecided: int
    # The point that refutes the claim, or the centre of an undecided box.
    where: dict[str, float] | None
    value: float  # Value of the function there.
    seconds: float  # How long it took.
    # What decided it: python-flint's balls, or floats rounded outwards in machine code; balls have
    # confirmed a point that refutes.
    arithmetic: Literal["balls", "floats"] = "balls"

    @property
    def status(self) -> Literal["proved", "refuted", "undecided"]:
        """The verdict on the claim."""
        return {True: "proved", False: "refuted"}.get(self.holds, "undecided")  # type: ignore

    @property
    def missing(self) -> str:
        """What is missing for a decision; nothing if there is one."""
        if self.holds is not None:
            return ""
        what = counted(self.undecided, "box is", "boxes are")
        return (
            f"{what} undecided after {self.boxes}, one around {point_text(self.where)}: raise "
            "max_boxes, or leave the claim a margin there"
        )

    def __str__(self) -> str:
        if self.holds is None:
            return f"undecided: {self.missing}"
        if self.holds:
            return f"proved on {counted(self.boxes, 'box', 'boxes')}"
        return f"refuted at {point_text(self.where)}: {self.value:.6g}"


def point_text(where: Mapping[str, float] | None) -> str:
    """Return the coordinates of a point in words."""
    return ", ".join(f"{name} = {value:.6g}" for name, value in (where or {}).items())


@as_annotated
def enclose(function: _Function, box: Box, *, tol: float = 1e-3, max_boxes: int = 50_000) -> Range:
    """Enclose the range of a function on a box, by branch and bound.

    Parameters
    ----------
    function : callable
        ``function((x1, ..., xm)) -> value`` for the coordinates in the order of the box; plain
        Python and NumPy functions of scalars.
    box : Box
        Where x lies: a lower and an upper bound of every coordinate.
    tol : float, optional
        Each end of the range is at most this far from a value that is attained.
    max_boxes : int, optional
        Limit for each end; where it is reached the range is wider, and still proved.

    Raises
    ------
    ParameterError
        If it is not a function or not a box, `tol` is not positive, or `max_boxes` is below 1; if
        the function asks what its arguments are, or makes of balls what it does not of floats.

    Examples
    --------
    x (1 - x) on [0, 1] has the range [0, 1/4]:

    >>> from nlctl.analysis.lyapunov import Box, enclose
    >>> found = enclose(lambda x: x[0] * (1 - x[0]), Box(names=("x",), low=(0.0,), high=(1.0,)))
    >>> -1e-3 < found.low <= 0.0 and 0.25 <= found.high < 0.251
    True
    """
    a_function("enclose", "function", function)
    of_type("enclose", "box", box, Box, "Box.of(x1=(-1, 1))")
    if not tol > 0:  # infinite: the first box will do
        raise ParameterError(f"enclose needs tol > 0, got {tol}")
    integer("enclose", "max_boxes", max_boxes, at_least=1)
    start, read = time.perf_counter(), _as_readable("enclose", function)
    high, by_code = _end(read, box, 1, tol, max_boxes)
    low, also = _end(read, box, -1, tol, max_boxes)
    return Range(
        low=-low.high,
        high=high.high,
        least=-low.attained,
        greatest=high.attained,
        boxes=high.boxes + low.boxes,
        undecided=high.unbounded + low.unbounded,
        seconds=time.perf_counter() - start,
        arithmetic="floats" if by_code and also else "balls",
    )


def enclose_relatively(function: _Function, box: Box, tol: float, max_boxes: int) -> Range:
    """Enclose a range to a tolerance relative to what one box says of |f|."""
    rough = enclose(function, box, max_boxes=1).magnitude
    fineness = tol * rough if 0 < rough < np.inf else tol
    return enclose(function, box, tol=fineness, max_boxes=max_boxes)


@as_annotated
def prove(
    function: _Function,
    box: Box,
    *,
    low: float = -np.inf,
    high: float = np.inf,
    max_boxes: int = 50_000,
) -> Proof:
    """Prove or refute low <= f <= high on a box.

    A claim that is attained with equality can only be proved where interval arithmetic is exact;
    leave it a margin.

    Parameters
    ----------
    function : callable
        ``function((x1, ..., xm)) -> value``, as in `enclose`.
    box : Box
        Where the claim is made.
    low, high : float, optional
        The claim.
    max_boxes : int, optional
        Number of boxes after which the rest counts as undecided.

    Raises
    ------
    ParameterError
        If it is not a function or not a box, the claim is not low <= high, or `max_boxes` is
        below 1; if the function asks what its arguments are, or makes of balls what it does not
        of floats.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import Box, prove
    >>> box = Box(names=("x",), low=(0.0,), high=(1.0,))
    >>> prove(lambda x: x[0] * (1 - x[0]), box, high=0.26).holds
    True
    >>> refuted = prove(lambda x: x[0] * (1 - x[0]), box, high=0.2)
    >>> print(refuted.holds, refuted.value > 0.2)
    False True
    """
    a_function("prove", "function", function)
    of_type("prove", "box", box, Box, "Box.of(x1=(-1, 1))")
    integer("prove", "max_boxes", max_boxes, at_least=1)
    if not low <= high:  # refuses NaN, too
        raise ParameterError(f"prove needs low <= high, got {low} and {high}")
    start, read = time.perf_counter(), _as_readable("prove", function)
    proof = _proved_by_code(read, box, (low, high), max_boxes)
    proof = proof or _proved_by_balls(read, box, (low, high), max_boxes)
    return replace(proof, seconds=time.perf_counter() - start)


def _proved_by_code(
    function: Readable, box: Box, ends: tuple[float, float], max_boxes: int
) -> Proof | None:
    """Return what machine code finds, if there is any; balls confirm a point that refutes."""
    boxes, undecided, where, value, holds = 0, 0, None, np.nan, True
    claims = [(s, e) for s, e in zip((-1, 1), (-ends[0], ends[1]), strict=True) if e < np.inf]
    if max_boxes <= TOO_FEW or not claims:
        return None
    for sign, bound in claims:
        code = code_for(function, box, sign)
        if code is None:
            return None
        verdict = decided_by_code(code, box, bound, max(max_boxes - boxes, 1))
        boxes += verdict.boxes
        if verdict.holds:
            continue
        there = _at(function, verdict.point, box)
        if verdict.holds is False and not (there.upper() < ends[0] or there.lower() > ends[1]):
            return None
        holds, undecided, value = verdict.holds, verdict.undecided, float(there.mid())
        where = dict(zip(box.names, map(float, verdict.point), strict=True))
        break
    return Proof(
        holds=holds, boxes=boxes, undecided=undecided, where=where, value=value, seconds=0.0,
        arithmetic="floats",
    )  # fmt: skip


def _at(function: _Function, point: np.ndarray, box: Box) -> arb:
    """Return the value at a point, on all of a side where that has no end."""
    wide = [_interval(a, b) for a, b in box.cell]
    points = [arb(float(m)) if np.isfinite(m) else w for m, w in zip(point, wide, strict=True)]
    return _every_branch(function, points, [a >= 0 for a, _ in box.cell])


def _proved_by_balls(
    function: _Function, box: Box, ends: tuple[float, float], max_boxes: int
) -> Proof:
    (low, high), queue, boxes = ends, [box.cell], 0
    undecided, where, value, holds = 0, None, np.nan, True
    while queue and boxes < max_boxes:
        cell = queue.pop()
        boxes += 1
        bound, centre, gradient = _bounds(function, cell)
        if bound.lower() >= low and bound.upper() <= high:
            continue
        refuted = centre.upper() < low or centre.lower() > high
        halves = [] if refuted else _halves(cell, gradient, box)
        if not halves:
            where, value = dict(zip(box.names, _centre(cell), strict=True)), float(centre.mid())
            holds, undecided = (False, 0) if refuted else (None, undecided + 1)
        if refuted:
            break
        queue += halves
    else:
        if queue:
            holds, undecided = None, undecided + len(queue)
            where = where or dict(zip(box.names, _centre(queue[-1]), strict=True))
    return Proof(
        holds=holds, boxes=boxes, undecided=undecided, where=where, value=value, seconds=0.0
    )


def _end(
    function: Readable, box: Box, sign: int, tol: float, max_boxes: int
) -> tuple[Supremum, bool]:
    """Return the supremum of sign f, and whether machine code has found it."""
    code = code_for(function, box, sign) if max_boxes > TOO_FEW else None
    if code is None:
        mirrored = function if sign > 0 else lambda x: -as_ball(function(x))
        return _supremum(mirrored, box, tol, max_boxes), False
    low, high = np.array([box.low, box.high], dtype=float)
    by_code = enclose_supremum(code, low, high, tol=tol, max_boxes=max_boxes, hopeless=HOPELESS)
    return by_code, True


def _as_readable(who: str, function: _Function) -> Readable:
    """Return a function with its expression; a user's is compared with itself on floats."""
    if isinstance(function, Readable):
        return function
    if is_of_library(function):  # compared on its own
        return readable(function, function)
    what = f"{who} cannot take this function: "
    return readable(one_number(function, lambda why: ParameterError(what + why)), function)


def _supremum(function: _Function, box: Box, tol: float, max_boxes: int) -> Supremum:
    """Return a proved upper bound with the largest value met, by balls."""
    order, boxes, best = itertools.count(), 0, -np.inf
    heap: list[tuple[float, int, Cell, Any]] = []
    done: list[float] = []
    todo = [box.cell]
    while True:
        for cell in todo:
            boxes += 1
            bound, centre, gradient = _bounds(function, cell)
            met = centre.upper() if not np.all(np.isfinite(cell)) else centre.lower()
            best = max(best, float(met)) if met.is_finite() else best
            heapq.heappush(heap, (-upper(bound), next(order), cell, gradient))
        end, _, cell, gradient = heap[0]
        limit = max_boxes if np.isfinite(end) else min(max_boxes, HOPELESS)
        if -end - best <= tol or boxes >= limit:
            break
        todo = _halves(cell, gradient, box)
        heapq.heappop(heap)
        if not todo:  # as small as floats allow
            done.append(-end)
            if not heap:
                break
    bounds = [*done, *(-h[0] for h in heap)]
    lost = sum(b == np.inf for b in bounds)
    return Supremum(high=max(bounds), attained=best, boxes=boxes, unbounded=lost)


def upper(ball: object) -> float:
    """Return the upper end of a ball as a float, rounded up; infinite for what is not a number.

    Examples
    --------
    >>> from flint import arb
    >>> from nlctl.analysis.intervals.branch_and_bound import upper
    >>> 1.0 <= upper(arb(1.0)) < 1.0 + 1e-12, upper(arb("nan"))
    (True, inf)
    """
    end = as_ball(ball).value.upper()
    if not end.is_finite():
        return np.inf
    nearest = float(end)
    return nearest if arb(nearest) >= end else float(np.nextafter(nearest, np.inf))


def _centre(cell: Cell) -> tuple[float, ...]:
    return tuple(
        0.5 * a + 0.5 * b if np.isfinite(a) and np.isfinite(b) else np.nan for a, b in cell
    )


def _interval(a: float, b: float) -> arb:
    return arb(a) if a == b else arb(a).union(arb(b)) if np.isfinite(b - a) else arb(0, "inf")


def _bounds(function: _Function, cell: Cell) -> tuple[arb, arb, tuple[arb, ...] | None]:
    """Return the range on a cell, the value at its centre, and the gradient's range."""
    # The gradient is None where the function, having branches there, need not be continuous.
    wide = [_interval(a, b) for a, b in cell]
    middle, signs = _centre(cell), [a >= 0 for a, _ in cell]
    points = [arb(m) if np.isfinite(m) else w for m, w in zip(middle, wide, strict=True)]
    centre = _every_branch(function, points, signs)
    unit = [tuple(arb(int(i == j)) for i in range(len(cell))) for j in range(len(cell))]
    try:
        value = as_ball(function(tuple(map(Ball, wide, unit, signs))))
    except Undecided:
        return _every_branch(function, wide, signs), centre, None
    gradient = value.gradient or (arb(0),) * len(cell)
    mean = centre
    for slope, w, point in zip(gradient, wide, points, strict=True):
        mean = mean + slope * (w - point) if not slope.is_zero() else mean
    return common(value.value, mean), centre, gradient


def _every_branch(function: _Function, coordinates: Sequence[arb], signs: Sequence[bool]) -> arb:
    """Return the hull over every way through the function; NaN if there is no end of them."""
    balls, hull = tuple(Ball(x, (), s) for x, s in zip(coordinates, signs, strict=True)), None
    try:
        for result in every_way(lambda: function(balls)):
            value = as_ball(result).value
            hull = value if hull is None else hull.union(value)
    except Undecided:
        return arb.nan()
    assert hull is not None
    return hull


def _halves(cell: Cell, gradient: tuple[arb, ...] | None, box: Box) -> list[Cell]:
    """Halve a cell across the side that matters most; nothing if floats leave no room."""
    weights = []
    for i, (a, b) in enumerate(cell):
        middle = 0.5 * a + 0.5 * b
        whole = box.high[i] - box.low[i]
        room = np.isfinite(b - a) and a < middle < b
        steep = gradient is not None and all(g.is_finite() for g in gradient)
        scale = float(gradient[i].abs_upper()) if steep and gradient else 1 / whole if whole else 0
        weights.append((b - a) * scale if room else -1.0)
    i = int(np.argmax(weights))
    if weights[i] < 0:
        return []
    a, b = cell[i]
    middle = 0.5 * a + 0.5 * b
    return [(*cell[:i], half, *cell[i + 1 :]) for half in ((a, middle), (middle, b))]
