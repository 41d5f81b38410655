"""Steps of a stepper are one run with held inputs: with the same numbers, whatever is kept."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.native.stepping import window

DT = 0.05
RNG = np.random.default_rng(0)


def pendulum(u="v", y="y"):
    return ct.nlsys(
        lambda t, x, u, params: [x[1], -np.sin(x[0]) - 0.5 * x[1] + u[0]],
        lambda t, x, u, params: x[0],
        inputs=[u], outputs=[y], states=2, name="plant",
    )  # fmt: skip


def loop(*between):
    """A pendulum behind a lag and whatever is between, in feedback."""
    lag = ct.ss(-1, 1, 2, 0, inputs="e", outputs=between[0].input_labels[0], name="lag")
    error = ct.summing_junction(["r", "-y"], "e", name="error")
    parts = [lag, *between, pendulum(between[-1].output_labels[0]), error]
    return nlctl.interconnect(parts, inputs=["r"], outputs=["y"])


def sampled_loop():
    law = ct.ss([[1.0]], [[0.05]], [[1.0]], [[2.0]], 0.07, inputs="e", outputs="v", name="law")
    error = ct.summing_junction(["r", "-y"], "e", name="error")
    parts = [nlctl.sampled(law, 0.07), pendulum(), error]
    return nlctl.interconnect(parts, inputs=["r"], outputs=["y"])


def delayed_loop():
    wire = nlctl.TransportDelay(delay=0.33, inputs=("w",), outputs=("v",), history=np.sin)
    return loop(nlctl.block(wire, "wire"))


def stiff():
    return ct.nlsys(
        lambda t, x, u, params: [x[1], -1e5 * (x[1] + np.sin(x[0]) - u[0])],
        lambda t, x, u, params: x[0], inputs=["u"], outputs=["y"], states=2, name="stiff",
    )  # fmt: skip


def sines():
    return ct.nlsys(
        lambda t, x, u, params: [
            u[0] - x[0] + np.sin(3 * t) + 9 * np.exp(-100 * (t - 20) ** 2) + 1.0 * (t > 7.3)
        ],
        lambda t, x, u, params: x[0], inputs=["u"], outputs=["y"], states=1, name="sines",
    )  # fmt: skip


def memory(record):
    return loop(nlctl.block(record, "actuator"))


SYSTEMS = {
    "smooth": pendulum,
    "backlash": lambda: memory(nlctl.Backlash()),
    "relay": lambda: memory(nlctl.Relay()),
    "sliding": lambda: memory(nlctl.IdealRelay()),
    "dead zone": lambda: memory(nlctl.DeadZone()),
    "friction": lambda: memory(nlctl.actuators.LuGre()),
    "clocks": sampled_loop,
    "delay": delayed_loop,
    "stiff": stiff,
}


def inputs(count, samples):
    return np.random.default_rng(1).normal(size=(count, samples))


def of_a_run(system, u, dt=DT, **given):
    """Outputs and states of a run with held inputs, just before each next time."""
    t = dt * np.arange(u.shape[1] + 1)
    run = nlctl.input_output_response(
        system, t, np.concatenate([u, u[:, -1:]], axis=1), hold="zoh",
        evaluation_times=np.nextafter(t[1:], -np.inf), squeeze=False, **given,
    )  # fmt: skip
    return run.y, run.x


def stepped(made, u):
    found = [(made.step(each), made.states) for each in u.T]
    y, x = zip(*found, strict=True)
    return np.array(y).T, np.array(x).T


@pytest.mark.parted
@pytest.mark.parametrize("name", SYSTEMS)
def test_steps_are_one_run_bit_for_bit(name):
    """Memories, clocks, delays, events and the integrator's steps go on, also past a window."""
    compiled, u = nlctl.compile(SYSTEMS[name]()), inputs(1, window.HELD_STEPS + 60)
    made = nlctl.stepper(compiled, DT)
    for each, same in zip(stepped(made, u), of_a_run(compiled, u), strict=True):
        np.testing.assert_array_equal(each, same)


