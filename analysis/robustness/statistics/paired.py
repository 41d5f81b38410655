"""Controllers against each other on the same rows: differences, wins, and violations."""

import itertools
from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np
import pandas as pd
from scipy import stats

from nlctl.annotations import as_annotated
from nlctl.arguments import of_type, one_of
from nlctl.errors import ParameterError
from nlctl.params import as_numbers
from nlctl.wording import counted

from ..stl.spec import violates
from ..uncertainty.design import Design
from .guarantee import Margins, check_iid, checked_confidence, series_of

Better = Literal["smaller", "larger"]
BCA_ROWS = 5000  # up to so many rows the bootstrap is corrected for bias and acceleration
TRUSTED_ROWS = 300
LARGEST_SHARE = 0.1


@as_annotated
def differences(
    design: Design,
    outcomes: Mapping[str, Margins],
    confidence: float = 0.95,
    better: Better = "smaller",
) -> pd.DataFrame:
    """Compare a number of every pair of controllers, row by row.

    A run without the number (NaN, it diverged) is worse than every run with one; two such runs are
    alike.

    Parameters
    ----------
    design : Design
        Independent draws.
    outcomes : mapping
        ``{controller: numbers}`` with one number for each row.
    confidence : float, optional
        Of each interval by itself.
    better : {"smaller", "larger"}, optional
        Which number is the better one.

    Returns
    -------
    pandas.DataFrame
        One row per pair (a, b), a - b throughout: the median difference with its exact interval
        median_low, median_high (`median_interval`); the mean difference with its bootstrap interval
        mean_low, mean_high (BCa up to 5,000 rows, then percentiles), NaN where a run diverged;
        mean_trusted, whether that is to be believed (`mean_is_trusted`); and the p-value of the
        sign test, exact, with p_holm adjusted for the number of pairs.

    Raises
    ------
    NoGuaranteeError
        If rows are no independent draws.
    ParameterError
        If there are less than two controllers, or numbers are missing.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, differences, independent
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> errors = {"PID": [3.0, 4.0, 5.0, 6.0], "paper": [1.0, 2.0, 3.0, 4.0]}
    >>> found = differences(independent(space, 4, entropy=1), errors)
    >>> print(found["median"].tolist(), found["p"].tolist())  # both signs alike: 2 / 2^4
    [2.0] [0.125]
    """
    check_iid(design)
    confidence = checked_confidence(confidence)
    of_type("a comparison", "outcomes", outcomes, Mapping, "{controller: numbers}")
    rows = []
    for a, b, delta in _pairs(design, outcomes, better):
        median_low, median_high = median_interval(delta, confidence)
        low, high = _mean_interval(delta, confidence, design.entropy)
        positive, negative = int(np.sum(delta > 0)), int(np.sum(delta < 0))
        rows.append(
            {
                "a": a,
                "b": b,
                "median": float(np.median(delta)),
                "median_low": median_low,
                "median_high": median_high,
                "mean": delta.mean() if np.all(np.isfinite(delta)) else np.nan,
                "mean_low": low,
                "mean_high": high,
                "mean_trusted": mean_is_trusted(delta),
                "p": _sign_test(positive, negative),
            }
        )
    table = pd.DataFrame(rows)
    return table.assign(p_holm=holm(table["p"].to_numpy())).set_index(["a", "b"])


@as_annotated
def wins(
    design: Design, outcomes: Mapping[str, Margins], better: Better = "smaller"
) -> pd.DataFrame:
    """Return in how many rows each controller is better than each other one.

    Rows and columns are controllers; the entry (a, b) counts the rows in which a beats b.  Ties
    count for neither, NaN loses against numbers.  Arguments and errors as in `differences`, but
    any design will do.

    Parameters
    ----------
    design : Design
        Whose rows all controllers have run.
    outcomes : mapping
        Numbers of shape (rows,) by controller.
    better : {"smaller", "larger"}, optional
        Which number is the better one.

    Returns
    -------
    pandas.DataFrame
        Counts, controllers in rows and columns.

    Raises
    ------
    ParameterError
        If there are less than two controllers, or numbers are missing.

    Examples
    --------
    A tie counts for neither, and a run that diverged loses:

    >>> from nlctl.analysis.robustness import Space, Uncertain, independent, wins
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> errors = {"PID": [3.0, 2.0, 5.0, float("nan")], "paper": [1.0, 2.0, 9.0, 4.0]}
    >>> count = wins(independent(space, 4, entropy=1), errors)
    >>> int(count.loc["paper", "PID"]), int(count.loc["PID", "paper"])
    (2, 1)
    """
    of_type("a comparison", "outcomes", outcomes, Mapping, "{controller: numbers}")
    names = list(outcomes)
    table = pd.DataFrame(0, index=pd.Index(names, name="winner"), columns=names)
    sign = 1 if better == "smaller" else -1
    for a, b, delta in _pairs(design, outcomes, better):
        table.loc[a, b] = int(np.sum(sign * delta < 0))
        table.loc[b, a] = int(np.sum(sign * delta > 0))
    return table


