r"""
The pieces of the paper's controller
====================================

Gaussian basis functions (10) are 1 at their centre. The filtered error (14) is a polynomial in :math:`d/dt`. The
Nussbaum gain (24), :math:`N = e^{\zeta^{2}} \cos(\pi\zeta/2)`, changes its sign at odd numbers. The three laws that leave the
paper's path differ from it where :math:`\zeta` grows.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers

basis = nlctl.block(
    controllers.GaussianBasis(centres=((-1.0,), (0.0,), (1.0,)), widths=(0.5,)), "basis"
)
x = np.linspace(-2, 2, 401)
psi = np.array([basis.output(0, [], [value]) for value in x])
zeta = np.linspace(0, 3.05, 400)


def gain(record):
    """What the law makes of r = 1 where its argument is zeta."""
    law = nlctl.block(record, "law")
    u = np.array([1.0 if name == "r" else 0.0 for name in law.input_labels])
    return np.array([law.output(0, [z], u)[law.output_index["u"]] for z in zeta])


figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
left.plot(x, psi)
left.set(xlabel="x", title="GaussianBasis")
for law in (controllers.NussbaumLaw(beta=1.0), controllers.MonotoneNussbaumLaw(beta=1.0)):
    right.plot(zeta, gain(law), label=type(law).__name__)
right.set(xlabel="zeta", ylim=(-60, 20), title="u for r = 1")
right.legend()

assert np.allclose(psi[[100, 200, 300]].max(axis=1), 1)
N = gain(controllers.NussbaumLaw(beta=1.0))
assert np.allclose(N, np.exp(zeta**2) * np.cos(np.pi * zeta / 2))
changes = zeta[1:][np.diff(np.sign(N)) != 0]
assert np.allclose(changes, [1, 3], atol=0.01)
