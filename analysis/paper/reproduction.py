"""Runs of the cases compared with what a right implementation reaches."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.native import compile as compiled
from nlctl.native import uninterrupted
from nlctl.response import input_output_response

from ..reproductions.paper import FoundNumber, PaperRuns, Statement
from ..reproductions.sections import found_numbers
from .cases import CASES, METRICS, Case


@dataclass(frozen=True, kw_only=True)
class Expectation:
    """A figure to reach, as printed, and the tolerance that the simulation method allows.

    The values in ``expected.csv`` come from an independent computation with an event-located
    integrator of order eight; all digits shown are converged.
    """

    case: str
    metric: str
    printed: str
    tolerance: float

    @property
    def value(self) -> float:
        """The figure as a number."""
        return float(self.printed)


def expectations() -> list[Expectation]:
    """Read the figures to reach; no tolerance is below half a unit of the last printed digit.

    Returns
    -------
    list of Expectation
        As independent computations have found them.
    """
    text = files("nlctl.analysis.paper").joinpath("expected.csv").read_text(encoding="utf-8")
    return [
        Expectation(
            case=row["case"],
            metric=row["metric"],
            printed=row["value"],
            tolerance=max(
                float(row["tolerance"]), 0.5 * 10.0 ** -len(row["value"].partition(".")[2])
            ),
        )
        for row in csv.DictReader(text.splitlines())
    ]


def expected_statement(expected: Expectation) -> Statement:
    """Return a figure to reach as a statement of the paper's page."""
    case = {case.key: case for case in CASES}[expected.case]
    return Statement(
        claim="All numbers agree with an independent computation",
        part=f"example-{case.example}",
        case=case.title,
        quantity={m.key: m.meaning for m in METRICS}[expected.metric],
        printed=expected.printed,
        tolerance=expected.tolerance,
        value=lambda runs: runs[expected.case].metrics.get(expected.metric, math.nan),
    )


@as_annotated
def checks(runs: PaperRuns) -> list[FoundNumber]:
    """Compare runs with the figures to reach; cases that were not run are left out.

    Parameters
    ----------
    runs : mapping
        Runs by the key of the case, as `nlctl.analysis.reproductions.cases.simulate_cases`
        returns them.

    Returns
    -------
    list of FoundNumber
        One for each figure, with the value that the run has.
    """
    return found_numbers([expected_statement(e) for e in expectations() if e.case in runs], runs)


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
    response = uninterrupted(
        input_output_response(
            compiled(case.make()), case.times, rtol=rtol, atol=rtol / 100, method=method,
            ignore_errors=True, max_steps=3_000_000,
        )
    )  # fmt: skip
    signals = np.full((2, case.times.size), np.nan)
    signals[:, : response.time.size] = [response.outputs[name] for name in ("e", "zeta")]
    return signals
