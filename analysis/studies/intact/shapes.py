"""The shapes that the JSON files of a run folder are validated against.

A file may be intact and carry the right key, and yet be of another version or made by hand.
"""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from ..sealed import ANEW, RunFolderError, read_json

_Shape = TypeVar("_Shape", bound=BaseModel)


def _as_text(value: object) -> Any:
    return str(value) if isinstance(value, float) else value  # "nan" is read as a number


def _inside(value: str) -> str:
    """Refuse a path that leads out of the folder."""
    path = PurePosixPath(value)
    leads_out = path.is_absolute() or {".", ".."} & set(value.split("/")) or ":" in path.parts[0]
    if leads_out or "\\" in value or not value.isprintable():
        raise ValueError("a path has to stay in the folder")
    return value


def _name(value: str) -> str:
    """Refuse what cannot be the name of a file in a folder."""
    if "/" in value or value.startswith("."):
        raise ValueError("a name has neither slashes nor a dot in front")
    return _inside(value)


_Text = Annotated[str, Field(strict=True), BeforeValidator(_as_text)]  # pydantic 2.7: in this order
_Some = Annotated[bool, Field(strict=True)]
_Count = Annotated[int, Field(strict=True, ge=0)]
_Cell = float | _Text | None
_Key = Annotated[_Text, Field(min_length=1, max_length=255), AfterValidator(_name)]
_Place = Annotated[_Text, Field(min_length=1, max_length=4096), AfterValidator(_inside)]
_Digest = Annotated[_Text, Field(pattern="^[0-9a-f]{64}$")]
_Answer = Literal["shown", "refuted", "not shown yet", ""]


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Facts(_File):
    blocks: dict[str, _Text]
    wiring: dict[str, _Text]
    parameters: dict[str, _Text]
    initial_state: dict[str, _Text]


class _Origin(_File):
    model_config = ConfigDict(extra="allow", frozen=True)
    study: dict[str, Any]
    diagrams: dict[str, _Facts]
    versions: dict[str, _Text]
    values: dict[str, dict[str, float | _Text]]
    unseen: dict[str, list[_Text]] = {}


class RunFile(_File):
    """``run.json``."""

    study_folder: _Text = Field(pattern="^[^\x00]+$", max_length=4096)
    origin: _Origin


class _Quantity(_File):
    name: _Text
    law: _Text
    low: _Cell
    high: _Cell
    unit: _Cell
    nominal: _Cell


class _Requirement(_File):
    key: _Text
    formula: _Text
    until: float
    meaning: _Text


class _Metric(_File):
    key: _Text
    signal: _Text
    unit: _Text
    meaning: _Text


class _FindingHead(_File):
    key: _Key
    kind: _Text
    title: _Text
    sentence: _Text
    claim: _Text
    answer: _Answer
    needs: _Text
    runs: _Count
    numbers: dict[str, Any]
    is_answered: _Some


class _Listed(_FindingHead):
    tables: list[_Key]


class FindingFile(_FindingHead):
    """``KEY/finding.json``."""

    tables: dict[_Key, _Digest]
    origin: _Digest


class _Done(_File):
    done: _Count


class ResultsFile(_File):
    """``results.json``."""

    title: _Text
    question: _Text
    verdict: _Text
    holds: _Some
    answer: _Answer
    complete: _Some
    notes: list[_Text]
    rows: _Done | None
    quantities: list[_Quantity] = Field(min_length=1)
    requirements: list[_Requirement] = Field(min_length=1)
    metrics: list[_Metric]
    findings: list[_Listed]
    origin: _Digest


class _Table(_File):
    rows: _Count
    columns: list[_Text]


class ContentsFile(_File):
    """``contents.json``: the record that proves that a folder is intact."""

    files: dict[_Place, _Digest]
    rows: dict[_Key, _Count]
    tables: dict[_Place, _Table]
    analyses: list[_Key]
    done: list[_Key]
    complete: _Some
    page: dict[_Key, _Digest]


def shaped(path: Path, shape: type[_Shape], remedy: str = ANEW) -> dict[str, Any]:
    """Return what a file of a run folder holds, if it has the shape that runs write."""
    content = read_json(path, remedy)
    try:
        return shape.model_validate(content).model_dump(exclude_unset=True)
    except (ValidationError, RecursionError) as error:
        mistake = "it is nested too deeply"
        if isinstance(error, ValidationError):
            first = error.errors(include_url=False)[0]
            mistake = f"{'.'.join(map(str, first['loc']))}: {first['msg'].lower()}"[:200]
        raise RunFolderError(f"'{path}' holds what no run writes ({mistake}): {remedy}") from error
