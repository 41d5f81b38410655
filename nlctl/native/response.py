"""Responses of compiled diagrams."""

from collections.abc import Callable, Mapping
from typing import Any

import control as ct
import numpy as np

from ..accumulation import limit_of
from ..annotations import as_annotated
from ..diagrams import state_names
from ..errors import ChatteringError, DivergedError, ParameterError, ZenoError
from ..responses.arguments import evaluation_array, input_array, interpolated, state_array
from ..responses.time_response import Response, response_of
from ..responses.watched import Watched, check_numbers, nan_watchers, not_a_number
from .audit import Audit, Trial
from .audit import audit as compare
from .chattering.place import chattering_words
from .compiled import Compiled, with_watched
from .describe import described_functions
from .driver import Course, trajectory
from .floats import as_given
from .integrate.state import Status
from .own_errors import own_error
from .reading import Resolved
from .results import Trajectory
from .settings import Settings

_LARGE = 1e6  # a state that a message names, in its unit


def respond(
    compiled: Compiled,
    times: np.ndarray,
    inputs: object = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    settings: Settings,
    params: Mapping[str, Any] | None = None,
    evaluation_times: object = "T",
    ignore_errors: bool = False,
    progress: Callable[[float], object] | None = None,
    audit: Audit = True,
    watched: tuple[Watched, ...] = (),
    **form: object,
) -> Response:
    """Integrate a compiled diagram; see `nlctl.input_output_response` for the arguments."""
    system = compiled.system
    compiled = with_watched(compiled, (*watched, *nan_watchers(watched)), params)
    compiled = as_given(compiled, params)
    evaluated = evaluation_array(evaluation_times, times)
    u, resolved = input_array(system, inputs, times), compiled.resolved(params)
    own = initial_state is None
    x0 = resolved.initial_state.copy() if own else state_array(system, initial_state)
    grid = times if evaluated is times else _grid(system, times, evaluated)
    if grid is not times:
        u = interpolated(u, times, grid)
    p = resolved.p
    check_numbers(watched, (float(grid[0]), x0, u[:, 0]), params)
    course = Course(compiled=compiled, times=grid, inputs=u, settings=settings)
    reached = trajectory(course, x0, p, progress)
    compiled = compiled.calling(reached.cut)
    trial = Trial(
        time=reached.time, states=reached.states, inputs=reached.inputs, p=p, params=params, width=1
    )
    compare(compiled, trial, audit)
    run = reached.statistics
    if run.status is Status.STOPPED and not ignore_errors:
        # whoever takes it for an error continues
        raise KeyboardInterrupt(_message(compiled, reached, p, params))
    ended = run.status is Status.ENDED
    failed = failure(compiled, reached, p, params)
    if failed is not None and not ignore_errors:
        raised = own_error(compiled, reached, params) if run.status is Status.DIVERGED else None
        raise raised or failed
    shown: Any = slice(None)
    if grid is not evaluated:
        shown = np.isin(reached.time, evaluated)
        shown[-1:] |= ended
    message = None if failed is None else str(failed)
    return _response(resolved, reached, shown, (params, form, message))


def failure(
    compiled: Compiled, reached: Trajectory, p: np.ndarray, params: Mapping[str, Any] | None
) -> DivergedError | None:
    """Return why a run has not reached its last time, if it has not."""
    run, guards = reached.statistics, compiled.program.guards
    if run.status is Status.ENDED:
        return not_a_number(reached.happened)
    if run.status is Status.OK:
        return None
    if reached.culprit >= 0 and run.status in (Status.ZENO, Status.DIVERGED):
        block = compiled.schedule.nodes[guards[reached.culprit]].path
        if run.status is Status.ZENO:
            return ZenoError.of(block, limit_of(_falls(compiled, reached), reached.since))
        if not np.isfinite(reached.guard):
            why = f"block '{block}' has a guard that is NaN at t = {run.time:.6g} s"
            return DivergedError(why, run.time)
    kind = ChatteringError if run.status is Status.CHATTERING else DivergedError
    return kind(_message(compiled, reached, p, params), run.time)


