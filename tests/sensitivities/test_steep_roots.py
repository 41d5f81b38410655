"""Derivatives of runs through what is infinitely steep at 0, such as flows through orifices."""

import math

import control as ct
import numpy as np
import pytest

import nlctl


def root_of_abs(z, params):
    return np.sqrt(np.abs(z))


def orifice(z, params):
    return np.sign(z) * np.sqrt(np.abs(z))


def orifice_by_where(z, params):
    return np.where(z > 0, np.sqrt(np.abs(z)), -np.sqrt(np.abs(z)))


def orifice_by_choice(z, params):
    return np.sqrt(z) if z >= 0 else -np.sqrt(-z)


def one_way(z, params):
    return math.sqrt(max(z, 0.0))


def one_way_back(z, params):
    return np.sqrt(np.maximum(-z, 0.0))


def one_way_by_choice(z, params):
    return math.sqrt(z) if z > 0 else 0.0


def one_way_by_where(z, params):
    return np.sqrt(np.where(z > 0, z, 0.0))


def clipped(z, params):
    return np.sqrt(np.clip(z, 0, 5))


def any_power(z, params):
    return np.sign(z) * np.abs(z) ** params["power"]


def third(z, params):
    return np.cbrt(z)


def nested(z, params):
    return np.sqrt(z**2) ** 0.5


LAWS = [
    root_of_abs, orifice, orifice_by_where, orifice_by_choice, one_way, one_way_back,
    one_way_by_choice, one_way_by_where, clipped, any_power, third, nested,
]  # fmt: skip


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("law", LAWS)
def test_integrals_of_roots_move_by_their_ends(law, rtol):
    """With x' = 1, y' = f(x - p), that is x = t: dy/dp = f(-p) - f(t - p), wherever f is steep."""
    params = {"p": 0.37, "power": 0.5}
    plant = ct.nlsys(
        lambda t, x, u, params: [1.0, law(x[0] - params["p"], params)], None, states=2, inputs=0,
        outputs=2, params=params, name="plant",
    )  # fmt: skip
    times = np.array([0.0, 0.2, 0.8, 1.6])
    by = nlctl.sensitivity_response(plant, times, 0, 0, with_respect_to=["p"], rtol=rtol, atol=rtol)
    assert not by.missing
    f = [float(law(t - 0.37, params)) for t in times]
    slope = [f[0] - value for value in f]
    assert by.derivatives[1, 0] == pytest.approx(slope, abs=max(300 * rtol, 3e-7))


def test_elements_of_an_array_pass_0_one_after_the_other():
    def update(t, x, u, params):
        flow = np.sign(x - params["p"]) * np.sqrt(np.abs(x - params["p"]))
        return np.concatenate([[1.0, 0.5], flow[:2]])

    plant = ct.nlsys(update, None, states=4, inputs=0, outputs=4, params={"p": 0.4}, name="plant")
    by = nlctl.sensitivity_response(plant, [0, 1.5], 0, 0, with_respect_to=["p"])

    def f(z):
        return np.sign(z) * np.sqrt(abs(z))

    slopes = [f(-0.4) - f(1.5 - 0.4), (f(-0.4) - f(0.75 - 0.4)) / 0.5]
    assert by.derivatives[2:, 0, -1] == pytest.approx(slopes, abs=1e-6)


def test_two_tanks_whose_flow_reverses():
    """Differences of runs, whose errors are of the order of the step's square."""

    def update(t, x, u, params):
        over = x[0] - x[1]
        between = params["k"] * np.sign(over) * np.sqrt(np.abs(over))
        return [
            params["q"] - between - 0.3 * x[0],
            between - params["a"] * x[1] + np.sin(t),
        ]

    tanks = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="tanks",
                     params={"q": 0.3, "k": 0.7, "a": 0.4})  # fmt: skip
    times, start, h = np.linspace(0, 4, 21), [1.0, 0.5], 1e-4
    by = nlctl.sensitivity_response(tanks, times, 0, start, with_respect_to=["q", "k", "a"])
    assert not by.missing
    for j, name in enumerate(("q", "k", "a")):
        low, high = (
            nlctl.input_output_response(
                tanks, times, 0, start, params={name: tanks.params[name] + d},
                rtol=1e-12, atol=1e-14,
            ).states for d in (-h, h)
        )  # fmt: skip
        assert by.derivatives[:, j] == pytest.approx((high - low) / (2 * h), abs=3e-7)


