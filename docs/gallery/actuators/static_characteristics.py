r"""
Characteristics without memory
==============================

Every actuator of the catalogue that has no state. A saturation and a quantiser are plain; one-sided dead zones
add up to any piecewise linear curve; a dead zone behind its inverse is the identity.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

u = np.linspace(-3, 3, 1201)


def characteristic(record):
    """The output at each input."""
    block = nlctl.block(record, "actuator")
    return np.array([block.output(0, [], [value])[0] for value in u])


zone = {"slope_r": 1.0, "slope_l": 0.8, "b_r": 0.5, "b_l": -0.3}
dead_zone = nlctl.block(nlctl.DeadZone(ripple_r=0, ripple_l=0, **zone), "dead_zone")
shown = {
    "Gain": nlctl.Gain(k=0.7),
    "Saturation": nlctl.Saturation(limit=1.5),
    "AsymmetricSaturation": nlctl.actuators.AsymmetricSaturation(limit_r=2.0, limit_l=-1.0),
    "Quantiser": nlctl.Quantiser(q=0.5),
    "OneSidedDeadZones": nlctl.actuators.OneSidedDeadZones(),
    "DeadZoneInverse": nlctl.actuators.DeadZoneInverse(**zone),
}
v = {name: characteristic(record) for name, record in shown.items()}
figure, axes = plt.subplots(2, 3, sharex=True, figsize=(8, 4.5), layout="constrained")
for ax, (name, curve) in zip(axes.flat, v.items(), strict=True):
    ax.plot(u, curve)
    ax.set_title(name, fontsize="medium")

# %%
# Each against its formula:
assert np.array_equal(v["Saturation"], np.clip(u, -1.5, 1.5))
assert np.allclose(v["AsymmetricSaturation"], np.clip(np.where(u > 0, u, 1.2 * u), -1, 2))
assert np.abs(v["Quantiser"] - u).max() <= 0.25 + 1e-12
through = np.array([dead_zone.output(0, [], [value])[0] for value in v["DeadZoneInverse"]])
assert np.allclose(through, u, atol=1e-12)
slopes = np.diff(v["OneSidedDeadZones"]) / np.diff(u)
assert np.allclose(slopes[[0, 600, -1]], [1 - 0.3, 1, 1 + 0.4])
