"""A single run by "auto" goes on by Taylor's method where that pays, with the same answers."""

import control as ct
import numpy as np
import pytest
from numba.core import config

import nlctl

pytestmark = pytest.mark.skipif(getattr(config, "DISABLE_JIT", False), reason="10^4 steps")


def block(update, n, output=None, **kwargs):
    return ct.nlsys(update, output, states=n, name="plant", **kwargs)


def oscillator(t, x, u, params):
    return [x[1], -x[0]]


def switched(t, x, u, params):
    return [-x[0] + (1.0 if t % 0.5 < 0.15 else 0.0), -x[1] + np.sin(20.0 * t)]


def kicked(t, x, u, params):
    return [x[1], -x[0] + 0.5 * np.sign(x[0] - 0.25)]


def held(t, x, u, params):
    return [-x[0] + u[0], 20.0 * x[2], -20.0 * x[1]]


def van_der_pol(t, x, u, params):
    return [x[1], 1000.0 * (1.0 - x[0] ** 2) * x[1] - x[0]]


def tried(response):
    return response.statistics.accepted + response.statistics.rejected


def both(diagram, times, x0, **kwargs):
    """Return the responses of the default and of the explicit pair."""
    compiled = nlctl.compile(diagram)
    return [
        nlctl.input_output_response(compiled, times, initial_state=x0, method=method, **kwargs)
        for method in ("auto", "tsit5")
    ]


@pytest.mark.parametrize(("rtol", "share", "error"), [(1e-11, 0.3, 1e-8), (1e-6, 0.6, 5e-4)])
def test_a_long_smooth_run_takes_fewer_steps_and_is_right(rtol, share, error):
    """x'' = -x: cos(t) after 500 s."""
    times = np.linspace(0, 500, 401)
    tolerances = {"rtol": rtol, "atol": 0.01 * rtol}
    auto, pair = both(block(oscillator, 2, inputs=0), times, [1, 0], **tolerances)
    assert tried(auto) < share * tried(pair)
    np.testing.assert_allclose(auto.states[0], np.cos(times), atol=error)
    again = nlctl.input_output_response(
        nlctl.compile(block(oscillator, 2, inputs=0)), times, initial_state=[1, 0], **tolerances
    )
    np.testing.assert_array_equal(auto.states, again.states)


def test_pulses_are_located_after_the_turn_as_before():
    """x' = -x + (t % 0.5 < 0.15), in closed form, next to what makes the steps many."""
    times = np.linspace(0, 40, 801)
    auto, pair = both(block(switched, 2, inputs=0), times, [0, 0], rtol=1e-10, atol=1e-12)
    assert tried(auto) < 0.7 * tried(pair)
    exact, x = [0.0], 0.0
    for k in range(1, times.size):
        on, off = min(max(0.15 - (times[k - 1] + 1e-9) % 0.5, 0.0), 0.05), 0.0
        off = 0.05 - on
        x = (1 + (x - 1) * np.exp(-on)) * np.exp(-off)
        exact.append(x)
    np.testing.assert_allclose(auto.states[0], exact, atol=3e-9)


def test_crossings_of_states_are_the_same_events():
    """x'' = -x + 0.5 sign(x - 0.25): as many crossings, at the same times."""
    times = np.linspace(0, 300, 31)
    auto, pair = both(block(kicked, 2, inputs=0), times, [2, 0], rtol=1e-10, atol=1e-12)
    assert tried(auto) < 0.8 * tried(pair)
    assert len(auto.events) == len(pair.events) > 70
    np.testing.assert_allclose(auto.events["time"], pair.events["time"], atol=1e-6)
    np.testing.assert_allclose(auto.states, pair.states, atol=1e-6)


def test_inputs_event_functions_and_the_end_of_a_run():
    """A held input with break points; the run ends where sin(20 t) has fallen for the last time."""
    times = np.linspace(0, 50, 501)
    u = np.where(times % 5 < 2.5, 1.0, -1.0)
    found = both(
        block(held, 3, inputs=1), times, [0, 0, 1], inputs=u, rtol=1e-10, atol=1e-12,
        stop_when=lambda t, x, u, p: t - 40.03,
        events=[lambda t, x, u, p: x[1]],
    )  # fmt: skip
    auto, pair = found
    assert tried(auto) < 0.8 * tried(pair)
    assert auto.time[-1] == pytest.approx(40.03, abs=1e-9)
    assert len(auto.events) == len(pair.events)
    np.testing.assert_allclose(auto.states[1], np.sin(20 * auto.time), atol=1e-6)
    np.testing.assert_allclose(auto.states, pair.states, atol=1e-7)


