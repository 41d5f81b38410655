"""A run in python-control, which ends where the state leaves the finite numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import control as ct
import numpy as np
from scipy.integrate import OdeSolver

from ..blocks import SLIDES
from ..delays.lines import delayed_blocks
from ..diagrams import apart, leaves, override
from ..errors import DivergedError, ParameterError, UsageError
from ..names import unknown
from ..sampling.system import Sampled, happening
from ..sliding.blocks import sliding_blocks
from .arguments import RunArguments, evaluation_array, input_array, state_array
from .delayed import Past, break_points, by_steps, with_delays
from .relaxation import check_relaxation
from .sampled import from_sample_to_sample
from .time_response import as_response

SOLVE_IVP_METHODS = (
    "LSODA",
    "RK23",
    "RK45",
    "DOP853",
    "Radau",
    "BDF",
)  # of scipy.integrate.solve_ivp
_STANDSTILL = 200  # steps in a row that do not advance the time
_ROUNDING = 1e-14  # of a time


def python_control_response(run: RunArguments) -> ct.TimeResponseData:
    """Run a diagram in python-control.

    Raises
    ------
    DivergedError
        If the state becomes infinite or NaN.
    ParameterError
        If inputs, initial state or times are refused.
    UsageError
        If a block is an ideal relay, or has a memory that it would not move.
    """
    system, times, solver = apart(run.system).system, run.times, run.solver
    params = override(system, run.params)
    _refuse(system)
    # a function that declares no numbers of inputs or states gets what it is given
    inputs = run.inputs if system.ninputs is None else input_array(system, run.inputs, times)
    whole = system.nstates is None and run.initial_state is not None
    x0: Any = run.initial_state if whole else state_array(system, run.initial_state)
    wanted = run.evaluation_times  # None: the integrator's own steps
    if wanted is not None:
        wanted = evaluation_array(wanted, times)
        if wanted.size == 1 and system.isdtime(strict=True):
            raise ParameterError("evaluation_times of a sampled system needs two times, got one")
    simulate = _between(_integrated, system)
    watch = _Watch(system=system, reached=float(times[0]), progress=run.progress)
    method = solver["method"] or solver["solve_ivp_method"] or "LSODA"
    scipys = isinstance(method, type) and issubclass(method, OdeSolver)
    if not scipys and method not in SOLVE_IVP_METHODS:
        raise unknown("method", str(method), SOLVE_IVP_METHODS, "of python-control's solve_ivp")
    settings = {"rtol": solver["rtol"], "atol": solver["atol"], "events": watch}
    settings["max_step"] = np.inf if system.ninputs is None else _longest_step(times, inputs)
    with np.errstate(over="ignore", invalid="ignore"):  # reported as divergence, not as warnings
        try:
            response = simulate(
                system,
                times,
                inputs,
                x0,
                params=dict(params or {}),
                ignore_errors=run.ignore_errors,
                evaluation_times=wanted,
                solve_ivp_method=method,
                solve_ivp_kwargs=settings | solver["solve_ivp_kwargs"],
                **run.form,
            )
        except RuntimeError as error:
            # python-control takes a NaN signal for an algebraic loop: it never equals itself
            if watch.reached > times[0] or _overflows(system, times[0], x0, params):
                raise _diverged(system, watch.reached) from error
            raise
    if not np.all(np.isfinite(response.y)):
        raise _diverged(system, watch.reached)
    return as_response(response)


def _integrated(system: Any, times: np.ndarray, *given: Any, **settings: Any) -> Any:
    """Run `control.input_output_response`, also between instants that only rounding sets apart.

    LSODA refuses so short an interval; any step of an explicit method is exact there.
    """
    if times[-1] - times[0] <= _ROUNDING * max(abs(times[0]), abs(times[-1])):
        settings["solve_ivp_method"] = "RK23"
    return ct.input_output_response(system, times, *given, **settings)


def _longest_step(times: np.ndarray, inputs: Any) -> float:
    """Return the shortest time between break points of the inputs, inf where there are none.

    A longer step from rest sees nothing of a pulse that it goes over.
    """
    known = np.asarray(break_points(times, inputs))
    ends = np.concatenate((times[:1], known, times[-1:]))
    return float(np.diff(ends).min()) if known.size else np.inf


def _refuse(system: Any) -> None:
    """Refuse blocks that python-control would run wrongly."""
    for made in sliding_blocks(system):
        raise UsageError(f"block '{made.name}' {SLIDES}")
    check_relaxation(system)


def _between(simulate: Any, system: Any) -> Any:
    """Return what simulates between samples, and by steps where signals are delayed."""
    is_sampled = any(isinstance(leaf.system, Sampled) for leaf in leaves(system))
    if not delayed_blocks(system):
        return partial(from_sample_to_sample, simulate) if is_sampled else simulate

    def with_known(known: Past, *given: Any, **settings: Any) -> Any:
        steps = partial(by_steps, simulate, known)
        return (partial(from_sample_to_sample, steps) if is_sampled else steps)(*given, **settings)

    return partial(with_delays, with_known)


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
        self.repeated = self.repeated + 1 if t == self.reached else 0  # before it: tried again
        if self.repeated > _STANDSTILL or not np.all(np.isfinite(x)):
            raise _diverged(self.system, self.reached)
        self.reached = float(t)
        if self.progress is not None:
            self.progress(float(t))
        return 1.0


def _overflows(system: ct.NonlinearIOSystem, t: float, x0: Any, params: Any) -> bool:
    """Whether the right-hand side leaves the finite numbers at the start already."""
    try:
        with np.errstate(over="raise", invalid="raise"), happening():
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
