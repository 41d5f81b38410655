"""What is made of a record when it is first needed, and kept with the record.

A record that says what was read stays as it is.  What follows from it at some cost, such as machine
code, lies in a field of its own, by kinds of things; whoever makes a kind looks there first.
"""

from __future__ import annotations

from typing import Any, TypeVar

_T = TypeVar("_T")


class Cache:
    """Things that have been made, by their classes."""

    def __init__(self) -> None:
        self._kept: dict[type, list[Any]] = {}

    def of(self, kind: type[_T]) -> list[_T]:
        """Return all things of a class; what is appended to the list is kept."""
        return self._kept.setdefault(kind, [])
