"""Memories behind inputs that jump while they carry them along, against a replay of extremes.

All of these actuators are independent of the rate: what they output depends on the sequence of
extremes of the input alone, whether it got there by a jump or not.
"""

import functools
from types import SimpleNamespace

import control as ct
import numpy as np
import pytest
from examples import crossed, many
from hypothesis import example, given, settings
from hypothesis import strategies as st

import nlctl

ACTUATORS = {
    "play": nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.1, c_l=-0.1),
    "unequal": nlctl.Backlash(m_r=1.2, m_l=0.8, c_r=0.3, c_l=-0.2),
    "stop": nlctl.actuators.Stop(r=0.2),
    "plays": nlctl.actuators.PrandtlIshlinskii(w=(0.3, 0.2), r=(0.1, 0.25)),
    "relay": nlctl.Relay(on=0.4, off=0.1),
    "relays": nlctl.actuators.Preisach(
        alpha=(0.3, 0.6, 0.7), beta=(0.1, 0.2, 0.5), w=(0.3, 0.2, 0.1)
    ),
}
TIMES = (0.5, 0.9, 1.3)


@nlctl.record
class Jumps:
    """y = slope t + a_1 + ... + a_k from t_k on."""

    slope: float = nlctl.param(1.0, unit="1/s", meaning="slope")
    a_1: float = nlctl.param(0.0, unit="1", meaning="first jump")
    a_2: float = nlctl.param(0.0, unit="1", meaning="second jump")
    a_3: float = nlctl.param(0.0, unit="1", meaning="third jump")
    delivers: str = "y"

    inputs, states, feedthrough = (), (), False

    @property
    def outputs(self):
        return (self.delivers,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        first = np.where(t >= TIMES[0], p.a_1, 0.0) + np.where(t >= TIMES[1], p.a_2, 0.0)
        return (p.slope * t + first + np.where(t >= TIMES[2], p.a_3, 0.0),)

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return t - TIMES[0], t - TIMES[1], t - TIMES[2]


def replay(actuator, extremes):
    """Return the output of an actuator after a sequence of inputs."""
    p = SimpleNamespace(**{name: np.array(value) for name, value in vars(actuator).items()})
    x = np.array([actuator.initial[name] for name in actuator.memory])
    for value in extremes:
        x = np.array(actuator.commit(0.0, x, (value,), p))
    return float(actuator.output(0.0, x, (extremes[-1],), p)[0])


def extremes(jumps, rising, end):
    """Return the inputs on both sides of all jumps (time, height), and the last one."""
    found, height = [rising(0.0)], 0.0
    for t, a in jumps:
        if t < end:
            found += [rising(t) + height, rising(t) + height + a]
            height += a
    return [*found, rising(end) + height]


@functools.cache
def behind_corners(name):
    """Return an actuator behind a source that jumps at its corners."""
    loop = {"jumps": Jumps(delivers="u"), "actuator": ACTUATORS[name]}
    return nlctl.compile(nlctl.interconnect(loop, outputs=["v"], name=f"{name}_at_corners"))


@functools.cache
def behind_a_sampler(name):
    """Return an actuator behind u = t + gain t_k, t_k the last instant of a clock of 0.25 s."""
    hold = nlctl.sampled(ct.nlsys(None, held, inputs=["y"], outputs=["h"], params={"gain": 1.0},
                                  name="hold"), 0.25)  # fmt: skip
    total = ct.summing_junction(["y", "h"], "u", name="sum")
    loop = {"clock": Jumps(), "hold": hold, "sum": total, "actuator": ACTUATORS[name]}
    return nlctl.compile(nlctl.interconnect(loop, outputs=["v"], name=f"{name}_sampled"))


def held(t, x, u, params):
    """h = gain y."""
    return [params["gain"] * u[0]]


@functools.cache
def behind_a_delay(name):
    """Return an actuator behind u = t + what jumps, 0.15 s later."""
    line = nlctl.TransportDelay(inputs=("w",), outputs=("h",), delay=0.15)
    total = ct.summing_junction(["y", "h"], "u", name="sum")
    loop = {
        "clock": Jumps(), "jumps": Jumps(slope=0.0, delivers="w"), "line": line, "sum": total,
        "actuator": ACTUATORS[name],
    }  # fmt: skip
    return nlctl.compile(nlctl.interconnect(loop, outputs=["v"], name=f"{name}_delayed"))


heights = st.tuples(*[st.floats(-0.8, 0.8).filter(lambda a: abs(a) > 1e-3)] * 3)
ends = st.floats(0.05, 1.6).filter(lambda t: min(abs(t - s) for s in (*TIMES, 0.25)) > 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), crossed([*ACTUATORS], ["tsit5", "rodas5p", "taylor"]))
@given(heights=heights, end=ends)
@example(heights=(-0.15, 0.01, 0.01), end=0.52)
@settings(max_examples=many(10, part=2))
def test_behind_a_corner(name, method, heights, end):
    """It keeps what it was just before the input jumped back."""
    params = {f"jumps.a_{k + 1}": a for k, a in enumerate(heights)}
    run = nlctl.input_output_response(behind_corners(name), [0, end], params=params, method=method)
    jumps = list(zip(TIMES, heights, strict=True))
    wanted = replay(ACTUATORS[name], extremes(jumps, float, end))
    assert run.outputs[0, -1] == pytest.approx(wanted, abs=2e-7)


