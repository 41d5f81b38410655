r"""
Adaptation as a first-order lag
===============================

With a constant error :math:`r` both laws of (25) are lags: the weights tend to :math:`r \psi / \sigma_{1}` with the rate
:math:`\Gamma \sigma_{1}`, the bound of the rest to :math:`r \tanh(r/\tau) / \sigma_{2}` with the rate :math:`\gamma \sigma_{2}`.
Without sigma-modification they would integrate for ever.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers

r, psi = 0.3, np.array([0.8, 0.2])
t = np.linspace(0, 10, 1001)
tight = {"rtol": 1e-10, "atol": 1e-12}
weights = nlctl.block(controllers.AdaptiveWeights(nodes=2, Gamma=2.0, sigma_1=0.5), "weights")
inputs = np.repeat([[r], [psi[0]], [psi[1]]], t.size, axis=1)
W = nlctl.input_output_response(weights, t, inputs, **tight).states
robust = nlctl.block(controllers.RobustTerm(gamma=1.0, sigma_2=0.5, tau=0.2), "robust")
delta = nlctl.input_output_response(robust, t, r, **tight).states[0]

figure, axes = plt.subplots(figsize=(6, 3))
axes.plot(t, W.T, label="W_hat")
axes.plot(t, delta, "--", label="delta_hat")
axes.set(xlabel="t (s)")
axes.legend()
assert np.abs(W - np.outer(r * psi / 0.5, 1 - np.exp(-t))).max() < 1e-8
assert np.abs(delta - r * np.tanh(r / 0.2) / 0.5 * (1 - np.exp(-0.5 * t))).max() < 1e-8

# %%
# The error itself is filtered: (14) with :math:`\lambda_{1} = 1.5` is :math:`r = 1.5 e + \dot{e}`. A piece that is left out
# is ``Zero``.
error = nlctl.block(controllers.FilteredError(lambdas=(1.5,)), "filtered_error")
values = {"x1": 0.5, "x2": 0.2, "yd": 0.1, "yd1": -0.3}
u = [values.get(name, 0.0) for name in error.input_labels]
assert np.isclose(error.output(0, [], u)[error.output_index["r"]], 1.5 * 0.4 + 0.5)
assert not any(nlctl.block(controllers.Zero(outputs=("W_psi", "W_norm")), "none").output(0, [], []))
