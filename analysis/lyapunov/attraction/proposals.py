"""Quadratic V that may fall: by Lyapunov's equation, and by semidefinite programs on samples."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from ..convex import at_least, at_most, minimizer, symmetric_basis
from .motion import StateRates

_SAMPLES = 400
_RATE = 1e-3  # V' <= -1e-3 |x|^2 at samples, for P >= 1


def from_linear_part(A: np.ndarray) -> np.ndarray:
    """Return P of A^T P + P A = -1, symmetric.

    Shapes: `A` (n, n).
    """
    P = solve_continuous_lyapunov(A.T, -np.eye(len(A)))
    return 0.5 * (P + P.T)


def fitted(motion: StateRates, at: np.ndarray, P: np.ndarray, level: float) -> Iterator[np.ndarray]:
    """Yield P for which V falls at samples of sets ever larger than (x - at)^T P (x - at) <= level.

    The program is convex: V' = 2 (x - at)^T P f(x) is linear in P.  Of all P >= 1 that fall at the
    samples and along the linear part, the one with the largest set is taken, as measured by the
    trace of P times that of the set before.

    Shapes: `at` (n,), `P` (n, n).
    """
    n, rng, basis = len(P), np.random.default_rng(0), symmetric_basis(len(P))
    root = np.linalg.inv(np.linalg.cholesky(P / level)).T  # maps the unit ball onto the set
    directions = rng.standard_normal((_SAMPLES, n))
    unit = directions / np.linalg.norm(directions, axis=1)[:, None]
    unit *= rng.uniform(0.3, 1.0, _SAMPLES)[:, None] ** (1 / n)
    A = motion.jacobian(at)
    for factor in (1.15, 1.4, 2.0):
        z = factor * unit @ root.T
        rates = motion.at(at + z)
        finite = np.all(np.isfinite(rates), axis=1)
        square = np.sum(z[finite] ** 2, axis=1)
        falls = [2 * np.einsum("ki,ij,kj->k", z[finite], E, rates[finite]) for E in basis]
        limits = [
            at_least(basis, np.eye(n)),
            at_least([-(A.T @ E + E @ A) for E in basis], _RATE * np.eye(n)),
            at_most(np.column_stack(falls), -_RATE * square),
        ]
        size = np.array([np.trace(root.T @ E @ root) for E in basis])
        x, _ = minimizer(np.zeros((len(basis), len(basis))), size, limits)
        if x is None:
            return
        yield np.tensordot(x, np.array(basis), 1)
