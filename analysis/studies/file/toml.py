"""TOML within limits: whatever stands in a file, it is read or refused at once."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Any

__all__ = ["check_depth", "read_toml", "statements"]

_LARGEST = 200_000  # characters of a file
_LONGEST = 8_000  # characters of a line; a key takes the square of its dots to be read
DEEPEST = 20  # tables and lists inside of each other
_TOKEN = re.compile(
    r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*|[\[\]{}\n]',
    re.DOTALL,
)


def read_toml(text: str) -> dict[str, Any]:
    """Return what stands in a text.

    Raises
    ------
    ValueError
        If it is not TOML, or larger or deeper than any study; the message is one sentence.
    """
    if len(text) > _LARGEST:
        raise ValueError(f"has {len(text):,} characters, a study at most {_LARGEST:,}")
    lines = text.split("\n")
    longest = max(range(len(lines)), key=lambda i: len(lines[i]))
    if len(lines[longest]) > _LONGEST:
        raise ValueError(
            f"has {len(lines[longest]):,} characters in line {longest + 1}, a study at most "
            f"{_LONGEST:,}"
        )
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"is not TOML: {error}") from None
    except RecursionError:
        raise ValueError(
            f"has lists or tables inside of each other, deeper than {DEEPEST}"
        ) from None
    except ValueError:  # of int()
        raise ValueError("has an integer of thousands of digits") from None
    check_depth(data)
    return data


def check_depth(data: Any) -> None:
    """Refuse tables and lists that are nested deeper than those of any study.

    Raises
    ------
    ValueError
        With the place.
    """
    rows: list[tuple[Any, str]] = [(data, "")]
    for _ in range(DEEPEST + 1):
        inner = []
        for value, place in rows:
            parts = value.items() if isinstance(value, dict) else enumerate(value)
            inner += [(v, place or str(k)) for k, v in parts if isinstance(v, dict | list)]
        rows = inner
    if rows:
        raise ValueError(
            f"has lists or tables inside of each other, deeper than {DEEPEST}, in '{rows[0][1]}'"
        )


def statements(text: str) -> Iterator[tuple[int, str]]:
    """Yield the statements of a TOML file, a header or a key with its value.

    Yields
    ------
    (line, statement)
        The number of its first line, from 0.
    """
    start, first, line, depth = 0, 0, 0, 0
    for token in _TOKEN.finditer(text):
        word = token[0]
        depth += (word in "[{") - (word in "]}")
        if word == "\n" and depth <= 0:
            if statement := text[start : token.start()].strip():
                yield first, statement
            start, first, depth = token.end(), line + 1, 0
        line += word.count("\n")
    if statement := text[start:].strip():
        yield first, statement
