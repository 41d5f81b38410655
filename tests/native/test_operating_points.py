"""Operating points: python-control's own examples, closed forms, and what is said of a point."""

import control as ct
import numpy as np
import pytest

import nlctl


def pvtol():
    """The aircraft of python-control's examples."""
    m, J, r, g, c = 4.0, 0.0475, 0.25, 9.8, 0.05
    return ct.nlsys(
        lambda t, x, u, params: [
            x[3], x[4], x[5],
            (-c * x[3] + np.cos(x[2]) * u[0] - np.sin(x[2]) * u[1]) / m,
            (-c * x[4] + np.sin(x[2]) * u[0] + np.cos(x[2]) * u[1]) / m - g,
            r / J * u[0],
        ],
        lambda t, x, u, params: x,
        inputs=["F1", "F2"], states=6, outputs=["x", "y", "th", "vx", "vy", "om"], name="pvtol",
    )  # fmt: skip


def predator_prey():
    """The hares and lynxes of python-control's examples, with a food supply as input."""
    r, a, b, d, k, c = 1.6, 3.2, 0.6, 0.56, 125.0, 50.0
    return ct.nlsys(
        lambda t, x, u, params: [
            (r + u[0]) * x[0] * (1 - x[0] / k) - a * x[1] * x[0] / (c + x[0]),
            b * a * x[1] * x[0] / (c + x[0]) - d * x[1],
        ],
        lambda t, x, u, params: x,
        inputs=["feed"], states=["hares", "lynxes"], outputs=["H", "L"], name="predprey",
    )  # fmt: skip


HOVER = 4 * 9.8
ASKED = {
    "inputs": (pvtol, {"initial_state": np.zeros(6), "inputs": [0, HOVER]}),
    "outputs": (pvtol, {"x0": [0, 0, 0.1, 0, 0, 0], "u0": [0.1, 39], "y0": [1, 2, 0, 0, 0, 0],
                            "iy": [0, 1]}),
    "inputs and outputs": (pvtol, {"x0": np.zeros(6), "u0": [0.01, HOVER], "y0": np.zeros(6),
                                       "iu": [], "iy": [0, 1]}),
    "flight": (pvtol, {"x0": np.zeros(6), "u0": [0.01, HOVER], "y0": [0, 0, 0, 1, 0, 0],
                           "ix": [0, 1], "iy": [3, 4], "idx": [2, 3, 4, 5]}),
    "lynxes": (predator_prey, {"initial_state": [20, 30], "inputs": 0}),
    "feed": (predator_prey, {"x0": [25, 20], "u0": 0.0, "y0": [0, 30], "iy": [1], "iu": []}),
}  # fmt: skip


@pytest.mark.parametrize("name", ASKED)
def test_python_controls_examples_have_its_points(name):
    make, given = ASKED[name]
    ours, theirs = (
        each.find_operating_point(make(), **given | {"return_outputs": True})
        for each in (nlctl, ct)
    )
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6)
    system = make()
    rates = system.dynamics(0, ours.states, ours.inputs)
    asked = given.get("idx", range(system.nstates))
    np.testing.assert_allclose(rates[list(asked)], 0, atol=1e-12)


def pendulum():
    return ct.nlsys(
        lambda t, x, u, params: [x[1], u[0] - 9.81 * np.sin(x[0])],
        lambda t, x, u, params: x[0],
        inputs=["torque"], outputs=["angle"], states=["angle", "rate"], name="pendulum",
    )  # fmt: skip


def test_a_torque_is_found_that_holds_an_angle():
    point = nlctl.find_operating_point(pendulum(), inputs=0.0, outputs=0.5)
    np.testing.assert_allclose(point.inputs, 9.81 * np.sin(0.5), rtol=1e-14)
    np.testing.assert_allclose(point.outputs, 0.5, rtol=1e-14)
    assert point.isolated
    assert point.kinks == ()
    assert nlctl.linearize(pendulum(), point).A[1, 0] == pytest.approx(-9.81 * np.cos(0.5))
    assert ct.linearize(pendulum(), point).A[1, 0] == pytest.approx(-9.81 * np.cos(0.5), rel=1e-5)


def test_names_fix_what_places_fix():
    by_name = nlctl.find_operating_point(
        pendulum(), {"angle": 0.5}, 0.0, state_indices=["angle"], output_indices=[],
        deriv_indices=["rate", "angle"],
    )  # fmt: skip
    by_place = nlctl.find_operating_point(pendulum(), [0.5, 0.0], 0.0, ix=[0], iy=[], idx=[0, 1])
    np.testing.assert_array_equal(by_name.inputs, by_place.inputs)
    np.testing.assert_allclose(by_name.inputs, 9.81 * np.sin(0.5), rtol=1e-13)


def test_rates_that_are_wanted():
    point = nlctl.find_operating_point(pendulum(), [0.0, 0.0], 0.0, derivs=[2.0, 0.0])
    np.testing.assert_allclose(point.states, [0.0, 2.0], atol=1e-14)


def test_all_points_that_starts_lead_to():
    angles = np.linspace(-4, 4, 9)
    found = nlctl.find_operating_points(pendulum(), [[a, 0] for a in angles], 4.905)
    for point in found:
        assert np.sin(point.states[0]) == pytest.approx(0.5)
    assert {round(p.states[0] / np.pi * 6) % 12 for p in found} == {1, 5}


