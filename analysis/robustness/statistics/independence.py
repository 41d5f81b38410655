"""Whether options and failing have to do with each other: exact where counts are small."""

from __future__ import annotations

import numpy as np
from scipy import special, stats

MOST_TABLES = 200_000  # up to so many tables are enumerated; of more, so many are drawn
PERMUTATIONS = 99_999
LARGE = 20.0  # from this expected number on in every field the chi-square law is as good as exact
_ROUNDING = 1e-9


def independence_test(counts: np.ndarray, entropy: int) -> tuple[float, float]:
    """Test whether failing is independent of an option, given how many rows have and do each."""
    # The statistic is chi-square's; its p-value is exact, the probability of a table at least as
    # far from independence among all with the same sums (the test of Fisher, Freeman and Halton).
    # Where these are too many they are drawn (a permutation test, whose p is (1 + b) / (1 + draws)
    # and never too small), and where every field expects `LARGE` the law of chi-square is taken.
    # Shapes: `counts` (options, 2).
    rows, failing = counts.sum(axis=1), int(counts[:, 0].sum())
    if len(rows) == 1:
        return 0.0, 1.0
    chi_square = float(_chi_square(counts[None, :, 0], rows, failing)[0])
    strength = float(np.sqrt(chi_square / rows.sum()))
    at_least = chi_square * (1 - _ROUNDING) - _ROUNDING
    if _count(rows, failing) <= MOST_TABLES:
        tables, probabilities = _every_table(rows, failing)
        far = _chi_square(tables, rows, failing) >= at_least
        return strength, min(1.0, float(probabilities[far].sum()))
    if rows.min() * min(failing, rows.sum() - failing) / rows.sum() >= LARGE:
        return strength, float(stats.chi2.sf(chi_square, len(rows) - 1))
    rng = np.random.default_rng(entropy)
    drawn = rng.multivariate_hypergeometric(rows, failing, size=PERMUTATIONS, method="marginals")
    beyond = int(np.sum(_chi_square(drawn, rows, failing) >= at_least))
    return strength, (1 + beyond) / (1 + PERMUTATIONS)


def _chi_square(failing: np.ndarray, rows: np.ndarray, total: int) -> np.ndarray:
    """Return chi-square of tables of failing rows, shape (tables, options)."""
    share = total / rows.sum()
    distance = (failing - rows * share) ** 2 / rows
    return distance.sum(axis=1) / (share * (1 - share))


def _count(rows: np.ndarray, failing: int) -> float:
    """Return how many tables have these sums."""
    ways = np.ones(1)
    for size in rows:
        ways = np.convolve(ways, np.ones(min(int(size), failing) + 1))[: failing + 1]
        if ways.max() > 1e15:
            return np.inf
    return float(ways[failing])


def _every_table(rows: np.ndarray, failing: int) -> tuple[np.ndarray, np.ndarray]:
    """Return all tables with these sums, and their probabilities."""
    tables = np.zeros((1, 0), dtype=int)
    left = np.array([failing])
    after = rows.sum() - np.cumsum(rows)  # rows of the options that follow
    for size, later in zip(rows, after, strict=True):
        step = np.arange(size + 1)
        fits = (step[None, :] <= left[:, None]) & (left[:, None] - step[None, :] <= later)
        which, here = np.nonzero(fits)
        tables = np.column_stack([tables[which], step[here]])
        left = left[which] - step[here]
    ways = special.gammaln(rows + 1) - special.gammaln(tables + 1)
    ways = (ways - special.gammaln(rows - tables + 1)).sum(axis=1)
    return tables, np.exp(ways - special.logsumexp(ways))
