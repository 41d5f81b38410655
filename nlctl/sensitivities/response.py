"""Derivatives of a run: what is asked, how it is run, and what is returned."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from ..annotations import as_annotated
from ..arguments import one_of, tolerances
from ..errors import CompileError, InexactWarning
from ..native import Compiled, Tableau, compile  # noqa: A004 (what it does)
from ..native.audit import Trial, audit
from ..native.diagram.checks import sized
from ..native.driver import Course, begin, prepared, run_once
from ..native.floats import with_floats
from ..native.integrate.state import Status
from ..native.jacobians import inexact
from ..native.response import respond
from ..native.results import Trajectory
from ..native.settings import Settings, solver_settings
from ..native.slid import SlidRun, with_modes
from ..native.spare import give_back
from ..params import checked_times
from ..responses.arguments import (
    HOLDS,
    checked_params,
    held,
    input_array,
    state_array,
    with_aliases,
)
from .alone import run_alone
from .missing import Arrays, commits_at_start, evaluated_rows, missing
from .names import Observed, VariedQuantity, checked_names, observed_signals, varied_quantities
from .program import Differentiated, parameters_with, with_its_derivatives
from .record import SensitivityResponse
from .schedule import Sent

_STEPS_FIRST, _STEPS_MORE = 20_000, 100  # then so many times as the run without derivatives takes
_STEP, _PART = 1e-9, 1e-4  # how long steps of held inputs take: of the run, and of an interval


@dataclass(frozen=True, kw_only=True)
class RunWithDerivatives:
    """What a run with derivatives is asked."""

    # as `nlctl.input_output_response` takes them
    times: np.ndarray
    inputs: Any
    initial_state: Any
    params: Mapping[str, Any] | None
    of: Sequence[str] | None
    with_respect_to: Sequence[str]
    hold: str
    settings: Settings
    audit: Any


def differentiated_run(compiled: Compiled, run: RunWithDerivatives) -> SensitivityResponse:
    """Integrate a diagram with its derivatives."""
    if not ct.isctime(compiled.system):
        raise CompileError(
            f"'{compiled.system.name}' is in discrete time: derivatives of runs are for diagrams "
            "in continuous time; nlctl.sampled has blocks with a clock in these"
        )
    names = checked_names("with_respect_to", run.with_respect_to)
    compiled = with_floats(compiled, names)
    u = input_array(compiled.system, run.inputs, run.times)
    shown = 1  # of how many times each is one that was asked for
    if run.hold == "zoh" and u.size:
        (times, u), shown = _steps(run.times, u), 2
        run = replace(run, times=times, inputs=u)
    p = compiled.parameter_vector(run.params)
    cut = compiled.equations_with(p).cut
    if cut and _alone(compiled, run).statistics.called:  # it takes more passes than are written out
        compiled = compiled.calling(cut)
    signals = observed_signals(compiled, run.of)
    quantities = varied_quantities(compiled, names)
    x0 = state_array(compiled.system, run.initial_state)
    values = [p[q.place] if q.state < 0 else x0[q.state] for q in quantities]
    scale = np.array([abs(v) or 1.0 for v in values])
    named = signals, quantities
    one, slid = _as_far_as_it_goes(compiled, run, named, (u, x0, p, scale))
    differentiated, reached, start, whole = one.differentiated, one.reached, one.start, one.p
    _audit(compiled, reached, p, run)
    if reached.statistics.status not in (Status.OK, Status.ZENO, Status.CHATTERING):
        _alone(compiled, run)
    if shown > 1:
        reached = _shown(shown, reached, differentiated, whole)
    full = tuple(quantity.name for quantity in quantities)
    given = (run.times, start, whole, u)
    lacks = missing(differentiated, (slid.compiled, full), reached, given, one.commits)
    return _response(
        differentiated, (signals, quantities), (run.times[::shown], reached), scale, lacks
    )


@dataclass(frozen=True, kw_only=True)
class _Integrated:
    """A run of a program with derivatives."""

    differentiated: Differentiated
    reached: Trajectory
    start: np.ndarray  # its initial state
    p: np.ndarray  # and its parameters
    commits: list[Arrays]


def _as_far_as_it_goes(
    compiled: Compiled,
    run: RunWithDerivatives,
    named: tuple[Sequence[Observed], Sequence[VariedQuantity]],
    given: tuple[np.ndarray, ...],
) -> tuple[_Integrated, SlidRun]:
    """Run a diagram with its derivatives, along what it slides; with the run without them."""
    u, x0, p, scale = given
    one = _integrated(compiled, _at_most(run, _STEPS_FIRST), named, given)
    slid = run_alone(_course(compiled, run, u), one.reached, x0, p)
    done = slid.reached.statistics
    further = _at_most(run, _STEPS_FIRST + _STEPS_MORE * (done.accepted + done.rejected))
    if slid.slides:
        x0 = with_modes(x0, len(slid.slides), run.times)
        one = _integrated(slid.compiled, further, named, (u, x0, slid.p, scale))
        one = replace(one, reached=slid.named(one.reached))
    elif one.reached.statistics.status is Status.STEP_LIMIT:
        one = _integrated(compiled, further, named, given)
    return one, slid


def _integrated(
    compiled: Compiled,
    run: RunWithDerivatives,
    named: tuple[Sequence[Observed], Sequence[VariedQuantity]],
    given: tuple[np.ndarray, ...],
) -> _Integrated:
    """Run a diagram with its derivatives."""
    (signals, quantities), (u, x0, p, scale) = named, given
    differentiated = _compiled(compiled, signals, quantities, p, run.settings)
    span = float(run.times[0]), float(run.times[-1])
    rise = float(np.ptp(u, axis=1).max(initial=0.0))
    whole = parameters_with(differentiated.extended, quantities, p, scale, run.settings, span, rise)
    start, commits = _start(differentiated, quantities, run, (u, x0, scale), whole)
    reached = run_once(_course(differentiated.compiled, run, u), start, whole)
    return _Integrated(
        differentiated=differentiated, start=start, p=whole, commits=commits,
        reached=_at_its_end(reached, run.times.size, differentiated.outputs),
    )  # fmt: skip


def _at_most(run: RunWithDerivatives, steps: int) -> RunWithDerivatives:
    """Return a run that ends after so many steps, or fewer if its settings say so."""
    # Where rates have no bound derivatives may need steps without end: sqrt(abs(x)) through 0.
    most = min(run.settings.max_steps, steps)
    return replace(run, settings=replace(run.settings, max_steps=most))


def _at_its_end(reached: Trajectory, samples: int, outputs: int) -> Trajectory:
    """Return a run that has come to its end, if only derivatives of outputs are NaN somewhere."""
    # An output may have a corner of its own, as a norm at 0 has: nothing else knows of it.
    ended = reached.time.size == samples and np.isfinite(reached.outputs[:outputs]).all()
    if reached.statistics.status is not Status.DIVERGED or not ended:
        return reached
    return replace(reached, statistics=replace(reached.statistics, status=Status.OK))


def _steps(times: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return held inputs with steps that take long enough for events to be located in them."""
    over = np.minimum(_STEP * np.ptp(times), _PART * np.diff(times))
    return held(times, u, over)


