"""What a plant asks of the controller while the filtered error keeps a bound."""

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

import numpy as np
from flint import arb

from nlctl.plants import coordinate_names
from nlctl.references import SumOfSines
from nlctl.wording import counted

from ...intervals.arithmetic import as_ball
from ...intervals.box import Box
from ...intervals.branch_and_bound import enclose_relatively, upper
from ...intervals.machine import Readable
from ...intervals.normal_form import exact
from ..bounds.decomposition import Decomposition, decompose
from ..bounds.error_bounds import (
    error_bounds,
    filter_poles,
    initial_errors,
    reference_bounds,
    total_error,
)
from ..bounds.sector import quotient_function, range_of_quotient
from ..loop.checked import ADDED, Acceleration, CheckedLoop, disturbed
from .kind import ProofOptions, Subject
from .result import (
    Certificate,
    Content,
    Row,
    equation_content,
    per_second,
    rows_of_split,
    split_content,
    starts_content,
    texts,
)


@dataclass(frozen=True, kw_only=True)
class FilteredLoop(CheckedLoop):
    """A loop whose controller sees the plant through the filtered error r of (14)."""

    reference: SumOfSines
    e0: tuple[arb, ...]  # initial errors e_1(0), ..., e_n(0): of all starts

    @property
    def law(self) -> Any:
        """The control law."""
        return self.spec("law")

    @property
    def lambdas(self) -> tuple[float, ...]:
        """lambda_1, ..., lambda_{n-1} of the filtered error."""
        return self.spec("filtered_error").lambdas

    @property
    def r_0(self) -> arb:
        """r(0) of (14)."""
        coefficients = (*map(arb, reversed(self.lambdas)), arb(1))
        return sum((a * b for a, b in zip(coefficients, self.e0, strict=True)), arb(0))

    def states(self, part: str) -> list[str]:
        """Names of the states of a part."""
        return self.starts.names_of(self.roles.places[part])


def as_filtered(read: CheckedLoop) -> dict[str, Any]:
    """Return the fields of a `FilteredLoop`."""
    reference, x0 = read.spec("reference"), [between(*ends) for ends in read.start("plant")]
    return vars(read) | {"reference": reference, "e0": initial_errors(reference, x0)}


def subject_of(loop: FilteredLoop, options: ProofOptions, u_max: float) -> Subject:
    """Return what a proof of a bound of |r| begins with; `u_max` is that of the split."""
    actuator, tol = loop.spec("actuator"), options.tol
    split = disturbed(decompose(actuator, k=options.k, u_max=u_max, tol=tol), loop.disturbance)
    return Subject(
        loop=loop, start=abs(loop.r_0), actuator=actuator, split=split, u_max=u_max, tol=tol
    )


def between(low: float, high: float) -> arb:
    """Return an interval."""
    return arb(low) if low == high else arb(low).union(arb(high))


@dataclass(frozen=True, kw_only=True)
class Demand:
    """What the plant asks of the controller while |r| <= C; of the gains only lambda enters."""

    C: float  # bound of |r|
    box: Box  # what x stays in
    errors: tuple[float, ...]  # bounds of |e_1|, ..., |e_n|
    # proved bounds of G = F/v over the box, for all v
    G_min: float
    G_max: float
    matched: float  # proved bound of |g(x) + d(x, t)| over the box, for all t
    delta_star: float  # matched + G_max eps_u*
    boxes: int  # boxes of the proofs
    # what proved them; balls where only some are floats'
    arithmetic: Literal["balls", "floats"] = "balls"

    @property
    def how(self) -> str:
        """On how many boxes, and of what, in words."""
        of = ", floats rounded outwards" if self.arithmetic == "floats" else ""
        return counted(self.boxes, "box", "boxes") + of


def demand(loop: FilteredLoop, split: Decomposition, C: float, *, tol: float = 1e-3) -> Demand:
    """Bound what the plant asks of the controller while |r| <= C."""
    errors = error_bounds(loop.lambdas, loop.e0, arb(C))
    commands = reference_bounds(loop.reference)
    reach = tuple(upper(e + y) for e, y in zip(errors, commands, strict=False))
    low, names = tuple(-a for a in reach), coordinate_names(len(reach))
    box = Box(names=names, low=low, high=reach, how=f"|r| <= {C:.6g}")

    def over_all(*more: str) -> Box:
        sides = {"t": (0.0, np.inf), "v": (-np.inf, np.inf)}
        whole = box
        for name in more:
            whole = whole.times(name, *sides[name])
        return whole

    matched, gain_of_v = _terms(loop.acceleration)
    fine = enclose_relatively(matched, over_all("t"), tol, 20_000)
    gain = range_of_quotient(gain_of_v, over_all("t", "v"), tol=tol, max_boxes=2_000)
    return Demand(
        C=C,
        box=box,
        errors=tuple(map(upper, errors)),
        G_min=gain.G_min,
        G_max=gain.G_max,
        matched=fine.magnitude,
        delta_star=upper(total_error(as_ball(gain.G_max), split.eps_star, fine.magnitude, 0.0)),
        boxes=fine.boxes + gain.boxes,
        arithmetic="floats" if {fine.arithmetic, *gain.arithmetic} == {"floats"} else "balls",
    )