@pytest.mark.slow
@pytest.mark.parted(part=2)
@pytest.mark.parametrize("name", ACTUATORS)
@given(gain=st.floats(-3.0, 2.0).filter(lambda a: abs(a) > 0.01), end=st.floats(0.05, 1.6))
@settings(max_examples=many(10, part=2))
def test_behind_a_sampled_block(name, gain, end):
    """Or before the next sample is held."""
    if abs(end / 0.25 - round(end / 0.25)) < 1e-3:
        end += 0.01
    run = nlctl.input_output_response(behind_a_sampler(name), [0, end], params={"gain": gain})
    jumps = [(0.25 * k, 0.25 * gain) for k in range(1, 7)]
    wanted = replay(ACTUATORS[name], extremes(jumps, float, end))
    assert run.outputs[0, -1] == pytest.approx(wanted, abs=2e-7)


@pytest.mark.parted
@pytest.mark.parametrize("name", ACTUATORS)
@given(heights=heights, end=ends)
@settings(max_examples=many(10, part=2))
def test_behind_a_delay(name, heights, end):
    """Or before a jump arrives at the end of a transport delay."""
    params = {f"jumps.a_{k + 1}": a for k, a in enumerate(heights)}
    run = nlctl.input_output_response(behind_a_delay(name), [0, end + 0.15], params=params)
    jumps = [(t + 0.15, a) for t, a in zip(TIMES, heights, strict=True)]
    wanted = replay(ACTUATORS[name], extremes(jumps, float, end + 0.15))
    assert run.outputs[0, -1] == pytest.approx(wanted, abs=2e-7)


@pytest.mark.parted
@pytest.mark.parametrize("method", ["tsit5", "rodas5p"])
@pytest.mark.parametrize("rtol", np.logspace(-11, -6, 11))
def test_behind_a_condition_of_a_state(method, rtol):
    """u = 1.5 (x % 1) falls by 1.5: a stop of 0.5, carried along, is at -0.5, and u back at 0."""
    flow = ct.nlsys(
        lambda t, x, u, params: [1.0], lambda t, x, u, params: 1.5 * (x[0] % 1.0),
        inputs=0, outputs=["u"], states=1, name="saw",
    )  # fmt: skip
    loop = nlctl.interconnect({"saw": flow, "stop": nlctl.actuators.Stop(r=0.5)}, outputs=["v"])
    times = np.r_[0.0, np.arange(1, 31) + 0.2]
    run = nlctl.input_output_response(
        loop, times, 0, 0, method=method, rtol=rtol, atol=rtol / 100, squeeze=True
    )
    np.testing.assert_allclose(run.outputs[1:], -0.2, rtol=0, atol=1e-4)
