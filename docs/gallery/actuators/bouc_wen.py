r"""
The Bouc-Wen model
==================

With :math:`\nu = 1` the force along a path in one direction is that of a first-order lag of the displacement,
:math:`z_{max} (1 - e^{-\beta (\gamma + \delta) x})` (Ikhouane and Rodellar, *Systems with Hysteresis*, 2007), and its
loop under a slow sine does not depend on how fast it is run through.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

record = nlctl.actuators.BoucWen(gamma=0.9, delta=0.3)
block = nlctl.block(record, "spring")
t = np.linspace(0, 3, 3001)
forces = []
figure, axes = plt.subplots(figsize=(4.5, 3.5))
for speed in (1.0, 10.0):  # the same path of 3 mm and back, ten times as fast
    path = 3e-3 * np.sin(np.pi * t)
    velocity = 3e-3 * np.pi * np.cos(np.pi * t) * speed
    forces.append(
        nlctl.input_output_response(block, t / speed, velocity, rtol=1e-9).outputs.ravel()
    )
axes.plot(path * 1e3, forces[0])
axes.set(xlabel="displacement (mm)", ylabel="force (N)")

rise = t <= 0.5
exact = record.z_max * (1 - np.exp(-record.beta * (record.gamma + record.delta) * path[rise]))
assert np.abs(forces[0][rise] - exact).max() < 1e-4 * record.z_max
assert np.abs(forces[1] - forces[0]).max() < 1e-4 * record.z_max
