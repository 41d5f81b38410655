"""Whether a run folder is whole: one sealed record of every file, which every reader checks first.

``contents.json`` is written last, when a run ends, and taken away when it goes on.  It says which
files there are, with a key of each, how many rows each part has, and which analyses are expected:
whatever a copy lost, a disk damaged or somebody edited is named.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from nlctl.wording import counted

from ..file.schema import keyed
from ..result import Result
from ..sealed import RunFolderError, file_digest, write_json
from .shapes import ContentsFile, shaped

__all__ = ["CONTENTS", "Wholeness", "check_whole", "seal", "unseal", "verify"]

CONTENTS = "contents.json"
_PAGE = ("index.html", "report.json", "report.pdf")
_AT_TOP = ("study.toml", "run.json", "results.json")
REMEDY = "continue the run with --resume, which makes it anew, or take an intact copy"


@dataclass(frozen=True, kw_only=True)
class Wholeness:
    """What `verify` found of a run folder.

    Attributes
    ----------
    folder : Path
    files : int
        Number of files that are as they were written.
    rows : dict
        Number of rows by part, ``"rows"`` for the main table.
    analyses : tuple of str
        Keys of the analyses that the study asks for.
    done : tuple of str
        Those that are done.
    problems : tuple of str
        What is missing, edited or too much, one sentence each; empty if the folder is whole.
    others : tuple of str
        Files that the run has not written, its page aside.

    Examples
    --------
    See `verify`.
    """

    folder: Path
    files: int
    rows: dict[str, int]
    analyses: tuple[str, ...]
    done: tuple[str, ...]
    problems: tuple[str, ...]
    others: tuple[str, ...]

    @property
    def is_whole(self) -> bool:
        """Whether nothing is missing, edited or too much."""
        return not self.problems

    def __str__(self) -> str:
        if self.problems:
            count = counted(len(self.problems), "difference")
            return "\n  ".join([f"'{self.folder}' is not whole, {count}:", *self.problems])
        rows = sum(self.rows.values())
        return (
            f"'{self.folder}' is whole: {counted(self.files, 'file')}, {counted(rows, 'row')}, "
            f"{len(self.done)} of {counted(len(self.analyses), 'analysis', 'analyses')}."
        )


def seal(result: Result) -> None:
    """Write the record of a folder, as it is now."""
    folder, done = result.folder, [finding.key for finding in result.findings]
    files = list(_parts(folder, keyed(result.study)))
    content = {
        "files": {path.relative_to(folder).as_posix(): file_digest(path) for path in files},
        "rows": _rows(folder, files),
        "analyses": list(keyed(result.study)),
        "done": done,
        "complete": result.complete,
    }
    write_json(folder / CONTENTS, content)


def unseal(folder: Path) -> None:
    """Take the record away, before anything in the folder changes."""
    (folder / CONTENTS).unlink(missing_ok=True)


def _parts(folder: Path, keys: Iterable[str]) -> Iterator[Path]:
    """Yield the files that a run has written and that readers read."""
    yield from (path for name in _AT_TOP if (path := folder / name).exists())
    for key in ("rows", *keys):
        yield from sorted(p for p in (folder / key).rglob("*") if _is_part(p))


def _is_part(path: Path) -> bool:
    """Whether a file may be one that readers read."""
    hidden, damaged = path.name.startswith("."), path.suffix == ".damaged"
    return not (hidden or damaged) and (path.is_symlink() or not path.is_dir())


def _rows(folder: Path, files: Iterable[Path]) -> dict[str, int]:
    """Return the number of rows that each part of a folder keeps in chunks."""
    found: dict[str, int] = {}
    for path in files:
        if path.parent.name == "chunks" and path.suffix == ".parquet":
            part = path.relative_to(folder).parts[0]
            found[part] = found.get(part, 0) + pq.read_metadata(path).num_rows
    return found


def check_whole(folder: Path) -> dict[str, Any]:
    """Refuse a folder that is not what its run has written; return its record.

    Raises
    ------
    RunFolderError
        If it holds no run, a part is missing, edited or too much, or the run has not come to an
        end.
    """
    content = _record(folder)
    for problem in _problems(folder, content):
        raise RunFolderError(f"{problem}: {REMEDY}")
    return content


def _record(folder: Path) -> dict[str, Any]:
    path = folder / CONTENTS
    if (folder / "study.toml").exists() and not path.exists():
        raise RunFolderError(
            f"'{folder}' holds a run that has not come to an end, or that lost its '{CONTENTS}': "
            "continue it with --resume"
        )
    if not path.exists():
        raise RunFolderError(f"'{folder}' holds no run of a study: there is no '{CONTENTS}'")
    return shaped(path, ContentsFile, "continue the run with --resume, which makes it anew")


def _problems(folder: Path, content: dict[str, Any]) -> Iterator[str]:
    """Yield what is not as the record says, one sentence each."""
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


def _contradictions(folder: Path, content: dict[str, Any], files: list[Path]) -> Iterator[str]:
    """Yield what the record says that cannot be, of files that are all as it says."""
    place = f"'{folder / CONTENTS}'"
    try:
        rows = _rows(folder, files)
    except (OSError, ValueError) as error:
        yield f"a table of '{folder}' cannot be read ({str(error).partition(chr(10))[0]})"
        return
    if rows != content["rows"]:
        yield f"{place} counts other rows ({content['rows']}) than there are ({rows})"
    expected, done = content["analyses"], content["done"]
    if expected[: len(done)] != done or (content["complete"] and done != expected):
        yield f"{place} names other analyses as done ({done}) than are expected ({expected})"
    for key in done:
        if f"{key}/finding.json" not in content["files"]:
            yield f"'{folder / key / 'finding.json'}' is missing"


def verify(folder: Path) -> Wholeness:
    """Hold every file of a run folder against the record that its run has sealed.

    Nothing is imported, run or drawn.

    Parameters
    ----------
    folder : Path
        Where `run` has kept its results.

    Returns
    -------
    Wholeness
        With every difference, in words.

    Raises
    ------
    RunFolderError
        If it holds no run, or none that has come to an end, or the record itself is damaged.

    Examples
    --------
    A lost analysis is named, and so is everything else that differs:

    >>> import shutil
    >>> import tempfile
    >>> from pathlib import Path
    >>> from analysis.studies import read_study, run, verify
    >>> text = '''
    ... loop = "nlctl:block"
    ... options = { spec = { block = "Lag" }, name = "lag" }
    ... study = { title = "A lag", seed = 1 }
    ... space."lag.T" = { uniform = [0.05, 0.4] }
    ... inputs.u = 1.0
    ... spec.rises = "always from 1 s on v >= 0.9"
    ... time = { end = 1.2, step = 0.1 }
    ... runs.size = 20
    ... analysis = [{ kind = "probability", limit = 0.3 }]
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "lag.toml").write_text(text, encoding="utf-8")
    ...     _ = run(read_study(Path(folder, "lag.toml")), Path(folder, "run"))
    ...     before = verify(Path(folder, "run"))
    ...     shutil.rmtree(Path(folder, "run", "probability"))
    ...     after = verify(Path(folder, "run"))
    >>> before.is_whole, before.rows, before.done
    (True, {'rows': 20}, ('probability',))
    >>> after.is_whole, [text[-32:] for text in after.problems]
    (False, ["probability/finding.json' is missing"[-32:]])
    """
    content = _record(folder)
    known = {CONTENTS, *content["files"], *_PAGE}
    every = (path for path in folder.rglob("*") if _is_part(path))
    names = (path.relative_to(folder).as_posix() for path in every)
    problems = tuple(dict.fromkeys(_problems(folder, content)))
    told = " ".join(problems)
    return Wholeness(
        folder=folder,
        files=len(content["files"]),
        rows=content["rows"],
        analyses=tuple(content["analyses"]),
        done=tuple(content["done"]),
        problems=problems,
        others=tuple(n for n in sorted(names) if n not in known and f"/{n}'" not in told),
    )
