"""`floor`, `round`, `%` jump at every integer; an event says which way what is counted goes."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

COUNTS = {
    "floor": (np.floor, 0.0),
    "round": (round, 0.5),
    "%": (lambda s: s % 1, 0.0),
    "ceil": (np.ceil, 0.0),
    "//": (lambda s: s // 1, 0.0),
}
WAYS = [{"method": name} for name in ("tsit5", "rodas5p", "taylor")]
WAYS.append({"engine": "python-control"})
T = np.linspace(0, 4, 5)


def run(count, rate, how):
    """A state s from 0.2 on, and the integral of what is counted of it."""
    system = ct.nlsys(
        lambda t, x, u, p: [rate(t), count(x[0])], lambda t, x, u, p: x, inputs=0, outputs=2,
        states=2, name="counter",
    )  # fmt: skip
    response = nlctl.input_output_response(system, T, 0, [0.2, 0], rtol=1e-7, atol=1e-9, **how)
    events = response.events
    return events[events["which"] != "comparison"]


@pytest.mark.parametrize(("how", "sign"), crossed(WAYS, [1.0, -1.0]))
@pytest.mark.parametrize(("count", "shift"), COUNTS.values(), ids=COUNTS)
def test_a_ramp(count, shift, sign, how):
    """s = 0.2 +- t: four events, all in the direction of the ramp."""
    events = run(count, lambda t: sign, how)
    assert list(events["direction"]) == ["rising" if sign > 0 else "falling"] * 4
    first = (1 - (0.2 + shift) % 1 if sign > 0 else (0.2 + shift) % 1) % 1
    np.testing.assert_allclose(events["time"], first + np.arange(4), atol=1e-6)


@pytest.mark.parametrize(("how", "name"), crossed(WAYS, ["floor", "round", "%"]))
def test_a_sine(name, how):
    """s = 0.2 + 3 sin(t): each event is at an integer, in the direction of cos(t)."""
    count, shift = COUNTS[name]
    events = run(count, lambda t: 3 * np.cos(t), how)
    level = 0.2 + 3 * np.sin(events["time"]) + shift
    np.testing.assert_allclose(level, np.round(level), atol=1e-5)
    rising = np.array(events["direction"] == "rising")
    np.testing.assert_array_equal(rising, np.cos(events["time"]) > 0)
    ends = [0.2 + shift, 3.2 + shift, 3 * np.sin(4) + 0.2 + shift]
    assert len(events) == sum(abs(np.diff(np.floor(ends))))


def test_a_ramp_that_turns():
    """From 0.2 to 2.2 and back."""
    half = run(np.floor, lambda t: 1.0 if t < 2 else -1.0, WAYS[0])
    directions = list(half["direction"][half["which"] == "floor"])
    assert directions == ["rising"] * 2 + ["falling"] * 2
