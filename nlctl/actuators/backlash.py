"""Backlash: the play operator, whose memory is a state."""

from typing import Any

import numpy as np

from ..equations import equation
from ..errors import ParameterError
from ..functions import clip
from ..params import param, record
from .memories import Remembering, relaxation


@equation
def play_band(u, p):
    """Return the lower and upper output that the gap admits at input u."""
    # The lines are m_r (u - c_r), taken when u rises, and m_l (u - c_l), taken when it falls. With
    # unequal slopes they cross; sorting them keeps the operator defined and continuous there.
    rising, falling = p.m_r * (u - p.c_r), p.m_l * (u - p.c_l)
    return np.minimum(rising, falling), np.maximum(rising, falling)


@equation
def play(u, memory, p):
    """The play operator: the memory, pushed by the nearer side of the gap."""
    low, high = play_band(u, p)
    return clip(memory, low, high)


def check_gap(spec: Any) -> None:
    """Refuse a gap whose left end is not on the left of its right end."""
    if not spec.c_l < spec.c_r:
        who = type(spec).__name__
        raise ParameterError(f"{who} needs c_l < c_r, got {spec.c_l:g} and {spec.c_r:g}")


@record
class Backlash(Remembering):
    """Backlash as the play operator (Lv et al. 2017, Example 2).

        v = m_r (u - c_r)    u rises and v touches the right side of the gap
            m_l (u - c_l)    u falls and v touches the left side
            v(t-)            otherwise

    that is v(t) = min(max(v(t-), low(u)), high(u)): the memory clipped into the gap.  The paper's
    phi(u) is read as v(t-); any other reading is ill-posed in a closed loop.  The output lies in
    the gap from the first instant, whatever memory it starts from.

    Both engines of `nlctl.input_output_response` have this play: they locate where it reverses.
    Plain `control.input_output_response` has no hook for accepted steps.  There the memory relaxes
    onto the play, memory' = 1000/s (v - memory), and v is the memory clipped into the gap: exact on
    the sides of the gap, off by O(slope |u''| / rate^2) where it holds.  In Example 2 over 20 s the
    states are off by at most 1.8e-4.  The price is a stiff state: simulate with LSODA there.

    Parameters
    ----------
    v0 : float, optional
        Memory v(0-) at the start: the initial value of the state ``memory``.

    Examples
    --------
    Its output follows u half a gap behind, and holds where u reverses:

    >>> gap = nlctl.block(nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.5, c_l=-0.5), "actuator")
    >>> times = np.array([0.0, 1.0, 1.5, 2.0])
    >>> response = nlctl.input_output_response(gap, times, [0.0, 2.0, 1.2, 0.0])
    >>> print(response.outputs.round(6))
    [0.  1.5 1.5 0.5]
    """

    m_r: float = param(1.2, unit="1", meaning="slope of the right (rising) side", above=0)
    m_l: float = param(1.2, unit="1", meaning="slope of the left (falling) side", above=0)
    c_r: float = param(0.5, unit="1", meaning="right end of the gap, in u")
    c_l: float = param(-0.6, unit="1", meaning="left end of the gap, in u")

    states = ("memory",)

    def check(self) -> None:
        """The gap has a left and a right end, and the memory a finite start."""
        super().check()
        check_gap(self)

    @property
    def gains(self) -> tuple[float, float]:
        """Bounds (k_1, k_2) of k in (2): the slopes."""
        return min(self.m_r, self.m_l), max(self.m_r, self.m_l)

    @equation
    def output(t, x, u, p):
        """The memory clipped into the gap."""
        return (play(u[0], x[0], p),)

    commit = output  # the memory v(t-) becomes the output

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        """Contact with either side of the gap."""
        low, high = play_band(u[0], p)
        return x[0] - low, x[0] - high

    @equation
    def band(t, u, p):
        return play_band(u, p)
