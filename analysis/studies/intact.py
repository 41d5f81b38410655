"""Whether a run folder is intact: one sealed record of every file, which every reader checks first.

``contents.json`` is written last, when a run ends, and removed when it continues.  It says which
files there are, with a key of each, how many rows and which columns each table has, which analyses
are expected, and which page was made of them: whatever a copy lost, a disk damaged or somebody
edited is named.

The shapes that the JSON files of a run folder are validated against.

A file may be intact and carry the right key, and yet be of another version or made by hand.
"""

import shlex
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from nlctl.wording import counted

from ..robustness.runs.store import locked, parquet
from .file.schema import keyed
from .result import Result
from .sealed import ANEW, RunFolderError, file_digest, read_json, write_json

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


CONTENTS = "contents.json"
_LONGEST = 200  # characters of names in a message
_AT_TOP = ("study.toml", "run.json", "results.json")
REMEDY = "continue the run with --resume, which makes it again, or take an intact copy"


def seal(result: Result, key: str, before: Mapping[str, Any] | None = None) -> None:
    """Write what was found, from the origin with that key, and the record of the folder then."""
    write_json(result.folder / "results.json", result.plain() | {"origin": key})
    folder, done = result.folder, [finding.key for finding in result.findings]
    files = list(_parts(folder, keyed(result.study)))
    tables = _tables(folder, files)
    digests = {path.relative_to(folder).as_posix(): file_digest(path) for path in files}
    is_same = before is not None and before["files"] == digests
    content = {
        "files": digests,
        "rows": _rows(tables),
        "tables": tables,
        "analyses": list(keyed(result.study)),
        "done": done,
        "complete": result.complete,
        "page": before["page"] if before is not None and is_same else {},
    }
    write_json(folder / CONTENTS, content)


def unseal(folder: Path) -> dict[str, Any] | None:
    """Take the record away, before anything in the folder changes; return it if it was intact."""
    try:
        before = sealed_record(folder)
    except RunFolderError:
        before = None
    (folder / CONTENTS).unlink(missing_ok=True)
    return before


def _parts(folder: Path, keys: Iterable[str]) -> Iterator[Path]:
    """Yield the files that a run has written and that readers read."""
    yield from (path for name in _AT_TOP if (path := folder / name).exists())
    for key in ("rows", *keys):
        yield from sorted(p for p in (folder / key).rglob("*") if is_part(p))


def is_part(path: Path) -> bool:
    """Whether a file may be one that readers read."""
    hidden, damaged = path.name.startswith("."), path.suffix == ".damaged"
    return not (hidden or damaged) and (path.is_symlink() or not path.is_dir())


def _rows(tables: Mapping[str, Any]) -> dict[str, int]:
    """Return the number of rows that each part of a folder keeps in chunks."""
    rows: dict[str, int] = {}
    for path, table in ((Path(name), table) for name, table in tables.items()):
        if path.parent.name == "chunks":
            rows[path.parts[0]] = rows.get(path.parts[0], 0) + table["rows"]
    return rows


def _tables(folder: Path, files: Iterable[Path]) -> dict[str, Any]:
    """Return the number of rows and the columns of every table in a folder."""
    tables = {}
    for path in files:
        if path.suffix == ".parquet":
            kept = parquet().read_metadata(path)
            columns = kept.schema.to_arrow_schema().names
            tables[path.relative_to(folder).as_posix()] = {
                "rows": kept.num_rows,
                "columns": columns,
            }
    return tables


def check_intact(folder: Path) -> dict[str, Any]:
    """Refuse a folder that is not what its run has written; return its record."""
    content = sealed_record(folder)
    for problem in problems_in(folder, content):
        raise RunFolderError(f"{problem}: {REMEDY}")
    return content


def sealed_record(folder: Path) -> dict[str, Any]:
    """Return what ``contents.json`` says, whether or not it is so."""
    path = folder / CONTENTS
    if (folder / "study.toml").exists() and not path.exists():
        raise RunFolderError(
            f"'{folder}' holds a run that has not come to an end, or that lost its '{CONTENTS}': "
            "continue it with --resume"
        )
    if not path.exists():
        raise RunFolderError(f"'{folder}' holds no run of a study: there is no '{CONTENTS}'")
    return shaped(path, ContentsFile, "continue the run with --resume, which makes it again")


