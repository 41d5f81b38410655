"""Assumption 1: actuators as v = k(u, t) u + eps_u (2), with the bounds (3) of k and of eps_u.

The split of an actuator is not unique.  Any bounds 0 < k_1 <= k_2 give one: k u is v clipped
between the lines k_1 u and k_2 u, and eps_u the rest.  A small k_1 buys a small eps_u.
"""

import dataclasses
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from nlctl import actuators
from nlctl.actuators import Backlash, DeadZone
from nlctl.annotations import as_annotated
from nlctl.arguments import number, vector
from nlctl.attributes import described_record
from nlctl.errors import ParameterError, UsageError
from nlctl.params import equation_arguments
from nlctl.wording import counted

from ...intervals.agreement import on_balls
from ...intervals.branch_and_bound import Range
from .clipped import Edge, clipped_split, eps_range

_TIMES = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 100.0, 1000.0)  # s; at which declared splits are tried


class DecompositionError(UsageError):
    """An actuator that (2) and (3) do not describe; the message says why.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import decompose
    >>> decompose(nlctl.Saturation())
    Traceback (most recent call last):
    nlctl.analysis...DecompositionError: Saturation is not of the form (2)...
    """


@described_record(made_by="decompose")
class Decomposition:
    """A split v = k(u, v) u + eps_u of an actuator, (2) and (3)."""

    k_1: float  # 0 < k_1 <= k <= k_2.
    k_2: float
    eps_low: float  # Bounds of eps_u.
    eps_high: float
    # ``part(u, v)`` is k u; floats and arrays. `gain` and `eps_u` follow from it.
    part: Callable[[Any, Any], Any]
    # "computed" in closed form, "proved" by branch and bound, "given" by the record alone: samples
    # do not refute it, and nothing proves it.
    provenance: Literal["proved", "computed", "given"]
    how: str  # How the bounds were obtained, and for which inputs they hold.
    over: str
    largest_u: float = np.inf  # They hold for |u| up to this.

    def __post_init__(self) -> None:
        if not 0 < self.k_1 <= self.k_2 < np.inf:
            raise DecompositionError(
                f"Assumption 1 needs 0 < k_1 <= k_2, got {self.k_1:g} and {self.k_2:g}"
            )

    @property
    def eps_star(self) -> float:
        """Bound eps_u* of |eps_u|."""
        return float(np.maximum(abs(self.eps_low), abs(self.eps_high)))

    def eps_u(self, u: object, v: object) -> Any:
        """Return eps_u = v - k u for input u and output v.

        Parameters
        ----------
        u, v : array_like of shape (m,)
            Input and output of the actuator.

        Returns
        -------
        ndarray of shape (m,)
            In the unit of v.
        """
        return v - self.part(u, v)

    def gain(self, u: object, v: object) -> Any:
        """Return k for input u and output v; k_1 at u = 0, where it has no effect.

        Parameters
        ----------
        u, v : array_like of shape (m,)
            Input and output of the actuator.

        Returns
        -------
        ndarray of shape (m,)
            Between `k_1` and `k_2`.
        """
        u = np.asarray(u, dtype=float)
        k = self.part(u, v) / np.where(u == 0, 1.0, u)
        return np.where(u == 0, self.k_1, k)


def check_gain(who: str, k: object) -> None:
    """Refuse bounds of k that are no pair with 0 < k_1 <= k_2; None is none."""
    bounds = None if k is None else vector(who, "k = (k_1, k_2)", k)
    if bounds is not None and (bounds.size != 2 or not 0 < bounds[0] <= bounds[1]):
        raise ParameterError(f"{who} needs k = (k_1, k_2) with 0 < k_1 <= k_2, got {k}")


@as_annotated
def decompose(
    actuator: Any,
    *,
    k: tuple[float, float] | None = None,
    u_max: float = 60.0,
    tol: float = 1e-4,
) -> Decomposition:
    """Split an actuator as v = k u + eps_u and bound k and eps_u.

    Parameters
    ----------
    actuator : record
        A `nlctl.DeadZone` (by default split as in textbooks: k is the slope factor, and 1 inside
        the dead zone), a memoryless actuator with one input and one output, an actuator with
        memory and an equation ``band(t, u, p)`` of the least and greatest output that it can have
        at input u, or a record with a method ``decomposition(u_max)`` that returns its split for
        inputs of |u| <= u_max.
    k : (k_1, k_2), optional
        Bounds that k shall have, by default the ``gains`` of the record where it has them.  The
        split is then `clipped_split`, and eps_u is bounded by branch and bound.
    u_max : float, optional
        Largest |u| of the branch and bound.
    tol : float, optional
        eps_u* is at most this far from a value that is attained.

    Notes
    -----
    The bounds hold for all t >= 0: time is a side of the boxes.  What a record declares itself is
    "proved" where branch and bound confirms it, and "given" otherwise, whatever the record says.

    Raises
    ------
    DecompositionError
        If eps_u is not bounded for all u, as with saturation, no split is known (a record may say
        why, as ``no_split``), or the record's own one is refuted by a sample of its output.
    ParameterError
        If `k` is not a pair with 0 < k_1 <= k_2, or `u_max` or `tol` is not positive.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import decompose
    >>> split = decompose(nlctl.DeadZone(ripple_r=0, ripple_l=0))
    >>> print(split.k_1, split.k_2, split.eps_low, split.eps_high, split.provenance)
    0.8 1.0 -0.5 0.3 computed
    """
    u_max = number("decompose", "u_max", u_max, above=0)
    tol = number("decompose", "tol", tol, above=0)
    check_gain("decompose", k)
    _refuse_by_itself(actuator)
    if k is None and hasattr(actuator, "decomposition"):
        return _declared_split(actuator, u_max, tol)
    if k is None and type(actuator) is DeadZone:
        return _textbook_dead_zone(actuator)
    if k is None and type(actuator) is Backlash and actuator.m_r == actuator.m_l:
        return _play(actuator)
    k = _own_gains(actuator) if k is None else k
    return _proved_split(actuator, k, u_max, tol)


