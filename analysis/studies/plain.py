"""JSON files of a run folder; numbers that JSON lacks are kept as text."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nlctl._errors import UsageError
from nlctl._files import replace_file

__all__ = ["RunFolderError", "as_json", "from_json", "read_json", "write_json"]

NON_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


class RunFolderError(UsageError):
    """A folder that is no run of a study, or of another one; the message says what to do."""


def as_json(value: Any) -> Any:
    """Return `value` as JSON can hold it: NaN and infinities become text, see `from_json`."""
    if isinstance(value, Mapping):
        return {str(key): as_json(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(part) for part in value]
    if isinstance(value, np.ndarray | np.generic):
        return as_json(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def from_json(value: Any) -> Any:
    """Undo `as_json`, up to the type of sequences."""
    if isinstance(value, dict):
        return {key: from_json(part) for key, part in value.items()}
    if isinstance(value, list):
        return [from_json(part) for part in value]
    return NON_FINITE.get(value, value) if isinstance(value, str) else value


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
