"""The arguments of a run: read as python-control reads them, and checked where they enter."""

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np

from ..diagrams import initial_state as state_of
from ..diagrams import state_names
from ..errors import ParameterError, UnknownKeywordError
from ..names import unknown
from ..params import as_numbers
from ..wording import counted
from .watched import Watched

ALIASES = {  # python-control's short names
    **{"T": "timepts", "U": "inputs", "X0": "initial_state"},
    **{"t_eval": "evaluation_times", "return_x": "return_states"},
}


@dataclass(frozen=True, kw_only=True)
class RunArguments:
    """The arguments of a run that both engines take."""

    system: Any
    times: np.ndarray
    inputs: Any
    initial_state: Any
    evaluation_times: object
    params: Mapping[str, Any] | None
    progress: Callable[[float], object] | None
    ignore_errors: bool
    audit: Any  # True, False or "every run"
    form: Mapping[str, Any]  # squeeze, transpose, return_states
    solver: Mapping[str, Any]  # method, rtol, ..., and what SciPy is told
    watched: tuple[Watched, ...] = ()  # functions whose changes of sign are events
    hold: str = "foh"  # what inputs are between their times


HOLDS = ("foh", "zoh")  # first-order and zero-order hold, as python-control calls them


def checked_params(params: object) -> Mapping[str, Any] | None:
    """Return the parameters of a run."""
    if not isinstance(params, Mapping | None):
        raise ParameterError(
            f"params needs values by name, {{'law.beta': 4.0}}, got {type(params).__name__}"
        )
    return params


def with_aliases(
    given: Mapping[str, Any],
    aliases: Mapping[str, Any],
    function: Callable[..., Any],
    short_names: Mapping[str, str] = ALIASES,
    needed: Sequence[str] = ("timepts",),
) -> dict[str, Any]:
    """Return arguments of a function by their full names."""
    found = dict(given)
    parameters = inspect.signature(function).parameters if aliases else {}
    for name, value in aliases.items():
        full = short_names.get(name)
        if full is None or full not in given:
            short = [alias for alias, full in short_names.items() if full in given]
            names = [*(k for k in parameters if k != "aliases"), *short]
            whose = f"of {function.__name__}"
            raise unknown("argument", name, names, whose, UnknownKeywordError)
        if given[full] is not parameters[full].default:
            raise ParameterError(f"'{full}' is given twice, as {full}= and as {name}=")
        found[full] = value
    if any(found.get(name, 0.0) is None for name in needed):
        raise ParameterError("timepts is missing: give the times of the response, in s")
    return found


def unified(run: RunArguments) -> RunArguments:
    """Return a run with each of SciPy's arguments in one place, those in solve_ivp_kwargs too."""
    keywords, solver = run.solver["solve_ivp_kwargs"] or {}, dict(run.solver)
    if not isinstance(keywords, Mapping):
        raise ParameterError(f"solve_ivp_kwargs needs a mapping, got {keywords!r}")
    keywords, wanted = dict(keywords), run.evaluation_times
    if keywords.get("t_eval") is not None:
        if not (isinstance(wanted, str) and wanted == "T"):
            raise ParameterError("'t_eval' is given twice, also in solve_ivp_kwargs")
        wanted = keywords["t_eval"]
    keywords.pop("t_eval", None)
    inner = keywords.pop("method", None)
    methods = [m for m in (solver["method"], solver["solve_ivp_method"], inner) if m is not None]
    if len(methods) > 1:
        raise ParameterError(f"the method is given twice: {methods[0]!r} and {methods[1]!r}")
    solver |= {"solve_ivp_method": solver["solve_ivp_method"] or inner}
    return replace(run, evaluation_times=wanted, solver=solver | {"solve_ivp_kwargs": keywords})


def input_array(system: ct.InputOutputSystem, inputs: object, times: np.ndarray) -> np.ndarray:
    """Return the inputs of a run over its m times, of shape (ninputs, m)."""
    count = system.ninputs or 0
    shape = (count, times.size)
    array = as_numbers(inputs)
    if array is not None and array.ndim == 0:
        array = np.full(shape, float(array))
    if array is not None and array.ndim == 1 and count == 1:
        array = array[None, :]
    if (array is None or array.shape != shape) and isinstance(inputs, list | tuple):
        array = _stacked(inputs, times.size)
    if array is None:
        by_name = isinstance(inputs, Mapping) or callable(inputs)
        rows = f": give their samples, a row for each of {list(system.input_labels or ())}"
        raise ParameterError(
            f"inputs need real numbers, got {_short(inputs)}{rows if by_name else ''}"
        )
    if array.shape != shape:
        raise ParameterError(f"inputs need shape {shape} for these times, got {array.shape}")
    for i, k in () if np.isfinite(array).all() else np.argwhere(~np.isfinite(array))[:1]:
        raise ParameterError(
            f"inputs has {array[i, k]} at '{system.input_labels[i]}', t = {times[k]:g} s: "
            "every input needs a finite number at every time"
        )
    return np.array(array, dtype=float, order="C")


