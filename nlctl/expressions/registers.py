"""What a traced function writes into objects that were there before: its variables, or memory.

What is read as the last call left it is an unknown, a leaf of the graph.  Where nothing that the
function returns depends on such a leaf, each call computes the same, whatever was left.
"""

from __future__ import annotations

from collections.abc import (
    Callable,
    ItemsView,
    Iterable,
    Iterator,
    KeysView,
    Sequence,
    ValuesView,
)
from dataclasses import dataclass
from types import CellType
from typing import Any

import numpy as np

from .arrays import Special, Tracer, leaf_vector, scalar
from .graph import Expr, Graph, Untraceable, needed
from .source import in_cell

REAL_NUMBERS = (int, float, np.float64)
LEFT_OVER = "left"  # name of the array that the unknowns are read from, which no program has


@dataclass(frozen=True, eq=False)
class Register:
    """One field, value of a dict or variable; or all elements of a list or an array."""

    holder: Any  # an object, a dict, the names of a module, the cell of a closure
    name: str  # of the field, the key, the variable's; empty where elements are written
    title: str  # as it is written
    place: str = ""  # file and line

    @property
    def key(self) -> tuple[int, str]:
        """What it is known by."""
        return id(self.holder), self.name


def held_in(holder: Any, name: str, default: object = None) -> Any:
    """Return what a cell, a dict or an object holds under a name."""
    if isinstance(holder, CellType):
        return in_cell(holder, default)
    return holder.get(name, default) if type(holder) is dict else getattr(holder, name, default)


class Kept:
    """What one way through a function has written so far, and what it has read of others."""

    def __init__(self, graph: Graph, registers: Sequence[Register] = ()) -> None:
        self.graph, self.registers = graph, {r.key: r for r in registers}
        self.values: dict[tuple[int, str], Any] = {}
        self.unknown: dict[tuple[int, str], tuple[int, Any]] = {}  # place of leaves, and their form
        self.forms: dict[tuple[int, str], set[Any]] = {}  # of what is written
        self.variables: dict[tuple[int, str], Any] = {}  # where a traced function has each
        self.leaves = 0

    def begin(self) -> None:
        """Forget what another way has written, but for the form that it leaves lists in."""
        left = {k: v for k, v in self.values.items() if not k[1]}
        left |= {k: held_in(place, k[1]) for k, place in self.variables.items()}
        for key, value in left.items():
            self.forms.setdefault(key, set()).add(_form(value))
        self.values, self.variables = {}, {}

    def has(self, holder: object, name: str = "") -> bool:
        """Whether it is a register."""
        return bool(self.registers) and (id(holder), name) in self.registers

    def holds(self, thing: object) -> bool:
        """Whether fields of an object, or values of a dict, are registers."""
        return any(r.holder is thing for r in self.registers.values() if r.name)

    def write(self, holder: object, name: str, value: Any) -> None:
        """Keep what is written into a field."""
        if not self.has(holder, name):
            raise Untraceable("a function that changes an object")
        if self.graph.branches or self.graph.passing:
            raise Untraceable("a branch that changes an object")
        key = (id(holder), name)
        self.forms.setdefault(key, set()).add(_form(value))
        self.values[key] = value

    def read(self, holder: object, name: str) -> Any:
        """Return what a field was given in this call, or an unknown in the form of what it has."""
        key = (id(holder), name)
        if key not in self.values:
            self.values[key] = self._left(key, held_in(holder, name))
        return self.values[key]

    def variable(self, holder: object, name: str, place: object, value: Any) -> Any:
        """Return what a variable around a function is, whose copy has it at a place."""
        if not self.has(holder, name):
            return value
        self.variables[id(holder), name] = place
        return self.read(holder, name)

    def elements(self, thing: Any, plain: Callable[[Any], Any]) -> Any:
        """Return a list or an array whose elements are written: at first they are unknown."""
        if not self.has(thing):
            return plain(thing)
        key = (id(thing), "")
        if key not in self.values:
            self.values[key] = self._left(key, thing)
        return self.values[key]

    def _left(self, key: tuple[int, str], thing: Any) -> Any:
        if key[1] and isinstance(thing, np.ndarray) and self.has(thing):
            array = self.elements(thing, np.copy)
            self.unknown[key] = self.unknown[id(thing), ""]
            return array
        form = _form(thing)
        if form is None:
            title = self.registers[key].title
            raise Untraceable(f"it reads '{title}', which is not a number, before it writes it")
        count = int(np.prod(form[1]))
        start, _ = self.unknown.setdefault(key, (self.leaves, form))
        self.leaves = max(self.leaves, start + count)
        if form[0] == "number":
            return scalar(self.graph, self.graph.leaf(LEFT_OVER, start, None))
        array = leaf_vector(self.graph, LEFT_OVER, start, form[1])
        return [array[k] for k in range(count)] if form[0] == "list" else array

    def check(self, results: Iterable[Expr]) -> None:
        """Refuse what depends on what another call has left."""
        self.begin()
        self.ask(results)
        for key, (_, form) in self.unknown.items():
            if self.forms.get(key, {form}) != {form}:
                title = self.registers[key].title
                raise Untraceable(f"it leaves '{title}' in another form than it had")

    def ask(self, numbers: Iterable[Expr]) -> None:
        """Refuse numbers that another call has left, whose types are not known either."""
        if not self.unknown:
            return
        places = {n.data[1] for n in needed(numbers) if n.op == "leaf" and n.data[0] == LEFT_OVER}
        for key, (start, form) in self.unknown.items():
            if places.intersection(range(start, start + int(np.prod(form[1])))):
                title = self.registers[key].title
                raise Untraceable(f"it remembers '{title}' from one call to the next")


