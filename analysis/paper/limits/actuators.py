"""The paper's controller, unchanged, through every actuator of nlctl: a kept record.

``python -m analysis.paper.limits.actuators`` makes it again, in a minute, and prints the table of
``docs/explanation/actuators.md``.  Friction is left out: it takes a velocity and makes a force, and
is not an actuator of the form v = k(u, t) u + eps_u (2) between the controller and the plant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nlctl import actuators, native, paper
from nlctl.native import Status
from nlctl.response import input_output_response

from ...lyapunov.bounds.decomposition import DecompositionError, decompose
from ..cases import HORIZON, TAIL
from ..sampling_limits import meets_the_spec

__all__ = ["ACTUATOR_RECORD", "actuator_run", "actuators_of_the_table", "assumption", "table_text"]

ACTUATOR_RECORD = Path(__file__).with_name("actuator-limits.csv")
_COLUMNS = ["example", "actuator", "status", "time", "error", "peak", "assumption"]
_LOOK = 1e-3  # s: between samples
_EFFORT = 3_000_000  # steps of a run
_BOUND = 60.0  # largest |u| over which eps_u is bounded, as the ledger has it


def actuators_of_the_table() -> dict[str, Any]:
    """Return every actuator of nlctl that takes u and makes v, with its default values, by name."""
    records = {name: getattr(actuators, name) for name in actuators.__all__}
    return {
        name: record()
        for name, record in records.items()
        if isinstance(record, type) and _fits(record)
    }


def _fits(record: type) -> bool:
    return getattr(record, "inputs", ()) == ("u",) and getattr(record, "outputs", ()) == ("v",)


def assumption(actuator: Any) -> str:
    """Return the bounds of the split (2) of an actuator, or why it has none."""
    try:
        split = decompose(actuator, u_max=_BOUND)
    except DecompositionError as error:
        words = str(error).removesuffix("; replace the actuator")
        return words.removeprefix(f"{type(actuator).__name__} is ")
    eps = max(abs(split.eps_low), abs(split.eps_high))
    return f"{split.k_1:.3g} <= k <= {split.k_2:.3g}, abs(eps_u) <= {eps:.3g} ({split.provenance})"


def actuator_run(example: str, name: str) -> dict[str, Any]:
    """Run an example with one actuator in the place of its own.

    Parameters
    ----------
    example : {"example_1", "example_2"}
    name : str
        Of `actuators_of_the_table`.

    Returns
    -------
    dict
        example, actuator, status, time (s, at which the run ended), error (largest abs(y - yd)
        from 10 s on), peak (largest abs(u)), assumption; error and peak are NaN where the run does
        not reach its end.
    """
    actuator = actuators_of_the_table()[name]
    times = np.linspace(0, HORIZON, round(HORIZON / _LOOK) + 1)
    loop = paper.EXAMPLES[example](actuator=actuator)
    made: Any = native.uninterrupted(
        input_output_response(loop, times, ignore_errors=True, max_steps=_EFFORT)
    )
    row = {
        "example": example, "actuator": name, "status": made.statistics.status.name,
        "time": made.statistics.time, "error": np.nan, "peak": np.nan,
        "assumption": assumption(actuator),
    }  # fmt: skip
    if made.statistics.status is Status.OK:
        y, yd, u = (made.outputs[loop.output_index[signal]] for signal in ("y", "yd", "u"))
        row["error"] = float(np.abs(y - yd)[times >= TAIL].max())
        row["peak"] = float(np.abs(u).max())
    return row


def table_text(record: pd.DataFrame) -> str:
    """Return the record as a table in Markdown, with the spec of reports/example-1.toml."""
    lines = [
        "| example | actuator | spec | error after 10 s | largest abs(u) | Assumption 1 and (2) |",
        "|---|---|---|---|---|---|",
    ]
    for row, meets in zip(record.to_dict("records"), meets_the_spec(record), strict=True):
        number = row["example"][-1]
        if row["status"] == Status.OK.name:
            ended = "met" if meets else "violated"
            numbers = f"{row['error']:.3g} | {row['peak']:.3g}"
        else:
            how = row["status"].lower().replace("_", " ")
            ended, numbers = f"{how} at {row['time']:.3g} s", "- | -"
        lines.append(
            f"| {number} | {row['actuator']} | {ended} | {numbers} | {row['assumption']} |"
        )
    return "\n".join(lines)


def _main() -> None:
    """Make the record again."""
    rows = [
        actuator_run(example, name)
        for example in paper.EXAMPLES
        for name in actuators_of_the_table()
    ]
    made = pd.DataFrame(rows).reindex(columns=_COLUMNS)
    made.to_csv(ACTUATOR_RECORD, index=False, float_format="%.6g")
    print(table_text(made))


if __name__ == "__main__":
    _main()
