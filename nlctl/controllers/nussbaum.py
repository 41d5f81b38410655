"""Nussbaum law (23), (24): it finds the sign of the input gain by itself."""

from collections.abc import Callable
from functools import cached_property

from ..equations import equation
from ..functions import nussbaum
from ..params import param, record


@equation
def control_base(u, p):
    """The bracket of (23): eta = beta r + W_hat^T psi + delta_hat tanh(r/tau) + Y_d."""
    r, W_psi, robust, Y_d = u
    return p.beta * r + W_psi + robust + Y_d


def gained(N: Callable[[float], float], base: Callable) -> Callable:
    """Make the output equation of (23), u = N(zeta) eta and zeta, from N and eta = base(u, p)."""
    N = equation(N)

    @equation
    def output(t, x, u, p):
        (zeta,) = x
        return N(zeta) * base(u, p), zeta

    return output


@record
class NussbaumLaw:
    """Nussbaum control law (23), (24).

        u     = N(zeta) eta,   eta = beta r + W_hat^T psi + delta_hat tanh(r/tau) + Y_d
        zeta' = r eta,         zeta(0) = 1

    Parameters
    ----------
    N : equation, optional
        Nussbaum function; by default the paper's `nlctl.functions.nussbaum`, which is 0 at
        zeta = 1.

    Examples
    --------
    At zeta = 1 the paper's Nussbaum function is 0; zeta' = r eta is not:

    >>> law = nlctl.block(nlctl.controllers.NussbaumLaw(beta=2.5), "law")
    >>> u = [2.0, 0.0, 0.0, 1.0]  # r, W_psi, robust, Y_d
    >>> print(law.output(0, [1.0], u).round(12), law.dynamics(0, [1.0], u))
    [0. 1.] [12.]
    """

    beta: float = param(2.5, unit="1", meaning="gain of the filtered error", above=0)
    N: Callable[[float], float] = nussbaum

    inputs = ("r", "W_psi", "robust", "Y_d")
    outputs = ("u", "zeta")
    states = ("zeta",)
    initial = {"zeta": 1.0}

    @equation
    def update(t, x, u, p):
        """Equation (24)."""
        return (u[0] * control_base(u, p),)

    @cached_property
    def output(self) -> Callable:
        """Equation (23)."""
        return gained(self.N, control_base)
