"""How much of a run is the integrator's: other tolerances, another method."""

from __future__ import annotations

import numpy as np
import pandas as pd

from nlctl.native import compile as compiled
from nlctl.native import uninterrupted
from nlctl.response import input_output_response

from .cases import CASES, Case
from .reproduction import sample_times

_REFERENCE = ("tsit5", 1e-10)
_OTHERS = (("tsit5", 1e-9), ("tsit5", 1e-8), ("rodas5p", 1e-8))  # the report's own is the first


def numerics() -> pd.DataFrame:
    """Run the published cases with other integrators, and compare with the tightest.

    Returns
    -------
    pandas.DataFrame
        One row per case, method (Tsitouras 5(4), explicit; Rodas5P, stiff) and relative tolerance
        ``rtol`` (the absolute one is a hundredth), with the largest differences of ``e`` and
        ``zeta`` over all samples from tsit5 at 1e-10; NaN where a run did not end.
    """
    rows = []
    for case in (c for c in CASES if c.group == "published"):
        best = _signals(case, *_REFERENCE)
        for method, rtol in _OTHERS:
            apart = np.max(np.abs(_signals(case, method, rtol) - best), axis=1)
            row = {"case": case.key, "method": method, "rtol": rtol}
            rows.append(row | {"e": float(apart[0]), "zeta": float(apart[1])})
    return pd.DataFrame(rows)


def _signals(case: Case, method: str, rtol: float) -> np.ndarray:
    """Return e and zeta at the sample times, NaN after the end of a run."""
    times = sample_times()
    response = uninterrupted(
        input_output_response(
            compiled(case.diagram), times, rtol=rtol, atol=rtol / 100, method=method,
            ignore_errors=True, max_steps=3_000_000,
        )
    )  # fmt: skip
    signals = np.full((2, times.size), np.nan)
    signals[:, : response.time.size] = [response.outputs[name] for name in ("e", "zeta")]
    return signals
