"""What this user has run or trusted: a record of his own, by hash, outside of every folder.

A folder that was received cannot say that it is trusted.  What is recorded is one statement for
each file or module of a study: which study, what it calls the file, and what is in it.  Another
study, another content, another name: another statement.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

import platformdirs

from nlctl.host.files import replace_file

_FORMAT = 1


def record_file() -> Path:
    """Return where the record is: in NLCTL_CONFIG_DIR, or the user's configuration."""
    folder = os.environ.get("NLCTL_CONFIG_DIR") or platformdirs.user_config_dir("nlctl")
    return Path(folder) / "trusted.json"


def statement(study: str, name: str, content: bytes) -> str:
    """Return what is recorded of one file of a study."""
    digest = hashlib.sha256(content).hexdigest()
    return hashlib.sha256("\0".join((study, name, digest)).encode()).hexdigest()


def remembered() -> frozenset[str]:
    """Return all statements; none where there is no record, or others could have written it."""
    path = record_file()
    try:
        if _is_others(path) or _is_others(path.parent):
            return frozenset()
        content = json.loads(path.read_bytes())
        if content["format"] != _FORMAT:
            return frozenset()
        return frozenset(map(str, content["statements"]))
    except (OSError, ValueError, KeyError, TypeError):
        return frozenset()


def _is_others(path: Path) -> bool:
    """Whether somebody else owns a path, or may write there."""
    if not hasattr(os, "getuid"):
        return False
    status = path.stat()
    return status.st_uid not in (os.getuid(), 0) or status.st_mode & 0o022 != 0


def remember(statements: Iterable[str]) -> bool:
    """Add statements to the record; return whether it holds them now."""
    # Where it cannot be written nothing is lost but the question that is asked again.
    before_it, path = remembered(), record_file()
    new = frozenset(statements) - before_it
    if not new:
        return True
    content = json.dumps({"format": _FORMAT, "statements": sorted(before_it | new)}, indent=1)
    before = os.umask(0o077)  # nobody else writes what this user trusts
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, lambda file: file.write(content.encode()))
    except OSError:
        return False
    finally:
        os.umask(before)
    return new <= remembered()
