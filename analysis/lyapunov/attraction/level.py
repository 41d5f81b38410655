"""The largest level of a quadratic V below which V falls: proved from inside, refuted outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat

from nlctl.expressions.derivatives import tangents
from nlctl.expressions.graph import Expr, Graph
from nlctl.native.enclosures.boxes import BoxCode, enclosed
from nlctl.native.enclosures.divide import BoxVerdict, decide_claim

from ...intervals.box import Box, face_of_box
from ...intervals.exact_matrices import exact_matrix, is_positive_definite
from .motion import StateRates

_STRICT = 1e-9  # V' < 0 is proved as V' <= -1e-9 where V is not small
_FACE = 20_000  # boxes on a face
_SMALLEST = 2.0**-40  # of the level that fits into the box: an inner set below it is none
_INSIDE = 1 - 1e-6  # of that level, so that the faces can be proved


@dataclass(frozen=True, kw_only=True)
class Quadratic:
    """V = (x - at)^T P (x - at) along a motion."""

    motion: StateRates
    P: np.ndarray  # (n, n)
    at: np.ndarray  # (n,)
    # positive at once where V' > -1e-9, V <= level and V >= floor: the sides are the states,
    # then level and floor
    falls: BoxCode
    inside: BoxCode  # level - V, of the same sides

    def largest_in(self, box: Box) -> float:
        """Return the largest level whose set lies in a box, to rounding."""
        reach = np.minimum(np.array(box.high) - self.at, self.at - np.array(box.low))
        return float(np.min(reach**2 / np.diag(np.linalg.inv(self.P))))

    @property
    def size(self) -> float:
        """Volume of {V <= 1}, but for a factor."""
        return float(np.linalg.det(self.P) ** -0.5)


def quadratic_of(motion: StateRates, P: np.ndarray, at: np.ndarray) -> Quadratic:
    """Return V with the code of what is claimed about it."""
    graph, rates, leaves = motion.in_graph(more=2)
    n = motion.order
    level, floor = leaves[n:]
    V = _form(graph, P, at, leaves[:n])
    (rate,) = tangents(graph, [V], lambda e: rates[e.data[1]] if e.data[1] < n else None)
    assert rate is not None
    rise = graph.op("add", rate, graph.const(_STRICT))
    below, above = graph.op("sub", level, V), graph.op("sub", V, floor)
    return Quadratic(
        motion=motion,
        P=P,
        at=at,
        falls=enclosed([rise, below, above], n + 2, fixed=2),
        inside=enclosed([below], n + 2, fixed=2),
    )


def _form(graph: Graph, P: np.ndarray, at: np.ndarray, x: list[Expr]) -> Expr:
    op, n = graph.op, len(x)
    z = [op("sub", one, graph.const(float(a))) for one, a in zip(x, at, strict=True)]
    total = graph.const(0.0)
    for i in range(n):
        for j in range(i, n):
            factor = float(P[i, i] if i == j else P[i, j] + P[j, i])
            if factor:
                product = op("mul", z[i], z[j])
                total = op("add", total, op("mul", graph.const(factor), product))
    return total


@dataclass(frozen=True, kw_only=True)
class ProvedLevel:
    """What is known of the levels of one V."""

    V: Quadratic
    level: float  # proved; 0 where nothing is
    floor: float  # below it the linear part decides
    # a level that is not proved, as near as was asked for; that of the box where all below is
    above: float
    refuted: np.ndarray | None  # a point with V' >= 0, to rounding, and V <= `above`
    boxes: int
    reason: str  # why there is nothing beyond `level`

    @property
    def volume(self) -> float:
        """Of the proved set, but for a factor."""
        return float(self.level ** (self.V.motion.order / 2) * self.V.size)


def largest_level(V: Quadratic, box: Box, tol: float, max_boxes: int) -> ProvedLevel:
    """Return the largest level that is proved, to a relative tolerance."""
    is_definite = is_positive_definite(exact_matrix(V.P))
    fits = V.largest_in(box) * _INSIDE if is_definite else 0.0
    low, boxes = _floor(V, fits, box) if is_definite else 0.0, 0
    nothing = {"V": V, "level": 0.0, "floor": low, "above": fits, "refuted": None}
    if low == 0.0:
        return ProvedLevel(**nothing, boxes=0, reason="the linear part decides nothing next to it")
    if not _holds(V, fits, box):
        return ProvedLevel(**nothing, boxes=0, reason="the box does not hold a level set")
    floor, high, trial = low, fits, fits
    refuted, reason = None, "the box: take a larger one"
    while True:
        fall = _fall(V, trial, floor, box, max_boxes)
        boxes += fall.boxes
        if fall.holds:
            low = trial
        else:
            high, (refuted, reason) = trial, _not_proved(V, fall, trial, floor, box, max_boxes)
        if low >= fits or high - low <= tol * low:
            break
        trial = 0.5 * (low + high) if high < 4 * low else float(np.sqrt(low * high))
    level = low if low > floor else 0.0
    return ProvedLevel(
        V=V, level=level, floor=floor, above=high, refuted=refuted, boxes=boxes, reason=reason
    )


def _fall(
    V: Quadratic, level: float, floor: float, box: Box, max_boxes: int, bound: float = 0.0
) -> BoxVerdict:
    """Return whether V' < 0 between two levels, on the box: it holds the level set."""
    numbers = level, floor
    return decide_claim(V.falls, box.low, box.high, bound, max_boxes=max_boxes, numbers=numbers)


