"""Bounds of model reference adaptive control against closed forms and another way to them."""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from examples import many
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st
from mrac_loops import (
    e_modification,
    first_order,
    half_sine,
    projection,
    sigma,
    unstable,
    wing_rock,
)

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.lyapunov.model_reference.quadratic_form import quadratic_form
from nlctl.errors import DiagramError, ParameterError

W, D = 2.0, 0.5  # of the plant x' = 2 x + v + 0.5 sin t


def disturbed(size):
    return nlctl.equation(lambda x, t: size * np.sin(t))


def largest_energy(inequality, Gamma, P, span=8.0, count=801):
    """The largest P e^2 + (W_hat - W)^2 / Gamma at which V' > 0 for some |d| <= D, by a grid."""
    own = np.geomspace(1e-4, span, count)
    e, W_hat, d = np.meshgrid(own, np.linspace(-span, span, count), [-D, D], indexing="ij")
    V = P * e * e + (W_hat - W) ** 2 / Gamma
    return float(V[inequality(e, W_hat, d) > 0].max())


@pytest.mark.parted
@pytest.mark.parametrize(("Gamma", "sigma_1"), [(5.0, 0.2), (2.0, 0.1), (20.0, 0.5), (1.0, 3.0)])
def test_sigma_modification_is_at_most_completed_squares(Gamma, sigma_1):
    """V <= c max(1/k, 1/(Gamma sigma)), c = P D^2/k + sigma W^2; equal where k = Gamma sigma."""
    found = certify(first_order(sigma(sigma_1, Gamma), d=half_sine))
    known = (0.5 * D**2 + sigma_1 * W**2) * max(1.0, 1 / (Gamma * sigma_1))
    ultimate = found.alpha_0 / found.alpha_1
    assert found.holds
    assert ultimate <= known * (1 + 1e-6)
    if Gamma * sigma_1 == 1:
        assert ultimate == pytest.approx(known, rel=1e-6)
    assert found.ultimate == pytest.approx(np.sqrt(2 * ultimate), rel=1e-9)


@pytest.mark.parametrize(("Gamma", "sigma_1"), [(5.0, 0.2), (2.0, 0.1), (20.0, 0.5)])
def test_sigma_modification_is_the_largest_energy_where_it_can_rise(Gamma, sigma_1):
    """Two ways to one number: the rate that is best, and V' of the loop on a grid."""

    def rate(e, W_hat, d):  # Q = 1, P = 1/2
        return -e * e + e * d - 2 * sigma_1 * (W_hat - W) * W_hat

    found = certify(first_order(sigma(sigma_1, Gamma), d=half_sine))
    ultimate, grid = found.alpha_0 / found.alpha_1, largest_energy(rate, Gamma, 0.5)
    assert grid <= ultimate <= 1.03 * grid


@pytest.mark.parametrize(("Gamma", "own"), [(5.0, 0.2), (2.0, 0.5), (10.0, 1.0)])
def test_e_modification_is_the_largest_energy_where_it_can_rise(Gamma, own):
    def rate(e, W_hat, d):
        return -e * e + e * d - own * np.abs(e) * (W_hat - W) * W_hat  # 2 |r| = |e|

    found = certify(first_order(e_modification(own, Gamma), d=half_sine))
    grid = largest_energy(rate, Gamma, 0.5)
    assert grid <= found.ultimate**2 / 2 <= 1.03 * grid


def test_projection_has_the_closed_form():
    """(W_max + |W|)^2 / Gamma + 4 q D^2 / mu with q = P^2 and mu = 2."""
    found = certify(first_order(projection(2.5), d=half_sine))
    assert pytest.approx(4.5**2 / 5 + 4 * 0.25 * D**2 / 2, rel=1e-9) == found.V_max
    assert found.region.W_hat == pytest.approx(2.5)
    assert found.ultimate_W_error == pytest.approx(4.5)


@pytest.mark.parametrize("weights", [sigma(), e_modification(), projection()])
def test_the_root_mean_square_does_not_depend_on_Gamma(weights):  # noqa: N802
    """Of sigma-modification a + (a^2 + b)^(1/2), a = q^(1/2) D, b = sigma W^2 / 2."""
    faster = type(weights)(**{**vars(weights), "Gamma": 500.0})
    slow, fast = (certify(first_order(w, d=half_sine)) for w in (weights, faster))
    assert slow.rms == pytest.approx(fast.rms, rel=1e-7)
    assert fast.ultimate < slow.ultimate
    a, h = 0.5 * D, 2 * D + 0.2 * W**2 / 2
    known = {
        nlctl.controllers.AdaptiveWeights: a + np.sqrt(a * a + 0.2 * W**2 / 2),
        nlctl.controllers.EModifiedWeights: 0.5 * h,
        nlctl.controllers.ProjectedWeights: 2 * a,
    }
    assert slow.rms == pytest.approx(known[type(weights)], rel=1e-7)


