"""Actuators with uncertain nonlinearity, v = k(u, t) u + eps_u (2): dead zone and backlash.

Saturation does not obey (2), and a gain of the wrong sign breaks Assumption 1: both are here to
see what a controller makes of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import control as ct
import numpy as np

from ._diagram import as_system, interconnect
from ._equation import equation
from ._errors import DiagramError, ParameterError
from ._param import as_numbers, param, record
from .functions import clip

__all__ = ["Backlash", "DeadZone", "Gain", "Saturation", "cascade"]


@record
class DeadZone:
    """Asymmetric dead zone with slopes that depend on the input (Lv et al. 2017, Example 1).

    v = (1 + 0.3 sin u) (u - b_r)      u >= b_r
        0                              b_l < u < b_r
        (0.8 + 0.2 cos u) (u - b_l)    u <= b_l
    """

    slope_r: float = param(1.0, unit="1", meaning="mean slope on the right", above=0)
    ripple_r: float = param(0.3, unit="1", meaning="ripple of the right slope, sin u")
    slope_l: float = param(0.8, unit="1", meaning="mean slope on the left", above=0)
    ripple_l: float = param(0.2, unit="1", meaning="ripple of the left slope, cos u")
    b_r: float = param(0.5, unit="1", meaning="right break point", above=0)
    b_l: float = param(-0.3, unit="1", meaning="left break point", below=0)

    inputs = ("u",)
    outputs = ("v",)
    states = ()
    feedthrough = True

    def check(self) -> None:
        """Assumption 1 wants a positive slope everywhere."""
        for side in ("r", "l"):
            slope, ripple = getattr(self, f"slope_{side}"), getattr(self, f"ripple_{side}")
            if abs(ripple) >= slope:
                raise ParameterError(
                    f"DeadZone needs |ripple_{side}| < slope_{side}, so that the slope stays "
                    f"positive, got {ripple:g} and {slope:g}"
                )

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The characteristic v(u)."""
        (u1,) = u
        if p.b_l < u1 < p.b_r:  # false for NaN, which then reaches v
            return (0.0,)
        if u1 > 0:
            return ((p.slope_r + p.ripple_r * np.sin(u1)) * (u1 - p.b_r),)
        return ((p.slope_l + p.ripple_l * np.cos(u1)) * (u1 - p.b_l),)

    @staticmethod
    @equation
    def corners(t, x, u, p):
        """The break points."""
        (u1,) = u
        return u1 - p.b_l, u1 - p.b_r


@equation
def play_band(u, p):
    """Return the lower and upper output that the gap admits at input u.

    The lines are m_r (u - c_r), taken when u rises, and m_l (u - c_l), taken when it falls.  With
    unequal slopes they cross; sorting them keeps the operator defined and continuous there.
    """
    rising, falling = p.m_r * (u - p.c_r), p.m_l * (u - p.c_l)
    return np.minimum(rising, falling), np.maximum(rising, falling)


@equation
def play(u, memory, p):
    """The play operator: the memory, carried along by the nearer side of the gap."""
    low, high = play_band(u, p)
    return clip(memory, low, high)