def problems_in(folder: Path, content: dict[str, Any]) -> Iterator[str]:
    """Yield what is not as the record says, one sentence each."""
    parquet()
    files = content["files"]
    yield from (f"'{folder / n}' is missing in its record" for n in _AT_TOP if n not in files)
    sound = []
    for name, digest in files.items():
        path = folder / name
        try:
            if file_digest(path) == digest:
                sound.append(path)
            else:
                yield f"'{path}' is not as it was written"
        except FileNotFoundError:
            yield f"'{path}' is missing"
        except OSError as error:
            yield f"'{path}' cannot be read ({error.strerror or error})"
    keys = {*content["done"], *content["analyses"]}
    for path in _parts(folder, sorted(keys)):
        if path.relative_to(folder).as_posix() not in files:
            yield f"'{path}' was not written by the run"
    if len(sound) == len(files):
        yield from _contradictions(folder, content, sound)


def _size(table: Mapping[str, Any] | None) -> str:
    if table is None:
        return "no table"
    return f"{counted(table['rows'], 'row')} of {', '.join(table['columns'])[:_LONGEST]}"


def _contradictions(folder: Path, content: dict[str, Any], files: list[Path]) -> Iterator[str]:
    """Yield what the record says that cannot be, of files that are all as it says."""
    place = f"'{folder / CONTENTS}'"
    try:
        tables = _tables(folder, files)
    except (OSError, ValueError, NotImplementedError) as error:  # of pyarrow, which derives them
        yield f"a table of '{folder}' cannot be read ({str(error).partition(chr(10))[0]})"
        return
    rows, recorded = _rows(tables), content["tables"]
    if rows != content["rows"]:
        yield f"{place} counts other rows ({content['rows']}) than there are ({rows})"
    for name in dict.fromkeys([*recorded, *tables]):
        if recorded.get(name) != tables.get(name):
            expected, actual = (_size(where.get(name)) for where in (recorded, tables))
            yield f"{place} says that '{name}' has {expected}, and it has {actual}"
    expected, done = content["analyses"], content["done"]
    if expected[: len(done)] != done or (content["complete"] and done != expected):
        yield f"{place} names other analyses as done ({done}) than are expected ({expected})"
    for key in done:
        if f"{key}/finding.json" not in content["files"]:
            yield f"'{folder / key / 'finding.json'}' is missing"


_PAGE, _SIGNALS, _PRINT = ("index.html", "report.json"), "signals.json", "report.pdf"
PAGE_FILES = (*_PAGE, _SIGNALS, _PRINT)
_PARTS = ("study.toml", "run.json", "results.json", CONTENTS)


def is_run(folder: Path) -> bool:
    """Whether a folder is one of a run, or what is left of one."""
    return any((folder / name).exists() for name in _PARTS)


@contextmanager
def recorded_page(folder: Path) -> Iterator[None]:
    """Hold a run's folder while its page is written, and put that page into its record."""
    with locked(folder, RunFolderError):
        content = check_intact(folder)
        yield
        files = (*_PAGE, *(name for name in (_SIGNALS,) if (folder / name).exists()))
        digests = {name: file_digest(folder / name) for name in files}
        is_same = digests[_PAGE[0]] == content["page"].get(_PAGE[0])
        before = content["page"] if is_same else {}  # a print of another page is none of this one
        write_json(folder / CONTENTS, content | {"page": before | digests})


@contextmanager
def recorded_print(folder: Path) -> Iterator[None]:
    """The same while a page is printed to ``report.pdf``, in a folder of a run or another one."""
    if not is_run(folder):
        yield
        return
    with locked(folder, RunFolderError):
        content = sealed_record(folder)
        yield
        if file_digest(folder / _PAGE[0]) == content["page"].get(_PAGE[0]):
            print_ = {_PRINT: file_digest(folder / _PRINT)}
            write_json(folder / CONTENTS, content | {"page": content["page"] | print_})


def page_problems(folder: Path, content: Mapping[str, Any]) -> Iterator[str]:
    """Yield which files of a page are not those that were made of a run, one sentence each."""
    remedy = f"make it again with 'nlctl report {shlex.quote(str(folder))}'"
    for name in PAGE_FILES:
        path, kept = folder / name, content["page"].get(name)
        if not path.exists():
            if kept is not None:
                yield f"'{path}' is missing: {remedy}"
            continue
        try:
            is_own = kept is not None and file_digest(path) == kept
        except OSError as error:
            yield f"'{path}' cannot be read ({error.strerror or error}): {remedy}"
            continue
        if not is_own:
            yield f"'{path}' is not as it was made of these results: {remedy}"


def check_page(folder: Path) -> None:
    """Refuse the page of a run that is not the one that was made of it."""
    if is_run(folder):
        for problem in page_problems(folder, sealed_record(folder)):
            raise RunFolderError(problem)
