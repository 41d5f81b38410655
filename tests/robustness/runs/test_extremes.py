"""Extremes between samples: never beyond what samples support, and exact where breaks are known."""

import itertools
from functools import partial

import numpy as np
import pytest
from examples import some
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import KroghInterpolator
from scipy.optimize import brentq

from nlctl.analysis import metrics
from nlctl.analysis.metrics import highest, in_machine_code, lowest
from nlctl.analysis.metrics.curves import _differences, _doubt, limits_at_breaks, path

NONE = np.empty(0)

waves = st.lists(
    st.tuples(st.floats(0.2, 2), st.floats(0.2, 6), st.floats(0, 7)), min_size=1, max_size=3
)
steps = st.floats(0.003, 0.15)


def signal(t, parts):
    """A sum of sines."""
    return sum(a * np.sin(w * t + p) for a, w, p in parts)


def bound_of_bend(parts, h):
    """h^2 max |y''| / 8."""
    return h**2 / 8 * sum(a * w**2 for a, w, _ in parts)


@given(waves, steps, st.floats(0, 1), st.integers(5, 300), st.floats(0.05, 0.9))
def test_a_clipped_signal_is_not_higher_than_its_limit(parts, h, phase, n, share):
    """Where three samples in a row have seen the limit; otherwise by at most h^2 |y''| / 8."""
    t = (phase + np.arange(n)) * h
    x = signal(t, parts)
    limit = share * np.abs(x).max()
    y = np.clip(x, -limit, limit)
    seen = np.any((y[2:] == limit) & (y[1:-1] == limit) & (y[:-2] == limit))
    beyond = 0.0 if seen else bound_of_bend(parts, h)
    assert highest(t, y) <= limit + beyond
    assert highest(t, y) >= y.max()


@given(waves, steps, st.floats(0, 1), st.integers(5, 300), st.floats(0.05, 0.9))
def test_a_dead_zone_shows_no_more_than_its_input(parts, h, phase, n, share):
    """v = 0 within it; at rest its least magnitude is 0, and a corner is not overshot."""
    t = (phase + np.arange(n)) * h
    x = signal(t, parts)
    width = share * np.abs(x).max()
    v = np.maximum(x - width, 0.0)
    seen = np.any((v[2:] == 0) & (v[1:-1] == 0) & (v[:-2] == 0))
    assert lowest(t, v) >= (0.0 if seen else -bound_of_bend(parts, h))


@given(waves, steps, st.floats(0, 1), st.integers(5, 300))
def test_a_relay_and_magnitudes_stay_within_their_values(parts, h, phase, n):
    """sign x lies in [-1, 1]; -|x| below 0 but for zeros that no sample has seen."""
    t = (phase + np.arange(n)) * h
    x = signal(t, parts)
    assert highest(t, np.where(x > 0, 1.0, -1.0)) <= 1
    assert highest(t, -np.abs(x)) <= bound_of_bend(parts, h)


@given(st.floats(0.02, 0.45), st.floats(0, 1), st.integers(5, 300))
def test_a_triangle_is_not_higher_than_its_apex(h, phase, n):
    t = (phase + np.arange(n)) * h
    assert highest(t, np.abs(t % 1 - 0.5)) <= 0.5
    assert lowest(t, np.abs(t % 1 - 0.5)) >= 0


@given(waves, steps, st.floats(0, 1), st.integers(5, 200), st.floats(0.05, 0.9))
def test_play_and_rate_limits_are_not_overshot(parts, h, phase, n, share):
    """Both stay within the extremes of their input, which they reach by steps of their law."""
    t = (phase + np.arange(n)) * h
    x = signal(t, parts)
    play, slow = x.copy(), x.copy()
    radius = share * np.abs(x).max()
    rate = share * np.abs(np.diff(x)).max()
    for k in range(1, n):
        play[k] = np.clip(play[k - 1], x[k] - radius, x[k] + radius)
        slow[k] = slow[k - 1] + np.clip(x[k] - slow[k - 1], -rate, rate)
    beyond = bound_of_bend(parts, h)
    assert highest(t, play) <= play.max() + beyond
    assert highest(t, slow) <= x.max() + beyond


@pytest.mark.parted
@pytest.mark.parametrize("n", range(5, 12))
def test_two_levels_have_no_values_beyond(n):
    """All 2^n rows of two levels: no polynomial is put through any of them."""
    t = np.arange(float(n))
    for row in itertools.product((0.0, 1.0), repeat=n):
        assert highest(t, np.array(row)) == max(row)


