r"""
The plants by themselves
========================

Without forcing, damping and disturbance the oscillator of Example 1 conserves its energy
:math:`x_{2}^{2}/2 + p_{1} x_{1}^{2}/2 + x_{1}^{4}/4`. The Genesio system of Example 2 has a stable origin for
:math:`a b > c` only (Routh); with :math:`a = 1.2, b = 2.92, c = 6` it is chaotic (Genesio and Tesi 1992).
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

quiet = {"p_mean": 0.0, "p_ripple": 0.0, "q_mean": 0.0, "q_ripple": 0.0, "d_amplitude": 0.0}
oscillator = nlctl.block(nlctl.plants.ForcedDuffing(**quiet), "oscillator")
t = np.linspace(0, 100, 10_001)
tight = {"rtol": 1e-10, "atol": 1e-12}
x1, x2 = nlctl.input_output_response(oscillator, t, 0, [0.5, 0.0], **tight).states
energy = x2**2 / 2 - 0.2 * x1**2 / 2 + x1**4 / 4
assert np.abs(energy - energy[0]).max() < 1e-8

chaotic = nlctl.block(nlctl.plants.Genesio(a=1.2, b=2.92, d_amplitude=0.0), "genesio")
x = nlctl.input_output_response(chaotic, t, 0, [0.1, 0.1, 0.1], **tight).states
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3), layout="constrained")
left.plot(x1, x2, linewidth=0.8)
left.set_title("ForcedDuffing")
right.plot(x[0], x[1], linewidth=0.6)
right.set_title("Genesio")

# %%
# The origin's poles are the roots of :math:`s^{3} + a s^{2} + b s + c`:
for a, b, stable in ((1.2, 2.92, False), (2.4, 2.92, True)):
    genesio = nlctl.block(nlctl.plants.Genesio(a=a, b=b, d_amplitude=0.0), "genesio")
    poles = nlctl.compile(genesio).linearize(np.zeros(3)).poles()
    assert np.allclose(np.sort_complex(poles), np.sort_complex(np.roots([1, a, b, 6])))
    assert (poles.real.max() < 0) == stable == (a * b > 6)
assert np.abs(x).max() < 20  # bounded, and away from the origin
assert np.ptp(x[0, t > 50]) > 3
