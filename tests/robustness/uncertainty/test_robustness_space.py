"""Spaces: names held against a diagram, laws turned into values, boxes scaled."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis.robustness.uncertainty.binding import diagrams, resolved
from nlctl.analysis.robustness.uncertainty.space import (
    Choice,
    Space,
    SpaceError,
    Uncertain,
    arguments,
    combinations,
    ends,
    from_quantiles,
    from_unit_cube,
    nominal,
    scaled,
)

B_R = Uncertain(name="actuator.b_r", bounds=(0.3, 0.9))
X1 = Uncertain(name="plant.x1(0)", law=stats.norm(0.5, 0.1))
ACTUATOR = Choice(
    name="actuator", options={"dead zone": nlctl.DeadZone(), "backlash": nlctl.Backlash()}
)


@pytest.fixture(scope="module")
def loop():
    """Example 1, not compiled."""
    return nlctl.paper.example_1()


def test_names_units_and_nominal_values_come_from_the_diagram(loop):
    """Ends of paths are enough, for parameters, their elements and initial states."""
    short = Space(
        quantities=(
            Uncertain(name="b_r", bounds=(0.3, 0.9)),
            Uncertain(name="x1(0)", bounds=(-1, 1), unit="m"),
            Uncertain(name="lambdas[0]", bounds=(1.0, 2.0)),
            Uncertain(name="frequencies[1]", law=stats.uniform(0.4, 0.2), nominal=0.45),
        )
    )
    b_r, x1, slope, frequency = resolved(short, loop).quantities
    assert (b_r.name, b_r.unit, b_r.nominal) == ("actuator.b_r", "1", 0.5)
    assert (x1.name, x1.unit) == ("plant.x1(0)", "m")
    assert x1.nominal == nlctl.initial_state(loop)[nlctl.state_names(loop).index("plant.x1")]
    assert slope.name.endswith("lambdas[0]")
    assert slope.nominal == nlctl.parameters(loop).value[slope.name[:-3]][0]
    assert (frequency.unit, frequency.nominal) == ("rad/s", 0.45)


@each_row(
    ("quantity", "error", "message"),
    [
        (
            {"name": "actuator.br", "bounds": (0, 1)},
            nlctl.errors.UnknownNameError,
            "nearest: 'actuator.b",
        ),
        (
            {"name": "plant.x9(0)", "bounds": (0, 1)},
            nlctl.errors.UnknownNameError,
            "nearest: 'plant.x",
        ),
        (
            {"name": "b_r", "bounds": (-0.1, 1)},
            nlctl.errors.ParameterError,
            "b_r >= 0, got -0.1.*act",
        ),
        ({"name": "lambdas", "bounds": (1, 2)}, SpaceError, r"shape \(1,\): address.*lambdas\[0\]"),
        (
            {"name": "centres", "bounds": (1, 2)},
            nlctl.errors.ParameterError,
            "centres to be a matrix",
        ),
        (
            {"name": "lambdas[7]", "bounds": (1, 2)},
            nlctl.errors.ParameterError,
            "not an element of it",
        ),
        ({"name": "b_r", "bounds": (0.6, 0.9)}, SpaceError, r"\[0.6, 0.9\], got 0.5.*diagram's"),
    ],
)
def test_what_does_not_fit_the_diagram_is_refused(loop, quantity, error, message):
    """The message names the quantity and what to write instead."""
    with pytest.raises(error, match=message):
        resolved(Space(quantities=(Uncertain(**quantity),)), loop)


def test_a_whole_number_needs_a_law_of_whole_numbers():
    """The seed of a noise: uniform is refused, randint gives integers that reach the block."""
    noise = nlctl.block(nlctl.references.BandLimitedNoise(), "sensor")
    with pytest.raises(SpaceError, match=r"sensor.seed' is an integer.*got uniform on \[0, 9\]"):
        resolved(Space(quantities=(Uncertain(name="sensor.seed", bounds=(0, 9)),)), noise)
    space = Space(quantities=(Uncertain(name="sensor.seed", law=stats.randint(0, 10)),))
    space = resolved(space, noise)
    table = from_quantiles(space, np.linspace(0, 1, 101)[:, None])
    assert set(table["sensor.seed"]) == set(range(10))
    assert arguments(space, table)["params"]["sensor.seed"].dtype.kind == "i"


def test_parameters_of_third_party_blocks_go_by_their_bare_names():
    """A ct.nlsys with a dict of parameters; a vector is refused."""
    lag = ct.nlsys(
        lambda t, x, u, params: [-params["a"] * x[0] * params["v"][0]],
        inputs=0, states=["x"], name="lag", params={"a": 1.5, "v": [1.0, 2.0]},
    )  # fmt: skip
    (a,) = resolved(Space(quantities=(Uncertain(name="a", bounds=(1, 2)),)), lag).quantities
    assert a.nominal == 1.5
    with pytest.raises(SpaceError, match=r"'v' has shape \(2,\): address.*'v\[0\]'"):
        resolved(Space(quantities=(Uncertain(name="v", bounds=(1, 2)),)), lag)


def test_uniform_points_become_draws_of_the_laws():
    """The quantile function at u is where the distribution function is u."""
    u = np.random.default_rng(1).random((500, 3))
    space = Space(quantities=(B_R, X1), choices=(ACTUATOR,))
    table = from_quantiles(space, u)
    np.testing.assert_allclose(B_R.law.cdf(table["actuator.b_r"]), u[:, 0], atol=1e-12)
    np.testing.assert_allclose(X1.law.cdf(table["plant.x1(0)"]), u[:, 1], atol=1e-12)
    np.testing.assert_array_equal(table["actuator"] == "backlash", u[:, 2] >= 0.5)


def test_the_faces_of_the_cube_give_finite_values():
    """u = 0 and u = 1 of a normal law are far out, not infinite."""
    assert np.isfinite(from_quantiles(Space(quantities=(X1,)), np.array([[0.0], [1.0]]))).all(
        axis=None
    )


def test_choices_come_with_their_weights():
    """A weight of 0 is never drawn; shares converge to the weights."""
    choice = Choice(name="actuator", options=dict.fromkeys("abc"), weights=(0.25, 0.0, 0.75))
    u = (np.arange(1000)[:, None] + 0.5) / 1000
    labels = from_quantiles(Space(choices=(choice,)), u)["actuator"]
    assert labels.value_counts().to_dict() == {"c": 750, "a": 250}


@given(st.floats(0, 5), st.floats(0, 1))
def test_scaling_multiplies_the_distance_to_the_nominal_value(factor, u):
    """Draws and box alike; twice by s is once by s^2; choices stay."""
    space = Space(
        quantities=(Uncertain(name="b_r", bounds=(0.3, 0.9), nominal=0.5),), choices=(ACTUATOR,)
    )
    points = np.array([[u, 0.7]])
    for mapping in (from_quantiles, from_unit_cube):
        full, part = mapping(space, points), mapping(scaled(space, factor), points)
        assert part.b_r[0] - 0.5 == pytest.approx(factor * (full.b_r[0] - 0.5), abs=1e-12)
        assert part.actuator[0] == full.actuator[0] == "backlash"
    assert scaled(scaled(space, factor), factor).scale == pytest.approx(factor**2)


def test_the_box_of_an_unbounded_law_holds_its_quantiles():
    """99.8 % of a normal law; half-bounded laws keep their finite end; given bounds win."""
    low, high = X1.box
    assert X1.law.cdf(high) - X1.law.cdf(low) == pytest.approx(0.998)
    assert Uncertain(name="g", law=stats.expon()).box[0] == 0
    assert Uncertain(name="g", law=stats.norm(), bounds=(-2, 1)).box == (-2, 1)


def test_ends_are_those_of_the_scaled_boxes():
    """Low and high of every quantity, whatever the choices and their weights."""
    b_r = Uncertain(name="b_r", bounds=(0.3, 0.9), nominal=0.5)
    found = ends(Space(quantities=(b_r,), choices=(ACTUATOR,), scale=2.0))
    assert list(found) == ["b_r"]
    np.testing.assert_allclose(found["b_r"], [0.1, 1.3])


def test_arguments_split_parameters_from_initial_states():
    """The ensemble's two dictionaries, without the choices."""
    space = Space(quantities=(B_R, X1), choices=(ACTUATOR,))
    split = arguments(space, from_unit_cube(space, np.zeros((3, 3))))
    assert list(split["params"]) == ["actuator.b_r"]
    assert list(split["initial_state"]) == ["plant.x1"]
    np.testing.assert_array_equal(split["params"]["actuator.b_r"], [0.3] * 3)


