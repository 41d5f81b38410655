r"""
Super-twisting sliding mode
===========================

:math:`u = -k_{1} |r|^{1/2} \operatorname{sgn} r + w`, :math:`\dot{w} = -k_{2} \operatorname{sgn} r` (Levant, *International
Journal of Control* 58, 1993) brings :math:`\dot{r} = u` to rest in finite time with a continuous input. In the variable
:math:`z = |r|^{1/2} \operatorname{sgn} r` and the time :math:`dt = 2 |z| ds` it is linear, so that the time is a
geometric series: :math:`T = \frac{w_{0}}{k_{2}} \frac{1 + q}{1 - q}` from :math:`r = 0`, :math:`w = w_{0}`, with
:math:`q = e^{-\pi k_{1} / \sqrt{8 k_{2} - k_{1}^{2}}}`.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

k_1, k_2, w_0 = 1.0, 2.0, 1.0
q = np.exp(-np.pi * k_1 / np.sqrt(8 * k_2 - k_1**2))
T = w_0 / k_2 * (1 + q) / (1 - q)
t, reached = np.linspace(0, 1.4 * T, 4001), {}
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 4))
for phi in (1e-2, 1e-4, 1e-6):
    blocks = {
        "surface": ct.ss(0, 1, 1, 0, inputs="v", outputs="r", name="surface"),
        "law": nlctl.controllers.SuperTwistingLaw(k_1=k_1, k_2=k_2, phi=phi),
        "actuator": nlctl.Gain(),
    }
    loop = nlctl.interconnect(blocks, outputs=["r", "u"])
    start = nlctl.initial_state(loop, {"law.w": w_0})
    response = nlctl.input_output_response(loop, t, 0, start, rtol=1e-8, atol=1e-10)
    w = response.states[nlctl.state_names(loop).index("law.w")]
    reached[phi] = t[np.abs(w) > 0.01 * w_0].max()
    above.plot(t, response.outputs[0], label=f"layer {phi:g}")
    below.plot(t, w)
above.axvline(T, color="k", linestyle="--", linewidth=0.8)
above.set_ylabel("r")
above.legend()
below.set(xlabel="t (s)", ylabel="w")

# %%
# When a hundredth of w is left, a hundredth of the time is left.
print(f"closed form {T:.3f} s, reached: {reached}")
assert abs(reached[1e-6] - T) < 0.02 * T
