r"""
The inverse of a hysteresis
===========================

A Prandtl-Ishlinskii operator has an inverse that is one as well (Krejci and Kuhnen 2001). In front of the operator
it makes the identity, whatever the input does.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

inverse, operator = nlctl.PrandtlIshlinskiiInverse(), nlctl.PrandtlIshlinskii()
series = nlctl.cascade({"inverse": inverse, "operator": operator})
t = np.linspace(0, 20, 4001)
u = np.sin(t) + 0.6 * np.sin(2.3 * t)
v = nlctl.input_output_response(series, t, u).outputs.ravel()
alone = nlctl.input_output_response(nlctl.block(operator, "operator"), t, u).outputs.ravel()

figure, axes = plt.subplots(figsize=(4.5, 3.5))
axes.plot(u, alone, label="operator alone")
axes.plot(u, v, label="behind its inverse")
axes.set(xlabel="u", ylabel="v")
axes.legend()
print(f"{np.abs(alone - u).max():.3f} off alone, {np.abs(v - u).max():.1e} behind the inverse")
assert np.abs(alone - u).max() > 0.1
assert np.abs(v - u).max() < 1e-6
