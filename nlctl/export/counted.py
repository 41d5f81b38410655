"""How many operations a step of a program takes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping

_WORDS = {"+": "additions", "-": "subtractions", "*": "products", "/": "divisions", "fma": "fma"}
_OPERATION = re.compile(r" ([-+*/]) |\b([a-z]\w*)\(")
_FUNCTION = re.compile(r"^static \w+ (\w+)\([^)]*\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_TURNS = re.compile(r"for \(int k = 0; k < (\d+)")
_LINEAR = re.compile(r"^\s*nlctl_(lu|lu_solve)\(&\w+\[\d+\], (\d+)(?:, (\d+))?\);")
_FREE = ("nlctl_bits", "nlctl_real", "sizeof")


def counted_operations(before: str, step: str) -> Counter[str]:
    """Return how often the functions of `step` do what, with those in `before` that they call.

    Of a choice both sides are counted: the worst case.
    """
    known: dict[str, Counter[str]] = {}
    for name, body in _FUNCTION.findall(before):
        known[name] = _counts(body, known)
    total = Counter[str]()
    for _, body in _FUNCTION.findall(step):
        total += _counts(body, known)
    return total


def in_words(counts: Mapping[str, int]) -> str:
    """Return counts in a line."""
    order = [*(key for key in _WORDS if key in counts), *sorted(set(counts) - set(_WORDS))]
    return ", ".join(f"{counts[key]} {_WORDS.get(key, key)}" for key in order) or "no operations"


def _counts(body: str, known: Mapping[str, Counter[str]]) -> Counter[str]:
    """Return how often statements do what, those of loops as often as these turn."""
    total, times = Counter[str](), 1
    for line in body.splitlines():
        turns = _TURNS.search(line)
        if turns or line.strip() == "}":
            times = int(turns[1]) if turns else 1
            continue
        if linear := _LINEAR.match(line):
            total[_of_matrix(*linear.groups())] += times
        statement = re.sub(r"\[[^]]*\]|/\*.*?\*/", "", line).replace("+=", "= x +")
        statement = statement.partition("return")[2] or statement.partition("=")[2]
        for sign, name in _OPERATION.findall(f" {statement}"):
            if name in known:
                total += Counter({key: times * n for key, n in known[name].items()})
            elif name not in _FREE:
                total[sign or name] += times
    return total


def _of_matrix(name: str, rows: str, columns: str | None) -> str:
    if name == "lu":
        return f"LU factorisation of {rows} x {rows}"
    return f"back substitution of {rows} x {columns}"
