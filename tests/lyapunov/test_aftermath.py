"""A burst bounded by the integral of N, and what becomes of forecasts."""

import dataclasses

import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row
from scipy.integrate import quad, solve_ivp

from nlctl.analysis.lyapunov import aftermath
from nlctl.analysis.lyapunov.nussbaum.long_run import outcome
from nlctl.analysis.lyapunov.nussbaum.property import lobe_around
from nlctl.analysis.lyapunov.nussbaum.slow_drift import Balance, SlowDrift
from nlctl.errors import ParameterError
from nlctl.functions import nussbaum_integral

BETA = 2.0


def growing(zeta):
    """A Nussbaum function with lobes that grow, and zeros at odd zeta."""
    return -(zeta**4) * np.sin(np.pi / 2 * (zeta - 1)) / 20


def shrinking(zeta):
    """One whose next lobe is too small to take the energy away."""
    return -20 * np.exp(-zeta) * np.sin(np.pi / 2 * (zeta - 1))


def crossed(N, kG, a, r0, zeta):
    """r' = k G(t) N eta + a r, eta = beta r, zeta' = r eta, until r is a millionth of its peak."""

    def rhs(t, x):
        eta = BETA * x[1]
        return x[1] * eta, kG(t) * N(x[0]) * eta + a * x[1]

    run = solve_ivp(rhs, (0.0, 5.0), [zeta, r0], "LSODA", rtol=1e-9, atol=1e-12)
    return run.y


@settings(max_examples=many(15, part=2), deadline=None)
@given(
    st.floats(0.5, 3.0), st.floats(0.0, 0.9), st.floats(0.1, 60.0), st.floats(0, 6),
    st.floats(-1.0, 1.0), st.floats(0.2, 2.0),
)  # fmt: skip
def test_a_burst_stays_within_its_bounds(mean, swing, w, phase, a, r0):
    """Simulated with a gain that varies in time within bounds, and with a drag."""
    low, high = mean * (1 - swing), mean * (1 + swing)
    zeta, r = crossed(growing, lambda t: mean * (1 + swing * np.sin(w * t + phase)), a, r0, 3.05)
    told = aftermath(3.05, growing, kG=(low, high), energy=r0**2 / 2, drag=abs(a) / BETA)
    least, most = told.peak
    assert least * (1 - 1e-3) <= np.abs(r).max() <= most * (1 + 1e-6)  # seen at steps only
    if abs(r[-1]) < 1e-3 * np.abs(r).max():  # it has ended
        assert told.rest[0] - 1e-3 <= zeta[-1] <= told.rest[1] + 1e-3


@pytest.mark.parametrize("kG", [0.3, 1.0, 25.0])
def test_a_constant_gain_ends_where_the_integral_is_0(kG):
    """By quadrature and in closed form; neither knows k G."""
    told = aftermath(3.0, growing, kG=(kG, kG))
    low, high = told.rest
    assert low == pytest.approx(high, abs=1e-9)
    assert quad(growing, 3.0, low)[0] == pytest.approx(0.0, abs=1e-6 * told.wrong.budget)
    assert told.peak[0] == pytest.approx(np.sqrt(2 * kG * quad(growing, 3.0, 5.0)[0]), rel=1e-6)
    paper = aftermath(3.0, kG=(kG, kG)).rest[0]
    assert nussbaum_integral(paper) == pytest.approx(nussbaum_integral(3.0), rel=1e-6)


def test_a_lobe_that_is_too_small_bounds_nothing():
    """Then zeta may cross it, and what comes is not told."""
    told = aftermath(3.0, shrinking, kG=(1.0, 2.0))
    assert told.peak[1] == told.rest[1] == np.inf
    assert np.isfinite(told.peak[0])
    wide = aftermath(3.0, growing, kG=(1e-3, 1e3))
    assert wide.rest[1] == np.inf


def test_what_is_no_burst_is_refused():
    """N of the right sign, and a gain without sign."""
    with pytest.raises(ParameterError, match="a burst is fed where N > 0"):
        aftermath(2.0)
    with pytest.raises(ParameterError, match="kG"):
        aftermath(3.5, kG=(-1.0, 1.0))
    with pytest.raises(ParameterError, match="energy"):
        aftermath(3.5, energy=-1.0)


def forecast(**changes):
    """Made after 100 s, at zeta = 2: a burst at 1000 s."""
    made = SlowDrift(
        time=100.0, zeta=2.0, lobe=lobe_around(2.0), spent=1.0, window=10.0, rates=(0.4, 0.4),
        burst=1000.0, burst_range=(900.0, 1200.0), balance=Balance(p=0.0, q=-0.4, residual=0.0),
        rest=None, rest_range=None, peak=1.0, mismatch=0.0,
    )  # fmt: skip
    return dataclasses.replace(made, **changes)


RESTING = {"rest": 2.4, "rest_range": (2.3, 3.0), "burst": np.inf, "burst_range": (900.0, np.inf)}
REVERSED = {"rates": (-0.1, -0.1), "burst": np.inf, "burst_range": (900.0, np.inf)}
TIME = np.linspace(0.0, 2000.0, 20_001)
CASES = {  # forecast, zeta over TIME, until (s), what became of it
    "a burst in the range": ({}, 2 + TIME / 1000, 2000, "held"),
    "a burst too early": ({}, 2 + TIME / 850, 2000, "failed"),
    "a burst too late": ({}, 2 + TIME / 1300, 2000, "failed"),
    "no burst, and the range has passed": ({}, 2 + TIME / 4000, 1300, "failed"),
    "no burst yet": ({}, 2 + TIME / 4000, 1100, "open"),
    "at rest where it was told": (RESTING, 2.4 - 0.4 * np.exp(-TIME / 100), 2000, "held"),
    "at rest beyond": (RESTING, 2.43 - 0.4 * np.exp(-TIME / 100), 2000, "failed"),
    "at rest before": (RESTING, 2.3 - 0.3 * np.exp(-TIME / 100), 2000, "open"),
    "passing by": (RESTING, 2 + TIME / 5000, 2000, "open"),
    "a burst where a rest was told": (RESTING, 2 + TIME / 1000, 2000, "failed"),
    "soon after it was told": (RESTING, 2 + TIME / 1000, 110, "open"),
    "a burst after a fall was told": (REVERSED, 2 + TIME / 1000, 2000, "failed"),
    "falling on": (REVERSED, 2 - TIME / 10_000, 2000, "open"),
}


@each_row("name", CASES)
def test_what_became_of_a_forecast(name):
    """Of bursts and of rests, also of those that look right at first."""
    changes, zeta, until, wanted = CASES[name]
    seen = until >= TIME
    assert outcome(forecast(**changes), TIME[seen], zeta[seen]) == wanted
