"""Generalised Prandtl-Ishlinskii operator: plays between two envelopes that are not straight."""

import numpy as np

from ..equations import equation
from ..errors import ParameterError
from ..functions import clip
from ..params import Floats, param, record
from .memories import relaxation
from .prandtl_ishlinskii import Plays
from .static import BOUNDED_OUTPUT


@equation
def envelope(u, a):
    """The envelope a_0 tanh(a_1 u + a_2) + a_3."""
    return a[0] * np.tanh(a[1] * u + a[2]) + a[3]


@equation
def envelope_bands(u, p):
    """Return the lower and upper end of each play at input u."""
    # Where the envelopes cross by more than 2 r they are sorted, as the lines of `Backlash` are:
    # the operator stays defined and continuous there.
    rising, falling = envelope(u, p.rising) - p.r, envelope(u, p.falling) + p.r
    return np.minimum(rising, falling), np.maximum(rising, falling)


@equation
def generalised_plays(u, memories, p):
    """The memories, each clipped into its band."""
    low, high = envelope_bands(u, p)
    return clip(memories, low, high)


@record
class GeneralisedPrandtlIshlinskii(Plays):
    """Generalised Prandtl-Ishlinskii operator: plays between a rising and a falling envelope.

        v = sum_i w_i S_i,   S_i = min(max(S_i(t-), gamma_r(u) - r_i), gamma_f(u) + r_i)
        gamma(u) = a_0 tanh(a_1 u + a_2) + a_3

    S_i follows gamma_r - r_i where u rises and gamma_f + r_i where it falls, so that loops
    saturate and need not be symmetric.  Generalised plays are those of Visintin (Differential
    Models of Hysteresis, 1994, chapter III), the sum with such envelopes is after Al Janaideh,
    Rakheja and Su (IEEE/ASME Transactions on Mechatronics 16, 2011, p. 734); neither text was at
    hand, and the default values are our own.  Each play has its memory, the state ``memory[i]``.

    With equal envelopes it is a `PrandtlIshlinskii` operator behind the characteristic gamma, and
    the inverse of that operator, followed by that of gamma, is its inverse.

    It does not obey (2): |v| is bounded for all u.  In plain `control.input_output_response` the
    memories relax onto the plays, as with `nlctl.Backlash`.

    Parameters
    ----------
    v0 : float or tuple of float, optional
        Memories S_i(0-) at the start: one for all, or one each.

    Examples
    --------
    One play of half gap 0.1 between two saturations that are 0.4 apart in u:

    >>> record = nlctl.actuators.GeneralisedPrandtlIshlinskii(
    ...     rising=(1.0, 1.0, -0.2, 0.0), falling=(1.0, 1.0, 0.2, 0.0), w=(1.0,), r=(0.1,)
    ... )
    >>> hysteresis = nlctl.block(record, "actuator")
    >>> [round(float(hysteresis.output(0, [0.0], [u])[0]), 6) for u in (0.2, 9.0, -9.0)]
    [0.0, 0.9, -0.9]
    """

    rising: Floats = param(
        (8.0, 0.14, -0.05, 0.0), unit="1", meaning="a_0, ..., a_3 of the rising envelope"
    )
    falling: Floats = param(
        (8.4, 0.14, 0.1, 0.5), unit="1", meaning="a_0, ..., a_3 of the falling envelope"
    )
    w: Floats = param((0.5, 0.2, 0.2, 0.1), unit="1", meaning="weights of the plays", above=0)
    r: Floats = param((0.0, 0.2, 0.4, 0.6), unit="1", meaning="thresholds, increasing", at_least=0)

    no_split = BOUNDED_OUTPUT

    def check(self) -> None:
        """Four numbers for each envelope, which increases; weights, thresholds, a finite start."""
        for name in ("rising", "falling"):
            a = getattr(self, name)
            if len(a) != 4 or not (a[0] > 0 and a[1] > 0):
                raise ParameterError(
                    f"GeneralisedPrandtlIshlinskii needs {name} = (a_0, a_1, a_2, a_3) with "
                    f"a_0 > 0 and a_1 > 0, so that the envelope increases, got {a}"
                )
        super().check()

    @equation
    def output(t, x, u, p):
        return (np.sum(p.w * generalised_plays(u[0], x, p)),)

    @equation
    def commit(t, x, u, p):
        return generalised_plays(u[0], x, p)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        """Contact of each play with either side of its band."""
        low, high = envelope_bands(u[0], p)
        return np.concatenate((x - low, x - high))

    @equation
    def band(t, u, p):
        """Least and greatest output at input u, whatever the memories."""
        low, high = envelope_bands(u, p)
        return np.sum(p.w * low), np.sum(p.w * high)
