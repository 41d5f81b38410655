"""Values that functions read from around them, as they were when a diagram was compiled.

They are constants of machine code, and python-control reads them again at every call.  So each run
looks whether they are still what they were.
"""

from __future__ import annotations

import functools
from array import array
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, compress
from operator import getitem, is_, not_
from types import CellType, CodeType, FunctionType, MappingProxyType, MethodType
from typing import Any

import numpy as np

from ...expressions.registers import held_in
from .values import PLAIN


class _Gone:
    """What stands for a value where there is none."""

    def __repr__(self) -> str:
        return "absent"


GONE = _Gone()
_WRITTEN = object()  # stands for what the function itself writes
_Keys = Iterable[tuple[int, str]]
_SEQUENCES = (list, tuple, deque, bytearray, array)
_OF_PARTIALS = ("func", "args", "keywords")
_TABLES = ("scipy.interpolate", "scipy.spatial.transform", "scipy.sparse", "numpy.polynomial")


@dataclass(frozen=True)
class Captured:
    """One value."""

    holder: Any  # what it is read from: a closure's cell, a module's names, an object
    name: str  # name in the holder
    then: Any  # what it was: a copy, where it can change in place

    @property
    def now(self) -> Any:
        """What it is."""
        return held_in(self.holder, self.name, GONE)

    @property
    def title(self) -> str:
        """What a message calls it."""
        owner = self.holder if self.name.startswith("__") or self.name in _OF_PARTIALS else None
        if isinstance(owner, functools.partial):
            owner = owner.func
        name = getattr(owner, "__qualname__", "")
        return f"{name}.{self.name}" if name else self.name


def noted(holder: object, name: str, value: object, written: _Keys = ()) -> Captured:
    """Return the note of a value that has just been read, without what the function writes."""
    return Captured(holder, name, recorded(value, written))


def noted_function(function: FunctionType) -> Iterator[Captured]:
    """Yield notes of what a function is made of: reloading a module writes it into the old one."""
    for name in ("__code__", "__defaults__", "__kwdefaults__"):
        yield noted(function, name, getattr(function, name))


def noted_partial(given: functools.partial[Any]) -> Iterator[Captured]:
    """Yield notes of the arguments that a `functools.partial` has."""
    for name in _OF_PARTIALS:
        yield noted(given, name, getattr(given, name))


class CapturedValues:
    """Values that a program has as constants; most are seen at once to be the same objects."""

    def __init__(self, notes: Iterable[Captured]) -> None:
        every = tuple({(id(n.holder), n.name, id(n.then)): n for n in notes}.values())
        is_alike = [n.now is n.then is not GONE for n in every]
        self.notes, self.others = every, list(compress(every, map(not_, is_alike)))
        in_dict = [n for n in compress(every, is_alike) if type(n.holder) is dict]
        alike = [n for n in compress(every, is_alike) if type(n.holder) is not dict]
        in_cell = "cell_contents"
        names = [in_cell if isinstance(n.holder, CellType) else n.name for n in alike]
        self.attributes = [n.holder for n in alike], names
        self.items = [n.holder for n in in_dict], [n.name for n in in_dict]
        self.objects = [n.then for n in (*alike, *in_dict)]

    def changed(self) -> Captured | None:
        """Return the first value that is not what it was."""
        try:
            values = chain(map(getattr, *self.attributes), map(getitem, *self.items))
            alike = all(map(is_, values, self.objects))
        except (AttributeError, KeyError, ValueError):  # gone, or a cell that was emptied
            alike = False
        notes = self.others if alike else self.notes
        for note in notes:
            if (now := note.now) is not note.then and not same(now, note.then):
                return note
        return None


