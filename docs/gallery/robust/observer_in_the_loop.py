r"""
Observers in the loop
=====================

A pendulum is held upright by its angle alone. The high-gain observer is fast and peaks: the error of the speed has a
maximum of :math:`e^{-1} / \varepsilon` times that of the angle. ``LuenbergerObserver``, of the linearised pendulum, and
``ExtendedKalmanFilter`` begin more calmly.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


@nlctl.equation
def pendulum(x, u):
    return x[1], np.sin(x[0]) + u[0]


@nlctl.equation
def acceleration(x, u):
    return np.sin(x[0]) + u[0]


plant = ct.nlsys(
    lambda t, x, u, params: [x[1], np.sin(x[0]) + u[0]],
    lambda t, x, u, params: [x[0]],
    inputs="u", outputs="y", states=["angle", "speed"], name="plant",
)  # fmt: skip
linear = ct.ss([[0, 1], [1, 0]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y")
law = ct.ss([], [], [], [[-3, -2]], inputs=["x1_hat", "x2_hat"], outputs="asked", name="law")
limit = nlctl.block(nlctl.Saturation(limit=2.0), "limit", inputs="asked", outputs="u")
covariance = ((1.0, 0.0), (0.0, 10.0))
observers = {
    "Luenberger": nlctl.observers.luenberger(linear, poles=[-4, -5]),
    "high gain": nlctl.observers.HighGainObserver(epsilon=0.05, known="u", model=acceleration),
    "Kalman": nlctl.observers.ExtendedKalmanFilter(f=pendulum, Q=covariance, R=((0.01,),)),
}
t, speeds = np.linspace(0, 5, 2001), {}
figure, axes = plt.subplots(2, sharex=True, figsize=(6, 4.5), layout="constrained")
for name, observer in observers.items():
    parts = {"plant": plant, "observer": observer, "law": law, "limit": limit}
    loop = nlctl.interconnect(parts, outputs=["y", "x2_hat"])
    run = nlctl.input_output_response(loop, t, 0, {"plant.angle": 0.3}, rtol=1e-9, atol=1e-11)
    angle, estimate = run.outputs
    speeds[name] = np.array(run.states["plant.speed"]) - estimate
    axes[0].plot(t, angle, label=name)
    axes[1].plot(t, speeds[name])
    assert abs(angle[-1]) < 0.02
axes[0].set_ylabel("angle (rad)")
axes[1].set(xlabel="t (s)", ylabel="error of the speed\n(rad/s)")
axes[0].legend()

peak = -speeds["high gain"].min()
print(f"peak {peak:.4f}, e^-1 / epsilon 0.3 = {0.3 * np.exp(-1) / 0.05:.4f}")
assert abs(peak - 0.3 * np.exp(-1) / 0.05) < 0.02 * peak
assert np.abs(speeds["high gain"][t > 1]).max() < 1e-6