def _not_proved(
    V: Quadratic, fall: BoxVerdict, level: float, floor: float, box: Box, max_boxes: int
) -> tuple[np.ndarray | None, str]:
    """Return a point where V does not fall, if there is one, and what is to be said of a level."""
    if fall.holds is None:
        return None, "undecided: raise max_boxes"
    n, there = V.motion.order, fall.point[None]
    least, most = (ends[0, 0] for ends in V.falls.values(there, there))  # of V' + 1e-9
    if least >= _STRICT:
        return fall.point[:n], "V' >= 0 at a point"
    rises = _fall(V, level, floor, box, max_boxes, _STRICT)  # a point where V' > 0
    if rises.holds is False:
        return rises.point[:n], "V' >= 0 at a point"
    if most < _STRICT:
        return None, "undecided: V' is above -1e-9 at a point, and below 0: scale P up"
    return fall.point[:n], "V' is 0 to rounding at a point"


def _holds(V: Quadratic, level: float, box: Box) -> bool:
    """Whether V > level on every face of a box, so that nothing leaves the level set there."""
    for i in range(V.motion.order):
        for end in box.cell[i]:
            ends = face_of_box(box, i, end)
            numbers = level, 0.0
            face = decide_claim(
                V.inside, ends.low, ends.high, 0.0, max_boxes=_FACE, numbers=numbers
            )
            if not face.holds:
                return False
    return True


def _floor(V: Quadratic, fits: float, box: Box) -> float:
    """Return a level below which V' < 0 follows from the Jacobian alone; 0 for none."""
    # f(x) = J (x - at) with J among the Jacobians of the segment, so that V' < 0 where P J + J^T P
    # is negative definite for all of them.
    level = fits * 0.25
    while level > fits * _SMALLEST:
        reach = reach_of_level(V.P, level)
        low, high = np.maximum(V.at - reach, box.low), np.minimum(V.at + reach, box.high)
        ends = V.motion.slopes.values(low[None], high[None])
        if np.all(np.isfinite(ends)) and _is_negative(V.P, *(e[0] for e in ends)):
            return level
        level /= 4
    return 0.0


def reach_of_level(P: np.ndarray, level: float) -> np.ndarray:
    """Return how far z^T P z <= level reaches along each axis, and a little more: not less."""
    # An inverse in floats may be off by more than any little.
    inverse = exact_matrix(P).inv()
    squares = (arb(inverse[i, i]) * arb(level) for i in range(len(P)))
    return np.array([float(square.sqrt().upper()) for square in squares]) * (1 + 1e-6)


def _is_negative(P: np.ndarray, low: np.ndarray, high: np.ndarray) -> bool:
    """Whether P J + J^T P is negative definite for all J between two: by Cholesky's pivots."""
    n = len(P)
    J = arb_mat(n, n, [arb(float(a)).union(arb(float(b))) for a, b in zip(low, high, strict=True)])
    S = arb_mat(n, n, [float(v) for v in P.ravel()]) * J
    rest = [[-(S[i, j] + S[j, i]) for j in range(n)] for i in range(n)]
    for k in range(n):
        if not rest[k][k] > 0:
            return False
        for i in range(k + 1, n):
            factor = rest[i][k] / rest[k][k]
            for j in range(i, n):
                rest[i][j] = rest[i][j] - factor * rest[k][j]
                rest[j][i] = rest[i][j]
    return True
