"""What a faulty signal becomes, as blocks: from the healthy signal to the faulty one.

A fault begins at its ``onset`` and lasts ``duration`` seconds; before and afterwards the signal
passes as it is.  Where a condition begins it, `Latch` remembers since when that has been met.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..actuators.memories import RELAXATION
from ..equations import equation
from ..functions import noise_value
from ..params import param, record
from ..references import NoiseBand

NEVER = 1e12
"""A time in s that no run reaches: as an onset, a fault that does not begin."""

SHARPER = 20.0  # what is tracked is that much faster than what freezes it


@equation
def age(t, u, p):
    """Time since the onset (s); negative before it."""
    # With a condition `u` is (signal, on, since, ...), and the fault begins at the later one of
    # `since` and the onset; without, it is (signal, ...), one more signal at most.
    if u.size < 3:
        return t - p.onset
    if u[1] > 0.5:
        return t - np.maximum(u[2], p.onset)
    return -1.0


@equation
def is_present(t, u, p):
    """Whether the fault has begun and not ended."""
    return 0 <= age(t, u, p) < p.duration


def while_present(faulty: Callable[..., Any]) -> Callable[..., Any]:
    """Make the output equation of a fault from what the signal is while it lasts."""
    faulty = equation(faulty)

    @equation
    def output(t, x, u, p):
        if is_present(t, u, p):
            return (faulty(t, x, u, p),)
        return (u[0],)

    return output


@record
class _Effect:
    """What all faults share: when they are present."""

    onset: float = param(0.0, unit="s", meaning="time before which the fault does not begin")
    duration: float = param(NEVER, unit="s", meaning="how long it lasts, 1e12 for ever", above=0)
    has_condition: bool = False  # Whether a `Latch` begins it.

    outputs = ("faulty",)
    vector = True
    inputs = property(lambda self: ("signal", "on", "since") if self.has_condition else ("signal",))

    @equation
    def switching(t, x, u, p):
        """Beginning and end of the fault."""
        since = age(t, u, p)
        return since, since - p.duration


@record
class Bias(_Effect):
    """A constant offset: signal + value."""

    value: float = param(0.0, unit="1", meaning="offset, in the unit of the signal")

    output = while_present(lambda t, x, u, p: u[0] + p.value)


@record
class DriftFault(_Effect):
    """An offset that grows from 0 on: signal + value (t - onset)."""

    value: float = param(0.0, unit="1/s", meaning="rate of the offset")

    output = while_present(lambda t, x, u, p: u[0] + p.value * age(t, u, p))


@record
class LossOfEffectiveness(_Effect):
    """A wrong gain: value times the signal; 1 is healthy, 0 a total loss."""

    value: float = param(1.0, unit="1", meaning="factor")

    output = while_present(lambda t, x, u, p: p.value * u[0])


@record
class Noise(NoiseBand, _Effect):
    """Band-limited noise, a fixed function of time: see `nlctl.references.BandLimitedNoise`."""

    value: float = param(0.0, unit="1", meaning="root mean square of the noise", at_least=0)

    def derived(self) -> dict[str, Any]:
        """Frequencies and phases, those of `nlctl.references.BandLimitedNoise` with one signal."""
        omega, phase = self.spectrum(1)
        return {"omega": omega[0], "phase": phase[0]}

    output = while_present(lambda t, x, u, p: u[0] + noise_value(t, p.value, p.omega, p.phase))


@record
class Outage(_Effect):
    """Nothing arrives: 0 while it lasts (dropout), or for ever (disconnection)."""

    output = while_present(lambda t, x, u, p: 0.0 * u[0])  # NaN travels


@record
class StuckAt(_Effect):
    """Stuck at a given value, whatever the signal is."""

    value: float = param(0.0, unit="1", meaning="what it is stuck at, in the unit of the signal")

    output = while_present(lambda t, x, u, p: p.value + 0.0 * u[0])  # NaN travels


@record
class Late(_Effect):
    """What a transport delay outputs, instead of its input signal."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """The signal, what the latch says, and the signal as it was earlier."""
        return (*super().inputs, "late")

    output = while_present(lambda t, x, u, p: u[-1])


@record
class LockInPlace(_Effect):
    """Stuck at the value that the signal had at the onset.

    `nlctl.input_output_response` remembers that value at the onset, exactly.  In plain
    `control.input_output_response`, which has no hook for accepted steps, ``held`` follows the
    signal with 20,000/s and freezes when ``caught``, which rises with 1000/s from the onset on, has
    passed 1/2: 0.7 ms later.  The value is then off by about 0.7 ms of the signal's rate.
    """

    states = ("held", "caught")
    memory = states

    @equation
    def update(t, x, u, p):
        """Relaxation: the held value follows until it is caught."""
        begun = 1.0 if age(t, u, p) >= 0 else 0.0
        if x[1] > 0.5:
            return 0.0, RELAXATION * (begun - x[1])
        return SHARPER * RELAXATION * (u[0] - x[0]), RELAXATION * (begun - x[1])

    @equation
    def commit(t, x, u, p):
        """Catch the signal once, at the onset."""
        if age(t, u, p) >= 0 and x[1] <= 0.5:
            return u[0], 1.0
        return x[0], x[1]

    @equation
    def output(t, x, u, p):
        """The signal, what was caught while the fault lasts."""
        if is_present(t, u, p) and x[1] > 0.5:
            return (x[0],)
        return (u[0],)


@equation
def excess(u, p):
    """By how much the condition of a `Latch` is met; > 0 holds."""
    size = abs(u[0]) if p.magnitude else u[0]
    return p.sign * (size - p.level)


@record
class Latch:
    """Remembers since when a condition on a signal has been met: it need not last.

    The condition is watched > level; |watched| > level with `is_magnitude`, < with `is_below`.
    ``on`` is 1 from then on, and ``since`` the time at which it began (s).

    It is met exactly where the signal passes the level, also by a peak within one step.  In plain
    `control.input_output_response` ``on`` rises with 1000/s, and counts when it has passed 1/2: a
    condition that is met for less than 0.7 ms is not remembered, and what begins with it is late
    by 0.7 ms.

    Parameters
    ----------
    is_magnitude, is_below : bool, optional
    """

    level: float = param(1.0, unit="1", meaning="level, in the unit of the watched signal")
    is_magnitude: bool = False
    is_below: bool = False

    inputs = ("watched",)
    outputs = ("on", "since")
    states = outputs
    memory = outputs
    feedthrough = False

    def derived(self) -> dict[str, Any]:
        """Signs of the condition, for the equations."""
        return {"magnitude": int(self.is_magnitude), "sign": -1.0 if self.is_below else 1.0}

    @equation
    def switching(t, x, u, p):
        """By how much the condition is met."""
        return (excess(u, p),)

    @equation
    def update(t, x, u, p):
        """Relaxation: `on` rises while the condition is met, until then `since` follows t."""
        on, since = x
        if on > 0.5:
            return RELAXATION * (1.0 - on), 0.0
        met = 1.0 if excess(u, p) > 0 else 0.0
        return RELAXATION * (met - on), SHARPER * RELAXATION * (t - since)

    @equation
    def commit(t, x, u, p):
        """Remember the first time at which the condition is met."""
        on, since = x
        if on <= 0.5 and excess(u, p) > 0:
            return 1.0, t
        return on, since

    @equation
    def output(t, x, u, p):
        on, since = x
        return on, since
