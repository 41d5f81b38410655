"""Rest that is reached in finite time: x' = -sign(x) sqrt(|x|) is (1 - t / 2)^2 until 2 s."""

import control as ct
import numpy as np
import pytest
from examples import crossed
from scipy.optimize import brentq

import nlctl
from nlctl.native import windows

LAWS = {
    "a tank": lambda t, x, u, p: [-np.sqrt(max(x[0], 0.0))],
    "sign": lambda t, x, u, p: [-np.sign(x[0]) * np.sqrt(abs(x[0]))],
    "power": lambda t, x, u, p: [-np.sign(x[0]) * abs(x[0]) ** 0.5],
    "if": lambda t, x, u, p: [-np.sqrt(x[0]) if x[0] > 0 else np.sqrt(-x[0])],
    "copysign": lambda t, x, u, p: [-np.copysign(np.sqrt(abs(x[0])), x[0])],
    "heaviside": lambda t, x, u, p: [(1 - 2 * np.heaviside(x[0], 0.5)) * np.sqrt(abs(x[0]))],
}
T = np.linspace(0, 3, 13)


def run(law, **how):
    plant = ct.nlsys(law, lambda t, x, u, p: x, inputs=0, outputs=1, states=1, name="plant")
    return nlctl.input_output_response(
        plant, T, 0, [1.0], rtol=1e-6, atol=1e-8, ignore_errors=True, max_steps=100_000, **how
    )


@pytest.mark.parametrize(("method", "law"), crossed([None, "rodas5p"], LAWS))
def test_rest_is_reached(law, method):
    response = run(law, method=method)
    assert response.success
    exact = np.maximum(1 - T / 2, 0) ** 2
    assert np.abs(response.outputs - exact).max() < 1e-6


@pytest.mark.parted
@pytest.mark.parametrize("law", [LAWS["sign"], LAWS["if"], LAWS["copysign"], LAWS["heaviside"]])
def test_no_polynomial_leads_away_from_rest(law):
    """Near 0 Taylor's method knows little of sqrt(|x|): it says so, or is right."""
    response = run(law, method="taylor")
    exact = np.maximum(1 - response.time / 2, 0) ** 2
    assert np.abs(response.outputs - exact).max() < 1e-6


def power_law(a):
    def law(t, x, u, p):
        return [-np.sign(x[0]) * abs(x[0]) ** a]

    return law


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("a", [0.3, 1 / 3, 0.5, 0.7])
def test_a_run_at_rest_does_not_crawl(a, rtol):
    """x is (1 - (1 - a) t)^(1 / (1 - a)) and then 0, where rates have no bound."""
    plant = ct.nlsys(power_law(a), inputs=0, outputs=1, states=1, name="plant")
    timepts = np.linspace(0, 20, 41)
    response = nlctl.input_output_response(
        plant, timepts, 0, [1.0], rtol=rtol, atol=0.01 * rtol, max_steps=200_000
    )
    exact = np.maximum(1 - (1 - a) * timepts, 0) ** (1 / (1 - a))
    assert np.abs(response.states - exact).max() < 20 * rtol


def test_members_that_crawl_are_what_they_are_alone():
    law = power_law(1 / 3)
    plant = ct.nlsys(law, lambda t, x, u, p: x, inputs=0, outputs=["x"], states=1, name="plant")
    timepts, first = np.linspace(0, 8, 17), np.array([0.25, 1.0, 4.0])
    how = {"rtol": 1e-7, "atol": 1e-9, "max_steps": 20_000}
    every = nlctl.ensemble_response(plant, timepts, 0, first[:, None], keep=["x"], **how)
    for number, x0 in enumerate(first):
        alone = nlctl.input_output_response(plant, timepts, 0, [x0], **how)
        assert np.array_equal(every.signals["x"][number], alone.outputs[0])


def test_a_trial_that_does_not_pay_leaves_the_run_as_it_was(monkeypatch):
    def crawling(t, x, u, p):
        return [x[1], -np.sign(x[1]) * abs(x[1]) ** (1 / 3) - np.sign(x[0]) * abs(x[0]) ** (1 / 5)]

    plant = ct.nlsys(crawling, inputs=0, outputs=2, states=2, name="plant")
    runs, trials = [], []
    real = windows._by_stiff_method

    def never(*args):
        trials.append(real(*args))
        return trials[-1]

    for replacement in (lambda *_: None, never):
        monkeypatch.setattr(windows, "_FURTHER", np.inf)
        monkeypatch.setattr(windows, "_by_stiff_method", replacement)
        runs.append(
            nlctl.input_output_response(
                plant, np.linspace(0, 10, 11), 0, [1.0, 0.0], rtol=1e-5, atol=1e-7,
                max_steps=20_000, ignore_errors=True,
            )
        )  # fmt: skip
    assert trials
    assert not any(trials)
    assert np.array_equal(runs[0].states, runs[1].states)
    assert runs[0].statistics == runs[1].statistics


K, C = 1.2, 3.0  # of -K sign(z) sqrt(|z|), and of what pushes z away from rest


def pushed(t, x, u, p):
    return [-K * np.sign(x[0]) * np.sqrt(abs(x[0])) + (C if 4.0 < t < 4.3 else 0.0)]


def following(t, x, u, p):
    z = x[0] - u[0]
    return [-K * np.sign(z) * np.sqrt(abs(z))]


