"""Whether each switch of a lane is at another place, as up a staircase, or comes back to one.

Where it comes back, the straight way from one switch to the next lies next to what is compared,
and the run has been on one side of it.  Otherwise the straight way leads as far from there
as the run does: the next switch of the same condition is another one.
"""

from itertools import pairwise

import numpy as np

from .steps import Jump, LaneEquations, Way

_PLACES = (0.25, 0.5, 0.75)  # of the straight way from one switch to the next
_AS_FAR = 0.5  # of how far the run has been from being equal


def rows_that_go_on(evaluated: LaneEquations, way: Way) -> np.ndarray:
    """Return whether each condition has switched, and never twice at one place."""
    goes_on = np.zeros(way.g.shape[1], dtype=bool)
    for row in range(goes_on.size):
        places = way.switches(row)
        goes_on[row] = places.size > 0 and all(
            _leads_on(evaluated, way, row, *pair) for pair in pairwise(places)
        )
    return goes_on


def _leads_on(evaluated: LaneEquations, way: Way, row: int, first: int, last: int) -> bool:
    """Whether the straight way between two switches leads away from what is compared."""
    (t, x), (t_2, x_2) = (_place(way, row, k) for k in (first, last))
    memory, (_, stays, u) = evaluated.run.task.rows.memory, way.points[first]

    def apart(s: float, z: np.ndarray) -> float:
        z[memory] = stays[memory]  # these jump
        return abs(float(evaluated.switching(s, z, u)[row]))

    straight = [apart(t + part * (t_2 - t), x + part * (x_2 - x)) for part in _PLACES]
    within = [apart(*_middle(way, k)) for k in range(first, last - 1)]
    farthest = max([*np.abs(way.g[first:last, row]), *within])
    return max(straight) > _AS_FAR * farthest


def _middle(way: Way, k: int) -> tuple[float, np.ndarray]:
    """Return where the lane is in the middle of a step: from one switch to the next may be one."""
    (t, x, _), (t_2, x_2, _) = way.points[k : k + 2]
    bend = (t_2 - t) / 8 * (way.rates[k] - way.rates[k + 1])
    return 0.5 * (t + t_2), 0.5 * (x + x_2) + bend


def _place(way: Way, row: int, k: int) -> tuple[float, np.ndarray]:
    """Return where a condition has switched before a point."""
    (t, x, _), (t_2, x_2, _) = way.points[k - 1 : k + 1]
    before, after = way.g[k - 1 : k + 1, row]
    part = before / (before - after)
    return t + part * (t_2 - t), x + part * (x_2 - x)


def goes_on_at(evaluated: LaneEquations, goes_on: np.ndarray, jump: Jump) -> bool:
    """Whether all conditions that switch at a jump are such that go on."""
    before, after = (np.sign(evaluated.switching(*side)) for side in jump.sides())
    switched = before != after
    return bool(switched.any() and goes_on[switched].all())
