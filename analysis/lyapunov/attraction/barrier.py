"""A barrier: a function that no trajectory from a set of starts carries above 0, proved."""

import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial, reduce
from typing import Any

import numpy as np
from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.expressions.derivatives import tangents
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Expr, Graph, Untraceable
from nlctl.native.enclosures.boxes import BoxCode, enclosed, expressions_of
from nlctl.native.enclosures.divide import decide_claim
from nlctl.upstream.systems import System
from nlctl.wording import counted

from ...intervals.box import Box, face_of_box
from ..proofs.kind import ProofKind
from ..proofs.result import ProofResult
from .motion import StateRates, motion_of
from .squares import PositiveCondition, Term, monomial_terms, polynomials_of, positive_where

__all__ = ["inequality_of", "safe_everywhere"]

_DECAYS = ((1, 1), (1, 3), (3, 1), (1, 10), (10, 1))  # k of B' + k B < 0


def inequality_of(function: Callable[[Any], Any], sides: int) -> Expr:
    """Return the expression of a set, which is where it is not negative."""
    numbers = expressions_of(function, sides)[1]
    if len(numbers) != 1:
        raise Untraceable(f"one number has to be >= 0 in a set, not {len(numbers)}")
    return numbers[0]


def safe_everywhere(
    motion: StateRates, box: Box, start: object, unsafe: Sequence[Any], degree: int, max_boxes: int
) -> dict[str, Any]:
    """Prove it by sums of squares; there are no boxes."""
    ring = fmpq_mpoly_ctx.get(motion.names, Ordering.lex)
    try:
        rates = polynomials_of(motion.rates, ring)
        begins, *bad = (_where(ring, one) for one in (start, *unsafe))
    except Untraceable as error:
        raise ParameterError(
            f"barrier needs polynomials where the box is infinite, got another function ({error}): "
            "give a finite box"
        ) from None
    terms = monomial_terms(len(rates), degree)
    parts = [ring.from_dict({term: 1}) for term in terms]
    along = [sum((p.derivative(i) * f for i, f in enumerate(rates)), p * 0) for p in parts]
    apart = [PositiveCondition(parts=[-p for p in parts], where=begins)]
    apart += [PositiveCondition(parts=parts, where=where) for where in bad]
    coefficients, reason = None, ""
    for k in _DECAYS:
        falls = [-slope - fmpq(*k) * p for p, slope in zip(parts, along, strict=True)]
        coefficients, reason = positive_where([*apart, PositiveCondition(parts=falls)], len(parts))
        if coefficients is not None:
            break
    numbers = [float(c.p) / float(c.q) for c in coefficients or [fmpq(0)] * len(parts)]
    return {
        "middle": np.zeros(len(rates)), "half": np.ones(len(rates)), "terms": tuple(terms),
        "coefficients": np.array(numbers), "reason": reason and f"{reason}: raise degree",
        "boxes": 0, "arithmetic": "rational numbers",
    }  # fmt: skip


def _where(ring: fmpq_mpoly_ctx, one: Any) -> list[fmpq_mpoly]:
    """Return polynomials that are not negative in a set."""
    if callable(one):
        return polynomials_of([inequality_of(one, ring.nvars())], ring)
    ends = [[fmpq(*float(v).as_integer_ratio()) for v in side] for side in one.cell]
    return [(ring.gen(i) - a) * (b - ring.gen(i)) for i, (a, b) in enumerate(ends)]


_BOUND = 1e300  # of rates: below it they are numbers
_STRICT = 1e-9  # B' < 0 and B > 0 are proved with this margin
_RATES = (0.0, 1.0, -1.0, 5.0)  # k of the proposals' B' + k B < 0
_ROUNDS = 60  # proposals for each of them
_SAMPLES = 300  # in each set
_POOL = 20_000  # points of the box among which a proposal is looked for mistakes first
_BAND = 0.02  # of the largest |B|, within which it counts as 0 there
_ADDED = 40  # of these in a round
_FALLS = "B' < 0 where B = 0"
_StateFunction = Callable[[Any], Any]


