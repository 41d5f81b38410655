r"""
Wing rock: concurrent learning
==============================

A delta wing at a high angle of attack rolls by itself: :math:`\ddot{\theta} = W^{T} \psi(\theta, \dot{\theta}) + 3
\delta`. Model reference adaptive control damps it with weights that are not :math:`W`; concurrent learning (Chowdhary and
Johnson, IEEE CDC 2010) adds the errors at recorded points, and finds the published weights although nothing is
excited any more. A network of Gaussian functions tracks as well and has no such weights. Start (1.2, 1),
:math:`\Gamma = 5`, gains 1.5 and 1.3, 60 s.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers

W = np.array([0.8, 0.2314, 0.6918, -0.6245, 0.0095, 0.0214])
common = {
    "command": nlctl.SumOfSines(order=0, amplitudes=0.0, frequencies=1.0, phases=0.0),
    "plant": nlctl.plants.WingRock(),
    "actuator": nlctl.Gain(),
    "model": controllers.ReferenceModel(a=(4.0, 2.0), b=4.0),
    "error": controllers.ModelError(K=(1.5, 1.3), Q=(1.0, 1.0)),
    "basis": controllers.WingRockRegressor(),
    "law": controllers.ModelReferenceLaw(gain=3.0),
}
grid = controllers.GaussianBasis(centres=controllers.grid_centres([5, 5], -2, 2), widths=(1.0,))
stack = nlctl.sampled(controllers.HistoryStack(gain=3.0), 0.05)
compared = {
    "MRAC": {"weights": controllers.AdaptiveWeights(nodes=6, Gamma=5.0, sigma_1=0.0)},
    "RBF-MRAC": {
        "basis": grid, "weights": controllers.AdaptiveWeights(nodes=25, Gamma=5.0, sigma_1=0.0)
    },
    "concurrent": {"weights": controllers.ConcurrentWeights(nodes=6, Gamma=5.0), "stack": stack},
}  # fmt: skip
t, weights, late = np.linspace(0, 60, 1201), {}, {}
figure, axes = plt.subplots(1, 2, sharey=True, figsize=(7, 3))
for label, controller in compared.items():
    loop = nlctl.interconnect({**common, **controller}, outputs=["e", "W_norm"])
    response = nlctl.input_output_response(loop, t)
    states = dict(zip(nlctl.state_names(loop), response.states, strict=True))
    weights[label] = np.array([states[f"weights.W_hat[{i}]"] for i in range(6)])
    late[label] = float(np.abs(response.outputs[0][t > 50]).max())
for axis, label in zip(axes, ("MRAC", "concurrent"), strict=True):
    axis.plot(t, weights[label].T)
    axis.hlines(W, 0, 60, "k", "dotted", linewidth=0.8)
    axis.set(title=label, xlabel="t (s)")

# %%
# All three track; only concurrent learning has the weights (dotted) to three decimals.
print(
    {label: f"{error:.1e}" for label, error in late.items()}, weights["concurrent"][:, -1].round(4)
)
assert max(late.values()) < 1e-6
assert np.abs(weights["concurrent"][:, -1] - W).max() < 1e-3
assert np.abs(weights["MRAC"][:, -1] - W).max() > 0.5
