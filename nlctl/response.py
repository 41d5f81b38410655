"""Simulating a diagram in either engine, at a tolerance that suits adaptive loops."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from .annotations import as_annotated
from .arguments import ATOL, RTOL, number, one_of, tolerances
from .blocks import sampling_of
from .diagrams import leaves, supplied_blocks
from .errors import AlgebraicLoopError, AuditError, CompileError, EngineWarning, ParameterError
from .names import unknown
from .params import checked_times
from .reference.interpreted import SOLVE_IVP_METHODS, python_control_response
from .responses import arguments
from .responses.time_response import Response
from .responses.watched import Watched, WatchedEvents, check_moves, watched_functions
from .sliding.relay import SLIDING
from .upstream.control_internals import StandIn, is_system
from .upstream.systems import System

if TYPE_CHECKING:
    from .native import Compiled, Tableau
    from .reference.known import Known

__all__ = ["input_output_response"]

ENGINES = ("python-control", "native", "auto")
NATIVE_ONLY = ("max_steps", "step")  # settings that python-control does not know


@as_annotated
def input_output_response(
    system: ct.NonlinearIOSystem | Compiled,
    timepts: ArrayLike | None = None,
    inputs: object = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    params: Mapping[str, Any] | None = None,
    engine: str | None = "auto",
    method: str | Tableau | None = None,
    rtol: float = RTOL,
    atol: float = ATOL,
    evaluation_times: object = "T",
    hold: str = "foh",
    squeeze: bool | None = None,
    transpose: bool = False,
    return_states: bool = False,
    ignore_errors: bool = False,
    audit: object = True,
    solve_ivp_method: str | None = None,
    solve_ivp_kwargs: Mapping[str, Any] | None = None,
    max_steps: int | None = None,
    max_step: float | None = None,
    step: float | None = None,
    slide: bool = True,
    stop_when: Callable[..., Any] | None = None,
    events: WatchedEvents | None = None,
    progress: Callable[[float], object] | None = None,
    **aliases: object,
) -> Response:
    """Simulate a block or diagram, as machine code or in python-control.

    A diagram that can be compiled is integrated by nlctl's own integrator, any other by
    `control.input_output_response`, with the same arguments.  What is added to python-control:
    blocks start from their own initial states, tolerances are tighter, a run that leaves the
    finite numbers ends with the time at which it did, and progress can be watched.

    Parameters
    ----------
    system : control.NonlinearIOSystem or Compiled
        A diagram, or what `nlctl.compile` made of it.
    timepts : array_like of shape (m,), optional
        Times in s at which the inputs are given and the response is computed; they are needed,
        under this name or as ``T``.
    inputs : array_like, list or float, optional
        Inputs over `timepts`, linear in between: a number for all; an array of shape (ninputs, m),
        or (m,) for one input; or a list, whose entries follow each other: a number is one input,
        an array of shape (m,) one input over time, one of another length as many constant
        inputs, one of shape (k, m) k inputs.  Also ``U``.
    initial_state : mapping, array_like or float, optional
        ``{"plant.x1": 0.8}`` replaces some of the blocks' initial states.  A number holds for all
        states; an array, or a list of numbers and arrays behind each other, gives the first ones,
        and the others start at 0.  Also ``X0``.
    params : mapping, optional
        Qualified parameters, ``{"actuator.b_r": 0.6}``.
    engine : {"auto", "native", "python-control"}, optional
        What computes the run of a diagram.  By default machine code, compiled for this run (for
        many runs compile once, with `nlctl.compile`), where the diagram can be compiled; where
        it cannot, python-control with an `EngineWarning` that says why.  With "native" that is
        an error, and "python-control" is the reference.  What only python-control knows (a
        method of SciPy, keywords of its integrator, the integrator's own times) it computes.  A
        `Compiled` always runs as machine code.
    method : str or Tableau, optional
        Method of `scipy.integrate.solve_ivp` in python-control, "LSODA" by default.  Machine code
        has "tsit5", an explicit Runge-Kutta pair of orders 5(4), "rodas5p", a stiff method of
        orders 5(4), "taylor", Taylor's method for equations that can be written as expressions,
        without delays and ideal relays, "auto", the default, which takes whichever of these gets
        further with the same work, and an explicit pair of your own as a `nlctl.native.Tableau`.
    rtol, atol : float, optional
        Tolerances of the integrator.
    evaluation_times : array_like of shape (k,), optional
        Times in s at which the response is wanted, if not at `timepts`; they lie within these.
        A sampled diagram starts with the first of them.  With None python-control takes the
        integrator's own steps, which machine code does not keep.  Also ``t_eval``.
    hold : {"foh", "zoh"}, optional
        What inputs are between `timepts`, by the names that `control.sample_system` has for it:
        linear, or constant, with a step at each time to the value that is given there.
    squeeze, transpose, return_states : bool, optional
        Form of the response, as in python-control: whether outputs lose axes of length 1, whether
        time is the first axis, and whether the response unpacks as time, outputs, states.  Also
        ``return_x``.
    ignore_errors : bool, optional
        Return what was computed until then, with ``success = False``, instead of raising.
    audit : bool or "every run", optional
        Machine code: by default the first run of a program is compared with python-control's own
        right-hand side and outputs at some points of the run; with False none is, with
        "every run" each.
    solve_ivp_method : str, optional
        Another name of `method` in python-control; machine code has none of these methods.
    solve_ivp_kwargs : mapping, optional
        Keywords of `scipy.integrate.solve_ivp`.  Machine code takes ``rtol`` and ``atol``.
    max_steps : int, optional
        Machine code: attempted steps after which a run is given up.
    max_step : float, optional
        Longest step of the integrator (s).
    step : float, optional
        Machine code: a fixed step in s; 0 for error control.
    slide : bool, optional
        Machine code: whether a run that comes back to a condition of the equations from both sides
        goes along it, as Filippov's solution does, with the convex combination of both sides'
        rates and outputs that keeps it there.  ``statistics.slides`` says where one has.  With
        False such a run ends with a ChatteringError.
    stop_when : callable, optional
        ``stop_when(t, x, u, params)``, a number: of the time, all states, the diagram's inputs
        and the overrides of the run.  Where it changes its sign the run ends; that instant is the
        last of the response, behind the times that were reached before it.
    events : callable, sequence of callables or mapping, optional
        Further such functions, by name in a mapping: when they change their signs is in
        ``response.events``.  ``direction`` and ``terminal`` of a function are as in
        `scipy.integrate.solve_ivp`.
    progress : callable, optional
        Called with the time after every accepted step (machine code: every 2000 steps).
    **aliases : object
        python-control's short names: ``T``, ``U``, ``X0``, ``t_eval``, ``return_x``.

    Returns
    -------
    control.TimeResponseData
        Outputs have shape (noutputs, k), or (k,) for one input and one output, states
        (nstates, k).  ``response.events`` is a table of what has happened: time, block, which,
        direction.  From machine code with an attribute ``statistics``: status, time reached,
        steps.

    Raises
    ------
    DivergedError
        If the state becomes infinite or NaN, or an event function NaN.
    ChatteringError
        If a run switches over and over again at a jump along which it cannot slide; the message
        names the block.
    ZenoError
        If jumps follow each other ever faster.
    KeyboardInterrupt
        After Ctrl-C; machine code with ``ignore_errors`` returns what it has until then.
    CompileError, AlgebraicLoopError
        If `engine` is "native" and the diagram cannot be compiled.
    AuditError
        If machine code and python-control differ, unless `engine` is "auto".
    UnknownNameError
        If a state, a parameter, a method or an argument of that name does not exist.
    ParameterError
        If a value is refused: times that are not finite and increasing, inputs or states of a
        wrong shape or not finite, an argument that has no meaning for the engine, an event
        function that does not return one number or is 0 all the time.

    Warns
    -----
    UserWarning
        If `initial_state` has fewer values than there are states and the last one is not 0.

    Examples
    --------
    >>> lag = ct.ss(-1, 1, 1, 0)
    >>> response = input_output_response(lag, [0, 1], 1, engine="python-control")
    >>> round(float(response.outputs[-1]), 6)  # 1 - exp(-1)
    0.632121
    """
    arguments.checked_params(params)
    tolerances("input_output_response", rtol, atol)
    if max_step is not None:
        number("input_output_response", "max_step", max_step, above=0)
    if isinstance(solve_ivp_kwargs, Mapping) and "rtol" in solve_ivp_kwargs:
        tolerances("solve_ivp_kwargs", solve_ivp_kwargs["rtol"], atol)
    if squeeze not in (None, True, False):
        raise ParameterError(f"squeeze needs True, False or None, got {squeeze!r}")
    named = {"timepts": timepts, "inputs": inputs, "initial_state": initial_state}
    named |= {"evaluation_times": evaluation_times, "return_states": return_states}
    named = arguments.with_aliases(named, aliases, input_output_response)
    one_of("input_output_response", "hold", hold, arguments.HOLDS)
    form = {"squeeze": squeeze, "transpose": transpose, "return_states": named["return_states"]}
    run = arguments.RunArguments(
        system=system,
        times=checked_times(named["timepts"]),
        inputs=named["inputs"],
        initial_state=named["initial_state"],
        evaluation_times=named["evaluation_times"],
        params=params,
        progress=progress,
        audit=audit,
        ignore_errors=ignore_errors,
        form=form,
        solver={
            **{"method": method, "rtol": rtol, "atol": atol, "max_steps": max_steps, "step": step},
            "max_step": max_step,
            "slide": slide,
            **{"solve_ivp_method": solve_ivp_method, "solve_ivp_kwargs": solve_ivp_kwargs},
        },
        watched=watched_functions(stop_when, events),
        hold=hold,
    )
    run = _held(_sized(arguments.unified(run)))
    response = _computed(run, "auto" if engine is None else engine)
    if run.watched and response.success is not False:
        check_moves(run.watched, (response.t, response.x, response.u), params)
    return response


def _held(run: arguments.RunArguments) -> arguments.RunArguments:
    """Return a run with the inputs of a zero-order hold as steps, in continuous time."""
    system = run.system.system if isinstance(run.system, StandIn) else run.system
    if run.hold == "foh" or not (is_system(system) and ct.isctime(system)) or system.ninputs == 0:
        return run
    if system.ninputs is None:
        raise ParameterError(
            f"hold='zoh' needs the number of inputs of block '{system.name}': give inputs=... "
            "to ct.nlsys"
        )
    times, inputs = arguments.held(run.times, arguments.input_array(system, run.inputs, run.times))
    evaluation = run.evaluation_times
    evaluation = run.times if isinstance(evaluation, str) and evaluation == "T" else evaluation
    return replace(run, times=times, inputs=inputs, evaluation_times=evaluation)


def _computed(run: arguments.RunArguments, engine: str) -> Response:
    interpretable = is_system(run.system)
    if not _takes_machine_code(run, engine, interpretable):
        for name in NATIVE_ONLY:
            if run.solver[name] is not None:
                raise ParameterError(
                    f"{name}={run.solver[name]!r} has no meaning in python-control: "
                    "engine='native' has it, max_step= bounds the steps of both engines"
                )
        return python_control_response(run, _known)
    from .native import Compiled  # late: needs numba

    if not interpretable and not isinstance(run.system, Compiled):
        raise ParameterError(
            f"system needs a diagram or a compiled one, got {type(run.system).__name__}"
        )
    try:
        return _native(run)
    except (CompileError, AlgebraicLoopError, AuditError) as error:
        is_ring = isinstance(error, AlgebraicLoopError) and _is_sampled(run.system)
        if engine != "auto" or not interpretable or supplied_blocks(run.system, SLIDING) or is_ring:
            raise
        warnings.warn(f"python-control takes over: {error}", EngineWarning, stacklevel=4)
    return python_control_response(replace(run, solver=dict(run.solver) | {"method": None}), _known)


def _sized(run: arguments.RunArguments) -> arguments.RunArguments:
    """Return a run of a block that has the numbers of signals which the run gives it."""
    system = run.system
    if not is_system(system) or None not in (system.nstates, system.ninputs, system.noutputs):
        return run
    from .native.diagram.checks import sized  # late: needs numba

    try:
        system = sized(system, run.times, run.inputs, run.initial_state)
    except CompileError:  # its function remembers: no call of it is for nothing
        return run
    return replace(run, system=system)


def _known(system: System, params: Any, times: np.ndarray, watched: tuple[Watched, ...]) -> Known:
    """Return what is known of the conditions of a diagram that python-control is to run."""
    from .native.known import known_conditions  # late: needs numba

    return known_conditions(system, params, times, watched)


def _is_sampled(system: Any) -> bool:
    """Whether blocks are sampled: of a circle at one instant python-control names no signal."""
    return any(sampling_of(leaf.system) is not None for leaf in leaves(system))


def _takes_machine_code(run: arguments.RunArguments, engine: str, interpretable: bool) -> bool:
    if engine not in ENGINES:
        raise unknown("engine", str(engine), ENGINES)
    if not interpretable and engine == "python-control":
        raise ParameterError(
            "engine='python-control' needs a diagram, got a compiled one: give compiled.system"
        )
    if not interpretable or engine == "native":
        return True
    return engine == "auto" and not _asks_for_scipy(run)


def _asks_for_scipy(run: arguments.RunArguments) -> bool:
    """Whether a run is given what only python-control's integrator knows."""
    method, keywords = run.solver["method"], run.solver["solve_ivp_kwargs"] or {}
    named = run.solver["solve_ivp_method"] is not None or method in SOLVE_IVP_METHODS
    return named or run.evaluation_times is None or bool(set(keywords) - {"rtol", "atol"})


def _native(run: arguments.RunArguments) -> Response:
    """Run a compiled diagram, or one that is compiled for this run, as machine code."""
    from .native import compile as compile_diagram
    from .native.diagram.checks import sized
    from .native.response import respond
    from .native.settings import solver_settings

    settings = solver_settings(**run.solver)
    compiled = run.system
    if is_system(compiled):
        compiled = sized(compiled, run.times, run.inputs, run.initial_state)
        compiled = compile_diagram(compiled, params=run.params)
    return respond(
        compiled,
        run.times,
        run.inputs,
        run.initial_state,
        settings=settings,
        params=run.params,
        evaluation_times=run.evaluation_times,
        ignore_errors=run.ignore_errors,
        progress=run.progress,
        audit=run.audit,
        watched=run.watched,
        **run.form,
    )
