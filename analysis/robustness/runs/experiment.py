"""What is simulated for each row of a design, and what is measured on it."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import control as ct
import numpy as np
import pandas as pd

from nlctl import native
from nlctl.annotations import as_annotated
from nlctl.arguments import ATOL, RTOL, a_function, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError, UsageError
from nlctl.names import check_known
from nlctl.native import Compiled, Ensemble, Status, ensemble_response
from nlctl.native import compile as compiled
from nlctl.native.settings import Settings
from nlctl.params import as_numbers, checked_times
from nlctl.responses.arguments import input_array
from nlctl.responses.breaks import with_breaks

from ...metrics import Metric, in_machine_code
from ..stl.piecewise import with_vertices
from ..stl.spec import Requirement, Spec, unfinished_margin
from ..uncertainty.binding import diagrams, resolved
from ..uncertainty.design import Design, seed_number
from ..uncertainty.space import Space, arguments, arguments_of_row, checked_rows


@as_annotated
@described_record(eq=False, made_by="prepare")
class Experiment:
    """A loop, what is uncertain in it, and what is asked of it.

    Raises
    ------
    ParameterError
        If times do not start at 0, a requirement looks beyond the last one, two numbers or
        quantities have the same name, or a tolerance or a number of steps is not positive.
    UnknownNameError
        If there is no such method.
    """

    space: Space
    # Returns the diagram, with one keyword per choice of the space, such as
    # `nlctl.paper.example_1`.
    build: Callable[..., ct.InputOutputSystem]
    spec: Spec
    # (m,): Times in s at which signals are sampled, from 0; requirements and metrics see these
    # samples.
    timepts: np.ndarray
    metrics: tuple[Metric, ...] = ()
    inputs: Any = 0.0  # Inputs of the diagram, the same for all rows.
    rtol: float = RTOL  # Tolerances of the integrator.
    atol: float = ATOL
    max_steps: int = 1_000_000  # A run that needs more steps has failed.
    method: str = "auto"  # As in `nlctl.input_output_response`.

    def __post_init__(self) -> None:
        who = "an experiment"
        of_type(who, "space", self.space, Space)
        of_type(who, "spec", self.spec, Spec)
        a_function(who, "build", self.build)
        for metric in self.metrics:
            if not (hasattr(metric, "key") and hasattr(metric, "signals")):
                raise ParameterError(
                    f"{who} needs metrics such as nlctl.analysis.metrics.Metric, got {metric!r}"
                )
        Settings(rtol=self.rtol, atol=self.atol, max_steps=self.max_steps, method=self.method)
        given = as_numbers(self.inputs)
        if given is not None and not np.all(np.isfinite(given)):
            raise ParameterError(f"{who} needs finite inputs, got {self.inputs!r}")
        times = checked_times(self.timepts)
        object.__setattr__(self, "timepts", times)
        if times[0] != 0:
            raise ParameterError(f"an experiment needs times from 0 s, got {times[0]:g} s")
        for requirement in self.spec.requirements:
            if requirement.until > times[-1]:
                raise ParameterError(
                    f"requirement '{requirement.key}' needs a response until "
                    f"{requirement.until:g} s, the experiment ends at {times[-1]:g} s"
                )
        names = [*self.space.names, *self.measured]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ParameterError(f"an experiment needs each column once, got twice: {twice}")

    @property
    def measured(self) -> list[str]:
        """Columns that `evaluate` adds to those of the space."""
        keys = [m.key for m in (*self.metrics, *self.spec.requirements)]
        return ["status", "time", "steps", *keys, "spec"]


@described_record(eq=False, made_by="prepare")
class Prepared:
    """An experiment whose diagrams are machine code; made by `prepare`, travels to processes."""

    # Its space has full names, and units and nominal values from the nominal diagram.
    experiment: Experiment
    # One for each combination of the choices.
    loops: tuple[tuple[Mapping[str, str], Compiled], ...]

    @property
    def nominal_loop(self) -> Compiled:
        """The one with the nominal option of every choice."""
        middle = {choice.name: choice.nominal for choice in self.experiment.space.choices}
        return next(loop for labels, loop in self.loops if labels == middle)


@as_annotated
def prepare(experiment: Experiment) -> Prepared:
    """Build and compile every diagram of an experiment, and validate names and values against them.

    Parameters
    ----------
    experiment : Experiment
        A space, what builds the loop, times, inputs and a spec.

    Raises
    ------
    UsageError
        As in `binding.diagrams` and `nlctl.compile`.
    ParameterError
        If the inputs do not fit a diagram, or are not finite.
    UnknownNameError
        If a requirement or a metric asks for a signal that a diagram lacks.

    Examples
    --------
    A lag whose time constant is uncertain has to be at 0.9 from 0.3 s on:

    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, always, evaluate, grid, in_band,
    ...     prepare, rows,
    ... )
    >>> space = Space(quantities=(Uncertain(name="lag.T", bounds=(0.05, 0.1)),))
    >>> high = always(in_band("v", lower=0.9), start=0.3)
    >>> fast = Requirement(key="fast", formula=high, until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"lag": nlctl.Lag()}),
    ...     spec=Spec(requirements=(fast,)), timepts=np.linspace(0, 1, 101), inputs=1.0,
    ... )
    >>> found = evaluate(prepare(experiment), rows(grid(space, 2), range(2)))
    >>> print(found["spec"].round(6).tolist(), round((0.1 - np.exp(-0.3 / 0.05)) / 0.9, 6))
    [0.108357, 0.055792] 0.108357
    """
    space = of_type("prepare", "experiment", experiment, Experiment).space
    built = diagrams(space, experiment.build)
    middle = {choice.name: choice.nominal for choice in space.choices}
    full = resolved(space, next(diagram for labels, diagram in built if labels == middle))
    for _, diagram in built:
        input_array(diagram, experiment.inputs, experiment.timepts)
        resolved(full, diagram)  # the full names must be known to every diagram
        for measure in (*experiment.spec.requirements, *experiment.metrics):
            for signal in measure.signals:
                check_known("signal", signal, diagram.output_labels, f"for '{measure.key}'")
    loops = tuple((labels, compiled(diagram)) for labels, diagram in built)
    return Prepared(experiment=replace(experiment, space=full), loops=loops)


@as_annotated
def evaluate(
    prepared: Prepared,
    table: pd.DataFrame,
    *,
    threads: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> pd.DataFrame:
    """Simulate rows and take their margins and metrics.

    A row's result does not depend on the other rows, on their order or on `threads`.

    Parameters
    ----------
    prepared : Prepared
        The experiment, compiled: what `prepare` returns.
    table : pandas.DataFrame
        One column for each name of the space, such as `design.rows` returns; others are ignored.
    threads : int, optional
        Number of threads; by default one per core.
    progress : callable, optional
        Called with the number of rows that are finished.

    Returns
    -------
    pandas.DataFrame
        With the index of `table`: its columns of the space, ``status``, ``time`` (s) reached,
        ``steps``, metrics (NaN for a failed run), the margin of each requirement by its key
        (`spec.unfinished_margin` for a failed run) and their least as ``spec``.  Rows that
        Ctrl-C kept from finishing are missing.

    Raises
    ------
    UnknownNameError, ParameterError
        If the table lacks a column, has a row twice, or a number that is not finite.

    Examples
    --------
    See `prepare`.
    """
    of_type("evaluate", "prepared", prepared, Prepared, "prepare(experiment)")
    checked_rows(prepared.experiment.space, table)
    parts, finished = [], 0
    for loop, rows in by_diagram(prepared, table):
        notify = None if progress is None else partial(_forward, progress, finished)
        parts.append(_run(prepared.experiment, loop, rows, threads, notify))
        finished += len(rows)
        if len(parts[-1]) < len(rows):
            break
    none = pd.DataFrame(columns=prepared.experiment.measured, index=table.index[:0])
    results = pd.concat(parts) if parts else none
    order = table.index.intersection(results.index, sort=False)
    space = table.loc[order, prepared.experiment.space.names]
    return pd.concat([space, results.loc[order]], axis=1)


def by_diagram(prepared: Prepared, table: pd.DataFrame) -> Iterator[tuple[Compiled, pd.DataFrame]]:
    """Yield each diagram that rows of a table ask for, with these rows: those with its labels."""
    for labels, loop in prepared.loops:
        same = [table[name] == label for name, label in labels.items()]
        rows = table.loc[np.logical_and.reduce(same)] if same else table
        if len(rows):
            yield loop, rows


def loop_of_row(
    prepared: Prepared, row: Mapping[str, Any]
) -> tuple[Compiled, dict[str, dict[str, Any]]]:
    """Return the diagram that a row asks for, and the arguments of its run."""
    space = prepared.experiment.space
    ((loop, _),) = by_diagram(prepared, pd.DataFrame([row], columns=space.names))
    return loop, arguments_of_row(space, row)


def simulate_rows(
    experiment: Experiment,
    loop: Compiled,
    rows: pd.DataFrame,
    *,
    metrics: Sequence[Metric | Requirement] = (),
    keep: Sequence[str] = (),
    threads: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Ensemble:
    """Simulate rows of one diagram, see `by_diagram`, with the settings of an experiment."""
    # `metrics` and the arguments after them are those of `nlctl.ensemble_response`.
    varied = arguments(experiment.space, rows)
    return ensemble_response(
        loop,
        experiment.timepts,
        experiment.inputs,
        varied["initial_state"],
        params=varied["params"],
        metrics=metrics,
        keep=keep,
        threads=threads,
        rtol=experiment.rtol,
        atol=experiment.atol,
        max_steps=experiment.max_steps,
        method=experiment.method,
        progress=progress,
    )


def signals_of_rows(
    prepared: Prepared, rows: pd.DataFrame, names: Sequence[str], threads: int | None = None
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Simulate rows of any diagrams; return signals of shape (rows, m), and how each run ended."""
    study, rows = prepared.experiment, rows.reset_index(drop=True)
    signals = {name: np.full((len(rows), len(study.timepts)), np.nan) for name in names}
    status = np.full(len(rows), "", dtype=object)
    for loop, same in by_diagram(prepared, rows):
        runs = simulate_rows(study, loop, same, keep=names, threads=threads)
        status[same.index] = runs.table["status"].to_numpy()
        for name in names:
            signals[name][same.index] = runs.signals[name]
    return signals, status


