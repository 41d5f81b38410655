"""Inverses of actuators, as compensators in front of them: dead zone, backlash, sum of plays.

An inverse takes the wanted output of the actuator as its input u; its own output v is what the
actuator needs.  ``cascade({"inverse": DeadZoneInverse(), "zone": DeadZone(...)})`` is then v = u.
"""

from typing import Any

import numpy as np

from ..equations import equation
from ..params import Floats, param, record
from . import prandtl_ishlinskii
from .backlash import check_gap
from .memories import FromUToV, Remembering, relaxation
from .relay import check_sides, moving_side


@record
class DeadZoneInverse(FromUToV):
    """Right inverse of a dead zone with constant slopes.

        v = u / slope_r + b_r    u > 0
            0                    u = 0
            u / slope_l + b_l    u < 0

    (Tao, Kokotovic, IEEE Transactions on Automatic Control 39, 1994, p. 59.)  A `DeadZone` with
    these parameters and without ripple has the output u.  The inverse jumps at u = 0.

    It obeys (2) with k between 1 / slope_r and 1 / slope_l and eps_u between b_l and b_r.

    Examples
    --------
    >>> inverse, zone = nlctl.actuators.DeadZoneInverse(), nlctl.DeadZone(ripple_r=0, ripple_l=0)
    >>> both = nlctl.actuators.cascade({"inverse": inverse, "zone": zone})
    >>> [round(float(both.output(0, [], [u])[0]), 6) for u in (-0.4, 0.0, 0.7)]
    [-0.4, 0.0, 0.7]
    """

    slope_r: float = param(1.0, unit="1", meaning="slope on the right of the dead zone", above=0)
    slope_l: float = param(0.8, unit="1", meaning="slope on the left of the dead zone", above=0)
    b_r: float = param(0.5, unit="1", meaning="right break point of the dead zone", above=0)
    b_l: float = param(-0.3, unit="1", meaning="left break point of the dead zone", below=0)

    @property
    def gains(self) -> tuple[float, float]:
        """Bounds (k_1, k_2) of k in (2): the slopes of the inverse."""
        slopes = 1 / self.slope_r, 1 / self.slope_l
        return min(slopes), max(slopes)

    @equation
    def output(t, x, u, p):
        """What the dead zone needs."""
        (desired,) = u
        if desired > 0:
            return (desired / p.slope_r + p.b_r,)
        if desired < 0:
            return (desired / p.slope_l + p.b_l,)
        return (desired,)  # 0, or NaN

    @equation
    def switching(t, x, u, p):
        return (u[0],)

    @equation
    def band(t, u, p):
        """Least and greatest output near input u: at the jump, from one side to the other."""
        right, left = u / p.slope_r, u / p.slope_l
        return np.minimum(right, left) + p.b_l, np.maximum(right, left) + p.b_r


@equation
def needed_lines(desired, p):
    """What brings a backlash to the wanted output on its rising and on its falling side."""
    return desired / p.m_r + p.c_r, desired / p.m_l + p.c_l


@record
class BacklashInverse(Remembering):
    """Right inverse of a backlash, for an input whose rate is known.

        v = max(u / m_r + c_r, u / m_l + c_l)    s = +1,   s = +1       u' > 0
            min(u / m_r + c_r, u / m_l + c_l)    s = -1        -1       u' < 0
                                                               s(t-)    u' = 0

    (Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996,
    chapter 2; with equal slopes the lines are u / m + c_r and u / m + c_l).  Its second input
    ``u1`` is u', as references have it.  Once its input has crossed the gap, a `Backlash` behind
    it has the output u.  The inverse crosses the gap in a jump where u reverses: that is why it
    needs u', and no inverse from u alone does it.

    It obeys (2) with k between 1 / m_r and 1 / m_l and eps_u between c_l and c_r.

    Examples
    --------
    It jumps across the gap where its input reverses:

    >>> record = nlctl.actuators.BacklashInverse(m_r=1.0, m_l=1.0, c_r=0.5, c_l=-0.6)
    >>> inverse = nlctl.block(record, "inverse")
    >>> [float(inverse.output(0, [1.0], [2.0, rate])[0]) for rate in (1.0, -1.0)]
    [2.5, 1.4]
    """

    m_r: float = param(1.2, unit="1", meaning="slope of the right (rising) side", above=0)
    m_l: float = param(1.2, unit="1", meaning="slope of the left (falling) side", above=0)
    c_r: float = param(0.5, unit="1", meaning="right end of the gap")
    c_l: float = param(-0.6, unit="1", meaning="left end of the gap")
    v0: float = 1.0  # Side s(0-) at the start, 1 or -1: the initial value of the state ``side``.

    inputs = ("u", "u1")
    states = ("side",)
    no_split = "it takes the rate u' besides u"

    def check(self) -> None:
        """The gap has a left and a right end; the side is one of two."""
        check_gap(self)
        check_sides(self)

    @equation
    def output(t, x, u, p):
        """What the backlash needs."""
        (side,) = x
        desired, u1 = u
        one, other = needed_lines(desired, p)
        now = moving_side(u1, side)  # +-1, or NaN
        upper, lower = np.maximum(one, other), np.minimum(one, other)
        return (np.where(now > 0, upper, np.where(now < 0, lower, now)),)

    @equation
    def commit(t, x, u, p):
        (side,) = x
        return (moving_side(u[1], side),)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        """Where u reverses, and where the lines cross."""
        desired, u1 = u
        one, other = needed_lines(desired, p)
        return u1, one - other


