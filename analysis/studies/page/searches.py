"""The report's sections on searches: worst case, radius, degradation, failure map."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ... import figures as figures
from ...report.document import Figure, Item, Paragraph, Table
from ...robustness.search.evaluation import margins_of
from ...robustness.stl.spec import violates
from . import text as text
from .rows import known, status_text
from .text import margin_text

if TYPE_CHECKING:
    from analysis.studies.result import Finding, Result

__all__ = ["degradation", "failure_map", "radius", "worst_case"]

Row = Mapping[str, Any]


def worst_case(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield how the worst row was found, whether it is confirmed, and what of it is needed."""
    n = finding.numbers
    lowest = finding.tables["best"]["margin"].to_numpy(dtype=float)
    caption = text.SEARCH + text.clipped(lowest)
    yield Figure(
        key=f"{key}-search",
        caption=caption,
        description=f"{caption} After {lowest.size} runs it is {margin_text(lowest[-1])}.",
        figure=figures.search(lowest, list(finding.tables["rows"]["searcher"].astype(str))),
    )
    if "replays" in finding.tables:
        yield _replays(finding.tables["replays"], bool(n["is_confirmed"]))
    number = int(np.argmin(margins_of(finding.tables["rows"])))
    folder = shlex.quote(str(result.folder))
    yield Paragraph(
        text="The worst row again:", code=f"nlctl replay {folder} {number} --part {finding.key}"
    )
    rows = {"worst row": n["witness"]}
    if "shrunk" in n:
        rows["shrunk"] = n["shrunk"]["row"]
    yield from _rows(rows, result.quantities, key)


def _replays(replays: pd.DataFrame, is_confirmed: bool) -> Table:
    told = "Confirmed" if is_confirmed else "Not confirmed"
    return Table(
        caption=f"{told}: the worst row run again in other ways.",
        columns=("engine", "method", "rtol", "atol", "status", "reached (s)", "margin"),
        rows=[
            (
                run["engine"],
                run["method"],
                f"{run['rtol']:.1g}",
                f"{run['atol']:.1g}",
                status_text(run["status"]),
                run["time"],
                margin_text(float(run["margin"])),
            )
            for run in replays.to_dict("records")
        ],
    )


def _rows(rows: Mapping[str, Row], quantities: pd.DataFrame, key: str) -> Iterator[Item]:
    """Yield some rows beside the nominal one, and how far their numbers deviate.

    What a row leaves out is nominal.
    """
    middle = dict(known(quantities, "nominal"))
    rows = {label: middle | dict(row) for label, row in rows.items()}
    table = deviations(rows, quantities)
    yield Table(
        caption="Its values beside the nominal ones; * deviates from nominal.",
        columns=("quantity", "unit", "nominal", *rows),
        rows=[
            (name, unit, middle, *(_marked(row[name], middle) for row in rows.values()))
            for name, unit, middle in known(quantities, "unit", "nominal")
        ],
    )
    if np.any(table.to_numpy() != 0):
        told = "; ".join(
            f"{name}: " + ", ".join(f"{row} {value:.3g}" for row, value in line.items())
            for name, line in table.iterrows()
        )
        yield Figure(
            key=f"{key}-deviations",
            caption=text.DEVIATIONS,
            description=f"{text.DEVIATIONS} {told}.",
            figure=figures.deviations(table),
        )


def _marked(value: Any, middle: Any) -> str:
    shown = value if isinstance(value, str) else f"{value:.6g}"
    return shown if value == middle else f"{shown} *"


def deviations(rows: Mapping[str, Row], quantities: pd.DataFrame) -> pd.DataFrame:
    """Return how far the numbers of some rows lie from nominal, in sides of their boxes.

    1 is the upper end of the box, -1 the lower one; one line per quantity, one column per row.
    """
    numbers = quantities.reindex(columns=["nominal", "low", "high"]).dropna()

    def sides(value: float, nominal: float, low: float, high: float) -> float:
        side = high - nominal if value > nominal else nominal - low
        return (value - nominal) / side if value != nominal else 0.0

    return pd.DataFrame(
        {
            label: [
                sides(float(row[name]), *map(float, numbers.loc[name])) for name in numbers.index
            ]
            for label, row in rows.items()
        },
        index=numbers.index,
        columns=list(rows),
    )


def radius(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield which sizes were looked at, and the row at the edge of the smallest violation."""
    n, steps = finding.numbers, finding.tables["steps"]
    if n["upper"] == 0:  # the nominal values violate: no other size was looked at
        yield from _rows({"violating row": n["witness"]}, result.quantities, key)
        return
    told = ", ".join(
        f"{step['size']:.4g}: {margin_text(float(step['margin']))}"
        for step in steps.to_dict("records")
    )
    caption = (
        text.RADIUS + text.SMALLEST * bool(np.isfinite(n["upper"])) + text.clipped(steps["margin"])
    )
    yield Figure(
        key=f"{key}-sizes",
        caption=caption,
        description=f"{caption} Lowest margin by size: {told}.",
        figure=figures.radius_steps(steps, float(n["upper"])),
    )
    if n["witness"] is not None:
        yield from _rows({"violating row": n["witness"]}, result.quantities, key)


def degradation(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield the probability of a violation against the size of the uncertainty."""
    n, curve = finding.numbers, finding.tables["curve"]
    together = "all together" if n["simultaneous"] else "each by itself"
    caption = text.DEGRADATION.format(confidence=100 * n["confidence"], together=together)
    yield Figure(
        key=f"{key}-curve",
        caption=caption,
        description=f"{caption} "
        + "; ".join(f"{size:g}: {row['rate']:.4g}" for size, row in curve.iterrows()),
        figure=figures.degradation(curve, asked.at, asked.limit),
    )
    yield Table(
        caption=f"{text.SAME}.",
        folded=True,
        columns=("factor", "violations", "runs", "share", "from", "to", "least margin", "median"),
        rows=[
            (
                size,
                row["violations"],
                row["runs"],
                *(f"{row[column]:.4g}" for column in ("rate", "lower", "upper")),
                *(margin_text(row[column]) for column in ("least_margin", "median_margin")),
            )
            for size, row in curve.to_dict("index").items()
        ],
    )


def failure_map(finding: Finding, result: Result, asked: Any, key: str) -> Iterator[Item]:
    """Yield the map of margins over two quantities."""
    names = (finding.numbers["x"], finding.numbers["y"])
    points = finding.tables["points"]
    about = result.quantities.loc[list(names)]
    nominal = tuple(map(float, about["nominal"]))
    labels = tuple(f"{name} ({unit or '1'})" for name, unit in known(about, "unit"))
    edge, is_nominal = finding.tables["boundary"], bool(np.all(np.isfinite(nominal)))
    caption = text.MAP + text.VIOLATED * bool(np.any(violates(points["spec"])))
    caption += text.BOUNDARY * bool(len(edge)) + text.STAR * is_nominal + text.BOX
    box = tuple((float(row["low"]), float(row["high"])) for _, row in about.iterrows())
    yield Figure(
        key=f"{key}-map",
        caption=caption,
        description=f"{caption} {finding.sentence}",
        figure=figures.failure_map(
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
