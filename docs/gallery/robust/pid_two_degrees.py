r"""
PID in two degrees of freedom, behind a limit
=============================================

``PID2`` weights the reference by b and c: a step response without overshoot, while a load is answered as before. From the
load to y both are :math:`P / (1 + P C)`. Behind a limit the integral winds up, unless back-calculation or clamping holds it.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

plant = ct.ss([[0, 1], [-1, -2]], [[0], [1]], [[1, 0]], 0, inputs="v", outputs="y", name="plant")
add = ct.summing_junction(["u", "load"], "v", name="add")
load = nlctl.sources.Pulse(height=-2.0, t_start=10.0, width=100.0, outputs="load")
t = np.linspace(0, 20, 2001)


def response(law):
    parts = {"step": nlctl.Step(), "load": load, "law": law, "add": add, "plant": plant}
    loop = nlctl.interconnect(parts, outputs=["y", "u"])
    return nlctl.input_output_response(loop, t).outputs


figure, axes = plt.subplots(2, 2, sharex=True, figsize=(7, 4.5), layout="constrained")
tuned = {"K": 8.0, "T_i": 1.2, "T_d": 0.25, "N": 10.0}
weights, wide = {}, {"u_min": -100, "u_max": 100}
for b, c in ((1.0, 1.0), (0.3, 0.0)):
    weights[b], u = response(nlctl.controllers.standard_pid(**tuned, b=b, c=c, **wide))
    axes[0, 0].plot(t, weights[b], label=f"b = {b:g}, c = {c:g}")
    axes[1, 0].plot(t, u)
limited, narrow = {}, {"u_min": -1.5, "u_max": 3.2}
for kind in ("none", "clamping", "back-calculation"):
    limited[kind], u = response(nlctl.controllers.standard_pid(**tuned, anti_windup=kind, **narrow))
    axes[0, 1].plot(t, limited[kind], label=kind)
    axes[1, 1].plot(t, u)
axes[0, 0].set(ylabel="y", title="no limit")
axes[0, 1].set(title="u at most 3.2")
axes[1, 0].set(xlabel="t (s)", ylabel="u", ylim=(-0.5, 5))
axes[1, 1].set(xlabel="t (s)", ylim=(-0.5, 5))
axes[0, 0].legend(fontsize="small")
axes[0, 1].legend(fontsize="small")

# The response to the load is that of the transfer function, for either weights:
s = ct.tf("s")
C = 8.0 * (1 + 1 / (1.2 * s) + 0.25 * s / (1 + 0.025 * s))
P = 1 / (s**2 + 2 * s + 1)
late = t >= 10
exact = -2.0 * ct.step_response(ct.minreal(P / (1 + P * C), verbose=False), t[late] - 10).outputs
for y in weights.values():
    assert np.abs(y[late] - 1 - exact).max() < 2e-3  # what is left of the step at 10 s
overshoot = {b: float(y[~late].max()) - 1 for b, y in weights.items()}
windup = {kind: float(y[~late].max()) - 1 for kind, y in limited.items()}
print(overshoot, windup)
assert overshoot[0.3] < 0.3 * overshoot[1.0]
assert max(windup["clamping"], windup["back-calculation"]) < 0.5 * windup["none"]