def _refuse_by_itself(actuator: object) -> None:
    """Refuse an actuator whose record says why it has no split."""
    why = getattr(actuator, "no_split", None)
    if why is not None:
        name = type(actuator).__name__
        raise DecompositionError(f"{name} is not of the form (2): {why}; replace the actuator")


def _own_gains(actuator: object) -> tuple[float, float]:
    """Return the bounds of k that a record knows."""
    name = type(actuator).__name__
    k = getattr(actuator, "gains", None)
    if k is None:
        raise DecompositionError(
            f"{name} has no known split (2): give the bounds k=(k_1, k_2), or the record a method "
            "decomposition(u_max)"
        )
    if not k[0] > 0:
        raise DecompositionError(
            f"{name} violates Assumption 1: its gain is {k[0]:g}, and k >= k_1 > 0 is needed"
        )
    return k


def _declared_split(actuator: Any, u_max: float, tol: float) -> Decomposition:
    """Return the split that a record declares, with what is known of it."""
    split = actuator.decomposition(u_max)
    _refute(actuator, split, u_max)
    given = dataclasses.replace(
        split, provenance="given", how=f"declared by {type(actuator).__name__}: {split.how}"
    )
    try:
        proved = _proved_split(actuator, (split.k_1, split.k_2), u_max, tol)
    except DecompositionError:
        return given
    if proved.eps_low < split.eps_low - tol or proved.eps_high > split.eps_high + tol:
        return given
    low, high = min(proved.eps_low, split.eps_low), max(proved.eps_high, split.eps_high)
    return dataclasses.replace(proved, eps_low=low, eps_high=high)


def only_declared(what: str, actuator: object) -> str:
    """Say that something follows from a split which a record declares, and nothing proves."""
    return (
        f"{what} would follow from the split (2) that {type(actuator).__name__} declares; samples "
        "do not refute it, and nothing proves it: for an actuator without memory give "
        "k=(k_1, k_2), which is proved"
    )


def _refute(actuator: Any, split: Decomposition, u_max: float) -> None:
    """Look for an input and a time at which a memoryless actuator breaks what it declares."""
    if len(actuator.states):
        return
    _, output = _edges(actuator)
    points = [(u, 0.0) for u in np.linspace(-u_max, u_max, 2001)]
    points += [(u, t) for t in _TIMES for u in np.linspace(-u_max, u_max, 101)]
    for u, t in points:
        v = output(u, t)
        k, eps_u = split.gain(u, v), split.eps_u(u, v)
        room = 1e-9 * (1 + abs(v))
        if not (
            split.k_1 - 1e-9 <= k <= split.k_2 + 1e-9
            and split.eps_low - room <= eps_u <= split.eps_high + room
        ):
            raise DecompositionError(
                f"{type(actuator).__name__} declares k in [{split.k_1:g}, {split.k_2:g}] and eps_u "
                f"in [{split.eps_low:g}, {split.eps_high:g}], but at u = {u:g}, t = {t:g} s k is "
                f"{k:g} and eps_u is {eps_u:g}: correct its decomposition"
            )


def _textbook_dead_zone(zone: DeadZone) -> Decomposition:
    """k = m(u) outside and 1 inside: eps_u = -m(u) b outside, -u inside."""
    right = zone.slope_r + abs(zone.ripple_r)
    left = zone.slope_l + abs(zone.ripple_l)
    least = min(zone.slope_r - abs(zone.ripple_r), zone.slope_l - abs(zone.ripple_l))

    def part(u: object, v: object) -> Any:
        u, v = np.asarray(u, dtype=float), np.asarray(v, dtype=float)
        inside = (zone.b_l <= u) & (u <= zone.b_r)
        distance = np.where(u > 0, u - zone.b_r, u - zone.b_l)
        return np.where(inside, u, v / np.where(inside, 1.0, distance) * u)

    return Decomposition(
        k_1=min(1.0, least),
        k_2=max(1.0, right, left),
        eps_low=-zone.b_r * max(1.0, right),
        eps_high=-zone.b_l * max(1.0, left),
        part=part,
        provenance="computed",
        how="slope factor outside the dead zone, 1 inside: eps_u = -m(u) b, or -u",
        over="all u",
    )


