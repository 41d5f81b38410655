"""The margin over the plane of two quantities, refined at the boundary."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pandas as pd
from pydantic import Field

from nlctl.wording import counted, some_of

from ... import figures as figures
from ...report.document import Item, Paragraph, captioned
from ...robustness import Space
from ...robustness.search.failure_map import boundary, failure_map
from ...robustness.stl.spec import violates
from ..file.schema import Asked, Pair, Whole
from ..kind import Ground, Kind, finding_of
from ..page import known
from ..result import Finding, Result

_CAPTION = (
    "Margin over the plane, the other quantities nominal; between the points that were run, the "
    "dots, it is interpolated."
)
_VIOLATED = " Orange: violated."
BOUNDARY = " Line: margin 0."
STAR = " Star: nominal."
BOX = " Dashed: the box of the study."


class Map(Asked):
    """The margin over the plane of two quantities, refined at the boundary."""

    x: str = Field(description="A quantity of [space].")
    y: str = Field(description="Another one.")
    x_bounds: Pair | None = Field(None, description="Range of x; its box by default.")
    y_bounds: Pair | None = Field(None, description="Range of y; its box by default.")
    cells: Whole = Field(8, ge=1, description="Cells along each axis of the first grid.")
    levels: Whole = Field(4, ge=0, le=10, description="How often a cell is divided at most.")
    runs: Whole = Field(4000, ge=1, description="Points at most; the first grid always runs.")


def _run(asked: Map, ground: Ground) -> Finding:
    """Map the margin over the plane of two quantities."""
    x, y = ground.space((asked.x, asked.y)).quantities
    plane = (
        x if asked.x_bounds is None else replace(x, bounds=asked.x_bounds),
        y if asked.y_bounds is None else replace(y, bounds=asked.y_bounds),
    )
    margin_map = failure_map(
        ground.simulate,
        Space(quantities=plane),
        x.name,
        y.name,
        cells=asked.cells,
        levels=asked.levels,
        most=asked.runs,
    )
    edge = boundary(margin_map)
    bad = int(np.count_nonzero(violates(margin_map.table["spec"])))
    if bad in (0, len(margin_map.table)):
        which = "every one" if bad else "none"
        outcome = f"{which} of {counted(len(margin_map.table), 'point')} violates the spec."
    else:
        sides = " and ".join(f"{side:.3g}" for side in margin_map.cell)
        fine = "" if margin_map.is_finished else "; refinement ended with the number of runs"
        outcome = (
            f"{some_of(bad, len(margin_map.table), 'point', 'violates', 'violate')} the spec; "
            f"cells at the boundary have sides {sides}{fine}. Points were chosen near the "
            "boundary, so their share is not a probability."
        )
    return finding_of(
        asked,
        f"In the plane of {margin_map.x} and {margin_map.y}, the others nominal, {outcome}",
        runs=len(margin_map.table),
        numbers={"x": margin_map.x, "y": margin_map.y, "cell": list(margin_map.cell)},
        tables={
            "points": margin_map.table,
            "triangles": pd.DataFrame(margin_map.triangles, columns=["a", "b", "c"]),
            "boundary": edge,
        },
    )


def _items(finding: Finding, result: Result, asked: Map, key: str) -> Iterator[Item]:
    """Yield the map of margins over two quantities."""
    names = (finding.numbers["x"], finding.numbers["y"])
    points = finding.tables["points"]
    about = result.quantities.loc[list(names)]
    nominal = tuple(map(float, about["nominal"]))
    labels = tuple(f"{name} ({unit or '1'})" for name, unit in known(about, "unit"))
    edge, is_nominal = finding.tables["boundary"], bool(np.all(np.isfinite(nominal)))
    caption = _CAPTION + _VIOLATED * bool(np.any(violates(points["spec"])))
    caption += BOUNDARY * bool(len(edge)) + STAR * is_nominal + BOX
    box = tuple((float(row["low"]), float(row["high"])) for _, row in about.iterrows())
    yield captioned(
        f"{key}-map",
        caption,
        finding.sentence,
        figures.failure_map_figure(
            points,
            finding.tables["triangles"].to_numpy(),
            names,
            labels=labels,  # type: ignore[arg-type]
            nominal=nominal if is_nominal else None,  # type: ignore[arg-type]
            box=box,  # type: ignore[arg-type]
        ),
    )
    if len(edge):
        ranges = (_range(name, edge[name].to_numpy()) for name in names)
        yield Paragraph(text=f"On the line where the margin is 0: {'; '.join(ranges)}.")


def _range(name: str, values: np.ndarray) -> str:
    low, high = f"{values.min():.4g}", f"{values.max():.4g}"
    return f"{name} is {low}" if low == high else f"{name} from {low} to {high}"


FAILURE_MAP = Kind(
    name="failure map",
    schema=Map,
    run=_run,
    title="Failure map",
    answers="the margin over the plane of two quantities",
    method=(
        "The failure map starts from a grid and divides cells where the margin changes its sign, "
        "or may do so between the corners."
    ),
    quantities=("x", "y"),
    runs=lambda asked, setup: asked.runs,
    ends_early=True,
    keeps_rows=False,
    largest=lambda asked, quantities: max(asked.runs, (asked.cells + 1) ** 2),
    items=_items,
    in_brief=True,
)
