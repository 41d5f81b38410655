"""Where the examples stop meeting their spec on a computer: a kept record, compared with runs.

It has every controller of `controllers.compared_controllers` by Euler's method, over the sampling
time, the delay and the steps of both converters; ``python campaign/sampling_runs.py``, in a
checkout, makes it again.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nlctl import paper
from nlctl.attributes import described_record
from nlctl.native import Compiled, ensemble_response
from nlctl.native import compile as compiled_loop
from nlctl.sampling import sampled

from .controllers import compared_controllers
from .reproduction import HORIZON, TAIL

SAMPLING_RECORD = Path(__file__).with_name("sampling-limits.csv")
BAND, PEAK = 0.15, 15.0  # the spec of reports/example-1.toml: |y - yd| from 10 s on, and |u|
_STEP = 0.002  # s: sampling time where something else is varied
_WAITING = 20  # sampling times that the longest delay takes
_COARSE = 13  # values over the whole range
_LOOK = 1e-3  # s: nothing that is held is missed
_EFFORT = 60_000  # steps of a run; one at 1 ms takes 20,000


@described_record
class Quantity:
    """Something of the computer that is varied."""

    key: str  # Name of the parameter, behind ``"sampling."``.
    title: str  # What it is called on the page.
    unit: str
    factor: float  # From the parameter's unit to `unit`.
    low: float  # Range, in the parameter's unit.
    high: float

    @property
    def values(self) -> np.ndarray:
        """What is tried first."""
        return np.geomspace(self.low, self.high, _COARSE)


QUANTITIES = (
    Quantity(key="dt", title="sampling time", unit="ms", factor=1e3, low=1e-3, high=0.1),
    Quantity(key="delay", title="delay", unit="ms", factor=1e3, low=1e-3, high=_WAITING * _STEP),
    Quantity(
        key="input_quantum",
        title="step of the measurements",
        unit="1",
        factor=1.0,
        low=1e-3,
        high=1.0,
    ),
    Quantity(
        key="output_quantum", title="step of the input u", unit="1", factor=1.0, low=0.01, high=10.0
    ),
)


def controller_program(controller: Any, *, delays: bool = False) -> Any:
    """Return a controller as a program with Euler's method, of which `QUANTITIES` may be varied."""
    if delays:
        return sampled(controller, _STEP, method="euler", delay=_STEP, waiting=_WAITING)
    return sampled(controller, _STEP, method="euler", input_quantum=0.0, output_quantum=0.0)


def sampling_runs(example: str, label: str, values: Mapping[str, np.ndarray]) -> pd.DataFrame:
    """Run an example with one controller on a computer, at some values of some quantities."""
    controller = compared_controllers(example)[label]
    loops: dict[bool, Compiled] = {}
    tables = []
    for quantity in QUANTITIES:
        if quantity.key not in values:
            continue
        delays = quantity.key == "delay"
        if delays not in loops:
            program = controller_program(controller, delays=delays)
            loops[delays] = compiled_loop(paper.EXAMPLES[example](controller=program))
        table = _runner(loops[delays], quantity)(np.asarray(values[quantity.key], dtype=float))
        tables.append(table.assign(quantity=quantity.key))
    joint = pd.concat(tables, ignore_index=True).assign(example=example, controller=label)
    return joint.reindex(columns=["example", "controller", "quantity", "value", "error", "peak"])


def _runner(loop: Compiled, quantity: Quantity) -> Callable[[np.ndarray], pd.DataFrame]:
    """Return what runs a loop over values of a quantity."""
    times = np.linspace(0, HORIZON, round(HORIZON / _LOOK) + 1)

    def run(values: np.ndarray) -> pd.DataFrame:
        responses = ensemble_response(
            loop, times, params={f"sampling.{quantity.key}": values}, keep=("y", "yd", "u"),
            max_steps=_EFFORT,
        )  # fmt: skip
        late = times >= TAIL
        error = np.abs(responses.signals["y"] - responses.signals["yd"])[:, late].max(axis=1)
        peak = np.abs(responses.signals["u"]).max(axis=1)
        return pd.DataFrame({"value": values, "error": error, "peak": peak})

    return run


def meets_the_spec(table: pd.DataFrame) -> np.ndarray:
    """Return which runs keep abs(y - yd) <= 0.15 from 10 s on and abs(u) <= 15; NaN does not."""
    return ((table["error"] <= BAND) & (table["peak"] <= PEAK)).to_numpy()


def where_it_ends(table: pd.DataFrame) -> tuple[float, float]:
    """Return up to which value all runs meet the spec, and the next one, which does not."""
    # NaN where there is none: the first value violates, or all are good.
    ordered = table.sort_values("value")
    bad, values = np.flatnonzero(~meets_the_spec(ordered)), ordered["value"].to_numpy()
    if not bad.size:
        return float(values[-1]), np.nan
    return (float(values[bad[0] - 1]) if bad[0] else np.nan), float(values[bad[0]])


def spec_ends(record: pd.DataFrame) -> pd.DataFrame:
    """Return where each controller's spec ends."""
    rows: dict[Any, dict[tuple[str, str], float]] = {}
    for place, part in record.groupby(["example", "controller"], sort=False):
        rows[place] = {}
        for quantity in QUANTITIES:
            good, bad = where_it_ends(part.query("quantity == @quantity.key"))
            rows[place] |= {(quantity.key, "good"): good, (quantity.key, "bad"): bad}
    return pd.DataFrame.from_dict(rows, orient="index")


def checked_record(path: Path = SAMPLING_RECORD) -> pd.DataFrame:
    """Return the record, if the paper's own loops are those of which it was made."""
    record = pd.read_csv(path)
    for example in paper.EXAMPLES:
        papers = (record["example"] == example) & (record["controller"] == "paper")
        one = record[papers & (record["quantity"] == "dt")].iloc[[_COARSE // 2]]
        check_lines(one, sampling_runs(example, "paper", {"dt": one["value"].to_numpy()}))
    return record


def check_lines(kept: pd.DataFrame, today: pd.DataFrame) -> None:
    """Compare lines of the record with runs of today, to 1e-3."""
    columns = ["error", "peak"]
    a, b = (table[columns].to_numpy() for table in (kept, today))
    if not np.allclose(a, b, rtol=1e-3, atol=0, equal_nan=True):
        line = kept.iloc[0]
        raise ValueError(
            f"the record of '{line['example']}' with the controller '{line['controller']}' has "
            f"{a.ravel()} at {line['quantity']} = {line['value']:g}, a run of today {b.ravel()}: "
            "make it again with 'python campaign/sampling_runs.py'"
        )
