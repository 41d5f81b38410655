"""Example 2 through its burst: averaged against the exact loop, and against the integral of N."""

import functools

import numpy as np
import pytest

import nlctl
from nlctl.analysis.lyapunov import read_parts
from nlctl.analysis.lyapunov.nussbaum.long_run import long_run
from nlctl.analysis.lyapunov.nussbaum.property import antiderivative
from nlctl.analysis.paper.burst import averaged, through_the_burst
from nlctl.diagrams import state_names

pytestmark = pytest.mark.slow

START = {"law.zeta": 2.9917}  # just below the end of the lobe: it bursts within seconds


@functools.cache
def parts():
    return read_parts(nlctl.paper.example_2())


@functools.cache
def exact():
    return long_run(nlctl.paper.example_2(), 60.0, start=START)


@functools.cache
def carried():
    return through_the_burst(exact())


def test_the_averaged_loop_is_the_exact_one_while_v_sweeps_the_ripple():
    """From |u| = 500 to where the exact run is given up: r, u and zeta to 2 %."""
    loop, end = nlctl.paper.example_2(), float(exact().time[-1])
    times = np.concatenate([np.linspace(0, end - 1e-3, 2001), np.linspace(end - 9.9e-4, end, 991)])
    run = nlctl.input_output_response(
        nlctl.compile(loop), times, 0, START, rtol=1e-6, atol=1e-8, ignore_errors=True
    )
    rows = dict(zip(run.output_labels, np.asarray(run.outputs), strict=True))
    i = int(np.flatnonzero(np.abs(rows["u"]) < 500)[-1])
    state = dict(zip(state_names(loop), np.asarray(run.states)[:, i], strict=True))
    start, left = float(run.time[i]), run.time[i:] - run.time[i]
    smooth = averaged(parts(), start)
    x0 = [state[name] for name in state_names(smooth)]
    told = nlctl.input_output_response(smooth, left, 0, x0, rtol=1e-9, atol=1e-11)
    found = dict(zip(told.output_labels, np.asarray(told.outputs), strict=True))
    assert abs(rows["u"][-1]) > 2e3
    for name in ("r", "u"):
        assert found[name][-1] == pytest.approx(rows[name][-1], rel=0.02)
    assert found["zeta"][-1] == pytest.approx(rows["zeta"][-1], abs=1e-3)


@pytest.mark.weekly
def test_the_burst_obeys_the_integral_of_n():
    """r^2/2 grows by k G int N, with the mean gain at the place of the burst; it ends where the
    integral is 0."""
    burst, N = carried(), antiderivative(parts().law.N)
    zeta, r = burst.signals["zeta"], burst.signals["r"]
    fed = N(zeta) - N(zeta[0])
    large = np.abs(r) > 1e3
    gain = (r[large] ** 2 - r[0] ** 2) / 2 / fed[large]
    assert gain.max() / gain.min() == pytest.approx(1.0, abs=1e-2)
    mean = 1.2 * 1.1 * (2 + np.cos(exact().last[0]))
    assert gain[0] == pytest.approx(mean, rel=1e-2)
    assert N(burst.rest) == pytest.approx(N(zeta[0]), abs=1e-3 * burst.bounds.wrong.budget)


def test_the_burst_lies_within_its_bounds_and_ends_calmly():
    """Finite, short, and small errors afterwards, whatever large constant stands for |N|."""
    burst = carried()
    peak, largest = burst.peaks
    assert burst.bounds.peak[0] <= peak <= burst.bounds.peak[1] < 1.1e5
    assert burst.bounds.rest[0] <= burst.rest <= burst.bounds.rest[1]
    assert largest > 1e12
    assert burst.lasted < 1e-3
    assert burst.apart < 5e-3
    assert burst.calm < 0.06
    assert np.all(np.diff(burst.signals["zeta"]) > -1e-6)


def test_a_run_without_a_burst_is_not_carried_on():
    """Nor one whose last state is not known."""
    assert through_the_burst(long_run(nlctl.paper.example_2(), 20.0)) is None