@described_record(made_by="barrier")
class Barrier(ProofResult):
    """A polynomial B with B <= 0 at all starts, B > 0 in all that is unsafe, B' < 0 where B = 0.

    No trajectory from a start comes to what is unsafe, or leaves the box, at any time.  In a box
    all of them exist for all time; in all of space one may escape to infinity, safe until then.
    """

    names: tuple[str, ...]  # States.
    middle: np.ndarray  # (n,): B is a polynomial in z = (x - middle) / half.
    half: np.ndarray
    terms: tuple[Term, ...]  # Powers of z in each term.
    coefficients: np.ndarray  # Of the terms.
    box: Box  # Where was looked.
    arithmetic: str = "floats rounded outwards"  # What proved it.

    @property
    def claim(self) -> str:
        """What is proved, in words."""
        if not self.holds:
            return "no barrier is proved"
        bounded = bool(np.isfinite(self.box.cell).all())
        return "safe for all time" if bounded else "safe as long as solutions exist"

    def value(self, x: Sequence[float]) -> float:
        """Return B at a state.

        Parameters
        ----------
        x : sequence of n floats
            A value of every state.

        Returns
        -------
        float
            B there, rounded as any number.
        """
        z = (np.asarray(x, dtype=float) - self.middle) / self.half
        return float(_monomials(z[None], self.terms)[0] @ self.coefficients)

    def __str__(self) -> str:
        if not self.holds:
            return f"undecided: {self.reason}"
        how = f"on {counted(self.boxes, 'box', 'boxes')}" if self.boxes else "by sums of squares"
        return f"{self.claim}: proved {how}"


@dataclass(frozen=True, kw_only=True)
class _Claim:
    """Numbers that are not positive at once on a box, and which samples a refutation adds to.

    `matters` says at which points the others than B are positive.
    """

    code: BoxCode
    box: Box
    kind: str
    what: str
    matters: Callable[[np.ndarray], np.ndarray] | None = None


@dataclass(frozen=True, kw_only=True)
class _SetInBox:
    """A set: a box, or where an expression of the states is not negative there."""

    box: Box
    inside: Expr | None = None

    @staticmethod
    def of(one: Any, box: Box) -> "_SetInBox":
        """Read a set that somebody has given."""
        if not callable(one):
            return _SetInBox(box=one)
        try:
            return _SetInBox(box=box, inside=inequality_of(one, len(box.names)))
        except Untraceable as error:
            raise ParameterError(f"barrier needs sets that can be read: {error}") from None

    @property
    def at(self) -> Callable[[np.ndarray], np.ndarray] | None:
        """The values of the expression at points, of shape (points, states)."""
        if (inside := self.inside) is None:
            return None
        return lambda x: np.resize(evaluate_expressions([inside], {"x": x.T})[0], len(x))


@dataclass(kw_only=True)
class _Problem:
    """What is to be kept apart, and the samples at which proposals do so."""

    motion: StateRates
    box: Box
    terms: tuple[Term, ...]
    middle: np.ndarray
    half: np.ndarray
    claims: list[_Claim] = field(default_factory=list)
    samples: dict[str, np.ndarray] = field(default_factory=dict)
    pool: np.ndarray = field(default_factory=lambda: np.zeros((0, 1)))

    @cached_property
    def on_pool(self) -> tuple[np.ndarray, np.ndarray]:
        """The terms at the points of the pool, and their rates."""
        z = (self.pool - self.middle) / self.half
        return _monomials(z, self.terms), _rates_of_terms(self, self.pool)


