"""What a kind of proof is: one record, and the iteration that all of those for loops share.

A bound of the loop gives a box that its signals stay in, what is proved on the box gives another
bound, and so on.  If the new bound is below the one that gave the box, then that is never reached:
up to the first time that it was, the signals stayed in the box, and so below the new bound.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import arb

from nlctl.wording import counted

from ...intervals.branch_and_bound import upper
from ...recheck.integers import text_above, text_below
from ..bounds.decomposition import Decomposition, only_declared
from ..loop.checked import Supposed
from .result import Certificate, ProofResult


@dataclass(frozen=True, kw_only=True)
class ProofOptions(Supposed):
    """What `certify` is asked; see there."""

    k: tuple[float, float] | None
    W: Sequence[float] | None
    u_max: float
    tol: float
    max_iterations: int


@dataclass(frozen=True, kw_only=True)
class Subject:
    """What a proof is about, before a box is examined."""

    loop: Any  # the loop as the proof reads it, with its `starts` and `disturbance`
    start: arb  # what is bounded, at the starts
    actuator: Any
    split: Decomposition  # of the actuator, with what external inputs add
    u_max: float  # half the range of u for which the split is proved
    tol: float
    matching: Any = field(default=None, repr=False)  # what else the kind of proof has found


@dataclass(frozen=True, kw_only=True)
class Closed:
    """The last step of the iteration, and its outcome."""

    region: Any
    bound: Any
    iterations: tuple[float, ...]
    u: float
    reason: str
    holds: bool

    def proved(self, value: float) -> float:
        """Return a bound; infinity if nothing is proved."""
        return value if self.holds else float("inf")


@dataclass(frozen=True, kw_only=True, eq=False)
class ProofKind:
    """A kind of proof.

    Those that `certify` knows have all fields; of others the first four say what they are.
    """

    name: str  # as in files and in the recheck: lower-case words
    about: str  # what it is about, in words
    result: type[ProofResult]  # what it finds
    find: str = "certify"  # the function of `nlctl.analysis.lyapunov` that finds it
    fits: Callable[[Any], bool] | None = None  # ``fits(loop)`` says whether a loop is one for it
    takes_W: bool = False  # whether weights may be chosen
    bounded: str = ""  # what is bounded, ``"|r|"``
    # ``begin(loop, options)`` reads a loop and returns the `Subject`
    begin: Callable[[Any, ProofOptions], Subject] | None = None
    # ``region(subject, level)`` returns what the signals stay in below a little more than a level:
    # an object with that bound `C`, its `box`, and the `boxes` and `arithmetic` of proofs
    region: Callable[[Subject, arb], Any] | None = None
    # ``bound(subject, region)`` returns what the region implies: an object with the new `level`,
    # and a `doubt` where there is none
    bound: Callable[[Subject, Any], Any] | None = None
    # ``endless(region, iterations)`` says why the iteration is given up; nothing if it is not
    endless: Callable[[Any, Sequence[float]], str] = lambda region, iterations: ""
    # ``largest_input(subject, region, bound)`` returns a bound of |u|
    largest_input: Callable[[Subject, Any, Any], float] | None = None
    # ``fields(subject, closed)`` returns the fields of `result` that are its own
    fields: Callable[[Subject, Closed], Mapping[str, Any]] | None = None


def certified(kind: Any, loop: Any, options: ProofOptions) -> Certificate:
    """Read a loop, close a box, and say what follows; see `certify`."""
    begun = time.perf_counter()
    subject = kind.begin(loop, options)
    closed = _closed(kind, subject, options.max_iterations)
    return kind.result(
        kind=kind.name,
        name=str(loop.name),
        holds=closed.holds,
        reason=closed.reason,
        starts=subject.loop.starts,
        disturbance=subject.loop.disturbance,
        split=subject.split,
        region=closed.region,
        iterations=closed.iterations,
        boxes=closed.region.boxes,
        arithmetic=closed.region.arithmetic,
        params=dict(options.params or {}),
        loop_facts=dict(subject.loop.content.facts),
        **kind.fields(subject, closed),
        seconds=time.perf_counter() - begun,
    )


def _closed(kind: Any, subject: Subject, max_iterations: int) -> Closed:
    """Iterate bound -> region -> bound until it closes, or must be given up."""
    level, iterations = subject.start, [upper(subject.start)]
    for _ in range(max_iterations):
        region = kind.region(subject, level)
        bound = kind.bound(subject, region)
        iterations.append(upper(bound.level))
        doubt = bound.doubt or kind.endless(region, iterations)
        if doubt or bound.level < arb(region.C):
            break
        level = bound.level
    else:
        steps = counted(max_iterations, "iteration")
        doubt = f"{kind.bounded} still grows after {steps}: {iterations[-1]:.6g}"
    last, u = f"{kind.bounded} <= {text_above(iterations[-1])}", float("inf")
    if not doubt:
        u = kind.largest_input(subject, region, bound)
        doubt = _beyond_the_split(subject, u, last)
    reason = doubt or f"the box closes: {kind.bounded} < {text_below(region.C)} implies {last}"
    return Closed(
        region=region, bound=bound, iterations=tuple(iterations), u=u, reason=reason,
        holds=not doubt,
    )  # fmt: skip


def _beyond_the_split(subject: Subject, u: float, statement: str) -> str:
    """Say why a box that closes proves nothing: the actuator's split need not hold there."""
    if subject.split.provenance == "given":
        return only_declared(statement, subject.actuator)
    far = 2 * subject.u_max
    if subject.split.provenance == "proved" and u > far:
        return f"|u| may reach {u:.4g}, the actuator's split is proved to {far:g}: raise u_max"
    return ""


def wider(level: Any, tol: float) -> Any:
    """Return a little more than a level: below it the next bound can lie."""
    return level * (1 + tol) + tol * tol


def without_end(bound: str, iterations: Sequence[float]) -> str:
    """Say that bounds grow beyond any limit."""
    shown = ", ".join(f"{C:.4g}" for C in iterations)
    return f"the box does not close: C -> {bound} gives {shown} and so on without end"