def _play(play: Backlash) -> Decomposition:
    """k = m: v lies between m (u - c_r) and m (u - c_l)."""
    m = play.m_r
    return Decomposition(
        k_1=m,
        k_2=m,
        eps_low=-m * play.c_r,
        eps_high=-m * play.c_l,
        part=clipped_split(m, m),
        provenance="computed",
        how="k is the slope; v lies in the gap from the first instant",
        over="all u",
    )


def _proved_split(actuator: Any, k: tuple[float, float], u_max: float, tol: float) -> Decomposition:
    edges = _edges(actuator)
    wide = eps_range(k, edges, 2 * u_max, tol)
    undecided = sum(end.undecided for end in wide)
    if undecided:
        raise DecompositionError(
            f"eps_u of {type(actuator).__name__} could not be bounded for |u| <= {2 * u_max:g}: "
            f"{counted(undecided, 'box is', 'boxes are')} undecided"
        )
    _refuse_growth(actuator, k, u_max, (eps_range(k, edges, u_max, tol), wide))
    declared = hasattr(actuator, "band") and not _is_of_nlctl(actuator)
    if declared:
        _refute_band(actuator, edges, u_max)
    boxes = counted(sum(end.boxes for end in wide), "box", "boxes")
    return Decomposition(
        k_1=k[0],
        k_2=k[1],
        eps_low=wide[0].low,
        eps_high=wide[1].high,
        part=clipped_split(*k),
        provenance="given" if declared else "proved",
        how=f"k = v/u clipped to [{k[0]:g}, {k[1]:g}]; {boxes}"
        + (", within the band that the record declares" if declared else ""),
        over=f"|u| <= {2 * u_max:g}, all t",
        largest_u=2 * u_max,
    )


def _is_of_nlctl(actuator: object) -> bool:
    """Whether it is one of nlctl's own records, whose bands its tests hold to."""
    return getattr(actuators, type(actuator).__name__, None) is type(actuator)


def _refute_band(actuator: Any, edges: tuple[Edge, Edge], u_max: float) -> None:
    """Look for an input and a memory at which an actuator leaves the band that it declares."""
    p, rng = equation_arguments(actuator), np.random.default_rng(0)
    for t in (0.0, *_TIMES):
        for u in np.linspace(-u_max, u_max, 101):
            x = 0.5 * u_max * rng.standard_normal(len(actuator.states))
            v = float(np.asarray(actuator.output(t, x, np.array([u]), p)).reshape(-1)[0])
            low, high = (float(edge(u, t)) for edge in edges)
            room = 1e-9 * (1 + abs(v))
            if not low - room <= v <= high + room:
                raise DecompositionError(
                    f"{type(actuator).__name__} declares the band [{low:g}, {high:g}] at u = {u:g},"
                    f" t = {t:g} s, but its output is {v:g} there with the states {x.tolist()}: "
                    "correct its band"
                )


def _edges(actuator: Any) -> tuple[Edge, Edge]:
    """Return the least and the greatest output v that the actuator can have at input u, time t."""
    p, name = equation_arguments(actuator), type(actuator).__name__
    band: Any = getattr(actuator, "band", None)
    if len(actuator.inputs) != 1 or len(actuator.outputs) != 1 or (actuator.states and not band):
        raise DecompositionError(
            f"{name} has memory or several signals: give the record a method decomposition(u_max), "
            "or an equation band(t, u, p) of its least and greatest output at input u"
        )

    def refusal(why: str) -> DecompositionError:
        return DecompositionError(
            f"the output of {name} cannot be evaluated on intervals of u "
            f"and t ({why}): write it with arithmetic and NumPy functions of numbers"
        )

    if band is not None:
        low, high = (on_balls(lambda u, t, i=i: band(t, u, p)[i], refusal) for i in (0, 1))
        return low, high
    function = actuator.output
    output = on_balls(lambda u, t: function(t, (), (u,), p)[0], refusal)
    return output, output


def _refuse_growth(
    actuator: object,
    k: tuple[float, float],
    u_max: float,
    reach: tuple[tuple[Range, Range], tuple[Range, Range]],
) -> None:
    """(2) wants one eps_u* for all u; where eps_u grows with the range of u, there is none."""
    name, near, (low, high) = type(actuator).__name__, *reach
    bound = max(-near[0].low, near[1].high)
    attained = max(high.greatest, -low.least)
    if attained > bound:
        raise DecompositionError(
            f"{name} is not of the form (2) with k in [{k[0]:g}, {k[1]:g}]: |eps_u| is at most "
            f"{bound:.4g} for |u| <= {u_max:g} and reaches {attained:.4g} for |u| <= "
            f"{2 * u_max:g}, so no eps_u* bounds it for all u (saturation, or k too narrow); "
            "give other k, or replace the actuator"
        )
