"""Runs of a diagram with its derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from ..errors import CompileError, InexactWarning
from ..expressions.evaluate import evaluate_expressions
from ..native import Compiled
from ..native.audit import Trial, audit
from ..native.driver import begin, prepared, trajectory
from ..native.histories import variations
from ..native.integrate.state import Status
from ..native.jacobians import inexact, searches_of
from ..native.response import respond
from ..native.results import Trajectory
from ..native.settings import Settings
from ..responses.arguments import input_array, state_array
from .missing import missing
from .names import Observed, VariedQuantity, observed_signals, varied_quantities
from .program import Differentiated, parameters_with, with_its_derivatives
from .record import SensitivityResponse

__all__ = ["RunWithDerivatives", "differentiated_run"]


@dataclass(frozen=True, kw_only=True)
class RunWithDerivatives:
    """What a run with derivatives is asked.

    Attributes
    ----------
    times, inputs, initial_state, params
        As `nlctl.input_output_response` takes them.
    of, with_respect_to : sequence of str
    settings : Settings
    audit : bool or str
    """

    times: np.ndarray
    inputs: Any
    initial_state: Any
    params: Mapping[str, Any] | None
    of: Sequence[str] | None
    with_respect_to: Sequence[str]
    settings: Settings
    audit: Any


def differentiated_run(compiled: Compiled, asked: RunWithDerivatives) -> SensitivityResponse:
    """Integrate a diagram with its derivatives."""
    if not ct.isctime(compiled.system):
        raise CompileError(
            f"'{compiled.system.name}' is in discrete time: derivatives of runs are for diagrams "
            "in continuous time; nlctl.sampled has blocks with a clock in these"
        )
    signals = observed_signals(compiled, asked.of)
    quantities = varied_quantities(compiled, asked.with_respect_to)
    u = input_array(compiled.system, asked.inputs, asked.times)
    x0 = state_array(compiled.system, asked.initial_state)
    p = compiled.parameter_vector(asked.params)
    made = _compiled(compiled, signals, quantities, p, asked.settings)
    scale = _scale(quantities, p, x0)
    span = float(asked.times[-1] - asked.times[0])
    whole = parameters_with(made.extended, quantities, p, scale, asked.settings, span)
    start = _start(made, quantities, asked, (u, x0, scale), whole)
    found = trajectory(made.compiled, asked.times, u, start, whole, asked.settings)
    _audit(compiled, found, p, asked)
    if found.statistics.status not in (Status.OK, Status.ZENO, Status.CHATTERING):
        _raise_own(compiled, asked)
    names = tuple(quantity.name for quantity in quantities)
    lacks = missing(made, (compiled, names), found, (asked.times, start, whole, u))
    return _response(made, (signals, quantities), (asked.times, found), scale, lacks)


def _compiled(
    compiled: Compiled,
    signals: Sequence[Observed],
    quantities: Sequence[VariedQuantity],
    p: np.ndarray,
    settings: Settings,
) -> Differentiated:
    """Return a diagram that is compiled with its derivatives, made when it is first needed."""
    assumed = {i: p[i] for i in compiled.equations.graph.assumptions}
    key = repr((signals, quantities, assumed))
    known = compiled.cache.of(_Kept)
    for each in known:
        if each.key == key:
            return each.made
    why = inexact(compiled, tuple(compiled.equations.results))
    if why is not None:
        warnings.warn(
            f"derivatives of '{compiled.system.name}' are differences where {why}, and exact "
            "elsewhere; jumps of such a function are not known",
            InexactWarning,
            stacklevel=4,
        )
    made = with_its_derivatives(compiled, signals, quantities, p, settings)
    known.append(_Kept(key=key, made=made))
    return made


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """What has been compiled, of what, by what and for which integers."""

    key: str
    made: Differentiated


def _scale(quantities: Sequence[VariedQuantity], p: np.ndarray, x0: np.ndarray) -> np.ndarray:
    """Return of what size each quantity is: that of its value, 1 for 0."""
    values = [p[q.place] if q.state < 0 else x0[q.state] for q in quantities]
    return np.array([abs(v) or 1.0 for v in values])


def _start(
    made: Differentiated,
    quantities: Sequence[VariedQuantity],
    asked: RunWithDerivatives,
    given: tuple[np.ndarray, np.ndarray, np.ndarray],
    p: np.ndarray,
) -> np.ndarray:
    """Return the initial state of a run with derivatives."""
    (u, x0, scale), places = given, made.places
    start = np.zeros(places.size)
    start[: places.states] = x0
    for j, quantity in enumerate(quantities):
        if quantity.state >= 0:
            start[places.derivative(j) + quantity.state] = scale[j]
    end = float(asked.times[-1])
    start[places.together :] = end + 1.0 + abs(end)  # not yet
    if made.sides.rows:
        start[places.kept : places.together] = _sides_at(made, asked, u, start, p)
    return start


def _sides_at(
    made: Differentiated, asked: RunWithDerivatives, u: np.ndarray, start: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """Return the sides on which a run begins, behind all that happens at once."""
    compiled, varied = made.compiled, variations(made.compiled, asked.times)
    first = prepared(compiled, asked.times, u, start[:, None], p[:, None], asked.settings, varied)
    with np.errstate(all="ignore"):
        begin(first)
    work = first.work
    arrays = {"t": work.t[None, :], "x": work.x, "u": work.u, "p": p[:, None]}
    arrays["t"] = np.maximum(arrays["t"][:, :1] * 0 + asked.times[0], first.lanes["right"][:1])
    now = made.sides.now
    values = evaluate_expressions([e for e, _ in now], arrays, searches_of(compiled.equations))
    parts = [np.broadcast_to(v.reshape(-1), (n,)) if v.size in (1, n) else v.reshape(-1)
             for v, (_, n) in zip(values, now, strict=True)]  # fmt: skip
    return np.concatenate(parts)


def _audit(compiled: Compiled, found: Trajectory, p: np.ndarray, asked: RunWithDerivatives) -> None:
    """Compare the equations with python-control's at points of the run, as any run is."""
    count, rates = compiled.system.ninputs or 0, compiled.schedule.rates
    own = count + len(compiled.schedule.lines)
    inputs = found.inputs[:own]
    if rates:
        inputs = np.concatenate([inputs, found.inputs[len(found.inputs) - count :]])
    trial = Trial(
        time=found.time, states=found.states[: compiled.system.nstates or 0], inputs=inputs, p=p,
        params=asked.params, width=1,
    )  # fmt: skip
    audit(compiled, trial, asked.audit)


