"""The split of an actuator whose k is v/u clipped to bounds, and the range of its eps_u."""

from collections.abc import Callable
from typing import Any

import numpy as np
from flint import arb

from nlctl.annotations import as_annotated
from nlctl.arguments import number
from nlctl.functions import clip

from ...intervals.agreement import UNREAD, reads_time
from ...intervals.arithmetic import Ball, as_ball, common
from ...intervals.branch_and_bound import Box, Range, Undecided, enclose
from ...intervals.quotient import slope_in

_UNTIMED, _TIMED = 50_000, 1_000  # boxes; the latter cannot be divided in time
Edge = Callable[[Any, Any], Any]  # output at an input and a time


@as_annotated
def clipped_split(k_1: float, k_2: float) -> Callable[[Any, Any], Any]:
    """Return k u of the split k = min(max(v/u, k_1), k_2), written without the division.

    It serves numbers, arrays and balls, and leaves the smallest |eps_u| that any split with
    k_1 <= k <= k_2 leaves at (u, v).

    Parameters
    ----------
    k_1, k_2 : float
        Bounds of k.

    Returns
    -------
    callable
        ``part(u, v)`` is k u.

    Raises
    ------
    ParameterError
        If not 0 < k_1 <= k_2, both finite.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import clipped_split
    >>> part = clipped_split(0.5, 2.0)
    >>> print(part(1.0, 1.5), part(1.0, 3.0))  # k = v/u, and at most 2
    1.5 2.0
    """
    number("clipped_split", "k_1", k_1, above=0)
    number("clipped_split", "k_2", k_2, at_least=k_1)

    def part(u: Any, v: object) -> Any:
        one, other = k_1 * u, k_2 * u
        return clip(v, np.minimum(one, other), np.maximum(one, other))

    return part


def eps_range(
    k: tuple[float, float], edges: tuple[Edge, Edge], u_max: float, tol: float
) -> tuple[Range, Range]:
    """Return the ranges of eps_u along both edges, for all t >= 0."""
    # It grows with v, so that these are its ends.
    part = clipped_split(*k)

    def along(edge: Edge) -> Range:
        def eps_u(point: tuple[Any, ...]) -> Any:
            u, t = (*point, UNREAD)[:2]
            v = edge(u, t)
            rest = as_ball(v - part(u, v))
            return rest if t is UNREAD else _sharpened(rest, edge, k, u, t)

        if reads_time(edge):
            box, limit = Box.of(u=(-u_max, u_max), t=(0.0, np.inf)), _TIMED
        else:
            box, limit = Box.of(u=(-u_max, u_max)), _UNTIMED
        return enclose(eps_u, box, tol=tol, max_boxes=limit)

    low = along(edges[0])
    return low, low if edges[1] is edges[0] else along(edges[1])


def _sharpened(rest: Any, edge: Edge, k: tuple[float, float], u: object, t: object) -> Any:
    """Return eps_u from the difference quotient q of v in u as well, v = q u + v(0, t)."""
    # v - clip(v, k_1 u, k_2 u) grows with v, and no faster: it is u (q - clip(q, k_1, k_2)) and
    # what lies between 0 and v(0, t). Between v and its clipped self intervals forget that t is one
    # time.
    try:
        q, start = slope_in(lambda w: edge(w, t), u).value, as_ball(edge(0.0, t)).value
    except Undecided:
        return rest
    ends = (q.lower(), q.upper())
    low, high = ((e - k[1]).max(arb(0)) + (e - k[0]).min(arb(0)) for e in ends)
    sharper = as_ball(u).value * low.union(high) + arb(0).union(start)
    if not rest.value.overlaps(sharper):  # answers that contradict each other: nobody goes this way
        return rest
    value = common(rest.value, sharper)
    return Ball(value, (arb(0, "inf"),) * len(as_ball(u).gradient))
