"""Extremum seeking: a parameter is driven to where a performance that is only measured is best."""

import numpy as np

from ..equations import equation
from ..params import param, record


@record
class ExtremumSeeking:
    """Extremum seeking by a sinusoidal perturbation, with a washout and a lowpass filter.

        theta = theta_hat + a sin(omega t),   theta_hat' = k xi
        xi'   = -omega_l xi + omega_l (y - eta) a sin(omega t)
        eta'  = omega_h (y - eta)

    (Krstić and Wang, Automatica 36(4), 2000, p. 595.)  It seeks a maximum of y where k > 0 and a
    minimum where k < 0.  Near an extremum y = y_* + h (theta - theta_*)^2 / 2, with omega well
    above k, omega_l, omega_h and the plant's own rates, the average of theta_hat - theta_* obeys

        s^2 + omega_l s - k omega_l a^2 h / 2 = 0

    and ends at -a^2 y'''(theta_*) / (8 h), to higher orders of a.  It knows neither y_*, theta_*
    nor h but the sign of h, and a to which theta may be moved.

    Parameters are fields; `y` has the unit of the performance, which k is per.

    Examples
    --------
    At omega t = pi / 2, where y is 0.25 above its mean eta = 1:

    >>> record = nlctl.controllers.ExtremumSeeking(k=2.0, a=0.1, omega=10.0)
    >>> seeking = nlctl.block(record, "seeking")
    >>> t, x, y = np.pi / 20, [3.0, 0.5, 1.0], [1.25]
    >>> print(seeking.output(t, x, y), seeking.dynamics(t, x, y))  # theta_hat + a; k xi, ...
    [3.1] [ 1.    -0.475  0.25 ]
    """

    k: float = param(1.0, unit="1/s", meaning="gain, per unit of y: above 0 for a maximum")
    a: float = param(0.2, unit="1", meaning="amplitude of the perturbation", above=0)
    omega: float = param(10.0, unit="rad/s", meaning="frequency of the perturbation", above=0)
    omega_l: float = param(1.0, unit="rad/s", meaning="corner of the lowpass filter", above=0)
    omega_h: float = param(1.0, unit="rad/s", meaning="corner of the washout filter", above=0)

    inputs = ("y",)
    outputs = ("theta",)
    states = ("theta_hat", "xi", "eta")
    feedthrough = False

    @equation
    def update(t, x, u, p):
        """The estimate, the demodulated and filtered performance, and its mean."""
        _, xi, eta = x
        (y,) = u
        demodulated = (y - eta) * p.a * np.sin(p.omega * t)
        return p.k * xi, p.omega_l * (demodulated - xi), p.omega_h * (y - eta)

    @equation
    def output(t, x, u, p):
        theta_hat, _, _ = x
        return (theta_hat + p.a * np.sin(p.omega * t),)
