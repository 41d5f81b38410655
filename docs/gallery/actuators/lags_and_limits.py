r"""
Step responses of actuators with dynamics
=========================================

A first-order lag, :math:`1 - e^{-t/T}`; a second-order lag, whose overshoot is
:math:`e^{-\pi \zeta / \sqrt{1 - \zeta^{2}}}`; a rate limiter, which rises as a ramp.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

t = np.linspace(0, 1.5, 3001)
zeta, omega = 0.4, 20.0
shown = {
    "Lag": nlctl.Lag(T=0.1),
    "SecondOrderLag": nlctl.actuators.SecondOrderLag(omega=omega, zeta=zeta),
    "RateLimiter": nlctl.RateLimiter(rise=2.0, fall=-2.0),
}
v = {}
figure, axes = plt.subplots(figsize=(6, 3))
for name, record in shown.items():
    block = nlctl.block(record, "actuator")
    v[name] = nlctl.input_output_response(block, t, 1.0, rtol=1e-10, atol=1e-12).outputs.ravel()
    axes.plot(t, v[name], label=name)
axes.set(xlabel="t (s)", ylabel="v")
axes.legend()

assert np.abs(v["Lag"] - (1 - np.exp(-t / 0.1))).max() < 1e-8
overshoot = np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2))
assert abs(v["SecondOrderLag"].max() - 1 - overshoot) < 1e-4
ramp = t < 0.45
assert np.abs(v["RateLimiter"] - 2 * t)[ramp].max() < 1e-8
