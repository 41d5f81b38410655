"""The loops that the command line is asked for, and the settings of a run."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nlctl.attributes import described_record
from nlctl.errors import ParameterError, UsageError

if TYPE_CHECKING:
    import control as ct
    import numpy as np

    from nlctl.upstream.systems import System

USUAL_HORIZON, USUAL_STEP = 20.0, 0.01  # s: of a run, and between its samples
_MOST_SAMPLES = 2_000_000  # times of one run: 16 MB a signal


def named_loop(name: str) -> Any:
    """Return the diagram that a loop's name stands for."""
    from nlctl.upstream.control_internals import is_system

    if ":" in name:
        from ..studies.resolve import named_function  # takes a second

        function = named_function(name, Path.cwd())
        _check_takes_nothing(name, function)
        loop = function()  # who types its name wants it called
    else:
        from nlctl.paper import named_example

        if name.endswith(".py"):
            raise ParameterError(f"'{name}' lacks the function that returns the loop: {name}:make")
        try:
            loop = named_example(name)()
        except UsageError as error:
            raise ParameterError(f"{error}; {_OWN}") from None
    if not is_system(loop):
        raise ParameterError(f"{name} needs to return a diagram, it returned {type(loop).__name__}")
    return in_state_space(loop)


def _check_takes_nothing(name: str, function: Callable[..., Any]) -> None:
    """Refuse a function that cannot be called without arguments."""
    try:
        signature = inspect.signature(function)
        signature.bind()
    except TypeError:
        raise ParameterError(
            f"{name} needs a function without arguments, got "
            f"{name.rpartition(':')[2]}{signature}: give each a default, or write one that calls it"
        ) from None
    except ValueError:  # what is written in C does not say
        return


def in_state_space(system: object) -> Any:
    """Return a diagram with states: a transfer function as a control.StateSpace of its signals."""
    import control as ct

    if not isinstance(system, ct.TransferFunction):
        return system
    names = {"inputs": system.input_labels, "outputs": system.output_labels}
    return ct.ss(system, name=system.name, **names)


_OWN = "a loop of your own is path/to/file.py:function or package.module:function"


def sampled_times(until: float, step: float, loop: Any) -> Any:
    """Return the times of a run, 0 to `until` in s; a loop in discrete time has its own step."""
    import numpy as np

    if loop.isdtime(strict=True):
        period = 1.0 if loop.dt is True else float(loop.dt)
        if step not in (USUAL_STEP, period):
            raise ParameterError(f"'{loop.name}' is sampled every {period:g} s: leave --step out")
        step = period

    if not (0 < step < until < float("inf")):
        raise ParameterError(f"simulate needs 0 < step < until, got step {step:g}, until {until:g}")
    if until / step > _MOST_SAMPLES:
        raise ParameterError(
            f"simulate needs at most {_MOST_SAMPLES:.0e} samples, got until {until:g} s / step "
            f"{step:g} s: take a longer --step"
        )
    if loop.isdtime(strict=True):
        return step * np.arange(int(until / step * (1 + 1e-12)) + 1)
    return np.linspace(0, until, round(until / step) + 1)


def input_values(diagram: System, texts: Sequence[str]) -> np.ndarray:
    """Return the constant value of each input of a diagram; 0 where none is given."""
    import numpy as np

    from nlctl.arguments import number
    from nlctl.names import check_known

    labels = list(diagram.input_labels)
    values = dict.fromkeys(labels, 0.0)
    for text in texts:
        name, value = _pair("--input", text)
        check_known("input", name, labels, f"of '{diagram.name}'")
        values[name] = number("simulate", f"input '{name}'", number_of(name, value))
    return np.array([values[name] for name in labels])


def assignments(
    diagram: ct.InterconnectedSystem, texts: Sequence[str]
) -> tuple[dict[str, Any], dict[str, float]]:
    """Sort ``NAME=VALUE`` texts into parameters and initial states; names must exist."""
    from nlctl.diagrams import parameter_names
    from nlctl.names import base_name, find_name

    params, initial = {}, {}
    known = dict.fromkeys([*parameter_names(diagram), *diagram.params])
    for text in texts:
        name, value = _pair("--set", text)
        if name.endswith("(0)"):
            initial[name.removesuffix("(0)")] = number_of(name, value)
        else:
            find_name("parameter", base_name(name), known)
            params[name] = _value(name, value)
    return params, initial


def _pair(option: str, text: str) -> tuple[str, str]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise ParameterError(f"{option} needs NAME=VALUE, got '{text}'")
    return name, value


def _value(name: str, text: str) -> bool | float | tuple[float, ...]:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    if "," in text:
        return tuple(number_of(name, part) for part in text.split(","))
    return number_of(name, text)


def number_of(name: str, text: str) -> float:
    """Return a number."""
    try:
        return float(text)
    except ValueError:
        raise ParameterError(f"{name} needs a number, got '{text}'") from None


def given_tolerances(rtol: float | None, atol: float | None) -> dict[str, float]:
    """Return the tolerances that were given, by their names."""
    return {name: value for name, value in (("rtol", rtol), ("atol", atol)) if value is not None}


@dataclass(frozen=True, kw_only=True)
class AskedRun:
    """A run of a loop, as options of a command ask for it."""

    loop: str
    settings: Sequence[str]
    inputs: Sequence[str]
    until: float = USUAL_HORIZON
    step: float = USUAL_STEP
    tolerances: Mapping[str, Any] = field(default_factory=dict)  # rtol, atol, where given

    def command(self, verb: str) -> list[str]:
        """Return the command that asks for it, as words."""
        words = ["nlctl", verb, self.loop]
        words += [part for text in self.settings for part in ("--set", text)]
        words += [part for text in self.inputs for part in ("--input", text)]
        words += ["--until", f"{self.until:g}"] * (self.until != USUAL_HORIZON)
        words += ["--step", f"{self.step:g}"] * (self.step != USUAL_STEP)
        return words + [w for k, v in self.tolerances.items() for w in (f"--{k}", f"{v:g}")]


@described_record
class Simulated:
    """A loop, what was set of it, and its run."""

    loop: Any
    response: Any
    params: Mapping[str, Any]  # Parameters that were set.
    start: Mapping[str, float]  # Initial states that were set.


def simulated(run: AskedRun, engine: str = "auto") -> Simulated:
    """Make the loop of a name, and run it under a bar."""
    from nlctl.response import input_output_response

    from .progress import progress_bar

    loop = named_loop(run.loop)
    times = sampled_times(run.until, run.step, loop)
    params, start = assignments(loop, run.settings)
    u = input_values(loop, run.inputs)[:, None] + 0 * times
    with progress_bar(f"simulating {run.loop}", run.until) as advance:
        reached = [0.0]

        def progress(t: float) -> None:
            advance(t - reached[0])
            reached[0] = t

        response = input_output_response(
            loop, times, u, start, params=params, engine=engine, progress=progress,
            **run.tolerances,
        )  # fmt: skip
    return Simulated(loop=loop, response=response, params=params, start=start)
