"""The method "auto" of a single run: by the explicit pair and by Taylor's method in turn.

A run begins with the explicit pair: a short one is over before Taylor coefficients are compiled.
After that Taylor's method is tried.  It stays while it gets further than the explicit pair with
the same work, both as measured in this run, one right after the other; the explicit pair is
measured again from time to time, and that is also when it sees that the equations have become
stiff.  Nothing rests on clocks: a run has the same numbers on every machine.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...errors import ParameterError
from ..integrate.memory import replaced
from ..integrate.methods.tableau import pair_of
from ..integrate.methods.taylor import MEASURED, OTHER_METHOD, STAGES, TRIAL, new_terms
from ..integrate.state import METHOD, RUNNING
from ..integrate.workspace import with_stages
from .method import order_for, with_taylor

if TYPE_CHECKING:
    from ..compiled import Compiled
    from ..integrate.driver import Run, Settings

_ORDER = 10  # from which on steps are worth more than what they cost, in most loops
_STEPS = 250  # of the explicit pair, before Taylor's method is tried
_SPAN, _MOST = 200, 2000  # steps of Taylor's method before that, twice as many each time


def with_turns(compiled: Compiled, run: Run, settings: Settings) -> Run:
    """Return a run that tries Taylor's method after so many steps.

    More of them for large diagrams, whose coefficients take longer to compile.
    """
    if settings.method != "auto" or settings.step or order_for(settings.rtol) < _ORDER:
        return run
    if compiled.program.memory or not compiled.system.nstates or compiled.schedule.lines:
        return run
    steps = max(_STEPS, len(compiled.lowered.functions["rhs"].plan.nodes))
    run.lanes["span"] = run.lanes["wait"] = steps
    return replace(run, task=replaced(run.task, taylor=replaced(OTHER_METHOD, span=_SPAN)))


def turned(compiled: Compiled, run: Run, p: np.ndarray, settings: Settings) -> Run:
    """Return a run that goes on by the other method, if it asks for that."""
    lane = run.lanes[0]
    if lane["status"] != METHOD:
        return run
    lane["status"], lane["other_pace"] = RUNNING, lane["pace"]
    lane["from_t"], lane["from_tried"] = lane["t"], lane["accepted"] + lane["rejected"]
    if run.task.taylor.highest:
        return _by_pair(run, settings)
    lane["span"] = TRIAL
    if run.series is not None:  # it has had its turn before
        taylor = replaced(run.series.taylor, span=run.task.taylor.span)
        run.work.taylor.expanded[:] = 0
        task = replaced(run.task, taylor=taylor, pair=run.series.pair)
        return replace(run, task=task, work=with_stages(run.work, STAGES))
    try:
        task, terms = with_taylor(run.task, compiled, p[:, None], settings)
    except ParameterError:  # there is what it cannot do
        return replace(run, task=replaced(run.task, taylor=OTHER_METHOD))
    arrays = new_terms(*terms, run.work.u.shape[0], 1)
    work = replaced(with_stages(run.work, STAGES), taylor=arrays)
    return replace(run, task=task, work=work, series=task)


def _by_pair(run: Run, settings: Settings) -> Run:
    """Return a run that goes on by the explicit pair: to be measured, or for longer each time."""
    lane, span = run.lanes[0], run.task.taylor.span
    if lane["span"] > TRIAL:
        lane["span"], span = MEASURED, min(2 * span, _MOST)
    else:
        lane["wait"] *= 2
        lane["span"], span = lane["wait"], _SPAN
    lane["h"] = lane["pace"]
    task = replaced(run.task, taylor=replaced(OTHER_METHOD, span=span), pair=pair_of(settings.pair))
    return replace(run, task=task, work=with_stages(run.work, settings.pair.stages))
