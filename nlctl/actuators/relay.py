"""Relays with hysteresis, one or many: relay, Preisach operator."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..annotations import as_annotated
from ..arguments import vector
from ..equations import equation
from ..errors import ParameterError
from ..params import Floats, param, record
from .memories import Remembering, checked_start, memory_names, relaxation
from .static import BOUNDED_OUTPUT


@equation
def kept_side(side):
    """Side that a memory stands for: a memory that relaxes passes through the numbers between."""
    return np.where(side < 0, -1.0, np.where(side >= 0, 1.0, side))  # NaN stays


@equation
def held_side(side):
    """Side that a relay outputs: its memory's, never that of its input."""
    # Behind a threshold a loop may lead back before the memory has switched, and would never leave
    # it. Beyond 1 a memory is its own side: it jumps, and nothing pushes it.
    return kept_side(side) * np.maximum(1.0, np.abs(side))


@equation
def relay_side(u, side, on, off):
    """Side of relays: +1 where u >= on, -1 where u <= off, in between that of the memory."""
    free = np.where(u >= on, 1.0, np.where(u <= off, -1.0, u))
    return np.where((off < u) & (u < on), kept_side(side), free)


@equation
def moving_side(rate, side):
    """Side of what moves: +1 where its rate is > 0, -1 where it is < 0, at rest the memory's."""
    moves = np.where(rate > 0, 1.0, np.where(rate < 0, -1.0, rate))  # NaN stays
    return np.where(rate == 0, kept_side(side), moves)


def check_sides(spec: Any) -> None:
    """Refuse initial sides other than 1 and -1."""
    if not np.all(np.abs(checked_start(spec, len(spec.states))) == 1):
        raise ParameterError(f"{type(spec).__name__} needs v0 of 1 and -1 only, got {spec.v0}")


@record
class Relay(Remembering):
    """Relay with hysteresis.

        v = height s,   s = +1       u >= on
                            -1       u <= off
                            s(t-)    off < u < on

    Its memory is the side s.  For u = A sin(w t) with thresholds on = -off = h < A its describing
    function is 4 height / (pi A) (sqrt(1 - (h / A)^2) - i h / A) (Gelb, Vander Velde,
    Multiple-Input Describing Functions, 1968, appendix B).

    It does not obey (2): |v| = height for all u.  In plain `control.input_output_response` the
    memory relaxes onto the side with 1000/s, and its sign counts: the output switches 0.7 ms after
    the input has met a threshold, and a swing back that comes sooner is missed.

    Examples
    --------
    >>> relay = nlctl.block(nlctl.Relay(on=1.0, off=-1.0), "relay")
    >>> response = nlctl.input_output_response(relay, [0, 1, 2, 3], [-2.0, 0.5, 2.0, 0.5])
    >>> print(response.outputs)
    [-1. -1.  1.  1.]
    """

    on: float = param(1.0, unit="1", meaning="input from which the relay is on")
    off: float = param(-1.0, unit="1", meaning="input up to which the relay is off")
    height: float = param(1.0, unit="1", meaning="output |v|", above=0)
    v0: float = -1.0  # Side s(0-) at the start, 1 or -1: the initial value of the state ``side``.

    states = ("side",)
    feedthrough = False
    no_split = BOUNDED_OUTPUT

    def check(self) -> None:
        """It switches off below where it switches on, and starts from one side."""
        if not self.off < self.on:
            raise ParameterError(f"Relay needs off < on, got {self.off:g} and {self.on:g}")
        check_sides(self)

    @equation
    def output(t, x, u, p):
        """The side, with its height."""
        (side,) = x
        return (p.height * held_side(side),)

    @equation
    def commit(t, x, u, p):
        (side,) = x
        return (relay_side(u[0], side, p.on, p.off),)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        return u[0] - p.on, u[0] - p.off


@as_annotated
def relay_grid(levels: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the thresholds (alpha, beta) of all relays on a grid of levels, alpha > beta.

    Parameters
    ----------
    levels : sequence of float
        n increasing numbers; they make n (n - 1) / 2 relays, in the order (1, 0), (2, 0), (2, 1),
        (3, 0), ... of the indices of alpha and beta.

    Returns
    -------
    alphas, betas : tuple of float
        Of the n (n - 1) / 2 relays of n levels.

    Raises
    ------
    ParameterError
        If there are fewer than two levels, or they do not increase.

    Examples
    --------
    >>> nlctl.actuators.relay_grid([-1, 0, 1])
    ((0.0, 1.0, 1.0), (-1.0, -1.0, 0.0))
    """
    grid = vector("relay_grid", "levels", levels)
    if grid.size < 2 or not np.all(np.diff(grid) > 0):
        raise ParameterError(f"relay_grid needs two or more increasing levels, got {levels}")
    upper, lower = np.tril_indices(grid.size, -1)
    return tuple(map(float, grid[upper])), tuple(map(float, grid[lower]))


_GRID = relay_grid((-1.0, -0.5, 0.0, 0.5, 1.0))


@record
class Preisach(Remembering):
    """Preisach operator with finitely many relays.

        v = sum_k w_k s_k,   s_k = +1         u >= alpha_k
                                   -1         u <= beta_k
                                   s_k(t-)    beta_k < u < alpha_k

    with weights w_k >= 0 (Mayergoyz, Mathematical Models of Hysteresis, 1991, section 1.1).
    `nlctl.actuators.relay_grid` makes the thresholds of a grid in the half-plane alpha > beta.

    It does not obey (2): |v| <= sum w_k for all u.  In plain `control.input_output_response` each
    memory relaxes as that of `nlctl.Relay`.

    Examples
    --------
    Two relays of half weight, which turn on at 0.5 and 1:

    >>> record = nlctl.actuators.Preisach(alpha=(0.5, 1.0), beta=(-0.5, -1.0), w=(0.5, 0.5))
    >>> hysteresis = nlctl.block(record, "actuator")
    >>> response = nlctl.input_output_response(hysteresis, [0, 1, 2, 3], [0.0, 0.6, 1.1, 0.0])
    >>> print(response.outputs)
    [-1.  0.  1.  1.]
    """

    alpha: Floats = param(_GRID[0], unit="1", meaning="inputs from which relays are on")
    beta: Floats = param(_GRID[1], unit="1", meaning="inputs up to which relays are off")
    w: Floats = param((0.1,) * 10, unit="1", meaning="weights", at_least=0)
    # Sides s_k(0-) at the start, 1 or -1: one for all, or one each.
    v0: float | tuple[float, ...] = -1.0

    feedthrough = False
    vector = True
    no_split = BOUNDED_OUTPUT
    states = property(lambda self: memory_names("side", len(self.w)))

    def check(self) -> None:
        """Each relay has two thresholds in order, a weight, and starts from one side."""
        counts = [len(values) for values in (self.alpha, self.beta, self.w)]
        if len(set(counts)) > 1:
            raise ParameterError(
                "Preisach needs as many alpha as beta and weights w, got {}, {} and {}".format(
                    *counts
                )
            )
        for k, (upper, lower) in enumerate(zip(self.alpha, self.beta, strict=True)):
            if not lower < upper:
                raise ParameterError(
                    f"Preisach needs beta[{k}] < alpha[{k}], got {lower:g} and {upper:g}"
                )
        check_sides(self)

    @equation
    def output(t, x, u, p):
        """The weighted sum of the sides."""
        return (np.sum(p.w * held_side(x)),)

    @equation
    def commit(t, x, u, p):
        return relay_side(u[0], x, p.alpha, p.beta)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        return np.concatenate((u[0] - p.alpha, u[0] - p.beta))
