"""The row with the lowest margin that a search finds."""

import shlex
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from pydantic import Field

from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, Paragraph, Table, captioned
from ...robustness import nominal
from ...robustness.search.confirmation import confirm
from ...robustness.search.evaluation import margins_of
from ...robustness.search.shrink import shrink
from ...robustness.search.worst_case import worst_case
from .. import page as text
from ..file.schema import Flag, Number, Varied, Whole
from ..kind import Ground, Kind, finding_of
from ..page import DID_NOT_END, found_rows, margin_in_words, margin_text, status_text
from ..result import Finding, Result
from .context import AUGER, HANSEN, SEARCHED

SEARCH = "Lowest margin after each run of the search; the background shows what chose the run."
ZELLER = (
    "A. Zeller, R. Hildebrandt: Simplifying and isolating failure-inducing input. IEEE Trans. "
    "Softw. Eng. 28 (2002) 183–200. doi 10.1109/32.988498."
)


class AskedWorstCase(Varied):
    """The row with the lowest margin that a search finds; a violation is confirmed and shrunk."""

    runs: Whole = Field(1000, ge=1, description="The search runs at most so many rows.")
    shrink: Flag = Field(True, description="Whether a violation is reduced to few deviations.")
    python_control: Flag = Field(False, description="Whether python-control confirms it as well.")
    limit: Number | None = Field(None, description="Claim: no margin found is this low.")
    claimed: ClassVar[str] = "no margin of {limit:g} or lower is found"


def _run(asked: AskedWorstCase, ground: Ground) -> Finding:
    """Search for the lowest margin; confirm and shrink a violation."""
    space = ground.space(asked.quantities)
    worst = worst_case(ground.simulate, space, asked.runs, entropy=ground.seed)
    if not worst.is_finished:
        raise KeyboardInterrupt
    sentences = [str(worst)]
    numbers: dict[str, Any] = {"margin": worst.margin, "witness": worst.witness}
    numbers |= {"found_by": worst.found_by, "runs": worst.runs, "all_corners": worst.all_corners}
    results = worst.results.assign(searcher=worst.searchers)
    tables = {"rows": results, "best": pd.DataFrame({"margin": worst.best_so_far})}
    count = worst.design.size
    if worst.is_violated:
        row = nominal(ground.space()) | worst.witness
        again = confirm(ground.prepared, row, python_control=asked.python_control)
        sentences.append(str(again))
        numbers |= {"is_confirmed": again.is_confirmed, "spread": again.spread}
        tables["replays"] = again.replays
        if asked.shrink:
            small = shrink(ground.simulate, space, worst.witness)
            sentences.append(str(small))
            numbers["shrunk"] = vars(small)
            count += small.runs
    return finding_of(
        asked,
        " ".join(sentences),
        **_no_low_margin(asked.limit, worst.margin, bool(numbers.get("is_confirmed", True))),
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


def _measured(finding: Finding, asked: AskedWorstCase) -> dict[str, str]:
    n = finding.numbers
    ended = margin_text(n["margin"]) == DID_NOT_END
    return {
        "measured": (
            "a run that did not reach its end"
            if ended
            else f"lowest margin found: {margin_text(n['margin'])}"
        ),
        "limit": f"> {asked.limit:g}",
        "margin": "" if ended else f"{n['margin'] - asked.limit:.3g}",
    }


def _items(finding: Finding, result: Result, asked: AskedWorstCase, key: str) -> Iterator[Item]:
    """Yield how the worst row was found, whether it is confirmed, and what of it is needed."""
    n = finding.numbers
    lowest = finding.tables["best"]["margin"].to_numpy(dtype=float)
    caption = SEARCH + text.clipped(lowest)
    yield captioned(
        f"{key}-search",
        caption,
        f"After {counted(lowest.size, 'run')}: {margin_in_words(lowest[-1])}.",
        figures.search(lowest, list(finding.tables["rows"]["searcher"].astype(str))),
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
    yield from found_rows(rows, result.quantities, key)


def _replays(replays: pd.DataFrame, is_confirmed: bool) -> Table:
    verdict = "Confirmed" if is_confirmed else "Not confirmed"
    return Table(
        caption=f"{verdict}: the worst row run again in other ways.",
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


WORST_CASE = Kind(
    name="worst case",
    schema=AskedWorstCase,
    run=_run,
    title="Worst case",
    answers="the lowest margin in the box; a violation is confirmed and shrunk",
    claims="no margin is `limit` or lower",
    method=(
        f"The worst case was searched for by {SEARCHED}. A violation is run again at a hundredth "
        "of the tolerances with an explicit and a stiff integrator before it is called confirmed, "
        "and shrunk to few deviations (Zeller and Hildebrandt 2002)."
    ),
    sources=(HANSEN, AUGER, ZELLER),
    quantities=("quantities",),
    runs=lambda asked, setup: asked.runs,
    ends_early=True,
    largest=lambda asked, quantities: asked.runs,
    measured=_measured,
    items=_items,
    witness=lambda finding: (finding.numbers["witness"], finding.numbers["margin"]),
)
