"""What an integration works on: the task, and arrays for all members.

Both are records of records: what a delay, the stiff method or a reset needs is defined where it is
used, and laid out here.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from ...accumulation import PACE
from .delayed import DelayLines, KeptSignals, new_past
from .evaluate import Scratch, new_ahead
from .events.functions import EventRows, Events, Inside, Memories
from .events.sharp import Sharp, SharpArrays
from .log import Log
from .memory import Places2, Reals1, Reals2, Reals3, arrays_alike, type_of, with_fields, with_table
from .methods.stiff import StiffArrays, StiffMethod, new_stiff
from .methods.tableau import ExplicitPair
from .methods.taylor import TaylorArrays, TaylorMethod, new_terms
from .resets import Guards, Resets
from .samples import Ticks, Timed
from .state import LANE, new_lanes


class Task(NamedTuple):
    """What is to be integrated, and how."""

    times: Reals1  # of the samples; inputs are linear in between
    inputs: Reals2  # (inputs, times)
    outputs: int  # number of the outputs
    p: Reals2  # (rows, lanes): what the right-hand side reads besides its arguments
    alone: int  # whether this is a single run
    rtol: float
    atol: float
    fixed: float  # step size, 0 if it is to be chosen
    max_steps: int
    method: int
    pair: ExplicitPair  # the explicit one
    stiff: StiffMethod
    taylor: TaylorMethod
    rows: EventRows
    timed: Timed
    clocks: Ticks
    resets: Resets
    sharp: Sharp
    lines: DelayLines
    table: Places2


class Work(NamedTuple):
    """The arrays for integrating batched members: (states, lanes), (events, lanes), ..."""

    lanes: Annotated[np.ndarray, LANE, 1]  # a record for each member
    samples: Reals3  # the states at the task's times: (times, states, lanes)
    y: Reals3  # the outputs there: (times, outputs, lanes)
    t: Reals1  # the times at which the right-hand side is evaluated
    u: Reals2  # and the inputs
    h: Reals1
    hh: Reals1  # steps, repeated for every state
    x: Reals2  # the states at the start of the step being tried
    x_new: Reals2  # and at its end
    x_stage: Reals2
    k: Reals3  # derivatives at the stages
    x_flat: Reals1  # the same memory as x, x_new, x_stage, k
    x_new_flat: Reals1
    x_stage_flat: Reals1
    k_flat: Reals2
    error: Reals1  # of the step over its tolerance
    rate: Reals1  # estimate of the largest eigenvalue's magnitude (1/s)
    s: Reals2  # next states of sampled blocks, or of those with guards behind a jump
    resume: Reals2  # states at the last time, before a sample that is due there
    ahead: Scratch
    events: Events
    memories: Memories
    inside: Inside
    sharp: SharpArrays
    stiff: StiffArrays
    taylor: TaylorArrays
    guards: Guards
    log: Log
    past: KeptSignals
    table: Places2


TASK, WORK = type_of(Task), type_of(Work)


def new_work(
    x0: np.ndarray,
    times: np.ndarray,
    inputs: int,
    events: int,
    memories: int,
    outputs: int,
    sampled: int = 0,
    guards: int = 0,
    lines: int = 0,
    stages: int = 3,
    terms: tuple[int, int] = (1, 0),
    sharp: int = 0,
    log: int = 0,
) -> Work:
    """Return the arrays for integrating members from `x0` (states, lanes) on."""
    # The inputs include the lines, and so do the outputs what arrives there. `terms` are the
    # numbers of orders and rows of Taylor coefficients, `log` of events that can be noted, and
    # `sharp` those by which sharp functions are measured.
    n, lanes = x0.shape
    states = {name: np.zeros((n, lanes)) for name in ("x", "x_new", "x_stage")}
    states["x"][:] = x0
    k = np.zeros((stages, n, lanes))
    return with_table(
        Work,
        lanes=new_lanes(times, lanes),
        samples=np.full((times.size, n, lanes), np.nan),
        y=np.full((times.size, outputs, lanes), np.nan),
        u=np.zeros((inputs, lanes)),
        hh=np.zeros(n * lanes),
        **{name: np.zeros(lanes) for name in ("t", "h", "error", "rate")},
        **states,
        **{f"{name}_flat": array.reshape(-1) for name, array in states.items()},
        k=k,
        k_flat=k.reshape(stages, n * lanes),
        s=np.zeros((sampled, lanes)),
        resume=np.zeros((n, lanes)),
        ahead=new_ahead(n, events, memories, lanes),
        events=arrays_alike(Events, (events, lanes), g_inside=(4, events, lanes)),
        memories=arrays_alike(Memories, (memories, lanes), m_inside=(4, memories, lanes)),
        inside=arrays_alike(
            Inside, (lanes,), values=(5,), newton=(5,), bracket=(3, lanes), height=(3, lanes)
        ),
        sharp=arrays_alike(
            SharpArrays,
            (sharp, lanes),
            at=(7, sharp, lanes),
            **dict.fromkeys(("part", "until", "lasted"), (lanes,)),
        ),
        stiff=new_stiff(n if lanes == 1 else 0, inputs),  # that method is for single runs
        taylor=new_terms(*terms, inputs, lanes),
        guards=arrays_alike(Guards, (guards, lanes), pace=(guards, lanes, PACE)),
        log=arrays_alike(Log, (log, lanes)),
        past=new_past(times.size, outputs, lines, lanes),
    )


def with_stages(work: Work, stages: int) -> Work:
    """Return a workspace for a method with so many stages, where the next step begins."""
    k = np.zeros((stages, *work.k.shape[1:]))
    k[0] = work.k[0]
    return with_fields(work, k=k, k_flat=k.reshape(stages, -1))