@record
class PrandtlIshlinskiiInverse(prandtl_ishlinskii.Plays):
    """Inverse of a Prandtl-Ishlinskii operator, which is one as well.

        v = W_0 u + sum_i W_i H_i,   H_i = min(max(H_i(t-), u - R_i), u + R_i)
        W_0 = 1 / w_0,   W_i = 1 / m_i - 1 / m_(i-1),   m_i = w_0 + w_1 + ... + w_i
        R_i = w_0 r_i + sum_(j <= i) w_j (r_i - r_j)

    (Kuhnen, European Journal of Control 9, 2003, p. 407.)  w_0, w, r and v0 are those of the
    operator.  Operator and inverse, one behind the other in either order, are the identity, if the
    memories v0 fit each other as after some input: |v0[i] - v0[i-1]| <= r_i - r_(i-1).

    It obeys (2) with the gain k = 1 / (w_0 + sum w_i) and |eps_u| <= sum |W_i| R_i.

    Parameters
    ----------
    v0 : float or tuple of float, optional
        Memories of the operator at the start: one for all, or one each.

    Examples
    --------
    >>> operator = nlctl.actuators.PrandtlIshlinskii()
    >>> inverse = nlctl.actuators.PrandtlIshlinskiiInverse()
    >>> both = nlctl.actuators.cascade({"inverse": inverse, "operator": operator})
    >>> [round(float(both.output(0, [0.0] * 8, [u])[0]), 6) for u in (-0.4, 0.1, 0.7)]
    [-0.4, 0.1, 0.7]
    """

    w_0: float = param(0.6, unit="1", meaning="weight of u in the operator", above=0)
    w: Floats = param((0.25, 0.15, 0.1, 0.1), unit="1", meaning="weights of the operator's plays")
    r: Floats = param(
        (0.2, 0.4, 0.6, 0.8), unit="1", meaning="thresholds of the operator, increasing", above=0
    )

    @property
    def initial(self) -> dict[str, float]:
        """Memories that fit those of the operator."""
        z = np.broadcast_to(np.asarray(self.v0, dtype=float), (len(self.r),))
        w = np.array(self.w)
        memories = [
            (self.w_0 + w[: i + 1].sum()) * z[i] + w[i + 1 :] @ z[i + 1 :] for i in range(len(w))
        ]
        return dict(zip(self.states, map(float, memories), strict=True))

    @property
    def gains(self) -> tuple[float, float]:
        """Bounds (k_1, k_2) of k in (2): the slope of every play at its sides together."""
        k = float(1 / (self.w_0 + np.sum(self.w)))
        return k, k

    def check(self) -> None:
        """The operator has an increasing loading curve, and as many memories as thresholds."""
        super().check()
        prandtl_ishlinskii.check_weights(self, "so that the operator has an inverse")

    def derived(self) -> dict[str, Any]:
        """Weights W_0, W and thresholds R of the inverse."""
        m = self.w_0 + np.cumsum([0.0, *self.w])
        r = np.array([0.0, *self.r])
        return {"W_0": 1 / m[0], "W": np.diff(1 / m), "R": np.cumsum(m[:-1] * np.diff(r))}

    @equation
    def output(t, x, u, p):
        return (prandtl_ishlinskii.weighted_plays(u[0], x, p.W_0, p.W, p.R),)

    @equation
    def commit(t, x, u, p):
        return prandtl_ishlinskii.unit_play(u[0], x, p.R)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        """Contact of each play with either side of its gap."""
        return np.concatenate(prandtl_ishlinskii.unit_contact(u[0], x, p.R))

    @equation
    def band(t, u, p):
        return prandtl_ishlinskii.weighted_band(u, p.W_0, p.W, p.R)
