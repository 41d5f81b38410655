"""Nussbaum laws with another zeta' than (24), against the slow drift of zeta.

By (23), (24) N(zeta) zeta' = r u: zeta drifts as long as r u has a mean, and where it passes a
zero of N the loop loses its sign.  These blocks have the signals of `NussbaumLaw` and stand in
its place.
"""

from collections.abc import Callable
from functools import cached_property

from ..equations import equation
from ..functions import clip
from ..params import param, record
from .known_sign import damped_base
from .nussbaum import NussbaumLaw, control_base, gained


@equation
def beyond(r, r_0):
    """What of r lies outside [-r_0, r_0]: d(r) = r - clip(r, -r_0, r_0), continuous in r."""
    return r - clip(r, -r_0, r_0)


@record
class DeadZoneNussbaumLaw(NussbaumLaw):
    """Nussbaum law (23) with a dead zone in the adaptation of its argument (lambda-tracking).

        u     = N(zeta) eta,    eta = beta r + W_hat^T psi + delta_hat tanh(r/tau) + Y_d
        zeta' = d(r) eta,       d(r) = r - clip(r, -r_0, r_0),   zeta(0) = 1

    zeta stands still while |r| <= r_0 and grows until |r| stays there, so that r_0 is about what
    |r| reaches.  d is the continuous dead zone, so that d(r)^2 / 2 instead of r^2 / 2 in (21)
    has the derivative d(r) r' and N(zeta) zeta' = d(r) u holds exactly.

    Examples
    --------
    zeta stands still while |r| <= r_0:

    >>> law = nlctl.block(nlctl.controllers.DeadZoneNussbaumLaw(beta=2.0, r_0=0.3), "law")
    >>> [round(float(law.dynamics(0, [1.0], [r, 0.0, 0.0, 0.0])[0]), 6) for r in (0.3, 0.5)]
    [0.0, 0.2]
    """

    r_0: float = param(0.3, unit="1", meaning="half width of the dead zone of r", above=0)

    @equation
    def update(t, x, u, p):
        """Equation (24) with d(r) instead of r."""
        return (beyond(u[0], p.r_0) * control_base(u, p),)

    @equation
    def switching(t, x, u, p):
        """The ends of the dead zone."""
        return u[0] + p.r_0, u[0] - p.r_0


@record
class LeakyNussbaumLaw(NussbaumLaw):
    """Nussbaum law (23) whose argument leaks back to where it started.

        u     = N(zeta) eta,    eta = beta r + W_hat^T psi + delta_hat tanh(r/tau) + Y_d
        zeta' = r eta - c (zeta - 1),   zeta(0) = 1

    zeta settles where the mean of r eta is c (zeta - 1).  It cannot settle at 1, where N of the
    paper is 0, so the price is a larger steady error than that of a gain which has grown.

    Examples
    --------
    At r = 0 zeta goes back to 1 at the rate c:

    >>> law = nlctl.block(nlctl.controllers.LeakyNussbaumLaw(c=0.5), "law")
    >>> print(law.dynamics(0, [3.0], [0.0, 0.0, 0.0, 0.0]))
    [-1.]
    """

    c: float = param(0.01, unit="1/s", meaning="rate of the leakage", at_least=0)

    @equation
    def update(t, x, u, p):
        """Equation (24) with leakage."""
        (zeta,) = x
        return (u[0] * control_base(u, p) - p.c * (zeta - 1),)


@record
class MonotoneNussbaumLaw(NussbaumLaw):
    """Nussbaum law whose argument never falls: (23), (24) with the base of `KnownSignLaw`.

        u     = N(zeta) eta,   eta = beta r + s tanh(r s / b)
        zeta' = r eta >= 0,    s = W_hat^T psi + delta_hat tanh(r/tau) + Y_d,   zeta(0) = 1

    Not a remedy by itself: zeta still drifts.  But it cannot oscillate, and so cannot pump V
    under a gain that varies with time; `nlctl.analysis.lyapunov.nussbaum.energy.safe_horizon`
    supposes a monotone zeta.

    Examples
    --------
    With s = -3 the law of the paper lets zeta fall; here it cannot:

    >>> falls = nlctl.block(nlctl.controllers.NussbaumLaw(beta=2.0), "law")
    >>> never = nlctl.block(nlctl.controllers.MonotoneNussbaumLaw(beta=2.0), "law")
    >>> falls.dynamics(0, [1.0], [1, -3, 0, 0])[0] < 0 < never.dynamics(0, [1.0], [1, -3, 0, 0])[0]
    np.True_
    """

    b: float = param(0.1, unit="1", meaning="width of the smooth sign of r s", above=0)

    @equation
    def update(t, x, u, p):
        """Equation (24) with the damped base."""
        return (u[0] * damped_base(u, p),)

    @cached_property
    def output(self) -> Callable:
        """Equation (23) with the damped base."""
        return gained(self.N, damped_base)
