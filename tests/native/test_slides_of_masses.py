"""Masses with dry friction on the ground and on each other, and long arrays of signs."""

import control as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nlctl
from nlctl.errors import ChatteringError


def plain(update, states):
    """A system of one block."""
    return ct.nlsys(update, None, states=states, inputs=0, outputs=states, name="plant")


def chain(count, sign):
    """Masses on springs with dry friction, of which the first one is shaken."""

    def update(t, x, u, params):
        q, v = x[:count], x[count:]
        stretched = 3.0 * np.diff(q)
        force = np.concatenate([[np.sin(t) * (2 + 0.5 * count)], np.zeros(count - 1)])
        force = force + np.concatenate([stretched, [0.0]]) - np.concatenate([[0.0], stretched])
        return np.concatenate([v, force - 0.4 * sign(v) - 0.05 * v])

    return update


def test_ten_masses_with_friction():
    times = np.linspace(0, 12, 13)
    run = nlctl.input_output_response(plain(chain(10, np.sign), 20), times, 0, 0)
    smooth = chain(10, lambda v: np.clip(v / 1e-5, -1, 1))
    expected = solve_ivp(lambda t, x: smooth(t, x, 0, 0), [0, 12], np.zeros(20), "Radau", times,
                         rtol=1e-6, atol=1e-8, max_step=0.05)  # fmt: skip
    assert run.states == pytest.approx(expected.y, abs=2e-4)
    assert len(run.statistics.slides) == 10


def test_masses_that_stick_to_each_other_and_to_the_ground():
    """Of three friction forces two suffice: two masses come to rest at once, and one goes on.

    Friction of 0.3 on the ground and 0.15 between them, a force of t / 10 on the first: together
    v = 0.3 - 0.3 t + t^2 / 40 until both stop, at rest until t / 10 = 0.45, then the first alone.
    """

    def update(t, x, u, params):
        v = x[2:]
        between = 0.15 * np.sign(v[1] - v[0])
        pushed = np.array([0.1 * t + between, -between])
        return np.concatenate([v, pushed - 0.3 * np.sign(v)])

    times = np.linspace(0, 10, 101)
    run = nlctl.input_output_response(
        plain(update, 4), times, 0, [0, 0, 0.3, 0.3], rtol=1e-9, atol=1e-12
    )
    stop = (0.3 - np.sqrt(0.06)) / 0.05
    first = np.minimum(times, stop)
    together = 0.3 * first - 0.15 * first**2 + first**3 / 120
    alone = np.maximum(times - 4.5, 0.0) ** 3 / 60
    assert run.states[0] == pytest.approx(together + alone, abs=1e-7)
    assert run.states[1] == pytest.approx(together, abs=1e-7)


def rubbing(seed, count, sign):
    """Masses in a row that rub on the ground and on their neighbours, each with a force."""
    rng = np.random.default_rng(seed)
    ground = rng.uniform(0, 0.6, count) * (rng.uniform(size=count) < 0.8)
    between, size = rng.uniform(0.05, 0.6, count - 1), rng.uniform(0.2, 1.2, count)
    omega, phase = rng.uniform(0.3, 1.5, count), rng.uniform(0, 6, count)
    mass = rng.uniform(0.5, 2, count)

    def update(t, x, u, params):
        v = x[count:]
        force = size * np.sin(omega * t + phase)
        rubs = between * sign(np.diff(v))
        force = force + np.concatenate([rubs, [0.0]]) - np.concatenate([[0.0], rubs])
        return np.concatenate([v, (force - ground * sign(v)) / mass])

    return update, np.concatenate([np.zeros(count), rng.normal(size=count)])


@pytest.mark.parametrize(("seed", "count"), [(0, 2), (1, 3), (2, 4), (3, 5)])
def test_rows_of_masses_that_rub_on_each_other(seed, count):
    times = np.linspace(0, 8, 41)
    update, start = rubbing(seed, count, np.sign)
    run = nlctl.input_output_response(plain(update, 2 * count), times, 0, start)
    smooth, _ = rubbing(seed, count, lambda v: np.clip(v / 1e-5, -1, 1))
    expected = solve_ivp(lambda t, x: smooth(t, x, 0, 0), [0, 8], start, "Radau", times,
                         rtol=1e-8, atol=1e-10, max_step=0.02)  # fmt: skip
    assert run.states == pytest.approx(expected.y, abs=2e-4)


def test_a_hundred_elements_slide():
    """x' = c - sign(x) from 0 with |c| < 1 stays there; their conditions are read at once."""
    c = np.concatenate([np.linspace(-0.9, 0.9, 96), [1.5, -1.5, 2.0, -2.0]])
    start = np.where(np.arange(100) % 2, 0.5, -0.25)
    times = np.linspace(0, 12, 25)
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: c - np.sign(x), 100), times, 0, start
    )
    slope = c - np.sign(start)
    straight = start[:, None] + slope[:, None] * times
    meets = -start / slope
    on = np.where(np.abs(c) < 1, 0.0, c - np.sign(c))
    through = (np.sign(c) * np.sign(start) < 0) & (np.abs(c) > 1)
    reached = (meets[:, None] > 0) & (times >= meets[:, None])
    beyond = np.where(through, on, 0.0)[:, None] * (times - meets[:, None])
    assert run.states == pytest.approx(np.where(reached, beyond, straight), abs=1e-8)
    assert len(run.statistics.slides) == 96


def test_a_product_of_many_sums_is_refused_in_time():
    """A sine of ten signs has 2^10 sides where all are 0: the run ends there, with the reason."""

    def update(t, x, u, params):
        return np.concatenate([[np.sin(np.sum(np.sign(x[1:])))], 0.5 - np.sign(x[1:])])

    with pytest.raises(ChatteringError, match="chattering at t = "):
        nlctl.input_output_response(plain(update, 11), [0, 1, 2], 0, np.full(11, 0.1))
