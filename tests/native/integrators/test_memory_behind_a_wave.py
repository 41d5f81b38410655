"""Memories behind signals that jump at times known before a run: what they see next to these."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

TIMES = np.array([0, 0.5, 0.8, 1.2])


def driven(wave, actuator, phase):
    """u = (0.9 + 0.18 t) wave(w t + phase) in front of an actuator."""
    source = ct.nlsys(
        None, lambda t, x, u, p: [(0.9 + 0.18 * t) * wave(p["w"] * t + p["f"])], inputs=0,
        outputs=["u"], params={"w": 4.0, "f": phase}, name="source",
    )  # fmt: skip
    return nlctl.interconnect({"source": source, "actuator": actuator}, outputs=["v"])


WAVES = {
    "sign": lambda z: np.sign(np.sin(z)),
    "comparison": lambda z: np.where(np.sin(z) > 0, 1.0, -1.0),
    "exponential": lambda z: 1.0 if np.exp(np.sin(z)) > 1.0 else -1.0,
}


@pytest.mark.parametrize(("wave", "turns"), crossed(WAVES, [0, 1_000_000]))
@pytest.mark.parametrize(
    ("actuator", "behind"),
    [
        (nlctl.actuators.Stop(r=0.7), lambda t: -0.7),
        (nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.7, c_l=-0.7), lambda t: -0.2 - 0.18 * t),
    ],
    ids=["stop", "play"],
)
def test_every_frequency(wave, actuator, behind, turns):
    """u jumps to -u at (pi - 0.3) / w: the play comes to u + r, the stop to -r."""
    # The switch is one of floats, and the machine's product and sum may be contracted: which of
    # them is the first behind it depends on w.  With a large phase it is a thousand million apart.
    loop = nlctl.compile(driven(wave, actuator, 0.3 + 2.0 * np.pi * turns))
    w = np.linspace(4.0, 4.03, 61)
    for value in w[::4]:
        run = nlctl.input_output_response(
            loop, TIMES, params={"source.w": value}, audit=False, max_steps=10_000
        )
        assert np.allclose(run.outputs[0, 2:], behind(TIMES[2:]), rtol=0, atol=1e-9)
        switches = run.events[run.events["which"] == "condition of t"]
        np.testing.assert_allclose(switches["time"], (np.pi - 0.3) / value, rtol=0, atol=1e-8)
        assert len(switches) >= 1
    many = nlctl.ensemble_response(loop, TIMES, params={"source.w": w}, keep=["v"], audit=False)
    assert np.allclose(many.signals["v"][:, 2:], behind(TIMES[2:]), rtol=0, atol=1e-9)


@pytest.mark.parted
@pytest.mark.parametrize("w", np.linspace(4.0, 4.03, 5))
def test_every_frequency_in_python_control(w):
    loop = driven(WAVES["sign"], nlctl.actuators.Stop(r=0.7), 0.3)
    run = nlctl.input_output_response(loop, TIMES, params={"source.w": w}, engine="python-control")
    assert np.allclose(run.outputs[0], [0.7, 0.7, -0.7, -0.7], rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", [None, "python-control"])
def test_a_sample_at_the_jump(engine):
    """u jumps at t = 0.8 from 1.044 to -1.044, where a sample is: the stop jumps with it."""
    wave = driven(lambda z: 1.0 if z < 3.5 else -1.0, nlctl.actuators.Stop(r=0.7), 0.3)
    run = nlctl.input_output_response(wave, TIMES, engine=engine)
    assert np.allclose(run.outputs[0], [0.7, 0.7, -0.7, -0.7], rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", [None, "python-control"])
def test_a_sample_at_an_instant_of_a_clock(engine):
    """The stop is driven by t less what a sampled block holds: 0, and 2 from t = 0.8 s on."""
    held = nlctl.sampled(
        ct.nlsys(
            None, lambda t, x, u, p: [0.0 if t < 0.7 else 2.0], inputs=0, outputs=["held"],
            dt=0.4, name="held",
        )
    )  # fmt: skip
    source = ct.nlsys(
        None, lambda t, x, u, p: [t - u[0]], inputs=["held"], outputs=["u"], name="source"
    )
    loop = nlctl.interconnect(
        {"held": held, "source": source, "actuator": nlctl.actuators.Stop(r=0.3)}, outputs=["v"]
    )
    run = nlctl.input_output_response(loop, [0, 0.5, 0.8, 1.2], engine=engine)
    assert np.allclose(run.outputs[0], [0.0, 0.3, -0.3, 0.1], rtol=0, atol=1e-9)
