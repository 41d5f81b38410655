"""A memory behind a square wave of a sine: which side machine code sees next to a switch."""

import control as ct
import numpy as np
import pytest

import nlctl


@pytest.mark.parametrize(
    "wave", [np.sign, lambda s: np.where(s > 0, 1.0, -1.0)], ids=["sign", "comparison"]
)
@pytest.mark.parametrize(
    ("actuator", "behind"),
    [
        (nlctl.actuators.Stop(r=0.7), lambda t: -0.7),
        (nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.7, c_l=-0.7), lambda t: -0.2 - 0.18 * t),
    ],
    ids=["stop", "play"],
)
def test_every_frequency(wave, actuator, behind):
    """u = 0.9 + 0.18 t jumps to -u at (pi - 0.3) / w: the play comes to u + r, the stop to -r."""
    # The root is one of floats, and the machine's product and sum may be contracted: which of them
    # is the first behind the jump depends on w.
    source = ct.nlsys(
        None, lambda t, x, u, p: [(0.9 + 0.18 * t) * wave(np.sin(p["w"] * t + 0.3))], inputs=0,
        outputs=["u"], params={"w": 4.0}, name="source",
    )  # fmt: skip
    loop = nlctl.compile(
        nlctl.interconnect({"source": source, "actuator": actuator}, outputs=["v"])
    )
    t, w = np.array([0, 0.5, 0.8, 1.2]), np.linspace(4.0, 4.03, 61)
    for value in w:
        run = nlctl.input_output_response(
            loop, t, params={"source.w": value}, audit=False, max_steps=10_000
        )
        assert np.allclose(run.outputs[0, 2:], behind(t[2:]), rtol=0, atol=1e-9)
    many = nlctl.ensemble_response(loop, t, params={"source.w": w}, keep=["v"], audit=False)
    assert np.allclose(many.signals["v"][:, 2:], behind(t[2:]), rtol=0, atol=1e-9)
