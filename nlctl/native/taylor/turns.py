"""The method "auto" of a single run: by the explicit pair and by Taylor's method in turn.

A run begins with the explicit pair, until that has cost what a turn costs: if it ends sooner,
turning would not have paid, and if it is long, little is lost.  Then Taylor's method is tried.  It
stays while it gets further than the explicit pair with the same work, both as measured in this run,
one right after the other; the explicit pair is measured again from time to time, and that is also
when it sees that the equations have become stiff.  Nothing rests on clocks: a run has the same
numbers on every machine.

Where coefficients are not finite although the rates are, as those of the root of t at 0, the
explicit pair has its turn whatever the method.
"""

import contextlib
from dataclasses import replace

import numpy as np

from ...errors import ParameterError
from ..integrate.memory import with_fields
from ..integrate.methods.tableau import pair_of
from ..integrate.methods.taylor import OTHER_METHOD, SLOPES, new_terms
from ..integrate.methods.turn import FIRST_TURN, MEASURED
from ..integrate.state import DIVERGED, METHOD, RUNNING, STEP_TOO_SMALL
from ..integrate.workspace import with_stages
from ..reading import Reading
from ..run import Run
from ..settings import Settings
from .method import order_for, with_taylor
from .routine import series

_ORDER = 8  # from which on steps are worth more than what they cost, in most loops
_TURN, _STEP = 50_000, 80  # what a turn costs, and a step but for its rates, in operations of these
_FEWEST, _LATEST = 2 * MEASURED, 600  # steps of the explicit pair, before Taylor's method is tried
_SPAN, _MOST = 800, 2000  # steps of Taylor's method before that, twice as many each time
_COMPARED = with_fields(OTHER_METHOD, compared=1)


def may_turn(reading: Reading) -> bool:
    """Whether runs of a diagram may continue by Taylor's method."""
    # Delays have no coefficients, and where clocks end the steps a run can be resumed at a sample,
    # and knows nothing of the steps before. The passes of a loop that end at a tolerance are long,
    # and hardly differ.
    program, lines = reading.program, reading.schedule.lines
    never = program.sampled or lines or reading.equations.graph.of_passes
    return bool(reading.system.nstates) and not never


def with_turns(reading: Reading, run: Run, settings: Settings) -> Run:
    """Return a run that tries Taylor's method after so many steps."""
    tight = order_for(settings.rtol) >= _ORDER
    if settings.method != "auto" or settings.step or not (tight and may_turn(reading)):
        return run
    steps = min(max(_TURN // (_STEP + run.machine.lowered.operations), _FEWEST), _LATEST)
    run.lanes["span"], run.lanes["wait"], run.lanes["stay"] = steps, steps, _SPAN
    return replace(run, task=with_fields(run.task, taylor=_COMPARED))


def series_ahead(reading: Reading, p: np.ndarray) -> None:
    """Make the code of Taylor's method now, where runs with parameters `p` may continue by it."""
    if may_turn(reading):
        with contextlib.suppress(ParameterError):
            series(reading, p, 1)


def turned(reading: Reading, run: Run, p: np.ndarray, settings: Settings) -> Run:
    """Return a run that continues by the other method, if it asks for that."""
    status = run.lanes["status"][0]
    fails = status in (STEP_TOO_SMALL, DIVERGED) and _fails(run)
    if status != METHOD and not fails:
        return run
    lane = run.lanes[0]
    if fails:  # the explicit pair has the last word
        lane["span"] = FIRST_TURN
    lane["status"] = RUNNING
    lane["from_t"], lane["from_accepted"] = lane["t"], lane["accepted"]
    lane["from_tried"] = lane["accepted"] + lane["rejected"]
    if run.task.taylor.highest:
        return _by_pair(run, settings)
    lane["other_pace"] = lane["pace"]
    lane["span"] = FIRST_TURN
    if run.series is not None:  # it has had its turn before
        run.work.taylor.expanded[:] = 0
        task = with_fields(run.task, taylor=run.series.taylor, pair=run.series.pair)
        return replace(run, task=task, work=with_stages(run.work, SLOPES))
    try:
        task, terms = with_taylor(run.task, reading, p[:, None], settings)
    except ParameterError:  # there is what it cannot do
        return replace(run, task=with_fields(run.task, taylor=OTHER_METHOD))
    arrays = new_terms(*terms, run.work.u.shape[0], 1)
    work = with_fields(with_stages(run.work, SLOPES), taylor=arrays)
    return replace(run, task=task, work=work, series=task)


def _fails(run: Run) -> bool:
    """Whether it is Taylor's method that does not get on: from a place where all is finite."""
    # Where a guard is NaN it is, at that place: no other method may continue.
    if not (run.task.taylor.highest and run.task.taylor.compared):
        return False
    here = np.append(run.work.x, run.work.events.g_start)
    return bool(np.isfinite(here).all())


def _by_pair(run: Run, settings: Settings) -> Run:
    """Return a run that continues by the explicit pair: to be measured, or for longer each time."""
    lane = run.lanes[0]
    if lane["span"] > FIRST_TURN:
        lane["span"], lane["stay"] = MEASURED, min(2 * lane["stay"], _MOST)
        lane["wait"] = 0  # it has paid
    else:
        lane["wait"] = max(2 * lane["wait"], MEASURED)
        lane["span"], lane["stay"] = lane["wait"], _SPAN
    lane["h"] = lane["other_pace"] or lane["h"]  # as it was when the pair was measured
    locate_anew(lane)
    task = with_fields(run.task, taylor=_COMPARED, pair=pair_of(settings.pair))
    return replace(run, task=task, work=with_stages(run.work, settings.pair.stages))


def locate_anew(lane: np.ndarray) -> None:
    """Have what is being located by one method be found again by another."""
    for name in ("tries", "seeks", "traces", "returns", "across", "cross", "at_once"):
        lane[name] = 0
