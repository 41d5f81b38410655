"""The record of Example 2 until its gain loses the sign, made again: minutes of computing.

    python campaign/burst_record.py

Runs at two tolerances, whose bursts must agree.
"""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from nlctl import paper
from nlctl.analysis.lyapunov.nussbaum.long_run import LONG_RUN_SIGNALS, LOOKS, LongRun, long_run
from nlctl.analysis.paper.evidence import AGREE, RECORD

TOLERANCES = (1e-6, 1e-7)  # relative; the record is of the second
_WINDOW = 4 * np.pi  # s; period of the paper's reference: one row in each, where |e| is largest
LAST, _STEP, PER_DECADE = 100.0, 0.5, 60  # s, s; the last seconds by time left until the end


def thinned_run(run: LongRun) -> LongRun:
    """Return a run with fewer samples, which its figure and its `burst` and `calm` do not miss.

    Kept are the largest \\|e\\| of each period, the two samples around the burst, one in half a
    second of the last hundred, of the last second as many in each decade of time left, and those
    at which predictions are made.
    """
    time, error = run.time, np.abs(run.signals["e"])
    number = np.floor(time / _WINDOW).astype(int)
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    ends = [*starts[1:], time.size]
    peaks = [a + int(np.argmax(error[a:b])) for a, b in zip(starts, ends, strict=True)]
    left = np.concatenate([np.arange(LAST, 1.0, -_STEP), np.geomspace(1.0, 1e-5, 5 * PER_DECADE)])
    late = np.searchsorted(time, time[-1] - left)
    cross = np.searchsorted(run.signals["zeta"], run.lobe.high) + np.array([-1, 0])
    calm = np.searchsorted(time, run.burst - 1.0, "right") - 1
    looks = np.searchsorted(time, list(LOOKS))
    keep = np.unique(np.concatenate([peaks, late, cross, looks, [0, calm, time.size - 1]]))
    keep = keep[keep < time.size]
    signals = {name: y[keep] for name, y in run.signals.items()}
    return replace(run, time=time[keep], signals=signals)


def agreed(run: LongRun, other: LongRun) -> LongRun:
    """Return a run with the burst that another one at another tolerance has."""
    if not abs(run.burst - other.burst) < AGREE:
        raise ValueError(
            f"'{run.loop}' bursts at {run.burst:.1f} s at rtol {run.rtol:g} and at "
            f"{other.burst:.1f} s at rtol {other.rtol:g}: a record needs tolerances at which these "
            f"agree to {AGREE:g} s"
        )
    return replace(run, again=(other.rtol, other.burst))


def write_record(run: LongRun, path: Path = RECORD) -> None:
    """Write a run as CSV; the first line says what it is, in JSON."""
    about = {
        name: getattr(run, name) for name in ("loop", "horizon", "rtol", "lost", "again", "last")
    }
    rows = np.column_stack([run.time, *(run.signals[name] for name in LONG_RUN_SIGNALS)])
    names = ",".join(["time", *LONG_RUN_SIGNALS])
    formats = ["%.6f", *["%.7g"] * len(LONG_RUN_SIGNALS)]
    header = f"{json.dumps(about)}\n{names}"
    np.savetxt(path, rows, fmt=formats, delimiter=",", header=header, comments="# ")


def _main() -> None:
    """Make the record again, the two runs at the same time."""
    with ThreadPoolExecutor(len(TOLERANCES)) as pool:
        waiting = [pool.submit(long_run, paper.example_2(), rtol=rtol) for rtol in TOLERANCES]
        other, run = (future.result() for future in waiting)
    record = agreed(run, other)
    write_record(thinned_run(record))
    print(f"{record}\n{RECORD}: the predictions need {max(LOOKS):g} s of a run and are not kept")


if __name__ == "__main__":
    _main()
