"""What the studies ``reports/rivals-1.toml`` and ``rivals-2.toml`` found: a kept record.

``python campaign/rival_runs.py``, in a checkout, runs both again.
"""

from __future__ import annotations

import json
import math
import tomllib
from hashlib import sha256
from pathlib import Path
from typing import Any

import pandas as pd

from nlctl import paper

from ..loop_record import loop_facts, loop_values
from ..studies import shipped
from .rivals import rival_loop

RIVALS_RECORD = Path(__file__).with_name("rivals.csv")
KEY = ["parameters", "rates"]
RIVAL_ACTUATORS = {"ideal": "no nonlinearity"} | {
    name: name for name in ("dead zone", "backlash", "saturation")
}
"""What tables call the actuators of `nlctl.analysis.paper.rivals.rival_actuators`."""


def rivals_study(example: str) -> Path:
    """Return the study file of an example."""
    return shipped(f"rivals-{example[-1]}")


def study_key(example: str) -> str:
    """Return a key of all that the study file of an example asks; comments do not count."""
    asked = tomllib.loads(rivals_study(example).read_text(encoding="utf-8"))
    return sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()[:12]


def loop_key(example: str, controller: str, actuator: str) -> tuple[str, float]:
    """Return a key that differs where the loops of two pairs differ."""
    loop = rival_loop(example, f"{controller} / {actuator}")
    facts = loop_facts(loop)
    held = json.dumps([facts["parameters"], facts["initial_state"]], sort_keys=True)
    values = loop_values(loop, 20.0).values()
    size = sum(abs(value) for value in values if not isinstance(value, str))
    return sha256(held.encode()).hexdigest()[:12], size


def checked_rivals(path: Path = RIVALS_RECORD) -> pd.DataFrame:
    """Return the record, if it is of the study files and of the loops of today."""
    record = pd.read_csv(path)
    again = "make it again with 'python campaign/rival_runs.py'"
    for example in paper.EXAMPLES:
        keys = set(record.loc[record["example"] == example, "study"])
        if keys != {study_key(example)}:
            raise ValueError(
                f"the record of rivals in '{example}' is of another study than "
                f"reports/rivals-{example[-1]}.toml: {again}"
            )
    asked = ["example", "controller", "actuator"]
    for example, controller, actuator, held, rates in record[[*asked, *KEY]].itertuples(
        index=False
    ):
        now = loop_key(example, controller, actuator)
        if now[0] != held or not math.isclose(now[1], rates, rel_tol=1e-5):
            raise ValueError(
                f"the record of rivals in '{example}' is of another loop of '{controller}' behind "
                f"'{actuator}' (parameters {held}, rates {rates:.6g}; now {now[0]}, {now[1]:.6g}): "
                + again
            )
    return record


def beaten_by(record: pd.DataFrame, example: str) -> dict[str, dict[str, tuple[str, ...]]]:
    """Return who beats the paper's controller as printed, and whom it beats, by actuator."""
    # One beats another with no more violations of the spec and a smaller RMS of e from 10 s on: the
    # exact interval of the median difference on the same samples is on one side of 0.
    tallies = {}
    for actuator, runs in record[record["example"] == example].groupby("actuator", sort=False):
        lines: list[dict[str, Any]] = runs.to_dict("records")  # type: ignore[assignment]
        (printed,) = (line for line in lines if line["controller"] == "paper")
        limit = printed["violations"]
        better = [r for r in lines if r["less_low"] > 0 and r["violations"] <= limit]
        worse = [r for r in lines if r["less_high"] < 0 and r["violations"] >= limit]
        tallies[str(actuator)] = {
            "beaten by": tuple(r["controller"] for r in better),
            "beats": tuple(r["controller"] for r in worse),
        }
    return tallies


def failed_text(row: dict[str, Any]) -> str:
    """Return how many runs violate the spec, and in brackets how many of them did not end."""
    return f"{row['violations']}" + (f" ({row['failed']})" if row["failed"] else "")
