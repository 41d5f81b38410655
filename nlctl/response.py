"""Simulating a diagram in python-control at a tolerance that suits adaptive loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from . import _diagram
from ._errors import DivergedError
from ._param import checked_times

if TYPE_CHECKING:
    from .native import Compiled

__all__ = ["input_output_response"]

STANDSTILL = 200  # steps in a row that do not advance the time


def input_output_response(
    system: ct.NonlinearIOSystem | Compiled,
    timepts: Any,
    inputs: Any = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    params: Mapping[str, Any] | None = None,
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
        fixed step in s, 0 for error control) and ``ignore_errors``.

    Returns
    -------
    control.TimeResponseData
        From machine code with an attribute ``statistics``: status, time reached, steps.

    Raises
    ------
    DivergedError
        If the state becomes infinite or NaN.
    UnknownNameError, ParameterError
        If a name or a value is refused, or if `timepts` has fewer than two entries, is not
        increasing or not finite.
    """
    times = checked_times(timepts)
    if not isinstance(system, ct.InputOutputSystem):
        settings = {"params": params, "rtol": rtol, "atol": atol, **kwargs}
        return _native(system, times, inputs, initial_state, settings, method, progress)
    given_by_name = initial_state is None or isinstance(initial_state, Mapping)
    x0: Any = _diagram.initial_state(system, initial_state) if given_by_name else initial_state
    watch = _Watch(system=system, reached=float(times[0]), progress=progress)
    settings = {"rtol": rtol, "atol": atol, "events": watch}
    with np.errstate(over="ignore", invalid="ignore"):  # reported as divergence, not as warnings
        try:
            response = ct.input_output_response(
                system,
                times,
                inputs,
                x0,
                params=dict(params or {}),
                method=method or "LSODA",
                solve_ivp_kwargs=settings | kwargs.pop("solve_ivp_kwargs", {}),
                **kwargs,
            )
        except RuntimeError as error:
            # python-control takes a NaN signal for an algebraic loop: it never equals itself
            if watch.reached > times[0] or _overflows(system, times[0], x0, params):
                raise _diverged(system, watch.reached) from error
            raise
    if not np.all(np.isfinite(response.y)):
        raise _diverged(system, watch.reached)
    return response


def _native(
    compiled: Compiled,
    times: np.ndarray,
    inputs: Any,
    initial_state: Any,
    settings: dict[str, Any],
    method: str | None,
    progress: Callable[[float], object] | None,
) -> ct.TimeResponseData:
    from .native._response import respond  # late: python-control's users need no compiler

    settings["method"] = method or "auto"
    return respond(compiled, times, inputs, initial_state, progress=progress, **settings)


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
