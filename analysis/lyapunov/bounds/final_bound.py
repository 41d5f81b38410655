"""The final bound of the proof: V(0), (31), (34)-(36), as formulas of the controller's gains.

Each formula is written once and serves floats, balls and polynomials alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

KAPPA = 0.2785  # bound of s - s tanh s for s >= 0, (29); `nlctl.analysis.lyapunov.kappa` proves it


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Gains of the controller (23)-(25), and where it starts."""

    beta: float  # gain of r, (23)
    # adaptation gain and sigma-modification of W_hat, (25)
    Gamma: float
    sigma_1: float
    # adaptation gain, sigma-modification and width of the robust term, (25)
    gamma: float
    sigma_2: float
    tau: float
    # r(0) and delta_hat(0)
    r_0: float
    delta_hat_0: float
    W_hat_0: tuple[float, ...]  # w_hat(0); empty where there is no network
    # width of the smooth sign of r s in a law with a damped base, r (beta r + s) <= r eta + 0.2785
    # b; 0 for eta of (23)
    b: float = 0.0


def total_error(G_max: Any, eps_u: Any, d: object, eps: object) -> Any:
    """Return delta* = G_max eps_u* + d* + eps*, the bound of all errors in (20)."""
    return G_max * eps_u + d + eps


def alpha_1(gains: Gains) -> float:
    """Return alpha_1 = min{2 beta, sigma_1 / lambda_max(Gamma^-1), sigma_2 gamma}, (31)."""
    # Without a network its term drops out.
    rates = [2 * gains.beta, gains.sigma_2 * gains.gamma]
    if gains.W_hat_0:
        rates.append(gains.sigma_1 * gains.Gamma)
    return float(np.min(rates))


def alpha_0(gains: Gains, delta: Any, W_squared: Any) -> Any:
    """Return alpha_0 = 0.2785 (tau delta* + b) + sigma_1 |W|^2 / 2 + sigma_2 delta*^2 / 2, (31)."""
    return (
        KAPPA * gains.tau * delta
        + KAPPA * gains.b
        + 0.5 * gains.sigma_1 * W_squared
        + 0.5 * gains.sigma_2 * delta**2
    )


def initial_V(gains: Gains, delta: Any, W_error_squared: Any) -> Any:  # noqa: N802
    """Return V(0) of (21): r^2/2 + |W - W_hat|^2/(2 Gamma) + (delta* - delta_hat)^2/(2 gamma)."""
    return (
        0.5 * gains.r_0**2
        + (0.5 / gains.Gamma) * W_error_squared
        + (0.5 / gains.gamma) * (delta - gains.delta_hat_0) ** 2
    )


def final_bound(alpha_0: Any, alpha_1: float, V_0: object, Q: float) -> Any:
    """Return C_0 = sqrt(2 (alpha_0 / alpha_1 + V(0) + Q)), (36), for alpha_1 > 0."""
    # With ``V_0 = 0`` and the limit superior of I(t) for `Q` it is the ultimate bound.
    return np.sqrt(2 * (alpha_0 / alpha_1 + V_0 + Q))
