"""Five cars that run towards minus infinity, four of which keep their distance from the car ahead.

Simulink's ``cars`` (after Hu, Lygeros, Sastry: Towards a theory of stochastic hybrid systems, HSCC
2000).  Equations were read from the charts, ``arch/arch20/shared/benchmarks/chasing-cars/cars.mdl``
in github.com/ismailbennani/zlscheck; they are in continuous time, and so they are here.  ZlsCheck
takes Euler's step of 0.01 s (``models/cc``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from inputs import pieces

import nlctl

COUNT, PERIOD = 40, 2.5  # pieces of throttle and brake, s
KEEPING, CHASING, BRAKING = 0.0, 1.0, -1.0


@nlctl.record
class Leader:
    """The first car: y' = v, v' = -throttle - brake v."""

    inputs, outputs, states, feedthrough = ("throttle", "brake"), ("y1",), ("y", "v"), False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Motion under both pedals."""
        return x[1], -u[0] - u[1] * x[1]

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """Where it is."""
        return (x[0],)


@nlctl.record
class Follower:
    """A car behind another one.

    ========  ========  =======  =============================================
    mode      y'        v'       until
    ========  ========  =======  =============================================
    chasing   -v        1        gap <= 10: keeping
    keeping   v         0        gap >= 15: chasing; gap <= 5: braking
    braking   -v        -v       gap >= 20: chasing
    ========  ========  =======  =============================================

    The chart starts in chasing and finds a gap of 10: it is keeping at once.
    """

    ahead: str
    place: str
    first: float = nlctl.param(10.0, unit="m", meaning="where it starts")

    states, feedthrough = ("y", "v", "mode"), False

    @property
    def inputs(self) -> tuple[str, ...]:
        """The place of the car ahead."""
        return (self.ahead,)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Its own place."""
        return (self.place,)

    @property
    def initial(self) -> dict[str, float]:
        """At rest, keeping."""
        return {"y": self.first}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        """Motion in each mode."""
        v, mode = x[1], x[2]
        keeps, chases = abs(mode) < 0.5, mode > 0.5
        return np.where(keeps, v, -v), np.where(chases, 1.0, np.where(keeps, 0.0 * v, -v)), 0.0

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """Where it is."""
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def guard(t, x, u, p):
        """How far the gap is from the end of the mode."""
        gap, mode = x[0] - u[0], x[2]
        keeps, chases = abs(mode) < 0.5, mode > 0.5
        kept = np.minimum(15.0 - gap, gap - 5.0)
        return (np.where(chases, gap - 10.0, np.where(keeps, kept, 20.0 - gap)),)

    @staticmethod
    @nlctl.equation
    def reset(t, x, u, p):
        """The next mode."""
        gap, mode = x[0] - u[0], x[2]
        left = np.where(gap > 10.0, CHASING, BRAKING)
        keeps, chases = abs(mode) < 0.5, mode > 0.5
        return x[0], x[1], np.where(chases, KEEPING, np.where(keeps, left, CHASING))


@nlctl.record
class Gaps:
    """What requirements look at: y2 - y1 and y5 - y4."""

    inputs, outputs, states, feedthrough = ("y1", "y2", "y4", "y5"), ("gap2", "gap5"), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """Both differences."""
        return u[1] - u[0], u[3] - u[2]


def cars(**pedals: Any) -> Any:
    """Return the cars; throttle and brake are given blocks, or inputs of the diagram."""
    outside = [pedal for pedal in ("throttle", "brake") if pedal not in pedals]
    behind = {
        f"car{i}": Follower(ahead=f"y{i - 1}", place=f"y{i}", first=10.0 * (i - 1))
        for i in range(2, 6)
    }
    return nlctl.interconnect(
        {**pedals, "car1": Leader(), **behind, "gaps": Gaps()},
        inputs=outside,
        outputs=["gap2", "gap5"],
    )


def plant() -> Any:
    """Return the cars, the first of which has pedals that are constant for 2.5 s each."""
    return cars(throttle=pieces("throttle", COUNT, PERIOD), brake=pieces("brake", COUNT, PERIOD))
