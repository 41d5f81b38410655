r"""
A fault from a time on
======================

An actuator that loses half of its gain at 2 s: a first-order loop :math:`\dot x = -x + v`, :math:`v = 4 (1 - x)`, moves from
the steady state :math:`4/5` to that of the half gain, :math:`2/3`, with the rate 3 instead of 5.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

plant = ct.ss(-1.0, 1.0, 1.0, 0.0, inputs=["v"], outputs=["x"], name="plant")
law = ct.nlsys(
    None, lambda t, x, u, params: 4.0 * (1.0 - u[0]), inputs=["x"], outputs=["u"], name="law"
)
actuator = nlctl.block(nlctl.Gain(k=1.0), "actuator")
loop = ct.interconnect([plant, law, actuator], inputs=[], outputs=["x", "v"], name="loop")
faulty = nlctl.with_faults(loop, nlctl.Fault("actuator.v", "gain", 0.5, at=2.0))
t = np.linspace(0, 4, 4001)
x = nlctl.input_output_response(faulty, t, rtol=1e-10, atol=1e-12).outputs[0]

before = 0.8 * (1 - np.exp(-5 * t))
after = 2 / 3 + (0.8 * (1 - np.exp(-10)) - 2 / 3) * np.exp(-3 * (t - 2))
exact = np.where(t < 2, before, after)
figure, axes = plt.subplots(figsize=(6, 3))
axes.plot(t, x)
axes.plot(t[::200], exact[::200], "o", markersize=4)
axes.set(xlabel="t (s)", ylabel="x")
assert np.abs(x - exact).max() < 1e-8
