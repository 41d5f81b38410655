"""What is known of a value without running anything: whose it is, and which object if captured."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from dataclasses import dataclass, replace
from types import FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ...upstream.numba_internals import CPUDispatcher


class Unknown:
    """Stands for an object that is only known when the function runs."""


UNKNOWN_VALUE = Unknown()
PLAIN = (bool, int, float, complex, str, bytes, type(None), np.generic, slice)  # never change
_LIBRARIES = ("numpy", "scipy", "math", "cmath", "numba", "builtins", "operator", "_operator",
              "functools", "_functools", "itertools", "bisect", "_bisect", "control", "copy",
              "statistics")  # fmt: skip


class Impure(Exception):  # noqa: N818 (it is what a walk finds)
    """A function is not one of its arguments alone.

    Attributes
    ----------
    reason, advice : str
        What it does, and what to do instead.
    place : str
        File and line.
    """

    def __init__(self, reason: str, advice: str) -> None:
        super().__init__(reason)
        self.reason, self.advice, self.place = reason, advice, ""


@dataclass(frozen=True)
class Local:
    """A function that a walked function defines: its syntax tree, and the names around it."""

    node: Any
    frame: Any


@dataclass(frozen=True)
class OneOf:
    """One of several functions, and which is only known when the function runs."""

    choices: tuple[KnownValue, ...]


@dataclass(frozen=True, eq=False)
class KnownValue:
    """What is known of a value.

    Attributes
    ----------
    own : bool
        Whether this call has made it (or it can never change): it may be written to.
    inside : bool
        Whether the same holds for what it holds.
    holds : bool
        Whether it keeps what is put into it (lists, tuples, dicts), instead of copying numbers.
    known : object
        The object itself, if it was there before the call.
    """

    own: bool
    inside: bool
    holds: bool = False
    known: Any = UNKNOWN_VALUE

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KnownValue) and self.marks == other.marks

    def __hash__(self) -> int:
        return hash(self.marks)

    @property
    def marks(self) -> tuple[Any, ...]:
        """What two values must have in common to be equal: arrays have no other equality."""
        return self.own, self.inside, self.holds, id(self.known)


FRESH = KnownValue(True, True)
VECTOR = KnownValue(False, True)  # numbers that belong to the caller
OUTSIDE = KnownValue(False, False, True)
SLICE = KnownValue(True, True, known=slice(None))


def captured(thing: Any) -> KnownValue:
    """Return what is known of an object that was there before the call."""
    if isinstance(thing, PLAIN):
        return KnownValue(True, True, known=thing)
    if isinstance(thing, np.ndarray):
        return KnownValue(False, thing.ndim <= 1, known=thing)
    numbers = isinstance(thing, tuple) and all(isinstance(v, PLAIN) for v in thing)
    return KnownValue(False, numbers, True, known=thing)


def least_upper_bound(values: Iterable[KnownValue]) -> KnownValue:
    """Return what holds for each of several values."""
    values = list(values) or [FRESH]
    first = values[0]
    return KnownValue(
        own=all(v.own for v in values),
        inside=all(v.inside for v in values),
        holds=any(v.holds for v in values),
        known=first.known if all(v.known is first.known for v in values) else UNKNOWN_VALUE,
    )


def element(value: KnownValue) -> KnownValue:
    """Return what is known of an element, whichever it is."""
    return KnownValue(value.inside, value.inside, value.holds)


def holder(values: Iterable[KnownValue]) -> KnownValue:
    """Return what is known of a list or tuple of these."""
    values = list(values)
    known = function_choice(values)
    return KnownValue(True, all(v.own and v.inside for v in values), True, known)


def function_choice(values: Iterable[KnownValue]) -> Any:
    """Return the choice between functions; UNKNOWN where not all values are functions."""
    values = tuple(values)
    functions = all(callable(v.known) or isinstance(v.known, Local) for v in values)
    return OneOf(values) if values and functions else UNKNOWN_VALUE


def forgotten(value: KnownValue) -> KnownValue:
    """Return the same without the object: a part of it, or another view."""
    return replace(value, known=UNKNOWN_VALUE)


def library(thing: Any) -> str | None:
    """Return the name of the well-known library that a function or class is from."""
    owner = getattr(thing, "__self__", None)
    module = getattr(thing, "__module__", None) or ""
    if isinstance(owner, ModuleType):
        module = owner.__name__
    elif isinstance(thing, np.ufunc):
        module = "numpy"
    elif owner is not None and not isinstance(owner, type):
        return None  # a method of some object
    return module if module.partition(".")[0] in _LIBRARIES else None


def python_function(thing: Any) -> FunctionType | None:
    """Return the plain Python function that is called, without what it is bound to."""
    if isinstance(thing, CPUDispatcher):
        return thing.py_func
    if isinstance(thing, MethodType):
        return python_function(thing.__func__)
    if isinstance(thing, FunctionType):
        return thing
    call = inspect.getattr_static(type(thing), "__call__", None)
    return call if isinstance(call, FunctionType) else None