def _shown(
    shown: int, reached: Trajectory, differentiated: Differentiated, p: np.ndarray
) -> Trajectory:
    """Return a run with held inputs, which nothing sees step, at the times that were asked for."""
    arrays = {name: getattr(reached, name) for name in ("time", "outputs", "states", "inputs")}
    reached = replace(reached, **{name: rows[..., ::shown] for name, rows in arrays.items()})
    arrays = {"t": reached.time[None], "x": reached.states, "u": reached.inputs, "p": p[:, None]}
    differentiated.sides.source.check_steps(arrays)
    return reached


def _alone(compiled: Compiled, run: RunWithDerivatives) -> Any:
    """Run a diagram without derivatives; raise why that does not reach its end."""
    return respond(
        compiled, run.times, run.inputs, run.initial_state, settings=run.settings,
        params=run.params, audit=False,
    )  # fmt: skip


def _compiled(
    compiled: Compiled,
    signals: Sequence[Observed],
    quantities: Sequence[VariedQuantity],
    p: np.ndarray,
    settings: Settings,
) -> Differentiated:
    """Return a diagram that is compiled with its derivatives, made when it is first needed."""
    key = repr((signals, quantities))
    entries = compiled.cache.of(_Kept)
    for entry in entries:
        if entry.key == key and entry.holds_for(p):
            return entry.differentiated
    equations = compiled.equations_with(p)
    why = inexact(equations, tuple(equations.results))
    if why is not None:
        warnings.warn(
            f"derivatives of '{compiled.system.name}' are differences where {why}, and exact "
            "elsewhere; jumps of such a function are not known",
            InexactWarning,
            stacklevel=4,
        )
    differentiated = with_its_derivatives(compiled, signals, quantities, p, settings)
    entries.append(_Kept(key=key, differentiated=differentiated))
    return differentiated


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """What has been compiled, of what and by what."""

    key: str
    differentiated: Differentiated

    def holds_for(self, p: np.ndarray) -> bool:
        """Whether the integers that its equations were read with are those of parameters."""
        # with other integers a function may ask for further ones
        assumed = self.differentiated.compiled.equations.graph.assumptions
        return all(p[place] == value for place, value in assumed.items())


