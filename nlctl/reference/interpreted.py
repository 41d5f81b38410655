"""A run in python-control's equations: what it is asked, and what it returns."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import control as ct
import numpy as np
from scipy import integrate

from ..delays.transport import PAST
from ..diagrams import apart, override, supplied_blocks
from ..errors import DivergedError, ParameterError, UsageError
from ..names import unknown
from ..responses.arguments import (
    RunArguments,
    evaluation_array,
    input_array,
    interpolated,
    state_array,
)
from ..responses.event_log import event_log
from ..responses.time_response import Response, as_response, labels_of, response_of
from ..sampling.system import happening
from ..sliding.relay import SLIDING
from ..upstream.control_internals import rates_now
from ..upstream.systems import System
from .driver import Driver, diverged
from .jumps import Jumps
from .known import Known
from .past import Past
from .stops import Stops

# of scipy.integrate.solve_ivp
SOLVE_IVP_METHODS = ("LSODA", "RK23", "RK45", "DOP853", "Radau", "BDF")
_KEYWORDS = ("rtol", "atol", "max_step", "min_step", "first_step")  # and those of its Jacobian
_JACOBIAN = ("jac", "jac_sparsity", "lband", "uband")


def python_control_response(
    run: RunArguments, known: Callable[..., Known] | None = None
) -> Response:
    """Run a diagram in python-control's equations.

    In discrete time, and where functions do not declare their sizes, by
    `control.input_output_response`; otherwise by the `Driver`.
    """
    system, times = apart(run.system).system, run.times
    params = override(system, run.params)
    run = replace(run, system=system, params=params)  # from here on this run's own copy
    for relay in supplied_blocks(system, SLIDING):
        raise UsageError(f"block '{relay.name}' {SLIDING.why}")
    # a function that declares no numbers of inputs or states gets what it is given
    inputs = run.inputs if system.ninputs is None else input_array(system, run.inputs, times)
    whole = system.nstates is None and run.initial_state is not None
    x0: Any = run.initial_state if whole else state_array(system, run.initial_state)
    evaluation = run.evaluation_times  # None: the integrator's own steps
    if evaluation is not None:
        evaluation = evaluation_array(evaluation, times)
        if evaluation.size == 1 and system.isdtime(strict=True):
            raise ParameterError("evaluation_times of a sampled system needs two times, got one")
    method, settings = _integrator(run)
    sizes = (system.ninputs, system.noutputs, system.nstates)
    with np.errstate(over="ignore", invalid="ignore"):  # reported as divergence, not as warnings
        if system.isdtime(strict=True) or None in sizes:
            if run.watched:
                raise ParameterError(
                    f"'{system.name}' is in discrete time, or does not say how many signals it "
                    "has: stop_when and events are for others"
                )
            return _by_python_control(run, inputs, x0, evaluation, (method, settings))
        return _driven(run, (inputs, x0, evaluation), (method, settings), known)


def _integrator(run: RunArguments) -> tuple[Any, dict[str, Any]]:
    """Return the class of the integrator and its arguments."""
    solver, keywords = run.solver, run.solver["solve_ivp_kwargs"]
    method = solver["method"] or solver["solve_ivp_method"] or "LSODA"
    if not (isinstance(method, type) and issubclass(method, integrate.OdeSolver)):
        if method not in SOLVE_IVP_METHODS:
            raise unknown("method", str(method), SOLVE_IVP_METHODS, "of python-control's solve_ivp")
        method = getattr(integrate, method)
    for name in keywords:
        if name in ("events", "dense_output", "vectorized", "args"):
            raise ParameterError(
                f"solve_ivp_kwargs with '{name}' has no meaning in nlctl.input_output_response: "
                "a response has values at its times only"
            )
        if name not in (*_KEYWORDS, *_JACOBIAN):
            raise unknown("keyword", name, [*_KEYWORDS, *_JACOBIAN], "in solve_ivp_kwargs")
    if solver["max_step"] is not None and "max_step" in keywords:
        raise ParameterError("'max_step' is given twice, also in solve_ivp_kwargs")
    longest = np.inf if solver["max_step"] is None else solver["max_step"]
    return method, {"rtol": solver["rtol"], "atol": solver["atol"], "max_step": longest, **keywords}


def _driven(run: RunArguments, given: Any, how: Any, known: Any) -> Response:
    """Run a diagram in continuous time."""
    system, times, (inputs, x0, wanted), (method, settings) = run.system, run.times, given, how
    begin, end, at = float(times[0]), float(times[-1]), _linear(times, inputs)
    conditions = Known() if known is None else known(system, run.params, times, run.watched)
    past = Past(supplied_blocks(system, PAST), begin, end, (settings["rtol"], settings["atol"]))
    jumps = Jumps(system, at, conditions, (run.watched, dict(run.params or {})), past.leaving)
    grid = times if wanted is None else np.union1d(times, wanted)
    driver = Driver(
        system, at, wanted, jumps=jumps, method=method, settings=settings, progress=run.progress,
        stops=Stops(grid, times, inputs, jumps.sampled.values(), conditions), known=past,
    )  # fmt: skip
    message = None
    try:
        driver.run(begin, end, np.array(x0, dtype=float))
        if not all(np.all(np.isfinite(y)) for _, y, _ in driver.rows):
            raise diverged(system, driver.reached)
    except DivergedError as error:
        message = str(error)
        if not run.ignore_errors:
            raise
    except RuntimeError as error:
        # python-control takes a NaN signal for an algebraic loop: it never equals itself
        if _is_loop(error, driver, begin, x0):
            raise
        failed = diverged(system, driver.reached)
        message = str(failed)
        if not run.ignore_errors:
            raise failed from error
    reached = np.array([t for t, _, _ in driver.rows])
    signals = [np.array([row[k] for row in driver.rows]).T for k in (1, 2)]
    y, x = (
        part.reshape(size or 0, reached.size)
        for part, size in zip(signals, (system.noutputs, system.nstates), strict=True)
    )
    response = response_of(
        system, (reached, y, x, interpolated(inputs, times, reached)), run.params, run.form,
        labels_of(system), success=message is None, message=message,
    )  # fmt: skip
    response.happened = event_log(driver.happened)
    ticks = [t for t in driver.stops.due if t <= driver.reached]
    response.jump_times = np.array([*ticks, *past.left])
    return response


def _is_loop(error: RuntimeError, driver: Driver, begin: float, x0: np.ndarray) -> bool:
    """Whether an algebraic loop ended a run, and not numbers that are not finite."""
    t, x = driver.tried or (begin, x0)
    is_loop = "loop" in str(error) or driver.reached == begin
    return is_loop and not _overflows(driver.system, t, x, driver.inputs(t))


def _linear(times: np.ndarray, inputs: np.ndarray) -> Callable[[float], np.ndarray]:
    """Return inputs that are linear between their times, as python-control has them."""
    nothing = np.zeros(0)

    def at(t: float) -> np.ndarray:
        if not inputs.shape[0]:
            return nothing
        i = min(max(int(np.searchsorted(times, t)), 1), times.size - 1)
        part = (t - times[i - 1]) / (times[i] - times[i - 1])
        return inputs[:, i - 1] * (1.0 - part) + inputs[:, i] * part

    return at


def _by_python_control(run: RunArguments, inputs: Any, x0: Any, wanted: Any, how: Any) -> Response:
    """Run by `control.input_output_response`."""
    system, (method, settings) = run.system, how
    try:
        found = ct.input_output_response(
            system, run.times, inputs, x0, params=dict(run.params or {}),
            ignore_errors=run.ignore_errors, evaluation_times=wanted,
            solve_ivp_method=method, solve_ivp_kwargs=settings, **run.form,
        )  # fmt: skip
    except RuntimeError as error:
        if _overflows(system, float(run.times[0]), x0, np.zeros(system.ninputs or 0)):
            raise diverged(system, float(run.times[0])) from error
        raise
    if not np.all(np.isfinite(found.y)):
        raise diverged(system, float(run.times[0]))
    return as_response(found, run.system)


def _overflows(system: System, t: float, x: Any, u: np.ndarray) -> bool:
    """Whether the right-hand side leaves the finite numbers."""
    if not np.all(np.isfinite(x)):
        return True
    try:
        with np.errstate(over="raise", invalid="raise"), happening():
            rates_now(system, t, np.asarray(x, dtype=float), u)
    except FloatingPointError:
        return True
    except RuntimeError:
        return False
    return False
