"""File -> study, validated against its loop; every mistake at once."""

import copy
import json
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import ParameterError, UsageError
from nlctl.names import check_known

from ..code.rule import Grant, Reach, named_in, remember_code, untrusted
from ..file.errors import Problem, StudyError, located, place_text, schema_problems
from ..file.schema import Study
from ..file.toml import KeyPath, check_depth, line_numbers, read_toml, study_text
from ..kind import Setup
from ..resolve import checked_definition
from ..sealed import digest_of
from .own_kinds import model_of, own_kinds
from .validate import checked_experiment

# a checkout has them in reports/, a wheel carries copies in its package
FOLDERS = (Path(__file__).parents[3] / "reports", Path(__file__).parents[1] / "reports")


@as_annotated
def shipped(name: str) -> Path:
    """Return the study file of this name, such as ``"example-1-quick"``.

    Parameters
    ----------
    name : str
        Without the ending.

    Returns
    -------
    pathlib.Path
        Of the file that is installed.

    Raises
    ------
    UnknownNameError
        If there is none.

    Examples
    --------
    >>> from nlctl.analysis.studies import shipped
    >>> shipped("example-1-quick").name
    'example-1-quick.toml'
    >>> shipped("example-1-quik")
    Traceback (most recent call last):
    nlctl.errors.UnknownNameError: unknown study 'example-1-quik'; nearest: 'example-1-quick', ...
    """
    studies = {path.stem: path for folder in FOLDERS for path in sorted(folder.glob("*.toml"))}
    check_known("study", name, studies)
    return studies[name]


_ROUNDS = 5  # mistakes may stand behind mistakes
STAND_INS = {  # while the rest of a mistaken file is validated
    "study": {"title": "a study", "seed": 0},
    "time": {"end": 1e5, "step": 0.1},  # formulas look ahead by less
    "spec": {},
}
_SPOKEN_OF = ("spec", "space", "runs")  # tables whose entries other parts of a study name


@described_record(eq=False, made_by="read_study")
class StudyFile(Setup):
    """A study without mistakes, with the settings of the command line."""

    path: Path


@as_annotated
def read_study(
    path: str | Path,
    settings: Sequence[str] = (),
    *,
    folder: str | Path | None = None,
    trust: bool = False,
    received: bool = False,
) -> StudyFile:
    """Read a study file, and validate every name in it against the loop.

    The files and modules that it names are run, if they may: see `code.rule`.

    Parameters
    ----------
    path : str or Path
        The study file, in TOML.
    settings : sequence of str, optional
        ``key=value`` that replace what the file has: ``runs.size=100``,
        ``space."actuator.b_r".uniform=[0.3, 0.6]``, ``analysis.0.confidence=0.9``.
    folder : str or Path, optional
        What paths in the study are relative to; by default the file's folder.
    trust : bool, optional
        Whether any code that it names may be run.  What was trusted once need not be again, as
        long as study and code stay what they are.
    received : bool, optional
        Whether the file came with a folder of results: then code of that folder runs only if this
        user has run or trusted it.

    Raises
    ------
    StudyError
        With every mistake: wrong TOML, unknown keys, wrong types, names that the loop lacks.
    ParameterError
        If a setting cannot be read.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> from nlctl.analysis.studies import read_study, shipped
    >>> file = read_study(shipped("example-1-quick"), ["runs.size=10"])
    >>> file.study.runs.size, file.experiment.space.names[0]
    (10, 'actuator.b_r')
    >>> file.experiment.timepts.size  # 20 s in steps of 0.01 s
    2001
    """
    path = Path(path)
    content = path.read_bytes()
    folder = path.parent if folder is None else Path(folder)
    try:
        text = study_text(content)
        data = read_toml(text)
        lines = line_numbers(text)
        given = {_set(data, setting): setting for setting in settings}
        check_depth(data)
    except ParameterError:
        raise
    except ValueError as error:
        raise StudyError(str(path), [Problem(place=(), message=str(error))]) from None
    reach: Reach = "all" if trust else "nlctl" if received else "study"
    grant = Grant(reach=reach, folder=folder, study=digest_of(data))
    kinds, mistaken = own_kinds(data, grant)
    study, problems, entries = _validated(data, model_of(kinds), mistaken)
    experiment = None
    if study is not None:
        more = _refused(study, grant)
        if not more:
            tables = {name: data[name] for name in _SPOKEN_OF if name in data}
            named = {k: list(v) if isinstance(v, dict) else [] for k, v in tables.items()}
            experiment, more = checked_experiment(study, folder, named)
        more = [replace(p, place=_original(p.place, entries)) for p in more]
        problems += [p for p in more if not follows(p, problems)]
    if problems or study is None or experiment is None:
        placed = [located(p, lines, given) for p in problems]
        raise StudyError(str(path), sorted(placed, key=lambda p: p.line or 0))
    if trust:
        remember_code(study, grant.study, folder)
    return StudyFile(path=folder / path.name, folder=folder, study=study, experiment=experiment)


