"""Model reference adaptive control: Lyapunov functions, invariant balls, and parameter drift."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.params import equation_arguments

numbers = st.floats(-3, 3)
vectors = st.lists(numbers, min_size=3, max_size=3).map(np.array)
positive = st.floats(0.1, 5)
TRUE = np.array([1.5, -0.8, 0.6])
GAMMA, SIGMA, GAIN = 2.0, 0.1, 3.0
WEIGHTS = {
    "gradient": nlctl.controllers.AdaptiveWeights(nodes=3, Gamma=GAMMA, sigma_1=0.0),
    "sigma": nlctl.controllers.AdaptiveWeights(nodes=3, Gamma=GAMMA, sigma_1=SIGMA),
    "e": nlctl.controllers.EModifiedWeights(nodes=3, Gamma=GAMMA, sigma=SIGMA),
    "projection": nlctl.controllers.ProjectedWeights(nodes=3, Gamma=GAMMA, W_max=2.0, width=0.1),
}
COMMAND = nlctl.SumOfSines(order=0, amplitudes=1.0, frequencies=0.7, phases=0.0)


def rate(spec, W_hat, r, psi):
    u = np.concatenate([[r], psi])
    return np.array(spec.update(0.0, np.asarray(W_hat, float), u, equation_arguments(spec)))


@nlctl.equation
def linear_uncertainty(x, v):
    """W^T (x1, x2, 0) + 3 v; the weight of the command has nothing to cancel."""
    x1, x2 = x
    return 1.5 * x1 - 0.8 * x2 + 3.0 * v


def loop_of(weights, *, d=None, K=(4.0, 2.0)):
    extra = {} if d is None else {"d": d}
    plant = nlctl.PureFeedback(order=2, f=linear_uncertainty, initial={"x1": 0.6}, **extra)
    controller = nlctl.mrac(
        error=nlctl.controllers.ModelError(K=K, Q=(1.0, 2.0)),
        weights=weights,
        law=nlctl.controllers.ModelReferenceLaw(gain=GAIN),
    )
    blocks = {"command": COMMAND, "plant": plant, "controller": controller, "a": nlctl.Gain()}
    return nlctl.interconnect(blocks, outputs=["e", "r", "u", "W_norm"])


def run_of(loop, times, **options):
    """Return E = x - xm, W_hat and r over time."""
    response = nlctl.input_output_response(loop, times, rtol=1e-10, atol=1e-12, **options)
    states = dict(zip(nlctl.state_names(loop), response.states, strict=True))
    E = np.array([states[f"plant.x{i}"] - states[f"controller.model.xm{i}"] for i in (1, 2)])
    W_hat = np.array([states[f"controller.weights.W_hat[{i}]"] for i in range(3)])
    return E, W_hat, response.outputs[1]


def what_modification_adds(label, W_hat, off, r):
    """V' + E^T Q E of each law by hand: 2 (W_hat - W)^T (what it adds to r psi)."""
    inwards = np.sum(off * W_hat, axis=0)
    return {"gradient": 0 * r, "sigma": -2 * SIGMA * inwards, "e": -2 * SIGMA * abs(r) * inwards}[
        label
    ]


@given(vectors, positive, positive, positive, positive)
def test_the_error_is_weighted_by_the_solution_of_the_lyapunov_equation(E, k, c, q_1, q_2):
    """Order 2 by hand: P_12 = Q_1 / (2 K_1), P_22 = (Q_2 + 2 P_12) / (2 K_2), r = b^T P E."""
    spec = nlctl.controllers.ModelError(K=(k, c), Q=(q_1, q_2))
    P_12 = q_1 / (2 * k)
    P_22 = (q_2 + 2 * P_12) / (2 * c)
    u = np.array([E[0] + 0.5, E[1] - 0.2, 0.5, -0.2])
    e, r, nu_e, norm = spec.output(0.0, np.empty(0), u, equation_arguments(spec))
    assert r == pytest.approx(P_12 * E[0] + P_22 * E[1], rel=1e-7, abs=1e-7)
    assert e == pytest.approx(E[0], abs=1e-12)
    assert nu_e == pytest.approx(-k * E[0] - c * E[1], abs=1e-12)
    assert norm == pytest.approx(np.hypot(E[0], E[1]), abs=1e-12)


@each_row("label", ["gradient", "sigma", "e"])
@each_row("K", [(4.0, 2.0), (1.5, 1.3)])
def test_the_lyapunov_function_changes_as_the_proof_says(label, K):
    """V = E^T P E + |W_hat - W|^2 / Gamma: V(T) - V(0) is the integral of V' by hand."""
    times = np.linspace(0, 10, 20_001)
    E, W_hat, r = run_of(loop_of(WEIGHTS[label], K=K), times)
    P, true = (
        nlctl.controllers.ModelError(K=K, Q=(1.0, 2.0)).lyapunov_matrix,
        np.array([[1.5], [-0.8], [0.0]]),
    )
    off = W_hat - true
    V = np.einsum("it,ij,jt->t", E, P, E) + np.sum(off**2, axis=0) / GAMMA
    derivative = -(E[0] ** 2) - 2 * E[1] ** 2 + what_modification_adds(label, W_hat, off, r)
    assert V[-1] - V[0] == pytest.approx(np.trapezoid(derivative, times), abs=1e-6)
    if label == "gradient":
        assert np.all(np.diff(V) <= 1e-12)


