"""Guards that are below 0 for no more than what a step may end by behind the kink in their middle,
and windows at the top of a swing: each is seen, by every method, and when it is there."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

METHODS = ("tsit5", "rodas5p", "taylor")


@nlctl.record
class Passes:
    """x' = 1 + |x - 1| / 2 from 0; counts when x comes nearer to a place than a width."""

    place: float = nlctl.param(1.0, unit="1", meaning="middle of the window")
    width: float = nlctl.param(0.1, unit="1", meaning="half of it", above=0)
    inputs, outputs, states, feedthrough = (), ("x", "count"), ("x", "count"), False
    update = staticmethod(nlctl.equation(lambda t, x, u, p: (1.0 + 0.5 * np.abs(x[0] - 1.0), 0.0)))
    output = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0], x[1])))
    guard = staticmethod(nlctl.equation(lambda t, x, u, p: (np.abs(x[0] - p.place) - p.width,)))
    reset = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0], x[1] + 1.0)))


def time_of(x):
    """When x is reached: 3 - 3 e^(-t/2) up to 1, from then on -1 + 2 e^((t - s)/2)."""
    return -2 * np.log((3 - min(x, 1)) / 3) + 2 * np.log((1 + max(x, 1)) / 2)


@pytest.fixture(scope="module")
def passes():
    return nlctl.compile(nlctl.block(Passes(), "passes"))


@pytest.mark.parametrize(("method", "rtol"), crossed([*METHODS], [1e-4, 1e-6, 1e-9]))
def test_a_narrow_guard_around_a_kink_falls_once_and_in_time(passes, method, rtol):
    """At the kink of the rate and elsewhere, and with both kinks within the guard."""
    rng = np.random.default_rng(0)
    for _ in range(40):
        width = 10 ** rng.uniform(np.log10(max(3e-3 * rtol, 1e-8)), -1)
        place = 1 + rng.choice([0, rng.uniform(-3, 3) * width, rng.uniform(-0.8, 0.8)])
        run = nlctl.input_output_response(
            passes, [0, 2], params={"passes.place": place, "passes.width": width}, method=method,
            rtol=rtol, atol=rtol / 100, audit=False,
        )  # fmt: skip
        assert run.outputs[1, -1] == 1, (place, width)
        fell = run.events["time"][run.events["which"] == "guard"].to_numpy()
        assert fell == pytest.approx([time_of(place - width)], abs=3 * rtol)


def peak(t, x, u, params):
    return [x[1], -x[0], 1.0 if x[0] > 1 - params["depth"] else 0.0]


@pytest.mark.parametrize("method", METHODS)
def test_a_window_at_the_top_of_a_swing(method):
    """x = sin t is above 1 - d for 2 arccos(1 - d) around pi / 2, and around each peak."""
    compiled = nlctl.compile(
        ct.nlsys(peak, None, inputs=0, outputs=3, states=3, params={"depth": 1e-3}, name="swing")
    )
    for depth in (1e-3, 1e-5, 1e-7):
        run = nlctl.input_output_response(
            compiled, [0, 3, 9, 15], initial_state=[0, 1, 0], params={"depth": depth},
            method=method, rtol=1e-11, atol=1e-13,
        )  # fmt: skip
        width = 2 * np.arccos(1 - depth)
        # the derivative of the width is 2 / sin: errors of x count 1 / (width / 2) times
        peaks = np.array([0, 1, 2, 3])
        np.testing.assert_allclose(run.states[2], peaks * width, rtol=0, atol=5e-9 / width)
