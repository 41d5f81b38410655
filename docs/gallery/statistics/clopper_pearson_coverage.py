r"""
Coverage of an exact bound
==========================

The upper bound of Clopper and Pearson (Biometrika 1934) holds with at least its confidence for every probability
:math:`p`; the usual :math:`\hat p + z \sqrt{\hat p (1 - \hat p)/n}` does not. Both coverages are sums of the binomial law.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy import stats

from nlctl.analysis.robustness import clopper_pearson

n, confidence = 100, 0.95
counts = np.arange(n + 1)
exact = np.array([clopper_pearson(int(k), n, confidence)[1] for k in counts])
usual = counts / n + stats.norm.ppf(confidence) * np.sqrt(counts / n * (1 - counts / n) / n)
p = np.linspace(0.001, 0.3, 600)
law = stats.binom.pmf(counts[:, None], n, p)
covered = {
    name: (law * (bound[:, None] >= p)).sum(axis=0)
    for name, bound in (("exact", exact), ("usual", usual))
}

figure, axes = plt.subplots(figsize=(6, 3))
for name, values in covered.items():
    axes.plot(p, values, label=name)
axes.axhline(confidence, color="black", linewidth=0.8)
axes.set(xlabel="p", ylabel="coverage", ylim=(0.6, 1.01))
axes.legend()
assert covered["exact"].min() >= confidence - 1e-12
assert covered["usual"].min() < 0.65
