r"""
Rohrs' counterexample, and L1 adaptive control
==============================================

Adaptive control made for :math:`\frac{2}{s + 1}` meets :math:`\frac{2}{s + 1} \cdot \frac{229}{s^{2} + 30 s + 229}` and the
command :math:`0.3 + 1.85 \sin 16.1 t` (Rohrs, Valavani, Athans, Stein, IEEE Transactions on Automatic Control 30, 1985;
model :math:`\frac{3}{s + 3}`, starts 1.14 and -0.65). At :math:`\sqrt{259} = 16.09` rad/s the phase is -180 degrees, and a
feedback gain above :math:`7800 / 458 = 17.03` is unstable (Routh). MRAC drifts there; projection below it holds. L1
adaptive control (Hovakimyan and Cao, 2010) has 1000 times the gain of adaptation, and a filter that passes 0.30 of 16.1 rad/s.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers

plant = ct.tf([2 * 229], np.polymul([1, 1], [1, 30, 229]), inputs="v", outputs="x1", name="plant")
sines = {"amplitudes": (0.3, 1.85), "frequencies": (0.0, 16.1), "phases": (np.pi / 2, 0.0)}
command = nlctl.SumOfSines(order=0, **sines)
model, law = controllers.ReferenceModel(a=(3.0,), b=3.0), controllers.DirectLaw()
error, basis = controllers.ModelError(K=(3.0,), Q=(6.0,)), controllers.AffineRegressor(order=1)
plain = controllers.AdaptiveWeights(nodes=2, Gamma=1.0, sigma_1=0.0)
ball = controllers.ProjectedWeights(nodes=2, Gamma=1.0, W_max=8.0)
predictor = controllers.StatePredictor(a=(3.0,), gain=3.0)
filtered = controllers.FilteredLaw(omega=5.0, b=3.0, gain=3.0)
fast = controllers.ProjectedWeights(nodes=2, Gamma=1000.0, W_max=10.0)
compared = {
    "MRAC": nlctl.mrac(model, error=error, weights=plain, law=law),
    "MRAC, projection": nlctl.mrac(model, error=error, weights=ball, law=law),
    "L1": nlctl.l1_adaptive(predictor, basis=basis, weights=fast, law=filtered),
}
largest, lost = {}, None
figure, axes = plt.subplots(3, sharex=True, figsize=(6, 5))
for (label, controller), axis in zip(compared.items(), axes, strict=True):
    blocks = {"command": command, "plant": plant, "controller": controller, "a": nlctl.Gain()}
    loop = nlctl.interconnect(blocks, outputs=["x1"])
    start = {"controller.weights.W_hat[0]": 0.65, "controller.weights.W_hat[1]": -1.14}
    start = nlctl.initial_state(loop, {} if label == "L1" else start)
    try:
        nlctl.input_output_response(loop, np.linspace(0, 60, 601), 0, start)
    except nlctl.errors.DivergedError as error_at:
        lost = error_at.time
    t = np.linspace(0, 21 if label == "MRAC" else 60, 4001)
    y = nlctl.input_output_response(loop, t, 0, start).outputs
    axis.plot(t, y[0] if y.ndim > 1 else y, linewidth=0.5)
    axis.set_ylabel(label)
    largest[label] = float(np.abs(y).max())
axes[-1].set_xlabel("t (s)")

# %%
# Phase crossover and critical gain in closed form; only plain MRAC is lost.
gain, _, crossover, _ = ct.margin(plant)
print(f"critical gain {gain:.2f} at {crossover:.2f} rad/s; MRAC lost at {lost:.1f} s; {largest}")
assert abs(gain - 7800 / 458) < 1e-6
assert abs(crossover - np.sqrt(259)) < 1e-6
assert 15 < lost < 30
assert largest["L1"] < 0.6 < largest["MRAC, projection"] < 2 < largest["MRAC"]
