r"""
Example 2 of the paper
======================

The Genesio system behind a backlash (Lv et al. 2017). The controller knows neither the plant
nor the actuator nor the sign of the input gain.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl.analysis.paper import expectations

loop = nlctl.paper.example_2()
t = np.linspace(0, 20, 20_001)
response = nlctl.input_output_response(loop, t)
y, yd, e, u, zeta = (response.outputs[key] for key in ("y", "yd", "e", "u", "zeta"))

figure, (above, middle, below) = plt.subplots(3, sharex=True, figsize=(6, 5))
above.plot(t, yd, "--", label="reference")
above.plot(t, y, label="output")
above.legend()
middle.plot(t, u)
middle.set(ylabel="u")
below.plot(t, zeta)
below.set(ylabel="zeta", xlabel="t (s)")

# %%
# The largest late error agrees with an independent computation of the same equations.
expected = next(x.value for x in expectations() if (x.case, x.metric) == ("2", "tail_max_e"))
late = np.abs(e[t >= 10]).max()
print(f"late |e| at most {late:.5f}, expected {expected:.5f}")
assert abs(late - expected) < 2e-5