@pytest.mark.parametrize("dt", [0.05, 0.01])
def test_functions_of_t_agree_to_the_tolerances(dt):
    """They are read for a window of steps, and not for the run that nobody knows the end of."""
    compiled, u = nlctl.compile(sines()), inputs(1, round(25 / dt))
    y, _ = stepped(nlctl.stepper(compiled, dt), u)
    expected, _ = of_a_run(compiled, u, dt)
    np.testing.assert_allclose(y, expected, rtol=0, atol=1e-9)
    assert np.ptp(y[0, round(19 / dt) :]) > 0.5  # the pulse at 20 s is seen


@pytest.mark.parted
@pytest.mark.parametrize("name", SYSTEMS)
def test_what_was_restored_goes_on_as_before(name):
    compiled, u = nlctl.compile(SYSTEMS[name]()), inputs(1, 40)
    made = nlctl.stepper(compiled, DT)
    stepped(made, u[:, :15])
    here = made.snapshot()
    first = stepped(made, u[:, 15:])
    made.step(7.0)
    made.restore(here)
    assert made.time == here.time == pytest.approx(15 * DT)
    np.testing.assert_array_equal(made.states, here.states)
    ahead = made.rollout(u[:, 15:])
    again = stepped(made, u[:, 15:])
    np.testing.assert_array_equal(ahead, first[0])
    for each, same in zip(again, first, strict=True):
        np.testing.assert_array_equal(each, same)


def test_a_state_of_another_branch_brings_its_inputs_with_it():
    """Between two held values the input is a step from what was held at that state."""
    made, u = nlctl.stepper(delayed_loop(), DT), inputs(1, 30)
    start = made.snapshot()
    stepped(made, u[:, :10])
    one = made.snapshot()
    expected = made.rollout(u[:, 10:])
    made.restore(start)
    stepped(made, -3 * u[:, :10])
    made.restore(one)
    np.testing.assert_array_equal(made.rollout(u[:, 10:]), expected)


def test_windows_are_crossed_back_and_forth():
    made, u = nlctl.stepper(memory(nlctl.Backlash()), DT), inputs(1, window.HELD_STEPS + 30)
    stepped(made, u[:, : window.HELD_STEPS - 5])
    here = made.snapshot()
    expected = made.rollout(u[:, window.HELD_STEPS - 5 :])
    y, _ = stepped(made, u[:, window.HELD_STEPS - 5 :])
    np.testing.assert_array_equal(y, expected)
    made.restore(here)
    y, _ = stepped(made, u[:, window.HELD_STEPS - 5 :])
    np.testing.assert_array_equal(y, expected)


def test_a_linear_system_is_its_zero_order_hold():
    """The closed form: x[k+1] = exp(A dt) x[k] + integral of exp(A s) ds B u[k]."""
    system = ct.ss([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0]], 0, name="oscillator")
    exact, u = ct.sample_system(system, DT, "zoh"), inputs(1, 200)
    made = nlctl.stepper(system, DT, rtol=1e-11, atol=1e-13)
    made.reset([1.0, -1.0])
    x, expected = np.array([1.0, -1.0]), []
    for each in u.T:
        x = exact.A @ x + exact.B @ each
        expected.append(x)
    np.testing.assert_allclose(stepped(made, u)[1], np.array(expected).T, rtol=0, atol=1e-9)


def test_python_control_goes_the_same_way_step_by_step():
    made, u, x = nlctl.stepper(pendulum(), DT), inputs(1, 20), np.array([0.5, 0.0])
    made.reset({"plant.x[0]": 0.5})
    for each in u.T:
        run = ct.input_output_response(
            pendulum(), [0, DT], each[0], x, solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-11}
        )
        x = run.x[:, -1]
        made.step(each)
        np.testing.assert_allclose(made.states, x, rtol=0, atol=1e-7)


