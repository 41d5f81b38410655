"""Violation probability against the size of the uncertainty: known probabilities."""

from functools import partial

import numpy as np
import pandas as pd
import pytest
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis.robustness.search.degradation import degradation_curve
from nlctl.analysis.robustness.statistics.guarantee import clopper_pearson
from nlctl.analysis.robustness.uncertainty.space import Choice, Space, SpaceError, Uncertain

D, BETA = 3, 1.2
NORMAL = Space(
    quantities=tuple(Uncertain(name=f"x{i}", law=stats.norm(), nominal=0.0) for i in range(D))
)


def linear(table, beta=BETA):
    """The linear limit state g = beta sqrt(d) - sum of x: P(g <= 0) = Phi(-beta)."""
    return pd.DataFrame({"spec": beta * np.sqrt(D) - table.sum(axis=1)}, index=table.index)


def test_the_rates_are_those_of_the_linear_limit_state():
    """Scaled by f the probability is Phi(-beta / f); 4 standard deviations off at most."""
    factors = (0.5, 1.0, 2.0)
    table = degradation_curve(linear, NORMAL, factors, 2000, entropy=1).table
    exact = stats.norm.cdf(-BETA / np.array(factors))
    spread = np.sqrt(exact * (1 - exact) / 2000)
    assert np.all(np.abs(table["rate"] - exact) < 4 * spread)
    assert np.all((table["lower"] < exact) & (exact < table["upper"]))
    assert list(table.index) == list(factors)


@pytest.mark.weekly
def test_the_intervals_cover_as_they_say():
    """80 curves: each interval covers in 80 % or more; all three together if simultaneous."""
    factors, repeats = (0.7, 1.0, 1.5), 80
    exact = stats.norm.cdf(-BETA / np.array(factors))
    for simultaneous in (False, True):
        covered = np.empty((repeats, 3), dtype=bool)
        for entropy in range(repeats):
            made = degradation_curve(
                linear, NORMAL, factors, 25, entropy=entropy, confidence=0.8,
                simultaneous=simultaneous,
            ).table  # fmt: skip
            covered[entropy] = (made["lower"] <= exact) & (exact <= made["upper"])
        hits = [covered.all(axis=1).sum()] if simultaneous else covered.sum(axis=0)
        for count in hits:
            assert stats.binomtest(int(count), repeats, 0.8, "less").pvalue > 0.001


def test_intervals_are_those_of_clopper_and_pearson():
    """By themselves at the confidence; simultaneous ones at 1 - 0.1 / 2."""
    for simultaneous, each in ((False, 0.9), (True, 0.95)):
        made = degradation_curve(
            linear, NORMAL, (1.0, 2.0), 50, entropy=5, confidence=0.9, simultaneous=simultaneous
        )
        for _, row in made.table.iterrows():
            exact = clopper_pearson(int(row["violations"]), 50, each, "both")
            assert (row["lower"], row["upper"]) == exact
        assert made.is_simultaneous == simultaneous
    assert "scaled by 2 about the nominal value" in str(made.statements[1])


def test_common_random_numbers_make_nested_violations():
    """Where the safe set is convex, a point that fails goes on failing as it grows."""
    made = degradation_curve(linear, NORMAL, np.linspace(0, 3, 13), 300, entropy=2)
    failed = np.array(made.margins) <= 0
    assert np.all(failed[1:] >= failed[:-1])
    assert np.all(np.diff(made.table["violations"]) >= 0)
    assert made.table["violations"].iloc[0] == 0
    np.testing.assert_allclose(made.margins[0], BETA * np.sqrt(D))


def test_choices_vary_at_size_0():
    """Only numbers are scaled."""
    arm = Choice(name="arm", options={"a": 1, "b": 2}, weights=(0.7, 0.3))
    space = Space(quantities=NORMAL.quantities, choices=(arm,))

    def evaluated(table):
        return pd.DataFrame({"spec": 0.5 - (table["arm"] == "b")}, index=table.index)

    rate = degradation_curve(evaluated, space, (0.0,), 1000, entropy=1).table["rate"].iloc[0]
    assert abs(rate - 0.3) < 0.06


def test_nan_counts_as_a_violation():
    def broken(table):
        return linear(table).mask(table[["x0"]].to_numpy() > 0)

    made = degradation_curve(broken, NORMAL, (0.01,), 100, entropy=1)
    assert made.statements[0].violations == np.sum(np.isnan(made.margins[0])) > 20


@each_row(
    ("changes", "error", "message"),
    [
        ({"factors": ()}, nlctl.errors.ParameterError, "at least one factor"),
        ({"factors": (-1.0,)}, SpaceError, "scale >= 0, got -1"),
        ({"runs": 0}, nlctl.errors.ParameterError, "runs >= 1, got 0"),
        ({"confidence": 1.0}, nlctl.errors.ParameterError, "0 < confidence < 1"),
    ],
)
def test_bad_calls_are_refused(changes, error, message):
    with pytest.raises(error, match=message):
        degradation_curve(linear, **{"space": NORMAL, "factors": (1.0,), "runs": 10} | changes)


def test_ctrl_c_goes_through():
    """A curve with holes would be wrong."""
    with pytest.raises(KeyboardInterrupt):
        degradation_curve(lambda table: linear(table).iloc[:-1], NORMAL, (1.0,), 10)


def test_it_takes_partial_functions():
    made = degradation_curve(partial(linear, beta=0.0), NORMAL, (1.0,), 400, entropy=1)
    assert abs(made.table["rate"].iloc[0] - 0.5) < 0.1
