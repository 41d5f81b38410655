r"""
A bound for all time
====================

Example 1 with a law that knows the sign of the input gain: interval arithmetic proves a bound of the filtered error
for all time. A run stays below it, far below: a certificate is about every disturbance that its box admits.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl.analysis.lyapunov import certify

loop = nlctl.paper.example_1(
    controller=nlctl.adaptive_neural(
        2, law=nlctl.controllers.KnownSignLaw(), weights=nlctl.controllers.AdaptiveWeights(Gamma=10.0),
        robust=nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5),
    )
)  # fmt: skip
certificate = certify(loop)
t = np.linspace(0, 40, 8001)
r = nlctl.input_output_response(loop, t).outputs["r"]

figure, axes = plt.subplots(figsize=(6, 3))
axes.semilogy(t, np.abs(r) + 1e-6, label="|r| of a run")
axes.axhline(certificate.C_0, color="black", label="proved for all time")
axes.set(xlabel="t (s)", ylim=(1e-4, 1))
axes.legend()

# %%
# The bound is :math:`C_{0} = \sqrt{2 \max\{V(0), \alpha_{0}/\alpha_{1}\}}` of the paper's (36), with enclosed constants:
bound = np.sqrt(2 * max(certificate.V_0, certificate.alpha_0 / certificate.alpha_1))
print(f"C_0 = {certificate.C_0:.4f}, by the formula {bound:.4f}; the run has {np.abs(r).max():.4f}")
assert abs(certificate.C_0 - bound) < 1e-9
assert np.abs(r).max() < certificate.C_0
