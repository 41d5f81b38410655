"""What lies between two samples of a run, or begins where a window ends, in closed form."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.metrics import breaks_of, highest, lowest, sampled_between
from nlctl.analysis.robustness import Requirement, always, eventually, in_band, margin
from nlctl.errors import ParameterError

TIMES = np.linspace(0, 10, 101)


def margin_of(formula, t, y, breaks):
    asked = Requirement(key="asked", formula=formula, until=10.0)
    return margin(asked, t, {"y": y}, breaks=breaks)


def pulsed(begin, width, height):
    """exp(-t), and a pulse that also moves a state."""

    def pulse(t):
        return height * (begin <= t < begin + width)

    return ct.nlsys(
        lambda t, x, u, params: [-x[0], pulse(t)], lambda t, x, u, params: [x[0] + pulse(t)],
        states=2, inputs=0, outputs=1, name="pulsed",
    )  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("engine", ["native", "python-control"])
@pytest.mark.parametrize(("begin", "width"), [(3.33, 0.02), (3.3, 0.1), (0.01, 1e-4), (9.8, 1e-6)])
def test_a_pulse_between_two_samples_has_its_height(begin, width, engine):
    loop, how = pulsed(begin, width, 5.0), {"engine": engine, "rtol": 1e-10, "atol": 1e-12}
    first = nlctl.input_output_response(loop, TIMES, 0, [1.0, 0.0], **how)
    with pytest.raises(ParameterError, match=r"breaks_of needs samples.*sampled_between"):
        breaks_of(first)
    finer = sampled_between(TIMES, first.events["time"])
    run = nlctl.input_output_response(loop, TIMES, 0, [1.0, 0.0], evaluation_times=finer, **how)
    t, y, breaks = run.time, run.outputs.ravel(), breaks_of(run)
    np.testing.assert_allclose(breaks, [begin, begin + width], rtol=0, atol=1e-12)
    top = 5 + np.exp(-begin)
    assert highest(t, y, breaks) == pytest.approx(top, abs=1e-6)
    assert lowest(t, y, breaks) == pytest.approx(np.exp(-10), abs=1e-6)
    low = in_band("y", upper=2.0, scale=1.0)
    middle = begin + width / 2
    assert margin_of(always(low), t, y, breaks) == pytest.approx(2 - top, abs=1e-6)
    for window in ((0.0, middle), (0.0, begin)):  # a window that ends where it begins has its side
        assert margin_of(always(low, *window), t, y, breaks) == pytest.approx(2 - top, abs=1e-6)
    late = 5 + np.exp(-middle)
    assert margin_of(always(low, middle, 10.0), t, y, breaks) == pytest.approx(2 - late, abs=1e-6)
    past = 2 - np.exp(-begin - width)
    assert margin_of(always(low, begin + width, 10.0), t, y, breaks) == pytest.approx(
        past, abs=1e-6
    )


def test_times_with_enough_samples_are_kept():
    times = np.linspace(0, 1, 21)
    np.testing.assert_array_equal(sampled_between(times, []), times)
    np.testing.assert_array_equal(sampled_between(times, [0.5]), times)
    np.testing.assert_array_equal(sampled_between(times, [-1.0, 0.0, 1.0, 2.0]), times)
    finer = sampled_between(times, [0.51, 0.52])
    assert finer.size == times.size + 9
    assert np.sum((finer > 0.51) & (finer < 0.52)) == 9


def test_no_two_samples_are_at_nearly_one_time():
    """Of 0.55 and what rounding makes of it a curve would learn rounding."""
    times = np.linspace(0, 10, 801)
    breaks = np.sort(np.concatenate([np.arange(0.25, 10, 0.25), np.arange(0.1, 10, 0.25)]))
    assert np.diff(sampled_between(times, breaks)).min() > 1e-4


@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_a_clock_that_is_faster_than_samples_gives_no_breaks(engine):
    """A held ramp: its steps are breaks where there are samples in between."""
    held = nlctl.sampled(ct.ss([], [], [], [[1.0]], 0.1, inputs="u", outputs="v", name="held"))
    ramp = ct.nlsys(None, lambda t, x, u, p: [t], inputs=0, outputs="u", name="ramp")
    loop = nlctl.interconnect({"ramp": ramp, "held": held}, outputs=["v"])
    fine = nlctl.input_output_response(loop, np.linspace(0, 1, 201), engine=engine)
    np.testing.assert_allclose(breaks_of(fine), np.arange(1, 10) / 10, atol=1e-12)
    coarse = nlctl.input_output_response(loop, np.linspace(0, 1, 5), engine=engine)
    assert np.isin(coarse.jump_times, breaks_of(coarse)).sum() <= 3
    late = always(in_band("v", lower=0.35, scale=1.0), 0.42, 1.0)  # it is 0.4 from 0.4 on
    asked = Requirement(key="asked", formula=late, until=1.0)
    found = margin(asked, fine.time, {"v": fine.outputs.ravel()}, breaks=breaks_of(fine))
    assert found == pytest.approx(0.05, abs=1e-9)


def test_windows_over_a_run_without_events_are_of_its_curve():
    """max of sin over [t, t + 3] is least where both ends are equal: -cos(1.5)."""
    swing = ct.nlsys(lambda t, x, u, p: [x[1], -x[0]], lambda t, x, u, p: [x[0]], states=2,
                     inputs=0, outputs=1, name="swing")  # fmt: skip
    times = np.linspace(0, 10, 101)
    run = nlctl.input_output_response(swing, times, 0, [0.0, 1.0], rtol=1e-10, atol=1e-12)
    y, breaks = run.outputs.ravel(), breaks_of(run)
    assert breaks.size == 0
    above = in_band("y", lower=0.0, scale=1.0)
    found = margin_of(always(eventually(above, 0.0, 3.0)), times, y, breaks)
    assert found == pytest.approx(-np.cos(1.5), abs=1e-6)
    below = in_band("y", upper=0.0, scale=1.0)
    found = margin_of(eventually(always(below, 0.0, 1.37)), times, y, breaks)
    assert found == pytest.approx(np.cos(1.37 / 2), abs=1e-6)
