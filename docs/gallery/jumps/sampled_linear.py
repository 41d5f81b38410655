r"""
A linear system, sampled
========================

With its input held between samples, a linear system is its zero-order-hold equivalent exactly
(``ct.sample_system``). A staircase through the continuous system meets the discrete one at every sample.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

continuous = ct.ss([[0, 1], [-2, -0.4]], [[0], [1]], [[1, 0]], 0, name="continuous")
period = 0.5
discrete = ct.sample_system(continuous, period, method="zoh")

k = np.arange(41)
held = np.sign(np.sin(0.7 * k))
x, samples = np.zeros(2), []
for value in held:  # one run for each interval in which the input is constant
    samples.append(x[0])
    part = nlctl.input_output_response(
        continuous, [0, period], value, x, rtol=1e-10, atol=1e-12, return_states=True
    )
    x = part.states[:, -1]
discretised = nlctl.input_output_response(discrete, period * k, held).outputs

figure, axes = plt.subplots(figsize=(5, 3))
axes.step(period * k, discretised, where="post", label="discrete")
axes.plot(period * k, samples, "o", markersize=4, label="continuous, at the samples")
axes.set(xlabel="t (s)", ylabel="y")
axes.legend()
assert np.abs(np.array(samples) - discretised).max() < 1e-8
