r"""
Bounds that may be read at any time
===================================

A study that is checked after every run and stopped when the bound looks good is wrong more often than the confidence
says. A confidence sequence is not: over 300 studies of 200 runs it misses the true probability, at any time, in less
than 10 %, and the exact bound for a fixed number of runs misses it far more often.
"""

import matplotlib.pyplot as plt
import numpy as np

from nlctl.analysis.robustness import clopper_pearson, sequence_bounds

p, runs, studies, confidence = 0.2, 200, 300, 0.9
rng = np.random.default_rng(1)
counts = np.cumsum(rng.random((studies, runs)) < p, axis=1)
looks = np.arange(20, runs + 1, 20)
missed = {}
for name, bounds in (("fixed number", lambda k, n: clopper_pearson(k, n, confidence, "both")),
                     ("at any time", lambda k, n: sequence_bounds(k, n, confidence))):  # fmt: skip
    tables = {n: np.array([bounds(k, int(n)) for k in range(n + 1)]) for n in looks}
    outside = [(tables[n][counts[:, n - 1]] - p).prod(axis=1) > 0 for n in looks]
    missed[name] = np.logical_or.accumulate(outside).mean(axis=1)

figure, axes = plt.subplots(figsize=(6, 3))
for name, share in missed.items():
    axes.plot(looks, share, label=name)
axes.axhline(1 - confidence, color="black", linewidth=0.8)
axes.set(xlabel="runs seen", ylabel="studies that were wrong so far")
axes.legend()
print({name: float(share[-1]) for name, share in missed.items()})
assert missed["at any time"][-1] <= 1 - confidence
assert missed["fixed number"][-1] > 1.5 * (1 - confidence)
