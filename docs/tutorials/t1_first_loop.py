r"""
1. A first loop in ten minutes
==============================

The paper's first example: a forced oscillator behind a dead zone, driven by a controller that knows neither.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

loop = nlctl.paper.example_1()
assert isinstance(loop, ct.InterconnectedSystem)

# %%
# It is an ordinary diagram of python-control. Its parameters have units and bounds:
print(nlctl.parameters(loop).head(8).drop(columns="meaning"))

# %%
# Simulate it, with another dead zone. Parameters are addressed like signals.
t = np.linspace(0, 20, 2001)
response = nlctl.input_output_response(loop, t, params={"actuator.b_r": 0.6})
print(response)

# %%
# Outputs are found by their names.
y, yd, u = (response.outputs[name] for name in ("y", "yd", "u"))
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 4))
above.plot(t, yd, "--", label="reference")
above.plot(t, y, label="output")
above.legend()
below.plot(t, u)
below.set(xlabel="t (s)", ylabel="u")
assert np.abs(y - yd)[t > 10].max() < 0.15

# %%
# A wrong name or value is refused in one sentence:
try:
    nlctl.input_output_response(loop, t, params={"actuator.b_right": 0.6})
except nlctl.errors.UnknownNameError as error:
    print(error)
