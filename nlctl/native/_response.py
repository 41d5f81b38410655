"""Responses of compiled diagrams."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import control as ct
import numpy as np

from .._diagram import initial_state as state_of
from .._errors import DivergedError, ParameterError
from ._compile import Compiled
from ._lane import Status
from ._simulate import Settings, Statistics, Trajectory, trajectory
from .audit import Audit, Trial
from .audit import audit as compare


class Response(ct.TimeResponseData):
    """A `control.TimeResponseData` that also keeps how the run went, in `statistics`."""

    statistics: Statistics


def respond(
    compiled: Compiled,
    times: np.ndarray,
    inputs: Any = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    params: Mapping[str, Any] | None = None,
    ignore_errors: bool = False,
    progress: Callable[[float], object] | None = None,
    audit: Audit = True,
    **settings: Any,
) -> Response:
    """Integrate a compiled diagram; see `nlctl.input_output_response` for the arguments.

    Raises
    ------
    DivergedError
        If the run does not reach the last time, unless `ignore_errors`: then the response ends
        where the run did, with ``success = False``.
    KeyboardInterrupt
        After Ctrl-C, unless `ignore_errors`.
    ParameterError
        If an argument has a wrong shape, or times do not fit a discrete-time diagram.
    """
    system = compiled.system
    u, x0 = input_array(inputs, system.ninputs or 0, times), state_array(system, initial_state)
    p = compiled.parameter_vector(params)
    made = trajectory(compiled, times, u, x0, p, Settings(**settings), progress)
    trial = Trial(time=made.time, states=made.states, inputs=u, p=p, params=params, width=1)
    compare(compiled, trial, audit)
    run = made.statistics
    if run.status is Status.STOPPED and not ignore_errors:
        raise KeyboardInterrupt(_message(system, run))  # whoever takes it for an error goes on
    if run.status is not Status.OK and not ignore_errors:
        raise DivergedError(_message(system, run), run.time)
    return _response(compiled, made, u[:, : made.time.size], params)


def uninterrupted(response: Any) -> Any:
    """Return a response that was computed with `ignore_errors`, if Ctrl-C has not ended it.

    Raises
    ------
    KeyboardInterrupt
    """
    if response.statistics.status is Status.STOPPED:
        raise KeyboardInterrupt(response.message)
    return response


def _message(system: ct.InputOutputSystem, run: Statistics) -> str:
    what = {
        Status.DIVERGED: "diverged: no finite state after",
        Status.STEP_LIMIT: "stopped at the limit of steps at",
        Status.STOPPED: "was stopped at",
        Status.STEP_TOO_SMALL: "diverged or jumps: no step is small enough after",
    }
    return f"'{system.name}' {what[run.status]} t = {run.time:.6g} s"


def _response(
    compiled: Compiled, made: Trajectory, inputs: np.ndarray, params: Mapping[str, Any] | None
) -> Response:
    system, run = compiled.system, made.statistics
    ok = run.status is Status.OK
    response = Response(
        made.time,
        made.outputs,
        made.states,
        inputs,
        issiso=system.issiso(),
        params=dict(system.params) | dict(params or {}),
        output_labels=system.output_labels,
        input_labels=system.input_labels,
        state_labels=system.state_labels,
        title=f"Input/output response for {system.name}",
        sysname=system.name,
        success=ok,
        message=None if ok else _message(system, run),
    )
    response.statistics = run
    return response


def input_array(inputs: Any, count: int, times: np.ndarray) -> np.ndarray:
    """Return the inputs as an array of shape (count, m), as python-control reads them.

    Raises
    ------
    ParameterError
        If the shape fits neither one input over time nor all of them.
    """
    shape = (count, times.size)
    if isinstance(inputs, list | tuple) and len(inputs) == count and count > 1:
        try:
            rows = [np.broadcast_to(np.asarray(u, dtype=float), times.shape) for u in inputs]
        except ValueError:
            raise ParameterError(f"inputs need shape {shape}, or one entry per input") from None
        return np.ascontiguousarray(rows)
    array = np.asarray(inputs, dtype=float)
    if array.ndim == 0:
        return np.full(shape, float(array))
    if array.ndim == 1 and count == 1:
        array = array[None, :]
    if array.shape != shape:
        raise ParameterError(f"inputs need shape {shape} for these times, got {array.shape}")
    return np.ascontiguousarray(array)


def state_array(system: ct.InputOutputSystem, initial_state: Any) -> np.ndarray:
    """Return the initial state as an array: by name, as a whole, or one number for all.

    Raises
    ------
    ParameterError
        If an array has the wrong length.
    """
    if initial_state is None or isinstance(initial_state, Mapping):
        return state_of(system, initial_state)
    array = np.asarray(initial_state, dtype=float).reshape(-1)
    if array.size == 1:
        return np.full(system.nstates or 0, array[0])
    if array.size != system.nstates:
        raise ParameterError(
            f"initial_state needs {system.nstates} values for '{system.name}', got {array.size}"
        )
    return array.copy()
