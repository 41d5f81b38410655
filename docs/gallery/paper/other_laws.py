r"""
Other laws in the same loop
===========================

Example 1 with each law of the catalogue instead of the paper's, and with a sliding mode. Within the boundary
layer the sliding mode keeps :math:`|r| \leq \phi`, here 0.1 and unit gain 12, and the tracking error then stays below
:math:`\phi/\lambda_{1}` (Slotine and Li 1991, section 7.2).
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers

laws = {
    "NussbaumLaw": controllers.NussbaumLaw(),
    "DeadZoneNussbaumLaw": controllers.DeadZoneNussbaumLaw(),
    "LeakyNussbaumLaw": controllers.LeakyNussbaumLaw(),
    "MonotoneNussbaumLaw": controllers.MonotoneNussbaumLaw(),
    "KnownSignLaw": controllers.KnownSignLaw(),
    "FixedGainLaw": controllers.FixedGainLaw(),
}
compared = {name: nlctl.adaptive_neural(2, law=law) for name, law in laws.items()}
compared["SlidingModeLaw"] = nlctl.sliding_mode()
t = np.linspace(0, 20, 4001)
figure, axes = plt.subplots(figsize=(7, 4))
late = {}
for name, controller in compared.items():
    loop = nlctl.paper.example_1(controller=controller)
    e = nlctl.input_output_response(loop, t).outputs["e"]
    axes.plot(t, e, label=name, linewidth=1)
    late[name] = float(np.abs(e[t >= 10]).max())
axes.set(xlabel="t (s)", ylabel="e")
axes.legend(fontsize="small", ncols=2)
print({name: round(value, 4) for name, value in late.items()})
assert late["SlidingModeLaw"] <= 0.1 / 1.5
assert round(late["NussbaumLaw"], 4) == 0.1174  # of an independent computation