def _refused(study: Study, grant: Grant) -> list[Problem]:
    """Return the functions that a study names and that may not run; nothing has been called."""
    named = list(named_in(study))
    if problems := untrusted(named, grant):
        return problems
    for place, name in named if grant.reach != "all" else ():
        try:
            checked_definition(name, grant)
        except UsageError as error:
            if grant.remedy in str(error):
                problems.append(Problem(place=place, message=str(error), needs_trust=True))
    return problems


def _validated(
    data: dict[str, Any], model: type[Study], mistaken: Sequence[Problem] = ()
) -> tuple[Study | None, list[Problem], list[int]]:
    """Return the study, its mistakes, and which entries of ``analysis`` it has."""
    # `mistaken` are mistakes that are known already.
    # Where there are mistakes, it is the study without the mistaken parts, if that is one: so
    # mistakes of form and wrong names are found in one go.
    rest, problems = copy.deepcopy(data), list(mistaken)
    for problem in mistaken:
        _remove(rest, problem.place)
    entries: list[int] = []
    for _ in range(_ROUNDS):
        whole, listed = rest, rest.get("analysis")
        if isinstance(listed, list):
            entries = [i for i, entry in enumerate(listed) if entry is not None]
            whole = {**rest, "analysis": [listed[i] for i in entries]}
        try:
            return model.model_validate(whole), problems, entries
        except ValidationError as error:
            mistakes = schema_problems(error, model, whole)
        mistakes = [replace(p, place=_original(p.place, entries)) for p in mistakes]
        reported = problems  # what takes out a mistaken part lets others come to light
        problems = reported + [p for p in mistakes if not follows(p, reported)]
        for problem in reversed(mistakes):
            _remove(rest, problem.place)
        for name, table in STAND_INS.items():
            if any(problem.place[:1] == (name,) for problem in mistakes) and name not in rest:
                rest[name] = table
    return None, problems, entries


def follows(problem: Problem, reported: Sequence[Problem]) -> bool:
    """Whether a mistake may follow from parts that were taken out because of others."""
    place = problem.place
    return any(place and one.place[: len(place)] == place for one in reported)


def _original(place: KeyPath, entries: Sequence[int]) -> KeyPath:
    """Return a place with the index that an analysis has in the file."""
    if len(place) > 1 and place[0] == "analysis" and isinstance(place[1], int):
        return ("analysis", entries[place[1]], *place[2:])
    return place


def _remove(data: dict[str, Any], place: KeyPath) -> None:
    """Take out the innermost key or analysis that a mistake belongs to."""
    target: Any = data
    steps: list[tuple[Any, str | int]] = []
    for i, part in enumerate(place):
        if isinstance(target, list) and i != 1:
            break  # an element of a value
        steps.append((target, part))
        if not isinstance(target, dict | list) or (isinstance(target, dict) and part not in target):
            steps.pop()  # it is missing: the table around it goes
            break
        target = target[part]  # type: ignore[index]
    if len(place) == 3 and place[2] == "kind":
        steps = steps[:2]
    if not steps:
        return
    holder, last = steps[-1]
    if isinstance(holder, list):
        holder[int(last)] = None
    else:
        del holder[last]


def _set(data: dict[str, Any], setting: str) -> KeyPath:
    """Put one setting into the data; return its place."""
    name, equals, value = setting.partition("=")
    try:
        parsed = read_toml(setting)
    except ValueError:
        try:  # a text without its quotes
            parsed = read_toml(f"{name} = {json.dumps(value.strip())}")
        except ValueError:
            parsed = {}
    if not (equals and parsed):
        shown = setting if len(setting) < 200 else f"{setting[:100]} ..."
        raise ParameterError(f"--set needs KEY=VALUE with a key as in TOML, got '{shown}'")
    place: list[str | int] = []
    target: Any = data
    depth = len(_keys(name))
    for i in range(depth):
        ((name, parsed),) = parsed.items()
        key: Any = _entry(target, name, place) if isinstance(target, list) else name
        place.append(key)
        if i == depth - 1:
            target[key] = parsed
        elif isinstance(target, dict):
            target = target.setdefault(key, {})
        else:
            target = target[key]
        if not isinstance(target, dict | list):
            raise ParameterError(f"--set {setting}: {place_text(tuple(place))} is not a table")
    return tuple(place)


def _keys(name: str) -> list[str]:
    """Split a dotted key as TOML does."""
    keys, parsed = [], tomllib.loads(f"{name} = 0")
    while isinstance(parsed, dict):
        ((key, parsed),) = parsed.items()
        keys.append(key)
    return keys


def _entry(entries: list[Any], key: str, place: Sequence[str | int]) -> int:
    """Return the index of a list entry that is named by its number, key or kind."""
    if key.isdigit() and int(key) < len(entries):
        return int(key)
    named = [i for i, e in enumerate(entries) if key in (e.get("key"), e.get("kind"))]
    if len(named) != 1:
        choices = ", ".join(str(e.get("key") or e.get("kind")) for e in entries)
        raise ParameterError(
            f"--set needs the number (0 to {len(entries) - 1}), or key or kind of one entry of "
            f"{place_text(tuple(place))} ({choices}), got '{key}'"
        )
    return named[0]
