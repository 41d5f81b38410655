"""Test signals of time: step, ramp, sine, square, pulses, chirp, and tables of data.

Each has one output, `ref` unless it is given another name.  What jumps in them depends on t alone:
both engines solve it before a run, so that no pulse is stepped over.
"""

from typing import Any

import numpy as np

from .arguments import are_names, flag, names_in, one_of
from .equations import equation
from .errors import ParameterError
from .params import Floats, param, record

__all__ = ["Chirp", "Pulse", "PulseTrain", "Ramp", "Sine", "Square", "Step", "TimeTable"]

_EARLY = 1 + 2.0**-50  # start + k period, which rounding moves, has begun its period
_MOST = 4096  # points of a table


@record
class _Source:
    """What sources share."""

    outputs: tuple[str, ...] = ("ref",)  # Name of the signal.

    inputs = ()
    feedthrough = False

    def check(self) -> None:
        """One output."""
        names = names_in(self.outputs)
        if len(names) != 1 or not are_names(names):
            raise ParameterError(f"{type(self).__name__} needs one name in outputs, got {names}")
        object.__setattr__(self, "outputs", names)


@equation
def since_period(t, start, period):
    """How long the period at time t has lasted; one begins at start + k period."""
    periods = (t - start) / period * _EARLY
    return period * (periods - np.floor(periods))


@record
class Step(_Source):
    """Step: offset before t_step, offset + height from then on.

        ref = offset + height [t >= t_step]

    Examples
    --------
    >>> step = nlctl.block(nlctl.Step(height=2.0, t_step=1.0), "step")
    >>> print(step.output(0.9, [], []), step.output(1.0, [], []))
    [0.] [2.]
    """

    height: float = param(1.0, unit="1", meaning="height of the step")
    t_step: float = param(0.0, unit="s", meaning="time of the step")
    offset: float = param(0.0, unit="1", meaning="value before the step")

    @equation
    def output(t, x, u, p):
        """The value on either side of the step."""
        if t >= p.t_step:
            return (p.offset + p.height,)
        return (p.offset,)


@record
class Ramp(_Source):
    """Ramp: offset before t_start, and a constant slope from then on.

        ref = offset + slope max(t - t_start, 0)

    Examples
    --------
    >>> ramp = nlctl.block(nlctl.sources.Ramp(slope=2.0, t_start=1.0), "ramp")
    >>> print(ramp.output(0.5, [], []), ramp.output(4.0, [], []))
    [0.] [6.]
    """

    slope: float = param(1.0, unit="1/s", meaning="slope")
    t_start: float = param(0.0, unit="s", meaning="time at which the ramp begins")
    offset: float = param(0.0, unit="1", meaning="value before the ramp")

    @equation
    def output(t, x, u, p):
        """A kink at t_start."""
        return (p.offset + p.slope * np.maximum(t - p.t_start, 0.0),)


@record
class Sine(_Source):
    """Sine with an offset; `nlctl.SumOfSines` has several, with derivatives.

        ref = offset + amplitude sin(omega t + phase)

    Examples
    --------
    >>> sine = nlctl.block(nlctl.Sine(amplitude=2.0, phase=np.pi / 2), "sine")
    >>> print(sine.output(0, [], []))
    [2.]
    """

    amplitude: float = param(1.0, unit="1", meaning="amplitude")
    omega: float = param(1.0, unit="rad/s", meaning="angular frequency", at_least=0)
    phase: float = param(0.0, unit="rad", meaning="phase at t = 0", symbol="phi")
    offset: float = param(0.0, unit="1", meaning="mean value")

    @equation
    def output(t, x, u, p):
        return (p.offset + p.amplitude * np.sin(p.omega * t + p.phase),)


@record
class Square(_Source):
    """Square wave: offset + amplitude in the first part of each period, then offset - amplitude.

        ref = offset               before t_start
              offset + amplitude   for tau mod period < duty period
              offset - amplitude   for the rest of the period

    with tau = t - t_start.  With duty = 1/2 its Fourier series from t_start on is

        ref = offset + 4 amplitude / pi sum_n sin(n omega tau) / n

    over n = 1, 3, 5, ..., where omega = 2 pi / period.

    Examples
    --------
    >>> square = nlctl.block(nlctl.sources.Square(period=2.0, duty=0.25), "square")
    >>> print([float(square.output(t, [], [])[0]) for t in (0.0, 0.4, 0.5, 1.9, 2.0)])
    [1.0, 1.0, -1.0, -1.0, 1.0]
    """

    amplitude: float = param(1.0, unit="1", meaning="amplitude")
    period: float = param(1.0, unit="s", meaning="period", above=0, symbol="T")
    duty: float = param(0.5, unit="1", meaning="part of each period that is high", above=0, below=1)
    t_start: float = param(0.0, unit="s", meaning="beginning of the first period")
    offset: float = param(0.0, unit="1", meaning="value in the middle")

    @equation
    def output(t, x, u, p):
        """High at first in each period, then low."""
        if t < p.t_start:
            return (p.offset,)
        if since_period(t, p.t_start, p.period) < p.duty * p.period:
            return (p.offset + p.amplitude,)
        return (p.offset - p.amplitude,)


