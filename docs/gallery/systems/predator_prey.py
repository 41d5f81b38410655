r"""
Lynxes and hares
================

The predator-prey model of Astrom and Murray (*Feedback Systems*, section 4.7) has its equilibrium at 20.6 hares and
29.5 lynxes; it is unstable, and all runs end on a limit cycle around it.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def update(t, x, u, params):
    H, L = x
    eaten = params["a"] * H * L / (params["c"] + H)
    return params["r"] * H * (1 - H / params["k"]) - eaten, params["b"] * eaten - params["d"] * L


values = {"r": 1.6, "d": 0.56, "b": 0.6, "k": 125.0, "a": 3.2, "c": 50.0}
model = ct.nlsys(update, None, states=["H", "L"], inputs=0, params=values, name="model")
rest = ct.find_operating_point(model, [20.0, 30.0], 0).states
print(rest)
assert np.round(rest, 1).tolist() == [20.6, 29.5]

exact = nlctl.compile(model).linearize(rest)
assert (exact.poles().real > 0).all()

# %%
# From inside and from outside:
t = np.linspace(0, 200, 8001)
figure, axes = plt.subplots(figsize=(4.5, 4))
peaks = []
for start in ([21.0, 30.0], [20.0, 100.0]):
    H, L = nlctl.input_output_response(model, t, 0, start, rtol=1e-9, atol=1e-9).states
    axes.plot(H, L, linewidth=0.8)
    peaks.append(H[t > 150].max())
axes.plot(*rest, "ko")
axes.set(xlabel="hares", ylabel="lynxes")
assert abs(peaks[0] - peaks[1]) < 0.01