def test_a_root_in_its_own_rate_is_as_right_as_is_asked_for():
    """A loop with two roots, in which a step across was 15,000 times its tolerance wrong."""

    def update(t, x, u, params):
        one, two = x[0] + 0.3129 * np.tanh(x[2]), x[1] + 0.24 * np.tanh(x[0])
        dead = 0.3651 * x[2] - 0.3772 * x[1]
        return [
            -0.9603 * x[0] + 0.9942 * x[1] + 0.9023 * math.sin(0.5887 * t)
            + 1.108 * max(x[0] + 0.4137 * np.tanh(x[2]), 0.4838) + 0.5838 * math.sqrt(abs(two)),
            params["a"] * x[1] + params["b"] * x[2] - 1.241 * one / (abs(one) + 0.124)
            + 1.031 * (x[1] + 0.2177 > 0.2528),
            -0.7944 * x[2] + 0.9447 * x[0]
            - 0.8761 * (dead - 0.2238 if dead > 0.2238 else dead + 0.2238 if dead < -0.2238 else 0),
        ]  # fmt: skip

    start = [float(v) for v in (0.6154, -0.8571, 0.2143)]
    plant = ct.nlsys(update, None, states=3, inputs=0, outputs=3, name="plant",
                     params={"a": -0.8329, "b": -0.5372})  # fmt: skip
    times = np.linspace(0, 4, 21)
    runs = {
        rtol: nlctl.sensitivity_response(
            plant, times, 0, start, with_respect_to=["a", "b"], rtol=rtol, atol=rtol / 100
        ) for rtol in (1e-6, 2e-7, 1e-7, 3e-8, 1e-10)
    }  # fmt: skip
    best = runs.pop(1e-10)
    assert not best.missing
    for rtol, by in runs.items():
        assert by.derivatives == pytest.approx(best.derivatives, abs=500 * rtol), rtol


def emptying(t, x, u, params):
    return [-params["k"] * np.sqrt(max(x[0], 0.0))]


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
def test_an_empty_tank_has_forgotten_its_outlet(rtol):
    """x = (1 - k t / 2)^2 until that is 0: dx/dk = -t (1 - k t / 2), and 0 from then on."""
    tank = ct.nlsys(emptying, None, states=1, inputs=0, outputs=1, name="tank", params={"k": 1.3})
    times = np.linspace(0, 6, 25)
    by = nlctl.sensitivity_response(
        tank, times, 0, 1.0, with_respect_to=["k"], rtol=rtol, atol=rtol
    )
    assert not by.missing
    slope = -times * np.maximum(1 - 0.65 * times, 0.0)
    assert by.derivatives[0, 0] == pytest.approx(slope, abs=30 * rtol)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_what_no_step_integrates_has_no_derivative_behind_it(rtol):
    """y' = log|x - p|: 1 / (x - p) has no integral."""
    plant = ct.nlsys(
        lambda t, x, u, params: [1.0, np.log(abs(x[0] - params["p"]))], None, states=2, inputs=0,
        outputs=2, name="plant", params={"p": 0.37},
    )  # fmt: skip
    by = nlctl.sensitivity_response(
        plant, [0, 0.2, 1], 0, 0, with_respect_to=["p"], rtol=rtol, atol=rtol
    )
    before, behind = by.derivatives[1, 0, 1:]
    assert before == pytest.approx(np.log(0.37) - np.log(0.17), rel=100 * rtol)
    assert np.isnan(behind)
    assert "cannot be integrated further" in str(by)
