"""The kept record of Example 2 until its gain loses the sign: minutes of computing, once.

``python campaign/burst_record.py``, in a checkout, makes it again, from runs at two tolerances
whose bursts must agree.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..lyapunov.nussbaum.long_run import LONG_RUN_SIGNALS, LongRun

RECORD = Path(__file__).with_name("example-2-burst.csv")
AGREE = 5.0  # s; bursts at two tolerances differ by less


def read_record(beginning: LongRun, path: Path = RECORD) -> LongRun:
    """Return the record as a run, with the lobe and the predictions of a run made today."""
    with path.open(encoding="utf-8") as file:
        about = json.loads(file.readline().removeprefix("# "))
        time, *rows = np.loadtxt(file, delimiter=",").T
    signals = dict(zip(LONG_RUN_SIGNALS, rows, strict=True))
    about["again"] = about["again"] and tuple(about["again"])
    about["last"] = tuple(about.get("last", ()))
    return replace(beginning, time=time, signals=signals, **about)


def continued(beginning: LongRun, record: LongRun) -> LongRun:
    """Return a run that continues the record where it ends."""
    end = beginning.time[-1]
    before = float(np.interp(end, record.time, record.signals["zeta"]))
    if not abs(before - beginning.signals["zeta"][-1]) < 1e-4:
        raise ValueError(
            f"the record of '{record.loop}' has zeta = {before:.5f} at {end:g} s, a run of today "
            f"{beginning.signals['zeta'][-1]:.5f}: make it again with "
            "'python campaign/burst_record.py', in a checkout"
        )
    later = record.time > end
    signals = {
        name: np.append(y, record.signals[name][later]) for name, y in beginning.signals.items()
    }
    return replace(record, time=np.append(beginning.time, record.time[later]), signals=signals)