def _forward(progress: Callable[[int], object], before: int, count: int) -> None:
    progress(before + count)


def _run(
    experiment: Experiment,
    loop: Compiled,
    rows: pd.DataFrame,
    threads: int | None,
    progress: Callable[[int], object] | None,
) -> pd.DataFrame:
    requirements = experiment.spec.requirements
    metrics = (*map(_fast, experiment.metrics), *requirements)
    simulated = simulate_rows(
        experiment, loop, rows, metrics=metrics, threads=threads, progress=progress
    )
    results = simulated.table.reindex(columns=experiment.measured)
    results = results.set_axis(rows.index[results.index.to_numpy()])
    failed = results["status"] != Status.OK.name
    end = float(experiment.timepts[-1])
    graded = [unfinished_margin(time, end) for time in results.loc[failed, "time"]]
    for requirement in requirements:
        results.loc[failed, requirement.key] = graded
    results["spec"] = np.min(results.loc[:, [r.key for r in requirements]].to_numpy(), axis=1)
    return results


def compile_experiment_ahead(prepared: Prepared) -> None:
    """Compile diagrams, metrics and margins, which otherwise happens with the first row."""
    for _, loop in prepared.loops:
        native.compile_ahead(loop, ensemble=True)
    time = np.linspace(0.0, 1.0, 5)
    with_vertices(time, np.zeros(time.size))
    for metric in prepared.experiment.metrics:
        if isinstance(metric, Metric):
            function = with_breaks(_fast(metric).function, np.zeros(0))
            function(time, *np.zeros((len(metric.signals), time.size)))