def test_discrete_time_is_stepped_by_its_own_rule():
    system = ct.ss([[0.5, 0.1], [0, 0.9]], [[0], [1]], [[1, 0]], [[2]], 0.1, name="discrete")
    made, u, x = nlctl.stepper(system, 0.1), inputs(1, 30), np.zeros(2)
    here = made.snapshot()
    for each in u.T:
        x = system.A @ x + system.B @ each
        expected = system.C @ x + system.D @ each
        np.testing.assert_allclose(made.step(each), expected, rtol=1e-14, atol=1e-14)
    ahead = made.rollout(u)
    made.restore(here)
    assert made.time == 0.0
    assert not np.array_equal(made.rollout(u), ahead)


def test_a_reset_takes_state_parameters_time_and_inputs():
    made = nlctl.stepper(nlctl.block(nlctl.Lag(T=1.0), "lag"), 0.1)
    assert made.reset({"lag.v": 2.0}) == [2.0]
    slow = made.step(0.0)
    made.reset([2.0], {"lag.T": 0.5}, time=3.0)
    fast = made.step(0.0)
    np.testing.assert_allclose([slow, fast], [[2 * np.exp(-0.1)], [2 * np.exp(-0.2)]], rtol=1e-8)
    assert made.time == pytest.approx(3.1)
    direct = nlctl.stepper(ct.ss(-1, 1, 1, 5, name="direct"), 0.1)
    assert direct.reset(inputs=2.0) == [10.0]


def test_a_rate_that_is_written_as_2_may_be_two_and_a_half():
    """An episode with another value is exp(-a t)."""
    decay = ct.nlsys(lambda t, x, u, p: [-p["a"] * x[0]], None, inputs=0, states=1, outputs=1,
                     params={"a": 2}, name="decay")  # fmt: skip
    one, many = nlctl.stepper(decay, 0.5), nlctl.vector_stepper(decay, 0.5, 3)
    for a in (2, 2.5):
        one.reset([1.0], params={"decay.a": a})
        assert one.step()[0] == pytest.approx(np.exp(-0.5 * a), rel=1e-7)
    rates = np.array([1.5, 2.0, 2.5])
    many.reset([1.0], params={"decay.a": rates})
    np.testing.assert_allclose(many.step()[:, 0], np.exp(-0.5 * rates), rtol=1e-7)


def test_an_episode_does_not_remember_the_one_before():
    made, u = nlctl.stepper(memory(nlctl.Backlash()), DT), inputs(1, 30)
    first = stepped(made, u)
    made.reset()
    for each, same in zip(stepped(made, u), first, strict=True):
        np.testing.assert_array_equal(each, same)


@nlctl.record
class Bouncing:
    """A ball above a floor that is pushed upwards."""

    g: float = nlctl.param(9.81, unit="m/s^2", meaning="acceleration of gravity", above=0)
    e: float = nlctl.param(0.8, unit="1", meaning="speed behind a bounce, before it 1", at_least=0)
    inputs, outputs, states, feedthrough = ("a",), ("h",), ("h", "v"), False
    initial = {"h": 1.0}
    update = staticmethod(nlctl.equation(lambda t, x, u, p: (x[1], u[0] - p.g)))
    output = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0],)))
    guard = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0],)))
    reset = staticmethod(nlctl.equation(lambda t, x, u, p: (0.0, -p.e * x[1])))


def test_resets_are_taken_and_are_in_the_table_of_the_step():
    made = nlctl.stepper(nlctl.block(Bouncing(), "ball"), 0.1)
    times = []
    for _ in range(20):
        made.step(0.0)
        times += made.events["time"].tolist()
    t0 = np.sqrt(2 / 9.81)
    expected = t0 + 2 * t0 * np.r_[0, np.cumsum(0.8 ** np.arange(1, len(times)))]
    np.testing.assert_allclose(times, expected, rtol=0, atol=1e-8)
    assert len(times) == 3


