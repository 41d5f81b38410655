"""Ideal weights: minimax, least squares and tightest; eps* proved over the box."""

import dataclasses
import functools

import numpy as np
import pytest

import nlctl
from nlctl.analysis.intervals.branch_and_bound import Box
from nlctl.analysis.lyapunov.bounds.error_bounds import (
    Gains,
    alpha_0,
    alpha_1,
    final_bound,
    initial_V,
)
from nlctl.analysis.lyapunov.bounds.sector import plant_terms
from nlctl.analysis.lyapunov.bounds.weights import (
    Network,
    approximation_error,
    minimax_weights,
    network_on_grid,
    tightest_weights,
)
from nlctl.errors import ParameterError
from nlctl.paper import paper_centres

DUFFING, GENESIO = nlctl.plants.ForcedDuffing(), nlctl.plants.Genesio()
BOXES = {
    DUFFING: Box.of(x1=(-0.85, 1.0), x2=(-0.55, 1.1)),
    GENESIO: Box.of(x1=(-0.85, 1.1), x2=(-0.55, 0.75), x3=(-0.6, 0.6)),
}
GAINS = Gains(
    beta=2.5,
    Gamma=0.5,
    sigma_1=0.5,
    gamma=1.5,
    sigma_2=0.5,
    tau=0.2,
    r_0=0.3,
    delta_hat_0=0.1,
    W_hat_0=(0.05,) * 27,
)


@functools.cache
def network(plant, layout="diagonal", per_side=None):
    order = len(plant.states)
    basis = nlctl.controllers.GaussianBasis(centres=paper_centres(layout, order))
    return basis, network_on_grid(plant, basis, BOXES[plant], per_side)


def polynomial(function, degree):
    """A network whose basis is 1, x, ..., x^degree on [-1, 1]."""
    x = np.linspace(-1, 1, 401)
    return Network(psi=np.vander(x, degree + 1), g=function(x), points=x[:, None])


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_minimax_weights_of_a_power_leave_the_chebyshev_error(n):
    """The best approximation of x^n by lower powers misses it by 2^(1-n)."""
    case = polynomial(lambda x: x**n, n - 1)
    assert case.error(minimax_weights(case)) == pytest.approx(2.0 ** (1 - n), abs=1e-4)


def test_minimax_is_never_worse_than_least_squares():
    """In its own measure, and with bounded weights too."""
    _, case = network(DUFFING, "9x3", 21)
    best = case.error(minimax_weights(case))
    bounded = minimax_weights(case, largest=10.0)
    assert best <= case.error(np.linalg.lstsq(case.psi, case.g)[0]) + 1e-9
    assert best <= case.error(bounded) + 1e-9
    assert np.abs(bounded).max() <= 10 + 1e-9


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("plant", [DUFFING, GENESIO])
def test_diagonal_centres_cannot_do_better_than_the_pair_bound(plant):
    """On the diagonal W^T psi = exp(-|x|^2/4) F(x1 + ... + xn): equal sums share F.

    For points x, y with equal sums, max error >= |b g(x) - a g(y)| / (a + b) with
    a = exp(-|x|^2/4), b = exp(-|y|^2/4); the linear programme attains the largest of these.
    """
    _, case = network(plant)
    rng = np.random.default_rng(0)
    box, n = BOXES[plant], len(plant.states)
    low, high = np.array(box.low), np.array(box.high)
    x = rng.uniform(low, high, (200_000, n))
    y = rng.uniform(low, high, (200_000, n))
    y[:, -1] = x.sum(axis=1) - y[:, :-1].sum(axis=1)
    inside = (y[:, -1] >= low[-1]) & (y[:, -1] <= high[-1])
    a, b = (np.exp(-np.sum(z[inside] ** 2, axis=1) / 4) for z in (x, y))
    f, _ = plant_terms(plant)
    g_x, g_y = (np.array([f(tuple(z), 0.0) for z in w[inside]]) for w in (x, y))
    pair = np.max(np.abs(b * g_x - a * g_y) / (a + b))
    attained = case.error(minimax_weights(case, largest=10.0))
    assert attained >= 0.98 * pair  # the grid is coarser than the sample
    assert attained == pytest.approx(pair, rel=0.05)