@as_annotated
def barrier(
    system: System,
    box: Box,
    *,
    start: Box | _StateFunction,
    unsafe: Box | _StateFunction | Sequence[Box | _StateFunction] = (),
    degree: int = 2,
    params: Mapping[str, Any] | None = None,
    max_boxes: int = 1_000_000,
) -> Barrier:
    """Prove that nothing from a set of starts gets where it must not, or leaves a box.

    In a box a polynomial B is proposed by linear programs on samples, B' + k B < 0 being linear in
    its coefficients: of points where the last proposal was 0 and rose.  What refutes a proposal
    becomes a sample of the next.  Proved is less than what is proposed: B <= 0 at the starts, B > 0
    in what is unsafe and where trajectories leave the box, B' < 0 where B = 0, and that rates have
    values where B <= 0.

    Where every side of the box is infinite, nothing is left: rates and sets have to be polynomials,
    and B <= 0, B > 0 and B' + k B < 0 everywhere are found as sums of squares, by one semidefinite
    program for each k that is tried, and proved by rational numbers.

    Parameters
    ----------
    system : control.InputOutputSystem or callable
        A diagram, whose external inputs are 0; or ``function((x1, ..., xn)) -> (x1', ..., xn')``.
    box : Box
        Where it is to stay, with a side for every state in their order; or all of them infinite.
    start : Box or callable
        Initial states: a box, or where ``function((x1, ..., xn))`` is not negative.
    unsafe : Box, callable or sequence of these, optional
        What is not to be met, besides the outside of `box`.
    degree : int, optional
        Of the polynomial; even ones enclose sets.
    params : mapping, optional
        Overrides of a diagram.
    max_boxes : int, optional
        For each claim.

    Returns
    -------
    Barrier
        Proved, or undecided: that none was found says nothing.

    Raises
    ------
    ParameterError
        If the rates or a set cannot be read, a box has other sides, or some infinite ones; if
        `degree` is below 1, `start` does not lie in the box, or there is no polynomial where the
        box is infinite.
    CompileError
        If the diagram cannot be compiled.

    Examples
    --------
    A damped oscillator from around (1, 0) never comes to x1 < -0.95:

    >>> from nlctl.analysis.lyapunov import Box, barrier
    >>> found = barrier(
    ...     lambda x: (x[1], -x[0] - x[1]),
    ...     Box.of(x1=(-3, 3), x2=(-3, 3)),
    ...     start=Box.of(x1=(0.9, 1.1), x2=(-0.1, 0.1)),
    ...     unsafe=Box.of(x1=(-3, -0.95), x2=(-3, 3)),
    ... )
    >>> print(found.status)
    proved

    From a disc around (1.5, 0), and so from both sides of a saddle, never to one around (-1, -1)
    (Prajna and Jadbabaie, 2004):

    >>> whole = Box.of(x1=(-np.inf, np.inf), x2=(-np.inf, np.inf))
    >>> found = barrier(
    ...     lambda x: (x[1], -x[0] + x[0] ** 3 / 3 - x[1]),
    ...     whole,
    ...     start=lambda x: 0.25 - (x[0] - 1.5) ** 2 - x[1] ** 2,
    ...     unsafe=lambda x: 0.16 - (x[0] + 1) ** 2 - (x[1] + 1) ** 2,
    ...     degree=4,
    ... )
    >>> print(found)
    safe as long as solutions exist: proved by sums of squares
    """
    box = of_type("barrier", "box", box, Box, "Box.of(x1=(-1, 1))")
    degree = integer("barrier", "degree", degree, at_least=1)
    max_boxes = integer("barrier", "max_boxes", max_boxes, at_least=1)
    unsafe = [unsafe] if isinstance(unsafe, Box) or callable(unsafe) else list(unsafe)
    _check_boxes(box, start, unsafe)
    begun = time.perf_counter()
    whole = not np.isfinite(box.cell).any()
    motion = motion_of("barrier", system, box, params, is_finite=not whole)
    find = safe_everywhere if whole else _in_the_box
    polynomial = find(motion, box, start, unsafe, degree, max_boxes)
    return Barrier(
        names=motion.names, box=box, holds=not polynomial["reason"],
        seconds=time.perf_counter() - begun, **polynomial,
    )  # fmt: skip


def _check_boxes(box: Box, start: Any, unsafe: Sequence[Any]) -> None:
    for name, one in (("start", start), *(("unsafe", u) for u in unsafe)):
        if callable(one):
            continue
        of_type("barrier", name, one, Box, "Box.of(x1=(-1, 1)) or a function of the states")
        if one.names != box.names or not np.all(np.isfinite(one.cell)):
            raise ParameterError(
                f"barrier needs {name} with the finite sides {', '.join(box.names)}, got {one}"
            )
    if np.isfinite(box.cell).any() and not np.isfinite(box.cell).all():
        raise ParameterError(
            f"barrier needs a box with sides all finite or all infinite, got {box}"
        )
    if callable(start):
        return
    within = zip(box.cell, start.cell, strict=True)
    if not all(a <= c and d <= b for (a, b), (c, d) in within):
        raise ParameterError(f"barrier needs start inside of the box, got {start} and {box}")


