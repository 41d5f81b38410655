"""JSON files of a run folder; numbers that JSON lacks are kept as text."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from analysis.json_values import as_json, from_json
from nlctl._errors import UsageError
from nlctl._files import replace_file

__all__ = ["RunFolderError", "as_json", "read_json", "write_json"]


class RunFolderError(UsageError):
    """A folder that is no run of a study, or of another one; the message says what to do."""


def write_json(path: Path, content: Any) -> None:
    """Write a file of JSON in one step."""
    text = json.dumps(as_json(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    replace_file(path, lambda file: file.write(text.encode()))


def read_json(path: Path) -> Any:
    """Read a file of a run folder that `write_json` has written.

    Raises
    ------
    RunFolderError
        If it is missing or damaged.
    """
    try:
        return from_json(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise RunFolderError(
            f"'{path.parent}' holds no run of a study, or a damaged one: {error}"
        ) from error