def _start(
    differentiated: Differentiated,
    quantities: Sequence[VariedQuantity],
    run: RunWithDerivatives,
    given: tuple[np.ndarray, np.ndarray, np.ndarray],
    p: np.ndarray,
) -> tuple[np.ndarray, list[Arrays]]:
    """Return the initial state behind all that happens at once, and the commits of memories."""
    (u, x0, scale), places = given, differentiated.places
    start = np.zeros(places.size)
    start[: places.states] = x0
    for j, quantity in enumerate(quantities):
        if quantity.state >= 0:
            start[places.derivative(j) + quantity.state] = scale[j]
    end = float(run.times[-1])
    never = end + 1.0 + abs(end)
    start[places.together : places.number] = start[places.chosen : places.ticked] = never
    sides, rated = differentiated.sides, differentiated.extended.sent >= Sent.RATES
    if not sides.rows and not differentiated.compiled.program.sampled and not rated:
        return start, []
    arrays = _beginning(differentiated, run, u, start, p)
    if rated:  # what is sent first may be another than what was before
        layout, lines = differentiated.extended.layout, differentiated.extended.schedule.lines
        before = [p[layout[line.block or 0]["before"].offset] for line in lines[: places.lines]]
        first = evaluated_rows(differentiated, sides.source.arriving, arrays)
        start[places.number : places.height] = 1.0
        start[places.height : places.moved] = before - first
    start[places.kept : places.together] = evaluated_rows(differentiated, sides.now, arrays)
    memories = [*sides.source.driven, *sides.source.catching]
    commits = commits_at_start(differentiated, x0, arrays)
    rows = [places.derivative(j) + m for j in range(places.by) for m in memories]
    start[rows] = commits[-1]["x"][rows, 0]
    return start, commits


def _course(compiled: Compiled, run: RunWithDerivatives, u: np.ndarray) -> Course:
    """Return the run of a program."""
    return Course(compiled=compiled, times=run.times, inputs=u, settings=run.settings)


def _beginning(
    differentiated: Differentiated,
    run: RunWithDerivatives,
    u: np.ndarray,
    start: np.ndarray,
    p: np.ndarray,
) -> Arrays:
    """Return what a run begins with, behind all that happens at once."""
    first = prepared(_course(differentiated.compiled, run, u), start[:, None], p[:, None])
    with np.errstate(all="ignore"):
        begin(first)
    work = first.work
    time = np.maximum(first.lanes["right"][None, :1], run.times[0])
    arrays = {"t": time, "x": work.x.copy(), "u": work.u.copy(), "p": p[:, None]}
    if first.spare is not None:
        give_back(differentiated.compiled.cache, first.spare)
    return arrays