@given(vectors, vectors, numbers, vectors, st.floats(0, 1))
def test_projection_never_works_against_the_gradient(W_hat, psi, r, target, share):
    """(W_hat - W*)^T (Proj(W_hat, y) - y) <= 0 for W* with f(W*) <= 0."""
    spec = WEIGHTS["projection"]
    inner = spec.W_max / np.sqrt(1 + spec.width)
    W_star = target / max(np.linalg.norm(target), 1e-9) * inner * share
    difference = rate(spec, W_hat, r, psi) / GAMMA - r * psi
    assert (W_hat - W_star) @ difference <= 1e-9 * (1 + np.abs(difference).max())


@given(vectors, vectors, numbers)
def test_on_the_ball_the_projected_rate_does_not_leave_it(W_hat, psi, r):
    """At |W_hat| = W_max, W_hat^T W_hat' <= 0; well inside it is the gradient's."""
    spec, size = WEIGHTS["projection"], np.linalg.norm(W_hat)
    on = (W_hat + [1e-3, 0, 0]) / max(np.linalg.norm(W_hat + [1e-3, 0, 0]), 1e-9) * spec.W_max
    assert on @ rate(spec, on, r, psi) <= 1e-9
    if size <= spec.W_max / np.sqrt(1 + spec.width):
        np.testing.assert_allclose(
            rate(spec, W_hat, r, psi), GAMMA * r * psi, rtol=1e-14, atol=1e-300
        )


@given(vectors, vectors, st.floats(-50, 50))
def test_e_modification_stays_in_its_ball_and_stands_without_error(W_hat, psi, r):
    """|W_hat| >= |psi| / sigma: W_hat^T W_hat' <= 0; r = 0: W_hat' = 0, where sigma forgets."""
    far = W_hat + 1e-3
    far = far / np.linalg.norm(far) * (np.linalg.norm(psi) / SIGMA + 1)
    assert far @ rate(WEIGHTS["e"], far, r, psi) <= 1e-9
    np.testing.assert_array_equal(rate(WEIGHTS["e"], W_hat, 0.0, psi), 0.0)
    np.testing.assert_allclose(rate(WEIGHTS["sigma"], W_hat, 0.0, psi), -GAMMA * SIGMA * W_hat)


def test_the_ball_is_invariant_for_every_member_of_an_ensemble():
    """Starts, true gains and disturbances that push outwards: no weight leaves |W_hat| <= W_max."""

    @nlctl.equation
    def d(x, t):
        return 4.0 + 2.0 * np.sin(3 * t)

    rng, size = np.random.default_rng(5), 32
    loop = loop_of(WEIGHTS["projection"], d=d)
    params = {"law.gain": rng.uniform(2, 4, size), "weights.Gamma": rng.uniform(0.5, 20, size)}
    start = {
        "plant.x1": rng.normal(size=size),
        "controller.weights.W_hat[0]": rng.uniform(-1, 1, size),
    }
    many = nlctl.ensemble_response(
        loop, np.linspace(0, 20, 401), 0, start, params=params, keep=["W_norm"]
    )
    norms = many.signals["W_norm"]
    assert np.isfinite(norms).all()
    assert norms.max() <= 2.0 * (1 + 1e-6)
    assert norms.max() > 1.99  # they were pushed


@each_row(
    ("make", "told"),
    [
        (
            lambda: nlctl.controllers.ReferenceModel(a=(-1.0, 2.0)),
            "ReferenceModel needs a Hurwitz .*-1",
        ),
        (lambda: nlctl.controllers.ModelError(K=(1.0, -2.0)), "ModelError needs a Hurwitz .*-2"),
        (lambda: nlctl.controllers.ModelError(K=(1.0,)), "as many Q as K, got 2 of Q and 1 of K"),
        (lambda: nlctl.controllers.ModelReferenceLaw(gain=0.0), "needs a gain other than 0"),
        (
            lambda: nlctl.mrac(error=nlctl.controllers.ModelError(K=(1.0,), Q=(1.0,))),
            "got 1 of K and 2 of a",
        ),
        (
            lambda: nlctl.mrac(weights=nlctl.controllers.AdaptiveWeights(nodes=4)),
            "got nodes=4 for 3",
        ),
    ],
)
def test_pieces_that_do_not_fit_are_refused(make, told):
    """The culprit, the rule and the values."""
    with pytest.raises(nlctl.errors.ParameterError, match=told):
        make()


def test_direct_mrac_finds_gains_for_an_unknown_input_gain():
    """x' = 2 x + 0.5 u after xm' = -3 xm + 3 yd: the gains that match are k_x = 10, k_r = -6."""

    @nlctl.equation
    def unstable(x, v):
        return 2.0 * x[0] + 0.5 * v

    controller = nlctl.mrac(
        nlctl.controllers.ReferenceModel(a=(3.0,), b=3.0),
        weights=nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=20.0, sigma_1=0.0),
        law=nlctl.controllers.DirectLaw(),
    )
    command = nlctl.SumOfSines(
        order=0, amplitudes=(1.0, 1.0), frequencies=(1.0, 3.0), phases=(0.0, 1.0)
    )
    blocks = {"command": command, "plant": nlctl.PureFeedback(order=1, f=unstable)}
    loop = nlctl.interconnect(
        {**blocks, "controller": controller, "a": nlctl.Gain()}, outputs=["e"]
    )
    response = nlctl.input_output_response(loop, np.linspace(0, 120, 1201))
    states = dict(zip(nlctl.state_names(loop), response.states[:, -1], strict=True))
    found = [states[f"controller.weights.W_hat[{i}]"] for i in (0, 1)]
    assert found == pytest.approx([10.0, -6.0], rel=1e-2)
    assert np.abs(response.outputs[0][-100:]).max() < 1e-2
