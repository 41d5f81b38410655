"""How far an uncertainty may grow: radii with closed forms, of functions and of linear loops."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row
from scipy import stats
from small_systems import function

import nlctl
from nlctl.analysis.robustness.runs.experiment import Experiment, evaluate, prepare
from nlctl.analysis.robustness.search.radius import largest_scale, robustness_radius, size_of
from nlctl.analysis.robustness.stl.formula import always, in_band
from nlctl.analysis.robustness.stl.spec import Requirement, Spec
from nlctl.analysis.robustness.uncertainty.lattice import corners
from nlctl.analysis.robustness.uncertainty.space import (
    QUANTILES,
    Choice,
    Space,
    SpaceError,
    Uncertain,
    scaled,
)


def box(*sides):
    """Nominal 0, asymmetric boxes."""
    return Space(
        quantities=tuple(
            Uncertain(name=f"x{i}", bounds=(-side, 2 * side), nominal=0.0)
            for i, side in enumerate(sides)
        )
    )


@pytest.mark.parametrize("d", [1, 2, 4])
def test_the_radius_of_the_linear_limit_state(d):
    """beta sqrt(d) - sum x_i > 0: the corner of the box reaches it at beta / (sqrt(d) quantile)."""
    space = Space(
        quantities=tuple(Uncertain(name=f"x{i}", law=stats.norm(), nominal=0.0) for i in range(d))
    )
    beta = 2.5
    made = robustness_radius(
        function(lambda t: beta * np.sqrt(d) - t.sum(axis=1)), space, runs=60, entropy=1
    )
    exact = beta / (np.sqrt(d) * stats.norm.ppf(QUANTILES[1]))
    assert made.upper == pytest.approx(exact, rel=5e-4)
    assert made.upper >= exact * (1 - 1e-12)
    assert made.searched < exact
    assert made.margin <= 0


@pytest.mark.slow
@settings(deadline=None, max_examples=10)
@given(st.lists(st.floats(-1, 1), min_size=1, max_size=3), st.floats(0.2, 3), st.integers(0, 2**32))
def test_half_spaces(normal, offset, entropy):
    """n x < c: the box of size rho reaches rho sum max(-n, 2 n); the witness is at its edge."""
    normal = np.array(normal)
    space = box(*[1.0] * normal.size)
    reach = np.sum(np.maximum(-normal, 2 * normal))
    evaluated = function(lambda t: offset - t.to_numpy() @ normal)
    made = robustness_radius(evaluated, space, 4.0, runs=40, draws=30, entropy=entropy)
    if reach * 4 <= offset * (1 - 1e-9):
        assert made.upper == np.inf
        assert made.witness is None
        assert made.searched == 4
        assert "No violation was found up to the size 4" in str(made)
        return
    assert made.upper == pytest.approx(offset / reach, rel=1e-3)
    assert size_of(space, made.witness) == made.upper
    assert evaluated(pd.DataFrame([made.witness]))["spec"][0] == made.margin <= 0
    assert made.statement.violations == 0
    assert made.runs == made.steps["runs"].sum()


def test_a_violation_inside_the_box_is_found():
    """A ball about (0.8, 0.5): the box that touches it, not the one that holds its centre."""
    space, centre, r = box(1.0, 1.0), np.array([0.8, 0.5]), 0.3
    made = robustness_radius(
        function(lambda t: np.sum((t.to_numpy() - centre) ** 2, axis=1) - r**2),
        space, 2.0, runs=600, tolerance=0.005, entropy=1,
    )  # fmt: skip
    assert made.upper == pytest.approx((0.8 - 0.3) / 2, rel=0.02)


def test_the_radius_scales_with_the_box():
    """Of a box twice as large it is half."""
    evaluated = function(lambda t: 1.7 - t["x0"] - 0.3 * t["x1"])
    one = robustness_radius(evaluated, box(0.5, 0.7), 8.0, runs=40, entropy=1)
    two = robustness_radius(evaluated, scaled(box(0.5, 0.7), 2.0), 4.0, runs=40, entropy=1)
    assert one.upper == pytest.approx(2 * two.upper, rel=1e-3)


def test_a_violation_at_nominal_has_radius_0():
    """By itself, or with another option: choices are not scaled."""
    made = robustness_radius(function(lambda t: t["x0"] - 0.1), box(1.0), runs=10)
    assert (made.upper, made.searched, made.statement) == (0.0, 0.0, None)
    assert made.witness == {"x0": 0.0}
    assert str(made).startswith("The nominal values violate the spec (margin -0.1): x0 = 0.")
    assert "-0" not in str(made).replace("-0.1", "")
    arm = Choice(name="arm", options={"a": 1, "b": 2})
    space = Space(quantities=box(1.0).quantities, choices=(arm,))
    made = robustness_radius(function(lambda t: 0.5 - (t["arm"] == "b")), space, runs=10)
    assert made.upper == 0
    assert made.witness == {"x0": 0.0, "arm": "b"}


def test_a_violation_right_beside_nominal_ends_the_search():
    """The radius is 0, which no box reaches: it ends at a thousandth of the largest size."""
    made = robustness_radius(
        function(lambda t: np.where(t["x0"] == 0, 1.0, -1.0)), box(1.0), 2.0, runs=20, entropy=1
    )
    assert 0 < made.upper < 0.002
    assert made.searched == 0


def test_whole_numbers_do_not_fit_every_box():
    """n = 1 (nominal) to 9 fails from 4 on, 3 / 8; 3.5, 2.5 / 8, is rounded to 4."""
    space = Space(quantities=(Uncertain(name="n", law=stats.randint(0, 10), nominal=1),))
    made = robustness_radius(function(lambda t: 3.5 - t["n"]), space, 2.0, runs=20, entropy=1)
    assert made.witness == {"n": 4.0}
    assert made.upper == pytest.approx(3 / 8)
    assert made.searched < 2.5 / 8
    assert made.statement.violations == 0


def test_draws_that_contradict_the_search_lower_the_bound():
    """The search looks at the box; here half of the law beyond it fails, which the draws see."""
    space = Space(
        quantities=(Uncertain(name="x", law=stats.norm(), bounds=(-0.1, 0.1), nominal=0.0),)
    )
    made = robustness_radius(
        function(lambda t: 0.5 - np.abs(t["x"])), space, 1.0, runs=50, draws=200, entropy=1
    )
    assert made.searched == 1
    assert made.statement.violations > 50
    assert made.upper == pytest.approx(5, rel=1e-3)  # of the box, 0.5 / 0.1
    assert "Draws of that size" in str(made)


def test_refused_draws_leave_the_search_as_it_is():
    def refusing(table):
        if len(table) == 33:
            raise nlctl.errors.ParameterError("DeadZone needs b_r >= 0, got -1")
        return function(lambda t: 1 - t["x0"])(table)

    made = robustness_radius(refusing, box(1.0), runs=20, draws=33, entropy=1)
    assert made.upper == pytest.approx(0.5, rel=1e-3)
    assert made.statement is None
    assert "a draw was refused, DeadZone" in str(made)


@each_row(
    ("changes", "error", "message"),
    [
        ({"largest": 0.0}, nlctl.errors.ParameterError, "largest > 0, got 0"),
        ({"tolerance": np.nan}, nlctl.errors.ParameterError, "0 < tolerance < 1, got nan"),
        ({"draws": -1}, nlctl.errors.ParameterError, "draws >= 0"),
        (
            {"space": Space(quantities=(Uncertain(name="x0", bounds=(0, 1)),))},
            SpaceError,
            "no nominal value",
        ),
    ],
)
def test_bad_calls_are_refused(changes, error, message):
    with pytest.raises(error, match=message):
        robustness_radius(**{"evaluate": function(lambda t: t["x0"]), "space": box(1)} | changes)


@nlctl.record
class Mass:
    """m x'' = f - d x', at x = 1 at rest."""

    m: float = nlctl.param(1.0, unit="kg", meaning="mass", above=0)
    d: float = nlctl.param(0.5, unit="kg/s", meaning="damping")
    inputs, outputs, states, initial = ("f",), ("x", "w"), ("x", "v"), {"x": 1.0}
    feedthrough = False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return x[1], (u[0] - p.d * x[1]) / p.m

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return x[0], x[1]


