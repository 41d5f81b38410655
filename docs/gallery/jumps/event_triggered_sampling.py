r"""
Sampling when it is needed
==========================

An unstable plant :math:`\dot x = x + u` under :math:`u = -2 w`, where :math:`w` is the last sample of :math:`x`. A new
sample is taken where :math:`|w - x|` exceeds :math:`0.3 |x|` (Tabuada 2007, event-triggered sampling): the rule is a block
of the diagram, and ``nlctl.TriggeredHold`` samples where its output falls through 0. From a sample :math:`x_k` on,
:math:`x = x_k (2 - e^s)`, so that all samples are :math:`\ln (2 - 1/1.3)` apart.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def law(t, x, u, params):
    """Return the control input, and what falls through 0 where the error is too large."""
    state, held = u
    return -2 * held, 0.3 * abs(state) - abs(held - state)


plant = ct.ss(1, 1, 1, 0, inputs="u", outputs="u1", name="plant")  # its output is what is sampled
rule = ct.nlsys(None, law, inputs=["u1", "w1"], outputs=["u", "trigger"], name="rule")
blocks = {"plant": plant, "rule": rule, "hold": nlctl.TriggeredHold(n=1)}
loop = nlctl.interconnect(blocks, outputs=["u1", "w1", "interval"])

t = np.linspace(0, 2, 801)
run = nlctl.input_output_response(loop, t, 0, {"plant.x[0]": 1.0})
x, w, interval = run.outputs
events = run.events[run.events["block"] == "hold"]
samples = events["time"].to_numpy()

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(t, x, label="x")
axes.step(t[1:], w[1:], where="post", lw=1, label="w, the last sample of x")
axes.plot(samples, np.interp(samples, t, x), "k.", label="samples")
axes.set(xlabel="t (s)", ylabel="state (1)", xlim=(0, 2), ylim=(0, 1.02))
axes.legend()

exact = np.log(2 - 1 / 1.3)
apart = np.diff(samples)
print(f"{samples.size} samples, {exact:.6f} s apart, to {abs(apart - exact).max():.0e} s")
print(f"as a signal of the diagram: {interval[-1]:.6f} s")
assert samples.size > 5
assert abs(apart - exact).max() < 1e-6
assert abs(interval[-1] - exact) < 1e-6
