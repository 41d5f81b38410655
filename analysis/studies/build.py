"""Study file -> experiment and design."""

import inspect
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import control as ct
import numpy as np

from nlctl.errors import ParameterError
from nlctl.faults import Fault
from nlctl.names import check_known

from ..metrics import Metric
from ..robustness import (
    Choice,
    Design,
    Experiment,
    Requirement,
    Space,
    Spec,
    corners,
    grid,
    independent,
    latin_hypercube,
    one_at_a_time,
    sobol,
    tracking_metrics,
)
from ..robustness.stl.text import parse_formula
from .file.schema import Choices, Faulty, Rows, Study
from .resolve import DEFAULT, loop_function, option, uncertain

_MOST_SAMPLES = 10_000_000
METRIC = ("key", "signals", "unit", "meaning", "function", "start", "end")
SIGNALS = ("error", "control", "actuated", "weights", "gain")


def loop(study: Study, folder: Path) -> partial[Any]:
    """Return the function that builds the diagram, with the study's options set."""
    options = {key: option(value, folder) for key, value in study.options.items()}
    return partial(loop_function(study.loop, folder), **options)


def choice(name: str, choices: Choices, build: Callable[..., Any], folder: Path) -> Choice:
    """Return the choice that a table under ``[choices]`` describes."""
    options = {
        label: _default(name, build) if value == DEFAULT else option(value, folder)
        for label, value in choices.options.items()
    }
    return replace(labels(name, choices), options=options)


def labels(name: str, choices: Choices) -> Choice:
    """Return a choice with its options as the file has them."""
    for label in choices.weights:
        check_known("option", label, choices.options, f"in the weights of '{name}'")
    weights = tuple(choices.weights.get(label, 0.0) for label in choices.options)
    return Choice(
        name=name,
        options=choices.options,
        nominal=choices.nominal,
        weights=weights if choices.weights else (),
    )


def _default(name: str, build: Callable[..., Any]) -> Any:
    keyword = inspect.signature(build).parameters.get(name)
    if keyword is None or keyword.default is inspect.Parameter.empty:
        raise ParameterError(f"the loop has no default for '{name}'")
    return keyword.default


def times(study: Study) -> np.ndarray:
    """Return the sample times 0, step, ..., end."""
    end, step = study.time.end, study.time.step
    if end / step > _MOST_SAMPLES:
        raise ParameterError(
            f"a run has at most {_MOST_SAMPLES:,} samples, got {end:g} s / {step:g} s"
        )
    count = round(end / step)
    if count < 2 or abs(count * step - end) > 1e-9 * end:
        raise ParameterError(f"the end needs to be a multiple of the step, got {end:g} / {step:g}")
    return np.linspace(0.0, end, count + 1)


def requirement(study: Study, key: str) -> Requirement:
    """Return a requirement of the study."""
    rule = study.spec[key]
    until = study.time.end if rule.until is None else rule.until
    return Requirement(
        key=key, formula=parse_formula(rule.formula), until=until, meaning=rule.meaning
    )  # fmt: skip


def metrics_of(study: Study, folder: Path, signals: frozenset[str]) -> tuple[Metric, ...]:
    """Return the metrics of the study; names that it leaves to us must be among `signals`."""
    if study.metrics is None:
        return ()
    asked = study.metrics
    parameters = inspect.signature(tracking_metrics).parameters
    names = {key: getattr(asked, key) for key in SIGNALS}
    for key, given in names.items():
        if given is None:
            names[key] = parameters[key].default if parameters[key].default in signals else ""
    start = study.time.end / 2 if asked.start is None else asked.start
    usual = tracking_metrics(start=start, band=asked.band, swing=asked.swing, **names)
    return (*usual, *(_metric(value, folder) for value in asked.more))


def _metric(value: Any, folder: Path) -> Metric:
    metric = option(value, folder)
    missing = [part for part in METRIC if not hasattr(metric, part)]
    if missing:
        raise ParameterError(
            f"a metric needs {', '.join(METRIC)}, what {value.get('function')} returns lacks "
            f"{', '.join(missing)}; see nlctl.analysis.metrics.Metric"
        )
    return metric


def inputs_of(study: Study, diagrams: Iterable[ct.InputOutputSystem]) -> tuple[float, ...]:
    """Return the value of each input of the diagrams, in their order."""
    labels = [list(diagram.input_labels) for diagram in diagrams]
    for names in labels:
        for name in study.inputs:
            check_known("input", name, names)
        for name in names:
            if name not in study.inputs:
                raise ParameterError(
                    f"the loop's input '{name}' is fed by nothing: give its value under [inputs], "
                    "or feed it by a block of the loop, such as a reference"
                )
        if names != labels[0]:
            raise ParameterError(
                f"every option needs its inputs in the same order, got {labels[0]} and {names}"
            )
    return tuple(study.inputs[name] for name in labels[0])


def experiment(
    study: Study, folder: Path, signals: frozenset[str], inputs: Sequence[float] = ()
) -> Experiment:
    """Return what is simulated for each row."""
    build = loop(study, folder)
    space = Space(
        quantities=tuple(uncertain(name, law) for name, law in study.space.items()),
        choices=tuple(choice(name, c, build, folder) for name, c in study.choices.items()),
    )
    timepts = times(study)
    return Experiment(
        space=space,
        build=build,
        spec=Spec(requirements=tuple(requirement(study, key) for key in study.spec)),
        timepts=timepts,
        inputs=np.tile(np.array(inputs)[:, None], len(timepts)) if inputs else 0.0,
        metrics=metrics_of(study, folder, signals),
        **study.solver.model_dump(),
    )


def faults_of(signal: str, faulty: Faulty) -> dict[str, Fault]:
    """Return the faults that a table under ``[faults]`` describes, by name, all from 0 s on."""
    faults = {}
    for kind, size in faulty.model_dump(exclude_none=True).items():
        lasts = size if kind == "dropout" else None
        value = None if size is True or lasts else size
        block = "fault_" + "".join(c if c.isalnum() else "_" for c in f"{signal}_{kind}")
        faults[f"{signal} {kind}"] = Fault(signal, kind, value, at=0.0, until=lasts, name=block)
    return faults


_SIZED = {"i.i.d.": independent, "Sobol'": sobol, "Latin hypercube": latin_hypercube}


def size_mistakes(rows: Rows) -> dict[str, str]:
    """Return which of `size` and `levels` a design lacks or does not take, and the sentence."""
    takes = "size" if rows.design in _SIZED else "levels" if rows.design == "grid" else ""
    return {
        key: f"a design of kind '{rows.design}' {'needs' if key == takes else 'takes no'} {key}"
        for key in ("size", "levels")
        if (getattr(rows, key) is None) == (key == takes)
    }


def main_design(rows: Rows, space: Space, seed: int) -> Design:
    """Return the rows of the main table."""
    for mistake in size_mistakes(rows).values():
        raise ParameterError(mistake)
    if rows.size is not None:
        return _SIZED[rows.design](space, rows.size, seed)
    if rows.levels is not None:
        return grid(space, rows.levels, seed)
    return corners(space, seed) if rows.design == "corners" else one_at_a_time(space, entropy=seed)
