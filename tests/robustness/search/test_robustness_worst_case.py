"""The search for the worst case, its confirmation and its shrinking: against known worst cases."""

import itertools
from functools import partial

import numpy as np
import pandas as pd
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from small_systems import function

import nlctl
from nlctl.analysis.robustness.runs.experiment import Experiment, evaluate, prepare
from nlctl.analysis.robustness.search.confirmation import confirm
from nlctl.analysis.robustness.search.shrink import shrink
from nlctl.analysis.robustness.search.worst_case import worst_case
from nlctl.analysis.robustness.statistics.guarantee import NoGuaranteeError, violation_probability
from nlctl.analysis.robustness.stl.formula import always, in_band
from nlctl.analysis.robustness.stl.spec import Requirement, Spec
from nlctl.analysis.robustness.uncertainty.design import rows
from nlctl.analysis.robustness.uncertainty.space import Choice, Space, SpaceError, Uncertain, scaled


def box(d, low=-1.0, high=2.0):
    return Space(
        quantities=tuple(
            Uncertain(name=f"x{i}", bounds=(low, high), nominal=0.0) for i in range(d)
        )
    )  # fmt: skip


def distance(table, place):
    return np.sum((table.filter(like="x").to_numpy(dtype=float) - place) ** 2, axis=1)


