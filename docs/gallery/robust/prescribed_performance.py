r"""
Prescribed performance without a network
========================================

Bechlioulis and Rovithakis (Automatica 50, 2014) control the paper's own class of plants with the states and the
sign of the input gain alone: the error stays within
:math:`\rho(t) = (\rho_{0} - \rho_{\infty}) e^{-lt} + \rho_{\infty}`. Plant, reference, gains and bounds are those
of the second-order example in the programs of I. Dimanidis's diploma thesis (Thessaloniki, 2017); the law is that
of 2014, with no factor :math:`1/(1 - \xi^{2})`.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl


@nlctl.equation
def van_der_pol(x, v):
    x1, x2 = x
    return -2 * (x1**2 - 1) * x2 - x1 + 1 + (2 + np.sin(x1 * x2)) * v


controller = nlctl.controllers.PrescribedPerformance(
    k=(4.0, 5.0), rho_0=(5.0, 5.0), rho_inf=(0.01, 0.01), decay=(3.0, 3.0)
)
reference = nlctl.SumOfSines(amplitudes=(1.0, 0.3), frequencies=(2.0, 5.0), phases=(0.0, np.pi / 2))
plant = nlctl.PureFeedback(order=2, f=van_der_pol, initial={"x1": 1.0, "x2": 1.0})
loop = nlctl.interconnect(
    {"reference": reference, "plant": plant, "law": controller, "actuator": nlctl.Gain()},
    outputs=["e", "u", "rho"],
)
t = np.linspace(0, 15, 6001)
e, u, rho = nlctl.input_output_response(loop, t).outputs

figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 4))
above.plot(t, e)
above.plot(t, np.array([rho, -rho]).T, "k--", linewidth=0.8)
above.set_ylabel("e")
above.set_yscale("symlog", linthresh=0.01)
below.plot(t, u)
below.set(xlabel="t (s)", ylabel="u")

# %%
# The promise, at each sample; and what it promises at last, 0.01.
print(f"largest |e| / rho: {np.max(np.abs(e) / rho):.3f}, late |e|: {np.abs(e[t > 5]).max():.5f}")
assert np.all(np.abs(e) < rho)
assert np.abs(e[t > 5]).max() < 0.01
