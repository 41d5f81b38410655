"""Actuators without memory: dead zone, saturation, gain."""

import numpy as np

from ..equations import equation
from ..errors import ParameterError
from ..functions import clip
from ..params import param, record
from .memories import FromUToV

BOUNDED_OUTPUT = "its output is bounded for all u, so that no k >= k_1 > 0 keeps eps_u bounded"


@record
class DeadZone(FromUToV):
    """Asymmetric dead zone with slopes that depend on the input (Lv et al. 2017, Example 1).

        v = (1 + 0.3 sin u) (u - b_r)      u >= b_r
            0                              b_l < u < b_r
            (0.8 + 0.2 cos u) (u - b_l)    u <= b_l

    Examples
    --------
    With constant slopes, left of the gap, inside, and right of it:

    >>> zone = nlctl.block(nlctl.DeadZone(ripple_r=0, ripple_l=0), "actuator")
    >>> [float(zone.output(0, [], [u])[0]) for u in (-1.3, 0.2, 1.5)]
    [-0.8, 0.0, 1.0]
    """

    slope_r: float = param(1.0, unit="1", meaning="mean slope on the right", above=0)
    ripple_r: float = param(0.3, unit="1", meaning="ripple of the right slope, sin u")
    slope_l: float = param(0.8, unit="1", meaning="mean slope on the left", above=0)
    ripple_l: float = param(0.2, unit="1", meaning="ripple of the left slope, cos u")
    b_r: float = param(0.5, unit="1", meaning="right break point", at_least=0)
    b_l: float = param(-0.3, unit="1", meaning="left break point", at_most=0)

    def check(self) -> None:
        """Assumption 1 wants a positive slope everywhere."""
        for side in ("r", "l"):
            slope, ripple = getattr(self, f"slope_{side}"), getattr(self, f"ripple_{side}")
            if abs(ripple) >= slope:
                raise ParameterError(
                    f"DeadZone needs |ripple_{side}| < slope_{side}, so that the slope stays "
                    f"positive, got {ripple:g} and {slope:g}"
                )

    @equation
    def output(t, x, u, p):
        (u1,) = u
        if p.b_l < u1 < p.b_r:  # false for NaN, which then reaches v
            return (0.0,)
        if u1 > 0:
            return ((p.slope_r + p.ripple_r * np.sin(u1)) * (u1 - p.b_r),)
        return ((p.slope_l + p.ripple_l * np.cos(u1)) * (u1 - p.b_l),)

    @equation
    def switching(t, x, u, p):
        """The break points."""
        (u1,) = u
        return u1 - p.b_l, u1 - p.b_r


@record
class Gain(FromUToV):
    """Linear actuator.

        v = k u

    It obeys (2) where k > 0.  With k = -1 behind another actuator the sign of the input gain is
    reversed.

    Examples
    --------
    >>> reversed_sign = nlctl.block(nlctl.Gain(k=-1.0), "actuator")
    >>> print(reversed_sign.output(0, [], [0.7]))
    [-0.7]
    """

    k: float = param(1.0, unit="1", meaning="gain")

    @property
    def gains(self) -> tuple[float, float]:
        """Bounds (k_1, k_2) of k in (2): the gain."""
        return self.k, self.k

    @equation
    def output(t, x, u, p):
        return (p.k * u[0],)


@record
class Saturation(FromUToV):
    """Symmetric saturation, v = min(max(u, -limit), limit).

    No k >= k_1 > 0 keeps eps_u of (2) bounded for it: the paper's theory does not cover it.

    Examples
    --------
    >>> limit = nlctl.block(nlctl.Saturation(limit=2.0), "actuator")
    >>> [float(limit.output(0, [], [u])[0]) for u in (-5.0, 0.5, 5.0)]
    [-2.0, 0.5, 2.0]
    """

    limit: float = param(10.0, unit="1", meaning="largest |v|", above=0)

    no_split = BOUNDED_OUTPUT

    @equation
    def output(t, x, u, p):
        return (clip(u[0], -p.limit, p.limit),)

    @equation
    def switching(t, x, u, p):
        """Where it begins to saturate."""
        return u[0] + p.limit, u[0] - p.limit


@record
class AsymmetricSaturation(FromUToV):
    """Saturation with other slopes and limits on either side.

        v = min(slope_r u, limit_r)    u >= 0
            max(slope_l u, limit_l)    u < 0

    With equal slopes of 1 and equal limits it is `Saturation`.  It does not obey (2) either.

    Examples
    --------
    >>> record = nlctl.actuators.AsymmetricSaturation(slope_l=2.0, limit_l=-6.0)
    >>> limit = nlctl.block(record, "actuator")
    >>> [float(limit.output(0, [], [u])[0]) for u in (-5.0, -1.0, 1.0, 50.0)]
    [-6.0, -2.0, 1.0, 10.0]
    """

    slope_r: float = param(1.0, unit="1", meaning="slope on the right", above=0)
    slope_l: float = param(1.2, unit="1", meaning="slope on the left", above=0)
    limit_r: float = param(10.0, unit="1", meaning="greatest v", above=0)
    limit_l: float = param(-6.0, unit="1", meaning="least v", below=0)

    no_split = BOUNDED_OUTPUT

    @equation
    def output(t, x, u, p):
        slope = np.where(u[0] < 0, p.slope_l, p.slope_r)
        return (clip(slope * u[0], p.limit_l, p.limit_r),)

    @equation
    def switching(t, x, u, p):
        """Where the slope changes, and where it begins to saturate."""
        return u[0], p.slope_l * u[0] - p.limit_l, p.slope_r * u[0] - p.limit_r


@record
class Quantiser(FromUToV):
    """Uniform quantiser.

        v = q floor(u / q + 1/2)          mid-tread: 0 is a level
            q (floor(u / q) + 1/2)        mid-riser: 0 is a jump

    (Gersho, Gray, Vector Quantization and Signal Compression, 1992, section 5.2).  It obeys (2)
    with k = 1 and |eps_u| <= q / 2.

    Machine code locates its jumps.  Around a loop in continuous time it may slide along one, with
    what is between two levels as its mean.

    Examples
    --------
    >>> steps = nlctl.block(nlctl.Quantiser(q=0.5), "actuator")
    >>> [float(steps.output(0, [], [u])[0]) for u in (0.2, 0.3, -1.1)]
    [0.0, 0.5, -1.0]
    """

    q: float = param(0.1, unit="1", meaning="step", above=0)
    riser: bool = param(False, unit="1", meaning="whether 0 is a jump (mid-riser)")

    gains = (1.0, 1.0)

    @equation
    def output(t, x, u, p):
        half = np.where(p.riser, 0.5, 0.0)
        return (p.q * (np.floor(u[0] / p.q + 0.5 - half) + half),)

    @equation
    def band(t, u, p):
        return u - 0.5 * p.q, u + 0.5 * p.q
