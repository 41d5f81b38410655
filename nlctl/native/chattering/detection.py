"""Whether a run chatters: its right-hand side jumps, and its steps do not come away from the jump.

Where the solutions on both sides of a jump lead back to it, there is no step that error control
accepts and that leaves it: a run makes ever more of the shortest steps.  Four things together
tell that from stiffness and from fast oscillations:

* by what it moves in a mean step, a state changes by no more than some tolerances: the next step of
  a staircase is farther away;
* of the last steps tried many contain a jump, of the right-hand side or of what a memory becomes,
  to which the run comes back, see `progress`;
* halving the way across, down to neighbouring numbers, does not make it smaller, and next to it on
  both sides there is none, as there is with rounding;
* it depends on the state: a run does not come back to what jumps with time alone.

A step that got to where it had to end, at a sample of the inputs, a clock or a break of a delay,
is as long as it could be, and no sign of anything: a run at rest is all such steps.

Switches that come ever closer together are another thing, see `accumulation`, and so are rates
that change with the rounding of states, see `reference.rough`.

It is looked for in windows of so many steps that a usual run has none, and rarely in a run that
goes on as it began.  What is found of a member never depends on the members beside it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...reference.rough import MOST_STEPS, neighbours, next_to, rough_state
from ..integrate.state import METHOD, RUNNING
from ..integrate.workspace import Task, Work
from .accumulation import accumulated, accumulating
from .progress import goes_on_at, rows_that_go_on
from .steps import Attempt, Jump, LaneEquations, parameters_of

WINDOW = 1800  # steps tried, at least
PROBE = 200  # of them that are looked at, at the end
_PROBES = 5  # as many of Taylor's method: it has few steps, and tries a hundred for a switch
_ROUGH_PLACES = 10  # of the steps looked at, for whether rates are noise
_JUMPS = 10  # of them with a jump
_WITHIN = 100.0  # tolerances that a state moves in a mean step
_FARTHER = 10.0  # times as far in an accepted step
_SLOW = 0.1  # part of the longest window
_LONG = 8  # windows after which a run is looked at that has not become slow
_LOOKS, _SELDOM = 8, 100  # so often whatever it does, then once in so many windows at most
_LEAST = 0.1  # part of the range of the right-hand side that counts as a jump
_REMAINS = 0.4  # part of it that is still there between neighbours; sign has a half at 0
_HALVINGS = 200
_FLAT = 0.25  # part of it by which what does not jump may change
_BESIDE = 2.0 ** np.arange(4, 22)  # distances between neighbours, any four in a row of which do
_WAYS = np.random.default_rng(1).choice([-1.0, 1.0], (4, 1000))  # signs, to move a state by
_PACES = np.dtype(
    [(name, "f8") for name in ("t", "longest", "pace")]
    + [(name, "i8") for name in ("tried", "windows", "slow", "looks", "crawls")]
)


def new_paces(lanes: np.ndarray) -> np.ndarray:
    """Return how fast lanes have been going that have not begun."""
    paces = np.zeros(lanes.size, _PACES)
    paces["t"] = lanes["t"]
    return paces


def asked(lanes: np.ndarray, paces: np.ndarray) -> np.ndarray:
    """Return which lanes are to be looked at, at the end of a window."""
    # Those that have become slow, after 1, 2, 4, ... windows; and those that run on and on, from
    # `_LONG` windows on: what usual runs take must not cost them anything, nor what runs take that
    # become slow again and again. A window that a turn to another method cuts short is one together
    # with the next.
    names = ("t", "longest", "tried", "windows", "slow", "looks")
    before, longest, tried, windows, slow, looks = (paces[name] for name in names)
    status, tried_now = lanes["status"], lanes["accepted"] + lanes["rejected"]
    whole = (tried_now - tried >= WINDOW) & ((status == RUNNING) | (status == METHOD))
    gone = lanes["t"] - before
    before[whole] = lanes["t"][whole]
    tried[whole] = tried_now[whole]
    np.maximum(longest, gone, out=longest, where=whole)
    windows += whole
    slow[whole] = (slow[whole] + 1) * (gone < _SLOW * longest)[whole]
    due = [(n & (n - 1)) == 0 for n in (windows, slow)]
    due[1] &= (slow > 0) & (looks < _LOOKS + windows // _SELDOM)
    looked_at = whole & ((due[0] & (windows >= _LONG)) | due[1])
    looks += looked_at
    paces["crawls"] = looked_at & (slow > 0)
    return looked_at


def probe_of(task: Task) -> int:
    """Return how many steps are looked at, at the end of a window of a run."""
    return PROBE * (_PROBES if task.taylor.highest else 1)


def snapshot(work: Work, advance: Callable[[], Any]) -> tuple[Any, Attempt]:
    """Try one step; return what `advance` returns, and the step."""
    t, x, first = work.lanes["t"].copy(), work.x.copy(), work.k[0].copy()
    lane = work.lanes[0]
    stiff = lane["stiff"] != 0 and not (lane["cross"] > 0.0 and lane["tries"] == 0)
    run = advance()
    w = run.work
    lanes = w.t.size
    moved = w.lanes["t"] > t
    return run, Attempt(
        t=t, x=x, first=first, x_new=w.x_new.copy(), h=w.hh[:lanes].copy(), k=w.k.copy(),
        u=w.u.copy(), stiff=bool(stiff), free=~(moved & (w.lanes["ends"] != 0)),
    )  # fmt: skip


def jump_of(run: Any, attempts: list[Attempt], j: int) -> Jump | None:
    """Return the last jump in the steps that lane `j` has tried, if it chatters there."""
    c = parameters_of(run, j)
    jump = _stayed_at(run, attempts[-PROBE:], j, c)
    if jump is None:
        evaluated = LaneEquations(run=run, j=j, c=c)
        return accumulating(evaluated, attempts) or _roughness(evaluated, attempts)
    return replace(jump, crowd=accumulated(run, j, jump.time))


def _roughness(evaluated: LaneEquations, attempts: list[Attempt]) -> Jump | None:
    """Return a place of a lane whose rates are noise, if there is no end of its steps by that."""
    run, j = evaluated.run, evaluated.j
    task, now = run.task, run.lanes["t"][j]
    length = (now - attempts[0].t[j]) / len(attempts)
    if task.times[-1] - now <= MOST_STEPS * length:
        return None
    looked_at = attempts[:: max(len(attempts) // _ROUGH_PLACES, 1)]
    u, x, t = looked_at[-1].u[:, j], looked_at[-1].x[:, j], float(looked_at[-1].t[j])
    scale = task.atol + task.rtol * np.abs(x)
    points = [(float(a.t[j]), a.x[:, j]) for a in looked_at]
    found = rough_state(
        lambda t, z: evaluated(t, z, u)[: x.size],
        [point for point in points if not _is_at_condition(evaluated, *point, u)], length,
        np.broadcast_to(scale, x.shape),
    )  # fmt: skip
    if found is None:
        return None
    return Jump(times=(t, t), before=x, after=next_to(x), inputs=u, is_rough=True)


def _is_at_condition(evaluated: LaneEquations, t: float, x: np.ndarray, u: np.ndarray) -> bool:
    """Whether a condition is within rounding of a state: a step has just ended behind it."""
    signs = [np.sign(evaluated.switching(t, z, u)) for z in neighbours(x)]
    return any(not np.array_equal(one, signs[0]) for one in signs)


def _stayed_at(run: Any, attempts: list[Attempt], j: int, c: np.ndarray) -> Jump | None:
    """Return the last jump in the steps of a lane, if they do not come away from it."""
    task = run.task
    free = [a for a in reversed(attempts) if a.free[j]]
    if len(free) < _JUMPS or not attempts[0].x.size:
        return None
    slopes = _slopes(run, attempts, j)
    states = np.array([a.x[:, j] for a in attempts])
    if not slopes.size or not np.isfinite(states).all():
        return None
    extent = slopes.max(axis=0) - slopes.min(axis=0)
    scale = task.atol + task.rtol * np.abs(states).max(axis=0)
    step = (run.lanes["t"][j] - attempts[0].t[j]) / len(attempts)
    moved = np.ptp(states, axis=0) / (_FARTHER * np.unique([a.t[j] for a in attempts]).size)
    moved[task.rows.memory] = 0.0  # these jump
    if not np.all(np.maximum(step * extent, moved) <= _WITHIN * scale):
        return None
    evaluated = _Places(run=run, j=j, c=c)
    weights = np.zeros(extent.size + task.rows.memory.size)
    weights[: extent.size] = 1.0 / scale
    weights[extent.size :] = 1.0 / (task.atol + task.rtol)  # memories jump by what they are
    least = np.append(
        _LEAST * extent, np.full(task.rows.memory.size, 1e3 * (task.atol + task.rtol))
    )
    goes_on = rows_that_go_on(evaluated, evaluated.way(attempts))
    found, last = 0, None
    for attempt in free:
        jump = evaluated.jump(attempt, weights, least)
        if jump is None or goes_on_at(evaluated, goes_on, jump):
            continue
        found, last = found + 1, last or jump
        if found == _JUMPS:
            return last
    return None


def _slopes(run: Any, attempts: list[Attempt], j: int) -> np.ndarray:
    """Return the rates of a lane at the stages of steps that are about as long as those it makes.

    Longer ones, which it tries again and again, may lead far up a staircase.
    """
    gone = run.lanes["t"][j] - attempts[0].t[j]
    longest = _FARTHER * gone / np.unique([a.t[j] for a in attempts]).size
    near = [a for a in attempts if a.h[j] <= longest]
    slopes = np.concatenate([a.k[:, :, j] for a in near or attempts])
    return slopes[np.isfinite(slopes).all(axis=1)]


@dataclass(frozen=True, kw_only=True)
class _Places(LaneEquations):
    """Where one lane has been, and what jumps there."""

    def jump(self, attempt: Attempt, weights: np.ndarray, least: np.ndarray) -> Jump | None:
        """Return a jump inside of a step, if there is one."""
        u = attempt.u[:, self.j]
        places = [(t, x) for t, x in self.points(attempt) if np.isfinite(x).all()]
        values = np.array([self(t, x, u) for t, x in places])
        change = np.where(np.isfinite(values).all(axis=0), np.ptp(values, axis=0), 0.0)
        change = np.where(change > least, weights * change, 0.0)
        if not change.any():
            return None
        i = int(np.argmax(change))
        low, high = places[int(values[:, i].argmin())], places[int(values[:, i].argmax())]
        return self._narrowed(low, high, u, i, weights)

    def _narrowed(
        self, low: Any, high: Any, u: np.ndarray, i: int, weights: np.ndarray
    ) -> Jump | None:
        """Halve the way from one place to another; return where component `i` jumps, if it does."""
        first, last = self(low[0], low[1], u)[i], self(high[0], high[1], u)[i]
        whole = abs(last - first)
        for _ in range(_HALVINGS):
            t, x = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])
            if any(t == e[0] and np.array_equal(x, e[1]) for e in (low, high)):
                break
            middle = self(t, x, u)[i]
            if abs(middle - first) > abs(last - middle):
                high, last = (t, x), middle
            else:
                low, first = (t, x), middle
            if not abs(last - first) > _REMAINS * whole:
                return None
        # the jump itself may have a value of its own, as sign(0) has: next to it on both sides
        alone = np.array([first, last])
        wider = Jump(times=(low[0], high[0]), before=low[1], after=high[1], inputs=u).sides(1.0)
        (t, before, _), (t_2, after, _) = wider
        jump = Jump(times=(float(t), float(t_2)), before=before, after=after, inputs=u)
        away = 1.0 / weights[: jump.before.size]
        found = self._stands_out(jump, i, alone) and self._depends_on_state(jump, i, away)
        return jump if found else None

    def _stands_out(self, jump: Jump, i: int, alone: np.ndarray) -> bool:
        """Whether component `i` jumps by more than it changes next to the jump."""
        # What changes by rounding does so everywhere, and what is smooth by more over a longer way.
        # Two conditions that do not switch at the same number leave one with a value of its own.
        with np.errstate(all="ignore"):
            points = [jump.sides(wider) for wider in _BESIDE]
            below, above = (
                np.array([self(t, x, u)[i] for t, x, u in side])
                for side in zip(*points, strict=True)
            )
        for k in range(_BESIDE.size - 3):
            low, high = below[k : k + 4], above[k : k + 4]
            whole = np.abs([high[0] - low[0], *(alone - low[0])]).max()
            if max(np.ptp(low), np.ptp(high)) <= _FLAT * whole and whole > 0.0:
                return True
        return False

    def _depends_on_state(self, jump: Jump, i: int, away: np.ndarray) -> bool:
        """Whether states within the tolerance `away` are on the other side at the same time."""
        if jump.times[0] == jump.times[1]:
            return True
        sides = jump.sides()
        least = _FLAT * abs(np.subtract(*(self(t, x, u)[i] for t, x, u in sides)))
        moves = np.resize(_WAYS, (len(_WAYS), away.size)) * away
        for t, x, u in sides:
            there = [self(t, x + move, u)[i] for move in (*moves, *-moves)]
            if not np.all(np.abs(np.subtract(there, self(t, x, u)[i])) <= least):
                return True
        return False