@as_annotated
def mcnemar(design: Design, margins: Mapping[str, Margins]) -> pd.DataFrame:
    """Test whether controllers violate the spec equally often, on the same rows.

    McNemar's test, exact: of the rows in which one of two controllers violates the spec, each
    violates half if they are alike.

    Parameters
    ----------
    design : Design
        Independent draws.
    margins : mapping
        ``{controller: margins}``; a run violates the spec unless its margin is > 0.

    Returns
    -------
    pandas.DataFrame
        One row per pair: only_a and only_b, the rows in which only that one violates, both,
        difference: rate of a less rate of b, p, and p_holm adjusted for the number of pairs.

    Raises
    ------
    NoGuaranteeError
        If rows are no independent draws.
    ParameterError
        If there are less than two controllers, or margins are missing.

    Examples
    --------
    Of five rows in which only one of them violates, all are the PID's: 2 / 2^5.

    >>> from nlctl.analysis.robustness import Space, Uncertain, independent, mcnemar
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> found = mcnemar(
    ...     independent(space, 5, entropy=1), {"PID": [-1.0] * 5, "paper": [1.0] * 5}
    ... )
    >>> print(found["p"].tolist())
    [0.0625]
    """
    check_iid(design)
    of_type("a comparison", "margins", margins, Mapping, "{controller: margins}")
    failed = {name: violates(_column(design, name, values)) for name, values in margins.items()}
    rows = []
    for a, b in itertools.combinations(_two_or_more(failed), 2):
        only_a = int(np.sum(failed[a] & ~failed[b]))
        only_b = int(np.sum(failed[b] & ~failed[a]))
        rows.append(
            {
                "a": a,
                "b": b,
                "only_a": only_a,
                "only_b": only_b,
                "both": int(np.sum(failed[a] & failed[b])),
                "difference": (only_a - only_b) / design.size,
                "p": _sign_test(only_a, only_b),
            }
        )
    table = pd.DataFrame(rows)
    return table.assign(p_holm=holm(table["p"].to_numpy())).set_index(["a", "b"])


def median_interval(values: np.ndarray, confidence: float = 0.95) -> tuple[float, float]:
    """Return an exact interval of the median from independent draws of any law."""
    # The l-th smallest and l-th largest value, with l the (1 - confidence) / 2 quantile of
    # Binomial(n, 1/2), so that P(fewer than l draws on one side) is less than that; infinite where
    # n is too small.
    ordered = np.sort(values)
    low = int(stats.binom.ppf((1 - checked_confidence(confidence)) / 2, ordered.size, 0.5))
    if low == 0:
        return -np.inf, np.inf
    return float(ordered[low - 1]), float(ordered[-low])


def mean_is_trusted(values: np.ndarray) -> bool:
    """Return whether the bootstrap interval of a mean has about the confidence that it claims."""
    # No interval of a mean does for every law (Bahadur and Savage 1956): what happens in one run of
    # a thousand may be the whole mean, and is in no hundred rows. It is trusted where there are
    # `TRUSTED_ROWS`, which hold what one run in a hundred does with a probability of 95 %; the
    # values are not skew, n >= 25 g^2 with the skewness g (Cochran 1977); and no single one of them
    # makes a tenth of their sum of squares. The interval of the median needs none of this.
    # Shapes: `values` (n,).
    if not np.all(np.isfinite(values)) or values.size < TRUSTED_ROWS:
        return False
    apart = values - values.mean()
    largest = np.max(np.abs(apart))
    if largest <= 1e-12 * np.max(np.abs(values)):  # equal to rounding
        return True
    squares = (apart / largest) ** 2
    skewness = np.mean((apart / largest) ** 3) / np.mean(squares) ** 1.5
    return bool(values.size >= 25 * skewness**2 and LARGEST_SHARE * squares.sum() >= 1)