@pytest.mark.slow
def test_what_becomes_of_it_without_a_disturbance():
    """V ends below |W|^2/Gamma with sigma-modification, whatever sigma is; e -> 0 without any."""
    for own in (0.2, 0.02, 0.002):
        found = certify(first_order(sigma(own)))
        assert found.alpha_0 / found.alpha_1 == pytest.approx(W**2 / 5, rel=1e-6)
        assert found.rms == pytest.approx(np.sqrt(own * W**2 / 2), rel=1e-9)
    for weights in (sigma(0.0), e_modification(0.0), projection()):
        found = certify(first_order(weights))
        assert found.holds
        assert found.ultimate == found.rms == 0.0
        assert found.V_max == pytest.approx(found.V_0, rel=1e-12)


@pytest.mark.slow
def test_the_bound_is_linear_in_the_disturbance_where_nothing_is_to_be_learned():
    """x' = v + d, so that W = 0: e <= 2 q^(1/2) D (mu P)^(-1/2) = D / k."""
    plain = nlctl.equation(lambda x, v: 1.0 * v)
    for size in (1.0, 1e-3, 1e-6):
        found = certify(first_order(sigma(2.0), f=plain, d=disturbed(size), k=3.0))
        assert found.W == (0.0, 0.0)
        assert found.ultimate == pytest.approx(size / 3, rel=1e-3)


def test_it_grows_as_one_over_sigma_where_weights_drift_slowly():
    """For sigma -> 0 the bound of V is q D^2 / (2 Gamma sigma) and more: drift in the end."""
    levels = [certify(first_order(sigma(own), d=half_sine)).V_max for own in (1e-6, 1e-7)]
    assert levels[0] >= 0.25 * D**2 / (2 * 5 * 1e-6)
    assert levels[1] / levels[0] == pytest.approx(10, rel=0.05)


@pytest.mark.parametrize("weights", [sigma(0.0), e_modification(0.0)])
def test_without_modification_and_with_a_disturbance_the_weights_may_drift(weights):
    """The gallery has the disturbance that drives them to infinity."""
    found = certify(first_order(weights, d=half_sine))
    assert not found.holds
    assert "parameter drift" in found.reason
    assert "may be 0.5" in found.reason
    assert np.inf == found.e == found.ultimate == found.W_error == found.rms == found.u_max


def test_weights_that_match_are_exact():
    """lambda W is what the law's own feedback and the regressor leave of the plant's equation."""
    match = certify(wing_rock(sigma(0.1, nodes=6))).matching
    assert tuple(map(Fraction, nlctl.plants.WingRock().w)) == match.W
    assert not match.rest.terms
    assert match.lam == 1


def test_an_input_gain_that_the_law_takes_for_another():
    """x' = 2 x + 4 v and a law with gain 1: lambda = 4, and 4 W = (2 - 3 k, 3 b) match."""
    f = nlctl.equation(lambda x, v: 2.0 * x[0] + 4.0 * v)
    found = certify(first_order(sigma(0.2), f=f, k=3.0, b=3.0))
    assert found.matching.lam == 4
    assert found.W == ((2 - 3 * 3) / 4, 3 * 3 / 4)
    assert not found.matching.rest.terms


def test_direct_adaptive_control_has_its_gains():
    """The gallery's plant x' = 2 x + 0.5 v: 10 and -6, and lambda = 0.5."""
    f = nlctl.equation(lambda x, v: 2.0 * x[0] + 0.5 * v)
    found = certify(
        first_order(sigma(0.0, 20.0), f=f, k=3.0, b=3.0, law=nlctl.controllers.DirectLaw())
    )
    assert found.holds
    assert found.W == (10.0, -6.0)
    assert found.matching.lam == Fraction(1, 2)


@pytest.mark.slow
def test_a_function_that_a_network_does_not_span_is_bounded_on_the_box():
    """sin 2x is below 1, cos x below 1: D is at most what is left of both, by branch and bound."""
    f = nlctl.equation(lambda x, v: np.sin(2 * x[0]) + 0.1 * np.cos(x[0]) + v)
    basis = nlctl.controllers.GaussianBasis(centres=((-1.0,), (0.0,), (1.0,)), widths=(1.0,))
    plant = nlctl.PureFeedback(order=1, f=f, initial={"x1": 1.2})
    loop = first_order(sigma(0.1, 50.0, nodes=3), plant=plant, basis=basis, k=4.0)
    found = certify(loop)
    assert found.holds
    assert found.W == (0.0, 0.0, 0.0)
    assert 1.0 < found.region.rest <= 1.1
    better = certify(loop, W=(-0.9, 0.0, 0.9))
    assert better.region.rest < 0.5 * found.region.rest
    assert better.W == (-0.9, 0.0, 0.9)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(("K", "closes"), [((1.5, 1.3), False), ((25.0, 10.0), True)])