def _stacked(entries: Sequence[Any], samples: int) -> np.ndarray:
    """Return the rows of all entries of a list of inputs."""
    rows = []
    for number, entry in enumerate(entries):
        array = as_numbers(entry)
        if array is None:
            raise ParameterError(f"inputs[{number}] needs real numbers, got {_short(entry)}")
        if array.ndim < 2 and array.shape != (samples,):
            array = np.outer(array, np.ones(samples))  # constant inputs
        array = np.atleast_2d(array)
        if array.ndim > 2 or array.shape[1] != samples:
            raise ParameterError(
                f"inputs[{number}] has shape {array.shape}: a block of inputs needs shape "
                f"(k, {samples}) for these times"
            )
        rows.append(array)
    return np.vstack(rows) if rows else np.zeros((0, samples))


def state_array(system: ct.InputOutputSystem, initial_state: object = None) -> np.ndarray:
    """Return the initial state of a run, of shape (nstates,)."""
    if initial_state is None or isinstance(initial_state, Mapping):
        return state_of(system, initial_state)
    size = system.nstates or 0
    given = initial_state if isinstance(initial_state, list | tuple) else [initial_state]
    parts = [as_numbers(part) for part in given]
    for part, entry in zip(parts, given, strict=True):
        if part is None:
            raise ParameterError(f"initial_state needs real numbers, got {_short(entry)}")
    x = np.concatenate([np.zeros(0), *(part.reshape(-1) for part in parts if part is not None)])
    if np.isscalar(initial_state):
        x = np.full(size, x[0])
    if x.size > size:
        raise ParameterError(
            f"initial_state needs {counted(size, 'value')} for '{system.name}', got {x.size}"
        )
    if 0 < x.size < size and x[-1] != 0.0:
        warnings.warn("initial_state too short; padding with zeros", stacklevel=2)
    x = np.concatenate([x, np.zeros(size - x.size)])
    for i in np.flatnonzero(~np.isfinite(x))[:1]:
        raise ParameterError(
            f"initial_state has {x[i]} at '{state_names(system)[i]}': "
            "every state needs a finite number"
        )
    return x


def evaluation_array(evaluation_times: object, times: np.ndarray) -> np.ndarray:
    """Return the times at which a response is wanted: those of the inputs if it is "T"."""
    if isinstance(evaluation_times, str) and evaluation_times == "T":
        return times
    evaluation = as_numbers(evaluation_times)
    if evaluation is None or evaluation.ndim != 1 or not evaluation.size:
        raise ParameterError(
            "evaluation_times needs a list of times, or 'T' for timepts, got "
            f"{_short(evaluation_times)}: machine code keeps no steps of its own"
        )
    if not np.all(np.isfinite(evaluation)) or not np.all(np.diff(evaluation) > 0):
        raise ParameterError("evaluation_times needs finite times in increasing order")
    for t in evaluation[(evaluation < times[0]) | (evaluation > times[-1])][:1]:
        raise ParameterError(
            f"evaluation_times has {t:g} s, outside of timepts from {times[0]:g} to {times[-1]:g} s"
        )
    return evaluation


def held(
    times: np.ndarray, inputs: np.ndarray, over: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return 2 m - 1 times and inputs, linear in between, that step at each of m times.

    Each step takes as long as `over` says (s), or to the next float.
    """
    # The value before lasts until the float before the time: no run has an instant between the two.
    steps, u = np.empty(2 * times.size - 1), np.repeat(inputs, 2, axis=1)
    steps[::2], steps[1::2] = times, np.minimum(np.nextafter(times[1:], -np.inf), times[1:] - over)
    return steps, np.ascontiguousarray(u[:, :-1])


def interpolated(inputs: np.ndarray, times: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return inputs (ninputs, m), which are linear between their times, at other times."""
    rows = [np.interp(wanted, times, row) for row in inputs]
    return np.array(rows).reshape(len(inputs), wanted.size)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) < 60 else f"{text[:56]} ..."
