"""Funnel control of any relative degree, from the output and its derivatives."""

import numpy as np

from ...equations import equation
from ...params import param, record, set_integer
from ...plants import coordinate_names
from ...references import derivative_names
from .prescribed import performance_bound


@equation
def barrier_gain(w):
    """Gain alpha(w^2) = 1 / (1 - w^2); NaN on the boundary of the funnel and beyond it."""
    if -1 < w < 1:
        return 1 / (1 - w * w)
    return np.nan


@record
class FunnelControl:
    """Funnel control: the error stays in a funnel of time, the gain grows towards its boundary.

        w_1 = phi(t) e,   w_{i+1} = phi(t) e^(i) + alpha(w_i^2) w_i,   i = 1, ..., n-1
        u = -k alpha(w_n^2) w_n,   alpha(s) = 1 / (1 - s),   e = x1 - yd
        1 / phi(t) = (rho_0 - rho_inf) exp(-decay t) + rho_inf

    (Berger, Ilchmann, Ryan, Mathematics of Control, Signals, and Systems 33, 2021, p. 151; for
    n = 1 Ilchmann, Ryan, Sangwin, ESAIM: COCV 7, 2002, p. 471, with another gain.)  The plant has
    relative degree n and stable internal dynamics: |e| < 1 / phi(t) for all t if each |w_i| < 1 at
    t = 0.  It needs e and n - 1 derivatives of it, here x_i - yd^(i-1) of the plant class (1), and
    the sign of the input gain, which is positive here.  At the boundary u is NaN: there is no law.

    Examples
    --------
    Half way to the boundary the gain is 1 / (1 - 1/4):

    >>> record = nlctl.controllers.FunnelControl(order=1, k=3.0, rho_0=1.0)
    >>> print(nlctl.block(record, "controller").output(0, [], [0.5, 0.0]))
    [ 0.5 -2.   1. ]
    """

    order: int = 2  # Relative degree n >= 1 of the plant.
    k: float = param(1.0, unit="1", meaning="factor of the control input", above=0)
    rho_0: float = param(5.1, unit="1", meaning="half width of the funnel at t = 0", above=0)
    rho_inf: float = param(0.1, unit="1", meaning="half width of the funnel at last", above=0)
    decay: float = param(2.0, unit="1/s", meaning="rate of decay of the funnel", at_least=0)

    outputs = ("e", "u", "rho")
    vector = True

    def check(self) -> None:
        """A relative degree."""
        set_integer(self, "order", at_least=1)

    plant_order = property(lambda self: self.order)
    inputs = property(
        lambda self: (*coordinate_names(self.order), *derivative_names(self.order - 1))
    )

    @equation
    def output(t, x, u, p):
        """The error, the control input, and the half width of the funnel."""
        n = u.size // 2
        rho = performance_bound(t, p.rho_0, p.rho_inf, p.decay)
        w = (u[0] - u[n]) / rho
        for i in range(1, n):
            w = (u[i] - u[n + i]) / rho + barrier_gain(w) * w
        return u[0] - u[n], -p.k * barrier_gain(w) * w, rho