def root_behind(start, timepts):
    """Return sqrt(|z|) where z has been at rest, is pushed for 0.3 s, and comes to rest again."""

    def took(s):  # the time of dz / dt = C - K sqrt(z) from 0
        return -2 / K * (s + C / K * np.log1p(-K * s / C)) - min(max(t - start, 0.0), 0.3)

    roots = []
    for t in timepts:
        root = brentq(took, 0.0, 0.999 * C / K, xtol=1e-14)
        roots.append(max(root - K / 2 * max(t - start - 0.3, 0.0), 0.0))
    return np.array(roots)


@pytest.mark.parametrize("rtol", [1e-5, 1e-6, 1e-7, 1e-8])
@pytest.mark.parametrize("method", [None, "rodas5p"])
@pytest.mark.parametrize("law", [pushed, following])
def test_a_push_leads_away_from_rest(law, method, rtol):
    """At 1e-20 the slope of the law is -6e9: linear equations of a step see z stay there."""
    plant = ct.nlsys(law, lambda t, x, u, p: x, inputs=1, outputs=1, states=1, name="plant")
    timepts = np.concatenate([np.linspace(0, 4, 9), [4.1, 4.2, 4.3], np.linspace(4.5, 12, 16)])
    u = -C * np.clip(timepts - 4.0, 0.0, 0.3)
    response = nlctl.input_output_response(
        plant, timepts, u, [1.0], rtol=rtol, atol=0.01 * rtol, method=method, max_steps=60_000
    )
    exact = np.where(timepts < 4, np.maximum(1 - K / 2 * timepts, 0), 0) ** 2
    exact += root_behind(4.0, timepts) ** 2 + (u if law is following else 0.0)
    assert np.abs(response.states - exact).max() < 30 * rtol


LAYERS = {
    "clip": lambda z: np.clip(z, -1, 1),
    "tanh": np.tanh,
    "fraction": lambda z: z / (1 + abs(z)),
}
NARROW = [("clip", 1e-10, None), ("clip", 1e-12, None), ("clip", 1e-6, "rodas5p")]
NARROW += [("tanh", 1e-8, "rodas5p"), ("fraction", 1e-8, "rodas5p"), ("fraction", 1e-10, "rodas5p")]


@pytest.mark.parametrize(("name", "width", "method"), NARROW)
@pytest.mark.parametrize("pushed_by", ["a pulse", "a ramp"])
def test_a_push_leads_out_of_a_narrow_layer(name, width, method, pushed_by):
    """With as good as a relay: x' is the push, less 1, where x is above the layer."""
    shape = LAYERS[name]

    def law(t, x, u, p):
        return [-shape(x[0] / width) + u[0]]

    def pulse(t, x, u, p):
        return [-shape(x[0] / width) + (3.0 if 4.0 < t < 4.3 else 0.0)]

    is_ramp = pushed_by == "a ramp"  # of 3 in 0.1 s: it is 1 a third of that behind 4 s
    plant = ct.nlsys(law if is_ramp else pulse, inputs=1, outputs=1, states=1, name="plant")
    timepts = np.linspace(0, 8, 81)
    push = np.interp(timepts, [4, 4.1, 4.2, 4.3], [0, 3, 3, 0])
    response = nlctl.input_output_response(
        plant, timepts, push, [1e-3], rtol=1e-7, atol=1e-9, method=method, max_steps=100_000
    )
    behind = timepts - 4.0
    if is_ramp:
        rising = 15 * np.maximum(np.minimum(behind, 0.1) - 1 / 30, 0) ** 2
        held = 2 * np.clip(behind - 0.1, 0, 0.1)
        s = np.clip(behind - 0.2, 0, 0.1)
        exact = rising + held + 2 * s - 15 * s**2 - np.maximum(behind - 0.3, 0)
    else:
        exact = 2 * np.clip(behind, 0, 0.3) - np.maximum(behind - 0.3, 0)
    wrong = np.abs(response.states[0] - np.maximum(exact, 0))[1:]
    assert wrong.max() < 1e-5 + 100 * width * (1 if name != "fraction" else 30)


def both(t, x, u, p):
    z = x[0] - u[0]
    return [-K * np.sign(z) * np.sqrt(abs(z)) + (C if 4.0 < t < 4.3 else 0.0)]


@pytest.mark.parametrize("ramp", [2.9, 3.05, 3.3, 4.0, 6.0])
@pytest.mark.parametrize("method", [None, "rodas5p"])
def test_a_push_is_seen_that_a_ramp_nearly_takes_back(method, ramp):
    """z' = C - ramp - K sign(z) sqrt(|z|) from 0, in a closed form."""
    plant = ct.nlsys(both, lambda t, x, u, p: x, inputs=1, outputs=1, states=1, name="plant")
    timepts = np.concatenate([np.linspace(0, 4, 9), [4.1, 4.2, 4.3, 5.0]])
    u = ramp * np.clip(timepts - 4.0, 0.0, 0.3)
    response = nlctl.input_output_response(
        plant, timepts, u, [1.0], rtol=1e-7, atol=1e-9, method=method, max_steps=60_000
    )
    most = abs(C - ramp) / K  # of sqrt(|z|), in the end
    root = brentq(
        lambda s: -2 / K * (s + most * np.log1p(-s / most)) - 0.3, 0.0, most * (1 - 1e-12)
    )
    exact = np.sign(C - ramp) * root**2 + u[-2]
    assert response.states[0, -2] == pytest.approx(exact, abs=1e-6)
