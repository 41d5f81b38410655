r"""
Friction over velocity
======================

The static laws, and the steady state of the dynamic ones: Dahl's model ends at Coulomb's level, LuGre's at
Stribeck's curve :math:`F_{c} + (F_{s} - F_{c}) e^{-(v/v_{s})^{2}} + \sigma_{2} v` (Canudas de Wit et al. 1995).
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

velocities = np.geomspace(1e-4, 1e-2, 25)


def settled(record, velocity):
    """The force at constant velocity, after a way of 0.6 mm."""
    t = np.linspace(0, 6e-4 / velocity, 11)
    block = nlctl.block(record, "friction")
    return nlctl.input_output_response(block, t, velocity, rtol=1e-9, atol=1e-12).outputs.ravel()[
        -1
    ]


laws = [
    nlctl.actuators.Coulomb(),
    nlctl.actuators.Stribeck(),
    nlctl.actuators.Dahl(),
    nlctl.actuators.LuGre(),
]
force = {type(law).__name__: np.array([settled(law, v) for v in velocities]) for law in laws}
figure, axes = plt.subplots(figsize=(6, 3.2))
for (name, curve), style in zip(force.items(), ("-", "-", "--", "o"), strict=True):
    axes.semilogx(velocities, curve, style, label=name, markersize=4)
axes.set(xlabel="velocity (m/s)", ylabel="force (N)")
axes.legend()

exact = 1 + 0.5 * np.exp(-((velocities / 1e-3) ** 2)) + 0.4 * velocities
assert np.allclose(force["Stribeck"], exact)
assert np.allclose(force["LuGre"], exact, rtol=1e-6)
assert np.allclose(force["Dahl"], 1.0, rtol=1e-6)
assert np.allclose(force["Coulomb"], 1 + 0.4 * velocities)
