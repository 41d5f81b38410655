"""What every part of a walk through functions shares: what was read, and how to walk further."""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod
from collections.abc import Iterable
from types import FunctionType
from typing import Any

from .captured import Captured, noted
from .values import Given, Instance, KnownValue, Message, captured


class Walk(ABC):
    """A walk through a function and all that it calls.

    Statements, expressions and calls that are known follow it from one function to the next; what
    they meet on the way is kept here.
    """

    def __init__(self) -> None:
        self.read: dict[tuple[int, str], Captured] = {}
        self.numba_differs: list[str] = []  # see `FunctionReading`
        self.messages: list[Message] = []
        self.keeps = 0  # how often a list or dict was given something that the call has not made
        self.classes: dict[ast.AST, type] = {}  # by where a function defines them
        self.tuples: set[type] = set()  # named tuples whose properties and operators are walked
        self.objects: list[Instance] = []
        self.made: dict[tuple[Any, Any], KnownValue] = {}  # objects, by where they are made

    def captured(self, holder: object, name: str, value: object) -> KnownValue:
        """Return what is known of a value that is read from around a function, and note it."""
        if (id(holder), name) not in self.read:
            self.read[id(holder), name] = noted(holder, name, value)
        return captured(value)

    def new_object(self, cls: type) -> Instance:
        """Return an object that the call has made, of which nothing is known yet."""
        self.objects.append(Instance(cls))
        return self.objects[-1]

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