@given(
    st.floats(-5, 5), st.floats(0, 1), st.booleans(),
    st.lists(st.floats(-1, 1), min_size=5, max_size=5),
)  # fmt: skip
def test_one_kink_or_jump_is_not_overshot(place, phase, bends, factors):
    """Cubics on both sides of one break: the guard takes what it does to the curve."""
    *cubic, size = factors
    cubic = np.array(cubic) * [0.003, 0.02, 0.1, 1.0]

    def y(t):
        return np.polyval(cubic, t) + size * np.where(t > place, t - place if bends else 1.0, 0.0)

    t = np.arange(-15, 16) + phase
    fine = np.concatenate([np.linspace(t[0], t[-1], 20_001), [place, np.nextafter(place, 9)]])
    assert highest(t, y(t)) <= y(fine).max() + 1e-6


@given(st.integers(0, 2**32 - 1), st.integers(5, 30))
def test_a_doubt_is_the_largest_distance_from_what_neighbours_say(seed, n):
    """By polynomials of SciPy through the others of three windows, on any samples."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, n))
    y = np.sin(t)
    count = min(9, max(n - 2, 4))
    for k in range(n):
        first = min(max(k - 4, 0), n - count)
        begin = max(min(first - 1, n - count - 2), 0)
        distances = []
        for start in range(begin, min(begin + 3, n - count + 1)):
            others = [j for j in range(start, start + count) if j != k]
            distances.append(abs(KroghInterpolator(t[others], y[others])(t[k]) - y[k]))
        doubt = _doubt(t, y, _differences(t, y, count), k)
        assert doubt == pytest.approx(max(distances), rel=1e-6, abs=2e-12)


def test_a_smooth_peak_is_found_from_below_to_eighth_order():
    """Of a sine, at every phase; today's fourth order and better."""
    errors = []
    for h in (0.4, 0.2, 0.1, 0.05):
        found = [highest(t, np.sin(t)) for t in (p * h + h * np.arange(7 / h) for p in PHASES)]
        assert np.max(found) <= 1
        errors.append(1 - np.min(found))
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 7)


PHASES = some(np.linspace(0, 1, 21))


@pytest.mark.parametrize("phase", PHASES)
def test_peaks_at_either_side_of_a_jump_are_limits(phase):
    """A sawtooth reaches its teeth though no sample does, and 1 - t^2 its value at a jump."""
    t = phase * 0.07 + 0.07 * np.arange(60)
    saw = t % 1.0
    assert highest(t, saw, np.array([1.0, 2, 3, 4])) == pytest.approx(1, abs=1e-9)
    assert lowest(t, saw, np.array([1.0, 2, 3, 4])) == pytest.approx(0, abs=1e-9)
    break_ = 0.4567
    y = np.where(t < break_, np.sin(t), -1.0)
    assert highest(t, y, np.array([break_])) == pytest.approx(np.sin(break_), abs=1e-6)


@pytest.mark.parametrize("phase", PHASES)
def test_a_clipped_sine_with_breaks_is_as_good_as_a_smooth_one(phase):
    """Neither its limit nor the smooth peak below it is missed."""
    t = 0.03 * phase + 0.03 * np.arange(300)
    x = np.exp(-0.1 * t) * np.sin(3 * t)
    limit = 0.7
    fine = np.linspace(t[0], t[-1], 400_001)
    over = lambda t: np.abs(np.exp(-0.1 * t) * np.sin(3 * t)) - limit  # noqa: E731
    changes = np.flatnonzero(np.diff((over(fine) > 0).astype(int)))
    breaks = np.array([brentq(over, fine[k], fine[k + 1], xtol=1e-13) for k in changes])
    y = np.clip(x, -limit, limit)
    assert highest(t, y, breaks) == pytest.approx(limit, abs=1e-6)  # the first piece is short
    late = t > 5
    exact = np.max(np.exp(-0.1 * fine) * np.sin(3 * fine), where=fine > t[late][0], initial=-1)
    if exact < limit:
        assert highest(t[late], y[late], breaks) == pytest.approx(exact, abs=1e-8)


