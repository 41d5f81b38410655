"""The part of the paper's page on rival controllers."""

from __future__ import annotations

from typing import Any

import pandas as pd

from ...report.document import Paragraph, Section, Table
from .. import TAIL
from ..rivals import KNOWLEDGE, RIVAL_ACTUATORS, beaten_by, failed_text

_TITLES = {"example_1": "Example 1", "example_2": "Example 2"}


def rivals_section(record: pd.DataFrame) -> Section:
    """Return the section on the paper's controller and its rivals."""
    return Section(
        key="rivals",
        title="Comparison with other controllers",
        items=[
            Paragraph(
                text="The plants of both examples with other controllers. The gains of each were "
                "found with the same budget on the same training samples of the example's own "
                "actuator; they are compared on fresh samples, the same for all. All others need "
                "to know the sign of the input gain, which the paper's controller finds; the last "
                "table lists what else each needs to know."
            ),
            *(Paragraph(text=_sentence(record, example)) for example in _TITLES),
            _winners(record),
            *(_table(record, example) for example in _TITLES),
            Table(
                caption="What each controller needs to know.",
                columns=("controller", "knowledge"),
                rows=list(KNOWLEDGE.items()),
                folded=True,
            ),
            Paragraph(
                text="These are medians of a recorded campaign. Its studies, with all pairs, "
                "differences and intervals, are run by nlctl run reports/rivals-1.toml and "
                "reports/rivals-2.toml; the command that makes the record again, in a checkout:",
                code="python campaign/rival_runs.py",
            ),
        ],
    )


def _sentence(record: pd.DataFrame, example: str) -> str:
    """Say what is better than the paper's controller with every actuator, and what is worse."""
    tallies, alone = beaten_by(record, example).values(), "no single controller"
    beaten, beats = (
        tuple(x for x in KNOWLEDGE if all(x in tally[key] for tally in tallies))
        for key in ("beaten by", "beats")
    )
    return (
        f"{_TITLES[example]}: with every one of the actuators, the paper's controller as printed "
        f"is worse than {_listed(beaten, alone)}, and better than {_listed(beats, alone)}."
    )


def _winners(record: pd.DataFrame) -> Table:
    return Table(
        caption="Controllers that are better than the paper's as printed, and those that are "
        f"worse: no more violations and a smaller RMS of e for t ≥ {TAIL:g} s, with the exact "
        "interval of the median difference on the same samples on one side of 0.",
        columns=("example", "actuator", "worse than", "better than"),
        rows=[
            (title, RIVAL_ACTUATORS[name], _listed(tally["beaten by"]), _listed(tally["beats"]))
            for example, title in _TITLES.items()
            for name, tally in beaten_by(record, example).items()
        ],
    )


def _listed(labels: tuple[str, ...], nobody: str = "none") -> str:
    return ", ".join("itself tuned" if x == "paper, tuned" else x for x in labels) or nobody


def _table(record: pd.DataFrame, example: str) -> Table:
    rows: Any = record[record["example"] == example]
    return Table(
        caption=f"{_TITLES[example]}: violations of |e| ≤ 0.15 for t ≥ {TAIL:g} s or |u| ≤ 15 in "
        f"{rows['samples'].iloc[0]} runs (in brackets those that did not reach their end), and "
        "medians of the RMS of e, of the largest |u|, and of the energy of u. Less than the "
        "paper: median difference in the RMS of e on the same samples, with its exact interval.",
        columns=(
            "actuator", "controller", "violations", "RMS of e", "largest |u|", "energy of u",
            "less than the paper", "from", "to",
        ),
        rows=[
            (
                RIVAL_ACTUATORS[row["actuator"]], row["controller"], failed_text(row),
                *(float(f"{row[key]:.3g}") for key in (
                    "late_rms", "peak_u", "energy", "less", "less_low", "less_high",
                )),
            )
            for row in rows.to_dict("records")
        ],
        folded=True,
    )  # fmt: skip