@record
class Pulse(_Source):
    """One rectangular pulse.

        ref = offset + height [t_start <= t < t_start + width]

    Examples
    --------
    However narrow it is, no step leads over it: its integral is height times width.

    >>> integrator = ct.ss(0, 1, 1, 0, inputs="ref", outputs="y", name="integrator")
    >>> pulse = nlctl.sources.Pulse(height=5.0, t_start=60.0, width=1e-3)
    >>> loop = nlctl.interconnect({"pulse": pulse, "integrator": integrator}, outputs=["y"])
    >>> print(nlctl.input_output_response(loop, [0, 100]).outputs[0, -1].round(9))
    0.005
    """

    height: float = param(1.0, unit="1", meaning="height of the pulse")
    t_start: float = param(0.0, unit="s", meaning="beginning of the pulse")
    width: float = param(0.1, unit="s", meaning="duration of the pulse", above=0)
    offset: float = param(0.0, unit="1", meaning="value outside of the pulse")

    @equation
    def output(t, x, u, p):
        """High within the pulse."""
        if p.t_start <= t < p.t_start + p.width:
            return (p.offset + p.height,)
        return (p.offset,)


@record
class PulseTrain(_Source):
    """Rectangular pulses, one at the beginning of each period.

        ref = offset + height   for 0 <= tau and tau mod period < width
              offset            otherwise,   tau = t - t_start

    Examples
    --------
    >>> train = nlctl.block(nlctl.sources.PulseTrain(period=1.0, width=0.25), "train")
    >>> print([float(train.output(t, [], [])[0]) for t in (-0.9, 0.1, 0.25, 3.2)])
    [0.0, 1.0, 0.0, 1.0]
    """

    height: float = param(1.0, unit="1", meaning="height of the pulses")
    t_start: float = param(0.0, unit="s", meaning="beginning of the first pulse")
    width: float = param(0.1, unit="s", meaning="duration of each pulse", above=0)
    period: float = param(1.0, unit="s", meaning="from one pulse to the next", above=0, symbol="T")
    offset: float = param(0.0, unit="1", meaning="value between pulses")

    def check(self) -> None:
        """A pulse ends before the next one begins."""
        super().check()
        if not self.width < self.period:
            raise ParameterError(
                f"PulseTrain needs width < period, got {self.width:g} and {self.period:g}: "
                "pulses that touch are a Step"
            )

    @equation
    def output(t, x, u, p):
        """High at the beginning of each period."""
        if t >= p.t_start and since_period(t, p.t_start, p.period) < p.width:
            return (p.offset + p.height,)
        return (p.offset,)


