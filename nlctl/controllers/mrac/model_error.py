"""The error between plant and reference model, and what the adaptation laws see of it."""

from typing import Any

import control as ct
import numpy as np

from ...equations import equation
from ...errors import ParameterError
from ...params import Floats, param, record
from ...plants import coordinate_names
from ..filtered_error import check_hurwitz
from .reference_model import model_state_names


def lyapunov_matrix(K: tuple[float, ...], Q: tuple[float, ...]) -> np.ndarray:
    """Return P of A^T P + P A = -diag(Q), shape (n, n), where E' = A E is E_n' = -K^T E."""
    A = np.diag(np.ones(len(K) - 1), 1)
    A[-1] = -np.array(K)
    return np.atleast_2d(ct.lyap(A.T, np.diag(Q)))


@equation
def seen_error(E, p):
    """What a law sees of an error: E_1, b^T P E, -K^T E, and its norm."""
    return E[0], np.sum(p.P_b * E), -np.sum(p.K * E), np.sqrt(np.sum(E * E))


def state_and_model_names(order: int) -> tuple[str, ...]:
    """Return ("x1", ..., "xn", "xm1", ..., "xmn")."""
    return (*coordinate_names(order), *model_state_names(order))


@record
class WeightedError:
    """What errors of adaptive loops share: their gains, and the matrix P that weights them."""

    K: Floats = param(
        (4.0, 2.0), unit="s^-(n+1-i)", meaning="gains of the error; their number is the order n"
    )
    Q: Floats = param((1.0, 1.0), unit="1", meaning="diagonal of Q", above=0)

    vector = True

    def check(self) -> None:
        """One entry of Q for each gain, and an error that decays."""
        who, K, Q = type(self).__name__, self.K, self.Q
        if len(Q) != len(K):
            raise ParameterError(f"{who} needs as many Q as K, got {len(Q)} of Q and {len(K)} of K")
        check_hurwitz(who, "K", K)

    plant_order = property(lambda self: len(self.K))

    @property
    def lyapunov_matrix(self) -> np.ndarray:
        """The matrix P, of shape (n, n)."""
        return lyapunov_matrix(self.K, self.Q)

    def derived(self) -> dict[str, Any]:
        """The last column of P, for the equation."""
        return {"P_b": self.lyapunov_matrix[:, -1]}


@record
class ModelError(WeightedError):
    """Error of a plant of class (1) against its reference model, weighted for adaptation.

        E = x - xm,   nu_e = -K^T E,   r = b^T P E,   b = (0, ..., 0, 1)
        A^T P + P A = -diag(Q),   A the matrix of E' = A E where E_n' = -K^T E

    With E' = A E + b d the function E^T P E has the derivative -E^T diag(Q) E + 2 r d: r is the
    error by which weights learn d.  Its output e is E_1.

    Examples
    --------
    Of order 1 with K = 2 and Q = 1, P = 1/4; the outputs are e, r = P E, -K E and |E|:

    >>> error = nlctl.block(nlctl.controllers.ModelError(K=(2.0,), Q=(1.0,)), "error")
    >>> print(error.output(0, [], [3.0, 1.0]))
    [ 2.   0.5 -4.   2. ]
    """

    outputs = ("e", "r", "nu_e", "E_norm")

    inputs = property(lambda self: state_and_model_names(len(self.K)))

    @equation
    def output(t, x, u, p):
        """The error, b^T P E, the feedback of the error, and its norm."""
        n = p.K.size
        return seen_error(u[:n] - u[n:], p)
