"""Controllers on the same samples: pairing, violations, ranking, and what is refused."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis import metrics
from nlctl.analysis.metrics import Metric
from nlctl.analysis.robustness import (
    Choice,
    Experiment,
    NoGuaranteeError,
    Requirement,
    Space,
    Spec,
    Uncertain,
    always,
    clopper_pearson,
    evaluate,
    from_table,
    in_band,
    independent,
    prepare,
    sobol,
)
from nlctl.analysis.robustness.statistics.comparison import compare, crossed

SPACE = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
CHOICE = Choice(name="controller", options={"one": 1, "two": 2, "three": 3})


def results(design, choice, **columns):
    """Return a table of results: each column as {option: numbers}, sample by sample."""
    table = crossed(design, choice).assign(status="OK")
    for name, by_option in columns.items():
        for label, numbers in by_option.items():
            table.loc[table[choice.name] == label, name] = numbers
    return table


def drawn(n, seed=1):
    """Return a design, and margins and errors of three controllers on it."""
    rng = np.random.default_rng(seed)
    base = rng.normal(size=n)
    margin = {c: base + 0.3 * i + rng.normal(size=n) for i, c in enumerate(CHOICE.options)}
    error = {c: np.abs(base) + 0.1 * i for i, c in enumerate(CHOICE.options)}
    return independent(SPACE, n, seed), margin, error


def compared(n=40, seed=1):
    design, margin, error = drawn(n, seed)
    table = results(design, CHOICE, spec=margin, error=error)
    return compare(design, CHOICE, table, {"error": "smaller"})


class TestCrossed:
    @given(st.integers(1, 20), st.integers(1, 4))
    def test_every_sample_comes_once_with_every_option(self, n, options):
        """Row i k + j is sample i with option j."""
        choice = Choice(name="c", options={f"o{j}": j for j in range(options)})
        design = independent(SPACE, n, 3)
        table = crossed(design, choice)
        assert list(table.index) == list(range(n * options))
        np.testing.assert_array_equal(table["a"], np.repeat(design.table["a"], options))
        assert list(table["c"]) == list(choice.options) * n

    def test_a_label_that_was_drawn_is_replaced(self):
        """Where the design's space has the choice already."""
        space = Space(quantities=SPACE.quantities, choices=(CHOICE,))
        design = independent(space, 10, 1)
        assert list(crossed(design, CHOICE).columns) == ["a", "controller"]
        assert from_table(space, crossed(design, CHOICE)).size == 30


class TestNumbers:
    def test_mcnemar_is_the_published_example(self):
        """6 and 16 discordant pairs: the exact two-sided p-value is 0.0525."""
        design, choice = independent(SPACE, 30, 1), Choice(name="c", options={"a": 1, "b": 2})
        one = [-1.0] * 6 + [1.0] * 16 + [1.0] * 5 + [-1.0] * 3
        other = [1.0] * 6 + [-1.0] * 16 + [1.0] * 5 + [-1.0] * 3
        table = results(design, choice, spec={"a": one, "b": other}, m={"a": one, "b": other})
        found = compare(design, choice, table, {"m": "larger"})
        assert found.violations.loc[("a", "b"), "p"] == pytest.approx(0.0525, abs=5e-5)
        assert list(found.ranking["violations"]) == [9, 19]
        assert list(found.ranking.index) == ["a", "b"]
        low, high = clopper_pearson(9, 30, 0.95, "both")
        assert tuple(found.ranking.loc["a", ["rate", "rate_low", "rate_high"]]) == (0.3, low, high)

    def test_a_constant_difference_is_found_exactly(self):
        """Errors that differ by 0.1 whatever the sample: median, mean and both intervals."""
        row = compared().differences.loc[("error", "one", "three")]
        for name in ("median", "median_low", "median_high", "mean", "mean_low", "mean_high"):
            assert row[name] == pytest.approx(-0.2)
        assert compared().wins.loc[("error", "one"), "three"] == 40
        assert list(compared().ranking["rank error"].sort_values()) == [1, 2, 3]

    def test_ranks_of_all_options_add_up(self):
        """To k (k + 1) / 2, also with ties and failed runs."""
        design, margin, error = drawn(20)
        error["two"] = np.where(np.arange(20) % 3, error["one"], np.nan)
        table = results(design, CHOICE, spec=margin, error=error)
        found = compare(design, CHOICE, table, {"error": "smaller"})
        assert found.ranking["rank error"].sum() == pytest.approx(6)

    def test_p_values_are_adjusted_for_all_pairs(self):
        """Holm's first step: the smallest of three p-values times three."""
        for table in (compared().violations, compared().differences.loc["error"]):
            assert len(table) == 3
            assert table["p_holm"].min() == pytest.approx(min(1, 3 * table["p"].min()))

    @pytest.mark.slow
    def test_intervals_cover_the_true_difference_of_rates(self):
        """Of 40 comparisons the exact interval of a rate holds 80 % at least."""
        law, held = stats.norm(0.5), 0
        for seed in range(40):
            design = independent(SPACE, 20, seed)
            m = np.random.default_rng(seed).normal(0.5, size=20)
            choice = Choice(name="c", options={"a": 1, "b": 2})
            both = {"a": m, "b": 1 + 0 * m}
            table = results(design, choice, spec=both, m=both)
            found = compare(design, choice, table, {"m": "larger"}, confidence=0.8)
            row = found.ranking.loc["a"]
            held += row["rate_low"] <= law.cdf(0) <= row["rate_high"]
        assert stats.binom.cdf(held, 40, 0.8) > 1e-3