class TestWorstCase:
    @pytest.mark.parametrize("d", [1, 2, 6])
    def test_a_worst_case_in_a_corner_is_found_exactly(self, d):
        """Concave: the least is at a corner, here the one with all coordinates 2."""
        found = worst_case(function(lambda t: 1 - distance(t, -0.1)), box(d), 400, entropy=1)
        assert found.all_corners
        assert found.found_by == "corners"
        assert found.witness == dict.fromkeys(box(d).names, 2.0)
        assert found.margin == pytest.approx(1 - d * 2.1**2)

    @pytest.mark.slow
    @pytest.mark.parametrize("d", [1, 2, 5])
    def test_a_worst_case_inside_is_found_by_cma_es(self, d):
        """Convex: the least of 0.1 + |x - 0.7|^2 is 0.1."""
        found = worst_case(function(lambda t: 0.1 + distance(t, 0.7)), box(d), 1500, entropy=2)
        assert found.found_by == "CMA-ES"
        assert found.margin == pytest.approx(0.1, abs=1e-4)
        assert not found.is_violated
        assert "proves nothing" in str(found)

    def test_a_needle_in_the_plane_is_found(self):
        """A pit of width 0.1 that ends at -1 in a box of 3 x 3, on slightly sloping ground."""
        space, place = box(2), np.array([1.3, -0.4])

        def pit(table):
            r2 = distance(table, place)
            return 1 + 0.01 * np.sqrt(r2) - 2 * np.exp(-r2 / (2 * 0.1**2))

        found = worst_case(function(pit), space, 1000, entropy=3)
        assert found.margin == pytest.approx(-1, abs=1e-3)
        np.testing.assert_allclose(list(found.witness.values()), place, atol=0.01)

    def test_choices_are_searched_too(self):
        """The lowest margin is with the label that is rare."""
        arm = Choice(name="arm", options={"a": 1, "b": 2, "c": 3}, weights=(0.6, 0.3, 0.1))
        space = Space(quantities=box(2).quantities, choices=(arm,))
        low = {"a": 0.0, "b": 0.0, "c": 0.5}
        found = worst_case(
            function(lambda t: 1 + distance(t, 1.2) - t["arm"].map(low).to_numpy()),
            space, 600, entropy=4,
        )  # fmt: skip
        assert found.witness["arm"] == "c"
        assert found.margin == pytest.approx(0.5, abs=1e-3)
        assert set(found.design.table["arm"]) == set("abc")

    def test_choices_alone_are_all_tried(self):
        """Up to the number of runs."""
        arms = tuple(Choice(name=n, options=dict.fromkeys("abcd", 1)) for n in ("p", "q"))
        space, evaluated = Space(choices=arms), function(lambda t: 1.5 - (t["p"] + t["q"] == "db"))
        found = worst_case(evaluated, space, 16, entropy=1)
        assert found.all_corners
        assert found.witness == {"p": "d", "q": "b"}
        assert worst_case(evaluated, space, 5, entropy=1).design.size <= 5

    def test_whole_numbers_stay_whole(self):
        """A law of integers has no points between them."""
        space = Space(
            quantities=(
                Uncertain(name="n", law=stats.randint(0, 10), nominal=1),
                Uncertain(name="x", bounds=(0.0, 1.0), nominal=0.5),
            )
        )
        found = worst_case(
            function(lambda t: (t["n"] - 6.4) ** 2 + (t["x"] - 0.2) ** 2), space, 300, entropy=1
        )
        assert np.all(found.design.table["n"] % 1 == 0)
        assert found.margin == pytest.approx(0.16, abs=1e-3)

    @pytest.mark.slow
    @settings(deadline=None, max_examples=many(25, part=4))
    @given(st.integers(1, 4), st.integers(1, 150), st.integers(0, 2**40), st.booleans())
    def test_it_reports_the_least_of_its_own_rows(self, d, runs, entropy, broken):
        """Never more, in no more rows than allowed; the history falls; NaN is the worst."""
        space = box(d)

        def ripple(table):
            x = table.to_numpy()
            margins = np.sin(7 * x).sum(axis=1) + np.cos(3 * x).prod(axis=1)
            return np.where(broken & (margins < -0.5), np.nan, margins)

        found = worst_case(function(ripple), space, runs, entropy=entropy)
        margins = found.results["spec"].to_numpy()
        assert found.design.size == runs == sum(found.runs.values())
        if np.any(np.isnan(margins)):
            assert np.isnan(found.margin)
            assert found.is_violated
        else:
            assert found.margin == margins.min()
        assert np.all(found.best_so_far[1:] <= found.best_so_far[:-1])
        row = rows(found.design, range(found.number, found.number + 1))
        np.testing.assert_array_equal(ripple(row), [found.margin])
        table = found.design.table.to_numpy()
        assert np.all((table >= -1) & (table <= 2))
        again = worst_case(function(ripple), space, runs, entropy=entropy)
        pd.testing.assert_frame_equal(again.design.table, found.design.table)

    def test_nothing_touches_the_global_random_numbers(self):
        """The library's default would seed them."""
        before = np.random.get_state()  # noqa: NPY002 (it is what must not change)
        worst_case(function(lambda t: distance(t, 0.3)), box(3), 300, entropy=1)
        after = np.random.get_state()  # noqa: NPY002
        np.testing.assert_array_equal(before[1], after[1])
        assert before[2:] == after[2:]

    def test_it_stops_at_the_target(self):
        """Within the batch that reached it."""
        evaluated = function(lambda t: distance(t, 1.2) - 0.2)
        found = worst_case(evaluated, box(3), 2000, entropy=1, target=0.0)
        assert found.is_violated
        first = int(np.argmax(found.best_so_far <= 0))
        assert found.design.size - first <= 64 < 2000

    def test_its_rows_support_no_probability(self):
        """They were chosen by looking."""
        found = worst_case(function(lambda t: distance(t, 0.3)), box(2), 50, entropy=1)
        with pytest.raises(NoGuaranteeError, match="looking at earlier results"):
            violation_probability(found.design, found.results["spec"])

    def test_ctrl_c_keeps_what_is_done(self):
        """Rows that are missing, or the exception itself."""
        count = itertools.count()

        def interrupted(table):
            if next(count) == 3:
                raise KeyboardInterrupt
            return function(lambda t: distance(t, 0.3))(table)

        found = worst_case(interrupted, box(2), 1000, entropy=1)
        assert not found.is_finished
        assert 0 < found.design.size < 1000
        assert found.margin == found.results["spec"].min()
        assert found.best_so_far.size == found.design.size
        with pytest.raises(KeyboardInterrupt):
            worst_case(lambda table: function(lambda t: distance(t, 0))(table.iloc[:1]), box(2))

    def test_bad_calls_are_refused(self):
        with pytest.raises(nlctl.errors.ParameterError, match="runs >= 1, got 0"):
            worst_case(function(lambda t: distance(t, 0)), box(2), 0)
        with pytest.raises(nlctl.errors.ParameterError, match=r"column 'spec', got \['margin'\]"):
            worst_case(lambda t: pd.DataFrame({"margin": np.zeros(len(t))}), box(2))


