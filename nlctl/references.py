"""Desired trajectories with their derivatives, and noise.

Each reference of order n outputs yd and its derivatives yd1, ..., ydn (yd', ..., yd^(n)).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from .arguments import pairs
from .equations import equation
from .errors import ParameterError
from .functions import noise_spectrum, noise_value
from .params import HIGHEST_ORDER, Floats, param, record, set_integer
from .wording import counted

__all__ = ["BandLimitedNoise", "FilteredStep", "FunctionReference", "SumOfSines"]


def derivative_names(order: int) -> tuple[str, ...]:
    """Return ("yd", "yd1", ..., "ydn")."""
    return ("yd", *(f"yd{k}" for k in range(1, order + 1)))


@record
class _Reference:
    """What references share: yd and its derivatives."""

    order: int = 2  # Number n >= 0 of derivatives that are outputs.

    inputs = ()
    feedthrough = False
    outputs = property(lambda self: derivative_names(self.order))

    def check(self) -> None:
        """An integer number of derivatives."""
        set_integer(self, "order", at_least=0, at_most=HIGHEST_ORDER)


@record
class SumOfSines(_Reference):
    """Sum of sines with all derivatives up to order n; by default the paper's.

        yd = sum_i a_i sin(w_i t + phi_i) = 0.5 (sin t + sin 0.5 t)

    Examples
    --------
    The paper's reference at t = 0, with two derivatives:

    >>> reference = nlctl.block(nlctl.SumOfSines(order=2), "reference")
    >>> print(reference.output(0, [], []).round(9))
    [0.   0.75 0.  ]
    """

    amplitudes: Floats = param((0.5, 0.5), unit="1", meaning="amplitudes a_i", symbol="a")
    frequencies: Floats = param(
        (1.0, 0.5), unit="rad/s", meaning="frequencies w_i", at_least=0, symbol="w"
    )
    phases: Floats = param((0.0, 0.0), unit="rad", meaning="phases phi_i", symbol="phi")

    def derived(self) -> dict[str, Any]:
        """The number of derivatives, for the equation."""
        return {"order": self.order}

    def check(self) -> None:
        """One amplitude, frequency and phase per sine."""
        super().check()
        sizes = len(self.amplitudes), len(self.frequencies), len(self.phases)
        if len(set(sizes)) > 1:
            raise ParameterError(
                "SumOfSines needs as many amplitudes as frequencies and phases, got "
                "{}, {} and {}".format(*sizes)
            )

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The k-th derivative of sin is a shift of the phase by k pi / 2."""
        yd = np.zeros(p.order + 1)
        for a, w, phi in zip(p.amplitudes, p.frequencies, p.phases):  # noqa: B905 (for numba)
            for k in range(p.order + 1):
                yd[k] += a * w**k * np.sin(w * t + phi + k * np.pi / 2)
        return yd


@record
class FilteredStep(_Reference):
    """A step through a reference filter of order n + 1, so that yd^(n) is continuous.

        yd = [omega / (s + omega)]^(n+1) step,    step = height for t >= t_step, otherwise 0

    Examples
    --------
    A filter of order 1 with omega = 2 rad/s:

    >>> reference = nlctl.block(nlctl.FilteredStep(order=0, omega=2.0), "reference")
    >>> response = nlctl.input_output_response(reference, np.array([0.0, 0.5]))
    >>> print(round(response.outputs[0, -1], 6), round(1 - np.exp(-1), 6))
    0.632121 0.632121
    """

    height: float = param(1.0, unit="1", meaning="height of the step")
    t_step: float = param(0.0, unit="s", meaning="time of the step")
    omega: float = param(2.0, unit="rad/s", meaning="corner frequency of the filter", above=0)

    vector = True
    states = property(lambda self: self.outputs)

    def derived(self) -> dict[str, Any]:
        """Coefficients of (s/omega + 1)^(n+1) at s^0, ..., s^n, times omega^(n+1)."""
        m = self.order + 1
        return {
            "coefficients": np.array([math.comb(m, k) * self.omega ** (m - k) for k in range(m)])
        }

    @equation
    def update(t, x, u, p):
        """Filter in controller form; its states are yd and its derivatives."""
        step = p.height * p.coefficients[0] if t >= p.t_step else 0.0
        return np.append(x[1:], step - np.sum(p.coefficients * x))

    @equation
    def output(t, x, u, p):
        return x.copy()