class Unread(Special):
    """Stands for a value of a dict that is to be read from what is kept."""


class Entries(dict[str, Any]):
    """A dict some of whose values the function writes; after a first call it may have more keys."""

    def __init__(self, kept: Kept, thing: dict[str, Any], plain: dict[str, Any]) -> None:
        written = [name for of, name in kept.registers if of == id(thing)]
        super().__init__(plain | {name: Unread() for name in written})
        self.kept, self.thing = kept, thing
        self.added = [name for name in written if name not in thing]

    def _ask(self) -> None:
        if self.added:
            raise Untraceable(f"it adds '{self.added[0]}' to a dict, and asks what is in it")

    def __getitem__(self, key: str) -> Any:
        value = super().__getitem__(key)
        return self.kept.read(self.thing, key) if isinstance(value, Unread) else value

    def __setitem__(self, key: str, value: Any) -> None:
        self.kept.write(self.thing, key, value)

    def __contains__(self, key: object) -> bool:
        self._ask()
        return super().__contains__(key)

    def __len__(self) -> int:
        self._ask()
        return super().__len__()

    def __iter__(self) -> Iterator[str]:  # with one of its own, Python copies it by its items
        self._ask()
        return super().__iter__()

    def __eq__(self, other: object) -> bool:
        return self.copy() == other

    def __ne__(self, other: object) -> bool:
        return self.copy() != other

    def keys(self) -> Any:
        """Return all keys: as of a dict, a view of what they are when it is read."""
        return KeysView(self)

    def get(self, key: str, default: object = None) -> Any:
        """Return the value of a key, or a default."""
        is_there = key in self
        return self[key] if is_there else default

    def values(self) -> Any:
        """Return all values, in a view."""
        return ValuesView(self)

    def items(self) -> Any:
        """Return all pairs, in a view."""
        return ItemsView(self)

    def copy(self) -> dict[str, Any]:
        """Return a dict of its own."""
        return dict(self.items())


def _form(value: Any) -> tuple[str, tuple[int, ...]] | None:
    """Return what kind of thing a value is, and its size; None if it is not of numbers."""
    if isinstance(value, Tracer):
        is_number = not value.shape and not value.is_array
        return ("number", ()) if is_number else ("array", value.shape)
    if type(value) in REAL_NUMBERS:
        return "number", ()
    if type(value) is np.ndarray and value.dtype == float and value.ndim:
        return "array", value.shape
    if type(value) is list and all(_form(v) == ("number", ()) for v in value):
        return "list", (len(value),)
    return None
