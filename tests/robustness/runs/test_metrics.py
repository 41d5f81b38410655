"""Metrics against closed forms."""

import re
from pathlib import Path

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import simpson

from nlctl.analysis import metrics
from nlctl.analysis.metrics import extremes, integrals, tracking_metrics, travel


def test_every_metric_has_a_test_here():
    """A new one asks for its closed form in this folder."""
    text = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("*.py"))
    names = [*extremes.__all__, *integrals.__all__, *travel.__all__]
    assert [name for name in names if not re.search(rf"\b{name}\(", text)] == []
    assert set(names) <= set(metrics.__all__)


@given(st.floats(-2, 2), st.floats(0.1, 3), st.floats(0.1, 3), st.floats(-5, 5))
def test_the_vertex_of_a_parabola_is_found_from_any_three_samples(top, h_before, h_after, t):
    offset, value = metrics.vertex(
        h_before, h_after, 3 - (t - h_before - top) ** 2, 3 - (t - top) ** 2,
        3 - (t + h_after - top) ** 2,
    )  # fmt: skip
    assert (t + offset, value) == pytest.approx((top, 3.0), abs=1e-10)


@given(st.lists(st.integers(-1000, 1000), min_size=1, max_size=20))
def test_consecutive_differences_add_up_to_the_way_between_the_ends(y):
    """Their sum telescopes."""
    steps = metrics.consecutive_differences(np.array(y))
    assert steps.size == len(y) - 1
    assert steps.sum() == y[-1] - y[0]


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


def even(n, end=2 * np.pi):
    """Return n + 1 even samples of [0, end]."""
    return np.linspace(0, end, n + 1)


def order(function, exact, counts, end=2 * np.pi):
    """Return the order with which the error of function(t) falls."""
    errors = [abs(function(even(n, end)) - exact) for n in counts]
    return np.log(errors[0] / errors[-1]) / np.log(counts[-1] / counts[0])


@given(st.integers(2, 30), st.integers(0, 1000))
def test_integral_is_scipys_simpson_on_uneven_samples(n, seed):
    """Two ways to one number, for even and odd numbers of intervals."""
    rng = np.random.default_rng(seed)
    t, y = np.cumsum(rng.uniform(0.1, 1, n + 1)), rng.normal(size=n + 1)
    assert metrics.integral(t, y) == pytest.approx(simpson(y, x=t), rel=1e-12, abs=1e-12)


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.integers(2, 9))
def test_integral_of_a_parabola_is_exact(c, n):
    """On any samples."""
    t = np.sqrt(np.linspace(0, 4, n + 1))
    exact = c[0] * 2 + c[1] * 2 + c[2] * 8 / 3
    y = c[0] + c[1] * t + c[2] * t**2
    assert metrics.integral(t, y) == pytest.approx(exact, rel=1e-12, abs=1e-12)


def test_integral_of_two_samples_is_the_trapezium():
    """The shortest response there is."""
    assert metrics.integral(np.array([1.0, 3.0]), np.array([2.0, 4.0])) == 6


def test_integral_has_order_four():
    """Of a smooth function, for odd numbers of intervals as well."""
    for extra in (0, 1):
        counts = [50 + extra, 100 + extra]
        assert order(lambda t: metrics.integral(t, np.exp(t)), np.e - 1, counts, 1.0) > 3.7


@given(st.floats(0.3, 3), st.integers(1, 4))
def test_integrals_of_a_sine_have_their_closed_forms(a, n):
    """Over n periods: IAE 4 n a, ISE n pi a^2, ITAE 4 pi n^2 a."""
    t = even(2000 * n, 2 * np.pi * n)
    y = a * np.sin(t)
    assert metrics.absolute_integral(t, y) == pytest.approx(4 * n * a, rel=1e-5)
    assert metrics.square_integral(t, y) == pytest.approx(n * np.pi * a * a, rel=1e-9)
    assert metrics.time_weighted_integral(t, y) == pytest.approx(4 * np.pi * n * n * a, rel=1e-5)
    late = metrics.time_weighted_integral(t + 7, y)  # the clock starts with the samples
    assert late == pytest.approx(4 * np.pi * n * n * a, rel=1e-5)


def test_iae_has_order_two_at_sign_changes():
    """The kinks of |y| lie between samples."""
    assert order(lambda t: metrics.absolute_integral(t, np.cos(t)), 4, [101, 1001, 10001]) > 1.9


@given(st.floats(0.2, 2), st.integers(1, 5))
def test_a_sine_travels_four_amplitudes_and_turns_twice_a_period(a, n):
    """Total variation, range and number of reversals over n periods."""
    t = even(1000 * n, 2 * np.pi * n)
    y = a * np.sin(t)
    assert metrics.total_variation(t, y) == pytest.approx(4 * a * n, rel=1e-4)
    assert metrics.spread(t, y) == pytest.approx(2 * a, rel=1e-6)
    assert metrics.reversals(t, y) == 2 * n
    assert metrics.reversals(t, y, above=1.99 * a) == 2 * n - 2  # the ends are half swings
    assert metrics.reversals(t, y, above=2.01 * a) == 0


