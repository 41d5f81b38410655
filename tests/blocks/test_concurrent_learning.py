"""Wing rock and concurrent learning: recorded points, and weights that converge without more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy.linalg import expm

import nlctl
from nlctl.params import equation_arguments

W = np.array([0.8, 0.2314, 0.6918, -0.6245, 0.0095, 0.0214])  # as published
L = 3.0
numbers = st.floats(-3, 3)
vectors = st.lists(numbers, min_size=3, max_size=3).map(np.array)
samples = st.lists(st.tuples(vectors, numbers, numbers), min_size=1, max_size=12)


def wing_rock(weights, *, command=0.0, **pieces):
    """Return wing rock under MRAC with the gains of Chowdhary and Johnson."""
    still = nlctl.SumOfSines(order=0, amplitudes=command, frequencies=0.0, phases=np.pi / 2)
    controller = {
        "model": nlctl.controllers.ReferenceModel(a=(4.0, 2.0), b=4.0),
        "error": nlctl.controllers.ModelError(K=(1.5, 1.3), Q=(1.0, 1.0)),
        "basis": nlctl.controllers.WingRockRegressor(),
        "weights": weights,
        "law": nlctl.controllers.ModelReferenceLaw(gain=L),
    }
    plant = {"command": still, "plant": nlctl.plants.WingRock(), "actuator": nlctl.Gain()}
    sums = [f"Omega[{i},{j}]" for i in range(6) for j in range(6)] if pieces else []
    return nlctl.interconnect({**plant, **controller, **pieces}, outputs=["e", "u", *sums])


def with_history(*, command=0.0, **changes):
    stack = nlctl.sampled(nlctl.controllers.HistoryStack(gain=L, **changes), 0.05)
    return wing_rock(nlctl.controllers.ConcurrentWeights(Gamma=5.0), command=command, stack=stack)


def states_of(loop, response):
    return dict(zip(nlctl.state_names(loop), response.states, strict=True))


def weights_of(loop, response):
    states = states_of(loop, response)
    return np.array([states[f"weights.W_hat[{i}]"] for i in range(W.size)])


@given(samples, st.floats(0.0, 1.0), st.integers(1, 6))
def test_the_stack_holds_the_sums_over_the_points_that_it_took(taken, novelty, points):
    """Step by step against a list of points that is summed by NumPy."""
    spec = nlctl.controllers.HistoryStack(nodes=3, gain=2.0, points=points, novelty=novelty)
    p, x, kept = equation_arguments(spec), np.zeros(len(spec.states)), []
    for psi, derivative, u in taken:
        last = kept[-1][0] if kept else np.zeros(3)
        if len(kept) < points and np.sum((psi - last) ** 2) >= novelty**2 * np.sum(psi**2):
            kept.append((psi, derivative - 2.0 * u))
        x = np.array(spec.update(0.0, x, np.array([*psi, derivative, u]), p))
    count, *sums = spec.output(0.0, x, np.zeros(5), p)
    assert count == len(kept)
    z = sum((psi * Delta for psi, Delta in kept), np.zeros(3))
    Omega = sum((np.outer(psi, psi) for psi, _ in kept), np.zeros((3, 3)))
    np.testing.assert_allclose(sums, [*z, *Omega.ravel()], atol=1e-12)


@given(samples, vectors, numbers, vectors)
def test_the_law_is_the_sum_over_recorded_errors(taken, W_hat, r, psi):
    """Gamma (r psi + sum_j psi_j (Delta_j - W_hat^T psi_j)), point by point."""
    points = [(psi_j, Delta) for psi_j, Delta, _ in taken]
    z = sum((psi_j * Delta for psi_j, Delta in points), np.zeros(3))
    Omega = sum((np.outer(psi_j, psi_j) for psi_j, _ in points), np.zeros((3, 3)))
    spec = nlctl.controllers.ConcurrentWeights(nodes=3, Gamma=2.0)
    u = np.array([r, *psi, *z, *Omega.ravel()])
    by_hand = r * psi + sum(psi_j * (Delta - W_hat @ psi_j) for psi_j, Delta in points)
    found = spec.update(0.0, W_hat, u, equation_arguments(spec))
    np.testing.assert_allclose(found, 2.0 * by_hand, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
@each_row("command", [0.0, 1.0])
def test_weights_converge_with_recorded_points_and_do_not_without(command):
    """A constant command excites nothing at last: MRAC tracks with other weights than W."""
    times = np.linspace(0, 60, 601)
    plain = wing_rock(
        nlctl.controllers.AdaptiveWeights(nodes=6, Gamma=5.0, sigma_1=0.0), command=command
    )
    run = nlctl.input_output_response(plain, times)
    assert np.abs(run.outputs[0][-100:]).max() < 1e-6
    assert np.abs(weights_of(plain, run)[:, -1] - W).max() > 0.5
    loop = with_history(command=command)
    run = nlctl.input_output_response(loop, times)
    assert np.abs(run.outputs[0][-100:]).max() < 1e-6
    np.testing.assert_allclose(weights_of(loop, run)[:, -1], W, atol=1e-3)


def test_the_lyapunov_function_decays_by_the_recorded_points_too():
    """V = E^T P E + |W_hat - W|^2 / Gamma: V' = -E^T Q E - 2 (W_hat - W)^T Omega (W_hat - W)."""
    loop, times = with_history(points=30), np.linspace(0, 5, 10_001)
    response = nlctl.input_output_response(loop, times, rtol=1e-10, atol=1e-12)
    states = states_of(loop, response)
    E = np.array([states[f"plant.x{i}"] - states[f"model.xm{i}"] for i in (1, 2)])
    off = weights_of(loop, response) - W[:, None]
    Omega = response.outputs[2:].reshape(6, 6, -1)
    P = nlctl.controllers.ModelError(K=(1.5, 1.3), Q=(1.0, 1.0)).lyapunov_matrix
    V = np.einsum("it,ij,jt->t", E, P, E) + np.sum(off**2, axis=0) / 5.0
    learning = np.einsum("it,ijt,jt->t", off, Omega, off)
    assert np.all(np.diff(V) <= 1e-9)
    rate = -np.sum(E**2, axis=0) - 2 * learning
    changed = V[-1] - V[0]
    assert changed == pytest.approx(np.trapezoid(rate, times), rel=2e-2)  # Omega jumps at samples
    assert np.trapezoid(2 * learning, times) > 0.1 * abs(changed)


def test_wing_rock_without_its_nonlinear_terms_is_linear():
    """w_3 = w_4 = w_5 = 0: the matrix exponential, with the constant w_0 as a third state."""
    plant = nlctl.block(nlctl.plants.WingRock(w=(*W[:3], 0.0, 0.0, 0.0)), "plant")
    times = np.linspace(0, 2, 21)
    response = nlctl.input_output_response(plant, times, 0.3, rtol=1e-10, atol=1e-12)
    A = np.array([[0, 1, 0], [W[1], W[2], W[0] + L * 0.3], [0, 0, 0]])
    expected = np.array([(expm(A * t) @ [1.2, 1.0, 1.0])[:2] for t in times]).T
    np.testing.assert_allclose(response.states, expected, rtol=1e-7)
    sensor = A[1, :2] @ response.states + A[1, 2]
    np.testing.assert_allclose(response.outputs[3], sensor, rtol=1e-9)


def test_six_weights():
    """The form of the regressor is fixed."""
    with pytest.raises(nlctl.errors.ParameterError, match="WingRock needs 6 weights w, got 2"):
        nlctl.plants.WingRock(w=(1.0, 2.0))
