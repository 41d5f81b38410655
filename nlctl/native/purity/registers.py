"""What a function writes into objects that were there before: fields, elements of lists and arrays.

A field that is written before it is read is a variable of the call, wherever it is kept.  One that
is read as the call before left it is memory, and python-control's integrators call a function
several times a step.  Which it is, the trace finds out: what was there before is an unknown in it,
and nothing that is returned may depend on one.
"""

from __future__ import annotations

import inspect
from collections.abc import ItemsView, Iterable, Iterator, KeysView, Mapping, Sequence, ValuesView
from types import BuiltinFunctionType, MappingProxyType, MethodWrapperType, SimpleNamespace
from typing import Any

import numpy as np

from ...expressions.registers import REAL_NUMBERS, Register
from .captured import GONE, Captured, held_attributes
from .values import PLAIN, Impure, KnownValue, OneOf, function_choice, library, was_there

_RULING = ("__setattr__", "__delattr__", "__getattribute__", "__getattr__")
_BOUND, _VIEWS = BuiltinFunctionType | MethodWrapperType, KeysView | ItemsView | ValuesView
_DEPTH = 3  # of lists in lists, and of objects of libraries, that are searched for arrays


REMEMBERS = (
    "integrators call it several times a step, in any order: make what it remembers a state of the "
    "block, of one with dt= where it is sampled"
)


def refused_register(register: Register, what: str) -> Impure:
    """Return why a function is not one of its arguments alone."""
    error = Impure(f"{what} '{register.title}'", REMEMBERS)
    error.place = register.place
    return error


def unfollowed(registers: Sequence[Register], why: str) -> Impure:
    """Return why a function that writes into what was there before is not written out."""
    named = [r for r in registers if f"'{r.title}'" in why]
    if not named or not why.startswith("it "):
        error = refused_register(registers[0], "writes into")
        error.advice = f"write to variables of its own, or as expressions what is none: {why}"
        return error
    error = refused_register(named[0], "")
    error.reason = why.removeprefix("it ")
    return error


def has_plain_fields(thing: object, name: str) -> bool:
    """Whether writing a field of an object that was there before does nothing else."""
    cls = type(thing)
    if cls is SimpleNamespace:
        return True
    if not was_there(thing) or isinstance(thing, type) or not hasattr(thing, "__dict__"):
        return False
    foreign = [c for c in cls.__mro__ if c is not object and library(c) is not None]
    ruling = [n for n in _RULING if inspect.getattr_static(cls, n, None) is not (
        inspect.getattr_static(object, n, None))]  # fmt: skip
    member = inspect.getattr_static(cls, name, None)
    return not foreign and not ruling and not hasattr(type(member), "__set__")


def may_be_kept(value: KnownValue) -> bool:
    """Whether a value is one of numbers, arrays and lists of these: no object, no function."""
    return not isinstance(function_choice([value]), OneOf)


def is_workspace(thing: object) -> bool:
    """Whether the elements of a list or an array are numbers that nobody else has a view of."""
    if type(thing) is np.ndarray:
        return thing.dtype == float and thing.base is None and thing.ndim > 0
    return type(thing) is list and all(type(v) in REAL_NUMBERS for v in thing)


def check_apart(registers: Sequence[Register], notes: Iterable[Captured], *, is_same: bool) -> None:
    """Check that nothing of what a function reads from around it is a register under other names.

    Within the function that writes them (`is_same`) one list or array is known by its identity.
    """
    by_key = {r.key: r for r in registers} | {(id(r.holder), "__dict__"): r for r in registers}
    for note in notes if registers else ():
        if (register := by_key.get((id(note.holder), note.name))) is not None:
            raise refused_register(register, "shares with another function what it writes into")
        whole, parts = note.now, list(_parts(note.now))
        for register in registers:
            if _is_other_name(register, note) or any(
                _are_one(register, v, is_same and (v is whole or type(v) is dict)) for v in parts
            ):
                raise refused_register(register, "knows under another name what it writes into")


def _is_other_name(register: Register, note: Captured) -> bool:
    """Whether a value is read from an object whose fields are written as values of a dict."""
    fields = getattr(note.holder, "__dict__", None)
    return fields is register.holder and note.name == register.name


def _are_one(register: Register, value: Any, is_known: bool) -> bool:
    """Whether writing a field, a value of a dict, a list or an array changes another thing."""
    space = register.holder
    if register.name and type(space) is dict:
        is_view = type(value) is MappingProxyType and value.keys() == space.keys()
        return is_view or (value is space and (not is_known or "__builtins__" in space))
    if register.name:
        return value is getattr(space, "__dict__", GONE)
    if value is space:
        return not is_known
    both = isinstance(value, np.ndarray) and isinstance(space, np.ndarray)
    return both and np.may_share_memory(value, space)


def _parts(value: Any, depth: int = _DEPTH) -> Iterator[Any]:
    """Yield a value, and what a list or an object of a library holds."""
    yield value
    if isinstance(value, _BOUND):  # `values.__getitem__`, `array.sum`
        yield from _parts(value.__self__, max(depth - 1, 0))
    if isinstance(value, memoryview):
        yield value.obj
    elif isinstance(value, _VIEWS):
        yield value.mapping
    if not depth or isinstance(value, (*PLAIN, np.ndarray, type)):
        return
    if isinstance(value, list | tuple | set | frozenset):
        inner: Iterable[Any] = value
    elif isinstance(value, Mapping):
        inner = value.values()
    elif library(type(value)) in (None, "builtins"):
        return
    else:
        inner = held_attributes(value).values()
    for part in inner:
        yield from _parts(part, depth - 1)
