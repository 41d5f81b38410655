"""From a bound of the filtered error r to the set that the state stays in.

r = (d/dt + p_1) ... (d/dt + p_{n-1}) e_1 is a chain of first-order filters, so that |r| <= C for
all time bounds every e_i, and with the reference every x_i.

The final bound of the proof: V(0), (31), (34)-(36), as formulas of the controller's gains.

Each formula is written once and serves floats, balls and polynomials alike.
"""

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, fmpz_poly

from nlctl.errors import ParameterError
from nlctl.params import equation_arguments
from nlctl.references import SumOfSines

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


_ROUNDING = 1e-12  # added to what double precision has summed up
_SAMPLES = 4000  # of a period


def filter_poles(lambdas: Sequence[float]) -> tuple[arb, ...]:
    """Return p_1, ..., p_{n-1} > 0 of s^(n-1) + lambda_1 s^(n-2) + ... = prod_j (s + p_j)."""
    # As balls, from the exact values of the lambdas.
    coefficients = [Fraction(c) for c in (*reversed(lambdas), 1.0)]
    common = math.lcm(*(c.denominator for c in coefficients))
    polynomial = fmpz_poly([int(c * common) for c in coefficients])
    poles: list[arb] = []
    roots: Any = polynomial.complex_roots()
    for root, multiplicity in roots:
        if not (root.imag == 0 and root.real < 0):
            raise ParameterError(
                f"the filter of lambdas {tuple(lambdas)} has a root at {complex(root):.4g}: bounds "
                "of e need real negative roots, choose the lambdas as products of (s + p)"
            )
        poles += [-root.real] * multiplicity
    return tuple(sorted(poles, key=float))


def initial_errors(reference: SumOfSines, x0: Sequence[arb], t: float = 0.0) -> tuple[arb, ...]:
    """Return e_1, ..., e_n where the plant has the states x0."""
    yd = reference.output(t, (), (), equation_arguments(reference))
    # the radius covers what double precision has lost in yd
    return tuple(x - arb(float(y), 1e-12) for x, y in zip(x0, yd, strict=False))


def error_bounds(lambdas: Sequence[float], e0: Sequence[arb | float], C: arb) -> tuple[arb, ...]:
    """Bound |e_1|, ..., |e_n| for all time by |r| <= C and the initial error."""
    # With z_0 = r and z_k' = -p_k z_k + z_{k-1}, e_1 = z_{n-1}: |z_k| <= max(|z_k(0)|,
    # C_{k-1}/p_k), and every e_i is a combination of the z_k.
    poles = filter_poles(lambdas)
    n = len(poles) + 1
    # rows[k]: coefficients of e_1, e_1', ... in z_k = (s + p_{k+1}) ... (s + p_{n-1}) e_1
    rows = [[arb(1)]]
    for p in reversed(poles):
        previous = rows[0]
        rows.insert(0, [p * a + b for a, b in zip([*previous, 0], [0, *previous], strict=True)])
    products = ([a * b for a, b in zip(row, e0, strict=False)] for row in rows)
    z = [abs(sum(terms, arb(0))) for terms in products]
    z[0] = C
    for k in range(1, n):
        z[k] = z[k].max(z[k - 1] / poles[k - 1])
    # e_i = z_{n-i} - (lower derivatives), as combinations of z_{n-1}, z_{n-2}, ...
    combinations: list[list[arb]] = []
    for i in range(n):
        row = rows[n - 1 - i]
        combination = [arb(0)] * i + [arb(1)]
        for a, lower in zip(row[:-1], combinations, strict=True):
            for j, c in enumerate(lower):
                combination[j] = combination[j] - a * c
        combinations.append(combination)
    return tuple(
        sum((abs(c) * z[n - 1 - j] for j, c in enumerate(row)), arb(0)) for row in combinations
    )


@functools.lru_cache(maxsize=32)
def reference_bounds(reference: SumOfSines) -> tuple[float, ...]:
    """Return sup |yd|, ..., sup |yd^(n)| over all time of a sum of sines."""
    # Where the frequencies, as the doubles that they are, have a common period of moderate length,
    # from samples of the reference's own equation over it: between two samples h apart a function
    # exceeds the nearer one by at most |y'| h/2 + sup|y''| h^2/8. Otherwise, and at most, the sum
    # of the amplitudes: 0.5 and 1 have a period, and so have 0.1 and 0.2, but 0.1 and 0.3 have
    # none, since the double next to 0.3 is not three times that next to 0.1 and their phases drift
    # apart.
    a, w = np.abs(reference.amplitudes), np.array(reference.frequencies)
    n = reference.order
    largest = [float(np.sum(a * w**k)) * (1 + _ROUNDING) for k in range(n + 3)]
    turning = [Fraction(f) for f in reference.frequencies if f > 0]  # exact
    if not turning:
        return tuple(largest[: n + 1])
    common = math.lcm(*(f.denominator for f in turning))
    slowest = Fraction(math.gcd(*(int(f * common) for f in turning)), common)
    beats = max(turning) / slowest
    if beats > 100:
        return tuple(largest[: n + 1])
    beats = int(beats)
    h = 2 * np.pi / float(slowest) / (_SAMPLES * beats)
    p = equation_arguments(dataclasses.replace(reference, order=n + 1))
    y = np.abs([reference.output(i * h, (), (), p) for i in range(_SAMPLES * beats + 1)])
    between = np.max(y[:, :-1] + y[:, 1:] * h / 2, axis=0)
    return tuple(
        min(float(between[k]) + largest[k + 2] * h * h / 8 + _ROUNDING, largest[k])
        for k in range(n + 1)
    )