class TestShrink:
    def test_only_what_matters_is_left(self):
        """Of five deviations, x1 + x3 > 2 is the violation; neither alone reaches it."""
        evaluated = function(lambda t: 2 - t["x1"] - t["x3"])
        made = shrink(evaluated, box(5), dict.fromkeys(box(5).names, 1.6))
        assert made.names == ("x1", "x3")
        assert made.of == 5
        assert made.is_fewest
        assert made.row["x0"] == made.row["x2"] == made.row["x4"] == 0
        assert -1.6 * 2**-9 <= made.margin <= 0
        assert made.row["x1"] == pytest.approx(0.4, abs=2e-3)  # the first goes as far as it may
        assert made.row["x3"] == pytest.approx(1.6, abs=2e-3)

    def test_fewer_are_found_where_deletion_alone_would_not(self):
        """{x0, x1} is what single deletions end with, but x2 alone violates."""

        def margins(table):
            has = table.to_numpy() > 0.5
            pair = has[:, 0] & has[:, 1]
            alone = has[:, 2] & ~has[:, 0] & ~has[:, 1]
            full = has.all(axis=1)
            return 1 - 3.0 * pair - 1.5 * alone - full

        row = dict.fromkeys(box(3).names, 1.0)
        assert shrink(function(margins), box(3), row).names == ("x2",)
        greedy = shrink(function(margins), box(3), row, most=0)
        assert set(greedy.names) == {"x0", "x1"}
        assert not greedy.is_fewest
        assert "each of them is needed" in str(greedy)

    def test_choices_go_back_to_nominal_if_they_may(self):
        arm = Choice(name="arm", options={"a": 1, "b": 2})
        space = Space(quantities=box(2).quantities, choices=(arm,))
        row = {"x0": 1.5, "x1": 1.5, "arm": "b"}
        made = shrink(function(lambda t: 1 - t["x0"]), space, row)
        assert made.names == ("x0",)
        assert made.row["arm"] == "a"
        made = shrink(function(lambda t: 0.5 - (t["arm"] == "b")), space, row)
        assert made.names == ("arm",)
        assert dict(made.row) == {"x0": 0, "x1": 0, "arm": "b"}

    @settings(deadline=None, max_examples=many(40))
    @given(st.integers(0, 2**32), st.integers(1, 6))
    def test_the_result_violates_and_each_part_is_needed(self, entropy, d):
        """Any margin: 1-minimal, within the first row's deviations."""
        rng = np.random.default_rng(entropy)
        weights, bend = rng.normal(size=d), rng.normal(size=(d, d))

        def margins(table):
            x = table.to_numpy()
            return 0.5 + x @ weights + np.einsum("ni,ij,nj->n", x, bend, x)

        space = box(d)
        first = dict(zip(space.names, rng.uniform(-1, 2, d), strict=True))
        if margins(pd.DataFrame([first]))[0] > 0:
            with pytest.raises(nlctl.errors.ParameterError, match="only a violation can be shrunk"):
                shrink(function(margins), space, first)
            return
        made = shrink(function(margins), space, first)
        assert made.margin == margins(pd.DataFrame([made.row]))[0] <= 0
        for name in space.names:
            part = made.row[name] / first[name]
            assert 0 < part <= 1 if name in made.names else part == 0
        for name in made.names:
            assert margins(pd.DataFrame([dict(made.row) | {name: 0.0}]))[0] > 0

    def test_nominal_values_are_needed(self):
        space = Space(quantities=(Uncertain(name="x0", bounds=(0, 1)),))
        with pytest.raises(SpaceError, match="no nominal value"):
            shrink(function(lambda t: -t["x0"]), space, {"x0": 1.0})


@nlctl.record
class Oscillator:
    """x'' = -damping x' - stiffness x, from x = 1 at rest."""

    damping: float = nlctl.param(0.2, unit="1/s", meaning="damping")
    stiffness: float = nlctl.param(1.0, unit="1/s^2", meaning="stiffness", above=0)
    growth: float = nlctl.param(0.0, unit="1", meaning="gain of x^3", at_least=0)
    inputs, outputs, states, initial = (), ("x",), ("x", "v"), {"x": 1.0}
    feedthrough = False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        x1, x2 = x
        return x2, -p.damping * x2 - p.stiffness * x1 + p.growth * x1**3

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def oscillating(limit, end=10.0, **changes):
    space = Space(
        quantities=(
            Uncertain(name="mass.damping", bounds=(0.1, 0.3)),
            Uncertain(name="mass.growth", bounds=(0.0, 3.0)),
        )
    )
    return prepare(
        Experiment(
            space=space,
            build=lambda: nlctl.interconnect({"mass": Oscillator()}, outputs=["x"]),
            spec=Spec(
                requirements=(
                    Requirement(
                        key="calm", formula=always(in_band("x", upper=limit), 2.0), until=end
                    ),
                )
            ),
            timepts=np.linspace(0, end, 501),
            **changes,
        )
    )


