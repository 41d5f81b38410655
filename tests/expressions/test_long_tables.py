"""Tables of measured data in functions: many points, and places that are computed."""

from __future__ import annotations

import bisect

import control as ct
import numpy as np
import pytest
from scipy import interpolate

import nlctl

END = 10.0


def _tables(n):
    rng = np.random.default_rng(n)
    places, values = np.linspace(0.0, END, n), rng.normal(size=n)
    scattered = np.sort(rng.uniform(0.0, END, n))
    rows, numbers, step = rng.normal(size=(n, 2)), list(map(float, values)), END / (n - 1)
    counts, of_numpy, ordered = list(range(n)), list(values), list(places)
    spline = interpolate.CubicSpline(places, np.sin(places))
    held = interpolate.interp1d(places, values, kind="previous", fill_value="extrapolate")
    several = interpolate.interp1d(places, rows, axis=0, fill_value="extrapolate")
    knots = interpolate.make_interp_spline(places, np.cos(places))
    return {
        "interp": lambda s: np.interp(s, places, values),
        "interp of scattered places": lambda s: np.interp(s, scattered, values, left=-3.0),
        "searchsorted": lambda s: values[min(np.searchsorted(places, s), n - 1)],
        "searchsorted right": lambda s: values[np.searchsorted(places, s, side="right") - 1],
        "digitize": lambda s: 0.01 * np.digitize(s, scattered),
        "bisect": lambda s: numbers[bisect.bisect_right(ordered, s) - 1],
        "an array": lambda s: values[int(s / step)],
        "a list": lambda s: numbers[min(int(s / step), len(numbers) - 1)],
        "from the end": lambda s: values[-1 - int(s / step)],
        "a list of NumPy's": lambda s: of_numpy[int(s / step)],
        "integers": lambda s: numbers[counts[int(s / step)]] / (1 + counts[int(s / step)]),
        "a row": lambda s: rows[int(s / step)].sum(),
        "a column": lambda s: rows[int(s / step), 1],
        "take": lambda s: np.take(values, int(s / step)),
        "by hand": lambda s: (
            (k := min(int(s / step), n - 2)) * 0.0
            + values[k]
            + (s - places[k]) / step * (values[k + 1] - values[k])
        ),
        "a spline": lambda s: spline(s),
        "a spline's slope": lambda s: spline(s, 1),
        "a spline by knots": lambda s: knots(s),
        "held": lambda s: held(s),
        "several": lambda s: several(s)[1],
    }


@pytest.mark.parted
@pytest.mark.parametrize(
    ("name", "n"), [(name, 600) for name in _tables(4)] + [("interp", 200), ("a list", 200)]
)
def test_a_table_is_what_python_finds(name, n):
    """At random, at the places, next to them, and of the state as of the time."""
    table = _tables(n)[name]
    rng, places = np.random.default_rng(1), np.linspace(0.0, END, n)
    some = rng.choice(places[1:-1], 20)
    points = [*rng.uniform(0.0, END, 20), *some, *np.nextafter(some, -1), *np.nextafter(some, 11)]
    for function in (
        lambda t, x, u, params: [-x[0] + table(t)],
        lambda t, x, u, params: [t - table(x[0])],
    ):
        block = ct.nlsys(function, None, states=1, inputs=0, outputs=1, name="block")
        compiled = nlctl.compile(block)
        assert not compiled.equations.calls
        for s in points:
            expected = block.dynamics(s, [s], [])
            np.testing.assert_allclose(compiled.dynamics(s, [s], []), expected, 1e-12, 1e-12)


def test_no_value_of_a_table_is_passed_over():
    """The integral of 1,001 held values: their sum."""
    values = np.random.default_rng(3).normal(size=1001)
    for kind in (values, list(map(float, values)), tuple(map(float, values))):
        block = ct.nlsys(
            lambda t, x, u, params, kind=kind: [kind[int(100 * t)]],
            None, states=1, inputs=0, outputs=1, name="block",
        )  # fmt: skip
        run = nlctl.input_output_response(block, [0.0, 5.0, 10.0], 0, [0.0])
        # 100 * t is an integer next to k / 100, not there
        np.testing.assert_allclose(run.states[0, 1:], values[:1000].cumsum()[[499, 999]] / 100,
                                   rtol=0, atol=1e-9)  # fmt: skip


def test_a_straight_table_of_many_places_is_a_straight_line():
    """x' = -(2 x + 1), read from a table of its values, and its derivative."""
    places = np.linspace(-3.0, 3.0, 801)
    block = ct.nlsys(
        lambda t, x, u, params: [-np.interp(x[0], places, 2.0 * places + 1.0)],
        None, states=1, inputs=0, outputs=1, name="block",
    )  # fmt: skip
    times = np.linspace(0.0, 2.0, 9)
    run = nlctl.input_output_response(block, times, 0, [1.0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(run.states[0], 1.5 * np.exp(-2.0 * times) - 0.5, rtol=0, atol=1e-8)
    np.testing.assert_allclose(nlctl.compile(block).linearize([0.3]).A, [[-2.0]], rtol=1e-9)


@pytest.mark.parametrize("table", [np.arange(300.0), list(range(300)), [0.0, 1, 2.5]])
def test_a_place_beyond_a_table_is_the_error_that_it_is(table):
    block = ct.nlsys(
        lambda t, x, u, params: [1.0 + 1e-9 * table[int(x[0])]],
        None, states=1, inputs=0, outputs=1, name="block",
    )  # fmt: skip
    compiled = nlctl.compile(block)
    assert compiled.dynamics(0.0, [-1.0], [])[0] == block.dynamics(0.0, [-1.0], [])[0]
    assert np.isnan(compiled.dynamics(0.0, [300.0], [])[0])
    with pytest.raises(IndexError, match="out of"):
        nlctl.input_output_response(compiled, np.arange(500.0), 0, [1.0])


def test_what_a_list_holds_is_followed_whatever_it_is():
    """Functions, rows and numbers of several types, by a mode that the state says."""
    laws = [lambda x: -x, lambda x: -2.0 * x**3, np.sin]
    rows, mixed = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]], [1, 0.5, np.float64(2.0)]

    def update(t, x, u, params):
        mode = int(abs(x[0])) % 3
        return [laws[mode](x[0]) * mixed[int(t)] + rows[mode][1]]

    block = ct.nlsys(update, None, states=1, inputs=0, outputs=1, name="block")
    compiled = nlctl.compile(block)
    assert not compiled.equations.calls
    for t in (0.0, 1.5, 2.5):
        for x in (-2.5, -0.5, 0.5, 1.0, 2.2, 7.1):
            expected = block.dynamics(t, [x], [])
            np.testing.assert_allclose(compiled.dynamics(t, [x], []), expected, rtol=1e-14)


