"""The closed loops that the reproduction runs, and what a right implementation reaches."""

import csv
import math
from dataclasses import dataclass
from functools import partial
from importlib.resources import files

import numpy as np
import pandas as pd

from nlctl import actuators, paper
from nlctl.annotations import as_annotated
from nlctl.arguments import number
from nlctl.attributes import described_record
from nlctl.native import compile as compiled
from nlctl.native import uninterrupted
from nlctl.response import input_output_response

from ..metrics import Metric, final, highest, lowest, peak, rms
from ..reproductions.page import found_numbers
from ..reproductions.paper import FoundNumber, PaperCase, PaperRuns, Statement

HORIZON = 20.0
TAIL = HORIZON / 2
BOUND = 0.15  # of |e₁| from TAIL on: a sixth of the reference; the paper names none
_RTOL = 1e-9

_number = partial(Metric, unit="1")
_late = partial(_number, start=TAIL)
METRICS = (
    _late(key="tail_max_e", signal="e", meaning="max |e₁| for t ≥ 10 s", function=peak),
    _late(key="tail_rms_e", signal="e", meaning="RMS of e₁ for t ≥ 10 s", function=rms),
    _number(key="rms_e", signal="e", meaning="RMS of e₁", function=rms),
    _number(key="max_u", signal="u", meaning="max |u|", function=peak),
    _number(key="zeta_min", signal="zeta", meaning="min ζ", function=lowest),
    _number(key="zeta_max", signal="zeta", meaning="max ζ", function=highest),
    _number(key="zeta_end", signal="zeta", meaning="ζ(20 s)", function=final),
    _number(key="max_r", signal="r", meaning="max |r|", function=peak),
    _late(key="tail_max_r", signal="r", meaning="max |r| for t ≥ 10 s", function=peak),
    _number(key="max_delta_hat", signal="delta_hat", meaning="max δ̂", function=highest),
    _number(key="max_W", signal="W_norm", meaning="max ‖Ŵ‖", function=highest),
    _number(key="x1_end", signal="x1", meaning="x₁(20 s)", function=final),
    _number(key="x2_end", signal="x2", meaning="x₂(20 s)", function=final),
)


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


@described_record(eq=False)
class Case(PaperCase):
    """One closed loop of the paper, or of a choice that the paper leaves open."""

    title: str
    example: int  # 1 or 2.
    group: str  # ``"published"``, ``"choice"`` or ``"exchange"``.


def _case(key: str, title: str, group: str = "choice", **arguments: object) -> Case:
    """Return a case of the example that its key begins with."""
    example = int(key[0])
    return Case(
        key=key,
        title=title,
        example=example,
        group=group,
        make=partial(paper.EXAMPLES[f"example_{example}"], **arguments),
        times=sample_times(),
        rtol=_RTOL,
        atol=1e-2 * _RTOL,
        metrics=METRICS,
    )


CASES = (
    _case("1", "as published, diagonal centres", "published"),
    _case("1-3x9", "centres on a 3×9 grid", centres="3x9"),
    _case("1-9x3", "centres on a 9×3 grid", centres="9x3"),
    _case("1-integral", "forcing phase ∫w dt instead of w(t) t", phase="integral"),
    _case("1-p1", "p₁ = +0.2 instead of −0.2", p1=0.2),
    _case("1-backlash", "Example 2's backlash", "exchange", actuator=actuators.Backlash()),
    _case("2", "as published, 3×3×3 centres", "published"),
    _case("2-diagonal", "diagonal centres", centres="diagonal"),
    _case("2-lambdas", "r = 2e₁ + e₂ + e₃ instead of e₁ + 2e₂ + e₃", lambdas=(1.0, 2.0)),
    _case("2-v0-low", "v(0) = −0.6", v0=-0.6),
    _case("2-v0-high", "v(0) = 0.72", v0=0.72),
    _case("2-dead-zone", "Example 1's dead zone", "exchange", actuator=actuators.DeadZone()),
)


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
        Runs by the key of the case, as `nlctl.analysis.reproductions.paper.simulate_cases`
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