def test_the_stiff_method_has_its_turn():
    """Van der Pol's equation with mu = 1000: less than twice what the stiff method takes alone."""
    compiled = nlctl.compile(block(van_der_pol, 2, inputs=0))
    times = np.linspace(0, 3000, 61)
    auto, stiff = (
        nlctl.input_output_response(compiled, times, initial_state=[2, 0], method=m, rtol=1e-9)
        for m in ("auto", "rodas5p")
    )
    assert tried(auto) < 3 * tried(stiff)
    np.testing.assert_allclose(auto.states[0], stiff.states[0], atol=1e-4)


@pytest.mark.parametrize(
    "kwargs", [{"rtol": 1e-5, "atol": 1e-7}, {"step": 0.1}, {"rtol": 1e-10, "max_steps": 590}]
)
def test_where_it_does_not_pay_nothing_changes(kwargs):
    """At loose tolerances, with given steps, and in short runs: the explicit pair, bit for bit."""
    times = np.linspace(0, 100, 101)
    auto, pair = both(block(oscillator, 2, inputs=0), times, [1, 0], ignore_errors=True, **kwargs)
    np.testing.assert_array_equal(auto.states, pair.states)


def costly(t, x, u, params):
    return [x[1], -x[0] + 0.0 * sum(np.sin(k * x[1]) for k in range(1, 201))]


def test_progress_is_reported_by_steps_and_not_by_turns():
    """A run that stands still is known by how far so many steps went; a turn cuts none short."""
    compiled, seen = nlctl.compile(nlctl.paper.example_1()), []
    response = nlctl.input_output_response(
        compiled, [0, 60], rtol=1e-6, atol=1e-8, progress=seen.append
    )
    assert 1 < len(seen) <= 1 + tried(response) / 1800
    assert seen == sorted(seen)
    assert seen[-1] == 60.0


@pytest.mark.weekly
def test_what_costs_more_turns_sooner():
    """The same motion in fewer than 600 steps, which cost a turn where rates cost much."""
    times = np.linspace(0, 24, 25)
    for rates, turns in ((oscillator, False), (costly, True)):
        auto, pair = both(block(rates, 2, inputs=0), times, [1, 0], rtol=1e-9, atol=1e-11)
        assert 250 < tried(pair) < 600
        assert (tried(auto) < 0.8 * tried(pair)) is turns
        np.testing.assert_allclose(auto.states[0], np.cos(times), atol=1e-6)


def test_what_has_no_coefficients_keeps_the_pair():
    """What leaves a delay is known as pieces of polynomials of a low order."""
    line = nlctl.TransportDelay(inputs=("y",), outputs=("u",), delay=0.3)
    plant = ct.nlsys(lambda t, x, u, p: [np.cos(t) - u[0]], lambda t, x, u, p: [x[0]],
                     inputs=["u"], outputs=["y"], states=1, name="plant")  # fmt: skip
    compiled = nlctl.compile(nlctl.interconnect({"plant": plant, "line": line}, outputs=["y"]))
    times = np.linspace(0, 40, 401)
    auto, pair = (nlctl.input_output_response(compiled, times, method=m) for m in ("auto", "tsit5"))
    np.testing.assert_array_equal(auto.states, pair.states)


@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
def test_a_memory_has_coefficients(rtol):
    """The backlash of Example 2: Taylor's method takes over, with a fifth of the steps."""
    times = np.linspace(0, 20, 401)
    compiled = nlctl.compile(nlctl.paper.example_2())
    auto, pair = (
        nlctl.input_output_response(compiled, times, method=m, rtol=rtol, atol=0.1 * rtol)
        for m in ("auto", "tsit5")
    )
    assert auto.statistics.accepted < 0.2 * pair.statistics.accepted
    np.testing.assert_allclose(auto.outputs, pair.outputs, rtol=0, atol=1e3 * rtol)
    times = auto.events["time"].to_numpy()
    assert max(np.abs(times - t).min() for t in pair.events["time"]) < 1e3 * rtol


@nlctl.record
class Unguarded:
    """A guard that is NaN from t = 3 on, while another state oscillates."""

    inputs, outputs, states, feedthrough = (), ("x",), ("x", "v"), False
    update = staticmethod(lambda t, x, u, p: (x[1], -400.0 * x[0]))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (np.sqrt(3.0 - t),))
    reset = staticmethod(lambda t, x, u, p: (x[0], x[1]))


def test_a_guard_that_is_nan_ends_the_run_whatever_the_method():
    """NaN travels: the explicit pair does not go on where Taylor's method has met it."""
    loop = nlctl.interconnect({"block": Unguarded()}, outputs=["x"])
    for method in ("auto", "tsit5"):
        found = nlctl.input_output_response(
            nlctl.compile(loop), np.linspace(0, 6, 61), initial_state=[1, 0], method=method,
            rtol=1e-10, atol=1e-12, ignore_errors=True,
        )  # fmt: skip
        assert found.statistics.status.name == "DIVERGED"
        assert found.statistics.time == pytest.approx(3.0, abs=0.05)
