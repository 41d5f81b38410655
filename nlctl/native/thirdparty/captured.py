"""Values that functions read from around them, as they were when a diagram was compiled.

They are constants of machine code, and python-control reads them anew at every call.  So each run
looks whether they are still what they were.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from types import CellType
from typing import Any

import numpy as np

from .values import PLAIN

GONE = object()


@dataclass(frozen=True)
class Captured:
    """One value.

    Attributes
    ----------
    holder : cell, dict or object
        What it is read from: a closure's cell, a module's names, an object.
    name : str
        Name in the holder.
    then : object
        What it was: a copy, where it can change in place.
    """

    holder: Any
    name: str
    then: Any

    @property
    def now(self) -> Any:
        """What it is."""
        if isinstance(self.holder, CellType):
            try:
                return self.holder.cell_contents
            except ValueError:  # emptied
                return GONE
        if type(self.holder) is dict:
            return self.holder.get(self.name, GONE)
        return getattr(self.holder, self.name, GONE)


def noted(holder: Any, name: str, value: Any) -> Captured:
    """Return the note of a value that has just been read."""
    return Captured(holder, name, _snapshot(value))


def changed(values: Iterable[Captured]) -> Captured | None:
    """Return the first value that is not what it was."""
    return next((v for v in values if not _same(v.now, v.then)), None)


def _snapshot(value: Any) -> Any:
    """Return what a value is compared with: copies of arrays and containers, else itself."""
    if type(value) is np.ndarray:
        return value.copy()
    if type(value) in (list, tuple, set):
        return type(value)(map(_snapshot, value))
    if type(value) is dict:
        return {k: _snapshot(v) for k, v in value.items()}
    return value


def _same(now: Any, then: Any) -> bool:
    if now is then:
        return True
    if type(now) is not type(then):
        return False
    if type(now) is np.ndarray:
        alike = now.dtype == then.dtype and now.shape == then.shape
        return alike and np.array_equal(_bits(now), _bits(then))
    if type(now) in (list, tuple):
        return len(now) == len(then) and all(map(_same, now, then))
    if type(now) is dict:
        return now.keys() == then.keys() and all(_same(now[k], then[k]) for k in now)
    return isinstance(now, PLAIN) and bool(now == then or (now != now and then != then))


def _bits(array: np.ndarray) -> np.ndarray:
    """Return an array as integers: NaN is itself, and 0 is not -0."""
    flat = np.ascontiguousarray(array).reshape(-1)
    if flat.dtype == object:
        return np.array([id(value) for value in flat], dtype=np.int64)
    return flat.view(np.int64 if flat.itemsize == 8 else np.uint8)
