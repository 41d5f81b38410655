r"""The integral of (32) and (33), as states of a block that is integrated with the loop.

.. math:: I(t) = \int_0^t [k G N(\zeta) + 1] \zeta' e^{-\alpha_1 (t - \tau)} d\tau, \quad
   I' = -\alpha_1 I + [k G N(\zeta) + 1] \zeta' .
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.equations import equation
from nlctl.params import param, record

from ..bounds.clipped import clipped_split
from ..bounds.decomposition import Decomposition


@as_annotated
def sharpest(split: Decomposition) -> Decomposition:
    """Return the split with the same bounds of k and the smallest abs(eps_u) at every (u, v).

    Bounds of eps_u that hold for any split with these k_1, k_2 hold for this one, which is the
    one that is evaluated along trajectories.  Machine code can call its ``part``.

    Parameters
    ----------
    split : Decomposition
        Any split of the actuator.

    Returns
    -------
    Decomposition
        With the same k_1 and k_2, and a smaller or equal eps_u*.

    Examples
    --------
    Where v = k u is within the bounds of k nothing is left for eps_u:

    >>> import nlctl
    >>> from nlctl.analysis.lyapunov import decompose, sharpest
    >>> split = decompose(nlctl.DeadZone(ripple_r=0, ripple_l=0))
    >>> zone = nlctl.block(nlctl.DeadZone(ripple_r=0, ripple_l=0), "actuator")
    >>> v = float(zone.output(0, [], [10.0])[0])
    >>> print(v, sharpest(split).part(10.0, v), split.part(10.0, v))
    9.5 9.5 10.0
    """
    return dataclasses.replace(split, part=clipped_split(split.k_1, split.k_2))


@record
class NussbaumIntegral:
    """The integrals of (32) and (33), three readings of the latter.

        I'         = -alpha_1 I + w,             w = [k G N(zeta) + 1] zeta' = r G k u + zeta'
        I_bar'     = -alpha_1 I_bar + |w|
        I_printed' = -alpha_1 I_printed + |k G N(zeta) + 1| zeta'

    sup I is the Q that (34) needs; sup I_bar bounds it; the integral that is printed in (33),
    with the bar over the bracket alone, does not, since zeta' may be negative.

    Parameters
    ----------
    part : equation, optional
        ``part(u, v)`` is k u of the actuator's split (2); by default k = 1.

    Examples
    --------
    Its three integrals are states and outputs:

    >>> import nlctl
    >>> from nlctl.analysis.lyapunov import NussbaumIntegral
    >>> nlctl.block(NussbaumIntegral(), "integral").state_labels
    ['I', 'I_bar', 'I_printed']
    """

    alpha_1: float = param(0.25, unit="1/s", meaning="rate of the weight", at_least=0)
    part: Callable[[Any, Any], Any] = clipped_split(1.0, 1.0)

    inputs = ("r", "u", "v", "G", "rate_zeta")
    outputs = ("kGu", "I", "I_bar", "I_printed")
    states = ("I", "I_bar", "I_printed")
    feedthrough = True

    @cached_property
    def output(self) -> Callable:
        """k G u, and the integrals."""
        part = equation(self.part)

        @equation
        def output(t, x, u, p):
            _, control, v, G, _ = u
            return G * part(control, v), x[0], x[1], x[2]

        return output

    @cached_property
    def update(self) -> Callable:
        """The integrands."""
        part = equation(self.part)

        @equation
        def update(t, x, u, p):
            r, control, v, G, rate_zeta = u
            I, I_bar, I_printed = x  # noqa: E741
            w = r * G * part(control, v) + rate_zeta
            return (
                -p.alpha_1 * I + w,
                -p.alpha_1 * I_bar + abs(w),
                -p.alpha_1 * I_printed + abs(w) * np.sign(rate_zeta),
            )

        return update