def escapes():
    return ct.nlsys(
        lambda t, x, u, params: x**2 + u[0], inputs=["u"], states=1, name="escapes", outputs=1
    )


def test_a_run_that_diverges_says_when():
    """x' = x^2 from x = 1 is 1 / (1 - t)."""
    made = nlctl.stepper(escapes(), 0.3)
    made.reset([1.0])
    for _ in range(3):
        made.step(0.0)
    with pytest.raises(nlctl.errors.DivergedError, match="'escapes' diverged") as raised:
        made.step(0.0)
    assert raised.value.time == pytest.approx(1.0, abs=1e-6)
    assert not made.success
    with pytest.raises(nlctl.errors.UsageError, match=r"diverged.*call reset\(\) or restore"):
        made.step(0.0)
    made.reset()
    assert made.success


def test_with_ignore_errors_what_has_ended_is_nan_until_it_is_restored():
    made = nlctl.stepper(escapes(), 0.3, ignore_errors=True)
    made.reset([1.0])
    here = made.snapshot()
    y = np.array([made.step(0.0) for _ in range(6)]).ravel()
    np.testing.assert_allclose(y[:3], 1 / (1 - 0.3 * np.arange(1, 4)), rtol=1e-6)
    assert np.isnan(y[3:]).all()
    assert not made.success
    assert "diverged" in repr(made)
    made.restore(here)
    assert made.success
    ahead = made.rollout(np.zeros((1, 6)))
    np.testing.assert_array_equal(ahead[0], y)
    assert made.success  # a roll-out that diverges is not this run


@pytest.mark.parametrize("make", [pendulum, lambda: ct.ss(0.5, 1, 1, 0, 0.05, name="discrete")])
def test_nan_travels(make):
    made = nlctl.stepper(make(), DT, ignore_errors=True)
    assert np.isnan(made.step(np.nan)).all()
    assert not made.success
    loud = nlctl.stepper(make(), DT)
    with pytest.raises(nlctl.errors.DivergedError):
        loud.step(np.nan)


def test_chattering_is_named():
    system = ct.nlsys(
        lambda t, x, u, params: u[0] - np.sign(x[0]), inputs=["u"], outputs=["x"], states=1,
        name="coulomb",
    )  # fmt: skip
    made = nlctl.stepper(system, 0.5)
    made.reset([0.4])  # which it leaves after 0.4 / 0.7 s
    made.step(0.3)
    with pytest.raises(nlctl.errors.ChatteringError, match="coulomb"):
        made.step(0.3)


def test_wrong_calls_are_refused_by_name():
    made = nlctl.stepper(pendulum(), DT)
    with pytest.raises(
        nlctl.errors.ParameterError, match=r"step needs 1 number for the inputs \(v\)"
    ):
        made.step([1.0, 2.0])
    with pytest.raises(
        nlctl.errors.ParameterError, match=r"rollout needs inputs of shape \(1, m\)"
    ):
        made.rollout(np.ones((2, 5)))
    with pytest.raises(nlctl.errors.ParameterError, match="snapshot"):
        made.restore(nlctl.stepper(pendulum(), DT).snapshot())
    with pytest.raises(nlctl.errors.ParameterError, match="stepper needs a finite dt > 0"):
        nlctl.stepper(pendulum(), 0.0)
    with pytest.raises(nlctl.errors.ParameterError, match=r"stepper needs dt=0.1 for 'd'"):
        nlctl.stepper(ct.ss(0.5, 1, 1, 0, 0.1, name="d"), 0.2)
    with pytest.raises(nlctl.errors.UnknownNameError):
        made.reset({"plant.x[7]": 1.0})


def test_the_first_step_is_audited():
    """A function that is not what its source says is caught, as in a run."""
    compiled = nlctl.compile(pendulum())
    made = nlctl.stepper(compiled, DT, audit="every run")
    made.step(0.1)
    with pytest.raises(nlctl.errors.ParameterError, match="audit"):
        nlctl.stepper(compiled, DT, audit="never").step(0.1)
