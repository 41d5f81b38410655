"""Analyses that search, or look at sizes one after the other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from analysis.robustness import Space, bound_verdict, independent, nominal
from analysis.robustness.search.confirmation import confirm
from analysis.robustness.search.degradation import degradation_curve
from analysis.robustness.search.failure_map import boundary, failure_map
from analysis.robustness.search.largest_scale import largest_scale
from analysis.robustness.search.radius import robustness_radius
from analysis.robustness.search.shrink import shrink
from analysis.robustness.search.worst_case import worst_case
from analysis.robustness.statistics.guarantee import assumptions, rounded_down, rounded_up
from analysis.robustness.stl.spec import violates

from ..result import Finding
from .analyses import Degradation, Map, Radius, WorstCase
from .context import Ground, made, statement_numbers

__all__ = ["degradation", "failures", "lowest_margin", "radius"]


def lowest_margin(asked: WorstCase, ground: Ground) -> Finding:
    """Search for the lowest margin; confirm and shrink a violation."""
    space = ground.space(asked.quantities)
    found = worst_case(ground.simulate, space, asked.runs, entropy=ground.seed)
    if not found.is_finished:
        raise KeyboardInterrupt
    told = [str(found)]
    numbers: dict[str, Any] = {"margin": found.margin, "witness": found.witness}
    numbers |= {"found_by": found.found_by, "runs": found.runs, "all_corners": found.all_corners}
    results = found.results.assign(searcher=found.searchers)
    tables = {"rows": results, "best": pd.DataFrame({"margin": found.best_so_far})}
    count = found.design.size
    if found.is_violated:
        row = nominal(ground.space()) | found.witness
        again = confirm(ground.prepared, row, python_control=asked.python_control)
        told.append(str(again))
        numbers |= {"is_confirmed": again.is_confirmed, "spread": again.spread}
        tables["replays"] = again.replays
        if asked.shrink:
            small = shrink(ground.simulate, space, found.witness)
            told.append(str(small))
            numbers["shrunk"] = vars(small)
            count += small.runs
    return made(
        asked,
        " ".join(told),
        **_no_low_margin(asked.limit, found.margin, bool(numbers.get("is_confirmed", True))),
        runs=count,
        numbers=numbers,
        tables=tables,
    )


def _no_low_margin(limit: float | None, margin: float, is_confirmed: bool) -> dict[str, str]:
    """Return the answer to the claim about the lowest margin that was found."""
    if limit is None:
        return {}
    if margin > limit:
        return {"answer": "shown"}
    if is_confirmed:
        return {"answer": "refuted"}
    needs = "integrators that agree about the lowest margin"
    return {"answer": "not shown yet", "needs": needs}


def degradation(asked: Degradation, ground: Ground) -> Finding:
    """Bound the probability of a violation at every size."""
    space = ground.space(asked.quantities)
    found = degradation_curve(
        ground.simulate,
        space,
        asked.factors,
        asked.runs,
        entropy=ground.seed,
        confidence=asked.confidence,
        simultaneous=asked.simultaneous,
    )
    bounds = dict(zip(found.factors, found.statements, strict=True))
    told = "; ".join(
        f"at {factor:g} {one.violations} of {one.runs} ({rounded_down(one.lower)} to "
        f"{rounded_up(one.upper)})"
        for factor, one in bounds.items()
    )
    together = "together" if asked.simultaneous else "each by itself"
    limit = asked.limit
    verdict = {} if limit is None else vars(bound_verdict(bounds[asked.at], limit))
    return made(
        asked,
        f"Violations with all deviations scaled: {told}. The bounds hold with confidence "
        f"{100 * asked.confidence:g} %, {together}. Assumed: "
        f"at each size {'; '.join(assumptions(independent(space, asked.runs, ground.seed)))}.",
        **verdict,
        runs=sum(one.runs for one in found.statements),
        numbers={"confidence": asked.confidence, "simultaneous": asked.simultaneous},
        tables={"curve": found.table},
    )


def radius(asked: Radius, ground: Ground) -> Finding:
    """Search for the smallest size with a violation."""
    space = ground.space(asked.quantities)
    largest, why = largest_scale(ground.prepared, asked.largest, space.names)
    found = robustness_radius(
        ground.simulate,
        space,
        largest,
        limit=why,
        runs=asked.runs,
        tolerance=asked.tolerance,
        draws=asked.draws,
        confidence=asked.confidence,
        entropy=ground.seed,
    )
    numbers: dict[str, Any] = {"upper": found.upper, "searched": found.searched}
    numbers |= {"largest": found.largest, "margin": found.margin, "witness": found.witness}
    if found.statement is not None:
        numbers["statement"] = statement_numbers(found.statement)
    return made(
        asked,
        str(found),
        **_no_small_violation(asked.limit, found.upper, found.largest),
        runs=found.runs + (0 if found.statement is None else found.statement.runs),
        numbers=numbers,
        tables={"steps": found.steps},
    )


def _no_small_violation(limit: float | None, upper: float, largest: float) -> dict[str, str]:
    """Return the answer to the claim about the smallest size with a violation."""
    if limit is None:
        return {}
    if upper < limit:
        return {"answer": "refuted"}
    if min(upper, largest) >= limit:
        return {"answer": "shown"}
    needs = f"a search up to that size: this one ended at {largest:.4g}"
    return {"answer": "not shown yet", "needs": needs}


def failures(asked: Map, ground: Ground) -> Finding:
    """Map the margin over the plane of two quantities."""
    x, y = ground.space((asked.x, asked.y)).quantities
    plane = (
        x if asked.x_bounds is None else replace(x, bounds=asked.x_bounds),
        y if asked.y_bounds is None else replace(y, bounds=asked.y_bounds),
    )
    found = failure_map(
        ground.simulate,
        Space(quantities=plane),
        x.name,
        y.name,
        cells=asked.cells,
        levels=asked.levels,
        most=asked.runs,
    )
    edge = boundary(found)
    bad = int(np.count_nonzero(violates(found.table["spec"])))
    if bad in (0, len(found.table)):
        which = "every one" if bad else "none"
        told = f"{which} of {len(found.table)} points violates the spec."
    else:
        sides = " and ".join(f"{side:.3g}" for side in found.cell)
        fine = "" if found.is_finished else "; refinement ended with the number of runs"
        told = (
            f"{bad} of {len(found.table)} points violate the spec; cells at the boundary have "
            f"sides {sides}{fine}. Points were chosen near the boundary, so their share is no "
            "probability."
        )
    return made(
        asked,
        f"In the plane of {found.x} and {found.y}, the others nominal, {told}",
        runs=len(found.table),
        numbers={"x": found.x, "y": found.y, "cell": list(found.cell)},
        tables={
            "points": found.table,
            "triangles": pd.DataFrame(found.triangles, columns=["a", "b", "c"]),
            "boundary": edge,
        },
    )
