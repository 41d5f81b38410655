r"""
Loops of operators with memory
==============================

Relay, stop, Prandtl-Ishlinskii and Preisach operators under a slow sine of amplitude :math:`A`. Per period a relay
with thresholds :math:`\pm a` and height :math:`h` encloses the area :math:`4 a h`, a stop of threshold :math:`r`
the area :math:`4 r (A - r)`; weighted sums enclose the sums of the areas.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

A, t = 2.0, np.linspace(0, 4 * np.pi, 16_001)
u = A * np.sin(t)
w, r = (0.25, 0.15, 0.1), (0.2, 0.6, 1.2)
alpha, beta = nlctl.actuators.relay_grid(np.linspace(-1.5, 1.5, 7))
shown = {
    "Relay": nlctl.Relay(on=0.7, off=-0.7, height=1.0),
    "Stop": nlctl.actuators.Stop(r=1.0),
    "PrandtlIshlinskii": nlctl.actuators.PrandtlIshlinskii(w=w, r=r),
    "Preisach": nlctl.actuators.Preisach(alpha=alpha, beta=beta, w=(1 / len(alpha),) * len(alpha)),
}
exact = {
    "Relay": 4 * 0.7 * 1.0,
    "Stop": 4 * 1.0 * (A - 1.0),
    "PrandtlIshlinskii": sum(a * 4 * b * (A - b) for a, b in zip(w, r, strict=True)),
    "Preisach": np.mean([2 * (a - b) for a, b in zip(alpha, beta, strict=True)]),
}
figure, axes = plt.subplots(2, 2, figsize=(6.5, 5.5), layout="constrained")
for ax, (name, record) in zip(axes.flat, shown.items(), strict=True):
    v = nlctl.input_output_response(nlctl.block(record, "operator"), t, u).outputs
    ax.plot(u, v)
    ax.set_title(name, fontsize="medium")
    late = t >= 2 * np.pi  # the second period is closed
    area = abs(np.trapezoid(v[late], u[late]))
    print(f"{name}: {area:.4f}, closed form {exact[name]:.4f}")
    assert abs(area - exact[name]) < 5e-3 * exact[name]
