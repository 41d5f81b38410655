r"""
Loops that saturate and are not symmetric
=========================================

Generalised plays follow one envelope while the input rises and another while it falls. Envelopes of the form
:math:`a_0 \tanh(a_1 u + a_2) + a_3` make hysteresis that saturates; ends that differ make its loops asymmetric.
Between the envelopes :math:`\tanh(u - c)` and :math:`\tanh(u + c)`, a play without a gap of its own encloses

.. math:: \int_{-\infty}^{\infty} \tanh(u + c) - \tanh(u - c)\, du = 4 c.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

c, t = 0.6, np.linspace(0, 1, 4001)
shown = {
    "between two equal saturations": nlctl.actuators.GeneralisedPrandtlIshlinskii(
        rising=(1, 1, -c, 0), falling=(1, 1, c, 0), w=(1,), r=(0,)
    ),
    "four plays, another falling envelope": nlctl.actuators.GeneralisedPrandtlIshlinskii(
        rising=(1, 1, -0.4, 0), falling=(1.2, 1.2, 0.6, 0.25), r=(0, 0.1, 0.2, 0.3)
    ),
}
paths = ([8, -8, 8], [8, -8, 0.6, -0.6, 0.6], [-8, 8, -0.6, 0.6, -0.6])  # a whole loop, two inside
figure, axes = plt.subplots(1, 2, figsize=(7.5, 3.6), sharex=True, layout="constrained")
areas = []
for ax, (title, record) in zip(axes, shown.items(), strict=True):
    operator = nlctl.block(record, "operator")
    for path in paths:
        u = np.interp(t, np.linspace(0, 1, len(path)), path)
        v = nlctl.input_output_response(operator, t, u).outputs
        ax.plot(u, v, linewidth=1.2 if path is paths[0] else 0.8)
        areas.append(-np.trapezoid(v, u))
    ax.set(xlabel="input u", xlim=(-3.5, 3.5))
    ax.set_title(title, fontsize="medium")
axes[0].set_ylabel("output v")
print(f"area {areas[0]:.5f}, 4 c = {4 * c}")
assert abs(areas[0] - 4 * c) < 1e-4