def test_every_combination_of_choices_is_built_and_checked():
    """Two actuators; b_r belongs to one of them only, and the message says which lacks it."""
    space = Space(quantities=(X1,), choices=(ACTUATOR,))
    built = diagrams(space, nlctl.paper.example_1)
    assert [labels for labels, _ in built] == combinations(space)
    assert "actuator.memory" in nlctl.state_names(built[1][1])
    with pytest.raises(nlctl.errors.UnknownNameError, match=r"b_r'.*with actuator = backlash"):
        diagrams(Space(quantities=(B_R,), choices=(ACTUATOR,)), nlctl.paper.example_1)
    wrong = Space(choices=(Choice(name="actor", options=ACTUATOR.options),))
    with pytest.raises(
        nlctl.errors.UnknownNameError, match="keyword 'actor' of example_1; nearest: 'act"
    ):
        diagrams(wrong, nlctl.paper.example_1)


@each_row(
    ("make", "message"),
    [
        (lambda: Uncertain(name="a"), "needs a law .* or bounds, got neither"),
        (lambda: Uncertain(name="a", bounds=(1, 1)), "low < high"),
        (lambda: Uncertain(name="a", bounds=(0, np.nan)), "finite bounds"),
        (lambda: Uncertain(name="a", law=stats.norm), "frozen law"),
        (lambda: Uncertain(name="a", bounds=(0, 1), nominal=2), r"in its box \[0, 1\], got 2"),
        (lambda: Choice(name="c", options={}), "at least one option"),
        (lambda: Choice(name="c", options={"x": 1}, nominal="y"), "got 'y'"),
        (lambda: Choice(name="c", options={"x": 1}, weights=(0.5,)), "add up to 1"),
        (lambda: Space(), "at least one quantity"),
        (lambda: Space(quantities=(B_R, B_R)), r"got twice: \['actuator.b_r'\]"),
        (lambda: Space(quantities=(B_R,), scale=-1), "scale >= 0"),
        (lambda: scaled(Space(quantities=(B_R,)), 2), "has no nominal value: give one"),
        (lambda: nominal(Space(quantities=(B_R,))), "has no nominal value"),
        (
            lambda: from_quantiles(Space(quantities=(B_R,)), np.zeros((2, 2))),
            r"shape \(n, 1\), got",
        ),
        (lambda: from_unit_cube(Space(quantities=(B_R,)), np.array([[np.nan]])), r"in \[0, 1\]"),
    ],
)
def test_contradictions_are_refused_by_name(make, message):
    """Where they are born, with rule and value."""
    with pytest.raises(nlctl.errors.UsageError, match=message):
        make()
