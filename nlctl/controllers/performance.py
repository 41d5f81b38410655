"""Errors that stay within bounds of time: prescribed performance, and a funnel."""

import numpy as np

from ..equations import equation
from ..errors import ParameterError
from ..params import Floats, param, record, set_integer
from ..plants import coordinate_names
from ..references import derivative_names


@equation
def performance_bound(t, rho_0, rho_inf, decay):
    """Performance function rho(t) = (rho_0 - rho_inf) exp(-decay t) + rho_inf."""
    return (rho_0 - rho_inf) * np.exp(-decay * t) + rho_inf


@equation
def transformed_error(xi):
    """Transformed error ln((1 + xi) / (1 - xi)); NaN at the bound and beyond it."""
    if -1 < xi < 1:
        return np.log((1 + xi) / (1 - xi))
    return np.nan


@record
class PrescribedPerformance:
    """Prescribed performance control of pure-feedback plants, without approximation.

        a_0 = yd,   xi_i = (x_i - a_{i-1}) / rho_i(t),   i = 1, ..., n
        a_i = -k_i ln((1 + xi_i) / (1 - xi_i)),   u = a_n
        rho_i(t) = (rho_0[i] - rho_inf[i]) exp(-decay[i] t) + rho_inf[i]

    (Bechlioulis, Rovithakis, Automatica 50, 2014, p. 1217.)  It is made for the paper's plant
    class: |x1 - yd| < rho_1(t) for all t if |x_i - a_{i-1}| < rho_i at t = 0 and each x_i' grows
    with x_{i+1}, the last one with u.  It needs neither the plant nor a network nor a derivative
    of the reference; it needs the states and the sign of the input gain, which is positive here.
    Where an error is at its bound or beyond it, u is NaN: there is no law.

    Bounds of x_{i+1} - a_i that are wide against k_i make xi_i come close to 1 before x_i turns
    round, where a double has no room: 1 - xi is at least 1e-16, so that |a_i| < 38 k_i.

    Examples
    --------
    Half way to its bound the error is answered by k ln 3; at the bound there is no law:

    >>> record = nlctl.controllers.PrescribedPerformance(
    ...     k=(2.0,), rho_0=(1.0,), rho_inf=(0.1,), decay=(1.0,)
    ... )
    >>> controller = nlctl.block(record, "controller")
    >>> print(controller.output(0, [], [0.5, 0.0]).round(6), round(-2 * np.log(3), 6))
    [ 0.5      -2.197225  1.      ] -2.197225
    >>> print(controller.output(0, [], [1.0, 0.0])[1])
    nan
    """

    k: Floats = param((1.0, 8.0), unit="1", meaning="gains k_i", above=0)
    rho_0: Floats = param((3.0, 6.0), unit="1", meaning="bounds at t = 0", above=0)
    rho_inf: Floats = param((0.1, 1.0), unit="1", meaning="bounds at last", above=0)
    decay: Floats = param(
        (1.0, 1.0), unit="1/s", meaning="rates of decay of the bounds", at_least=0, symbol="l"
    )

    outputs = ("e", "u", "rho")
    vector = True

    def check(self) -> None:
        """As many bounds as gains."""
        sizes = {key: len(getattr(self, key)) for key in ("k", "rho_0", "rho_inf", "decay")}
        if len(set(sizes.values())) > 1 or not self.k:
            counted = ", ".join(f"{n} of {key}" for key, n in sizes.items())
            raise ParameterError(
                "PrescribedPerformance needs k, rho_0, rho_inf and decay of equal length, one "
                f"value for each state of the plant, got {counted}"
            )

    plant_order = property(lambda self: len(self.k))
    inputs = property(lambda self: (*coordinate_names(len(self.k)), "yd"))

    @equation
    def output(t, x, u, p):
        """The error, the control input, and the bound of the error."""
        yd = u[-1]
        target = yd  # a_{i-1}
        for i in range(p.k.size):
            rho = performance_bound(t, p.rho_0[i], p.rho_inf[i], p.decay[i])
            target = -p.k[i] * transformed_error((u[i] - target) / rho)
        return u[0] - yd, target, performance_bound(t, p.rho_0[0], p.rho_inf[0], p.decay[0])


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
