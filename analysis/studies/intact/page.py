"""The page of a run in its record: whether what lies in the folder was made of these results."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...robustness.runs.store import locked
from ..sealed import RunFolderError, file_digest, write_json
from .contents import CONTENTS, check_intact, sealed_record

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
