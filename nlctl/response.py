"""Simulating a diagram in python-control at a tolerance that suits adaptive loops."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from . import _diagram
from ._errors import DivergedError, ParameterError
from ._names import unknown
from ._param import checked_times

if TYPE_CHECKING:
    from .native import Compiled

__all__ = ["EngineWarning", "input_output_response"]

ENGINES = ("python-control", "native", "auto")
NATIVE_ONLY = ("max_steps", "step", "audit")  # settings that python-control does not know

STANDSTILL = 200  # steps in a row that do not advance the time


class EngineWarning(UserWarning):
    """A diagram could not be compiled, and python-control runs it: the message says why."""


def input_output_response(
    system: ct.NonlinearIOSystem | Compiled,
    timepts: Any,
    inputs: Any = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    params: Mapping[str, Any] | None = None,
    engine: str | None = None,
    method: str | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    progress: Callable[[float], object] | None = None,
    **kwargs: Any,
) -> ct.TimeResponseData:
    """Simulate a block or diagram, in python-control or as machine code.

    A diagram is integrated by `control.input_output_response`, a compiled one by nlctl's own
    integrator, with the same arguments.  What is added to python-control: blocks start from
    their own initial states, tolerances are tighter, a run that leaves the finite numbers ends
    with the time at which it did, and progress can be watched.

    Parameters
    ----------
    system : control.NonlinearIOSystem or Compiled
        A diagram, or what `nlctl.compile` made of it.
    timepts : array_like of shape (m,)
        Times in s at which the response is computed.
    inputs : array_like or float, optional
        Inputs over `timepts`, as in python-control.
    initial_state : mapping or array_like, optional
        ``{"plant.x1": 0.8}`` replaces some of the blocks' initial states; an array gives all.
    params : mapping, optional
        Qualified parameters, ``{"actuator.b_r": 0.6}``.
    engine : {"python-control", "native", "auto"}, optional
        What computes the run of a diagram: python-control, the default; machine code, compiled
        for this run (for many runs compile once, with `nlctl.compile`); or machine code where the
        diagram can be compiled and python-control, with an `EngineWarning` that says why, where
        it cannot.  A `Compiled` always runs as machine code.
    method : str, optional
        Method of `scipy.integrate.solve_ivp` in python-control, "LSODA" by default.  Machine code
        has "tsit5", an explicit Runge-Kutta pair of orders 5(4), "rodas5p", a stiff method of
        orders 5(4), and "auto", the default, which takes whichever is faster at each time.
    rtol, atol : float, optional
        Tolerances of the integrator.
    progress : callable, optional
        Called with the time after every accepted step (machine code: every 2000 steps).
    **kwargs
        Passed to `control.input_output_response`; machine code takes ``max_steps``, ``step`` (a
        fixed step in s, 0 for error control), ``ignore_errors`` and ``audit``: by default the
        first run of a program is compared with python-control's own right-hand side at some
        points, with False none is, with "every run" each.

    Returns
    -------
    control.TimeResponseData
        From machine code with an attribute ``statistics``: status, time reached, steps.

    Raises
    ------
    DivergedError
        If the state becomes infinite or NaN.
    KeyboardInterrupt
        After Ctrl-C; machine code with ``ignore_errors`` returns what it has until then.
    CompileError, AlgebraicLoopError
        If `engine` is "native" and the diagram cannot be compiled.
    AuditError
        If machine code and python-control differ, unless `engine` is "auto".
    UnknownNameError, ParameterError
        If a name or a value is refused, or if `timepts` has fewer than two entries, is not
        increasing or not finite.
    """
    times = checked_times(timepts)
    interpretable = isinstance(system, ct.InputOutputSystem)
    if not _takes_machine_code(engine, interpretable):
        run = _Run(system, times, inputs, initial_state, params, rtol, atol, progress, kwargs)
        return _interpreted(run, method)
    from .native import (  # late: others need no compiler
        AlgebraicLoopError,
        AuditError,
        CompileError,
    )

    run = _Run(system, times, inputs, initial_state, params, rtol, atol, progress, kwargs)
    try:
        return _native(run, method)
    except (CompileError, AlgebraicLoopError, AuditError) as error:
        if engine != "auto" or not interpretable:
            raise
        warnings.warn(f"python-control takes over: {error}", EngineWarning, stacklevel=2)
    run.kwargs = {k: v for k, v in kwargs.items() if k not in NATIVE_ONLY}
    return _interpreted(run, None)


def _takes_machine_code(engine: str | None, interpretable: bool) -> bool:
    if engine is not None and engine not in ENGINES:
        raise unknown("engine", str(engine), ENGINES)
    if not interpretable and engine == "python-control":
        raise ParameterError(
            "engine='python-control' needs a diagram, got a compiled one: give compiled.system"
        )
    return not interpretable or engine in ("native", "auto")


@dataclass
class _Run:
    """The arguments of a run that both engines take."""

    system: Any
    times: np.ndarray
    inputs: Any
    initial_state: Any
    params: Mapping[str, Any] | None
    rtol: float
    atol: float
    progress: Callable[[float], object] | None
    kwargs: dict[str, Any]


def _interpreted(run: _Run, method: str | None) -> ct.TimeResponseData:
    """Run a diagram in python-control."""
    system, times, initial_state, params = run.system, run.times, run.initial_state, run.params
    given_by_name = initial_state is None or isinstance(initial_state, Mapping)
    x0: Any = _diagram.initial_state(system, initial_state) if given_by_name else initial_state
    watch = _Watch(system=system, reached=float(times[0]), progress=run.progress)
    settings = {"rtol": run.rtol, "atol": run.atol, "events": watch}
    settings |= run.kwargs.pop("solve_ivp_kwargs", {})
    with np.errstate(over="ignore", invalid="ignore"):  # reported as divergence, not as warnings
        try:
            response = ct.input_output_response(
                system,
                times,
                run.inputs,
                x0,
                params=dict(params or {}),
                method=method or "LSODA",
                solve_ivp_kwargs=settings,
                **run.kwargs,
            )
        except RuntimeError as error:
            # python-control takes a NaN signal for an algebraic loop: it never equals itself
            if watch.reached > times[0] or _overflows(system, times[0], x0, params):
                raise _diverged(system, watch.reached) from error
            raise
    if not np.all(np.isfinite(response.y)):
        raise _diverged(system, watch.reached)
    return response


def _native(run: _Run, method: str | None) -> ct.TimeResponseData:
    """Run a compiled diagram, or one that is compiled for this run, as machine code."""
    from .native import compile as compile_diagram
    from .native._response import respond

    compiled = run.system
    if isinstance(compiled, ct.InputOutputSystem):
        compiled = compile_diagram(compiled, params=run.params)
    return respond(
        compiled,
        run.times,
        run.inputs,
        run.initial_state,
        params=run.params,
        progress=run.progress,
        method=method or "auto",
        rtol=run.rtol,
        atol=run.atol,
        **run.kwargs,
    )


@dataclass
class _Watch:
    """An event for `solve_ivp` that never happens but sees every accepted step.

    It stops a run whose state is not finite, and one whose time stands still: at a finite escape
    time LSODA repeats a vanishing step for ever.
    """

    system: ct.InputOutputSystem
    reached: float
    progress: Callable[[float], object] | None
    repeated: int = 0

    def __call__(self, t: float, x: np.ndarray) -> float:
        self.repeated = self.repeated + 1 if t <= self.reached else 0
        if self.repeated > STANDSTILL or not np.all(np.isfinite(x)):
            raise _diverged(self.system, self.reached)
        self.reached = max(float(t), self.reached)
        if self.progress is not None:
            self.progress(float(t))
        return 1.0


def _overflows(system: ct.NonlinearIOSystem, t: float, x0: Any, params: Any) -> bool:
    """Whether the right-hand side leaves the finite numbers at the start already."""
    try:
        with np.errstate(over="raise", invalid="raise"):
            system.dynamics(t, x0, np.zeros(system.ninputs or 0), params)
    except FloatingPointError:
        return True
    except RuntimeError:
        return False
    return False


def _diverged(system: ct.InputOutputSystem, time: float) -> DivergedError:
    return DivergedError(
        f"'{system.name}' diverged: no finite state after t = {time:.6g} s; "
        "simulate up to then to see how",
        float(time),
    )