@record
class Chirp(_Source):
    """Sine whose frequency sweeps from omega_0 at t = 0 to omega_1 at t_1, and stays there.

        ref = offset + amplitude sin(phi(t)),   phi' = omega(t),   phi(0) = phase
        omega(t) = omega_0 + (omega_1 - omega_0) t / t_1         (linear)
        omega(t) = omega_0 (omega_1 / omega_0)^(t / t_1)         (logarithmic)

    with omega = omega_0 before t = 0 and omega_1 behind t_1.

    Parameters
    ----------
    sweep : {"linear", "logarithmic"}, optional
        How the frequency changes with time.

    Examples
    --------
    The mean frequency of a linear sweep is that in its middle, here 2 pi rad/s for 10 s:

    >>> chirp = nlctl.sources.Chirp(omega_0=0.0, omega_1=4 * np.pi, t_1=10.0, phase=np.pi / 2)
    >>> print(nlctl.block(chirp, "chirp").output(10.0, [], []).round(9))
    [1.]
    """

    sweep: str = "linear"
    amplitude: float = param(1.0, unit="1", meaning="amplitude")
    omega_0: float = param(0.1, unit="rad/s", meaning="frequency at t = 0", at_least=0)
    omega_1: float = param(1.0, unit="rad/s", meaning="frequency from t_1 on", at_least=0)
    t_1: float = param(10.0, unit="s", meaning="duration of the sweep", above=0)
    phase: float = param(0.0, unit="rad", meaning="phase at t = 0", symbol="phi")
    offset: float = param(0.0, unit="1", meaning="mean value")

    def check(self) -> None:
        """One of two sweeps; a ratio of frequencies needs both above 0."""
        super().check()
        one_of("Chirp", "sweep", self.sweep, ("linear", "logarithmic"))
        for name in ("omega_0", "omega_1") if self.sweep == "logarithmic" else ():
            if not getattr(self, name) > 0:
                raise ParameterError(
                    f"Chirp needs {name} > 0 for a logarithmic sweep, got {getattr(self, name):g}"
                )

    def derived(self) -> dict[str, Any]:
        """The rate of a logarithmic sweep (1/s), 0 of one that is none."""
        if self.sweep == "linear":
            return {"rate": 0.0}
        return {"rate": float(np.log(self.omega_1 / self.omega_0)) / self.t_1}

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The integral of the frequency, in three parts: before, within and behind the sweep."""
        swept = np.minimum(np.maximum(t, 0.0), p.t_1)
        if p.rate != 0:
            angle = p.omega_0 * np.expm1(p.rate * swept) / p.rate
        elif p.omega_0 == p.omega_1:
            angle = p.omega_0 * swept
        else:
            angle = swept * (p.omega_0 + 0.5 * (p.omega_1 - p.omega_0) * swept / p.t_1)
        angle += p.omega_0 * np.minimum(t, 0.0) + p.omega_1 * np.maximum(t - p.t_1, 0.0)
        return (p.offset + p.amplitude * np.sin(angle + p.phase),)


@record
class TimeTable(_Source):
    """A table of data over time: straight lines from one point to the next, or held values.

        ref = values[k] + slope_k (t - times[k])
        ref = values[k]                              (hold)

    for times[k] <= t < times[k+1], with the slope to the next point.  Before the first time and
    behind the last one it stays at its first and last value; with `periodic` it begins again at
    the last time, at which the period ends.  At most 4096 points; more are an input of the run.

    Examples
    --------
    >>> table = nlctl.sources.TimeTable(times=(0.0, 1.0, 3.0), values=(0.0, 2.0, 0.0))
    >>> print(nlctl.block(table, "table").output(2.0, [], []))
    [1.]
    """

    hold: bool = False  # Whether each value is held until the next time (zero-order hold).
    periodic: bool = False  # Whether it repeats, with the period times[-1] - times[0].
    times: Floats = param((0.0, 1.0), unit="s", meaning="times t_k", symbol="tau")
    values: Floats = param((0.0, 1.0), unit="1", meaning="values at these times")

    vector = True

    def check(self) -> None:
        """Times increase, and each has a value."""
        super().check()
        flag("TimeTable", "hold", self.hold)
        flag("TimeTable", "periodic", self.periodic)
        n = len(self.times)
        if not 2 <= n <= _MOST:
            raise ParameterError(
                f"TimeTable needs 2 to {_MOST} times, got {n}: what is longer is an input of the "
                "run, nlctl.input_output_response(loop, times, values), with hold='zoh' for steps"
            )
        if n != len(self.values):
            raise ParameterError(
                f"TimeTable needs as many values as times, got {len(self.values)} and {n}"
            )
        steps = np.diff(self.times)
        if not np.all(steps > 0):
            k = int(np.argmax(~(steps > 0)))
            raise ParameterError(
                f"TimeTable needs increasing times, got times[{k}] = {self.times[k]:g} and "
                f"times[{k + 1}] = {self.times[k + 1]:g}"
            )
        with np.errstate(over="ignore"):
            slopes = np.diff(self.values) / steps
        if not self.hold and not np.all(np.isfinite(slopes)):
            k = int(np.argmax(~np.isfinite(slopes)))
            raise ParameterError(
                f"TimeTable needs slopes that are finite, got {steps[k]:g} "
                f"s between times[{k}] and times[{k + 1}]"
            )

    def derived(self) -> dict[str, Any]:
        """Slopes of the pieces (1/s), 0 of held values."""
        slopes = np.diff(self.values) / np.diff(self.times)
        return {"slopes": np.zeros_like(slopes) if self.hold else slopes, "periods": self.periodic}

    @equation
    def output(t, x, u, p):
        """The piece that holds now; the first and the last value outside of all."""
        first, last = p.times[0], p.times[-1]
        if p.periods:
            t = first + since_period(t, first, last - first)
        elif t < first:
            return (p.values[0],)
        elif t >= last:
            return (p.values[-1],)
        here = (p.times[:-1] <= t) & (t < p.times[1:])
        pieces = p.values[:-1] + p.slopes * (t - p.times[:-1])
        return (np.sum(np.where(here, pieces, 0.0)),)
