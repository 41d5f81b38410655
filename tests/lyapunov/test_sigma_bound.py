"""The bound of MRAC with sigma-modification is proved where it is true, and nowhere else."""

import numpy as np
import pytest

from nlctl.analysis.lyapunov import Box, prove_decrease

W, K, GAMMA, SIGMA, D, P = 2.0, 1.0, 5.0, 0.2, 0.5, 0.5
FLOOR = (P * D**2 / K + SIGMA * W**2) * max(1 / K, 1 / (GAMMA * SIGMA))
BOX = Box.of(x=(-4.5, 4.5), W_hat=(-5.0, 9.0), d=(-D, D))


def V(z):  # noqa: N802 (as in the text)
    return P * z[0] * z[0] + (z[1] - W) * (z[1] - W) / GAMMA


def gradient(z):
    return 2 * P * z[0], 2 * (z[1] - W) / GAMMA, 0.0


def rates(z, sigma=SIGMA, sign=1.0):
    x, W_hat, d = z
    return W * x - sign * (K + W_hat) * x + d, GAMMA * (P * x * x - sigma * W_hat), 0.0


def proof(equations, floor, most=3000):
    return prove_decrease(
        V, equations, BOX, level=8.0, floor=floor, gradient=gradient, max_boxes=most
    )


@pytest.mark.slow
def test_the_function_falls_above_the_floor_of_completed_squares():
    """Its rate is at most -min(k, Gamma sigma) V + P D^2 / k + sigma W^2."""
    assert proof(rates, 1.001 * FLOOR, most=100_000).holds
    rng = np.random.default_rng(0)
    for z in rng.uniform([-4.5, -5.0, -D], [4.5, 9.0, D], (200, 3)):
        falls = np.dot(gradient(z), rates(z))
        assert falls <= -min(K, GAMMA * SIGMA) * V(z) + P * D**2 / K + SIGMA * W**2 + 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(
    ("equations", "floor"),
    [
        pytest.param(lambda z: rates(z, sigma=0.0), 1.001 * FLOOR, marks=pytest.mark.weekly),
        (lambda z: rates(z, sign=-1.0), 1.001 * FLOOR),
        (rates, 0.3 * FLOOR),
    ],
    ids=["no sigma", "the wrong sign", "a floor too low"],
)
def test_nothing_is_proved_of_another_loop(equations, floor):
    assert not proof(equations, floor).holds