@nlctl.record
class Spring:
    """f = -k x - c w: a spring, and a derivative gain."""

    k: float = nlctl.param(1.0, unit="N/m", meaning="stiffness", above=0)
    c: float = nlctl.param(0.0, unit="N s/m", meaning="derivative gain")
    inputs, outputs, states = ("x", "w"), ("f",), ()
    feedthrough = True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (-p.k * u[0] - p.c * u[1],)


def mass_and_spring(*quantities):
    """|x| <= 1 after 0.5 s, from x = 1 at rest: holds if and only if d + c > 0.

    The energy m v^2 / 2 + k x^2 / 2 falls then, and grows otherwise, until at the next turning
    point |x| > 1.
    """
    return prepare(
        Experiment(
            space=Space(quantities=quantities),
            build=lambda: nlctl.interconnect({"mass": Mass(), "spring": Spring()}, outputs=["x"]),
            spec=Spec(
                requirements=(
                    Requirement(
                        key="stable",
                        formula=always(in_band("x", lower=-1, upper=1), 0.5),
                        until=20,
                    ),
                )
            ),
            timepts=np.linspace(0, 20, 801),
            rtol=1e-9,
            atol=1e-11,
        )
    )


@pytest.mark.slow
def test_the_radius_of_a_linear_loop_is_its_stability_margin():
    """d in 0.5 +- 0.2 and c in 0 +- 0.1 lose stability at (0.5 - 0.2 r) - 0.1 r = 0, r = 5 / 3."""
    made = mass_and_spring(
        Uncertain(name="mass.d", bounds=(0.3, 0.7)),
        Uncertain(name="spring.c", bounds=(-0.1, 0.1)),
        Uncertain(name="spring.k", bounds=(0.9, 1.1)),
    )
    largest, why = largest_scale(made, 3.0)
    assert (largest, why) == (3.0, "")
    found = robustness_radius(
        partial(evaluate, made), made.experiment.space, largest, runs=80, draws=100, entropy=1
    )
    assert found.upper == pytest.approx(5 / 3, rel=2e-3)
    witness = found.witness
    assert witness["mass.d"] + witness["spring.c"] == pytest.approx(0, abs=2e-3)
    assert found.statement.violations == 0
    assert found.statement.upper == pytest.approx(1 - 0.01 ** (1 / 100))