@record
class FunctionReference(_Reference):
    """A reference given by a function of time that returns yd and its derivatives.

    Parameters
    ----------
    order : int
        Number of derivatives that are outputs, n >= 0.
    function : equation
        ``function(t) -> (yd, yd', ..., yd^(n))``.

    Examples
    --------
    >>> @nlctl.equation
    ... def ramp(t):
    ...     return 0.1 * t, 0.1, 0.0
    >>> reference = nlctl.FunctionReference(order=2, function=ramp)
    """

    order: int = field()
    function: Callable[[float], Sequence[float]]

    def check(self) -> None:
        """The function must return as many derivatives as promised."""
        super().check()
        got = np.size(self.function(0.0))
        if got != self.order + 1:
            raise ParameterError(
                f"FunctionReference of order {self.order} needs a function that returns "
                f"{counted(self.order + 1, 'value')} ({', '.join(self.outputs)}), got {got}"
            )

    @cached_property
    def output(self) -> Callable:
        """The user's function as an equation of the block."""
        function = equation(self.function)

        @equation
        def output(t, x, u, p):
            return function(t)

        return output


@record
class NoiseBand:
    """What is noise in a band of frequencies, and how it is drawn."""

    low: float = param(0.0, unit="rad/s", meaning="lower end of the band", at_least=0)
    high: float = param(50.0, unit="rad/s", meaning="upper end of the band", above=0)
    seed: int = param(0, unit="1", meaning="seed of frequencies and phases", at_least=0)
    components: int = param(32, unit="1", meaning="number of sines", at_least=1)

    def check(self) -> None:
        """A band has two ends."""
        if not self.low < self.high:
            who = type(self).__name__
            raise ParameterError(f"{who} needs low < high, got {self.low:g} and {self.high:g}")

    def spectrum(self, count: int) -> tuple[np.ndarray, ...]:
        """Return frequencies and phases of so many signals, each of shape (count, components)."""
        drawn = [
            noise_spectrum(self.low, self.high, [self.seed, i], self.components)
            for i in range(count)
        ]
        return tuple(map(np.array, zip(*drawn, strict=True)))


@record
class BandLimitedNoise(NoiseBand):
    """Adds band-limited noise to signals: measurement noise, or a disturbance on the way.

        out_i(t) = in_i(t) + n_i(t)

    The noise is a fixed function of time, see `nlctl.functions.band_limited`; signal i uses the
    seed (seed, i).  Between plant and controller it is measurement noise, between actuator and
    plant a disturbance of the input.

    Parameters
    ----------
    inputs, outputs : tuple of str
        Names of the signals before and after, pairwise.

    Examples
    --------
    The same function of time in every run; nothing of it depends on a step size:

    >>> noise = nlctl.references.BandLimitedNoise(inputs=("y",), outputs=("ym",))
    >>> sensor = nlctl.block(noise, "sensor")
    >>> once, again = sensor.output(0.3, [], [1.0]), sensor.output(0.3, [], [1.0])
    >>> print(bool(once == again), bool(0 < abs(once[0] - 1.0) < 0.1))
    True True
    """

    inputs: tuple[str, ...] = ("x1", "x2")
    outputs: tuple[str, ...] = ("x1_measured", "x2_measured")
    rms: float = param(0.01, unit="1", meaning="root mean square of each noise", at_least=0)

    vector = True

    def check(self) -> None:
        """Signals come in pairs; a band has two ends."""
        pairs("BandLimitedNoise", self.inputs, self.outputs)
        super().check()

    def derived(self) -> dict[str, Any]:
        """Frequencies and phases, one row per signal."""
        omega, phase = self.spectrum(len(self.inputs))
        return {"spectrum": omega, "angles": phase}

    @equation
    def output(t, x, u, p):
        """Each signal with its own noise."""
        noisy = u.copy()
        for i in range(u.size):
            noisy[i] += noise_value(t, p.rms, p.spectrum[i], p.angles[i])
        return noisy
