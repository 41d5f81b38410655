"""A study validated against its loop: every name, every formula, every id, every analysis."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import control as ct

from nlctl.errors import ParameterError, UsageError
from nlctl.faults import with_faults
from nlctl.names import check_known, unknown
from nlctl.upstream.control_internals import is_system

from ...metrics import Metric
from ...robustness import Choice, Design, Experiment, Requirement, Space, Uncertain, resolved
from ...robustness.statistics.guarantee import check_iid
from ...robustness.uncertainty.binding import check_keyword, refusal_of
from ...robustness.uncertainty.space import combinations
from ..build import (
    SIGNALS,
    choice,
    experiment,
    faults_of,
    inputs_of,
    loop,
    main_design,
    metrics_of,
    requirement,
    size_mistakes,
    times,
)
from ..file.errors import Problem
from ..file.schema import RESERVED, Asked, Faulty, Study
from ..file.toml import KeyPath
from ..kind import Setup
from ..resolve import check_complete, loop_function, option, uncertain

_T = TypeVar("_T")
_MOST_ROWS = 10_000_000  # of a design or a search
MOST_DIAGRAMS = 1000


class _Notes:
    """Mistakes that are found one after the other."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def add(self, place: KeyPath, message: str) -> None:
        self.problems.append(Problem(place=place, message=message))

    def attempt(self, place: KeyPath, make: Callable[..., _T], *arguments: object) -> _T | None:
        """Return what `make` returns; a mistake that it names is noted instead."""
        try:
            return make(*arguments)
        except UsageError as error:
            self.add(place, str(error))
            return None


def checked_experiment(
    study: Study, folder: Path, named: Mapping[str, Collection[str]] | None = None
) -> tuple[Experiment | None, list[Problem]]:
    """Return the experiment of a study, and all mistakes; None if there are any."""
    # `named` are the names in the tables of the file, those of mistaken entries too, which the
    # study lacks: what speaks of them is not a mistake of its own.
    # Errors of another kind than `UsageError` come from the user's own functions and pass.
    notes = _Notes()
    tables = {"spec": study.spec, "space": study.space} | dict(named or {})
    _check_tables(study, tables, notes)
    requirements = [
        checked
        for key in study.spec
        if (checked := notes.attempt(("spec", key), requirement, study, key)) is not None
    ]
    quantities = {
        name: notes.attempt(("space", name), uncertain, name, law)
        for name, law in study.space.items()
    }
    diagrams = _diagrams(study, folder, notes)
    signals = frozenset.intersection(*(frozenset(d.output_labels) for d in diagrams or [_Empty]))
    for diagram in diagrams:
        _check_names(study, diagram, quantities, requirements, notes)
    for diagram in diagrams:
        for signal, faulty in study.faults.items():
            notes.attempt(("faults", signal), _check_faults, diagram, signal, faulty)
    large = _too_large(study, notes)
    metrics = notes.attempt(("metrics",), metrics_of, study, folder, signals) if diagrams else None
    inputs = notes.attempt(("inputs",), inputs_of, study, diagrams) if diagrams else None
    _check_analyses(study, tables, metrics, notes)
    checked = None
    if diagrams and not notes.problems:
        checked = notes.attempt((), experiment, study, folder, signals, inputs or ())
    if checked is None:
        _check_designs(study, _stand_in(study, quantities), large, notes)
        _comparable(study, folder, notes)
    else:
        space = notes.attempt(("space",), resolved, checked.space, diagrams[0])
        if space is not None:
            if refusal := notes.attempt(("space",), refusal_of, space, diagrams):
                notes.add(("space",), f"boxes do not fit together: {refusal}")
            _check_designs(study, space, large, notes)
        setup = Setup(study=study, folder=folder, experiment=checked)
        for i, asked in _comparable(study, folder, notes):
            if (check := asked.definition.check) is not None:
                notes.attempt(("analysis", i), check, asked, setup)
    return checked, list(dict.fromkeys(notes.problems))  # several diagrams have some in common


def _check_tables(study: Study, tables: Mapping[str, Collection[str]], notes: _Notes) -> None:
    if not tables["spec"]:
        notes.add(("spec",), "needs at least one requirement")
    if not (tables["space"] or study.choices):
        notes.add(("space",), "needs at least one quantity, if there are no choices")
    notes.attempt(("time",), times, study)
    notes.problems += id_problems(study, whole=set(tables["spec"]) == set(study.spec))