class TestFailedRuns:
    def test_they_are_violations_and_losses_and_counted(self):
        """NaN enters no median, and no mean difference is claimed."""
        design, margin, error = drawn(10)
        margin = {c: np.full(10, 1.0) for c in CHOICE.options}
        table = results(design, CHOICE, spec=margin, error=error)
        lost = table.index[(table["controller"] == "one")][:4]
        table.loc[lost, ["spec", "error", "status"]] = [-1.5e6, np.nan, "DIVERGED"]
        found = compare(design, CHOICE, table, {"error": "smaller"})
        assert tuple(found.ranking.loc["one", ["violations", "failed"]]) == (4, 4)
        assert found.ranking.index[-1] == "one"
        assert found.ranking.loc["one", "median error"] == pytest.approx(
            np.median(error["one"][4:])
        )
        assert found.wins.loc[("error", "two"), "one"] == 4
        assert found.wins.loc[("error", "one"), "two"] == 6
        assert np.isnan(found.differences.loc[("error", "one", "two"), "mean"])
        assert "DIVERGED" not in str(found)
        assert "3 options of controller on the same 10 samples" in str(found)


class TestInvariance:
    def test_the_order_of_rows_and_of_options_does_not_matter(self):
        """Shuffled rows give the same; other names and another order the same under those."""
        design, margin, error = drawn(30)
        table = results(design, CHOICE, spec=margin, error=error)
        first = compare(design, CHOICE, table, {"error": "smaller"})
        shuffled = compare(
            design, CHOICE, table.sample(frac=1, random_state=1), {"error": "smaller"}
        )
        pd.testing.assert_frame_equal(first.ranking, shuffled.ranking)
        pd.testing.assert_frame_equal(first.differences, shuffled.differences)
        new = {"one": "x", "two": "y", "three": "z"}
        other = Choice(name="controller", options={"z": 3, "x": 1, "y": 2})
        columns = ({new[c]: v for c, v in column.items()} for column in (margin, error))
        renamed = results(design, other, **dict(zip(("spec", "error"), columns, strict=True)))
        second = compare(design, other, renamed, {"error": "smaller"})
        pd.testing.assert_frame_equal(first.ranking.rename(index=new), second.ranking)
        a = first.violations.loc[("one", "three")]
        b = second.violations.loc[("z", "x")]
        assert (a.only_a, a.only_b, a.p) == (b.only_b, b.only_a, b.p)