def _raise_own(compiled: Compiled, asked: RunWithDerivatives) -> None:
    """Raise the error of a run that does not reach its end, with its own words."""
    respond(
        compiled, asked.times, asked.inputs, asked.initial_state, settings=asked.settings,
        params=asked.params, audit=False,
    )  # fmt: skip


def _response(
    made: Differentiated,
    names: tuple[Sequence[Observed], Sequence[VariedQuantity]],
    run_of: tuple[np.ndarray, Trajectory],
    scale: np.ndarray,
    lacks: Any,
) -> SensitivityResponse:
    """Return the signals and their derivatives out of a trajectory."""
    (signals, quantities), places, count = names, made.places, made.outputs
    times, found = run_of
    values = np.empty((len(signals), found.time.size))
    derivatives = np.empty((len(signals), len(quantities), found.time.size))
    carried = made.sides.source.carried
    rows = sorted(range(len(signals)), key=lambda i: signals[i].combination is None)
    row = 0
    for i in rows:
        signal = signals[i]
        is_state = signal.combination is None and signal.state not in carried
        source = found.states if is_state else found.outputs
        own = signal.state if is_state else row
        values[i] = source[own]
        for j in range(len(quantities)):
            place = places.derivative(j) + own if is_state else count * (1 + j) + own
            derivatives[i, j] = source[place] / scale[j]
        row += not is_state
    for each in lacks:
        behind = found.time > each.time if each.time == times[0] else found.time >= each.time
        without = [q.name in each.with_respect_to for q in quantities]
        derivatives[:, np.outer(without, behind)] = np.nan
    rest = ((0, 0), (0, times.size - found.time.size))
    values = np.pad(values, rest, constant_values=np.nan)
    derivatives = np.pad(derivatives, ((0, 0), *rest), constant_values=np.nan)
    return SensitivityResponse(
        time=times, signals=tuple(s.name for s in signals),
        with_respect_to=tuple(q.name for q in quantities), values=values,
        derivatives=derivatives, scale=scale, missing=tuple(lacks), statistics=found.statistics,
    )  # fmt: skip
