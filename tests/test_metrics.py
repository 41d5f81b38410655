"""Metrics against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis import metrics


@given(st.floats(0.5, 3), st.floats(-3, 3), st.floats(0.3, 5))
def test_peak_of_a_sine_is_its_amplitude(amplitude, phase, omega):
    """Between samples 0.01 apart the parabola finds the peak to fourth order."""
    t = np.arange(0, 4 * np.pi / omega, 0.01)
    y = amplitude * np.sin(omega * t + phase)
    assert metrics.peak(t, y) == pytest.approx(
        amplitude, abs=1e-3 * amplitude * (0.01 * omega) ** 3
    )


def test_peak_error_falls_with_the_fourth_power_of_the_step():
    """Halving the sampling interval divides the error by about 16."""
    errors = []
    for h in (0.2, 0.1, 0.05):
        t = 0.37 * h + h * np.arange(int(3 / h))  # the peak lies at a fixed place between samples
        errors.append(abs(metrics.highest(t, np.sin(t + np.pi / 2 - 1)) - 1))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3)


def test_exact_for_a_parabola_on_uneven_samples():
    """A parabola's vertex is found exactly wherever the samples lie."""
    t = np.array([0.0, 0.1, 0.5, 0.6, 1.3])
    assert metrics.highest(t, 2 - (t - 0.41) ** 2) == pytest.approx(2, abs=1e-14)
    assert metrics.lowest(t, (t - 0.41) ** 2 - 2) == pytest.approx(-2, abs=1e-14)


def test_rms_of_a_sine_over_full_periods():
    """The RMS is amplitude / sqrt(2)."""
    t = np.linspace(0, 4 * np.pi, 2001)
    assert metrics.rms(t, 3 * np.sin(t)) == pytest.approx(3 / np.sqrt(2), rel=1e-10)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_nan_and_infinity_travel(bad):
    """A response that left the finite numbers has no finite peak and no finite RMS."""
    t = np.linspace(0, 1, 11)
    y = np.where(t > 0.5, bad, t)
    assert not np.isfinite(metrics.peak(t, y))
    assert not np.isfinite(metrics.rms(t, y))
    assert not np.isfinite(metrics.final(t, y))


def test_over_keeps_the_closed_interval_and_refuses_an_empty_one():
    """The error says what the response covers."""
    t = np.linspace(0, 1, 11)
    assert metrics.over(t, t, 0.2, 0.5)[0] == pytest.approx([0.2, 0.3, 0.4, 0.5])
    with pytest.raises(ValueError, match=r"\[5, 9\] s needs at least 3 samples.*covers \[0, 1\] s"):
        metrics.over(t, t, 5, 9)