def test_settling_dwelling_and_travel_see_jumps_where_they_are():
    """y = 1 before 0.333, then e^-(t - 0.333) / 2: a jump by 1/2, settled to 0.1 at ln 5 later."""
    t = np.linspace(0, 5, 101)
    y = np.where(t < 0.333, 1.0, 0.5 * np.exp(-(t - 0.333)))
    breaks = np.array([0.333])
    assert metrics.settling_time(t, y, 0.6, breaks) == pytest.approx(0.333, abs=1e-9)
    exact = 0.333 + np.log(5)
    assert metrics.settling_time(t, y, 0.1, breaks) == pytest.approx(exact, abs=2e-6)
    assert metrics.time_within(t, y, 0.7, 2.0, breaks) == pytest.approx(0.333, abs=1e-9)
    way = 1 - 0.5 * np.exp(-(5 - 0.333))
    assert metrics.total_variation(t, y, breaks) == pytest.approx(way, abs=1e-9)


T = np.linspace(0, 5, 301)
FUNCTIONS = [
    *(getattr(metrics, name) for name in (
        "final", "highest", "lowest", "peak", "spread", "ultimate_bound", "integral", "rms",
        "absolute_integral", "square_integral", "time_weighted_integral", "total_variation",
        "reversals",
    )),
    partial(metrics.settling_time, band=0.6), partial(metrics.reversals, above=0.1),
    partial(metrics.time_within, lower=-0.2, upper=0.3), partial(metrics.ultimate_bound, share=0.5),
]  # fmt: skip
SIGNALS = {
    "jumps": np.where(T < 2.2222, np.sin(4 * T), -0.5 * np.cos(T)),
    "constant": np.full(T.size, 0.25),
    "NaN": np.where(T[7] == T, np.nan, np.sin(T)),
    "inf": np.where(T[-1] == T, np.inf, np.sin(T)),
    "-inf": np.where(T[0] == T, -np.inf, np.sin(T)),
    "strided": np.repeat(np.sin(3 * T), 2)[::2],
    "integers": np.round(3 * np.sin(T)).astype(int),
}


@pytest.mark.parametrize("signal", SIGNALS)
@pytest.mark.parametrize("breaks", [{}, {"breaks": None}, {"breaks": [2.2222]}, {"breaks": NONE}])
def test_numbers_are_the_same_in_machine_code(signal, breaks):
    """With breaks and without, of any arrays, also where the number is not a finite one."""
    y = SIGNALS[signal]
    for function in FUNCTIONS:
        given = breaks if metrics.with_breaks(function, NONE) is not function else {}
        with np.errstate(invalid="ignore"):  # 0 times -inf
            plain, fast = function(T, y, **given), in_machine_code(function)(T, y, **given)
        np.testing.assert_allclose(fast, plain, rtol=1e-12, atol=1e-13, err_msg=str(function))


@pytest.mark.parametrize(
    "arguments",
    [
        ((T, T), {}),
        ((T, T, 1.0, NONE, 2.0), {}),
        ((T, T, 1.0), {"band": 2.0}),
        ((T, T, 1.0), {"braeks": NONE}),
    ],
    ids=["missing", "too many", "twice", "misspelt"],
)
def test_what_is_wrong_is_said_in_the_same_words(arguments):
    given, named = arguments
    with pytest.raises(Exception) as plain:  # noqa: PT011
        metrics.settling_time(*given, **named)
    with pytest.raises(type(plain.value)) as fast:
        in_machine_code(metrics.settling_time)(*given, **named)
    assert str(fast.value) == str(plain.value)


@pytest.mark.parametrize(
    ("function", "t", "y"),
    [
        (metrics.integral, T, T[:-1]),
        (metrics.highest, T, T[:-1]),
        (metrics.highest, T[:0], T[:0]),
    ],
)
def test_samples_that_do_not_fit_never_get_to_machine_code(function, t, y):
    with pytest.raises(Exception) as plain:  # noqa: PT011
        function(t, y)
    with pytest.raises(type(plain.value)) as fast:
        in_machine_code(function)(t, y)
    assert str(fast.value) == str(plain.value)


def test_what_is_not_one_of_these_functions_is_returned():
    """Also an object that has no hash."""
    unhashable = type("Own", (), {"__call__": lambda *_: 0.0, "__eq__": lambda *_: False})()
    assert in_machine_code(unhashable) is unhashable


def test_a_path_goes_through_samples_and_limits():
    """Times increase, samples are kept, a sample at a break is a value of its own."""
    t = np.linspace(0, 1, 21)
    y = np.where(t < 0.5, t, 3 - t)
    at, values = path(t, y, np.array([0.5]))
    assert np.all(np.diff(at) > 0)
    np.testing.assert_array_equal(np.interp(t, at, values), y)
    np.testing.assert_allclose(limits_at_breaks(t, y, np.array([0.5]))[1], [0.5, 2.5], rtol=1e-12)
    np.testing.assert_array_equal(path(t, t, NONE)[1], t)
