r"""
A friction limit cycle
======================

A mass on a rough belt of velocity :math:`V`, held by a spring: it sticks until the spring pulls with :math:`F_{s}`,
slips back, and sticks again. With the frequency :math:`\omega = \sqrt{k/m}` and Coulomb friction :math:`F_{c}` while it
slips, a slip takes :math:`\frac{2}{\omega} (\pi - \arctan s)` and a stick :math:`\frac{2 s}{\omega}`, where
:math:`s = (F_{s} - F_{c}) \omega / (k V)`.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

m, k, V, F_s, F_c = 1.0, 4.0, 0.1, 1.5, 1.0


def body(t, x, u, params):
    return V + x[1], -4.0 * x[0] - u[0]  # elongation of the spring, velocity over the belt


def felt(t, x, u, params):
    return x[1], -4.0 * x[0], x[0]


mass = ct.nlsys(
    body, felt, states=["stretch", "slip"], inputs=["force"],
    outputs=["velocity", "applied", "stretch"], name="mass",
)  # fmt: skip
rough = nlctl.block(nlctl.actuators.StickSlip(F_s=F_s, F_c=F_c, sigma_2=0.0), "rough")
loop = ct.interconnect([mass, rough], inputs=[], outputs=["stretch", "force"], name="loop")
t = np.linspace(0, 40, 80_001)
response = nlctl.input_output_response(nlctl.compile(loop), t, rtol=1e-8, atol=1e-10)
stretch = response.outputs[0]

figure, axes = plt.subplots(figsize=(6, 3))
axes.plot(t, stretch)
axes.set(xlabel="t (s)", ylabel="spring (m)")

omega = np.sqrt(k / m)
s = (F_s - F_c) * omega / (k * V)
exact = 2 / omega * (np.pi - np.arctan(s) + s)
middle = (stretch[:-1] < 0.25) & (stretch[1:] >= 0.25)
times = t[1:][middle]
period = (times[-1] - times[2]) / (times.size - 3)
print(f"period {period:.4f} s, closed form {exact:.4f} s")
assert abs(period - exact) < 2e-3