@given(st.integers(0, 100), st.floats(0.01, 1))
def test_small_swings_are_no_reversals(seed, above):
    """Noise of a tenth of the threshold on a zigzag of twice its height turns as the zigzag."""
    noise = np.random.default_rng(seed).uniform(-0.1, 0.1, 60) * above
    y = np.repeat([0.0, 1.0, -1.0, 1.0, 0.5, 2.0], 10) * 2 * above
    y[30:50] = 2 * above  # 1 -> 0.5 is a swing of exactly the threshold: left out
    assert metrics.reversals(even(59), y + noise, above=above) == 2


@given(st.floats(0.02, 0.9), st.integers(20, 400), st.sampled_from([1, -1]))
def test_settling_time_of_an_exponential_is_its_logarithm(band, n, sign):
    """|e^-t| <= band from -ln band on, from either side; a line is off by at most h^2 / 8."""
    t = even(n, 5)
    error = metrics.settling_time(t + 3, sign * np.exp(-t), band) + np.log(band)
    assert 0 <= error <= (5 / n) ** 2 / 8 * np.exp(5 / n)


def test_a_response_settles_at_once_or_never():
    """Inside the band all the time: 0; outside at the end: infinity."""
    t = even(100)
    assert metrics.settling_time(t, 0 * t, 0.1) == 0
    assert metrics.settling_time(t, np.exp(t), 0.1) == np.inf  # it has not


@given(st.floats(0.05, 0.95))
def test_time_in_the_dead_band_of_a_triangle_is_its_share(half):
    """|y| <= half takes the share half of a triangle wave, exactly."""
    t = np.linspace(0, 4, 5)
    y = np.array([0.0, 1.0, 0.0, -1.0, 0.0])
    assert metrics.time_within(t, y, -half, half) == pytest.approx(4 * half)


def test_time_at_rest_counts_level_intervals():
    """v = 0 while the input crosses the gap of a dead zone of half width 1/2."""
    t = even(6000)
    v = np.maximum(np.sin(t) - 0.5, 0) + np.minimum(np.sin(t) + 0.5, 0)
    assert metrics.time_within(t, v, 0.0, 0.0) == pytest.approx(4 * np.arcsin(0.5), abs=5e-3)


def test_ultimate_bound_forgets_the_transient():
    """What is left of e^-t + 0.1 sin 5t at t = 20."""
    t = even(20000, 20)
    y = 10 * np.exp(-3 * t) + 0.1 * np.sin(5 * t)
    assert metrics.ultimate_bound(t, y) == pytest.approx(0.1, rel=1e-5)
    assert metrics.ultimate_bound(t, y, share=1.0) == metrics.peak(t, y)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    "metric", [m.function for m in tracking_metrics(start=10, band=0.1)] + [metrics.spread]
)
def test_no_metric_of_a_diverged_response_is_a_calm_number(metric, bad):
    """One bad sample in the middle, or all from there on."""
    t = np.linspace(0, 1, 11)
    with np.errstate(invalid="ignore"):
        assert not np.isfinite(metric(t, np.where(t > 0.5, bad, 0.0)))


@pytest.mark.weekly
def test_numba_compiles_the_metrics_as_they_stand():
    """One compiled function gives the same numbers; the other metrics are made of these."""
    calls = [
        "spread(t, y)", "ultimate_bound(t, y)", "rms(t, y)", "total_variation(t, y)",
        "settling_time(t, y, 0.3)", "time_within(t, y, -0.2, 0.2)", "reversals(t, y, 0.1)",
    ]  # fmt: skip
    scope = dict(vars(metrics))
    exec(f"def some(t, y):\n    return ({', '.join(calls)})", scope)
    t = np.sqrt(np.linspace(0, 40, 300))
    y = np.exp(-0.3 * t) * np.cos(3 * t)
    native = numba.njit(nogil=True)(scope["some"])
    np.testing.assert_allclose(native(t, y), scope["some"](t, y), rtol=1e-12)


def test_tracking_metrics_name_every_number_once():
    """With unit and meaning; signals that a loop lacks are left out."""
    every = tracking_metrics(start=10, band=0.15)
    assert len({m.key for m in every}) == len(every) == 14
    assert all(m.unit and m.meaning for m in every)
    assert {m.key: m.start for m in every if m.start} == {"late_peak": 10, "late_rms": 10}
    bare = tracking_metrics(start=10, band=0.15, weights="", gain="")
    assert {m.signal for m in bare} == {"e", "u", "v"}