def square_of_the_bound(case, W, rest):
    """C_0^2 on the grid, from the formulas (31), (21), (36)."""
    delta = rest + case.error(W)
    V_0 = initial_V(GAINS, delta, np.sum((W - GAINS.W_hat_0) ** 2))
    return final_bound(alpha_0(GAINS, delta, W @ W), alpha_1(GAINS), V_0, 0.0) ** 2


@pytest.mark.parametrize("rest", [0.0, 6.0])
def test_no_other_weights_give_a_smaller_bound(rest):
    """The convex programme's W against 0, least squares, and steps in every direction."""
    _, case = network(DUFFING, "diagonal", 21)
    W = tightest_weights(case, GAINS, rest)
    best = square_of_the_bound(case, W, rest)
    rng = np.random.default_rng(1)
    others = [np.zeros(27), minimax_weights(case, largest=10.0)]
    others += [W + s * rng.standard_normal(27) for s in (1e-4, 1e-2, 1.0) for _ in range(50)]
    others += [(1 + s) * W for s in (-1e-2, 1e-2)]
    assert all(square_of_the_bound(case, other, rest) >= best * (1 - 1e-6) for other in others)


def test_without_decay_the_tightest_weights_make_alpha_0_small():
    """sigma_2 = 0 gives alpha_1 = 0 and no bound; alpha_0 stays a use for W."""
    _, case = network(DUFFING, "diagonal", 11)
    gains = dataclasses.replace(GAINS, sigma_2=0.0)
    W = tightest_weights(case, gains, 1.0)
    mine, none = (alpha_0(gains, 1.0 + case.error(w), w @ w) for w in (W, np.zeros(27)))
    assert mine < none


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("plant", [DUFFING, GENESIO])
def test_the_proved_error_is_above_the_grid_s_and_close(plant):
    """The grid gives a lower bound, branch and bound an upper one; a finer grid lies between."""
    basis, case = network(plant, "diagonal", 11)
    W = tightest_weights(case, GAINS, 6.0)
    proved = approximation_error(plant, basis, W, BOXES[plant], tol=1e-3)
    _, fine = network(plant, "diagonal", 41 if len(plant.states) == 2 else 21)
    assert case.error(W) <= fine.error(W) <= proved.magnitude
    assert max(proved.greatest, -proved.least) >= proved.magnitude - 1e-3


def test_without_a_network_the_error_is_g_itself():
    """Example 2: |g| is greatest at x = (1.1, 0.75, 0.6), where it is 6.6 - 1.21 + 2.25 + 0.96."""
    proved = approximation_error(GENESIO, None, (), BOXES[GENESIO])
    assert proved.magnitude == pytest.approx(6 * 1.1 - 1.1**2 + 3 * 0.75 + 1.6 * 0.6, abs=1e-6)


def test_weights_without_digits_are_refused():
    """Free minimax weights of the diagonal have norms beyond all precision."""
    basis, case = network(DUFFING, "diagonal", 21)
    W = minimax_weights(case)
    assert np.linalg.norm(W) > 1e5
    with pytest.raises(ParameterError, match=r"needs \|W\| <= 100000, got .*tightest_weights"):
        approximation_error(DUFFING, basis, W, BOXES[DUFFING])


def test_a_network_of_another_size_than_the_controllers_is_refused():
    """W_hat(0) is of the controller's nodes."""
    case = polynomial(np.exp, 3)
    with pytest.raises(ParameterError, match=r"W_hat\(0\), got 4 and 27"):
        tightest_weights(case, GAINS, 0.0)