class TestRefused:
    @each_row(
        ("change", "message"),
        [
            (lambda t: t.drop(index=4), r"1 of 12 rows is missing, the first is row 4 \('two'\)"),
            (lambda t: t.rename(index={11: 12}), "1 of 12 rows is missing"),
            (lambda t: pd.concat([t, t.iloc[:1].rename(index={0: 12})]), "0 to 11, got row 12"),
            (lambda t: pd.concat([t, t.iloc[:1]]), "row 0 comes twice"),
            (lambda t: t.assign(a=t["a"] + (t.index == 7)), "row 7 has a = .* another design"),
            (lambda t: t.assign(controller="one"), "row 1 has controller = one"),
        ],
    )
    def test_rows_that_make_no_pairs(self, change, message):
        """The first row is named."""
        design, margin, error = drawn(4)
        table = results(design, CHOICE, spec=margin, error=error)
        compare(design, CHOICE, table, {"error": "smaller"})
        with pytest.raises(nlctl.errors.ParameterError, match=message):
            compare(design, CHOICE, change(table), {"error": "smaller"})

    def test_unknown_columns_no_metric_and_chosen_samples(self):
        """By name with the nearest; tests need independent draws."""
        design, margin, error = drawn(4)
        table = results(design, CHOICE, spec=margin, error=error)
        with pytest.raises(nlctl.errors.UnknownNameError, match="error"):
            compare(design, CHOICE, table, {"eror": "smaller"})
        with pytest.raises(nlctl.errors.ParameterError, match="at least one metric"):
            compare(design, CHOICE, table, {})
        chosen = sobol(SPACE, 4)
        table = results(chosen, CHOICE, spec=margin, error=error)
        with pytest.raises(NoGuaranteeError):
            compare(chosen, CHOICE, table, {"error": "smaller"})


@nlctl.record
class Decay:
    """x' = -(rate + boost) x + growth x^3."""

    rate: float = nlctl.param(1.0, unit="1/s", meaning="decay")
    boost: float = nlctl.param(0.0, unit="1/s", meaning="what an option adds")
    growth: float = nlctl.param(0.0, unit="1/s", meaning="growth")
    inputs, outputs, states, initial = (), ("y",), ("x",), {"x": 1.0}
    feedthrough = False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (-(p.rate + p.boost) * x[0] + p.growth * x[0] ** 3,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def test_loops_are_compared_from_their_equations():
    """y(1) = exp(-(rate + boost)): differences, violations and a run that escapes, exactly."""
    choice = Choice(
        name="lag",
        options={"slow": Decay(), "fast": Decay(boost=1.0), "lost": Decay(growth=100.0)},
    )
    quantities = (Uncertain(name="lag.rate", bounds=(0.5, 2.0)),)
    small = Requirement(key="small", formula=always(in_band("y", upper=0.3), 1, 1), until=1)
    experiment = Experiment(
        space=Space(quantities=quantities, choices=(choice,)),
        build=lambda lag: nlctl.interconnect({"lag": lag}, outputs=["y"]),
        spec=Spec(requirements=(small,)),
        timepts=np.linspace(0, 1, 11),
        metrics=(Metric(key="end", signal="y", unit="1", meaning="", function=metrics.final),),
    )
    made = prepare(experiment)
    design = independent(Space(quantities=made.experiment.space.quantities), 50, 5)
    found = compare(design, choice, evaluate(made, crossed(design, choice)), {"end": "smaller"})
    rate = design.table["lag.rate"].to_numpy()
    slow, fast = np.sum(np.exp(-rate) >= 0.3), np.sum(np.exp(-rate - 1) >= 0.3)
    assert dict(found.ranking["violations"]) == {"fast": fast, "slow": slow, "lost": 50}
    assert dict(found.ranking["failed"]) == {"fast": 0, "slow": 0, "lost": 50}
    expected = np.mean(np.exp(-rate) - np.exp(-rate - 1))
    assert found.differences.loc[("end", "slow", "fast"), "mean"] == pytest.approx(
        expected, abs=1e-6
    )
    assert found.wins.loc[("end", "fast"), "lost"] == 50