def _in_the_box(
    motion: StateRates, box: Box, start: object, unsafe: Sequence[Any], degree: int, max_boxes: int
) -> dict[str, Any]:
    problem = _problem(motion, box, start, unsafe, degree)
    coefficients, boxes, reason = np.zeros(len(problem.terms)), 0, ""
    for k in _RATES:
        coefficients, n, reason = _attempt(problem, k, max_boxes)
        boxes += n
        if not reason:
            break
    return {
        "middle": problem.middle, "half": problem.half, "terms": problem.terms,
        "coefficients": coefficients, "reason": reason, "boxes": boxes,
    }  # fmt: skip


def _problem(
    motion: StateRates, box: Box, start: object, unsafe: Sequence[Any], degree: int
) -> _Problem:
    n = motion.order
    terms = tuple(monomial_terms(n, degree))
    low, high = np.array(box.low), np.array(box.high)
    problem = _Problem(
        motion=motion, box=box, terms=terms, middle=0.5 * (low + high), half=0.5 * (high - low)
    )
    sets = [_SetInBox.of(one, box) for one in (start, *unsafe)]
    also = [one.inside for one in sets if one.inside is not None]
    graph, (*rates,), leaves = motion.in_graph(more=len(terms), also=also)
    inside = iter(rates[n:])
    B, rate = _polynomial(graph, rates, leaves, problem)
    op, margin, sides = graph.op, graph.const(_STRICT), n + len(terms)
    code = lambda *exprs: enclosed(list(exprs), sides, fixed=len(terms))  # noqa: E731
    below = op("sub", margin, B)
    rises = op("add", rate, margin)
    band = [op("add", B, margin), below]
    claims = problem.claims

    for i, one in enumerate(sets):
        within = [] if one.inside is None else [op("add", next(inside), margin)]
        kind, what = (
            ("unsafe", "B > 0 in what is unsafe") if i else ("start", "B <= 0 at the starts")
        )
        wrong = code(below if i else B, *within)
        claims.append(_Claim(code=wrong, box=one.box, kind=kind, what=what, matters=one.at))
    for i, end in itertools.product(range(n), (0, 1)):
        speed, sign = (lambda x, i=i: motion.at(x)[:, i]), 1 if end else -1
        outwards = op("add", rates[i] if end else op("neg", rates[i]), margin)
        claims.append(_Claim(
            code=code(below, outwards), box=face_of_box(box, i, box.cell[i][end]), kind="unsafe",
            what=f"B > 0 where {motion.names[i]} leaves the box",
            matters=lambda x, speed=speed, sign=sign: sign * speed(x),
        ))  # fmt: skip
    claims.append(_Claim(code=code(rises, *band), box=box, kind="inside", what=_FALLS))
    _first_samples(problem)
    size = reduce(partial(op, "add"), map(partial(op, "absolute"), rates[:n]))
    exist = code(op("sub", size, graph.const(_BOUND)), op("neg", B))
    claims.append(_Claim(code=exist, box=box, kind="unsafe", what="rates have values where B <= 0"))
    return problem


def _polynomial(
    graph: Graph, rates: Sequence[Expr], leaves: Sequence[Expr], problem: _Problem
) -> tuple[Expr, Expr]:
    """Return B and its rate; the coefficients are sides of the box."""
    op, n = graph.op, problem.motion.order
    z = [
        op("div", op("sub", leaf, graph.const(float(m))), graph.const(float(h)))
        for leaf, m, h in zip(leaves, problem.middle, problem.half, strict=False)
    ]
    B = graph.const(0.0)
    for coefficient, term in zip(leaves[n:], problem.terms, strict=True):
        product = coefficient
        for one, power in zip(z, term, strict=True):
            product = op("mul", product, graph.power(one, power)) if power else product
        B = op("add", B, product)
    (rate,) = tangents(graph, [B], lambda e: rates[e.data[1]] if e.data[1] < n else None)
    return B, graph.const(0.0) if rate is None else rate


def _first_samples(problem: _Problem) -> None:
    """Take corners and random points of each set; of faces those where the motion leaves."""
    rng = np.random.default_rng(0)
    samples: dict[str, list[np.ndarray]] = {"start": [], "unsafe": []}
    for claim in problem.claims[:-1]:
        corners = np.array(list(itertools.islice(itertools.product(*claim.box.cell), 64)))
        low, high = np.array(claim.box.low), np.array(claim.box.high)
        count = _SAMPLES if claim.matters is None else _POOL
        points = np.concatenate([corners, rng.uniform(low, high, (count, len(low)))])
        if claim.matters is not None:
            points = points[claim.matters(points) >= 0][:_SAMPLES]
        samples[claim.kind].append(points)
    problem.samples = {kind: np.concatenate(parts) for kind, parts in samples.items()}
    problem.pool = rng.uniform(problem.box.low, problem.box.high, (_POOL, problem.motion.order))