def test_a_network_of_wing_rock_needs_a_strong_model(K, closes):
    """As the page on rivals says: with W = 0 the whole plant is a disturbance on the box."""
    basis = nlctl.controllers.GaussianBasis(
        centres=nlctl.controllers.grid_centres([5, 5], -2, 2), widths=(1.0,)
    )
    error = nlctl.controllers.ModelError(K=K, Q=(K[0], 1.0))
    loop = wing_rock(sigma(0.01, 50.0, nodes=25), basis=basis, error=error)
    found = certify(loop, tol=0.05)
    assert found.holds is closes
    if not closes:
        assert "the box does not close" in found.reason
        return
    assert found.ultimate < 0.53
    t = np.linspace(0, 40, 4001)
    run = nlctl.input_output_response(loop, t)
    e, u = (np.abs(run.outputs[run.output_labels.index(label)]) for label in ("e", "u"))
    assert e.max() <= found.e
    assert u.max() <= found.u_max
    assert e[t > 20].max() <= found.ultimate


def test_a_plant_that_is_not_affine_in_its_input():
    """x' = 2 x + v + 0.2 sin v + 0.5 sin t: at most 0.2 more."""
    f = nlctl.equation(lambda x, v: 2.0 * x[0] + v + 0.2 * np.sin(v))
    found = certify(first_order(sigma(), f=f, d=half_sine))
    assert found.holds
    assert pytest.approx(0.7, rel=1e-2) == found.region.D


def test_a_disturbance_without_a_bound_for_all_times_is_told():
    """Of (1 + t)^(-1/5) intervals know none, as they know no half line."""
    fading = nlctl.equation(lambda x, t: 0.2 * (1 + t) ** -0.2)
    found = certify(first_order(sigma(), d=fading))
    assert not found.holds
    assert "bounded for all t" in found.reason


def test_a_box_that_does_not_close_proves_nothing():
    """x^3, which the regressor lacks, against a weak model."""
    f = nlctl.equation(lambda x, v: x[0] ** 3 + 2.0 * x[0] + v)
    found = certify(first_order(sigma(), f=f, d=half_sine))
    assert not found.holds
    assert "the box does not close" in found.reason


@pytest.mark.parametrize(
    ("actuator", "added"),
    [
        (nlctl.Gain(k=1.0), 0.0),
        (nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.4, c_l=-0.4), 0.4),
        (nlctl.DeadZone(ripple_r=0.0, ripple_l=0.0, slope_l=1.0, b_r=0.3, b_l=-0.2), 0.3),
    ],
)
def test_an_actuator_adds_its_remainder_to_the_disturbance(actuator, added):
    """v = u + eps_u is matched: D = 0.5 + eps_u*."""
    found = certify(first_order(sigma(), d=half_sine, actuator=actuator))
    assert found.holds
    assert pytest.approx(0.5 + added, rel=1e-6) == found.region.D


def test_slopes_that_differ_add_what_they_may_add_to_the_largest_input():
    """Of the dead zone with slopes 1 and 0.98: half their difference times sup |u|."""
    zone = nlctl.DeadZone(ripple_r=0.0, ripple_l=0.0, slope_l=0.98, b_r=0.1, b_l=-0.1)
    found = certify(first_order(sigma(), d=half_sine, actuator=zone))
    need, split = found.region, found.split
    assert found.holds
    assert split.k_1 < split.k_2
    known = need.rest + float(found.matching.beta) * (
        split.eps_star + (split.k_2 - split.k_1) / 2 * need.u
    )
    assert pytest.approx(known, rel=1e-9) == need.D


def test_an_external_input_adds_its_bound():
    found = certify(first_order(sigma(), inputs=["w"]), inputs={"w": 0.5})
    same = certify(first_order(sigma(), d=half_sine))
    assert found.V_max == pytest.approx(same.V_max, rel=1e-3)
    assert {c.symbol: c.provenance for c in found.constants}["sup |w|"] == "given"
    with pytest.raises(DiagramError, match="'w' is added to the plant's v, and may be anything"):
        certify(first_order(sigma(), inputs=["w"]))


def test_a_ball_that_the_weights_are_not_in_proves_nothing():
    found = certify(first_order(projection(1.5), d=half_sine))
    assert not found.holds
    assert "raise W_max" in found.reason


def test_another_sign_of_both_gains_is_as_good():
    """x' = 2 x - 4 v and a law that divides by -4."""
    f = nlctl.equation(lambda x, v: 2.0 * x[0] - 4.0 * v)
    one, other = certify(first_order(sigma(), f=f, gain=-4.0)), certify(first_order(sigma()))
    assert one.V_max == other.V_max
    assert one.u_max == pytest.approx(other.u_max / 4)


