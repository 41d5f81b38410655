"""What stands in the JSON files of a run folder: shapes, held against what is read.

A file may be whole and carry the right key, and yet be of another version or made by hand.
"""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
)

from ..sealed import ANEW, RunFolderError, read_json

__all__ = ["ContentsFile", "FindingFile", "ResultsFile", "RunFile", "shaped"]

_Shape = TypeVar("_Shape", bound=BaseModel)


def _as_text(value: Any) -> Any:
    return str(value) if isinstance(value, float) else value  # "nan" is read as a number


def _inside(value: str) -> str:
    """Refuse a path that leads out of the folder."""
    path = PurePosixPath(value)
    leads_out = path.is_absolute() or {".", ".."} & set(value.split("/")) or ":" in path.parts[0]
    if leads_out or "\\" in value or not value.isprintable():
        raise ValueError("a path has to stay in the folder")
    return value


def _name(value: str) -> str:
    """Refuse what is no name of a file in a folder."""
    if "/" in value or value.startswith("."):
        raise ValueError("a name has neither slashes nor a dot in front")
    return _inside(value)


Text = Annotated[str, BeforeValidator(_as_text), Field(strict=True)]
Some = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=0)]
Cell = float | Text | None
Key = Annotated[Text, Field(min_length=1, max_length=255), AfterValidator(_name)]
Place = Annotated[Text, Field(min_length=1, max_length=4096), AfterValidator(_inside)]
Digest = Annotated[Text, Field(pattern="^[0-9a-f]{64}$")]
Answer = Literal["shown", "refuted", "not shown yet", ""]


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Facts(_File):
    blocks: dict[str, Text]
    wiring: dict[str, Text]
    parameters: dict[str, Text]
    initial_state: dict[str, Text]


class _Origin(_File):
    model_config = ConfigDict(extra="allow", frozen=True)
    study: dict[str, Any]
    diagrams: dict[str, _Facts]
    versions: dict[str, Text]
    values: dict[str, dict[str, float | Text]]
    unseen: dict[str, list[Text]] = {}


class RunFile(_File):
    """``run.json``."""

    study_folder: Text = Field(pattern="^[^\x00]+$", max_length=4096)
    origin: _Origin


class _Quantity(_File):
    name: Text
    law: Text
    low: Cell
    high: Cell
    unit: Cell
    nominal: Cell


class _Requirement(_File):
    key: Text
    formula: Text
    until: float
    meaning: Text


class _Metric(_File):
    key: Text
    signal: Text
    unit: Text
    meaning: Text


class _Found(_File):
    key: Key
    kind: Text
    title: Text
    sentence: Text
    claim: Text
    answer: Answer
    needs: Text
    runs: Count
    numbers: dict[str, Any]
    is_answered: Some


class _Listed(_Found):
    tables: list[Key]


class FindingFile(_Found):
    """``KEY/finding.json``."""

    tables: dict[Key, Digest]
    origin: Digest


class _Done(_File):
    done: Count


class ResultsFile(_File):
    """``results.json``."""

    title: Text
    question: Text
    verdict: Text
    holds: Some
    answer: Answer
    complete: Some
    notes: list[Text]
    rows: _Done | None
    quantities: list[_Quantity] = Field(min_length=1)
    requirements: list[_Requirement] = Field(min_length=1)
    metrics: list[_Metric]
    findings: list[_Listed]
    origin: Digest


class ContentsFile(_File):
    """``contents.json``: the record that proves that a folder is whole."""

    files: dict[Place, Digest]
    rows: dict[Key, Count]
    analyses: list[Key]
    done: list[Key]
    complete: Some


def shaped(path: Path, shape: type[_Shape], remedy: str = ANEW) -> dict[str, Any]:
    """Return what a file of a run folder holds, if it has the shape that runs write.

    Raises
    ------
    RunFolderError
        If it is missing, damaged, edited, or has another shape.
    """
    content = read_json(path, remedy)
    try:
        return shape.model_validate(content).model_dump(exclude_unset=True)
    except (ValidationError, RecursionError) as error:
        told = "it is nested too deeply"
        if isinstance(error, ValidationError):
            first = error.errors(include_url=False)[0]
            told = f"{'.'.join(map(str, first['loc']))}: {first['msg'].lower()}"[:200]
        raise RunFolderError(f"'{path}' holds what no run writes ({told}): {remedy}") from error