def _audit(
    compiled: Compiled, integrated: Trajectory, p: np.ndarray, run: RunWithDerivatives
) -> None:
    """Compare the equations with python-control's at points of the run, as any run is."""
    count, rates = compiled.system.ninputs or 0, compiled.schedule.rates
    count_with_lines = count + len(compiled.schedule.lines)
    inputs = integrated.inputs[:count_with_lines]
    if rates:
        inputs = np.concatenate([inputs, integrated.inputs[len(integrated.inputs) - count :]])
    trial = Trial(
        time=integrated.time, states=integrated.states[: compiled.system.nstates or 0],
        inputs=inputs, p=p, params=run.params, width=1,
    )  # fmt: skip
    audit(compiled, trial, run.audit)


def _response(
    differentiated: Differentiated,
    names: tuple[Sequence[Observed], Sequence[VariedQuantity]],
    run_of: tuple[np.ndarray, Trajectory],
    scale: np.ndarray,
    lacks: Any,
) -> SensitivityResponse:
    """Return the signals and their derivatives out of a trajectory."""
    (signals, quantities), places, count = names, differentiated.places, differentiated.outputs
    times, integrated = run_of
    values = np.empty((len(signals), integrated.time.size))
    derivatives = np.empty((len(signals), len(quantities), integrated.time.size))
    driven = differentiated.sides.source.driven
    rows = sorted(range(len(signals)), key=lambda i: signals[i].combination is None)
    row = 0
    for i in rows:
        signal = signals[i]
        is_state = signal.combination is None and signal.state not in driven
        source = integrated.states if is_state else integrated.outputs
        row_of_signal = signal.state if is_state else row
        values[i] = source[row_of_signal]
        for j in range(len(quantities)):
            place = (
                places.derivative(j) + row_of_signal
                if is_state
                else count * (1 + j) + row_of_signal
            )
            derivatives[i, j] = source[place] / scale[j]
        row += not is_state
    for lack in lacks:
        behind = (
            integrated.time > lack.time if lack.time == times[0] else integrated.time >= lack.time
        )
        without = [q.name in lack.with_respect_to for q in quantities]
        derivatives[:, np.outer(without, behind)] = np.nan
    rest = ((0, 0), (0, times.size - integrated.time.size))
    values = np.pad(values, rest, constant_values=np.nan)
    derivatives = np.pad(derivatives, ((0, 0), *rest), constant_values=np.nan)
    return SensitivityResponse(
        time=times, signals=tuple(s.name for s in signals),
        with_respect_to=tuple(q.name for q in quantities), values=values,
        derivatives=derivatives, scale=scale, missing=tuple(lacks),
        statistics=integrated.statistics,
    )  # fmt: skip


