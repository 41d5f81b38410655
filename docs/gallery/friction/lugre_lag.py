r"""
Frictional lag
==============

Friction lags behind a velocity that changes, the more the faster it changes: a figure of Canudas de Wit, Olsson, Astrom and
Lischinsky (IEEE Trans. Automatic Control 40, 1995, not read; its parameters are the defaults of ``nlctl.actuators.LuGre``). For slow
changes :math:`z = g(v)/\sigma_0 - \tau \, g'(v) \dot v/\sigma_0` with :math:`\tau = g(v)/(\sigma_0 v)` to first order, so that
the loop of the force over the velocity has the area :math:`-\int (\sigma_0 \tau - \sigma_1) \, g'(v) \, \dot v^2 / \sigma_0 \, dt`.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

p = nlctl.actuators.LuGre()
friction = nlctl.compile(nlctl.block(p, "friction"))
figure, axes = plt.subplots(figsize=(5, 3.2), layout="constrained")


def areas(omega):
    """Return the area of the loop (N m/s), and what it tends to for slow changes."""
    t = np.linspace(0, 4 * np.pi / omega, 40_001)
    v, rate = 3e-3 + 2e-3 * np.sin(omega * t), 2e-3 * omega * np.cos(omega * t)
    force = np.asarray(nlctl.input_output_response(friction, t, v).outputs)
    late = t >= t[-1] / 2
    axes.plot(1e3 * v[late], force[late], lw=1, label=f"{omega:g} rad/s")
    bell = (p.F_s - p.F_c) * np.exp(-((v / p.v_s) ** 2))
    g, slope = p.F_c + bell, -2 * v / p.v_s**2 * bell
    slow = -(g / v - p.sigma_1) * slope / p.sigma_0 * rate**2
    return np.trapezoid(force[late], v[late]), np.trapezoid(slow[late], t[late])


loops = {omega: areas(omega) for omega in (0.3, 1.0, 10.0, 25.0)}
axes.set(xlabel="velocity (mm/s)", ylabel="friction (N)")
axes.legend()
for omega, (area, slow) in loops.items():
    print(f"{omega:4.1f} rad/s: area {1e6 * area:.3f} mN mm/s, to first order {1e6 * slow:.3f}")
assert abs(loops[0.3][0] / loops[0.3][1] - 1) < 1e-3
assert abs(loops[1.0][0] / loops[1.0][1] - 1) < 1e-3
assert np.all(np.diff([area for area, _ in loops.values()]) > 0)
