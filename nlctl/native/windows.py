"""Windows of a run's steps: what is looked at between them, and what happens by that.

A run comes back from machine code after so many steps.  It may ask for derivatives, it may chatter,
see `chattering.detection`, and it may crawl: by the explicit method it gets nowhere, and nothing
jumps there.  Then the stiff method is tried.  It stays where it gets much further with the same
work; otherwise the run continues as if nothing had been tried.

What comes to rest in a finite time crawls, as x' = -sign(x) |x|^(1/3) does at 0: its rates have no
bound there, but each step leads across 0, where the explicit method sees none of them.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from .along import derivatives
from .chattering.detection import asked, jump_of, probe_of, snapshot
from .compiled import Compiled
from .happened import with_log
from .histories import with_room
from .integrate.memory import named_arrays, with_fields
from .integrate.methods.lu import WHOLE
from .integrate.methods.stiff import DIFFERENCES, EXACT, stiff_method
from .integrate.state import AUTO, DERIVATIVES, METHOD, OK, RUNNING, STIFF, Status
from .integrators import integrators
from .run import Run
from .taylor.turns import locate_anew

ROUNDS = 2000  # steps between looks at Ctrl-C and the progress
_STEPS = 40  # of the stiff method
_FURTHER = 100.0  # times as far as by explicit steps with the same work: a trial that pays
_AWAY = 1e5  # explicit steps: the first one that is tried at rest
_ROUNDING = 1e-13  # of a state: no tolerance is less


class _Trial(NamedTuple):
    """How the stiff method is tried: closer to rest rates are small, and steps may be long."""

    part: float  # of the tolerances
    steps: int
    first: float  # explicit steps: the first one


_TRIALS = (_Trial(1.0, _STEPS, 1.0), _Trial(1e-3, 100, 1.0), _Trial(1e-6, _STEPS, 100.0))


def go_on(run: Run, rounds: int = ROUNDS) -> Run:
    """Try up to `rounds` steps in every lane that is still running."""
    rhs, _ = run.machine.entries
    point, along = (0, 0) if run.along is None else run.along.entries
    while rounds:  # what has no room waits until there is: lanes do not shorten others' windows
        work = with_log(run.task, with_room(run.task, run.work))
        run = run if work is run.work else replace(run, work=work)
        run.lanes["untried"] = 0
        integrators()["advance"](rhs, point, along, run.task, run.work, rounds)
        run.machine.check(run.task.p)
        rounds = int(run.lanes["untried"][0])
    return run


def watched(run: Run, paces: np.ndarray) -> Run:
    """Try a window of steps in every lane; one that chatters at its end gets that status."""
    # It is the same number of steps whatever lanes are looked at, so that what becomes of one does
    # not depend on the others.
    probe = probe_of(run.task)
    run = go_on(run, ROUNDS - probe)
    if (run.lanes["status"] >= 0).all():  # all are over
        return run
    lanes = asked(run.lanes, paces).nonzero()[0]
    if not len(lanes):
        return go_on(run, probe) if RUNNING in run.lanes["status"] else run
    begun = run.lanes["t"].copy()
    run = _examined(run, [int(j) for j in lanes], probe)
    paces["pace"] = (run.lanes["t"] - begun) / probe
    return run


def _examined(run: Run, lanes: list[int], probe: int) -> Run:
    """Try steps one by one, by one method; lanes that chatter there get that status."""
    task, status, attempts = run.task, run.lanes["status"], []
    turns = status == METHOD
    status[turns] = RUNNING
    run = replace(run, task=with_fields(task, taylor=with_fields(task.taylor, compared=0)))
    for _ in range(probe):
        run, attempt = snapshot(run.work, partial(go_on, run, 1))
        attempts.append(attempt)
    found = {j: jump_of(run, attempts, j) for j in lanes if status[j] == RUNNING}
    jumps = {j: jump for j, jump in found.items() if jump is not None}
    status[turns & (status == RUNNING)] = METHOD
    status[list(jumps)] = Status.CHATTERING
    return replace(run, task=task, jumps={**run.jumps, **jumps})


def differentiated(compiled: Compiled, run: Run, p: np.ndarray) -> Run:
    """Return a run with the derivatives that its stiff method has asked for, if it has."""
    if run.lanes["status"][0] != DERIVATIVES:
        return run
    along, stiff = derivatives(compiled, p), run.task.stiff
    stiff = stiff_method(
        run.work.x.shape[0],
        EXACT if along else DIFFERENCES,
        along.c if along else stiff.c,
        along.elimination if along else WHOLE,
    )
    run.lanes["status"] = RUNNING
    return replace(run, task=with_fields(run.task, stiff=stiff), along=along)


def next_window(compiled: Compiled, run: Run, paces: np.ndarray, p: np.ndarray) -> Run:
    """Try a window of steps of a single run, and the stiff method where it crawls behind that."""
    run = differentiated(compiled, watched(run, paces), p)
    if not _crawls(run, paces)[0]:
        return run
    for trial in _TRIALS:
        tried = _by_stiff_method(compiled, run, p, float(paces["pace"][0]), trial)
        if tried is not None:
            paces["looks"] = 0  # that one has paid
            return tried
    return run


def given_up(run: Run, paces: np.ndarray) -> None:
    """Have lanes that crawl run alone: the stiff method is for single runs."""
    run.lanes["status"][_crawls(run, paces)] = STIFF


def _crawls(run: Run, paces: np.ndarray) -> np.ndarray:
    """Return which lanes have become slow for no reason that is known, where they may be stiff."""
    task, lanes = run.task, run.lanes
    may = task.method == AUTO and not (task.fixed or task.taylor.highest or task.rows.memory.size)
    going = (lanes["status"] == RUNNING) | (lanes["status"] == METHOD)
    for j, jump in run.jumps.items():  # switches come ever closer, and it does not stay at a jump
        going[j] |= lanes["status"][j] == Status.CHATTERING and jump.accumulates
    return may & (paces["crawls"] != 0) & going


def _by_stiff_method(
    compiled: Compiled, run: Run, p: np.ndarray, pace: float, trial: _Trial
) -> Run | None:
    """Return a run after some steps of the stiff method, None if that does not pay."""
    # `pace`: how far an explicit step leads (s). What is written in a trial that does not pay is
    # what it was again, and no such step is counted.
    before = [(array, array.copy()) for _, array in named_arrays(run.work)]
    lane = run.lanes[0]
    begun, count = float(lane["t"]), int(lane["accepted"] + lane["rejected"])
    locate_anew(lane)
    lane["status"], lane["stiff"], lane["slow"] = RUNNING, 1, 0
    lane["judged_at"], lane["judged_after"], lane["h"] = begun, count, trial.first * pace
    tried = _closer(run, trial.part)
    for rounds in (1, trial.steps):  # with its first step it asks for derivatives
        tried = differentiated(compiled, go_on(tried, rounds), p)
    if trial.part < 1.0:
        tried = replace(tried, task=with_fields(tried.task, rtol=run.task.rtol, atol=run.task.atol))
        tried.lanes["h"] = _AWAY * pace
        tried = go_on(tried, _STEPS)
    lane = tried.lanes[0]
    work = run.task.stiff.cost * (lane["accepted"] + lane["rejected"] - count)
    if lane["status"] in (RUNNING, METHOD, OK) and lane["t"] - begun > _FURTHER * pace * work:
        return replace(tried, jumps={})
    for array, held in before:
        array[...] = held
    return None


def _closer(run: Run, part: float) -> Run:
    """Return a run with errors of so small a part of its tolerances."""
    rtol, atol = run.task.rtol, run.task.atol
    least = min(rtol, _ROUNDING)
    return replace(run, task=with_fields(run.task, rtol=max(part * rtol, least), atol=part * atol))
