"""L1 adaptive control: the bound of the predictor, its limit of fast adaptation, Rohrs' plant."""

import control as ct
import numpy as np
import pytest
from rows import each_row

import nlctl

W = np.array([1.0, -2.0, 1.5])  # of x1, x2, 1
SINE = nlctl.SumOfSines(order=0, amplitudes=1.0, frequencies=1.5, phases=0.0)


@nlctl.equation
def uncertain(x, v):
    """x2' = -4 x1 - 2 x2 + 2 v + W^T (x, 1)."""
    x1, x2 = x
    return -4.0 * x1 - 2.0 * x2 + 2.0 * v + 1.0 * x1 - 2.0 * x2 + 1.5


def loop_of(Gamma=1000.0, omega=8.0):
    controller = nlctl.l1_adaptive(
        nlctl.controllers.StatePredictor(a=(4.0, 2.0), gain=2.0),
        weights=nlctl.controllers.ProjectedWeights(nodes=3, Gamma=Gamma, W_max=5.0),
        law=nlctl.controllers.FilteredLaw(omega=omega, b=4.0, gain=2.0),
    )
    plant = nlctl.PureFeedback(order=2, f=uncertain)
    blocks = {"command": SINE, "plant": plant, "controller": controller, "a": nlctl.Gain()}
    return nlctl.interconnect(blocks, outputs=["x1", "x2", "u", "xm1", "xm2", "W_norm"])


def reference_response(times, omega=8.0):
    """The loop with W itself in the place of its estimate: linear, by python-control."""
    A = np.array([
        [0, 1, 0],
        [-4 + W[0], -2 + W[1], 2],
        [-omega * W[0] / 2, -omega * W[1] / 2, -omega],
    ])  # fmt: skip
    B = np.array([[0, 0], [0, W[2]], [omega * 4 / 2, -omega * W[2] / 2]])
    inputs = np.array([np.sin(1.5 * times), np.ones_like(times)])
    return ct.forced_response(ct.ss(A, B, np.eye(3), 0), times, inputs).outputs


def test_the_predictor_keeps_its_bound_for_every_gain_of_adaptation():
    """|x - xm|^2 <= |W|^2 / (Gamma lambda_min(P)) from equal states and W_hat(0) = 0."""
    Gammas = np.array([1.0, 10.0, 100.0, 1000.0, 10_000.0])
    P = nlctl.controllers.ModelError(K=(4.0, 2.0), Q=(1.0, 1.0)).lyapunov_matrix
    many = nlctl.ensemble_response(
        loop_of(), np.linspace(0, 10, 2001), params={"weights.Gamma": Gammas},
        keep=["x1", "x2", "xm1", "xm2"], rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    E = [many.signals[f"x{i}"] - many.signals[f"xm{i}"] for i in (1, 2)]
    largest = np.hypot(*E).max(axis=1)
    assert np.all(largest <= np.sqrt(W @ W / (Gammas * np.linalg.eigvalsh(P)[0])))
    assert np.all(np.diff(largest) < 0)


def test_fast_adaptation_gives_the_response_that_knows_the_weights():
    """x and u approach those of the reference loop; with 100 Gamma at a tenth."""
    times, off = np.linspace(0, 10, 4001), []
    expected = reference_response(times)
    for Gamma in (1e3, 1e5):
        response = nlctl.input_output_response(loop_of(Gamma), times, rtol=1e-8, atol=1e-10)
        off.append(np.abs(response.outputs[:3] - expected).max(axis=1))
    assert np.all(off[0] < 0.3)
    assert np.all(off[1] < 0.15 * off[0])


def rohrs(controller):
    """2 / (s + 1) and what nobody has modelled, at its phase crossover."""
    plant = ct.tf([2 * 229], np.polymul([1, 1], [1, 30, 229]))
    plant = ct.ss(plant, inputs="v", outputs="x1", name="plant")
    command = nlctl.SumOfSines(
        order=0, amplitudes=(0.3, 1.85), frequencies=(0.0, 16.1), phases=(np.pi / 2, 0.0)
    )
    blocks = {"command": command, "plant": plant, "controller": controller, "a": nlctl.Gain()}
    return nlctl.interconnect(blocks, outputs=["x1", "W_norm"])


def rohrs_mrac(weights):
    model, error = (
        nlctl.controllers.ReferenceModel(a=(3.0,), b=3.0),
        nlctl.controllers.ModelError(K=(3.0,), Q=(6.0,)),
    )
    loop = rohrs(nlctl.mrac(model, error=error, weights=weights, law=nlctl.controllers.DirectLaw()))
    start = {"controller.weights.W_hat[0]": 0.65, "controller.weights.W_hat[1]": -1.14}
    return loop, nlctl.initial_state(loop, start)


@pytest.mark.slow
@each_row(
    ("weights", "holds"),
    [
        (nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=1.0, sigma_1=0.0), False),
        (nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=1.0, sigma_1=0.03), False),
        (nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=1.0, sigma_1=0.1), False),
        (nlctl.controllers.ProjectedWeights(nodes=2, Gamma=1.0, W_max=15.0), True),
        (nlctl.controllers.ProjectedWeights(nodes=2, Gamma=1.0, W_max=20.0), False),
    ],
)
def test_rohrs_plant_under_mrac_is_lost_unless_a_ball_keeps_the_gain_below_17(weights, holds):
    """By Routh the loop is stable up to the gain 7800 / 458 = 17.03."""
    loop, start = rohrs_mrac(weights)
    times = np.linspace(0, 200, 401)
    if holds:
        response = nlctl.input_output_response(loop, times, 0, start)
        assert np.abs(response.outputs[0]).max() < 5
        return
    try:
        response = nlctl.input_output_response(loop, times, 0, start)
    except nlctl.errors.DivergedError:
        return
    assert np.abs(response.outputs[0]).max() > 1e6  # a linear loop grows and stays finite for long


def test_rohrs_plant_under_l1_adaptive_control_stays():
    """The filter passes 0.30 of 16.1 rad/s; the estimates stay in their ball."""
    controller = nlctl.l1_adaptive(
        nlctl.controllers.StatePredictor(a=(3.0,), gain=3.0),
        weights=nlctl.controllers.ProjectedWeights(nodes=2, Gamma=1000.0, W_max=10.0),
        law=nlctl.controllers.FilteredLaw(omega=5.0, b=3.0, gain=3.0),
    )
    response = nlctl.input_output_response(rohrs(controller), np.linspace(0, 60, 3001))
    assert np.abs(response.outputs[0]).max() < 0.6
    assert response.outputs[1].max() <= 10.0 * (1 + 1e-6)


@each_row(
    ("make", "told"),
    [
        (lambda: nlctl.controllers.StatePredictor(a=(-1.0, 2.0)), "StatePredictor needs a Hurwitz"),
        (
            lambda: nlctl.controllers.StatePredictor(gain=0.0),
            "StatePredictor needs a gain other than 0",
        ),
        (lambda: nlctl.controllers.FilteredLaw(gain=0.0), "FilteredLaw needs a gain other than 0"),
        (
            lambda: nlctl.l1_adaptive(law=nlctl.controllers.FilteredLaw(gain=2.0)),
            "one gain .*, got 1 and 2",
        ),
        (
            lambda: nlctl.l1_adaptive(weights=nlctl.controllers.ProjectedWeights(nodes=9)),
            "nodes=9 for 3",
        ),
    ],
)
def test_pieces_of_l1_adaptive_control_that_do_not_fit_are_refused(make, told):
    """The culprit, the rule and the values."""
    with pytest.raises(nlctl.errors.ParameterError, match=told):
        make()
