"""A certificate as a file that others check: rationals, boxes, and the claim, as JSON.

`nlctl.analysis.recheck` reads it, and knows nothing of what found it.  Bounds are written a little
wider than they were proved, so that plain interval arithmetic follows them, and nothing is written
that the recheck does not answer with yes.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from flint import arb

from nlctl.errors import UsageError
from nlctl.host.files import replace_file
from nlctl.plants import coordinate_names

from ...intervals.normal_form import exact
from ...intervals.paths import Undecided
from ...intervals.written import operations
from ...recheck import FORMAT, Refuted, proved_bounds, recheck, seal_of
from ..bounds.decomposition import Decomposition
from ..bounds.error_bounds import filter_poles, reference_bounds
from ..bounds.starts import Starts
from .plant_bounds import Demand, FilteredLoop, demand

__all__ = [
    "Content",
    "filtered_attempts",
    "save_certificate",
    "split_content",
    "starts_content",
    "texts",
]

_WIDER = ((0.0, 1e-3), (0.0, 1e-5), (0.01, 1e-3), (0.05, 1e-3), (0.2, 1e-3))
# relative: how far C is raised, and by how much bounds on its box
_POLE = Fraction(1, 2**40)  # relative: half the width of an irrational pole
Content = dict[str, Any]


def save_certificate(
    path: str | os.PathLike[str], kind: str, name: str, attempts: Callable[[], Iterator[Content]]
) -> Path:
    """Write the first of some attempts that the recheck answers with yes."""
    why = "there is nothing to be written"
    try:
        for made in attempts():
            content = {
                "format": FORMAT[0],
                "version": FORMAT[1],
                "kind": kind,
                "loop": name,
                **made,
            }
            try:
                bounds = proved_bounds(content)
                content["claim"] = {k: str(_rounded_up(b)) for k, b in bounds.items()}
                content["seal"] = seal_of(content)
                recheck(content)
            except Refuted as error:
                why = str(error)
                continue
            text = f"{json.dumps(content, indent=1)}\n".encode()
            return replace_file(path, lambda file, text=text: file.write(text))
    except Undecided as error:
        why = f"{error}; the file holds arithmetic and a few functions only"
    raise UsageError(
        f"the certificate of '{name}' cannot be saved so that others can check it: {why}"
    )


def _rounded_up(bound: Fraction) -> Fraction:
    """Return a bound with ten digits or so."""
    digits = 10 ** max(10 - len(str(int(bound))), 0)
    return Fraction(-((-bound.numerator * digits) // bound.denominator), digits)


def filtered_attempts(
    loop: FilteredLoop,
    need: Demand,
    split: Decomposition,
    gains: Mapping[str, float],
    states: Mapping[str, Any],
) -> Iterator[Content]:
    """Yield premises and proof of a loop with a filtered error, with more and more room."""
    premises = {
        "equation": _equation(loop),
        "reference": {
            column: texts(getattr(loop.reference, column))
            for column in ("amplitudes", "frequencies", "phases")
        },
        "lambdas": texts(loop.lambdas),
        "actuator": split_content(split),
        "gains": {name: str(exact(value)) for name, value in gains.items()},
        "starts": starts_content(loop.starts),  # type: ignore[attr-defined]
        **states,
    }
    for raised, wider in _WIDER:
        found = demand(loop, split, need.C * (1 + raised)) if raised else need
        yield {"premises": premises, "proof": _proof(loop, found, Fraction(wider))}


def _equation(loop: FilteredLoop) -> list[list[Any]]:
    names = coordinate_names(len(loop.lambdas) + 1)
    return operations(
        ("t", *names, "v"), lambda s: loop.acceleration(s["t"], [s[x] for x in names], s["v"])
    )


def _proof(loop: FilteredLoop, need: Demand, wider: Fraction) -> Content:
    """Return C, the box and the bounds on it, a little wider."""
    wanted = [exact(y) * (1 + wider / 10) for y in reference_bounds(loop.reference)]
    return {
        "C": str(exact(need.C)),
        "poles": [_pole(p) for p in filter_poles(loop.lambdas)],
        "reference": texts(wanted),
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


def texts(values: Iterable[Any]) -> list[str]:
    """Return finite numbers as exact texts."""
    return [str(exact(value)) for value in values]


def split_content(split: Decomposition) -> Content:
    """Return the split of an actuator as it stands in a file."""
    endless = split.largest_u == float("inf")
    return {
        "k_1": str(exact(split.k_1)),
        "k_2": str(exact(split.k_2)),
        "eps": str(exact(split.eps_star)),
        "range": None if endless else str(exact(split.largest_u)),
    }


def starts_content(starts: Starts) -> Content:
    """Return the ends of all initial states that a proof depends on; not those that V bounds."""
    every = zip(starts.names, starts.low, starts.high, strict=True)
    bounded = ((name, ends) for name, *ends in every if all(map(math.isfinite, ends)))
    return {name: texts(ends) for name, ends in bounded if name not in starts.kept}
