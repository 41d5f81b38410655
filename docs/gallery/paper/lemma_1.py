r"""
The lemma that fails
====================

Lemma 1 of the paper bounds :math:`\zeta` for all time where :math:`V` is bounded by an integral over :math:`\dot\zeta`.
With :math:`\dot\zeta = c/(2 + e^{\zeta^{2}})` its premise holds, and :math:`\zeta` grows without bound: separation of
variables gives :math:`2 \zeta + \int_{0}^{\zeta} e^{s^{2}} ds = c t`.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np
from scipy.special import dawsn

import nlctl


def update(t, x, u, params):
    return (params["c"] / (2 + np.exp(x[0] ** 2)),)


drift = ct.nlsys(update, None, states=1, inputs=0, params={"c": 1.0}, name="drift")
t = np.geomspace(1e-2, 1e6, 400)
response = nlctl.input_output_response(drift, t, 0, [0.0], rtol=1e-9, atol=1e-12)
zeta = response.states[0]

figure, axes = plt.subplots(figsize=(6, 3))
axes.semilogx(t, zeta)
axes.axhline(3, linestyle="--", color="black")
axes.set(xlabel="t (s)", ylabel="zeta", title="At 3 the gain changes its sign")

exact = 2 * zeta + np.exp(zeta**2) * dawsn(zeta)  # Dawson's integral
assert np.abs(exact - (t - t[0])).max() < 1e-5 * t[-1]
assert np.abs(exact[200:] / (t[200:] - t[0]) - 1).max() < 1e-6
assert zeta[-1] > 3.5
