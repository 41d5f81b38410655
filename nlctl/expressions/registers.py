"""What a traced function writes into objects that were there before: its variables, or memory.

What is read as the last call left it is an unknown, a leaf of the graph.  Where nothing that the
function returns depends on such a leaf, each call computes the same, whatever was left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arrays import Tracer, leaf_vector, scalar
from .graph import Expr, Graph, Untraceable, needed

REAL_NUMBERS = (int, float, np.float64)
LEFT_OVER = "left"  # name of the array that the unknowns are read from, which no program has


@dataclass(frozen=True, eq=False)
class Register:
    """One field of an object, or all elements of a list or an array."""

    holder: Any
    name: str  # of the field; empty where elements are written
    title: str  # as it is written
    place: str = ""  # file and line

    @property
    def key(self) -> tuple[int, str]:
        """What it is known by."""
        return id(self.holder), self.name


class Kept:
    """What one way through a function has written so far, and what it has read of others."""

    def __init__(self, graph: Graph, registers: Sequence[Register] = ()) -> None:
        self.graph, self.registers = graph, {r.key: r for r in registers}
        self.values: dict[tuple[int, str], Any] = {}
        self.unknown: dict[tuple[int, str], tuple[int, Any]] = {}  # place of leaves, and their form
        self.forms: dict[tuple[int, str], set[Any]] = {}  # of what is written
        self.leaves = 0

    def begin(self) -> None:
        """Forget what another way has written, but for the form that it leaves lists in."""
        for key, value in self.values.items():
            if not key[1]:
                self.forms.setdefault(key, set()).add(_form(value))
        self.values = {}

    def has(self, holder: object, name: str = "") -> bool:
        """Whether it is a register."""
        return bool(self.registers) and (id(holder), name) in self.registers

    def holds(self, thing: object) -> bool:
        """Whether fields of an object are registers."""
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
            self.values[key] = self._left(key, getattr(holder, name, None))
        return self.values[key]

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
