r"""
2. Your own plant
=================

The plant class of the paper is :math:`x_{n}^{(1)} = f(x, v) + d(x, t)` behind a chain of integrators. Only
:math:`f` is yours; here a pendulum whose input gain depends on its angle.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl


@nlctl.equation
def pendulum(x, v):
    x1, x2 = x
    return -9.81 * np.sin(x1) - 0.1 * x2 + (2 + np.cos(x1)) * v


# %%
# A diagram is a dictionary of records; signals with the same name are connected.
loop = nlctl.interconnect(
    {
        "reference": nlctl.SumOfSines(order=2),
        "plant": nlctl.PureFeedback(order=2, f=pendulum, initial={"x1": 0.5}),
        "controller": nlctl.adaptive_neural(order=2),
        "actuator": nlctl.DeadZone(),
    }
)
t = np.linspace(0, 20, 2001)
response = nlctl.input_output_response(loop, t, X0=nlctl.initial_state(loop, {"plant.x1": 0.8}))
e = response.outputs["e"]
plt.figure(figsize=(6, 2.5))
plt.plot(t, e)
plt.xlabel("t (s)")
plt.ylabel("e")
assert np.abs(e[t > 10]).max() < 0.25

# %%
# What is run can be read: the plant's equation as LaTeX, from the function above.
equations = next(block for block in nlctl.typeset(loop) if block.block == "plant")
print(*equations.equations, sep="\n")
