"""Whether a function is one of its arguments alone, found without calling it.

python-control calls the functions of a block in any order and any number of times.  One that
remembers, that changes what it was given, or that differs from call to call computes something
else in machine code.  So its syntax tree is walked, and the functions that it calls are walked
with it: for every value it is known whose it is.  What is not understood is refused.
"""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from types import FunctionType
from typing import Any

from ...expressions.registers import Register
from ...expressions.source import Definition, Unreadable, definition, source_file
from . import known_calls, made
from .captured import Captured, noted_function, noted_partial
from .expressions import Frame
from .registers import check_apart, refused_register
from .statements import CallWalker
from .values import (
    FRESH,
    OUTSIDE,
    Bound,
    Cached,
    Given,
    Impure,
    Instance,
    KnownValue,
    ListOf,
    Local,
    Message,
    OneOf,
    Pure,
    Unknown,
    captured,
    element,
    holder,
    least_upper_bound,
    python_function,
)
from .walk import Registers, Walk

_BUDGET = 400  # bodies that are walked for one function, before it is too much to follow


@dataclass(frozen=True, kw_only=True)
class FunctionReading:
    """What was found in a function and in all that it calls."""

    # what it reads from around it: constants, as long as they stay what they are
    captured: tuple[Captured, ...]
    # why numba would compute it differently: names that have no value on one of the ways there,
    # which are an error in Python and 0 in numba, "try", and the "text" of numbers
    numba_differs: tuple[str, ...]
    # where it writes messages: it may be computed from its expressions alone, which reach none
    messages: tuple[Message, ...]
    registers: tuple[Register, ...] = ()  # what it writes into what was there before


def check_pure(
    function: object, arguments: Sequence[KnownValue], *, may_write: bool = False
) -> FunctionReading:
    """Check that a function depends on its arguments alone and changes nothing."""
    # Only who traces it with what it writes into may let it write: whether it reads what another
    # call has left there is seen in no other way.
    plain = python_function(function)
    if plain is not None and inspect.isgeneratorfunction(plain):
        error = Impure("yields its values", "return them as a list")
        error.place = f"{source_file(plain)}, line {plain.__code__.co_firstlineno}"
        raise error
    walk = FunctionWalk()
    try:
        walk.call(captured(function), Given(tuple(arguments)))
        while walk.learnt:  # it may have read before what it writes later
            walk = FunctionWalk(walk.registers)
            walk.call(captured(function), Given(tuple(arguments)))
    except RecursionError:
        raise Impure("calls itself too deeply to be followed", "make it simpler") from None
    registers = tuple(register for register, _ in walk.registers.values())
    if registers and not may_write:
        raise refused_register(registers[0], "changes")
    check_apart(registers, walk.read.values(), is_same=True)
    check_apart(registers, walk.cached, is_same=False)
    return FunctionReading(
        captured=tuple(walk.read.values()), numba_differs=tuple(dict.fromkeys(walk.numba_differs)),
        messages=tuple(walk.messages), registers=registers,
    )  # fmt: skip


class FunctionWalk(Walk):
    """Walks a function and all that it calls, with what each kind of thing does when called."""

    def __init__(self, registers: Registers | None = None) -> None:
        super().__init__(registers)
        self.done: dict[Any, KnownValue] = {}
        self.keeping: set[Any] = set()  # of these, what puts something into lists
        self.walked: set[ast.AST] = set()  # functions inside others, while they are walked
        self.bodies = 0

    def call(self, function: KnownValue, given: Given) -> KnownValue:
        thing = function.known
        if isinstance(thing, Unknown):
            raise Impure("calls what is only known when it runs", "call a function by its name")
        if isinstance(thing, OneOf):
            choices = [choice for choice in thing.choices if choice.known is not None]
            return least_upper_bound([self.call(choice, given) for choice in choices])
        if isinstance(thing, ListOf):
            raise Impure("calls a list", "call what is in it")
        if isinstance(thing, Pure):
            if thing.gives_parts:
                return element(given.places[0]) if given.places else FRESH
            return KnownValue(True, function.inside, known=thing)
        if isinstance(thing, Bound):
            return self.call(thing.function, thing.given + given)
        if isinstance(thing, Cached):
            return self.first_call(thing.function, given)
        if isinstance(thing, Instance):
            return self.call(made.attribute(self, function, "__call__"), given)
        if isinstance(thing, Local):
            return self.body(thing.node, thing.frame.function, thing.frame, given)
        if isinstance(thing, functools.partial):
            self.note(noted_partial(thing))
            named = {k: captured(v) for k, v in thing.keywords.items()}
            first = Given(tuple(map(captured, thing.args)), named)
            return self.call(captured(thing.func), first + given)
        return known_calls.call(self, thing, given)

    def function(self, thing: FunctionType, given: Given) -> KnownValue:
        self.note(noted_function(thing))
        try:
            return self.body(definition(thing), thing, None, given)
        except Unreadable as error:
            reason = f"calls {thing.__qualname__}, and {error}"
            raise Impure(reason, error.advice) from None

    def body(
        self, node: Definition, function: FunctionType, parent: Frame | None, given: Given
    ) -> KnownValue:
        frame = Frame(_bound(node.args, function, parent, given), function, parent)
        self.bodies += 1
        if self.bodies > _BUDGET:
            raise Impure("calls too many functions to be followed", "make it simpler")
        if parent is not None:  # what it finds in the names around it may have changed
            if node in self.walked:
                return OUTSIDE  # it calls itself
            self.walked.add(node)
            result = CallWalker(self, frame).result(node)
            self.walked.discard(node)
            return result
        key = (node, function, self.caching > 0, *frame.names.items())
        if key not in self.done:
            before = self.keeps
            self.done[key] = OUTSIDE  # while it is being walked: it may call itself
            self.done[key] = CallWalker(self, frame).result(node)
            self.keeping |= {key} if self.keeps > before else set()
        elif key in self.keeping:
            self.keeps += 1
        return self.done[key]


def _bound(
    arguments: ast.arguments, function: FunctionType, parent: Frame | None, given: Given
) -> dict[str, KnownValue]:
    """Return the names of a call's arguments with their values."""
    places = [a.arg for a in arguments.posonlyargs + arguments.args]
    names = [*places, *(a.arg for a in arguments.kwonlyargs)]
    bound = dict.fromkeys(names, OUTSIDE)
    if parent is None:  # a function's own defaults are objects that outlive the call
        defaults = function.__defaults__ or ()
        ends = places[len(places) - len(defaults) :]
        bound |= {k: captured(v) for k, v in zip(ends, defaults, strict=True)}
        bound |= {k: captured(v) for k, v in (function.__kwdefaults__ or {}).items()}
    bound |= dict(zip(places, given.places, strict=False))
    bound |= {k: v for k, v in given.names.items() if k in names}
    if arguments.vararg:
        bound[arguments.vararg.arg] = holder(given.places[len(places) :])
    if arguments.kwarg:
        bound[arguments.kwarg.arg] = holder(v for k, v in given.names.items() if k not in names)
    return bound
