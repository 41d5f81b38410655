"""The smallest size of the uncertainty at which a violation is found."""

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from ... import figures as figures
from ...report.document import Item, captioned
from ...robustness.search.radius import largest_scale, robustness_radius
from .. import page as text
from ..file.schema import Confidence, Size, Varied, Whole
from ..kind import Ground, Kind, finding_of
from ..page import found_rows, margin_in_words, margin_text
from ..result import Finding, Result
from .context import AUGER, CLOPPER, HANSEN, SEARCHED

SIZES = 12  # that the search tries, roughly
_CAPTION = "Sizes that were tried, as factors of the box, with the lowest margin found there."
_SMALLEST = " Dashed: the smallest size with a violation."


class AskedRadius(Varied):
    """The smallest size of the uncertainty at which a violation is found."""

    largest: Size = Field(4.0, gt=0, description="Largest size, as a factor of the box.")
    runs: Whole = Field(500, ge=1, description="Rows of the search at each size, at most.")
    tolerance: Confidence = Field(0.02, description="Relative width at which the search ends.")
    draws: Whole = Field(459, ge=0, description="Independent draws for the statement.")
    confidence: Confidence = 0.99
    limit: Size | None = Field(None, description="Claim: none is found below this size.")
    claimed: ClassVar[str] = "no violation is found below size {limit:g}"


def _run(asked: AskedRadius, ground: Ground) -> Finding:
    """Search for the smallest size with a violation."""
    space = ground.space(asked.quantities)
    largest, why = largest_scale(ground.prepared, asked.largest, space.names)
    radius = robustness_radius(
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
    numbers: dict[str, Any] = {"upper": radius.upper, "searched": radius.searched}
    numbers |= {"largest": radius.largest, "margin": radius.margin, "witness": radius.witness}
    if radius.statement is not None:
        numbers["statement"] = radius.statement.plain()
    return finding_of(
        asked,
        str(radius),
        **_no_small_violation(asked.limit, radius.upper, radius.largest),
        runs=radius.runs + (0 if radius.statement is None else radius.statement.runs),
        numbers=numbers,
        tables={"steps": radius.steps},
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


def _measured(finding: Finding, asked: Any) -> dict[str, str]:
    n = finding.numbers
    measured = f"violation at size {n['upper']:.4g}"
    if n["upper"] == 0:
        measured = f"the nominal values violate, {margin_in_words(n['margin'])}"
    elif n["witness"] is None:
        measured = f"no violation found up to size {n['largest']:.4g}"
    return {
        "measured": measured,
        "limit": f"≥ {asked.limit:g}",
        "margin": f"{min(n['upper'], n['largest']) - asked.limit:.3g}",
    }


def _items(finding: Finding, result: Result, asked: AskedRadius, key: str) -> Iterator[Item]:
    """Yield which sizes were tried, and the row at the edge of the smallest violation."""
    n, steps = finding.numbers, finding.tables["steps"]
    if n["upper"] == 0:  # the nominal values violate: no other size was tried
        yield from found_rows({"violating row": n["witness"]}, result.quantities, key)
        return
    listed = ", ".join(
        f"{step['size']:.4g}: {margin_text(float(step['margin']))}"
        for step in steps.to_dict("records")
    )
    caption = _CAPTION + _SMALLEST * bool(np.isfinite(n["upper"])) + text.clipped(steps["margin"])
    yield captioned(
        f"{key}-sizes",
        caption,
        f"Lowest margin by size: {listed}.",
        figures.radius_steps(steps, float(n["upper"])),
    )
    if n["witness"] is not None:
        yield from found_rows({"violating row": n["witness"]}, result.quantities, key)


RADIUS = Kind(
    name="radius",
    schema=AskedRadius,
    run=_run,
    title="Robustness radius",
    answers="the smallest factor of the box at which a violation is found",
    claims="none below `limit`",
    method=(
        f"At each size of the radius the box was searched by {SEARCHED}, with the same random "
        "numbers; each violation is moved towards nominal along its ray."
    ),
    sources=(HANSEN, AUGER, CLOPPER),
    quantities=("quantities",),
    runs=lambda asked, setup: SIZES * asked.runs + asked.draws,
    ends_early=True,
    keeps_rows=False,
    largest=lambda asked, quantities: max(asked.runs, asked.draws),
    measured=_measured,
    items=_items,
)