def _attempt(problem: _Problem, k: float, max_boxes: int) -> tuple[np.ndarray, int, str]:
    """Propose and refute in turn; return coefficients, boxes, and what is missing."""
    boxes, reason, none = 0, "", np.zeros(len(problem.terms))
    problem.samples["inside"] = problem.pool[:0]
    for _ in range(_ROUNDS):
        coefficients = _proposal(problem, k)
        if coefficients is None:
            return none, boxes, f"no polynomial keeps samples apart: {reason or 'raise degree'}"
        if _mistakes(problem, coefficients):
            continue
        reason = ""
        for claim in problem.claims:
            decision = decide_claim(
                claim.code, claim.box.low, claim.box.high, 0.0, max_boxes=max_boxes,
                numbers=coefficients,
            )  # fmt: skip
            boxes += decision.boxes
            if decision.holds:
                continue
            reason = reason or claim.what
            points = problem.samples[claim.kind]
            added = decision.point[: problem.motion.order]
            problem.samples[claim.kind] = np.concatenate([points, added[None]])
        if not reason:
            return coefficients, boxes, ""
    return none, boxes, f"not proved: {reason or _FALLS}"  # what mistakes are of


def _mistakes(problem: _Problem, coefficients: np.ndarray) -> bool:
    """Add points of the pool where B is 0 and does not fall to the samples, if there are any."""
    values, rates = (m @ coefficients for m in problem.on_pool)
    near = np.abs(values) <= _BAND * np.max(np.abs(values))
    wrong = np.flatnonzero(near & (rates >= 0))
    chosen = wrong[:: max(1, len(wrong) // _ADDED)]
    inside = problem.samples["inside"]
    problem.samples["inside"] = np.concatenate([inside, problem.pool[chosen]])
    return bool(len(wrong))


def _monomials(z: np.ndarray, terms: Sequence[Term]) -> np.ndarray:
    """Return the terms at points, shape (points, terms)."""
    return np.stack([np.prod(z ** np.array(term), axis=1) for term in terms], axis=1)


def _rates_of_terms(problem: _Problem, points: np.ndarray) -> np.ndarray:
    """Return how fast each term changes along the motion."""
    z = (points - problem.middle) / problem.half
    speed = problem.motion.at(points) / problem.half
    total = np.zeros((len(points), len(problem.terms)))
    for i in range(points.shape[1]):
        lower = [tuple(p - (j == i) for j, p in enumerate(t)) for t in problem.terms]
        kept = [tuple(max(p, 0) for p in t) for t in lower]
        factors = np.array([t[i] for t in problem.terms], dtype=float)
        total += factors * _monomials(z, kept) * speed[:, i : i + 1]
    return total


def _proposal(problem: _Problem, k: float) -> np.ndarray | None:
    """Return coefficients with the largest margin at all samples; None if there is none."""
    from scipy.optimize import linprog

    at = {kind: _monomials((p - problem.middle) / problem.half, problem.terms)
          for kind, p in problem.samples.items()}  # fmt: skip
    falls = _rates_of_terms(problem, problem.samples["inside"]) + k * at["inside"]
    size = np.maximum(np.max(np.abs(falls), axis=1, keepdims=True, initial=0.0), 1e-3)
    rows = np.concatenate([at["start"], -at["unsafe"], falls / size])
    good = np.all(np.isfinite(rows), axis=1)
    apart = len(at["start"]) + len(at["unsafe"])
    margins = np.where(np.arange(len(rows)) < apart, 1.0, 0.1)
    matrix = np.column_stack([rows, margins])[good]
    result = linprog(
        np.append(np.zeros(len(problem.terms)), -1.0), A_ub=matrix, b_ub=np.zeros(len(matrix)),
        bounds=[(-1, 1)] * len(problem.terms) + [(0, 1)], method="highs",
    )  # fmt: skip
    if result.x is None or result.x[-1] <= 1e-7:
        return None
    return result.x[:-1]


BARRIER = ProofKind(
    name="barrier", about="starts and states that are unsafe", result=Barrier, find="barrier"
)