def _stand_in(study: Study, quantities: Mapping[str, Uncertain | None]) -> Space:
    """Return a space of the study's size, whatever its mistakes, to validate designs."""

    def some(name: str, quantity: Uncertain | None) -> Uncertain:
        stand_in = quantity if quantity is not None else Uncertain(name=name, bounds=(0.0, 1.0))
        middle = sum(stand_in.box) / 2 if stand_in.nominal is None else stand_in.nominal
        return replace(stand_in, nominal=middle)

    return Space(
        quantities=tuple(some(*one) for one in (quantities or {"any": None}).items()),
        choices=tuple(
            Choice(name=name, options=dict.fromkeys(map(str, asked.options)) or {"": None})
            for name, asked in study.choices.items()
        ),
    )


def _comparable(study: Study, folder: Path, notes: _Notes) -> list[tuple[int, Asked]]:
    """Return the analyses whose keywords the loop's function takes; the others are noted."""
    try:
        function = loop_function(study.loop, folder)
    except UsageError:  # noted already
        return []
    before = len(notes.problems)
    for i, asked in enumerate(study.analysis):
        for key in asked.definition.keywords:
            notes.attempt(("analysis", i, key), check_keyword, function, getattr(asked, key))
    lost = {problem.place[1] for problem in notes.problems[before:]}
    return [(i, asked) for i, asked in enumerate(study.analysis) if i not in lost]


class _Empty:
    """Stands for a loop that could not be built."""

    output_labels = ()


def _diagrams(study: Study, folder: Path, notes: _Notes) -> list[ct.InputOutputSystem]:
    """Build the diagram of every combination of options that can be made."""
    before = len(notes.problems)
    function = notes.attempt(("loop",), loop_function, study.loop, folder)
    for key, value in study.options.items():
        if function is not None:
            notes.attempt(("options", key), check_keyword, function, key)
        notes.attempt(("options", key), option, value, folder)
    if len(notes.problems) > before:
        return _as_it_comes(function)
    build = loop(study, folder)
    choices = []
    for name, asked in study.choices.items():
        notes.attempt(("choices", name), check_keyword, build, name)
        parsed = notes.attempt(("choices", name), choice, name, asked, build, folder)
        choices += [] if parsed is None else [parsed]
    if len(notes.problems) > before:
        return _as_it_comes(function)
    options = {c.name: c.options for c in choices}
    count = math.prod(len(c.options) for c in choices)
    if count > MOST_DIAGRAMS:
        notes.add(
            ("choices",), f"at most {MOST_DIAGRAMS:,} diagrams can be made, got {_count(count)}"
        )
        return []
    every = combinations(Space(choices=tuple(choices))) if choices else [{}]
    built = []
    for labels in every:
        chosen = {name: options[name][label] for name, label in labels.items()}
        system = notes.attempt(("loop",), _diagram, partial(build, **chosen), study.loop)
        built += [] if system is None else [system]
    return built or _as_it_comes(function)


def _as_it_comes(function: Callable[..., Any] | None) -> list[ct.InputOutputSystem]:
    """Return the loop without the study's options, so that names can be validated against it."""
    try:
        return [] if function is None else [_diagram(function, "")]
    except Exception:  # whatever a function of the user's does without what it was to be given
        return []


def _diagram(build: Callable[[], Any], name: str) -> ct.InputOutputSystem:
    """Return the diagram that a loop's function returns."""
    check_complete(build, name, {})
    diagram = build()
    if not is_system(diagram):
        raise ParameterError(f"'{name}' returns {type(diagram).__name__}, and not a diagram")
    return diagram


def _check_names(
    study: Study,
    diagram: ct.InputOutputSystem,
    quantities: Mapping[str, Uncertain | None],
    requirements: Sequence[Requirement],
    notes: _Notes,
) -> None:
    for name, quantity in quantities.items():
        if quantity is not None:
            alone = Space(quantities=(quantity,))
            notes.attempt(("space", name), resolved, alone, diagram)
    labels = diagram.output_labels
    for asked in requirements:
        for signal in asked.signals:
            notes.attempt(("spec", asked.key), check_known, "signal", signal, labels)
    for key in SIGNALS:
        if signal := getattr(study.metrics, key, None):
            notes.attempt(("metrics", key), check_known, "signal", signal, labels)


def _check_faults(diagram: ct.InputOutputSystem, signal: str, faulty: Faulty) -> None:
    """Refuse faults on a signal that the loop lacks, and magnitudes that are none."""
    faults = faults_of(signal, faulty)
    if not faults:
        kinds = ", ".join(Faulty.model_fields)
        raise ParameterError(f"faults on '{signal}' need at least one kind of: {kinds}")
    with_faults(diagram, *faults.values())


