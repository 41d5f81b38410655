r"""
Area of the play's loop
=======================

A backlash of half gap :math:`r` under a slow sine of amplitude :math:`A > r` runs round a parallelogram of the
area :math:`4 r (A - r)`, however the input is timed.
"""

# sphinx_gallery_thumbnail_number = 1
import matplotlib.pyplot as plt
import numpy as np

import nlctl

r, A = 0.5, 2.0
play = nlctl.block(nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=r, c_l=-r), "play")
t = np.linspace(0, 4 * np.pi, 8001)
u = A * np.sin(t)
v = nlctl.input_output_response(play, t, u).outputs

figure, axes = plt.subplots(figsize=(4, 4))
axes.plot(u, v)
axes.set(xlabel="u", ylabel="v", title="Play")

# %%
# The second period is closed; its area by the trapezoidal rule:
late = t >= 2 * np.pi
area = abs(np.trapezoid(v[late], u[late]))
print(f"{area:.5f}, closed form {4 * r * (A - r):.5f}")
assert abs(area - 4 * r * (A - r)) < 1e-4