@functools.lru_cache(maxsize=8)
def _terms(rate: Acceleration) -> tuple[Readable, Readable]:
    """Return g + d, of states and time, and F/v, of these and v: as long as the plant is known."""
    matched = Readable(
        of_balls=lambda point: rate(point[-1], list(point[:-1]), 0.0),
        expressions=lambda graph, s: [rate.expression(graph, s[-1], s[:-1], 0.0)],
    )
    gain = quotient_function(
        lambda x, v: rate(x[-1], x[:-1], v),
        lambda graph, s: rate.expression(graph, s[-2], s[:-2], s[-1]),
    )
    return matched, gain


def feedforward(loop: FilteredLoop, need: Demand) -> arb:
    """Bound |Y_d| of (18) by the errors and the n-th derivative of the reference."""
    A = [abs(arb(a)) for a in reversed(loop.lambdas)]
    commands = reference_bounds(loop.reference)
    error_terms = (a * e for a, e in zip(A, need.errors[1:], strict=True))
    return arb(commands[len(A) + 1]) + sum(error_terms, arb(0))


_WIDER = ((0.0, 1e-3), (0.0, 1e-5), (0.01, 1e-3), (0.05, 1e-3), (0.2, 1e-3))
# relative: how far C is raised, and by how much bounds on its box
_POLE = Fraction(1, 2**40)  # relative: half the width of an irrational pole


@dataclass(frozen=True, kw_only=True)
class FilteredCertificate(Certificate):
    """A certificate about |r|, of a loop whose controller sees the plant through r of (14)."""

    C_0: float  # bound of |r| for all time, from all `starts`
    ultimate: float  # bound of limsup |r|
    u_max: float  # bound of |u| for all time
    loop: Any  # the parameters that it is about

    def _of_plant(self) -> Iterator[Row]:
        need, over = self.region, str(self.region.box)
        unit = per_second(len(self.loop.e0))
        yield "G_min", need.G_min, unit, "proved", "F/v", f"all v, {over}"
        yield "G_max", need.G_max, unit, "proved", "F/v", f"all v, {over}"
        yield from rows_of_split(self.split)
        if self.disturbance:
            yield "sup |w|", self.disturbance, "1", "given", ADDED, "all t"
        yield "sup |g + d|", need.matched, unit, "proved", need.how, f"all t, {over}"
        yield "delta*", need.delta_star, unit, self._sure, "sup |g + d| + G_max eps_u*", over

    def _numbers(self) -> tuple[Mapping[str, float], Content]:
        """Return the gains, and the states by part, as a file has them."""
        raise NotImplementedError

    def _attempts(self) -> Iterator[Content]:
        loop, need, (gains, states) = self.loop, self.region, self._numbers()
        reference = ("amplitudes", "frequencies", "phases")
        premises = {
            "equation": equation_content(loop.acceleration, len(loop.e0)),
            "reference": {name: texts(getattr(loop.reference, name)) for name in reference},
            "lambdas": texts(loop.lambdas),
            "actuator": split_content(self.split),
            "gains": {name: str(exact(value)) for name, value in gains.items()},
            "starts": starts_content(self.starts),
            **states,
        }
        for raised, wider in _WIDER:
            region = demand(loop, self.split, need.C * (1 + raised)) if raised else need
            yield {"premises": premises, "proof": _proof(loop, region, Fraction(wider))}


def _proof(loop: FilteredLoop, need: Demand, wider: Fraction) -> Content:
    """Return C, the box and the bounds on it, a little wider."""
    reference = [exact(y) * (1 + wider / 10) for y in reference_bounds(loop.reference)]
    return {
        "C": str(exact(need.C)),
        "poles": [_pole(p) for p in filter_poles(loop.lambdas)],
        "reference": texts(reference),
        "matched": str(exact(need.matched) * (1 + wider)),
        "G_min": str(exact(need.G_min) * (1 - wider)),
        "G_max": str(exact(need.G_max) * (1 + wider)),
    }


def _pole(p: arb) -> list[str]:
    """Return a pole of the filter as an interval; without width if it is a fraction of doubles."""
    middle = exact(float(p.mid()))
    exactly = bool(p.contains(arb(float(middle)))) and middle.denominator < 2**40
    room = Fraction(0) if exactly else middle * _POLE
    return [str(middle - room), str(middle + room)]
