"""What an integration works on: the task, arrays for all members, and the right-hand side.

The right-hand side is an address: what calls it is compiled once and not once per diagram.  Here
and in what works on these arrays elements are assigned in loops: assigning a slice compiles to the
same loop and to the text of errors that cannot happen, and takes ten times as long to compile.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ..machine.address import call_out, call_rhs
from .memory import type_of, with_table, zeros
from .methods import rodas5p
from .methods.lu import WHOLE
from .state import DIRECTIONS, INNER, new_lanes

AUTO, EXPLICIT, IMPLICIT, TAYLOR = 0, 1, 2, 3
UNKNOWN, DIFFERENCES, EXACT = 0, 1, 2  # where the stiff method has its Jacobian from
DEGREE = 5  # of the polynomials that delayed signals are kept as


class Task(NamedTuple):
    """What is to be integrated, and how."""

    times: np.ndarray  # of the samples; inputs are linear in between
    inputs: np.ndarray  # (inputs, times)
    p: np.ndarray  # (rows, lanes): what the right-hand side reads besides its arguments
    bending: int  # number of switching functions that blocks declare, the first rows of g
    declared: int  # and with those of conditions at which nothing jumps, which follow
    guarded: int  # and with those of other conditions
    switching: int  # and with the guards
    watched: int  # the first of those that the run watches, behind the other conditions
    ways: np.ndarray  # which of their changes count: 1 rising, -1 falling, 0 both
    ending: np.ndarray  # and whether the run ends there
    memory: np.ndarray  # indices of memory states; what they would become follows in g
    rtol: float
    atol: float
    fixed: float  # step size, 0 if it is to be chosen
    max_steps: int
    method: int
    pair_order: float  # of the explicit pair
    stable: float  # h |lambda| up to which its steps are
    A: np.ndarray  # and its tableau, see `Tableau.arrays`
    B: np.ndarray
    C: np.ndarray
    E: np.ndarray
    inside: np.ndarray  # parts of a step at which event functions are kept: see `Tableau.arrays`
    kept: np.ndarray
    alone: int  # whether this is a single run
    jumps: np.ndarray  # (lanes, instants): when functions of t alone jump or have kinks, then inf
    longest: np.ndarray  # (lanes,) step in s that none may be longer than
    reach: np.ndarray  # (lanes, cells): until when a step may lead that begins in a cell
    opaque: int  # whether something is called as it stands: nobody knows when it jumps
    ticks: np.ndarray  # (lanes, instants): when something happens to sampled blocks, then inf
    which: np.ndarray  # (lanes, instants): which of the functions then
    samples: np.ndarray  # these functions
    due: np.ndarray  # (functions, sampled states): whether it makes the next state
    sampled: np.ndarray  # indices of these states
    resets: np.ndarray  # the function that fills states behind jumps, if there are guards
    jumping: np.ndarray  # indices of these states
    owned: np.ndarray  # (guards, these states): whether a guard's fall is their jump
    derivatives: int  # UNKNOWN until the stiff method asks for them
    c_along: np.ndarray  # what exact ones read besides their arguments
    delays: np.ndarray  # (lines, lanes) in s, without what varies in time
    varied: np.ndarray  # (lines,): number of pieces of what does
    vary_t: np.ndarray  # (pieces, lines): when they begin
    vary_h: np.ndarray  # and how long they are
    vary: np.ndarray  # (pieces, lines, DEGREE + 1): polynomials in s
    kinks: np.ndarray  # (lines, kinks): when a derivative of it jumps, then inf
    direct: np.ndarray  # (lines, lines): whether what arrives at one is what leaves the other
    signals: np.ndarray  # the function that fills the outputs, and then what arrives at the lines
    outputs: int  # number of the outputs
    cost: float  # of a step of the stiff method, in explicit ones
    order: np.ndarray  # of pivots, and where their entries are: see `lu.Elimination`
    rank: np.ndarray
    start: np.ndarray
    pivot: np.ndarray
    column: np.ndarray
    source: np.ndarray
    target: np.ndarray
    highest: int  # order of Taylor's method, 0 for others
    series: np.ndarray  # its functions
    sides: np.ndarray  # rows of comparisons, see `taylor.recurrences.Recurrences`
    c_series: np.ndarray  # and what they read besides their arguments
    table: np.ndarray


class Work(NamedTuple):
    """The arrays for integrating batched members: (states, lanes), (events, lanes), ..."""

    lanes: np.ndarray  # a record for each member, see `_lane`
    samples: np.ndarray  # the states at the task's times: (times, states, lanes)
    y: np.ndarray  # the outputs there: (times, outputs, lanes)
    t: np.ndarray  # the times at which the right-hand side is evaluated
    h: np.ndarray
    hh: np.ndarray  # steps, repeated for every state
    x: np.ndarray  # the states at the start of the step being tried
    x_new: np.ndarray  # and at its end
    x_stage: np.ndarray
    x_ahead: np.ndarray  # for evaluations besides the step's own, with their results
    dx_ahead: np.ndarray
    g_ahead: np.ndarray
    k: np.ndarray  # derivatives at the stages
    g: np.ndarray  # switching functions, and what memories would become
    g_start: np.ndarray
    g_inside: np.ndarray  # inside the step being tried, see `excursions`; the last is scratch
    values: np.ndarray  # of one event function over a step
    newton: np.ndarray
    wanted: np.ndarray  # whether a step is to be looked into
    resolved: np.ndarray  # the longest step over which event functions can be followed
    sought: np.ndarray  # the event function whose minimum is sought, -1 if none is
    attempts: np.ndarray
    part: np.ndarray  # of the step: where it is evaluated
    looked: np.ndarray  # what it is there
    foreseen: np.ndarray  # and was foreseen to be
    wrong: np.ndarray  # what the polynomial may be wrong by
    narrow: np.ndarray  # part of the step below which it is not sought closer
    floor: np.ndarray  # below 0: what is not told from it
    bracket: np.ndarray  # parts below, at and above the least value that is known
    height: np.ndarray  # and the values there
    e: np.ndarray  # event functions: switching functions, and the rates of memories
    above: np.ndarray  # (guards, lanes): whether a guard was not negative when last seen
    rising: np.ndarray  # the value of one that was negative behind its jump and is to rise, or NaN
    log_t: np.ndarray  # of what has happened in a single run: see `log`
    log_row: np.ndarray
    e_start: np.ndarray
    e_before: np.ndarray  # at the end of a step that ended before a condition, see `crossing`
    e_low: np.ndarray  # at the ends of the bracket in which an event is located
    e_high: np.ndarray
    behind: np.ndarray  # 1 where the step before ended with this event; of a condition that is
    # exactly 0 the side that it has come from
    slope: np.ndarray  # rates of g
    slope_start: np.ndarray
    u: np.ndarray
    error: np.ndarray  # of the step over its tolerance
    rate: np.ndarray  # estimate of the largest eigenvalue's magnitude (1/s)
    t_end: np.ndarray
    s: np.ndarray  # next states of sampled blocks, or of those with guards behind a jump
    resume: np.ndarray  # states at the last time, before a sample that is due there
    x_flat: np.ndarray  # the same memory as x, x_new, x_stage, x_ahead, k
    x_new_flat: np.ndarray
    x_stage_flat: np.ndarray
    x_ahead_flat: np.ndarray
    k_flat: np.ndarray
    dx_ahead_flat: np.ndarray
    jacobian: np.ndarray  # of the stiff method, empty with several lanes: see `jacobian_place`
    jacobian_flat: np.ndarray
    columns: np.ndarray  # of 1 / (h gamma) - J, and of its factors
    factors: np.ndarray
    f_t: np.ndarray
    pivots: np.ndarray
    U: np.ndarray
    t_along: np.ndarray  # what exact derivatives are evaluated with, a direction in each column
    x_along: np.ndarray
    u_along: np.ndarray
    v: np.ndarray  # the directions
    finite: np.ndarray
    past: np.ndarray  # polynomials of the lines' signals: (steps, lines, powers, lanes)
    past_t: np.ndarray  # when these steps began
    past_h: np.ndarray  # and how long they were
    level: np.ndarray  # (steps, lines, lanes): which derivative jumps at their beginnings
    kept: np.ndarray  # how many there are
    first: np.ndarray  # (lines, lanes): the break that has arrived last
    next: np.ndarray  # and that will arrive next, -1 if none is known
    fresh: np.ndarray  # which derivative jumps now
    since: np.ndarray  # when the step being tried began
    seen: np.ndarray  # outputs and signals at nodes of that step
    tried: np.ndarray  # its polynomials
    missed: np.ndarray  # what these miss, over its tolerance; -1 where it is a jump
    missed_at_end: np.ndarray
    shown: np.ndarray  # what leaves the lines at the task's times: (times, lines, lanes)
    shown_to: np.ndarray  # up to which of these
    terms: np.ndarray  # Taylor coefficients: (orders, rows, lanes), see `taylor.routine.Series`
    expanded: np.ndarray  # 1 where they are those of the step being tried
    u_rate: np.ndarray
    largest: np.ndarray  # of coefficients, or of what a step lacks, over the tolerance
    table: np.ndarray


_STATES = ("x", "x_new", "x_stage", "x_ahead", "dx_ahead")


def new_work(
    x0: np.ndarray,
    times: np.ndarray,
    inputs: int,
    events: int,
    outputs: int,
    sampled: int = 0,
    guards: int = 0,
    lines: int = 0,
    stages: int = 3,
    terms: tuple[int, int] = (1, 0),
    log: int = 0,
) -> Work:
    """Return the arrays for integrating members from `x0` (states, lanes) on.

    The inputs include the lines, and so do the outputs what arrives there.  `terms` are the
    numbers of orders and rows of Taylor coefficients, and `log` of events that can be noted.
    """
    n, lanes = x0.shape
    stiff = n if lanes == 1 else 0  # the stiff method is for single runs
    shapes: dict[str, tuple[int, ...]] = {
        **dict.fromkeys(_STATES, (n, lanes)),
        **dict.fromkeys(("g", "g_ahead", "g_start", "slope", "slope_start"), (events, lanes)),
        **dict.fromkeys(("e", "e_start", "e_before", "e_low", "e_high", "behind"), (events, lanes)),
        **dict.fromkeys(("t", "h", "error", "rate", "t_end"), (lanes,)),
        **dict.fromkeys(
            ("resolved", "part", "looked", "foreseen", "wrong", "narrow", "floor"), (lanes,)
        ),
        **dict.fromkeys(("bracket", "height"), (3, lanes)),
        **dict.fromkeys(("values", "newton"), (5,)),
        "g_inside": (4, events, lanes),
        "hh": (n * lanes,),
        "k": (stages, n, lanes),
        **dict.fromkeys(("u", "u_rate"), (inputs, lanes)),
        "s": (sampled, lanes),
        "resume": (n, lanes),
        **_of_the_stiff_method(stiff, inputs),
    }
    arrays = {name: np.zeros(shape) for name, shape in shapes.items()}
    arrays |= _guards(guards, lanes, log)
    counted = ("wanted", "sought", "attempts", "expanded")
    arrays |= {name: np.zeros(lanes, dtype=np.int64) for name in counted}
    arrays |= {"terms": zeros((*terms, lanes)), "largest": np.zeros((4, lanes))}
    arrays |= _past(times.size, outputs, lines, lanes)
    arrays["x"][:] = x0
    for name, rows in (("samples", n), ("y", outputs)):
        arrays[name] = np.full((times.size, rows, lanes), np.nan)
    flat = {f"{x}_flat": arrays[x].reshape(-1) for x in _STATES}
    flat["jacobian_flat"] = arrays["jacobian"].reshape(-1)
    arrays["v"] = directions(stiff, inputs)
    k_flat = arrays["k"].reshape(stages, n * lanes)
    arrays |= {"k_flat": k_flat, "pivots": np.zeros(stiff, dtype=np.int64)}
    return with_table(Work, lanes=new_lanes(times, lanes), **arrays, **flat)


def grown(work: Work, names: tuple[str, ...], room: int) -> Work:
    """Return a workspace with so many rows in some of its arrays; what they hold stays."""
    given = work._asdict()
    del given["table"]
    for name in names:
        before = given[name]
        given[name] = np.zeros((room, *before.shape[1:]), dtype=before.dtype)
        given[name][: before.shape[0]] = before
    return with_table(Work, like=WORK, **given)


def _of_the_stiff_method(n: int, inputs: int) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the arrays of the stiff method."""
    return {
        "jacobian": (n // DIRECTIONS + 1, n, DIRECTIONS),
        "columns": (n, n),
        "factors": (n * n,),
        "f_t": (n,),
        "U": (rodas5p.STAGES, n),
        **dict.fromkeys(("t_along", "finite"), (DIRECTIONS,)),
        "x_along": (n, DIRECTIONS),
        "u_along": (inputs, DIRECTIONS),
    }


def _guards(guards: int, lanes: int, log: int) -> dict[str, np.ndarray]:
    """Return the arrays for guards, and for a log of so many entries."""
    counts = {"above": (guards, lanes), "log_row": (log,)}
    return {
        **{name: np.zeros(shape, dtype=np.int64) for name, shape in counts.items()},
        "rising": np.zeros((guards, lanes)),
        "log_t": np.zeros(log),
    }


def _past(times: int, outputs: int, lines: int, lanes: int) -> dict[str, np.ndarray]:
    """Return the arrays for delayed signals; there is no place for a step yet."""
    shapes: dict[str, tuple[int, ...]] = {
        "past": (0, lines, DEGREE + 1, lanes),
        **dict.fromkeys(("past_t", "past_h"), (0, lanes)),
        **dict.fromkeys(("since", "missed", "missed_at_end"), (lanes,)),
        "seen": (DEGREE + 3 if lines else 0, outputs, lanes),
        "tried": (lines, DEGREE + 1, lanes),
        "shown": (times, lines, lanes),
    }
    counts: dict[str, tuple[int, ...]] = {
        "level": (0, lines, lanes),
        **dict.fromkeys(("first", "next", "fresh"), (lines, lanes)),
        **dict.fromkeys(("kept", "shown_to"), (lanes,)),
    }
    arrays = {name: np.zeros(shape) for name, shape in shapes.items()}
    return arrays | {name: np.zeros(shape, dtype=np.int64) for name, shape in counts.items()}


def directions(n: int, inputs: int) -> np.ndarray:
    """Return unit vectors of n states and, behind the inputs, of time, `DIRECTIONS` together."""
    v = np.zeros((n // DIRECTIONS + 1, n + inputs + 1, DIRECTIONS))
    for c in range(n + 1):
        v[c // DIRECTIONS, c if c < n else n + inputs, c % DIRECTIONS] = 1.0
    return v


_LINE, _GRID, _NONE = np.zeros(1), np.zeros((1, 1)), np.zeros(0, dtype=np.int64)
_PLACES = np.zeros((1, 1), dtype=np.int64)
TASK = type_of(  # only the types of these matter
    with_table(
        Task, times=_LINE, inputs=_GRID, p=_GRID, memory=_NONE,
        bending=0, declared=0, guarded=0, switching=0, watched=0, ways=_NONE, ending=_NONE,
        rtol=0.0, atol=0.0, fixed=0.0, max_steps=0, method=0, pair_order=0.0, stable=0.0,
        A=_GRID, B=_GRID, C=_LINE, E=_LINE, inside=_GRID, kept=_NONE, alone=0,
        jumps=_GRID, longest=_LINE, reach=_GRID, opaque=0,
        ticks=_GRID, which=_PLACES, samples=_NONE,
        due=_PLACES, sampled=_NONE, resets=_NONE, jumping=_NONE, owned=_PLACES,
        derivatives=0, c_along=_GRID,
        delays=_GRID, varied=_NONE, vary_t=_GRID, vary_h=_GRID,
        vary=np.zeros((1, 1, 1)), kinks=_GRID,
        direct=_PLACES, signals=_NONE, outputs=0,
        cost=0.0, highest=0, series=_NONE, sides=_PLACES, c_series=_GRID, **vars(WHOLE),
    )
)  # fmt: skip
WORK = type_of(new_work(_GRID, _LINE, 1, 1, 1))


@numba.njit(**INNER)
def on_this_side(lanes, w):
    """Have functions of t alone seen on the side on which a step lies, also at its ends."""
    for j in range(lanes.size):
        w.t[j] = max(min(w.t[j], lanes[j].left), lanes[j].right)


@numba.njit(**INNER)
def inputs_at(task, lanes, w):
    """Fill w.u with the inputs at the times w.t: linear within a segment of the time grid.

    What leaves transport delays then follows behind them, and the inputs' rates where ideal relays
    ask for them.
    """
    t, times, inputs, u = w.t, task.times, task.inputs, w.u
    for j in range(lanes.size):
        m = min(lanes[j].segment, times.size - 2)  # a lane that has finished is not moved on
        share = (t[j] - times[m]) / (times[m + 1] - times[m])
        for i in range(inputs.shape[0]):
            first, last = inputs[i, m], inputs[i, m + 1]  # exact at both, and where they are equal
            u[i, j] = last if share == 1.0 else first + share * (last - first)
    for i in range(task.delays.shape[0]):
        for j in range(lanes.size):
            u[inputs.shape[0] + i, j] = past_value(task, w, i, j, t[j])
    for j in range(lanes.size):
        input_rates(task, lanes[j].segment, inputs.shape[0] + task.delays.shape[0], u, j)


@numba.njit(**INNER)
def input_rates(task, segment, first, rates, j):
    """Fill rows of `rates` from `first` on, if there are any, with the inputs' slopes."""
    m = min(segment, task.times.size - 2)
    for i in range(min(task.inputs.shape[0], rates.shape[0] - first)):
        rise = task.inputs[i, m + 1] - task.inputs[i, m]
        rates[first + i, j] = rise / (task.times[m + 1] - task.times[m])


@numba.njit(**INNER)
def piece_at(starts, column, low, high, t):
    """Return which piece from `low` to `high` a time lies in: the last that has begun."""
    while low < high:
        middle = (low + high + 1) // 2
        if starts[middle, column] <= t:
            low = middle
        else:
            high = middle - 1
    return low


@numba.njit(**INNER)
def _within(start, length, t):
    """Return where a time lies in a piece, from -1 to 1.

    What looks ahead of a step, or of the run, sees the polynomial standing still.
    """
    z = 2.0 * (t - start) / length - 1.0
    return min(max(z, -1.0 - 1e-6), 1.0 + 1e-6)


@numba.njit(**INNER)
def _variation(task, i, t):
    """Return by how much the delay of line `i` is longer at time t, and the slope of that."""
    k = piece_at(task.vary_t, i, 0, task.varied[i] - 1, t)
    z = _within(task.vary_t[k, i], task.vary_h[k, i], t)
    value, slope = task.vary[k, i, DEGREE], 0.0
    for n in range(DEGREE - 1, -1, -1):
        slope = slope * z + value
        value = value * z + task.vary[k, i, n]
    return value, 2.0 * slope / task.vary_h[k, i]


@numba.njit(**INNER)
def sent(task, i, j, t):
    """Return when line `i` of a lane was given what leaves it at time t."""
    if task.varied[i] == 0:
        return t - task.delays[i, j]
    return t - (task.delays[i, j] + _variation(task, i, t)[0])


@numba.njit(**INNER)
def arrival(task, i, j, s):
    """Return when leaves line `i` of a lane what it is given at time s; inf behind the run.

    The delay grows by less than 1 s per second: Newton's method, with the bracket that this gives.
    """
    if task.varied[i] == 0:
        return s + task.delays[i, j]
    last = task.varied[i] - 1
    low, high = task.vary_t[0, i], task.vary_t[last, i] + task.vary_h[last, i]
    if sent(task, i, j, high) < s:
        return np.inf
    t = min(max(s + task.delays[i, j], low), high)
    for _ in range(100):
        value, slope = _variation(task, i, t)
        missed = t - (task.delays[i, j] + value) - s
        if missed > 0.0:
            high = t
        else:
            low = t
        new = t - missed / (1.0 - slope)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - t) <= 1e-15 * abs(t) or new == t:
            return new
        t = new
    return t


@numba.njit(**INNER)
def past_value(task, w, i, j, t):
    """Return what leaves line `i` of a lane at time t.

    Of the polynomials between two breaks only, so that rounding never reads the other side.
    """
    s = sent(task, i, j, t)
    last = w.next[i, j] - 1 if w.next[i, j] >= 0 else w.kept[j] - 1
    k = piece_at(w.past_t, j, w.first[i, j], last, s)
    z = _within(w.past_t[k, j], w.past_h[k, j], s)
    value = w.past[k, i, DEGREE, j]
    for n in range(DEGREE - 1, -1, -1):
        value = value * z + w.past[k, i, n, j]
    return value


@numba.njit(**INNER)
def evaluate(rhs, task, lanes, w, x, dx, g):
    """Evaluate the right-hand side at the times w.t; memory stands still within a step."""
    if task.jumps.shape[1]:
        on_this_side(lanes, w)
    if w.u.shape[0]:
        inputs_at(task, lanes, w)
    call_rhs(rhs, w.t, x, w.u, task.p, dx, g)
    for i in task.memory:
        for j in range(lanes.size):
            dx[i, j] = 0.0


def outputs(rhs, out, task, w):
    """Fill ``w.y[m, :, lane]`` with the outputs at ``w.samples[m, :, lane]``.

    Samples inside a step have the memory of its beginning; here they get their own.
    """
    states, y = w.samples, w.y
    for m in range(task.times.size):
        for j in range(w.t.size):
            w.t[j] = task.times[m]
            for i in range(task.inputs.shape[0]):
                w.u[i, j] = task.inputs[i, m]
            for i in range(task.delays.shape[0]):
                w.u[task.inputs.shape[0] + i, j] = w.shown[m, i, j]
            input_rates(task, m, task.inputs.shape[0] + task.delays.shape[0], w.u, j)
        if task.memory.size:
            call_rhs(rhs, w.t, states[m], w.u, task.p, w.dx_ahead, w.g)
            for i in range(task.memory.size):
                for j in range(w.t.size):
                    states[m, task.memory[i], j] = w.g[task.switching + i, j]
        call_out(out, w.t, states[m], w.u, task.p, y[m])