@record
class Backlash:
    """Backlash as the play operator (Lv et al. 2017, Example 2).

        v = m_r (u - c_r)    u rises and v touches the right side of the gap
            m_l (u - c_l)    u falls and v touches the left side
            v(t-)            otherwise

    that is v(t) = min(max(v(t-), low(u)), high(u)): the memory clipped into the gap.  The paper's
    phi(u) is read as v(t-); any other reading is ill-posed in a closed loop.  The output lies in
    the gap from the first instant, whatever memory it starts from.

    In python-control, which has no accepted-step hook, the memory is a state that relaxes onto
    the play, memory' = rate (v - memory), and v is the memory clipped into the gap.  On the sides
    of the gap v is then exact, whatever the rate; where it holds, it misses the turning value by
    O(slope |u''| / rate^2).  In Example 2 over 20 s the states are off by at most 1.5e-2, 1.8e-4
    and 1.8e-6 at rates of 100, 1000 and 10,000 1/s.  The price is a stiff state: simulate with
    ``method="LSODA"`` and rtol <= 1e-8 (the default of `nlctl.input_output_response`).

    Parameters
    ----------
    v0 : float, optional
        Memory v(0-) at the start: the initial value of the state ``memory``.
    """

    m_r: float = param(1.2, unit="1", meaning="slope of the right (rising) side", above=0)
    m_l: float = param(1.2, unit="1", meaning="slope of the left (falling) side", above=0)
    c_r: float = param(0.5, unit="1", meaning="right end of the gap, in u")
    c_l: float = param(-0.6, unit="1", meaning="left end of the gap, in u")
    rate: float = param(1e3, unit="1/s", meaning="relaxation rate of the memory", above=0)
    v0: float = 0.0

    inputs = ("u",)
    outputs = ("v",)
    states = ("memory",)
    memory = ("memory",)
    feedthrough = True

    @property
    def initial(self) -> dict[str, float]:
        """The memory starts from v(0-)."""
        return {"memory": self.v0}

    def check(self) -> None:
        """The gap has a left and a right end, and the memory a finite start."""
        number = as_numbers(self.v0)
        if number is None or number.ndim or not np.isfinite(number):
            raise ParameterError(f"Backlash needs a finite v0, got {self.v0!r}")
        if not self.c_l < self.c_r:
            raise ParameterError(f"Backlash needs c_l < c_r, got {self.c_l:g} and {self.c_r:g}")

    @staticmethod
    @equation
    def update(t, x, u, p):
        """Relaxation of the memory onto the play."""
        (memory,) = x
        (u1,) = u
        return (p.rate * (play(u1, memory, p) - memory),)

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The memory clipped into the gap."""
        (memory,) = x
        (u1,) = u
        return (play(u1, memory, p),)

    commit = output  # the memory v(t-) becomes the output

    @staticmethod
    @equation
    def corners(t, x, u, p):
        """Contact with either side of the gap."""
        (memory,) = x
        (u1,) = u
        low, high = play_band(u1, p)
        return memory - low, memory - high


@record
class Gain:
    """Linear actuator.

    v = k u

    With k = -1 behind another actuator the sign of the input gain is turned round.
    """

    k: float = param(1.0, unit="1", meaning="gain")

    inputs = ("u",)
    outputs = ("v",)
    states = ()
    feedthrough = True

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The gain."""
        return (p.k * u[0],)


@record
class Saturation:
    """Symmetric saturation, v = min(max(u, -limit), limit).

    No k >= k_1 > 0 keeps eps_u of (2) bounded for it: the paper's theory does not cover it.
    """

    limit: float = param(10.0, unit="1", meaning="largest |v|", above=0)

    inputs = ("u",)
    outputs = ("v",)
    states = ()
    feedthrough = True

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The characteristic v(u)."""
        return (clip(u[0], -p.limit, p.limit),)

    @staticmethod
    @equation
    def corners(t, x, u, p):
        """Where it begins to saturate."""
        return u[0] + p.limit, u[0] - p.limit


def cascade(stages: Mapping[str, Any], *, name: str = "actuator") -> ct.InterconnectedSystem:
    """Join actuators in series: the output v of each is the input u of the next.

    Parameters
    ----------
    stages : mapping
        ``{"limit": Saturation(), "dead_zone": DeadZone()}``, in the order of the signal flow;
        each has the input u and the output v.  Parameters are then
        ``"actuator.dead_zone.b_r"``.
    name : str, optional

    Returns
    -------
    control.InterconnectedSystem
        From u to v; it stands in the place of an actuator.

    Raises
    ------
    DiagramError
        If there is no stage, or one has other signals.
    """
    if not isinstance(stages, Mapping):
        raise DiagramError(
            f"cascade needs stages with their names, {{'limit': ...}}, got {type(stages).__name__}"
        )
    systems, last = [], len(stages) - 1
    for i, (key, stage) in enumerate(stages.items()):
        system = as_system(stage, key).copy(name=key)
        if (system.input_labels, system.output_labels) != (["u"], ["v"]):
            raise DiagramError(
                f"cascade needs stages from u to v, '{key}' goes from "
                f"{system.input_labels} to {system.output_labels}"
            )
        system.update_names(
            inputs=[f"v{i}" if i else "u"], outputs=["v" if i == last else f"v{i + 1}"]
        )
        systems.append(system)
    if not systems:
        raise DiagramError("cascade needs at least one stage, got none")
    return interconnect(systems, inputs=["u"], outputs=["v"], name=name)
