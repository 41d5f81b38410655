"""
Replace the actuator
====================

Give the examples another one, or put it into the diagram's dictionary. Several in a row are a ``cascade``.
"""

import numpy as np

import nlctl

t = np.linspace(0, 20, 2001)
series = nlctl.actuators.cascade(
    {"limit": nlctl.Saturation(limit=15.0), "dead_zone": nlctl.DeadZone()}
)
for actuator in (nlctl.Backlash(), series):
    loop = nlctl.paper.example_1(actuator=actuator)
    response = nlctl.input_output_response(loop, t)
    late = np.abs(response.outputs["e"][t > 10]).max()
    print(f"{late:.4f}")
    assert late < 0.15

# %%
# Parameters of a stage have its name in the middle:
assert "actuator.dead_zone.b_r" in nlctl.parameters(loop).index
