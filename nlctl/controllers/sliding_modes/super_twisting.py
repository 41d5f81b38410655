"""Super-twisting sliding mode: a continuous law that compensates a disturbance of bounded rate."""

from __future__ import annotations

import numpy as np

from ...equations import equation
from ...params import param, record

__all__ = ["SuperTwistingLaw"]


@record
class SuperTwistingLaw:
    """Super-twisting law with a boundary layer, in the place of `SlidingModeLaw`.

        u = -k_1 |r|^(1/2) sign(r) + w,   w' = -k_2 sign(r)          |r| >= phi
        u = -k_1 r / phi^(1/2) + w,       w' = -k_2 r / phi          |r| <= phi

    (Levant, International Journal of Control 58, 1993, p. 1247, here without the bounds of u; the
    layer is ours.)  For r' = u + d with |d'| <= L it reaches r = 0 in finite time, without the
    layer, if for instance k_1 = 1.5 sqrt(L), k_2 = 1.1 L, and u is continuous; d itself may be of
    any size.  Where d' is constant, |r| ends at phi |d'| / k_2.  Crossings of r = 0 without a layer
    accumulate, no step size would follow them; within it the law is linear.  It assumes an input
    gain whose sign is known and positive.

    Examples
    --------
    >>> law = nlctl.block(nlctl.controllers.SuperTwistingLaw(k_1=6.0, k_2=8.0), "law")
    >>> print(law.output(0, [1.5], [0.25]), law.dynamics(0, [1.5], [0.25]))  # w - k_1 sqrt(r), -k_2
    [-1.5] [-8.]
    """

    k_1: float = param(6.0, unit="1", meaning="gain of the square root of r", above=0)
    k_2: float = param(8.0, unit="1/s", meaning="rate of w outside of the layer", above=0)
    phi: float = param(0.01, unit="1", meaning="half width of the boundary layer of r", above=0)

    inputs = ("r",)
    outputs = ("u",)
    states = ("w",)
    feedthrough = True

    @staticmethod
    @equation
    def update(t, x, u, p):
        """The integral of the sign."""
        (r,) = u
        return (-p.k_2 * r / np.maximum(np.absolute(r), p.phi),)

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The law."""
        (w,) = x
        (r,) = u
        return (w - p.k_1 * r / np.sqrt(np.maximum(np.absolute(r), p.phi)),)

    @staticmethod
    @equation
    def switching(t, x, u, p):
        """The edges of the layer."""
        (r,) = u
        return r + p.phi, r - p.phi
