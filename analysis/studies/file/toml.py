"""TOML within limits: whatever a file holds is read or refused at once; the line of every key."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

KeyPath = tuple[str | int, ...]
_LARGEST = 200_000  # characters of a file
_LONGEST = 8_000  # characters of a line; a key takes the square of its dots to be read
DEEPEST = 20  # tables and lists inside of each other
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e]")
_TOKEN = re.compile(
    r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*|[\[\]{}\n]',
    re.DOTALL,
)


def study_text(content: bytes) -> str:
    """Return the text in a file."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ValueError(
            f"is not UTF-8, as TOML is: byte 0x{content[error.start]:02x} in line {line}; save it "
            "as UTF-8"
        ) from None


def read_toml(text: str) -> dict[str, Any]:
    """Return the data of a text."""
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
    _check_printable(data, "")
    return data


def _check_printable(value: object, place: str) -> None:
    """Refuse control characters, which a terminal would obey."""
    if isinstance(value, dict):
        for key, part in value.items():
            _check_printable(str(key), f"{place}.{key}" if place else str(key))
            _check_printable(part, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list):
        for part in value:
            _check_printable(part, place)
    elif isinstance(value, str) and (character := _CONTROL.search(value)):
        raise ValueError(
            f"has a control character, U+{ord(character[0]):04X}, in {place!a}: texts have lines, "
            "tabs and characters that can be printed"
        )


def check_depth(data: object) -> None:
    """Refuse tables and lists that are nested deeper than those of any study."""
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
    """Yield the statements of a TOML file, a header or a key with its value."""
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


def line_numbers(text: str) -> dict[KeyPath, int]:
    """Return the line of every key that a statement of a TOML file begins with."""
    lines: dict[KeyPath, int] = {}
    counts: dict[KeyPath, int] = {}
    table: KeyPath = ()
    for line, statement in statements(text):
        path = _path(_parsed(statement))
        if statement.startswith("["):
            if statement.startswith("[["):
                counts[path] = counts.get(path, -1) + 1
            path = table = _indexed(path, counts)
        else:
            path = (*table, *path)
        for depth in range(1, len(path) + 1):
            lines.setdefault(path[:depth], line + 1)
    return lines


def _indexed(path: KeyPath, counts: Mapping[KeyPath, int]) -> KeyPath:
    """Put in the index of the list entry that a header belongs to."""
    place: list[str | int] = []
    for depth, part in enumerate(path, 1):
        place.append(part)
        if path[:depth] in counts:
            place.append(counts[path[:depth]])
    return tuple(place)


def _parsed(statement: str) -> dict[str, Any]:
    try:
        return tomllib.loads(statement)
    except tomllib.TOMLDecodeError:  # a comment
        return {}


def _path(statement: object) -> KeyPath:
    """Return the dotted key of a statement; a value that is a table ends it as well."""
    path: list[str | int] = []
    while isinstance(statement, dict | list) and len(statement) == 1:
        if isinstance(statement, list):
            statement = statement[0]
            continue
        ((key, statement),) = statement.items()
        path.append(key)
    return tuple(path)


def nearest_line(lines: Mapping[KeyPath, int], place: KeyPath) -> int | None:
    """Return the line of a place, or of the innermost table around it that has one."""
    for depth in range(len(place), 0, -1):
        if place[:depth] in lines:
            return lines[place[:depth]]
    return None
