r"""
The same controller, another actuator
=====================================

Example 1 with the backlash of Example 2 instead of its dead zone: nothing else changes. The expected
number comes from an independent computation.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl.analysis.paper import expectations

t = np.linspace(0, 20, 20_001)
figure, axes = plt.subplots(figsize=(6, 3))
errors = {}
for actuator in (nlctl.DeadZone(), nlctl.Backlash()):
    loop = nlctl.paper.example_1(actuator=actuator)
    name = type(actuator).__name__
    errors[name] = nlctl.input_output_response(loop, t).outputs["e"]
    axes.plot(t, errors[name], label=name)
axes.set(xlabel="t (s)", ylabel="e")
axes.legend()

expected = next(
    x.value for x in expectations() if (x.case, x.metric) == ("1-backlash", "tail_max_e")
)
assert abs(np.abs(errors["Backlash"][t >= 10]).max() - expected) < 1e-4
