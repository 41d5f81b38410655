r"""
Noise of a quantiser
====================

The error of a fine uniform quantiser has the power :math:`q^{2}/12` (Bennett 1948), and by Widrow's theorem it is
uniform for signals that are smooth enough.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

q = 0.05
quantiser = nlctl.block(nlctl.Quantiser(q=q), "quantiser")
t = np.linspace(0, 200, 40_001)
u = np.sin(t) + 0.7 * np.sin(np.sqrt(2) * t + 1)
v = nlctl.input_output_response(quantiser, t, u).outputs.ravel()
error = v - u

figure, (above, below) = plt.subplots(1, 2, figsize=(7, 2.8), layout="constrained")
above.plot(t[:800], v[:800])
above.set(xlabel="t (s)", ylabel="v")
below.hist(error / q, bins=40, density=True)
below.set(xlabel="error / q", ylabel="density")
power = np.mean(error**2)
print(f"power {power:.3e}, q²/12 = {q**2 / 12:.3e}")
assert abs(power / (q**2 / 12) - 1) < 0.02
assert np.abs(error).max() <= q / 2 + 1e-12