def test_the_search_ends_where_the_loop_refuses_values():
    """k = 1 - 0.3 r > 0 ends at r = 10 / 3; all these loops are stable."""
    made = mass_and_spring(
        Uncertain(name="spring.k", bounds=(0.7, 1.2)), Uncertain(name="mass.d", bounds=(0.45, 0.55))
    )
    largest, why = largest_scale(made)
    assert largest == pytest.approx(10 / 3, rel=1e-9)
    assert largest < 10 / 3
    assert "Spring needs k > 0" in why
    assert "at 4" in why
    found = robustness_radius(
        partial(evaluate, made), made.experiment.space, largest, limit=why, runs=30, draws=0
    )
    assert found.witness is None
    assert found.searched == largest
    assert "Spring needs k > 0" in str(found)
    with pytest.raises(nlctl.errors.ParameterError, match="at_most > 0, got 0"):
        largest_scale(made, 0)
    half = largest_scale(prepare_scaled(made, 2.0))[0]
    assert half == pytest.approx(5 / 3, rel=1e-9)


def alone(record, boxes, **nominal):
    """A block by itself, with boxes of its parameters."""
    quantities = (
        Uncertain(name=f"block.{key}", bounds=box, nominal=nominal.get(key))
        for key, box in boxes.items()
    )
    formula = always(in_band("v", upper=1))
    return prepare(
        Experiment(
            space=Space(quantities=tuple(quantities)),
            build=lambda: nlctl.interconnect({"block": record}, inputs=["u"], outputs=["v"]),
            spec=Spec(requirements=(Requirement(key="small", formula=formula, until=1),)),
            timepts=np.linspace(0, 1, 11),
        )
    )


