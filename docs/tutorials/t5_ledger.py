r"""
5. Reading the proof's ledger
=============================

``ledger`` goes through the paper's proof line by line, along a run, and says whether each holds.
The same from a terminal: ``nlctl check example-1``.
"""

import numpy as np
from scipy.special import lambertw

import nlctl
from nlctl.analysis import lyapunov

ledger = lyapunov.ledger(nlctl.paper.example_1(), 20.0)
for line in ledger.lines:
    print(f"{line.key:12} {line.status:15} {line.reading}")

# %%
# *Proved* holds on a whole box, by interval arithmetic; *checked* held at the samples of this run and says
# nothing of others; *violated* names the place. :doc:`/explanation/words` has all of them.
#
# A line read as *paper* is taken as it is printed. Some of those are violated, and the corrected ones are not:
broken = {(line.key, line.reading) for line in ledger.lines if line.status == "violated"}
print(broken)

# %%
# (29) is proved with the constant 0.2785, just above the root of :math:`\kappa = e^{-(\kappa + 1)}`, Lambert's W of 1/e:
print(lyapunov.kappa(), lambertw(np.exp(-1)).real)
assert lyapunov.kappa().holds
assert 0 <= 0.2785 - lambertw(np.exp(-1)).real < 1e-4
