"""How messages are worded: a number agrees with its noun, a wrong name has its nearest."""

import difflib
from collections.abc import Iterable
from typing import SupportsIndex


def counted(number: SupportsIndex, one: str, many: str = "") -> str:
    """Return a number and its noun: ``"1 state"``, ``"2 states"``."""
    return f"{number} {one if number == 1 else many or f'{one}s'}"


def some_of(count: SupportsIndex, total: SupportsIndex, one: str, verb: str, verbs: str) -> str:
    """Return how many do something: ``"1 of 3 runs violates"``, ``"2 of 3 runs violate"``."""
    return f"{count} of {counted(total, one)} {verb if 1 in (count, total) else verbs}"


def numbered(what: str, count: int) -> list[str]:
    """Return so many names: one as it is, several with numbers from 1 on.

    Examples
    --------
    >>> numbered("guard", 2)
    ['guard 1', 'guard 2']
    """
    return [what] if count == 1 else [f"{what} {k + 1}" for k in range(count)]


def nearest(name: str, known: Iterable[str], most: int, cutoff: float) -> list[str]:
    """Return the names that come nearest to one, capital letters or not, the nearest first."""
    plain: dict[str, list[str]] = {}
    for option in known:
        plain.setdefault(option.lower(), []).append(option)
    near = difflib.get_close_matches(str(name).lower(), plain, n=most, cutoff=cutoff)

    def apart(option: str) -> float:
        return -difflib.SequenceMatcher(a=option, b=str(name)).ratio()

    return [option for text in near for option in sorted(plain[text], key=apart)][:most]
