r"""
Cruise control
==============

The car of Astrom and Murray (*Feedback Systems*, section 4.1; python-control's ``cruise-control.py``): in the fourth
gear it keeps 20 m/s with the throttle at 0.1687. python-control's own model runs in machine code unchanged.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def car(t, x, u, params):
    """Mass 1600 kg, gear ratio over wheel radius 12 1/m, rolling friction, drag, slope."""
    v, throttle, slope = x[0], np.clip(u[0], 0, 1), u[1]
    omega = 12 * v
    torque = 190 * (1 - 0.4 * (omega / 420 - 1) ** 2)
    drag = 0.5 * 1.3 * 0.32 * 2.4 * v * np.abs(v)
    resistance = 1600 * 9.8 * (np.sin(slope) + 0.01 * np.sign(v)) + drag
    return ((12 * torque * throttle - resistance) / 1600,)


plant = ct.nlsys(car, None, states=["v"], inputs=["u", "slope"], outputs=["v"], name="car")
throttle = ct.find_operating_point(plant, [20], [0.5, 0], y0=[20], iu=[1]).inputs[0]
print(f"throttle {throttle:.4f}")
assert abs(throttle - 0.1687) < 5e-5

# %%
# A PI controller brings it back on a slope of 4 degrees, where the throttle of before is far too small:
law = ct.ss([[0.0]], [[1.0]], [[0.1]], [[0.5]], inputs=["e"], outputs=["u"], name="law")
sum_ = ct.summing_junction(["vref", "-v"], "e", name="sum")
loop = ct.interconnect(
    [plant, law, sum_], inputs=["vref", "slope"], outputs=["v", "u"], name="cruise"
)
t = np.linspace(0, 60, 1201)
inputs = [np.full(t.size, 20.0), np.where(t < 5, 0, np.deg2rad(4))]
v, u = nlctl.input_output_response(nlctl.compile(loop), t, inputs, [20.0, throttle / 0.1]).outputs

figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 4))
above.plot(t, v)
above.set(ylabel="v (m/s)")
below.plot(t, u)
below.set(xlabel="t (s)", ylabel="throttle")
assert abs(v[-1] - 20) < 1e-2
needed = throttle + 1600 * 9.8 * np.sin(np.deg2rad(4)) / (
    12 * 190 * (1 - 0.4 * (240 / 420 - 1) ** 2)
)
assert abs(u[-1] - needed) < 1e-3