@pytest.mark.parted
@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_each_place_that_a_state_passes_is_an_event(method):
    """A value for each interval of 400 unequal ones, there and back: their sums."""
    rng = np.random.default_rng(5)
    places, values = np.sort(rng.uniform(0.0, 1.0, 400)), rng.normal(size=401)

    def update(t, x, u, params):
        here = values[np.searchsorted(places, x[0])]
        return [x[1], -x[0], x[1] * here, np.interp(x[0], places, values[1:])]

    block = ct.nlsys(update, None, states=4, inputs=0, outputs=4, name="block")
    assert "too many" not in str(nlctl.compile(block))
    run = nlctl.input_output_response(
        block, [0.0, np.pi / 2, np.pi], 0, [0.0, 1.0, 0.0, 0.0], rtol=1e-9, atol=1e-10,
        method=method,
    )  # fmt: skip
    widths = np.diff(np.concatenate([[0.0], places, [1.0]]))
    np.testing.assert_allclose(run.states[2, 1], widths @ values, rtol=0, atol=1e-7)
    np.testing.assert_allclose(run.states[2, 2], 0.0, rtol=0, atol=1e-7)
    # and of straight lines in x = sin(t): by parts, with sqrt(1 - x^2) and arcsin(x) at the places
    slopes, angle = np.diff(values[1:]) / np.diff(places), np.arcsin(places)
    offsets = values[1:-1] - slopes * places[:-1]
    inner = offsets @ np.diff(angle) - slopes @ np.diff(np.cos(angle))
    outer = values[1] * angle[0] + values[-1] * (np.pi / 2 - angle[-1])
    np.testing.assert_allclose(run.states[3, 1], inner + outer, rtol=0, atol=1e-7)


@pytest.mark.parted
@pytest.mark.parametrize("n", [2, 6, 300])
def test_a_table_may_be_of_parameters(n):
    """Places and values that a run may have otherwise: of the time, and of a state."""
    rng = np.random.default_rng(n)
    tables = [(np.sort(rng.uniform(0.0, 4.0, n)), rng.normal(size=n)) for _ in range(2)]

    def update(t, x, u, params):
        places, values = params["places"], params["values"]
        held = values[min(int(t), n - 1)]
        return [
            np.interp(t, places, values, left=2.0) + held, np.interp(x[1], places, values) - x[1]
        ]  # fmt: skip

    (places, values), (others, more) = tables
    block = ct.nlsys(
        update, None, states=2, inputs=0, outputs=2, name="block",
        params={"places": places, "values": values},
    )  # fmt: skip
    compiled = nlctl.compile(block)
    assert not compiled.equations.calls
    for params in ({}, {"places": others, "values": more}):
        for t in (*rng.uniform(0.0, 4.0, 9), *others[:3], *places[:3], 0.0, 9.0):
            expected = block.dynamics(t, [t, 4.0 - t], [], params=params)
            found = compiled.dynamics(t, [t, 4.0 - t], [], params=params)
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
        run = nlctl.input_output_response(compiled, [0.0, 2.0, 5.0], 0, [0.0, 1.0], params=params)
        other = nlctl.input_output_response(
            block, [0.0, 2.0, 5.0], 0, [0.0, 1.0], params=params, engine="python-control",
        )  # fmt: skip
        np.testing.assert_allclose(run.states, other.states, rtol=0, atol=1e-5)


def test_what_follows_from_a_place_switches_with_it():
    """Comparisons of held values, of their places, and of what these choose: sums of signs."""
    values = np.random.default_rng(9).normal(size=500)

    def update(t, x, u, params):
        k = np.searchsorted(np.arange(1.0, 500.0), 50.0 * t, side="right")
        sign = 1.0 if values[k] > 0 else -1.0
        return [sign, max(sign, -0.5) * (k % 2), 1.0 if (sign > 0) == (k > 250) else 0.0]

    block = ct.nlsys(update, None, states=3, inputs=0, outputs=3, name="block")
    run = nlctl.input_output_response(block, [0.0, 10.0], 0, [0.0, 0.0, 0.0])
    k, sign = np.arange(500), np.sign(values)
    sums = [sign, np.maximum(sign, -0.5) * (k % 2), (sign > 0) == (k > 250)]
    np.testing.assert_allclose(run.states[:, -1], [s.sum() / 50 for s in sums], rtol=0, atol=1e-9)