def _falls(compiled: Compiled, reached: Trajectory) -> list[float]:
    """Return when the guard has fallen that has ended a run."""
    guards = compiled.program.guards
    alike = [k for k, block in enumerate(guards) if block == guards[reached.culprit]]
    path = compiled.schedule.nodes[guards[reached.culprit]].path
    name = "guard" if len(alike) == 1 else f"guard {alike.index(reached.culprit) + 1}"
    return reached.happened.times(path, name).tolist()


def _grid(system: ct.InputOutputSystem, times: np.ndarray, evaluated: np.ndarray) -> np.ndarray:
    """Return the times of a run with inputs at `times` that is evaluated at other times."""
    # A sampled system starts with the first of these; in between inputs are linear, and have their
    # break points where they were given.
    if system.isdtime(strict=True):
        return evaluated
    return np.union1d(times if system.ninputs else times[[0, -1]], evaluated)


@as_annotated
def uninterrupted(response: Any) -> Any:
    """Return a response that was computed with `ignore_errors`, if Ctrl-C has not ended it.

    Parameters
    ----------
    response : control.TimeResponseData
        Of `nlctl.input_output_response`.

    Returns
    -------
    control.TimeResponseData
        The same.

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C ended the run.
    ParameterError
        If it is not such a response.
    """
    if getattr(response, "statistics", None) is None:
        raise ParameterError(
            "uninterrupted needs a response of nlctl.input_output_response, got "
            f"{type(response).__name__}"
        )
    if response.statistics.status is Status.STOPPED:
        raise KeyboardInterrupt(response.message)
    return response


def _message(
    compiled: Compiled, reached: Trajectory, p: np.ndarray, params: Mapping[str, Any] | None
) -> str:
    run = reached.statistics
    what = {
        Status.DIVERGED: "diverged: no finite state after",
        Status.STEP_LIMIT: "stopped at the limit of steps at",
        Status.STOPPED: "was stopped at",
        Status.CHATTERING: "is chattering at",
        Status.ZENO: "jumps without end before",
        Status.STEP_TOO_SMALL: "diverged or jumps: no step is small enough after",
    }
    sentence = f"'{compiled.system.name}' {what[run.status]} t = {run.time:.6g} s"
    if run.status in (Status.DIVERGED, Status.STEP_TOO_SMALL):
        return sentence + _grown(compiled, reached) + _cut_short(compiled, reached)
    if run.jump is None:
        return sentence
    return f"{sentence}: {chattering_words(compiled, p, params, run.jump)}"


def _cut_short(compiled: Compiled, reached: Trajectory) -> str:
    """Say which loops may have ended a run that does not call their functions instead."""
    if not reached.cut or reached.statistics.called:
        return ""
    names = ", ".join(described_functions(compiled.schedule, reached.cut))
    return (
        f", or a loop in the {names} takes more passes there than are written out: bound them, or "
        "run it by nlctl.input_output_response, which calls such a function"
    )


def _grown(compiled: Compiled, reached: Trajectory) -> str:
    """Say which state was large at the last time at which all of them were finite."""
    finite = np.flatnonzero(np.isfinite(reached.states).all(axis=0))
    if not finite.size or not reached.states.size:
        return ""
    k = int(finite[-1])
    i = int(np.argmax(np.abs(reached.states[:, k])))
    if not abs(reached.states[i, k]) > _LARGE:
        return ""
    name = state_names(compiled.system)[i]
    return f"; state '{name}' is {reached.states[i, k]:.3g} at t = {reached.time[k]:.6g} s"


def _response(
    resolved: Resolved,
    reached: Trajectory,
    shown: np.ndarray | slice,
    more: tuple[Mapping[str, Any] | None, Mapping[str, Any], str | None],
) -> Response:
    system, (params, form, message) = resolved.system, more
    inputs = reached.inputs[: system.ninputs or 0]
    signals = (reached.time, reached.outputs, reached.states, inputs)
    response = response_of(
        system, [x[..., shown] for x in signals], params, form, resolved.labels,
        success=message is None, message=message,
    )  # fmt: skip
    response.statistics, response.happened = reached.statistics, reached.happened
    response.jump_times = reached.jump_times
    return response
