"""Bytes under a key, in the user's cache folder; what is read there is what was written.

An entry is one file: a mark, the SHA-256 of key and content, the content.  It is written in one
step.  One that is damaged, cut short, or another key's is as good as none.

The digest shows damage and not intent, so the files must be this user's alone: entries are machine
code.  The file that was opened is asked who owns it and who may write to it, and so is the folder.
What stands above the folder needs no such question: who can rename it can put another folder in
its place, but its files belong to somebody else.
"""

import functools
import hashlib
import os
import stat
import sys
import warnings
from pathlib import Path

import platformdirs

from ...errors import CacheWarning
from ...host.files import replace_file

MARK = b"nlctl machine code 1\n"  # the number is that of the format
DIGEST = hashlib.sha256().digest_size


def cache_folder() -> Path:
    """Return where machine code is kept: NLCTL_CACHE_DIR, or the user's cache folder."""
    return Path(os.environ.get("NLCTL_CACHE_DIR") or platformdirs.user_cache_dir("nlctl"))


def read(key: str) -> bytes | None:
    """Return what was written under a key; None if there is nothing that can be relied on."""
    path = _path(key)
    try:
        if not _is_safe(os.stat(path.parent), path.parent):
            return None
        # links are not followed, and a named pipe is not waited for
        flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        content = _content(os.open(path, flags | getattr(os, "O_BINARY", 0)), path)
    except OSError:
        return None
    body = content[len(MARK) + DIGEST :]
    return body if content == _entry(key, body) else None


def _content(descriptor: int, path: Path) -> bytes:
    """Return what is in an open file, nothing if it is not safe; close it."""
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or not _is_safe(status, path):
            return b""
        with open(descriptor, "rb", closefd=False) as file:
            return file.read()
    finally:
        os.close(descriptor)


def write(key: str, body: bytes) -> None:
    """Keep bytes under a key; where that is not possible or not safe, do nothing."""
    path = _path(key)
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_safe(os.stat(path.parent), path.parent):
            replace_file(path, lambda file: file.write(_entry(key, body)))
    except OSError:  # a full disk, a folder for reading only: costs time and nothing else
        return


def _path(key: str) -> Path:
    return cache_folder() / f"{key}.code"


def _entry(key: str, body: bytes) -> bytes:
    return MARK + hashlib.sha256(key.encode() + b"\0" + body).digest() + body


def _is_safe(status: os.stat_result, path: Path) -> bool:
    """Whether a file or folder is this user's and nobody else may write to it; warn if not."""
    if sys.platform == "win32":  # no such owners and modes; a profile's folders are the user's own
        return True
    if status.st_uid != os.geteuid():
        why, remedy = "belongs to another user", ""
    elif status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        why, remedy = "can be written to by others", f"run chmod go-w '{path}', or "
    else:
        return True
    folder = cache_folder()
    if not _warned(folder):  # once
        _warned(folder).append(True)
        warnings.warn(
            f"machine code in '{folder}' is not used, since '{path}' {why}: "
            f"{remedy}set NLCTL_CACHE_DIR to a folder of your own",
            CacheWarning,
            stacklevel=2,
        )
    return False


@functools.cache
def _warned(folder: Path) -> list[bool]:
    return []
