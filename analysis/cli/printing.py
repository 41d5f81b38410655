"""What is printed: text from files and folders may not give orders to the terminal."""

from __future__ import annotations

import errno
import json
import re
import sys
from typing import Any

__all__ = ["SHORT", "error_line", "in_json", "is_short_of_memory", "printable", "say"]

SHORT = "this needs more memory than there is"

_ORDERS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


def printable(text: object) -> str:
    """Return a text with its control characters spelt out; lines and tabs stay."""
    return _ORDERS.sub(lambda found: repr(found[0])[1:-1], str(text))


def say(text: object = "") -> None:
    """Print a text that may come from a file."""
    print(printable(text))


def error_line(text: object) -> None:
    """Print a text that may come from a file on stderr."""
    print(printable(text), file=sys.stderr)


def in_json(content: Any) -> str:
    """Return content as JSON that is safe to print."""
    text = json.dumps(content, indent=1, ensure_ascii=False)
    return _ORDERS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def is_short_of_memory(error: BaseException | None) -> bool:
    """Whether an error, or what led to it, is that memory has run out: threads need some, too."""
    seen = 0
    while error is not None and seen < 100:
        words = str(error)
        is_thread = isinstance(error, RuntimeError) and "start new thread" in words
        is_library = isinstance(error, ImportError | SystemError) and (
            "allocate memory" in words or "map segment" in words
        )
        is_refused = isinstance(error, OSError) and error.errno == errno.ENOMEM
        if isinstance(error, MemoryError) or is_thread or is_library or is_refused:
            return True
        error, seen = error.__cause__ or error.__context__, seen + 1
    return False
