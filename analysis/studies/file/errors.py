"""Mistakes in a study file: all of them at once, each with its place."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from nlctl.attributes import described_record
from nlctl.errors import UsageError
from nlctl.names import unknown

from .toml import KeyPath, nearest_line

_LONGEST = 600  # characters of a mistake
OWN_KIND = "a kind of your own is 'path/to/file.py:name' or 'module:name'"
_LARGEST = 10**40  # integers beyond are not printed


@described_record(made_by="StudyError")
class Problem:
    """One mistake."""

    place: KeyPath  # Keys and list indices that lead to it.
    message: str
    line: int | None = None  # Line of the file, from 1; None for what is not in the file.
    # Of the command line, ``key=value``, that are mistaken or have a part in it.
    settings: tuple[str, ...] = ()
    needs_trust: bool = False  # Whether it is none for who trusts the code that the study names.

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can hold it.

        Returns
        -------
        dict
            Place, its text, line, message and settings.
        """
        place = list(self.place)
        return {"place": place, "text": place_text(self.place), "line": self.line} | {
            "message": self.message,
            "settings": list(self.settings),
        }

    def __str__(self) -> str:
        given = " ".join(f"--set {_short(setting)}" for setting in self.settings)
        if self.line is None and given:
            return f"{given}: {_short(self.message)}"
        line = "" if self.line is None else f"line {self.line}, "
        given = f" (with {given})" if given else ""
        return f"{line}{_short(place_text(self.place))}: {_short(self.message)}{given}"


def _short(text: str) -> str:
    """Leave out the middle of a text that quotes too much of a file."""
    return (
        text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 2 :]}"
    )


class StudyError(UsageError):
    """A study file that cannot be run; the message lists every mistake.

    Attributes
    ----------
    problems : tuple of Problem

    Examples
    --------
    >>> from nlctl.analysis.studies import read_study, shipped
    >>> try:
    ...     read_study(shipped("example-1-quick"), ["runs.sise=10", "time.end=-1"])
    ... except StudyError as error:
    ...     for problem in error.problems:
    ...         print(problem.place, problem.message)
    ('time', 'end') input should be greater than 0, got -1
    ('runs', 'sise') unknown key 'sise'; nearest: 'size'
    """

    def __init__(self, source: str, problems: Sequence[Problem]) -> None:
        count = f"{len(problems)} mistake{'s' if len(problems) > 1 else ''}"
        super().__init__("\n  ".join([f"{source} has {count}:", *map(str, problems)]))
        self.problems = tuple(problems)


def place_text(place: KeyPath) -> str:
    """Return a place as it is written in TOML: ``space."actuator.b_r".uniform``."""
    text = ""
    for part in place:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            plain = part.replace("_", "").replace("-", "")
            name = part if plain.isascii() and plain.isalnum() else f'"{part}"'
            text += f".{name}" if text else name
    return text or "the file"


def schema_problems(error: ValidationError, model: type[BaseModel], data: Any) -> list[Problem]:
    """Return what pydantic found, with places as in the file and the nearest name of each key."""
    problems = []
    for one in error.errors(include_url=False):
        context = one.get("ctx", {})
        absent = one["type"] in ("missing", "extra_forbidden")
        place = _in_file(one["loc"], data, absent)
        message = one["msg"][0].lower() + one["msg"][1:]
        if one["type"] == "extra_forbidden":
            names = [key for at in _models_at(model, one["loc"][:-1]) for key in at.model_fields]
            message = str(unknown("key", str(one["loc"][-1]), names))
            if len(one["loc"]) == 3 and one["loc"][0] == "space" and "." not in str(one["loc"][1]):
                whole = ".".join(map(str, one["loc"][1:]))
                message += f'; a name with a dot needs quotes: "{whole}"'
        elif one["type"] == "tuple_type":
            message = "needs a list of values"
        elif one["type"] == "missing":
            message = "is missing" + _meaning(model, one["loc"])
        elif one["type"] == "union_tag_not_found":
            place, message = (*place, "kind"), "is missing"
        elif one["type"] == "union_tag_invalid":
            tags = context["expected_tags"].replace("'", "").split(", ")
            place, message = (
                (*place, "kind"),
                f"{unknown('kind', str(context['tag']), tags)}; {OWN_KIND}",
            )
        elif "input" in one and not isinstance(one["input"], dict | list):
            message = f"{message}, got {_text(one['input'])}"
        problems.append(Problem(place=place, message=message))
    return problems


def _text(value: object) -> str:
    """Return a value as the file has it; not an integer of thousands of digits."""
    if isinstance(value, int) and abs(value) > _LARGEST:
        return f"an integer of {value.bit_length()} bits"
    return repr(value)


def _in_file(loc: KeyPath, data: Any, absent: bool) -> KeyPath:
    """Drop the names of union members that pydantic puts between keys and behind them."""
    # Only if `absent` may the last part be a key that is not there.
    place: list[str | int] = []
    for i, part in enumerate(loc):
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            if i < len(loc) - 1 or not absent:
                continue
        place.append(part)
    return tuple(place)


def _models_at(annotation: object, loc: KeyPath) -> list[type[BaseModel]]:
    """Return the models that a place of pydantic's leads to."""
    models = list(_models(annotation))
    for part in loc:
        inner: list[type[BaseModel]] = []
        for model in models:
            if part in model.model_fields:
                inner += _models(model.model_fields[str(part)].annotation)
        kinds = [(m, m.model_fields.get("kind")) for m in models]
        tagged = [m for m, kind in kinds if kind and part in get_args(kind.annotation)]
        models = inner or tagged or models  # a key of a dict, an index: the same models
    return models


def _meaning(model: type[BaseModel], loc: KeyPath) -> str:
    """Return what a key is for, as its field describes it."""
    fields = [one.model_fields.get(str(loc[-1])) for one in _models_at(model, loc[:-1])]
    described = next((field.description for field in fields if field and field.description), "")
    return f": {described[0].lower()}{described[1:].rstrip('.')}" if described else ""


def _models(annotation: object) -> Iterator[type[BaseModel]]:
    """Yield the models in an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def located(
    problem: Problem, lines: Mapping[KeyPath, int], settings: Mapping[KeyPath, str]
) -> Problem:
    """Return a mistake with its line, or with the settings of the command line that made it."""
    place = problem.place
    responsible = tuple(text for at, text in settings.items() if place[: len(at)] == at)
    if responsible:
        return replace(problem, settings=responsible)
    inside = tuple(text for at, text in settings.items() if at[: len(place)] == place)
    return replace(problem, line=nearest_line(lines, place), settings=inside if place else ())
