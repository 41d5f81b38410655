"""Many runs step by step: each is a stepper of its own, bit for bit."""

import control as ct
import numpy as np
import pytest
from test_stepper import DT, SYSTEMS, pendulum

import nlctl
from nlctl.native.stepping import window

SIZE = 4


def same(many, alone):
    np.testing.assert_array_equal(many.states, [each.states for each in alone])
    np.testing.assert_array_equal(many.time, [each.time for each in alone])
    np.testing.assert_array_equal(many.success, [each.success for each in alone])
    assert many.messages == tuple(each.message for each in alone)


@pytest.mark.parted
@pytest.mark.parametrize("name", SYSTEMS)
def test_members_are_steppers_bit_for_bit(name):
    """Past a window, and with some that begin again on the way."""
    compiled, rng = nlctl.compile(SYSTEMS[name]()), np.random.default_rng(3)
    many = nlctl.vector_stepper(compiled, DT, SIZE)
    alone = [nlctl.stepper(compiled, DT) for _ in range(SIZE)]
    x0 = nlctl.initial_state(compiled) + 0.1 * rng.normal(size=(SIZE, compiled.system.nstates))
    y = [each.reset(x) for each, x in zip(alone, x0, strict=True)]
    np.testing.assert_array_equal(many.reset(x0), y)
    for k in range(window.HELD_STEPS + 20):
        if k in (30, window.HELD_STEPS + 5):
            many.reset(x0, members=[1, 3])
            for i in (1, 3):
                alone[i].reset(x0[i])
        u = rng.normal(size=(SIZE, 1))
        y = [each.step(one) for each, one in zip(alone, u, strict=True)]
        np.testing.assert_array_equal(many.step(u), y)
    same(many, alone)
    for i, each in enumerate(alone):
        rows = many.events[many.events["member"] == i].drop(columns="member")
        assert rows.to_numpy().tolist() == each.events.to_numpy().tolist()


def test_each_has_parameters_and_a_state_of_its_own():
    """The closed form of a lag, T y' = u - y."""
    T, y0 = np.array([0.5, 1.0, 2.0]), np.array([0.0, 1.0, -1.0])
    many = nlctl.vector_stepper(nlctl.block(nlctl.Lag(), "lag"), 0.1, 3)
    many.reset({"lag.v": y0}, {"lag.T": T})
    for _ in range(5):
        y = many.step([1.0, 2.0, 3.0])
    u = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(y[:, 0], u + (y0 - u) * np.exp(-0.5 / T), atol=1e-8)
    again = many.reset({"lag.v": 5.0}, members=[False, True, False])
    np.testing.assert_array_equal(again[:, 0], [y[0, 0], 5.0, y[2, 0]])
    np.testing.assert_allclose(many.time, [0.5, 0.0, 0.5])


def test_one_that_ends_leaves_the_others_alone():
    """x' = x^2 + u has no solution after 1 / x(0)."""
    grows = ct.nlsys(
        lambda t, x, u, params: [x[0] ** 2 + u[0]], None, inputs=1, outputs=1, states=1, name="it"
    )
    many = nlctl.vector_stepper(grows, 0.1, 3)
    alone = [nlctl.stepper(grows, 0.1, ignore_errors=True) for _ in range(3)]
    x0 = np.array([[0.1], [2.0], [0.2]])
    many.reset(x0)
    for each, x in zip(alone, x0, strict=True):
        each.reset(x)
    for _ in range(8):
        np.testing.assert_array_equal(many.step(), [each.step() for each in alone])
    same(many, alone)
    assert many.success.tolist() == [True, False, True]
    assert np.isnan(many.step()[1]).all()
    many.reset([0.1], members=[1])
    assert many.success.all()


def test_discrete_time_is_stepped_by_its_own_rule():
    system = ct.ss([[0.5]], [[1.0]], [[1.0]], 0, 0.1, name="discrete")
    many, u = nlctl.vector_stepper(system, 0.1, 2), np.array([[1.0], [2.0]])
    x = np.zeros((2, 1))
    for _ in range(4):
        x = 0.5 * x + u
        np.testing.assert_array_equal(many.step(u), x)


def test_what_is_refused():
    many = nlctl.vector_stepper(pendulum(), DT, 3)
    error = nlctl.errors.ParameterError
    with pytest.raises(error, match=r"step needs inputs of shape \(3, 1\).*got shape \(2,\)"):
        many.step([1.0, 2.0])
    with pytest.raises(error, match="for each of 3 members, got 2"):
        many.reset({"plant.x[0]": [1.0, 2.0]})
    with pytest.raises(error, match=r"numbers from 0 to 2.*got \[3\]"):
        many.reset(members=[3])
    with pytest.raises(error, match="size >= 1, got 0"):
        nlctl.vector_stepper(pendulum(), DT, 0)
    assert "3 members" in repr(many)
