"""Quantiser: an input rounded to steps."""

from __future__ import annotations

import numpy as np

from ..equations import equation
from ..params import param, record


@record
class Quantiser:
    """Uniform quantiser.

        v = q floor(u / q + 1/2)          mid-tread: 0 is a level
            q (floor(u / q) + 1/2)        mid-riser: 0 is a jump

    (Gersho, Gray, Vector Quantization and Signal Compression, 1992, section 5.2).  It obeys (2)
    with k = 1 and |eps_u| <= q / 2.

    Its jumps are the zeros of a sine, which changes its sign at each: machine code locates them
    unless one step passes an even number of them, which the error control of what v drives sees.
    Around a loop in continuous time it may chatter along a jump; the run then ends as
    `CHATTERING`, and says where.

    Examples
    --------
    >>> steps = nlctl.block(nlctl.Quantiser(q=0.5), "actuator")
    >>> [float(steps.output(0, [], [u])[0]) for u in (0.2, 0.3, -1.1)]
    [0.0, 0.5, -1.0]
    """

    q: float = param(0.1, unit="1", meaning="step", above=0)
    riser: bool = param(False, unit="1", meaning="whether 0 is a jump (mid-riser)")

    inputs = ("u",)
    outputs = ("v",)
    states = ()
    feedthrough = True
    gains = (1.0, 1.0)

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The nearest level."""
        half = np.where(p.riser, 0.5, 0.0)
        return (p.q * (np.floor(u[0] / p.q + 0.5 - half) + half),)

    @staticmethod
    @equation
    def switching(t, x, u, p):
        """The jumps."""
        return (np.sin(np.pi * (u[0] / p.q + np.where(p.riser, 0.0, 0.5))),)

    @staticmethod
    @equation
    def band(t, u, p):
        """Least and greatest output at input u."""
        return u - 0.5 * p.q, u + 0.5 * p.q
