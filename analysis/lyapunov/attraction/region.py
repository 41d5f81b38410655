"""A region of attraction: a set from which everything goes to an equilibrium, proved."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat
from scipy.linalg import solve_continuous_lyapunov

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.expressions.derivatives import tangents
from nlctl.expressions.graph import Expr, Graph
from nlctl.native.enclosures.boxes import BoxCode, enclosed
from nlctl.native.enclosures.divide import BoxVerdict, decide_claim
from nlctl.upstream.systems import System
from nlctl.wording import counted

from ...intervals.box import Box, face_of_box
from ...intervals.branch_and_bound import point_text
from ...intervals.normal_form import exact_matrix, is_positive_definite
from ...recheck.integers import text_above, text_below
from ..convex import at_least, at_most, minimizer, symmetric_basis
from ..proofs.kind import ProofKind
from ..proofs.result import ProofResult
from .motion import StateRates, motion_of

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


_AT_REST = 1e-9  # of the rates at an equilibrium
_ROUNDS = 3  # of proposals that grow


@described_record(made_by="region_of_attraction")
class AttractionRegion(ProofResult):
    """A set {(x - at)^T P (x - at) <= level} from which everything goes to `at`."""

    names: tuple[str, ...]  # States.
    at: np.ndarray  # (n,): The equilibrium, where |f| <= 1e-9: what is proved takes it for one.
    P: np.ndarray  # (n, n)
    level: float  # Proved; 0 where nothing is.
    above: float  # The least level that was tried and is not proved.
    refuted: dict[str, float] | None  # A point with V <= `above` where V does not fall.
    # Down to it V' <= -1e-9 is proved by enclosures, below it by those of the Jacobian.
    floor: float
    box: Box  # Where was looked.
    # What proved it.
    arithmetic: str = "floats rounded outwards, balls for the linear part"

    @property
    def claim(self) -> str:
        """What is proved, in words."""
        if not self.holds:
            return "no region of attraction is proved"
        return f"from V <= {text_below(self.level)} everything goes to the equilibrium"

    def value(self, x: Sequence[float]) -> float:
        """Return V at a state.

        Parameters
        ----------
        x : sequence of n floats
            A value of every state.

        Returns
        -------
        float
            V there, rounded as any number.
        """
        z = np.asarray(x, dtype=float) - self.at
        return float(z @ self.P @ z)

    def __str__(self) -> str:
        if not self.holds:
            return f"undecided: {self.reason}"
        where = f", {point_text(self.refuted)}" if self.refuted else ""
        more = "more" if self.above == self.level else text_above(self.above)
        how = counted(self.boxes, "box", "boxes")
        end = f"{more} is not: {self.reason}{where}"
        return f"V <= {text_below(self.level)} proved on {how}; {end}"


@as_annotated
def region_of_attraction(
    system: System,
    box: Box,
    *,
    P: object = None,
    at: Sequence[float] | None = None,
    params: Mapping[str, Any] | None = None,
    tol: float = 1e-4,
    max_boxes: int = 1_000_000,
) -> AttractionRegion:
    """Prove a region of attraction of an equilibrium: an ellipsoid, as large as can be.

    V = (x - at)^T P (x - at) is given, or proposed: by Lyapunov's equation of the linear part, then
    by semidefinite programs for V to fall at samples of larger sets.  That V falls everywhere in
    the set is proved: near the equilibrium by the Jacobian's enclosure, elsewhere by branch and
    bound.

    Parameters
    ----------
    system : control.InputOutputSystem or callable
        A diagram, whose external inputs are 0; or ``function((x1, ..., xn)) -> (x1', ..., xn')``.
    box : Box
        Where to look, with a side for every state in their order.  The region lies in it.
    P : array_like of shape (n, n), optional
        Symmetric and positive definite.
    at : sequence of n floats, optional
        The equilibrium; 0 by default.
    params : mapping, optional
        Overrides of a diagram.
    tol : float, optional
        The level is found to this, relative to it.
    max_boxes : int, optional
        For each level that is tried.

    Returns
    -------
    AttractionRegion
        Proved, or undecided.

    Raises
    ------
    ParameterError
        If the rates cannot be read, jump, or do not vanish at `at`; if the linear part is not
        stable, `P` is not positive definite, or the box has other sides.
    CompileError
        If the diagram cannot be compiled.

    Examples
    --------
    Van der Pol's oscillator in reversed time (Khalil, Example 8.9), where this V falls up to 2.3:

    >>> from nlctl.analysis.lyapunov import Box, region_of_attraction
    >>> found = region_of_attraction(
    ...     lambda x: (-x[1], x[0] + (x[0] ** 2 - 1) * x[1]),
    ...     Box.of(x1=(-3, 3), x2=(-3, 3)),
    ...     P=[[1.5, -0.5], [-0.5, 1.0]],
    ... )
    >>> print(found.status, round(found.level, 2))
    proved 2.3
    """
    box = of_type("region_of_attraction", "box", box, Box, "Box.of(x1=(-1, 1))")
    max_boxes = integer("region_of_attraction", "max_boxes", max_boxes, at_least=1)
    if not 0 < tol < 1:
        raise ParameterError(f"region_of_attraction needs 0 < tol < 1, got {tol}")
    start = time.perf_counter()
    motion = motion_of("region_of_attraction", system, box, params)
    point = _equilibrium(motion, at, box)
    A = motion.jacobian(point)
    _check_linear_part(A)
    given = None if P is None else _positive_definite(P, motion.order)
    first = from_linear_part(A) if given is None else given
    best = largest_level(quadratic_of(motion, first, point), box, tol, max_boxes)
    boxes = best.boxes
    if given is None:
        best, more = _grown(best, box, tol, max_boxes)
        boxes += more
    where = None
    if best.refuted is not None:
        where = dict(zip(motion.names, map(float, best.refuted), strict=True))
    return AttractionRegion(
        names=motion.names, at=point, P=best.V.P, level=best.level, above=best.above,
        refuted=where, holds=best.level > 0, reason=best.reason, floor=best.floor, box=box,
        boxes=boxes, seconds=time.perf_counter() - start,
    )  # fmt: skip


def _grown(best: ProvedLevel, box: Box, tol: float, max_boxes: int) -> tuple[ProvedLevel, int]:
    """Return the largest set of those that are proposed, and the boxes that it has cost."""
    boxes = 0
    for _ in range(_ROUNDS):
        if not best.level:
            break
        before = best
        for P in fitted(best.V.motion, best.V.at, before.V.P, before.level):
            trial = largest_level(quadratic_of(best.V.motion, P, best.V.at), box, tol, max_boxes)
            boxes += trial.boxes
            best = trial if trial.volume > best.volume else best
        if best.volume <= 1.01 * before.volume:
            break
    return best, boxes


def _equilibrium(motion: StateRates, at: Sequence[float] | None, box: Box) -> np.ndarray:
    """Return where nothing moves, inside of the box; the rates may not jump."""
    point = np.zeros(motion.order) if at is None else np.asarray(at, dtype=float)
    if point.shape != (motion.order,):
        raise ParameterError(
            f"region_of_attraction needs at with {counted(motion.order, 'number')}, got {at}"
        )
    if motion.jumps:
        raise ParameterError(
            "region_of_attraction needs rates that do not jump: write cases as np.minimum, "
            "np.maximum, np.clip or abs"
        )
    rates = motion.at(point[None])[0]
    if not np.all(np.abs(rates) <= _AT_REST):
        raise ParameterError(
            f"region_of_attraction needs an equilibrium, and the rates are {rates} at {point}: "
            "give another one as at="
        )
    if not (np.all(point > box.low) and np.all(point < box.high)):
        raise ParameterError(f"region_of_attraction needs {point} inside of the box, {box}")
    return point


def _check_linear_part(A: np.ndarray) -> None:
    if not np.all(np.isfinite(A)) or not np.all(np.linalg.eigvals(A).real < 0):
        raise ParameterError(
            "region_of_attraction needs a linear part that is stable: its eigenvalues are "
            f"{np.linalg.eigvals(A) if np.all(np.isfinite(A)) else A}"
        )


def _positive_definite(P: object, n: int) -> np.ndarray:
    """Return a matrix that the user has given."""
    matrix = np.asarray(P, dtype=float)
    symmetric = matrix.shape == (n, n) and np.array_equal(matrix, matrix.T)
    finite = symmetric and bool(np.all(np.isfinite(matrix)))
    if not finite or not is_positive_definite(exact_matrix(matrix)):
        raise ParameterError(
            f"region_of_attraction needs P symmetric and positive definite, {n} x {n}, got "
            f"{str(P)[:60]}"
        )
    return matrix


ATTRACTION = ProofKind(
    name="region of attraction",
    about="an equilibrium with a stable linear part",
    result=AttractionRegion,
    find="region_of_attraction",
)


_SAMPLES = 400
_RATE = 1e-3  # V' <= -1e-3 |x|^2 at samples, for P >= 1


def from_linear_part(A: np.ndarray) -> np.ndarray:
    """Return P of A^T P + P A = -1, symmetric; shapes: `A` (n, n)."""
    P = solve_continuous_lyapunov(A.T, -np.eye(len(A)))
    return 0.5 * (P + P.T)


def fitted(motion: StateRates, at: np.ndarray, P: np.ndarray, level: float) -> Iterator[np.ndarray]:
    """Yield P for which V falls at samples of sets larger than (x - at)^T P (x - at) <= level."""
    # The program is convex: V' = 2 (x - at)^T P f(x) is linear in P. Of all P >= 1 that fall at the
    # samples and along the linear part, the one with the largest set is taken, as measured by the
    # trace of P times that of the set before.
    # Shapes: `at` (n,), `P` (n, n).
    n, rng, basis = len(P), np.random.default_rng(0), symmetric_basis(len(P))
    root = np.linalg.inv(np.linalg.cholesky(P / level)).T  # maps the unit ball onto the set
    directions = rng.standard_normal((_SAMPLES, n))
    unit = directions / np.linalg.norm(directions, axis=1)[:, None]
    unit *= rng.uniform(0.3, 1.0, _SAMPLES)[:, None] ** (1 / n)
    A = motion.jacobian(at)
    for factor in (1.15, 1.4, 2.0):
        z = factor * unit @ root.T
        rates = motion.at(at + z)
        finite = np.all(np.isfinite(rates), axis=1)
        square = np.sum(z[finite] ** 2, axis=1)
        falls = [2 * np.einsum("ki,ij,kj->k", z[finite], E, rates[finite]) for E in basis]
        limits = [
            at_least(basis, np.eye(n)),
            at_least([-(A.T @ E + E @ A) for E in basis], _RATE * np.eye(n)),
            at_most(np.column_stack(falls), -_RATE * square),
        ]
        size = np.array([np.trace(root.T @ E @ root) for E in basis])
        x, _ = minimizer(np.zeros((len(basis), len(basis))), size, limits)
        if x is None:
            return
        yield np.tensordot(x, np.array(basis), 1)
