"""Which quantities matter: screening, shares of the variance, and what sets failures apart."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import special, stats

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, of_type
from nlctl.errors import ParameterError
from nlctl.wording import counted

from ..stl.spec import FAILED
from ..uncertainty.design import Design, affordable, checked_entropy, listed, sobol_points
from ..uncertainty.space import Space, from_quantiles, from_unit_cube
from .guarantee import Margins, checked_confidence, series_of
from .paired import holm

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


_WHO = "shares of the variance"


@as_annotated
def censored(margins: Margins) -> tuple[np.ndarray, int, float]:
    """Return margins with one number for all failed runs, for effects and shares of a variance.

    The margin of a run that did not reach its end is graded for searches, a million times the
    others (`spec.unfinished_margin`): it would be the whole variance.  What such a run shows is
    that its margin is no better than those of the runs that did, so it counts as the least of
    these, and at most as -1, beyond the bound by the bound itself.  The others stay as they are.

    Parameters
    ----------
    margins : array_like of shape (rows,)
        Margins of all rows.

    Returns
    -------
    values : ndarray of shape (rows,)
        The margins, with `least` for the runs that failed.
    failed : int
        Number of rows that count as `least`.
    least : float
        The least margin of the runs that reached their end, at most -1.

    Raises
    ------
    ParameterError
        If no run reached its end.

    Examples
    --------
    A run that failed counts as the least of the others, and at most as -1:

    >>> from nlctl.analysis.robustness import censored, unfinished_margin
    >>> values, failed, least = censored([0.5, -0.2, unfinished_margin(1.0, 10.0)])
    >>> print(values, failed, least)
    [ 0.5 -0.2 -1. ] 1 -1.0
    """
    values = series_of(margins, "margins").to_numpy(copy=True)
    ended = values > -FAILED  # not of NaN
    if not ended.any():
        raise ParameterError(
            f"of {counted(values.size, 'row')} none reached its end, so that their margins say "
            "nothing apart"
        )
    least = min(float(values[ended].min()), -1.0)
    return np.where(ended, values, least), int(np.sum(~ended)), least


@as_annotated
def morris(space: Space, trajectories: int, levels: int = 4, entropy: int | None = None) -> Design:
    """Walk through the boxes, one quantity a step: for `elementary_effects`.

    Each trajectory starts at a random point of a grid with `levels` values per quantity and changes
    every quantity once, in random order, by levels / (2 (levels - 1)) of its box (Morris,
    Technometrics 33, 1991).  It takes (number of quantities + 1) rows.

    Parameters
    ----------
    space : Space
        Without choices.
    trajectories : int
        At least 2; 10 to 50 are usual.
    levels : int, optional
        An even number.
    entropy : int, optional
        Of the rows' seeds; drawn if left out.

    Returns
    -------
    Design
        The rows of all trajectories, one trajectory after the other.

    Raises
    ------
    ParameterError
        If the space has choices, or a number is out of range.

    Examples
    --------
    See `elementary_effects`.
    """
    if space.choices:
        raise ParameterError(
            f"screening walks along numbers, and {[c.name for c in space.choices]} are choices: "
            "screen each combination on its own, or use saltelli"
        )
    r = integer("screening", "trajectories", trajectories, at_least=2)
    affordable("screening", r * (len(space.names) + 1), len(space.names))
    if integer("screening", "levels", levels, at_least=2) % 2:
        raise ParameterError(f"screening needs an even number of levels, got {levels}")
    d, entropy = len(space.names), checked_entropy(entropy)
    rng = np.random.default_rng(entropy)
    step = levels / (2 * (levels - 1))
    low = rng.integers(0, levels // 2, (r, 1, d)) / (levels - 1)
    upwards = rng.random((r, 1, d)) < 0.5
    turn = rng.permuted(np.tile(np.arange(d), (r, 1)), axis=1)[:, None, :]
    changed = np.arange(d + 1)[None, :, None] > turn  # row k has made the first k changes
    unit = np.minimum(low + step * (changed == upwards), 1.0)  # rounding
    points = from_unit_cube(space, unit.reshape(-1, d))
    return listed(space, "Morris", points, entropy, {"trajectories": r})


@as_annotated
def elementary_effects(
    design: Design, values: Sequence[float] | np.ndarray, confidence: float = 0.95
) -> pd.DataFrame:
    """Return how much a step in each quantity changes a response: Morris screening.

    An effect is the change of the response over the change of the quantity, in units of its box.

    Parameters
    ----------
    design : Design
        From `morris`.
    values : sequence of length ``design.size``
        The response of every row; margins where runs failed: see `censored`.
    confidence : float, optional
        Of the bootstrap interval (percentiles, trajectories resampled) of mu_star.

    Returns
    -------
    pandas.DataFrame
        One row per quantity; mu: mean effect, mu_star: mean magnitude, its interval low and high,
        sigma: standard deviation.  mu_star near 0: does not matter; sigma far from 0: not linear,
        or not on its own.

    Raises
    ------
    ParameterError
        If the design is another, or a value is not finite.

    Examples
    --------
    Of a + 3 b the effects are 1 and 3, wherever they are taken:

    >>> from nlctl.analysis.robustness import Space, Uncertain, elementary_effects, morris, rows
    >>> box = (Uncertain(name="a", bounds=(0.0, 1.0)), Uncertain(name="b", bounds=(0.0, 1.0)))
    >>> design = morris(Space(quantities=box), 4, entropy=1)
    >>> table = rows(design, range(design.size))
    >>> found = elementary_effects(design, table["a"] + 3 * table["b"])
    >>> print(found["mu_star"].round(6).tolist(), (found["sigma"] < 1e-12).all())
    [1.0, 3.0] True
    """
    y = _checked(design, values, "Morris", "morris")
    space, r = design.space, design.details["trajectories"]
    width = np.array([high - low for low, high in (q.box for q in space.quantities)]) * space.scale
    x = design.table.to_numpy(dtype=float).reshape(r, -1, len(width)) / width
    steps, changes = np.diff(x, axis=1), np.diff(y.reshape(r, -1), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        effects = np.where(steps != 0, changes[:, :, None] / steps, 0.0).sum(axis=1)
    interval = stats.bootstrap(
        (np.abs(effects),), np.mean, axis=0, vectorized=True, method="percentile",
        confidence_level=checked_confidence(confidence), rng=np.random.default_rng(design.entropy),
    ).confidence_interval  # fmt: skip
    return pd.DataFrame(
        {
            "mu": effects.mean(axis=0),
            "mu_star": np.abs(effects).mean(axis=0),
            "low": interval.low,
            "high": interval.high,
            "sigma": effects.std(axis=0, ddof=1),
        },
        index=pd.Index(space.names, name="quantity"),
    )


@as_annotated
def saltelli(space: Space, size: int, entropy: int | None = None) -> Design:
    """Make the rows that `sobol_indices` needs: size (number of names + 2) of them.

    Two independent sets A and B of `size` rows each from one scrambled Sobol' sequence, and for
    every name A with that column of B (Saltelli et al., Comput. Phys. Commun. 181, 2010).

    Parameters
    ----------
    space : Space
        With at least two quantities or choices.
    size : int
        A power of 2.
    entropy : int, optional
        Of the rows' seeds; drawn if left out.

    Returns
    -------
    Design
        The rows of A and B, and of A with one column of B at a time.

    Raises
    ------
    ParameterError
        If `size` is not a power of 2, or there is one name only, whose share is 1.

    Examples
    --------
    See `sobol_indices`.
    """
    d, entropy = len(space.names), checked_entropy(entropy)
    if d < 2:
        raise ParameterError(f"shares of the variance need two quantities, got {space.names}")
    affordable(_WHO, integer(_WHO, "size", size, at_least=1) * (d + 2), d)
    both = sobol_points(2 * d, size, entropy)
    a, b = both[:, :d], both[:, d:]
    mixed = np.tile(a, (d, 1, 1))
    for i in range(d):
        mixed[i, :, i] = b[:, i]
    points = from_quantiles(space, np.concatenate([a, b, mixed.reshape(-1, d)]))
    return listed(space, "Saltelli", points, entropy, {"size": size})


@as_annotated
def sobol_indices(
    design: Design,
    values: Sequence[float] | np.ndarray,
    confidence: float = 0.95,
    resamples: int = 999,
) -> pd.DataFrame:
    """Return which share of a response's variance comes from each quantity.

    Parameters
    ----------
    design : Design
        From `saltelli`.
    values : sequence of length ``design.size``
        The response of every row; margins where runs failed: see `censored`.
    confidence : float, optional
        Of the bootstrap intervals (percentiles; rows of all sets resampled together).
    resamples : int, optional
        Number of bootstrap samples.

    Returns
    -------
    pandas.DataFrame
        One row per name; S1: share by itself, ST: share with all interactions, each with its
        interval S1_low, S1_high, ST_low, ST_high.  All 0 for a constant response.

    Raises
    ------
    ParameterError
        If the design is another, or a value is not finite.

    Examples
    --------
    Of a + 3 b, a and b uniform, b has nine tenths of the variance:

    >>> from nlctl.analysis.robustness import Space, Uncertain, rows, saltelli, sobol_indices
    >>> box = (Uncertain(name="a", bounds=(0.0, 1.0)), Uncertain(name="b", bounds=(0.0, 1.0)))
    >>> design = saltelli(Space(quantities=box), 256, entropy=1)
    >>> table = rows(design, range(design.size))
    >>> found = sobol_indices(design, table["a"] + 3 * table["b"], resamples=99)
    >>> print(found["ST"].round(2).tolist())
    [0.1, 0.9]
    """
    y = _checked(design, values, "Saltelli", "saltelli")
    resamples = integer(_WHO, "resamples", resamples, at_least=1)
    d, n = len(design.space.names), design.details["size"]
    f_a, f_b, f_ab = y[:n], y[n : 2 * n], y[2 * n :].reshape(d, 1, n)

    def indices(rows: np.ndarray) -> np.ndarray:
        parts = {"f_A": f_a[rows][None], "f_B": f_b[rows][None], "f_AB": f_ab[..., rows]}
        sobol = stats.sobol_indices(func=parts, n=n)
        return np.stack([sobol.first_order, sobol.total_order])

    s1, st = indices(np.arange(n))
    interval = stats.bootstrap(
        (np.arange(n),), indices, vectorized=False, n_resamples=resamples, method="percentile",
        confidence_level=checked_confidence(confidence), rng=np.random.default_rng(design.entropy),
    ).confidence_interval  # fmt: skip
    columns = {"S1": s1, "S1_low": interval.low[0], "S1_high": interval.high[0]}
    columns |= {"ST": st, "ST_low": interval.low[1], "ST_high": interval.high[1]}
    return pd.DataFrame(columns, index=pd.Index(design.space.names, name="quantity"))


def _checked(design: Design, values: Sequence[float] | np.ndarray, kind: str, maker: str) -> Any:
    if of_type("this analysis", "design", design, Design).kind != kind:
        raise ParameterError(
            f"this analysis needs a design from {maker}(space, ...), got one of kind "
            f"'{design.kind}'"
        )
    y = series_of(values, "the response").sort_index().to_numpy()
    bad = np.nonzero(~np.isfinite(y))[0]
    if y.size != design.size or bad.size:
        what = f"row {bad[0]} has {y[bad[0]]}" if bad.size else f"got {y.size}"
        raise ParameterError(
            f"this analysis needs a finite value for each of {counted(design.size, 'row')}, "
            f"{what}; margins are finite for runs that diverged as well"
        )
    return y


@as_annotated
def regional(design: Design, margins: Margins) -> pd.DataFrame:
    """Return how far values in failing runs differ from those in passing ones.

    For numbers the statistic is the largest distance between the two empirical distributions
    (Kolmogorov-Smirnov, exact), for choices Cramér's V of the table of options (an exact or a
    permutation test where counts are small, see `independence_test`); 0: alike, 1: apart.

    Parameters
    ----------
    design : Design
        Any; p-values are given for independent draws only.
    margins : sequence of length ``design.size``
        A run passes if its margin is > 0.

    Returns
    -------
    pandas.DataFrame
        One row per name: statistic, p, and p_holm, adjusted for the number of names.

    Raises
    ------
    ParameterError
        If a margin is missing, or all runs pass or all fail.

    Examples
    --------
    What decides about failing has the statistic 1:

    >>> from nlctl.analysis.robustness import Space, Uncertain, independent, regional, rows
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(-1.0, 1.0)),))
    >>> design = independent(space, 100, entropy=1)
    >>> print(regional(design, rows(design, range(100))["a"])["statistic"].tolist())
    [1.0]
    """
    of_type("regional sensitivity", "design", design, Design)
    passed = series_of(margins, "margins").sort_index().to_numpy() > 0
    if passed.size != design.size or passed.all() or not passed.any():
        raise ParameterError(
            f"regional sensitivity needs a margin for each of {counted(design.size, 'row')} with "
            f"passing and failing runs among them, got {counted(passed.size, 'row')} and "
            f"{passed.sum()} that pass"
        )
    table = design.table
    rows = []
    for name in design.space.names:
        column = table[name].to_numpy()
        if name in [choice.name for choice in design.space.choices]:
            counts = pd.crosstab(column, passed).to_numpy()
            rows.append(independence_test(counts, design.entropy))
        else:
            test: Any = stats.ks_2samp(column[passed].astype(float), column[~passed].astype(float))
            rows.append((float(test.statistic), float(test.pvalue)))
    statistic, p = np.array(rows).T
    p = p if design.is_iid else np.full(p.shape, np.nan)
    columns = {"statistic": statistic, "p": p, "p_holm": holm(p)}
    return pd.DataFrame(columns, index=pd.Index(design.space.names, name="quantity"))
