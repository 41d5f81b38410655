"""The studies ``reports/rivals-1.toml`` and ``rivals-2.toml`` run again: six minutes.

    python campaign/rival_runs.py

It writes the record that the paper's page reads, and prints the tables of
``docs/explanation/rivals.md``.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pandas as pd
from page_tables import markdown_table

from nlctl import paper
from nlctl.analysis.paper.rivals import (
    KEY,
    RIVAL_ACTUATORS,
    RIVALS_RECORD,
    failed_text,
    loop_key,
    rivals_study,
    study_key,
)
from nlctl.analysis.studies import Result, read_study, run


def rival_rows(result: Result, example: str) -> pd.DataFrame:
    """Return what a run of the study found, a line for each controller behind each actuator."""
    rows, key = [], study_key(example)
    for finding in result.findings:
        pairs = finding.tables["differences"].loc["late_rms"]
        actuator = result.asked[finding.key].options["actuator"]
        ranking = finding.tables["ranking"]
        for label in ("paper", *pairs.loc["paper"].index):
            of_controller: Any = ranking.loc[label]
            less = (0.0,) * 3 if label == "paper" else pairs.loc[("paper", label)]
            rows.append(
                {"example": example, "study": key, "actuator": actuator}
                | {"controller": label}
                | dict(zip(KEY, loop_key(example, label, actuator), strict=True))
                | {"samples": finding.numbers["samples"]}
                | {key: int(of_controller[key]) for key in ("violations", "failed")}
                | {
                    key: of_controller[f"median {key}"]
                    for key in ("late_rms", "iae", "peak_u", "energy")
                }
                | dict(zip(("less", "less_low", "less_high"), tuple(less)[:3], strict=True))
            )
    return pd.DataFrame(rows)


def rivals_text(record: pd.DataFrame, example: str) -> str:
    """Return the record of an example as a table in Markdown, controllers x actuators.

    A cell has violations (of which did not end), median RMS of e and median largest abs(u).
    """
    of_example: Any = record[record["example"] == example]
    cells = [
        f"{failed_text(r)}; {r['late_rms']:.4f}; {r['peak_u']:.1f}"
        for r in of_example.to_dict("records")
    ]
    table = of_example.assign(cell=cells).pivot(
        index="controller", columns="actuator", values="cell"
    )
    labels = list(dict.fromkeys(of_example["controller"]))
    rows = ((label, *table.loc[label, list(RIVAL_ACTUATORS)]) for label in labels)
    return markdown_table(("controller", *RIVAL_ACTUATORS.values()), rows)


def _main() -> None:
    """Make the record again."""
    tables = []
    with tempfile.TemporaryDirectory() as folder:
        for example in paper.EXAMPLES:
            result = run(read_study(rivals_study(example)), Path(folder) / example)
            tables.append(rival_rows(result, example))
    record = pd.concat(tables)
    record.to_csv(RIVALS_RECORD, index=False, float_format="%.6g")
    for example in paper.EXAMPLES:
        print(rivals_text(record, example) + "\n")


if __name__ == "__main__":
    _main()
