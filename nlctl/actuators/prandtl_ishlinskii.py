"""Hysteresis of plays: stop, Prandtl-Ishlinskii operator, one-sided dead zones."""

from typing import Any, ClassVar

import numpy as np

from ..equations import equation
from ..errors import ParameterError
from ..functions import clip
from ..params import Floats, param, record
from ..wording import counted
from .memories import FromUToV, Remembering, memory_names, relaxation
from .static import BOUNDED_OUTPUT


@equation
def unit_play(u, memory, r):
    """Plays with unit slope and half gaps r: the memories clipped into [u - r, u + r]."""
    return clip(memory, u - r, u + r)


@equation
def unit_contact(u, memory, r):
    """How far plays are from either side of their gaps; exactly 0 where they touch it."""
    return memory - (u - r), memory - (u + r)


@equation
def weighted_plays(u, memories, w_0, w, r):
    """Prandtl-Ishlinskii operator: u and its plays, weighted."""
    return w_0 * u + np.sum(w * unit_play(u, memories, r))


@equation
def weighted_band(u, w_0, w, r):
    """Least and greatest value of the operator at input u, whatever the memories."""
    middle, half = (w_0 + np.sum(w)) * u, np.sum(np.abs(w) * r)
    return middle - half, middle + half


@record
class Stop(Remembering):
    """Stop operator, the elastic-plastic element dual to the play.

        v = u - w,   w = min(max(w(t-), u - r), u + r)

    w is the play of half gap r, and its last value the memory.  Stop and play add up to u
    (Brokate, Sprekels, Hysteresis and Phase Transitions, 1996, section 2.3).  v follows the
    changes of u until |v| = r, and stays there until u reverses.

    It does not obey (2): |v| <= r for all u.  In plain `control.input_output_response` the memory
    relaxes onto the play, as with `nlctl.Backlash`.

    Parameters
    ----------
    v0 : float, optional
        Memory w(0-) of the play at the start, the initial value of the state ``memory``.  The
        output lies in [-r, r] from the first instant, whatever it is.

    Examples
    --------
    The play that it completes stays behind u by r, so that the stop stays at r:

    >>> stop = nlctl.block(nlctl.actuators.Stop(r=1.0), "stop")
    >>> [float(stop.output(0, [0.0], [u])[0]) for u in (0.4, 3.0, -3.0)]
    [0.4, 1.0, -1.0]
    """

    r: float = param(1.0, unit="1", meaning="largest |v|, half gap of the play", above=0)

    states = ("memory",)
    no_split = BOUNDED_OUTPUT

    @equation
    def output(t, x, u, p):
        """What the play leaves of u."""
        (memory,) = x
        return (u[0] - unit_play(u[0], memory, p.r),)

    @equation
    def commit(t, x, u, p):
        (memory,) = x
        return (unit_play(u[0], memory, p.r),)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        """Where it begins or ends to yield: contact with either side of the gap."""
        (memory,) = x
        return unit_contact(u[0], memory, p.r)


def check_pairs(spec: Any) -> None:
    """Refuse thresholds and weights of different number."""
    if len(spec.r) != len(spec.w):
        raise ParameterError(
            f"{type(spec).__name__} needs one weight for each threshold, got "
            f"{counted(len(spec.w), 'weight')} w and {counted(len(spec.r), 'threshold')} r"
        )


def check_weights(spec: Any, meaning: str) -> None:
    """Refuse a slope that is not positive."""
    who = type(spec).__name__
    slopes = spec.w_0 + np.cumsum(spec.w)
    if not np.all(slopes > 0):
        i = int(np.argmax(~(slopes > 0)))
        raise ParameterError(
            f"{who} needs w_0 + w[0] + ... + w[{i}] > 0, {meaning}, got {slopes[i]:g}"
        )


@record
class Plays(Remembering):
    """What sums of plays share: a memory and a weight w for each threshold r, in order."""

    vector = True
    r: ClassVar[Any]

    states = property(lambda self: memory_names("memory", len(self.r)))

    def check(self) -> None:
        """A weight for each threshold, thresholds that increase, finite memories."""
        check_pairs(self)
        if not np.all(np.diff(self.r) > 0):
            who = type(self).__name__
            raise ParameterError(f"{who} needs increasing thresholds r, got {self.r}")
        super().check()


