"""Random programs of conditions: products of them, nested choices, %, floor and rint of sums of
states, pulses; all methods of machine code and the reference engine agree, events included."""

import control as ct
import numpy as np
import pytest

import nlctl

TIMES = np.linspace(0, 4, 9)
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def signal(rng):
    """A smooth function of t and x."""
    f, c = rng.uniform(0.5, 5), rng.uniform(0.2, 0.5)
    return [
        lambda t, x: x[0], lambda t, x: x[1], lambda t, x: x[2], lambda t, x: x[0] + x[1],
        lambda t, x: x[0] * x[1], lambda t, x: x[0] + c * np.sin(f * t),
        lambda t, x: x[0] ** 2 - x[1],
    ][rng.integers(7)]  # fmt: skip


def condition(rng):
    a, b = signal(rng), signal(rng)
    level, width, period = rng.uniform(-0.5, 0.5), rng.uniform(0.02, 0.3), rng.uniform(0.4, 1.9)
    return [
        lambda t, x: a(t, x) > level,
        lambda t, x: a(t, x) * (b(t, x) - level) > 0.0,
        lambda t, x: a(t, x) <= b(t, x) + width,
        lambda t, x: (a(t, x) > level) & (b(t, x) < level + width),
        lambda t, x: (a(t, x) > level) | (t % period < width),
        lambda t, x: np.abs(a(t, x) - level) < width,
        lambda t, x: a(t, x) % period > 0.4 * period,
    ][rng.integers(7)]  # fmt: skip


def value(rng, depth=2):
    """A function of t and x that jumps or has kinks."""
    a, level, width = signal(rng), rng.uniform(-0.5, 0.5), rng.uniform(0.1, 0.8)
    if depth == 0:
        return lambda t, x: 0.5 * a(t, x) + level
    first, second = condition(rng), condition(rng)
    one, two, three = (value(rng, depth - 1) for _ in range(3))
    gain = rng.uniform(1, 4)
    return [
        lambda t, x: np.where(first(t, x), one(t, x), two(t, x)),
        lambda t, x: np.where(
            first(t, x), np.where(second(t, x), one(t, x), two(t, x)), three(t, x)
        ),
        lambda t, x: 0.2 * np.floor(gain * (a(t, x) + x[2]) + level),
        lambda t, x: 0.2 * np.rint(gain * a(t, x)),
        lambda t, x: 0.3 * (a(t, x) % width),
        lambda t, x: np.clip(2 * a(t, x), -width, 0.5 * width),
        lambda t, x: np.abs(a(t, x) - level),
        lambda t, x: np.sign(a(t, x) - level) * np.cos(gain * t),
        lambda t, x: 1.0 if t % (2 * width) < 0.1 * width else level,
        lambda t, x: np.maximum(one(t, x), two(t, x)),
    ][rng.integers(10)]  # fmt: skip


def program(rng):
    """An oscillator, a state behind it, and what jumps in both."""
    one, two, w, z = value(rng), value(rng, 1), rng.uniform(0.8, 6), rng.uniform(0.05, 0.6)
    return ct.nlsys(
        lambda t, x, u, p: [
            x[1], -w * x[0] - z * x[1] + 0.6 * two(t, x) + 0.5 * np.sin(1.7 * t), one(t, x) - x[2],
        ],
        None, inputs=0, outputs=3, states=3, name="program",
    )  # fmt: skip


def result(system, start, **how):
    """The states of a run and its events; what it ends with, if it does not reach its end."""
    try:  # the reference does not slide
        made = nlctl.input_output_response(system, TIMES, 0, start, slide=False, **how, **TIGHT)
    except nlctl.errors.DivergedError as error:
        return type(error), None
    return made.states, made.events.sort_values(["which", "direction", "time"])


def check(seed, engines):
    rng = np.random.default_rng(seed)
    system, start = program(rng), rng.uniform(-0.5, 0.5, 3)
    states, events = result(system, start, engine="native", method="tsit5")
    for how in engines:
        others, table = result(system, start, **how)
        if events is None:
            assert others is states
            continue
        np.testing.assert_allclose(others, states, rtol=0, atol=1e-7)
        columns = ["which", "direction"]
        assert table[columns].to_numpy().tolist() == events[columns].to_numpy().tolist()
        np.testing.assert_allclose(table["time"], events["time"], rtol=0, atol=1e-6)


MACHINE = [{"engine": "native", "method": method} for method in ("taylor", "rodas5p")]


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_methods_and_engines_agree(seed):
    check(seed, [MACHINE[0], {"engine": "python-control"}])


@pytest.mark.weekly
@pytest.mark.parametrize("seed", range(3, 40))
def test_methods_and_engines_agree_on_many(seed):
    check(seed, [*MACHINE, {"engine": "python-control"}])