def test_discrete_time_stays_where_it_is():
    """x = x / 2 + u: twice the input."""
    system = ct.ss(0.5, 1, 1, 0, 0.1, name="discrete")
    np.testing.assert_allclose(nlctl.find_operating_point(system, 0.0, 3.0).states, 6.0)


def through(actuator):
    plant = ct.ss(-1, 1, 1, 0, inputs="v", outputs="y", name="plant")
    return nlctl.interconnect({"actuator": actuator, "plant": plant}, inputs=["u"], outputs=["y"])


def test_a_kink_is_named():
    """The default dead zone has its break point at 0.5."""
    edge = nlctl.DeadZone().b_r
    assert nlctl.find_operating_point(through(nlctl.DeadZone()), 0.0, 0.8).kinks == ()
    (kink,) = nlctl.find_operating_point(through(nlctl.DeadZone()), 0.0, edge).kinks
    assert kink.startswith("actuator")


def test_what_is_not_isolated_says_so():
    """Within a dead zone the output says nothing of the input."""
    point = nlctl.find_operating_point(through(nlctl.DeadZone()), 0.0, 0.1, 0.0)
    assert not point.isolated
    assert (point.rank, point.unknowns) == (1, 2)
    assert "not isolated: rank 1 for 2 unknowns" in repr(point)


def test_more_equations_than_unknowns_are_met_or_not():
    """Angle and rate are fixed and no torque is free: only where it hangs there is a point."""
    asked = {"state_indices": [0, 1], "input_indices": [0], "output_indices": []}
    assert nlctl.find_operating_point(pendulum(), [0.0, 0.0], 0.0, **asked).residual == 0.0
    with pytest.raises(nlctl.errors.OperatingPointError, match=r"missed by 4\.7") as raised:
        nlctl.find_operating_point(pendulum(), [0.5, 0.0], 0.0, **asked)
    assert raised.value.residual == pytest.approx(9.81 * np.sin(0.5))


def test_where_there_is_none_the_nearest_place_is_told():
    with pytest.raises(nlctl.errors.OperatingPointError, match="'pendulum'") as raised:
        nlctl.find_operating_point(pendulum(), [1.0, 0.0], 20.0)
    assert raised.value.residual == pytest.approx(20 - 9.81, rel=1e-6)
    np.testing.assert_allclose(np.sin(raised.value.states[0]), 1.0, rtol=1e-6)


def test_a_point_that_is_not_finite_is_none():
    root = ct.nlsys(lambda t, x, u, params: np.sqrt(x) - 1, inputs=0, states=1, name="root")
    assert nlctl.find_operating_point(root, [2.0]).states == pytest.approx(1.0)
    with pytest.raises(nlctl.errors.OperatingPointError, match="missed by nan"):
        nlctl.find_operating_point(root, [-2.0])


def test_delays_pass_what_is_constant():
    """x' = -x + 2 (r - x(t - tau)): two thirds of r, whatever the delay."""
    wire = nlctl.TransportDelay(inputs=("e",), outputs=("v",), delay=3.0)
    parts = {
        "wire": wire,
        "plant": ct.ss(-1, 1, 2, 0, inputs="v", outputs="y", name="plant"),
        "error": ct.summing_junction(["r", "-y"], "e", name="error"),
    }
    loop = nlctl.interconnect(parts, inputs=["r"], outputs=["y"])
    point = nlctl.find_operating_point(loop, 0.0, 3.0)
    np.testing.assert_allclose(point.outputs, 2.0, rtol=1e-13)
    assert point.isolated


def test_parameters_move_it():
    found = [
        nlctl.find_operating_point(through(nlctl.DeadZone()), 0.0, 1.0, params=params).states
        for params in ({}, {"actuator.b_r": 0.9})
    ]
    assert found[0] > found[1] > 0


def test_wrong_questions_are_refused_by_name():
    with pytest.raises(nlctl.errors.ParameterError, match="output_indices=\\[\\] fixes none"):
        nlctl.find_operating_point(pendulum(), 0.0, 0.0, state_indices=[0])
    with pytest.raises(nlctl.errors.UnknownNameError, match="angle"):
        nlctl.find_operating_point(pendulum(), 0.0, 0.0, 0.5, output_indices=["angel"])
    with pytest.raises(nlctl.errors.ParameterError, match="got 2 for a place of the states: "):
        nlctl.find_operating_point(pendulum(), 0.0, 0.0, state_indices=[2])
    with pytest.raises(nlctl.errors.ParameterError, match="root_method='no such'"):
        nlctl.find_operating_point(pendulum(), 0.0, 0.0, root_method="no such")
    hold = nlctl.sampled(ct.ss([], [], [], 1.0, 0.1, inputs="u", outputs="v", name="hold"))
    with pytest.raises(nlctl.errors.UsageError, match="'actuator'"):
        nlctl.find_operating_point(through(hold), 0.0, 1.0)
    with pytest.raises(nlctl.errors.ParameterError, match="'inputs' is given twice, as inputs= "):
        nlctl.find_operating_point(pendulum(), 0.0, 0.0, u0=1.0)
    with pytest.raises(nlctl.errors.UnknownKeywordError, match="nearest: 'x0'"):
        nlctl.find_operating_point(pendulum(), xO=1.0)
