"""Adaptive inverse of a dead zone, in front of an actuator whose break points are unknown."""

import numpy as np

from ..equations import equation
from ..params import param, record


@equation
def inverse_input(desired, x, p):
    """The input that the dead zone needs by the estimates, as `DeadZoneInverse`."""
    m_r, mb_r, m_l, mb_l = x
    if desired > 0:
        return (desired + mb_r) / np.maximum(m_r, p.m_min)
    if desired < 0:
        return (desired + mb_l) / np.maximum(m_l, p.m_min)
    return desired  # 0, or NaN


@equation
def kept_above(rate, value, low):
    """Projection of an estimate: it stands where it would fall below its bound."""
    if value <= low and rate < 0:
        return 0.0 * rate
    return rate + 0.0 * value  # NaN travels


@record
class AdaptiveDeadZoneInverse:
    """Adaptive inverse of a dead zone with unknown slopes and break points.

        u = (u_d + mb_r) / m_r    u_d > 0          m_r' = gamma r u,   mb_r' = -gamma r
            0                     u_d = 0          m_l' = gamma r u,   mb_l' = -gamma r
            (u_d + mb_l) / m_l    u_d < 0          on the side of u_d; the other side stands

    (Tao, Kokotovic, IEEE Transactions on Automatic Control 39, 1994, p. 59; the estimates are of
    the slopes m and of m b, with projection onto m >= m_min, mb_r >= 0, mb_l <= 0.)  The law of the
    controller is the wanted output u_d of the actuator.  For r' = -beta r + v - u_d the function
    r^2 / 2 + |theta - theta*|^2 / (2 gamma) has the derivative -beta r^2 as long as the estimated
    dead zone is as wide as the true one, theta* the true values of a dead zone with constant
    slopes.  It needs a plant that is known but for the dead zone, and the sign of its gain,
    positive here.

    Examples
    --------
    Its outputs are the input of the dead zone and both estimated break points:

    >>> inverse = nlctl.block(nlctl.controllers.AdaptiveDeadZoneInverse(), "inverse")
    >>> print(inverse.output(0, [1.0, 0.5, 1.0, -0.25], [2.0, 0.0]))
    [ 2.5   0.5  -0.25]
    """

    gamma: float = param(2.0, unit="1", meaning="adaptation gain", above=0)
    m_min: float = param(0.2, unit="1", meaning="least slope that is believed", above=0)
    m_0: float = param(1.0, unit="1", meaning="estimate of both slopes at t = 0", above=0)
    b_0: float = param(
        0.0, unit="1", meaning="estimate of b_r and -b_l at t = 0", at_least=0, symbol="b_0"
    )

    inputs = ("u_d", "r")
    outputs = ("u", "b_r_hat", "b_l_hat")
    states = ("m_r", "mb_r", "m_l", "mb_l")

    @property
    def initial(self) -> dict[str, float]:
        """The estimates at t = 0."""
        width = self.m_0 * self.b_0
        return {"m_r": self.m_0, "mb_r": width, "m_l": self.m_0, "mb_l": -width}

    @equation
    def update(t, x, u, p):
        """Gradient on the side that acts, projected."""
        m_r, mb_r, m_l, mb_l = x
        desired, r = u
        slope, width = p.gamma * r * inverse_input(desired, x, p), -p.gamma * r
        still = 0.0 * slope  # 0, or NaN
        if desired > 0:
            return kept_above(slope, m_r, p.m_min), kept_above(width, mb_r, 0.0), still, still
        if desired < 0:
            return still, still, kept_above(slope, m_l, p.m_min), -kept_above(-width, -mb_l, 0.0)
        return still, still, still, still

    @equation
    def output(t, x, u, p):
        """The input of the actuator, and the estimated break points."""
        m_r, mb_r, m_l, mb_l = x
        return inverse_input(u[0], x, p), mb_r / m_r, mb_l / m_l

    @equation
    def switching(t, x, u, p):
        """Where the side changes, and where an estimate meets its bound."""
        m_r, mb_r, m_l, mb_l = x
        return u[0], m_r - p.m_min, mb_r, m_l - p.m_min, mb_l
