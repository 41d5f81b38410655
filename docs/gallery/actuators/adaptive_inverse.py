r"""
Adaptive inverse of a dead zone
===============================

Tao and Kokotovic (IEEE Transactions on Automatic Control 39, 1994) put an inverse with estimated slopes and break
points in front of a dead zone that nobody knows. The plant wants :math:`v = u_{d}`:
:math:`\dot{r} = -r + v - u_{d}` with :math:`u_{d} = 2 \sin t`. Estimates that start too wide keep
:math:`V = r^{2}/2 + |\theta - \theta^{*}|^{2} / 2 \gamma` falling with :math:`\dot{V} = -r^{2}`, so that
:math:`\int r^{2} \leq V(0)`.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

zone = nlctl.DeadZone(b_r=0.5, b_l=-0.4, slope_r=1.2, slope_l=0.9, ripple_r=0.0, ripple_l=0.0)
true = np.array([1.2, 1.2 * 0.5, 0.9, -0.9 * 0.4])  # m_r, m_r b_r, m_l, m_l b_l
plant = ct.nlsys(
    lambda t, x, u, params: [-x[0] + u[0] - 2 * np.sin(t)],
    lambda t, x, u, params: [x[0], 2 * np.sin(t)],
    states=["r"], inputs=["v"], outputs=["r", "u_d"], name="plant",
)  # fmt: skip
t = np.linspace(0, 40, 20_001)
figure, axes = plt.subplots(figsize=(6, 3))
spent = {}
for label, gamma in (("fixed estimates", 1e-9), ("adaptive", 0.5)):
    inverse = nlctl.controllers.AdaptiveDeadZoneInverse(gamma=gamma, b_0=1.5)
    loop = nlctl.interconnect(
        {"plant": plant, "inverse": inverse, "actuator": zone}, outputs=["r", "b_r_hat"]
    )
    response = nlctl.input_output_response(loop, t, rtol=1e-9, atol=1e-11)
    r = response.outputs[0]
    spent[label] = float(np.trapezoid(r**2, t))
    axes.plot(t, r, label=label)
axes.set(xlabel="t (s)", ylabel="r")
axes.legend()

# %%
# The energy of the error has the bound of the proof, and is what V has lost.
theta = np.array([response.states[nlctl.state_names(loop).index(f"inverse.{k}")]
                  for k in ("m_r", "mb_r", "m_l", "mb_l")])  # fmt: skip
V = r**2 / 2 + np.sum((theta - true[:, None]) ** 2, axis=0) / (2 * 0.5)
print(f"integral of r^2: {spent['adaptive']:.4f} of V(0) = {V[0]:.4f}; fixed: {spent}")
assert abs(V[0] - V[-1] - spent["adaptive"]) < 1e-5
assert spent["adaptive"] < V[0] < spent["fixed estimates"]
