"""Responses of compiled diagrams."""

from __future__ import annotations

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
from .driver import trajectory
from .integrate.state import Status
from .own_errors import own_error
from .results import Trajectory
from .settings import Settings

_LARGE = 1e6  # a state that a message names, in its unit


def respond(
    compiled: Compiled,
    times: np.ndarray,
    inputs: Any = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    settings: Settings,
    params: Mapping[str, Any] | None = None,
    evaluation_times: Any = "T",
    ignore_errors: bool = False,
    progress: Callable[[float], object] | None = None,
    audit: Audit = True,
    watched: tuple[Watched, ...] = (),
    **form: Any,
) -> Response:
    """Integrate a compiled diagram; see `nlctl.input_output_response` for the arguments."""
    system = compiled.system
    compiled = with_watched(compiled, (*watched, *nan_watchers(watched)), params)
    wanted = evaluation_array(evaluation_times, times)
    u, x0 = input_array(system, inputs, times), state_array(system, initial_state)
    grid = times if wanted is times else _grid(system, times, wanted)
    if grid is not times:
        u = interpolated(u, times, grid)
    p = compiled.parameter_vector(params)
    check_numbers(watched, (float(grid[0]), x0, u[:, 0]), params)
    made = trajectory(compiled, grid, u, x0, p, settings, progress)
    trial = Trial(
        time=made.time, states=made.states, inputs=made.inputs, p=p, params=params, width=1
    )
    compare(compiled, trial, audit)
    run = made.statistics
    if run.status is Status.STOPPED and not ignore_errors:
        # whoever takes it for an error continues
        raise KeyboardInterrupt(_message(compiled, made, p, params))
    ended = run.status is Status.ENDED
    failed = failure(compiled, made, p, params)
    if failed is not None and not ignore_errors:
        raised = own_error(compiled, made, params) if run.status is Status.DIVERGED else None
        raise raised or failed
    shown: Any = slice(None)
    if grid is not wanted:
        shown = np.isin(made.time, wanted)
        shown[-1:] |= ended
    message = None if failed is None else str(failed)
    return _response(compiled, made, shown, (params, form, message))


def failure(
    compiled: Compiled, made: Trajectory, p: np.ndarray, params: Mapping[str, Any] | None
) -> DivergedError | None:
    """Return why a run has not reached its last time, if it has not."""
    run, guards = made.statistics, compiled.program.guards
    if run.status is Status.ENDED:
        return not_a_number(made.happened)
    if run.status is Status.OK:
        return None
    if made.culprit >= 0 and run.status in (Status.ZENO, Status.DIVERGED):
        block = compiled.schedule.nodes[guards[made.culprit]].path
        if run.status is Status.ZENO:
            return ZenoError.of(block, limit_of(_falls(compiled, made), made.since))
        if not np.isfinite(made.guard):
            why = f"block '{block}' has a guard that is NaN at t = {run.time:.6g} s"
            return DivergedError(why, run.time)
    kind = ChatteringError if run.status is Status.CHATTERING else DivergedError
    return kind(_message(compiled, made, p, params), run.time)


def _falls(compiled: Compiled, made: Trajectory) -> list[float]:
    """Return when the guard has fallen that has ended a run."""
    guards = compiled.program.guards
    own = [k for k, block in enumerate(guards) if block == guards[made.culprit]]
    path = compiled.schedule.nodes[guards[made.culprit]].path
    name = "guard" if len(own) == 1 else f"guard {own.index(made.culprit) + 1}"
    return made.happened.times(path, name).tolist()


def _grid(system: ct.InputOutputSystem, times: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the times of a run with inputs at `times` that is `wanted` at other times."""
    # A sampled system starts with the first of these; in between inputs are linear, and have their
    # break points where they were given.
    if system.isdtime(strict=True):
        return wanted
    return np.union1d(times if system.ninputs else times[[0, -1]], wanted)


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
    compiled: Compiled, made: Trajectory, p: np.ndarray, params: Mapping[str, Any] | None
) -> str:
    run = made.statistics
    what = {
        Status.DIVERGED: "diverged: no finite state after",
        Status.STEP_LIMIT: "stopped at the limit of steps at",
        Status.STOPPED: "was stopped at",
        Status.CHATTERING: "is chattering at",
        Status.ZENO: "jumps without end before",
        Status.STEP_TOO_SMALL: "diverged or jumps: no step is small enough after",
    }
    told = f"'{compiled.system.name}' {what[run.status]} t = {run.time:.6g} s"
    if run.status in (Status.DIVERGED, Status.STEP_TOO_SMALL):
        return told + _grown(compiled, made)
    if run.jump is None:
        return told
    return f"{told}: {chattering_words(compiled, p, params, run.jump)}"


def _grown(compiled: Compiled, made: Trajectory) -> str:
    """Say which state was large at the last time at which all of them were finite."""
    finite = np.flatnonzero(np.isfinite(made.states).all(axis=0))
    if not finite.size or not made.states.size:
        return ""
    k = int(finite[-1])
    i = int(np.argmax(np.abs(made.states[:, k])))
    if not abs(made.states[i, k]) > _LARGE:
        return ""
    name = state_names(compiled.system)[i]
    return f"; state '{name}' is {made.states[i, k]:.3g} at t = {made.time[k]:.6g} s"


def _response(
    compiled: Compiled,
    made: Trajectory,
    shown: np.ndarray | slice,
    told: tuple[Mapping[str, Any] | None, Mapping[str, Any], str | None],
) -> Response:
    system, run, (params, form, message) = compiled.system, made.statistics, told
    inputs = made.inputs[: system.ninputs or 0]
    signals = (made.time, made.outputs, made.states, inputs)
    response = response_of(
        system, [x[..., shown].copy() for x in signals], params, form,
        success=message is None, message=message,
    )  # fmt: skip
    response.statistics = run
    response.happened = made.happened
    return response
