r"""
Dead zone
=========

The actuator of the paper's Example 1 ignores inputs between :math:`b_l` and :math:`b_r`; outside, its slope
depends on the input.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

actuator = nlctl.block(nlctl.DeadZone(b_r=0.5, b_l=-0.3), "actuator")
u = np.linspace(-4, 4, 801)
v = np.array([actuator.output(0, [], [value])[0] for value in u])

figure, axes = plt.subplots(figsize=(4.5, 3))
axes.plot(u, v)
axes.set(xlabel="u", ylabel="v", title="Dead zone")

# %%
# It is the formula (2) of the example, and zero between the break points.
right = (1 + 0.3 * np.sin(u)) * (u - 0.5)
left = (0.8 + 0.2 * np.cos(u)) * (u + 0.3)
assert np.allclose(v, np.where(u >= 0.5, right, np.where(u <= -0.3, left, 0)), atol=1e-14)