def _fast(metric: Metric) -> Metric:
    if not isinstance(metric, Metric):  # what is like a metric runs as it is
        return metric
    return replace(metric, function=in_machine_code(metric.function))


# for each column the name of its type, or the labels that it may hold
Columns = Mapping[str, str | Sequence[str]]


def columns_of(prepared: Prepared) -> Columns:
    """Return the columns of a sweep's table, in order."""
    # Those of `experiment.evaluate`, then ``seed`` (see `design.seed_number`) and ``wall_time``,
    # the time (s) that a row's chunk took over its number of rows.
    experiment = prepared.experiment
    numbers = (*experiment.space.names, *experiment.measured)
    columns: dict[str, str | Sequence[str]] = dict.fromkeys(numbers, "float64")
    columns |= {choice.name: list(choice.options) for choice in experiment.space.choices}
    columns |= {"status": [status.name for status in Status], "steps": "int64"}
    return columns | {"seed": "uint64", "wall_time": "float64"}


def typed(frame: pd.DataFrame, columns: Columns) -> pd.DataFrame:
    """Return those columns that a frame has, in their order and with their types."""
    for name, kind in columns.items():
        if name in frame and not isinstance(kind, str):
            others: Any = frame[name][~frame[name].isin(list(kind))]
            if len(others):
                raise ValueError(
                    f"column '{name}' holds {str(others.iloc[0])[:40]!r}, no label of it"
                )
    types = {
        name: kind if isinstance(kind, str) else pd.CategoricalDtype(list(kind))
        for name, kind in columns.items()
        if name in frame
    }
    return frame.filter(list(types)).astype(types)


def chunk_table(
    prepared: Prepared,
    design: Design,
    chosen: pd.DataFrame,
    *,
    threads: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> pd.DataFrame:
    """Run some rows of a design, as `design.rows` has them."""
    # A pure function, except for the column ``wall_time``.
    start, numbers = time.perf_counter(), chosen.index
    try:
        results = evaluate(prepared, chosen, threads=threads, progress=progress)
    except UsageError as error:
        raise type(error)(f"{error} (in rows {numbers[0]} to {numbers[-1]})") from error
    if len(results) < len(numbers):
        raise KeyboardInterrupt
    seeds = np.array([seed_number(design, number) for number in numbers], dtype=np.uint64)
    spent = (time.perf_counter() - start) / max(len(numbers), 1)
    return typed(results.assign(seed=seeds, wall_time=spent), columns_of(prepared))
