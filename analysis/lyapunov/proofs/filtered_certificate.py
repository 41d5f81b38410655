"""What certificates about the filtered error have in common: their bounds, constants and file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import arb

from nlctl.plants import coordinate_names

from ...intervals.normal_form import exact
from ...intervals.written import operations
from ..bounds.error_bounds import filter_poles, reference_bounds
from ..loop.external_inputs import ADDED
from .filtered import Demand, FilteredLoop, demand
from .result import Certificate, Row, per_second, rows_of_split
from .saved import Content, split_content, starts_content, texts

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
            "equation": _equation(loop),
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


def _equation(loop: FilteredLoop) -> list[list[Any]]:
    names = coordinate_names(len(loop.lambdas) + 1)
    return operations(
        ("t", *names, "v"), lambda s: loop.acceleration(s["t"], [s[x] for x in names], s["v"])
    )


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
