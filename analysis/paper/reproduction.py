"""Running the cases and comparing them with what a right implementation reaches."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
import pandas as pd

from nlctl import native
from nlctl.annotations import as_annotated
from nlctl.arguments import number
from nlctl.native import (
    compile,  # noqa: A004 (what it does)
    uninterrupted,
)
from nlctl.native import compile as compiled
from nlctl.response import input_output_response

from ..metrics import Metric, over
from .cases import CASES, HORIZON, METRICS, Case


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


@dataclass(frozen=True, kw_only=True)
class CaseRun:
    """A simulated case: times (s), signals by name, and its metrics by key."""

    case: Case
    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    metrics: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Check:
    """A figure that was reached or missed."""

    expectation: Expectation
    metric: Metric
    value: float

    @property
    def error(self) -> float:
        """Distance from the expected value."""
        return abs(self.value - self.expectation.value)

    @property
    def passed(self) -> bool:
        """Whether the distance is within the tolerance; false for NaN."""
        return self.error <= self.expectation.tolerance


@as_annotated
def sample_times(horizon: float = HORIZON) -> np.ndarray:
    """Return output times (s): 0.2 ms apart in the first half second, then 5 ms.

    The largest control input is a peak of a few milliseconds in the first half second.

    Parameters
    ----------
    horizon : float, optional
        End (s).

    Returns
    -------
    ndarray of shape (m,)
        From 0 to the horizon (s).

    Raises
    ------
    ParameterError
        If the horizon does not lie beyond the first half second.
    """
    horizon = number("sample_times", "horizon", horizon, above=0.5, at_most=1e6)
    early = np.linspace(0, 0.5, 2501)
    return np.concatenate(
        [early, np.linspace(0.5, horizon, round((horizon - 0.5) / 0.005) + 1)[1:]]
    )


@as_annotated
def run_case(case: Case) -> CaseRun:
    """Simulate a case over the paper's horizon, its diagram compiled to machine code.

    The tests compare the published cases with plain python-control.

    Parameters
    ----------
    case : Case
        What is run.

    Returns
    -------
    CaseRun
        Signals over the paper's horizon, and metrics.

    Raises
    ------
    nlctl.errors.DivergedError
        If the loop diverges.
    """
    diagram = case.diagram
    atol = 1e-2 * case.rtol
    response = input_output_response(compile(diagram), sample_times(), rtol=case.rtol, atol=atol)
    return measured(case, response.time, dict(zip(diagram.output_labels, response.y, strict=True)))


@as_annotated
def measured(case: Case, time: np.ndarray, signals: Mapping[str, np.ndarray]) -> CaseRun:
    """Return a run with its metrics, whatever simulated it.

    Parameters
    ----------
    case : Case
        What was run.
    time : ndarray of shape (m,)
        Times (s).
    signals : mapping
        Samples of shape (m,) by name.

    Returns
    -------
    CaseRun
        Signals and metrics.
    """
    metrics = {m.key: m.function(*over(time, signals[m.signal], m.start, m.end)) for m in METRICS}
    return CaseRun(case=case, time=time, signals=signals, metrics=metrics)


@as_annotated
def run_all(
    cases: Iterable[Case], *, done: Callable[[Case], object] | None = None
) -> dict[str, CaseRun]:
    """Simulate cases and return them by key, in order.

    `done` is called with each case when it is finished.

    Parameters
    ----------
    cases : iterable of Case
        What is run, one after the other.
    done : callable, optional
        See above.

    Returns
    -------
    dict of str to CaseRun
        Signals and metrics of each case by its key.
    """
    results = {}
    for case in cases:
        results[case.key] = run_case(case)
        if done is not None:
            done(case)
    return results


@as_annotated
def compile_cases_ahead(cases: Iterable[Case]) -> None:
    """Compile the diagrams of cases, which otherwise happens when they are run.

    Parameters
    ----------
    cases : iterable of Case
        Those that will be run.
    """
    for case in cases:
        native.compile_ahead(compile(case.diagram))


@as_annotated
def checks(runs: Mapping[str, CaseRun]) -> list[Check]:
    """Compare runs with the figures to reach; cases that were not run are left out.

    Parameters
    ----------
    runs : mapping
        `CaseRun` by the key of the case, as `run_all` returns them.

    Returns
    -------
    list of Check
        One for each figure, with the value that the run has.
    """
    by_key = {m.key: m for m in METRICS}
    return [
        Check(
            expectation=e,
            metric=by_key[e.metric],
            value=runs[e.case].metrics.get(e.metric, math.nan),
        )
        for e in expectations()
        if e.case in runs
    ]


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
