r"""
A Preisach operator forgets what larger inputs wipe out
=======================================================

Its memory is the sequence of dominating extrema of its input (Mayergoyz 1991): small loops in the past leave no
trace after a larger swing. Two inputs with different histories, then the same large swing, end alike.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

levels = np.linspace(-1, 1, 21)
alpha, beta = nlctl.actuators.relay_grid(levels)
operator = nlctl.actuators.Preisach(alpha=alpha, beta=beta, w=(1 / len(alpha),) * len(alpha))
block = nlctl.block(operator, "operator")
corners = {"calm": [0, 0.1, 0, 1.2, -0.45, 0.33], "busy": [0, 0.9, -0.6, 1.2, -0.45, 0.33]}
t = np.linspace(0, 5, 2001)
figure, axes = plt.subplots(figsize=(5, 3.5))
ends = {}
for name, values in corners.items():
    u = np.interp(t, np.arange(6), values)
    v = nlctl.input_output_response(block, t, u).outputs
    ends[name] = v[t >= 3]
    axes.plot(u, v, "--" if name == "busy" else "-", label=name)
axes.set(xlabel="u", ylabel="v")
axes.legend()

# %%
# After the peak of 1.2, which is above all thresholds, both are the same:
assert np.array_equal(ends["calm"], ends["busy"])
assert ends["calm"][0] == max(ends["calm"])
assert np.isclose(ends["calm"][0], 1.0)
