r"""The function E^T P E along E' = A E + b d, in rational arithmetic.

A is the companion matrix of E_n' = -K^T E and b = (0, ..., 0, 1).  P is the matrix by which the
weights of the loop learn, whatever has been rounded off in it: Q = -(A^T P + P A) follows from it
exactly.  That P and Q are positive definite, and that Q - mu P is, is proved by leading minors.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, fmpq, fmpq_mat
from scipy.linalg import eigh

from nlctl.errors import DiagramError

from ...intervals.normal_form import exact, exact_matrix, is_positive_definite, rational

_SHRUNK = 1 - 1e-9  # of the least eigenvalue in floating point, to be proved a lower bound


def ball(x: Any) -> arb:
    """Return a fraction or a float as a ball."""
    return arb(rational(x)) if isinstance(x, Fraction | fmpq) else arb(x)


@dataclass(frozen=True, kw_only=True)
class QuadraticForm:
    """E^T P E with the derivative -E^T Q E + 2 b^T P E d."""

    K: tuple[Fraction, ...]  # gains of E_n' = -K^T E
    # of shape (n, n); the last is P^-1
    P: fmpq_mat
    Q: fmpq_mat
    inverse: fmpq_mat
    mu: float  # E^T Q E >= mu E^T P E, proved
    q: fmpq  # b^T P Q^-1 P b: (b^T P E)^2 <= q E^T Q E

    def value(self, E: Sequence[Any]) -> fmpq:
        """Return E^T P E of exact numbers."""
        return quadratic(self.P, E)

    def largest(self, sides: Sequence[tuple[Fraction, Fraction]]) -> fmpq:
        """Return the largest E^T P E of a box: a convex function is largest at a corner."""
        ends = [dict.fromkeys(side) for side in sides]  # one of equal ends
        return max(self.value(corner) for corner in itertools.product(*ends))

    def reach(self, level: arb, direction: Sequence[Any]) -> arb:
        """Return the largest c^T E of a direction c where E^T P E <= level."""
        return (level * ball(quadratic(self.inverse, direction))).sqrt()

    def errors(self, level: arb) -> tuple[arb, ...]:
        """Return the largest |E_1|, ..., |E_n| where E^T P E <= level."""
        n = self.P.nrows()
        return tuple(self.reach(level, [int(i == k) for i in range(n)]) for k in range(n))

    def first(self, square: arb) -> arb:
        """Return the largest |E_1| where E^T Q E <= square."""
        return (square * ball(self.Q.inv()[0, 0])).sqrt()

    def driven(self, D: arb) -> arb:
        """Return the level that E^T P E does not leave while |d| <= D."""
        # Where E^T Q E > 4 q D^2 it falls, and elsewhere it is at most 4 q D^2 / mu.
        return 4 * ball(self.q) * D * D / arb(self.mu)


def quadratic(M: fmpq_mat, x: Sequence[Any]) -> fmpq:
    """Return x^T M x."""
    column = fmpq_mat(len(x), 1, [rational(v) for v in x])
    return (column.transpose() * M * column)[0, 0]


def quadratic_form(path: str, K: Sequence[float], P: np.ndarray) -> QuadraticForm:
    """Prove that E^T P E is a Lyapunov function of E_n' = -K^T E; shapes: `P` (n, n)."""
    n = len(K)
    lower = np.tril(P) + np.tril(P, -1).T
    lower[n - 1] = lower[:, n - 1] = P[:, n - 1]
    exact_P = exact_matrix(lower)
    A = [[int(j == i + 1) for j in range(n)] for i in range(n - 1)]
    companion = fmpq_mat(n, n, [rational(v) for row in A for v in row] + [-rational(k) for k in K])
    Q = -(companion.transpose() * exact_P + exact_P * companion)
    for name, M in (("P", exact_P), ("Q = -(A^T P + P A)", Q)):
        if not is_positive_definite(M):
            raise DiagramError(
                f"{name} of block '{path}' is not positive definite, so that E^T P E is no "
                "Lyapunov function of its error: choose other K or Q"
            )
    column = fmpq_mat(n, 1, [exact_P[i, n - 1] for i in range(n)])
    return QuadraticForm(
        K=tuple(map(exact, K)),
        P=exact_P,
        Q=Q,
        inverse=exact_P.inv(),
        mu=_rate(path, exact_P, Q),
        q=(column.transpose() * Q.inv() * column)[0, 0],
    )


def _rate(path: str, P: fmpq_mat, Q: fmpq_mat) -> float:
    """Return a mu for which Q - mu P is proved to be positive definite."""
    floats = [np.array([[float(arb(v)) for v in row] for row in M.tolist()]) for M in (Q, P)]
    mu = float(eigh(*floats, eigvals_only=True)[0]) * _SHRUNK
    if not (mu > 0 and is_positive_definite(Q - rational(mu) * P)):
        raise DiagramError(
            f"the decay rate of block '{path}' could not be proved: its P is nearly singular, "
            "choose other K or Q"
        )
    return mu
