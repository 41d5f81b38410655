"""What is printed: text from files and folders may not give orders to the terminal."""

import json
import re
import sys

_ORDERS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


def printable(text: object) -> str:
    """Return a text with its control characters spelt out; lines and tabs stay."""
    return _ORDERS.sub(lambda match: repr(match[0])[1:-1], str(text))


def say(text: object = "") -> None:
    """Print a text that may come from a file."""
    print(printable(text))


def error_line(text: object) -> None:
    """Print a text that may come from a file on stderr."""
    print(printable(text), file=sys.stderr)


def notify(words: str) -> None:
    """Print on stderr what the user has to know, such as what a page will lack."""
    error_line(f"nlctl: {words}")


def error_text(error: Exception) -> str:
    """Return what an error says; of the system's without its number."""
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f"{error.strerror}: '{error.filename}'"
    return str(error)


def in_json(content: object) -> str:
    """Return content as JSON that is safe to print."""
    text = json.dumps(content, indent=1, ensure_ascii=False)
    return _ORDERS.sub(lambda match: f"\\u{ord(match[0]):04x}", text)