class TestConfirm:
    ROW = {"mass.damping": 0.1, "mass.growth": 0.0}

    def test_a_violation_is_confirmed_by_all_integrators(self):
        """The first maximum after 2 s: exp(-0.05 * 2 pi / w), w^2 = 1 - 0.05^2."""
        made = confirm(oscillating(0.7), self.ROW, python_control=True)
        assert made.is_confirmed
        assert list(made.replays["method"]) == ["auto", "tsit5", "rodas5p", "LSODA"]
        exact = 1 - np.exp(-0.05 * 2 * np.pi / np.sqrt(1 - 0.05**2)) / 0.7
        np.testing.assert_allclose(made.replays["margin"], exact, atol=1e-5)
        assert made.spread < 1e-5
        assert str(made).startswith("Confirmed by 4 integrations")

    def test_a_row_that_holds_is_not_confirmed(self):
        made = confirm(oscillating(0.9), self.ROW)
        assert not made.is_confirmed
        assert "holds, margin 0.18" in made.reason

    def test_a_violation_that_only_coarse_steps_see_is_not_confirmed(self):
        """The limit is met by 1e-5, which the study's tolerance of 0.1 cannot see."""
        top = np.exp(-0.05 * 2 * np.pi / np.sqrt(1 - 0.05**2))
        coarse = oscillating(top * (1 + 1e-5), rtol=0.1, atol=1e-3)
        margins = evaluate(coarse, pd.DataFrame([self.ROW]))["spec"]
        made = confirm(coarse, self.ROW)
        assert made.replays["margin"].iloc[0] == margins.iloc[0]
        assert not made.is_confirmed

    def test_a_burst_is_confirmed(self):
        """x'' = 2 x^3 + ... from 1 leaves the finite numbers."""
        made = confirm(
            oscillating(0.7), {"mass.damping": 0.1, "mass.growth": 3.0}, python_control=True
        )
        assert made.is_confirmed
        assert set(made.replays["status"]) <= {"DIVERGED", "STEP_TOO_SMALL"}
        assert np.ptp(made.replays["time"]) < 0.01 * made.replays["time"].min()

    def test_what_the_integrator_ends_is_not_confirmed(self):
        """Too few steps say nothing about the loop, although such a run counts as a violation."""
        made = confirm(oscillating(0.7, max_steps=20), self.ROW)
        assert np.all(made.replays["margin"] < 0)
        assert not made.is_confirmed
        assert "ended with STEP_LIMIT" in made.reason

    def test_the_search_on_a_loop_finds_the_corner(self):
        """The least damping has the highest swing; the growth adds to it."""
        made = oscillating(0.9)
        space = made.experiment.space
        found = worst_case(partial(evaluate, made), scaled(space, 0.5), 60, entropy=1)
        assert found.found_by == "corners"
        assert found.witness == {"mass.damping": pytest.approx(0.15), "mass.growth": 1.5}
        small = shrink(partial(evaluate, made), space, found.witness)
        assert small.names == ("mass.growth",)


def test_an_integer_that_is_scaled_to_one_value_stands_still():
    """x in 4 +- 2 scaled by 0.1 rounds to 4: the search goes on with the other numbers."""
    integers = Uncertain(name="n", law=stats.randint(2, 7), nominal=4)
    space = scaled(Space(quantities=(*box(2).quantities, integers)), 0.1)
    worst = worst_case(
        lambda table: table.assign(spec=table["x0"] + table["x1"]), space, 60, entropy=3
    )
    assert worst.runs["CMA-ES"] > 0
    assert set(worst.design.table["n"]) == {4}
    assert worst.margin == pytest.approx(-0.2, abs=1e-12)
