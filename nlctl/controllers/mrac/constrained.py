"""Model reference adaptive control in the presence of an input constraint."""

import numpy as np

from ...equations import equation
from ...functions import clip
from ...params import param, record
from .model_error import WeightedError, seen_error, state_and_model_names


@record
class ConstrainedLaw:
    """Direct law whose output never leaves the limits of the actuator.

        u_c = -W_hat^T psi,   u = min(max(u_c, -u_max), u_max),   du = u - u_c

    (Karason, Annaswamy, IEEE Transactions on Automatic Control 39, 1994, p. 2325.)  Its output du
    is what the constraint takes away; `ConstrainedError` keeps the adaptation free of it.

    Examples
    --------
    >>> law = nlctl.block(nlctl.controllers.ConstrainedLaw(u_max=10.0), "law")
    >>> print(law.output(0, [], [-12.0]))  # u, and what is missing
    [10. -2.]
    """

    u_max: float = param(10.0, unit="1", meaning="limit of the input", above=0)

    inputs = ("W_psi",)
    outputs = ("u", "du")

    @equation
    def output(t, x, u, p):
        """The law, and its deficit."""
        desired = -u[0]
        allowed = clip(desired, -p.u_max, p.u_max)
        return allowed, allowed - desired

    @equation
    def switching(t, x, u, p):
        return u[0] - p.u_max, u[0] + p.u_max


@record
class ConstrainedError(WeightedError):
    """Error that an adaptive law may learn from when its input is constrained.

        E_d' = A E_d + b beta_hat du,   beta_hat' = gamma_d r du,   r = b^T P (E - E_d)
        E = x - xm,   A^T P + P A = -diag(Q),   A and b as in `ModelError`

    (Karason, Annaswamy, IEEE Transactions on Automatic Control 39, 1994, p. 2325.)  E_d estimates
    the part of the error that is due to the deficit du, with the estimate beta_hat of the input
    gain.  With E_u = E - E_d the function E_u^T P E_u + lambda |W_hat - W|^2 / Gamma +
    (beta_hat - lambda)^2 / gamma_d has the derivative -E_u^T diag(Q) E_u, whatever du is; that E
    is bounded too holds from initial states from which the plant can be held with |u| <= u_max.

    Examples
    --------
    What the estimate E_d explains of an error, weights do not learn from: r = 0.

    >>> error = nlctl.block(nlctl.controllers.ConstrainedError(K=(2.0,), Q=(1.0,)), "error")
    >>> e, r, nu_e, E_norm, beta_hat = error.output(0, [2.0, 0.0], [3.0, 1.0, -1.0])
    >>> print(e, r)
    2.0 0.0
    """

    gamma_d: float = param(1.0, unit="1", meaning="adaptation gain of beta_hat", above=0)

    outputs = ("e", "r", "nu_e", "E_norm", "beta_hat")

    inputs = property(lambda self: (*state_and_model_names(len(self.K)), "du"))
    states = property(lambda self: (*(f"E_d{i + 1}" for i in range(len(self.K))), "beta_hat"))

    @equation
    def update(t, x, u, p):
        """The error that is due to the deficit, and the estimate of the input gain."""
        n = p.K.size
        E_d, beta_hat, du = x[:n], x[n], u[2 * n]
        r = seen_error(u[:n] - u[n : 2 * n] - E_d, p)[1]
        driven = beta_hat * du - np.sum(p.K * E_d)
        return np.append(np.append(E_d[1:], driven), p.gamma_d * r * du)

    @equation
    def output(t, x, u, p):
        """E_1, and what a law sees of E - E_d."""
        n = p.K.size
        E = u[:n] - u[n : 2 * n]
        _, r, nu_e, norm = seen_error(E - x[:n], p)
        return E[0], r, nu_e, norm, x[n]