def recorded(value: Any, written: _Keys = ()) -> Any:
    """Return what a value is compared with: copies of arrays and containers, else itself."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, dict | MappingProxyType):
        held = {k: recorded(v, written) for k, v in value.items()}
        held |= {k: _WRITTEN for of, k in written if of == id(value)}
        return _Kept(type(value), tuple(held.items()))
    if isinstance(value, _SEQUENCES):
        return _Kept(type(value), tuple(recorded(v, written) for v in value))
    if isinstance(value, set | frozenset):
        return _Kept(type(value), frozenset(value))
    if isinstance(value, np.poly1d) or _is_of_tables(value):
        return _Content(value, {k: recorded(v) for k, v in _content(value).items()})
    return value.copy() if _is_table(value) else value


def _is_table(value: object) -> bool:
    return type(value).__module__.startswith("pandas") and hasattr(value, "equals")


@dataclass(frozen=True)
class _Kept:
    """What a container held; printed as it was."""

    kind: type
    held: Any

    def __repr__(self) -> str:
        if issubclass(self.kind, dict | MappingProxyType):
            return repr(dict(self.held))
        return repr(list(self.held) if self.kind is list else self.held)


@dataclass(frozen=True)
class _Content:
    """A spline, a table or a polynomial, and the arrays that it holds: they may be written."""

    thing: Any
    held: dict[str, Any]

    def __repr__(self) -> str:
        return f"{self.thing!r} with other content"


def _content(value: Any) -> dict[str, Any]:
    """Return the numbers and containers that an object of a library holds, and its parts."""
    plain = np.ndarray, tuple, list, *PLAIN  # or a part: SciPy 1.18 keeps numbers in one
    return {
        k: v for k, v in held_attributes(value).items() if isinstance(v, plain) or _is_of_tables(v)
    }


def _is_of_tables(value: Any) -> bool:
    return type(value).__module__.startswith(_TABLES)


def held_attributes(thing: object) -> dict[str, Any]:
    """Return the attributes that an object has itself, those in slots among them."""
    held = {name: getattr(thing, name) for name in _slots(type(thing)) if hasattr(thing, name)}
    return {**held, **getattr(thing, "__dict__", {})}


def _slots(kind: type) -> Iterator[str]:
    """Yield the names of slots as attributes have them."""
    for base in kind.__mro__:
        given = base.__dict__.get("__slots__", ())
        for name in (given,) if isinstance(given, str) else given:
            is_private = name.startswith("__") and not name.endswith("__")
            yield f"_{base.__name__.lstrip('_')}{name}" if is_private else name


def same(now: Any, then: Any) -> bool:
    """Whether a value is what was recorded."""
    if isinstance(then, _Content):
        held = _content(now) if now is then.thing else None
        return held is not None and all(same(held.get(k, GONE), v) for k, v in then.held.items())
    if isinstance(then, _Kept):
        return type(now) is then.kind and _same_held(now, then.held)
    if type(now) is not type(then):
        return False
    if isinstance(now, np.ndarray):
        alike = now.dtype == then.dtype and now.shape == then.shape
        if alike and isinstance(now, np.ma.MaskedArray):
            alike = np.array_equal(np.ma.getmaskarray(now), np.ma.getmaskarray(then))
        # bit by bit: NaN is itself, 0 is not -0, an object is not its equal
        return alike and np.asarray(now).tobytes() == np.asarray(then).tobytes()
    if isinstance(now, MethodType):  # a new one each time it is read
        return now.__func__ is then.__func__ and now.__self__ is then.__self__
    if now is then:
        return True
    if _is_table(now):
        return bool(now.equals(then))
    if isinstance(now, CodeType):
        return now == then
    return isinstance(now, PLAIN) and bool(now == then or (now != now and then != then))


def _same_held(now: Any, held: Any) -> bool:
    """Whether a container holds what it held."""
    if isinstance(now, dict | MappingProxyType):
        if not now.keys() <= dict(held).keys():
            return False
        return all(v is _WRITTEN or (k in now and same(now[k], v)) for k, v in held)
    if isinstance(now, set | frozenset):
        return frozenset(now) == held
    return len(now) == len(held) and all(map(same, now, held))
