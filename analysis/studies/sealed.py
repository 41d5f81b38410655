"""JSON files of a run folder, sealed; numbers that JSON lacks are kept as text."""

import errno
import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nlctl.errors import UsageError
from nlctl.host.files import replace_file

from ..json_values import as_json, from_json

RUN_FORMAT = 4
"""Of all files of a run folder; others are refused."""
SEAL = "sha256"
LARGEST_JSON = 200_000_000  # bytes of a file of JSON
ANEW = "restore it, or run the study in another folder with --out"


class RunFolderError(UsageError):
    """A folder that is not a run of a study, or of another one; the message says what to do.

    Examples
    --------
    >>> from pathlib import Path
    >>> from nlctl.analysis.studies import load_result
    >>> load_result(Path("arm"))
    Traceback (most recent call last):
    nlctl.analysis.studies.sealed.RunFolderError: 'arm' holds no run of a study
    """


def write_json(path: Path, content: Any) -> None:
    """Write a file of JSON in one step, with its format and a key of its content in it."""
    plain = as_json({"format": RUN_FORMAT, **content})
    sealed = plain | {SEAL: digest_of(plain)}
    text = json.dumps(sealed, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    replace_file(path, lambda file: file.write(text.encode()))


def read_json(path: Path, remedy: str = ANEW) -> Any:
    """Read a file of a run folder that `write_json` has written."""
    try:
        content = json.loads(file_bytes(path))
        is_sealed = isinstance(content, dict) and content.pop(SEAL, None) == digest_of(content)
        values = from_json(content)
    except FileNotFoundError:
        raise RunFolderError(
            f"'{path.parent}' holds no run of a study, or one that has not come so far: there is "
            f"no '{path.name}'"
        ) from None
    except (OSError, ValueError, RecursionError) as error:
        is_deep = isinstance(error, RecursionError)
        mistake = "it is nested too deeply" if is_deep else "it is not JSON"
        reason = error.strerror if isinstance(error, OSError) else mistake
        raise RunFolderError(f"'{path}' is damaged ({reason}): {remedy}") from error
    if not isinstance(content, dict):
        raise RunFolderError(f"'{path}' is not as it was written: {remedy}")
    if content.get("format") != RUN_FORMAT:
        written_format = str(content.get("format", "none"))[:20]
        raise RunFolderError(
            f"'{path}' has the format {written_format!a}, and this nlctl reads {RUN_FORMAT}: read "
            "it with the nlctl that wrote it, or run the study again in another folder with --out"
        )
    if not is_sealed:
        raise RunFolderError(f"'{path}' is not as it was written: {remedy}")
    del values["format"]
    return values


def file_bytes(path: Path) -> bytes:
    """Return what is in a file of a run folder."""
    if path.exists() and not path.is_file():  # a pipe would never end
        raise OSError(errno.EINVAL, "it is not a file")
    if path.stat().st_size > LARGEST_JSON:
        raise OSError(errno.EFBIG, "it is larger than any file of a run")
    return path.read_bytes()


# the last is Arrow's word for numbers that are text
_NOT_WRITTEN = (
    ArithmeticError, AttributeError, LookupError, TypeError, ValueError, NotImplementedError,
)  # fmt: skip


@contextmanager
def as_written(what: str) -> Iterator[None]:
    """Refuse content that fits together and that no run writes: of other versions, or made up."""
    try:
        yield
    except UsageError:
        raise
    except _NOT_WRITTEN as error:
        reason = f"{type(error).__name__}: {error}".partition("\n")[0][:200]
        raise RunFolderError(f"{what} holds what no run writes ({reason}): {ANEW}") from error


def digest_of(content: object) -> str:
    """Return a key of what JSON can hold of a content."""
    text = json.dumps(as_json(content), sort_keys=True, ensure_ascii=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(path: Path) -> str:
    """Return a key of a file's bytes."""
    if not path.is_file():
        raise FileNotFoundError(errno.ENOENT, "there is no such file", str(path))
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def origin_key(origin: Mapping[str, Any]) -> str:
    """Return a key of what `origin.origin_of` returns, without values, which rounding changes."""
    return digest_of({key: part for key, part in origin.items() if key != "values"})