def test_rules_of_two_parameters_end_the_sizes_together():
    """A gap -0.6 + 0.4 r < 0.5 - 0.3 r closes at r = 11 / 7, though each end may go on by itself.

    Just below, all corners are simulated; just above, one of them is refused.
    """
    made = alone(nlctl.Backlash(), {"c_l": (-0.8, -0.2), "c_r": (0.2, 0.7), "m_r": (1.0, 1.4)})
    largest, why = largest_scale(made)
    assert largest == pytest.approx(11 / 7, rel=1e-9)
    assert largest < 11 / 7
    assert "Backlash needs c_l < c_r" in why
    space = made.experiment.space
    rows = evaluate(made, corners(scaled(space, largest)).table)
    assert (rows["status"] == "OK").all()
    with pytest.raises(nlctl.errors.ParameterError, match="c_l < c_r"):
        evaluate(made, corners(scaled(space, largest * (1 + 1e-9))).table)


def test_what_is_not_scaled_is_nominal_and_not_what_was_run_last():
    """A gap -0.4 < 0.5 - 0.3 r closes at r = 3; -0.6 is the block's own end, -0.2 that of a run."""
    made = alone(nlctl.Backlash(), {"c_l": (-0.8, -0.2), "c_r": (0.2, 0.7)}, c_l=-0.4)
    evaluate(made, corners(made.experiment.space).table.iloc[::-1])
    assert largest_scale(made, names=["block.c_r"])[0] == pytest.approx(3, rel=1e-9)


def test_the_first_of_several_rules_ends_the_sizes():
    """Of a dead zone b_r > 0 at 5 / 3, |ripple| < slope at 0.7 / 0.3 on the right, 3 / 2 left."""
    boxes = {"b_r": (0.2, 0.6), "slope_r": (0.8, 1.0), "ripple_r": (0.2, 0.4)}
    boxes |= {"slope_l": (0.6, 0.8), "ripple_l": (0.0, 0.4)}
    largest, why = largest_scale(alone(nlctl.DeadZone(), boxes))
    assert largest == pytest.approx(3 / 2, rel=1e-9)
    assert "|ripple_l| < slope_l" in why


@nlctl.record
class Knots:
    """v = u, with knots in order: a rule about neighbours only."""

    at: tuple = nlctl.param(tuple(map(float, range(12))), unit="1", meaning="knots")
    inputs, outputs, states = ("u",), ("v",), ()
    feedthrough = True

    def check(self):
        if not np.all(np.diff(self.at) > 0):
            raise nlctl.errors.ParameterError("Knots needs them in order")

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (u[0] + 0.0 * p.at[0],)


def test_many_quantities_of_one_block_are_tried_in_pairs():
    """Knots i +- r / 4: an end meets its neighbour at r = 4, two ends meet in the middle at 2."""
    boxes = {f"at[{i}]": (i - 0.25, i + 0.25) for i in range(12)}
    largest, why = largest_scale(alone(Knots(), boxes), 8.0)
    assert largest == pytest.approx(2, rel=1e-9)
    assert "Knots needs them in order" in why
    single = {key: boxes[key] for key in ("at[3]",)}
    assert largest_scale(alone(Knots(), single), 8.0)[0] == pytest.approx(4, rel=1e-9)


def test_a_nominal_row_that_is_refused_has_no_size():
    """Each of the two is admissible with the other's default; together they are not."""
    made = alone(nlctl.Backlash(), {"c_l": (0.0, 0.4), "c_r": (-0.5, 0.6)}, c_l=0.3, c_r=-0.1)
    with pytest.raises(nlctl.errors.ParameterError, match=r"c_l < c_r, got 0\.3 and -0\.1"):
        largest_scale(made)


def prepare_scaled(made, factor):
    """The same experiment with a scaled space."""
    space = scaled(made.experiment.space, factor)
    return replace(made, experiment=replace(made.experiment, space=space))