@record
class PrandtlIshlinskii(Plays):
    """Prandtl-Ishlinskii operator: a weighted sum of plays.

        v = w_0 u + sum_i w_i H_i,   H_i = min(max(H_i(t-), u - r_i), u + r_i)

    with thresholds 0 < r_1 < r_2 < ... (Kuhnen, European Journal of Control 9, 2003, p. 407).  The
    loading curve has the slope w_0 + ... + w_i behind the threshold r_i: these sums are positive.
    Each play has its memory, the state ``memory[i]``.

    It obeys (2) with the gain k = w_0 + sum w_i and |eps_u| <= sum |w_i| r_i, since
    |H_i - u| <= r_i.  In plain `control.input_output_response` the memories relax onto the plays,
    as with `nlctl.Backlash`.

    Parameters
    ----------
    v0 : float or tuple of float, optional
        Memories H_i(0-) at the start: one for all, or one each.

    Examples
    --------
    One play of half gap 0.4 with weight 0.5, next to u itself:

    >>> record = nlctl.actuators.PrandtlIshlinskii(w_0=1.0, w=(0.5,), r=(0.4,))
    >>> hysteresis = nlctl.block(record, "actuator")
    >>> [round(float(hysteresis.output(0, [0.0], [u])[0]), 6) for u in (0.3, 1.0)]
    [0.3, 1.3]
    """

    w_0: float = param(0.6, unit="1", meaning="weight of u itself", above=0)
    w: Floats = param((0.25, 0.15, 0.1, 0.1), unit="1", meaning="weights of the plays")
    r: Floats = param((0.2, 0.4, 0.6, 0.8), unit="1", meaning="thresholds, increasing", above=0)

    @property
    def gains(self) -> tuple[float, float]:
        """Bounds (k_1, k_2) of k in (2): the slope of every play at its sides together."""
        k = float(self.w_0 + np.sum(self.w))
        return k, k

    def check(self) -> None:
        """A weight for each threshold, thresholds in order, an increasing loading curve."""
        super().check()
        check_weights(self, "so that the loading curve increases")

    @equation
    def output(t, x, u, p):
        return (weighted_plays(u[0], x, p.w_0, p.w, p.r),)

    @equation
    def commit(t, x, u, p):
        return unit_play(u[0], x, p.r)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        """Contact of each play with either side of its gap."""
        return np.concatenate(unit_contact(u[0], x, p.r))

    @equation
    def band(t, u, p):
        return weighted_band(u, p.w_0, p.w, p.r)


@record
class OneSidedDeadZones(FromUToV):
    """Superposition of one-sided dead zones: a piecewise linear characteristic without memory.

        v = w_0 u + sum_i w_i S_i,   S_i = max(u - r_i, 0)  for r_i > 0
                                           min(u - r_i, 0)  for r_i < 0

    In ``cascade({"plays": PrandtlIshlinskii(), "zones": OneSidedDeadZones()})`` it makes hysteresis
    loops that are not symmetric: Kuhnen's modified Prandtl-Ishlinskii operator (European Journal
    of Control 9, 2003, p. 407).  Slopes are positive everywhere.

    It obeys (2): v / u tends to the outer slopes, and k lies between the least and the greatest
    slope.  There eps_u = 0, since v(0) = 0.

    Examples
    --------
    Slopes 1 between the thresholds, 0.5 beyond 1 on the right, 2 beyond -1 on the left:

    >>> record = nlctl.actuators.OneSidedDeadZones(w_0=1.0, w=(1.0, -0.5), r=(-1.0, 1.0))
    >>> shape = nlctl.block(record, "actuator")
    >>> [float(shape.output(0, [], [u])[0]) for u in (-2.0, 0.5, 3.0)]
    [-3.0, 0.5, 2.0]
    """

    w_0: float = param(1.0, unit="1", meaning="slope at u = 0", above=0)
    w: Floats = param((-0.3, 0.4), unit="1", meaning="changes of slope, outwards")
    r: Floats = param((-0.5, 0.7), unit="1", meaning="where the slope changes")

    vector = True

    @property
    def gains(self) -> tuple[float, float]:
        """Least and greatest slope, bounds (k_1, k_2) of k in (2)."""
        slopes = self._slopes()
        return float(slopes.min()), float(slopes.max())

    def _slopes(self) -> np.ndarray:
        order = np.argsort(np.abs(self.r))
        r, w = np.array(self.r)[order], np.array(self.w)[order]
        sides = (np.cumsum(w[r > 0]), np.cumsum(w[r < 0]))
        return self.w_0 + np.concatenate(([0.0], *sides))

    def check(self) -> None:
        """A weight for each threshold, none at 0, and a positive slope everywhere."""
        check_pairs(self)
        if 0.0 in self.r:
            raise ParameterError(
                "OneSidedDeadZones needs thresholds r other than 0: the slope at 0 is w_0"
            )
        least = float(self._slopes().min())
        if not least > 0:
            raise ParameterError(
                f"OneSidedDeadZones needs a positive slope everywhere, got {least:g} behind one of "
                "the thresholds"
            )

    @equation
    def output(t, x, u, p):
        beyond = np.where(p.r > 0, np.maximum(u[0] - p.r, 0.0), np.minimum(u[0] - p.r, 0.0))
        return (p.w_0 * u[0] + np.sum(p.w * beyond),)

    @equation
    def switching(t, x, u, p):
        return u[0] - p.r
