"""Records on the stack as on a machine of 64 bits, on one whose addresses have 32.

The integrators' bitcode has been simplified for 64 bits: where the parts of a record lie is written
into it as numbers of bytes.  So every record is made of parts of 64 bits here, and one that is
stored as a whole is stored part by part.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from ...errors import CompileError

_ALLOCA = re.compile(r"= alloca ([^\n]*?), align 8")
_ADDRESS = re.compile(r"\bptr\b")
_STORE = re.compile(r"^  store (\{[^\n]*\}) (%[\w.$\"]+), ptr (%[\w.$\"]+), align \d+$", re.M)
_UNKNOWN = re.compile(r"getelementptr (?:inbounds )?(?:nuw )?(?:ptr|\{)|load \{[^\n]*ptr")
_SIZES = {"ptr": 8, "i64": 8, "double": 8, "i8": 1, "i1": 1}


def laid_out_as_here(text: str) -> str:
    """Return IR whose records lie on the stack as on a machine of 64 bits."""
    if found := _UNKNOWN.search(text):
        raise CompileError(f"the integrators' IR has what no page can hold: {found[0]}")
    text = _ALLOCA.sub(lambda m: _ADDRESS.sub("i64", m[0]), text)
    count = iter(range(len(text)))
    return _STORE.sub(lambda m: _parts_stored(m[1], m[2], m[3], next(count)), text)


def _parts_stored(kind: str, value: str, place: str, number: int) -> str:
    """Return the lines that store the parts of a record."""
    lines = []
    for k, (path, part, offset) in enumerate(_parts(kind)):
        name = f"%part.{number}.{k}"
        indices = ", ".join(map(str, path))
        lines += [
            f"  {name} = extractvalue {kind} {value}, {indices}",
            f"  {name}.at = getelementptr i8, ptr {place}, i64 {offset}",
            f"  store {part} {name}, ptr {name}.at, align 1",
        ]
    return "\n".join(lines)


def _parts(kind: str) -> Iterator[tuple[list[int], str, int]]:
    """Yield the parts of a record that are none: indices, type, place in bytes."""
    path, offset = [-1], 0
    for word in re.findall(r"[{}]|\[\d+ x \w+\]|\w+", kind[1:-1]):
        if word == "{":
            path[-1] += 1
            path.append(-1)
        elif word == "}":
            path.pop()
        else:
            path[-1] += 1
            repeated = re.fullmatch(r"\[(\d+) x (\w+)\]", word)
            size = _SIZES[repeated[2] if repeated else word]
            offset = -(-offset // size) * size
            for i in range(int(repeated[1]) if repeated else 1):
                yield [*path, *([i] if repeated else [])], repeated[2] if repeated else word, offset
                offset += size