def _mean_interval(values: np.ndarray, confidence: float, entropy: int) -> tuple[float, float]:
    if not np.all(np.isfinite(values)):
        return np.nan, np.nan
    if np.ptp(values) <= 1e-12 * np.max(np.abs(values)):  # equal to rounding: nothing to resample
        return float(np.min(values)), float(np.max(values))
    interval = stats.bootstrap(
        (values,), np.mean, vectorized=True, confidence_level=confidence, n_resamples=1999,
        method="BCa" if values.size <= BCA_ROWS else "percentile",
        batch=max(1, 10**6 // values.size), rng=np.random.default_rng(entropy),
    ).confidence_interval  # fmt: skip
    return float(interval.low), float(interval.high)


def _sign_test(one: int, other: int) -> float:
    """Exact two-sided p-value of equal chances; 1 without any difference."""
    return float(stats.binomtest(one, one + other).pvalue) if one + other else 1.0


def _pairs(design: Design, outcomes: Mapping[str, Margins], better: Better):
    """Yield (a, b, a - b) of every pair; what is NaN is infinitely bad."""
    one_of("a comparison", "better", better, get_args(Better))
    of_type("a comparison", "design", design, Design)
    worst = np.inf if better == "smaller" else -np.inf
    columns = {}
    for name, values in outcomes.items():
        numbers = _column(design, name, values)
        columns[name] = np.where(np.isnan(numbers), worst, numbers)
    for a, b in itertools.combinations(_two_or_more(columns), 2):
        same = columns[a] == columns[b]  # also where both are infinite
        with np.errstate(invalid="ignore"):
            yield a, b, np.where(same, 0.0, columns[a] - columns[b])


def _two_or_more(columns: Mapping[str, np.ndarray]) -> list[str]:
    if len(columns) < 2:
        raise ParameterError(f"a comparison needs two controllers or more, got {list(columns)}")
    return list(columns)


def _column(design: Design, name: str, values: Margins) -> np.ndarray:
    series = series_of(values, f"'{name}'").sort_index()
    if not np.array_equal(series.index, np.arange(design.size)):
        raise ParameterError(
            f"a comparison needs a number of '{name}' for each of {counted(design.size, 'row')}, "
            f"got {series.size}"
        )
    return series.to_numpy()


@as_annotated
def holm(p_values: np.ndarray) -> np.ndarray:
    """Return p-values adjusted for their number (Holm, Scand. J. Statist. 6, 1979).

        p~_(i) = max over j <= i of min(1, (m - j + 1) p_(j)),    p_(1) <= ... <= p_(m)

    Rejecting what is at most a makes any false rejection at all happen with probability at most a,
    whatever the dependence between the tests.  NaN stays NaN and is not counted.

    Parameters
    ----------
    p_values : ndarray of shape (m,)
        Between 0 and 1, or NaN.

    Returns
    -------
    ndarray of shape (m,)
        In the same order.

    Raises
    ------
    ParameterError
        If a value is not a number in [0, 1], or they are not in one row.

    Examples
    --------
    >>> holm(np.array([0.01, 0.04])).tolist()
    [0.02, 0.04]
    """
    p = as_numbers(p_values)
    if p is None or p.ndim != 1 or np.any((p < 0) | (p > 1)):
        raise ParameterError(
            f"Holm's adjustment needs p-values in [0, 1] in one row, got {p_values!r}"
        )
    adjusted = np.full(p.shape, np.nan)
    order = np.argsort(p)[: np.count_nonzero(~np.isnan(p))]  # NaN sorts last
    steps = np.minimum(1.0, np.arange(order.size, 0, -1) * p[order])
    adjusted[order] = np.maximum.accumulate(steps)
    return adjusted
