"""What every part of a walk through functions shares: what was read, and how to walk further."""

from __future__ import annotations

import ast
import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import replace
from types import CellType, FunctionType
from typing import Any

import numpy as np

from ...expressions.registers import REAL_NUMBERS, Register, held_in
from ...expressions.source import source_file
from .captured import GONE, Captured, noted
from .registers import has_plain_fields, is_workspace, may_be_kept
from .values import (
    Given,
    Instance,
    KnownValue,
    Message,
    captured,
    handed_out_again,
    least_upper_bound,
    maybe_shared,
    was_there,
)

Registers = dict[tuple[int, str], tuple[Register, KnownValue]]
WORKSPACE = KnownValue(True, True)  # a list or an array of numbers


class Walk(ABC):
    """A walk through a function and all that it calls.

    Statements, expressions and calls that are known follow it from one function to the next; what
    they meet on the way is kept here.
    """

    def __init__(self, registers: Registers | None = None) -> None:
        # what is written into what was there before, and what is known of its values
        self.registers: Registers = {} if registers is None else registers
        self.learnt = False  # whether there is more of it than before the walk
        self.read: dict[tuple[int, str], Captured] = {}
        self.numba_differs: list[str] = []  # see `FunctionReading`
        self.messages: list[Message] = []
        self.keeps = 0  # how often a list or dict was given something that the call has not made
        self.caching = 0  # functions around, whose results are handed out again
        self.cached: list[Captured] = []  # what these read
        self.classes: dict[ast.AST, type] = {}  # by where a function defines them
        self.tuples: set[type] = set()  # named tuples whose properties and operators are walked
        self.objects: list[Instance] = []
        self.made: dict[tuple[Any, Any], KnownValue] = {}  # objects, by where they are made

    def captured(self, holder: object, name: str, value: object) -> KnownValue:
        """Return what is known of a value that is read from around a function, and note it."""
        of_numpy = isinstance(value, np.ndarray | np.generic)
        if value is np.float32 or (of_numpy and value.dtype == np.float32):
            self.numba_differs.append("float32")  # numba has doubles of it sooner than NumPy
        if self.caching:
            self.cached.append(Captured(holder, name, value))
        if (id(holder), name) in self.registers:
            return self.registers[id(holder), name][1]
        if (id(value), "") in self.registers:  # which one it is counts, not what is in it
            self.read[id(holder), name] = Captured(holder, name, value)
            return self.registers[id(value), ""][1]
        if (id(holder), name) not in self.read:
            self.read[id(holder), name] = noted(holder, name, value, self.registers)
        return captured(value)

    def writes(
        self, base: KnownValue, target: ast.Subscript | ast.Attribute, value: KnownValue,
        function: Callable[..., Any], key: Any = None,
    ) -> bool:  # fmt: skip
        """Note that a function writes into what was there before; return whether it may."""
        thing, place = base.known, f"{source_file(function)}, line {target.lineno}"
        if isinstance(target, ast.Subscript) and type(thing) is dict:
            keys = [key] if isinstance(key, str) else [k for k, v in thing.items() if _is_number(v)]
            title, fresh = ast.unparse(target.value), value.own and value.inside
            registers = [Register(thing, str(k), f"{title}['{k}']", place) for k in keys]
            return bool(keys) and fresh and all(self._written(r, value) for r in registers)
        if isinstance(target, ast.Subscript):
            return self._written(Register(thing, "", ast.unparse(target.value), place), value)
        setter = inspect.getattr_static(type(thing), target.attr, None)
        if not isinstance(setter, property) or not setter.fset or not was_there(thing):
            return self._written(Register(thing, target.attr, ast.unparse(target), place), value)
        self.captured(type(thing), target.attr, setter)
        self.call(captured(setter.fset), Given((base, value)))
        return True

    def _written(self, register: Register, value: KnownValue) -> bool:
        """Note that a field, or elements, are written; return whether they can be."""
        thing, name = register.holder, register.name
        before = held_in(thing, name, GONE) if name else thing
        if type(thing) is dict or isinstance(thing, CellType):
            is_key = type(thing) is dict and "__builtins__" not in thing  # and not a variable
            fits = is_key or _is_number(before) or is_workspace(before)
        else:
            fits = has_plain_fields(thing, name) if name else self._is_read(thing)
        if self.caching or not fits or not may_be_kept(value):
            return False
        before = 0.0 if before is GONE else before
        if isinstance(before, np.ndarray) and is_workspace(before):  # unknown numbers in a copy
            self._register(replace(register, holder=before, name=""), WORKSPACE)
            before = 0.0
        if name:
            kept = least_upper_bound([captured(before), value])
            self._register(register, replace(kept, known=WORKSPACE.known))
        elif isinstance(thing, list):
            self._register(register, replace(WORKSPACE, holds=True))
        return True

    def binds(
        self, holder: object, name: str, value: KnownValue, function: FunctionType, line: int
    ) -> bool:
        """Note that a function binds a variable around it; return whether it may."""
        place = f"{source_file(function)}, line {line}"
        return self._written(Register(holder, name, name, place), value)

    def _is_read(self, thing: object) -> bool:
        """Whether a list or an array of numbers was read from around the function, as it is."""
        is_read = any(note.now is thing for note in self.read.values())
        return is_read and is_workspace(thing)

    def lists_may_hold_others(self) -> None:
        """Note that lists that are registers hold what the call has not made."""
        for register, value in list(self.registers.values()):
            if value.holds and value.inside:
                self._register(register, maybe_shared(value))

    def first_call(self, function: KnownValue, given: Given) -> KnownValue:
        """Return what is known of a result that is handed out again by later calls."""
        self.caching += 1
        result = handed_out_again(self.call(function, given))
        self.caching -= 1
        return result

    def _register(self, register: Register, value: KnownValue) -> None:
        one, known = self.registers.get(register.key, (register, value))
        now = least_upper_bound([known, value])
        self.learnt |= register.key not in self.registers or now != known
        self.registers[register.key] = one, now

    def new_object(self, cls: type) -> Instance:
        """Return an object that the call has made, of which nothing is known yet."""
        self.objects.append(Instance(cls))
        return self.objects[-1]

    def made_once(self, place: tuple[Any, Any], result: KnownValue) -> KnownValue:
        """Return one object for all that a call makes in a loop, which is walked again."""
        if not isinstance(result.known, Instance):
            return result
        before = self.made.get(place)
        if before is not None and before.known.cls is result.known.cls:
            before.known.absorb(result.known)
            result = replace(result, known=before.known)
        self.made[place] = result
        return result

    def note(self, notes: Iterable[Captured]) -> None:
        """Keep notes of what a function or an object consists of."""
        for note in notes:
            self.read.setdefault((id(note.holder), note.name), note)

    @abstractmethod
    def call(self, function: KnownValue, given: Given) -> KnownValue:
        """Return what is known of the result of a call."""

    @abstractmethod
    def function(self, thing: FunctionType, given: Given) -> KnownValue:
        """Return what is known of the result of somebody's Python function."""


def _is_number(value: object) -> bool:
    return isinstance(value, REAL_NUMBERS)