@pytest.mark.slow
def test_names_and_nesting_do_not_matter():
    """The controller as `nlctl.mrac` makes it, and the blocks by themselves."""
    flat = certify(first_order(sigma(), d=half_sine))
    blocks = {
        "command": nlctl.SumOfSines(order=3, amplitudes=0.0, frequencies=1.0, phases=0.0),
        "airframe": nlctl.PureFeedback(order=1, f=unstable, d=half_sine),
        "autopilot": nlctl.mrac(nlctl.controllers.ReferenceModel(a=(1.0,), b=0.0), weights=sigma()),
        "ailerons": nlctl.Gain(),
    }
    nested = nlctl.interconnect(blocks, outputs=["x1"], name="aircraft")
    assert certify(nested).V_max == flat.V_max
    assert certify(nested, params={"autopilot.weights.sigma_1": 0.4}).V_max != flat.V_max


@pytest.mark.parted
@pytest.mark.parametrize("name", ["weights.Gamma", "error.Q", "model.b", "law.gain"])
def test_each_parameter_of_the_run_is_the_one_of_the_proof(name):
    """As if the blocks had been made with it."""
    part, field = name.split(".")
    value = (3.0,) if field == "Q" else 3.0
    records = {
        "weights": sigma(), "error": nlctl.controllers.ModelError(K=(1.0,), Q=(1.0,)),
        "model": nlctl.controllers.ReferenceModel(a=(1.0,), b=0.0),
        "law": nlctl.controllers.ModelReferenceLaw(gain=1.0),
    }  # fmt: skip
    one = certify(first_order(d=half_sine, **records), params={name: value})
    records[part] = dataclasses.replace(records[part], **{field: value})
    other = certify(first_order(d=half_sine, **records))
    assert str(one) == str(other)


def test_parameters_of_the_run_are_those_of_the_proof():
    changed = certify(first_order(sigma(), d=half_sine), params={"weights.sigma_1": 0.4})
    same = certify(first_order(sigma(0.4), d=half_sine))
    assert changed.V_max == same.V_max != certify(first_order(sigma(), d=half_sine)).V_max


def test_weights_of_ones_own_choice():
    """Any W is good for a proof; W = 0 leaves 2 x, which a strong model holds."""
    chosen = certify(first_order(sigma(2.0, 50.0), d=half_sine, k=9.0), W=(0.0, 0.0))
    assert chosen.holds
    assert chosen.W == (0.0, 0.0)
    assert {c.symbol: c.provenance for c in chosen.constants}["|W|"] == "given"
    with pytest.raises(ParameterError, match="one weight for each of 2 regressors, got 3"):
        certify(first_order(sigma()), W=(1.0, 2.0, 3.0))
    with pytest.raises(ParameterError, match="with a reference model only"):
        certify(nlctl.paper.example_1(), W=(1.0,))


@settings(max_examples=many(50), deadline=None)
@given(
    poles=st.lists(st.floats(0.2, 5.0), min_size=1, max_size=3),
    Q=st.lists(st.floats(0.1, 10.0), min_size=3, max_size=3),
    x=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
)
def test_the_quadratic_form_is_a_lyapunov_function(poles, Q, x):
    """mu, q and the bounds of the errors, against floating point at points."""
    K = np.poly(-np.array(poles))[:0:-1]
    error = nlctl.controllers.ModelError(K=tuple(map(float, K)), Q=tuple(Q[: len(poles)]))
    form = quadratic_form("error", error.K, error.lyapunov_matrix)
    P, own_Q = error.lyapunov_matrix, np.diag(error.Q)
    E = np.array(x[: len(poles)])
    energy, loss = E @ P @ E, E @ own_Q @ E
    assert loss >= form.mu * energy * (1 - 1e-6) - 1e-12
    assert (P[-1] @ E) ** 2 <= float(arb(form.q)) * loss * (1 + 1e-6) + 1e-9
    assert form.mu <= np.linalg.eigvals(np.linalg.solve(P, own_Q)).real.min() * (1 + 1e-9)
    reach = [float(r) for r in form.errors(arb(float(energy)))]
    assert all(abs(e) <= r * (1 + 1e-6) + 1e-9 for e, r in zip(E, reach, strict=True))


def test_a_matrix_that_is_no_lyapunov_function_is_refused():
    with pytest.raises(DiagramError, match="P of block 'error' is not positive definite"):
        quadratic_form("error", (4.0, 2.0), np.array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(DiagramError, match=r"Q = .* of block 'error' is not positive definite"):
        quadratic_form("error", (4.0, 2.0), np.array([[1.0, 0.0], [0.0, 1.0]]))