def _check_analyses(
    study: Study,
    tables: Mapping[str, Collection[str]],
    metrics: Sequence[Metric] | None,
    notes: _Notes,
) -> None:
    """Look at what can be said without the loop; `metrics` are None if they are not known."""
    columns = ("spec", *tables["spec"], *(metric.key for metric in metrics or ()))
    seen = set(RESERVED)
    for i, asked in enumerate(study.analysis):
        if asked.key in seen:
            notes.add(("analysis", i, "key"), f"needs a key of its own, '{asked.key}' is taken")
        seen |= {asked.key} - {""}
        if asked.definition.needs_rows and study.runs is None and "runs" not in tables:
            notes.add(("analysis", i), f"'{asked.kind}' needs the main table: add [runs]")
        certain = tables["spec"] and metrics is not None
        named = _named(asked, asked.definition.columns) if certain else []
        for key, name in named:
            notes.attempt(("analysis", i, key), check_known, "column", name, columns)
        for key, name in _named(asked, asked.definition.quantities) if tables["space"] else ():
            notes.attempt(("analysis", i, key), check_known, "quantity", name, tables["space"])


def _too_large(study: Study, notes: _Notes) -> set[KeyPath]:
    """Refuse numbers of runs that no machine can make; return where they are asked for."""
    wide, options = len(study.space), math.prod(len(c.options) for c in study.choices.values())
    counts: dict[KeyPath, int] = {
        ("analysis", i): largest(asked, wide)
        for i, asked in enumerate(study.analysis)
        if (largest := asked.definition.largest) is not None
    }
    if study.runs is not None:
        counts["runs",] = study.runs.size or 1
        if study.runs.design in ("grid", "corners"):
            counts["runs",] = (study.runs.levels or 2) ** wide * options
    large = {place: count for place, count in counts.items() if count > _MOST_ROWS}
    for place, count in large.items():
        what = "rows can be run" if place == ("runs",) else "runs can be made"
        notes.add(place, f"at most {_MOST_ROWS:,} {what}, got {_count(count)}")
    return set(large)


def _count(rows: int) -> str:
    return f"{rows:,}" if rows < 10**15 else f"about 10^{math.log10(rows):.0f}"


def _check_designs(study: Study, space: Space, large: set[KeyPath], notes: _Notes) -> None:
    """Make designs that are known in advance, unless too large; check the analyses against them."""
    if study.runs is not None and ("runs",) not in large:
        mistakes = size_mistakes(study.runs)
        for key, mistake in mistakes.items():
            notes.add(("runs", key), mistake)
        if not mistakes:
            notes.attempt(("runs",), main_design, study.runs, space, study.study.seed)
    for i, asked in enumerate(study.analysis):
        if asked.definition.is_statement and study.runs is not None:
            kind = study.runs.design
            design_of_rows = Design(
                space=space, kind=kind, size=1, is_iid=kind == "i.i.d.", entropy=0
            )
            notes.attempt(("analysis", i), check_iid, design_of_rows)
        design = asked.definition.design
        if design is not None and ("analysis", i) not in large:
            notes.attempt(("analysis", i), design, asked, space, study.study.seed)


def _named(asked: Asked, keys: Sequence[str]) -> list[tuple[str, str]]:
    """Return the names that some keys of an analysis, each with its key."""
    names = []
    for key in keys:
        value = getattr(asked, key)
        names += [(key, name) for name in ((value,) if isinstance(value, str) else value)]
    return names


def id_problems(study: Study, *, whole: bool) -> Iterator[Problem]:
    """Yield what is wrong with ids; `whole` says that no requirement of the file is missing."""
    owners: dict[str, str] = {}
    for key, rule in study.spec.items():
        if rule.id in owners:
            message = f"needs an id of its own, '{rule.id}' is that of '{owners[rule.id]}'"
            yield Problem(place=("spec", key, "id"), message=message)
        if rule.id:
            owners.setdefault(rule.id, key)
    for place, asked in enumerate(study.analysis):
        for name in dict.fromkeys(asked.id):
            if not name:
                message = "needs the id of a requirement, got an empty one"
            elif asked.id.count(name) > 1:
                message = f"needs each id once, got '{name}' again"
            elif whole and name not in owners:
                where = "(spec.NAME.id gives a requirement its id)"
                message = str(unknown("requirement id", name, owners, where))
            else:
                continue
            yield Problem(place=("analysis", place, "id"), message=message)
        if asked.id and not asked.claim:
            message = f"'{asked.kind}' claims nothing that could answer {', '.join(asked.id)}: "
            message += "say what it claims, such as by limit, or leave the id out"
            yield Problem(place=("analysis", place, "id"), message=message)