@as_annotated
def sensitivity_response(
    diagram: ct.NonlinearIOSystem | Compiled,
    timepts: ArrayLike | None = None,
    inputs: Any = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    with_respect_to: Sequence[str] | str,
    of: Sequence[str] | str | None = None,
    hold: str = "foh",
    params: Mapping[str, Any] | None = None,
    method: str | Tableau | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    max_steps: int | None = None,
    max_step: float | None = None,
    audit: object = True,
    **aliases: object,
) -> SensitivityResponse:
    """Simulate a diagram together with its derivatives by parameters and initial states.

    Forward sensitivities: the derivative of the whole program is integrated with it, under one
    error control.  At conditions of the equations, guards, switching memories and ideal relays
    that begin to slide the derivatives jump (saltation); memories, samples and delays have those
    of what they keep.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem or Compiled
        A diagram, or what `nlctl.compile` made of it; compile once for many runs.
    timepts : array_like of shape (m,), optional
        Times in s at which inputs are given, and signals and derivatives are computed; they are
        needed, under this name or as ``T``.
    inputs : array_like, list or float, optional
        Inputs over `timepts`, as in `nlctl.input_output_response`; also ``U``.
    initial_state : mapping, array_like or float, optional
        As there; also ``X0``.
    with_respect_to : sequence of str or str
        Parameters, ``"law.beta"`` or ``"law.K[1]"``, and initial states, ``"plant.x1(0)"``.
    of : sequence of str or str, optional
        Outputs of the diagram, outputs of its blocks, ``"plant.y"``, and states; by default the
        outputs of the diagram.
    hold : {"foh", "zoh"}, optional
        What inputs are between `timepts`, as in `nlctl.input_output_response`: linear, or held.
    params : mapping, optional
        Overrides by qualified name.
    method : str or Tableau, optional
        Of machine code, as in `nlctl.input_output_response`.
    rtol, atol : float, optional
        Tolerances, for states and for derivatives times the size of what they are taken by.
    max_steps : int, optional
        Attempted steps after which a run is given up.
    max_step : float, optional
        Longest step (s).
    audit : bool or "every run", optional
        As in `nlctl.input_output_response`.
    **aliases : object
        python-control's short names: ``T``, ``U``, ``X0``.

    Returns
    -------
    SensitivityResponse
        ``response["plant.y", "law.beta"]`` over ``response.time``.  Where there is no derivative
        it is NaN from there on, and ``response.missing`` says when, where and why: a condition
        that is met at a rate of 0 (grazing), two at one instant, a start on a condition, a memory
        that is touched at its end by a corner, switches without end, a jump that comes back through
        a delay that varies.  An output with a corner of its own, as a norm at 0, has none there,
        and has one again behind it.

    Raises
    ------
    UnknownNameError, AmbiguousNameError
        If a name is not that of exactly one signal, parameter or state.
    CompileError, AlgebraicLoopError
        If the diagram cannot be compiled, is in discrete time, or something in it has no
        derivative: a parameter that numbers follow from outside of the equations, one that says
        when samples are taken, a delay where one varies or has a history or where blocks are
        sampled, an algebraic loop that jumps, a condition or a memory behind a delay that varies or
        has samples in it, a memory that another one moves through a delay.
    ParameterError
        If a value is refused.
    DivergedError
        If the state becomes infinite or NaN.
    AuditError
        If machine code and python-control differ.

    Warns
    -----
    InexactWarning
        If a function is called unchanged: its derivatives are differences.

    Examples
    --------
    x' = 1 + (x > p) from 0: behind t = p it is 2 t - p, and its derivative by p is -1.

    >>> plant = ct.nlsys(
    ...     lambda t, x, u, params: [1 + np.where(x[0] > params["p"], 1.0, 0.0)],
    ...     states=["x"], inputs=0, params={"p": 0.5}, name="plant",
    ... )
    >>> made = nlctl.sensitivity_response(
    ...     plant, [0, 0.25, 1], of=["plant.x"], with_respect_to=["plant.p", "plant.x(0)"]
    ... )
    >>> print(made["plant.x", "plant.p"].round(6), made["plant.x", "plant.x(0)"].round(6))
    [ 0.  0. -1.] [1. 1. 2.]
    """
    named = {"timepts": timepts, "inputs": inputs, "initial_state": initial_state}
    named = with_aliases(named, aliases, sensitivity_response)
    checked_params(params)
    tolerances("sensitivity_response", rtol, atol)
    one_of("sensitivity_response", "hold", hold, HOLDS)
    settings = solver_settings(
        method=method, solve_ivp_method=None, solve_ivp_kwargs=None, rtol=rtol, atol=atol,
        max_steps=max_steps, max_step=max_step,
    )  # fmt: skip
    run = RunWithDerivatives(
        times=checked_times(named["timepts"]), inputs=named["inputs"],
        initial_state=named["initial_state"], params=params, of=of,
        with_respect_to=with_respect_to, hold=hold, settings=settings, audit=audit,
    )  # fmt: skip
    if not isinstance(diagram, Compiled):
        diagram = compile(sized(diagram, run.times, run.inputs, run.initial_state), params=params)
    return differentiated_run(diagram, run)
