"""What is made of a record when it is first needed, and kept with the record.

A record that says what was read stays as it is.  What follows from it at some cost, such as machine
code, lies in a field of its own, by kinds of things; whoever makes a kind looks there first.
"""

import threading
from collections.abc import Callable
from typing import Any, TypeVar

_T = TypeVar("_T")


class Cache:
    """Things that have been made, by their classes."""

    def __init__(self) -> None:
        self._kept: dict[type, list[Any]] = {}
        self._once = threading.RLock()  # of several threads that need it one makes it

    def of(self, kind: type[_T]) -> list[_T]:
        """Return all things of a class; what is appended to the list is kept."""
        return self._kept.setdefault(kind, [])

    def found(self, kind: type[_T], fits: Callable[[_T], bool], make: Callable[[], _T]) -> _T:
        """Return the first thing of a class that fits; it is made if there is none."""
        with self._once:
            known = self.of(kind)
            for each in known:
                if fits(each):
                    return each
            known.append(make())
            return known[-1]
