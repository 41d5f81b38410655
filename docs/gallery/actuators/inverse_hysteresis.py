r"""
The inverse of a hysteresis
===========================

A Prandtl-Ishlinskii operator has an inverse that is one as well (Krejci and Kuhnen 2001). In front of the operator
it makes the identity, whatever the input does. A backlash has an inverse that knows the rate of its input, and crosses
the gap in a jump where that reverses (Tao and Kokotovic 1996).
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

inverse, operator = nlctl.actuators.PrandtlIshlinskiiInverse(), nlctl.actuators.PrandtlIshlinskii()
series = nlctl.actuators.cascade({"inverse": inverse, "operator": operator})
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

# %%
# The backlash follows once its gap has been crossed; its inverse jumps by the whole gap.
wave = nlctl.SumOfSines(order=1, amplitudes=(1.0, 0.6), frequencies=(1.0, 2.3))
parts = {"wave": wave, "inverse": nlctl.actuators.BacklashInverse(), "gap": nlctl.Backlash()}
loop = ct.interconnect(
    [nlctl.block(record, name) for name, record in parts.items()],
    connections=[["inverse.u", "wave.yd"], ["inverse.u1", "wave.yd1"], ["gap.u", "inverse.v"]],
    inplist=[],
    outlist=["wave.yd", "inverse.v", "gap.v"],
    outputs=["u", "v", "y"],
)
reference, command, y = nlctl.input_output_response(loop, t).outputs
late = t > 3.0
print(f"{np.abs(y - reference)[late].max():.1e} off, jumps of {np.abs(np.diff(command)).max():.2f}")
assert np.abs(y - reference)[late].max() < 1e-6
assert np.abs(np.diff(command)).max() > 1.0
