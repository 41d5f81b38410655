"""What is known of a value without running anything: whose it is, and which object if captured."""

from __future__ import annotations

import builtins
import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import EnumType, Flag
from types import FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ...upstream.numba_internals import CPUDispatcher


class Unknown:
    """Stands for an object that is only known when the function runs."""


@dataclass(frozen=True)
class Attributes(Unknown):
    """The dict of an object that the call has made: what is written into it is an attribute."""

    of: KnownValue


@dataclass(frozen=True)
class TextLike(Unknown):
    """A text that is only known when the function runs, and by what it is matched."""

    pattern: str

    @classmethod
    def of(cls, pattern: str) -> TextLike | None:
        """Return it by its pattern, None where that is too much to follow."""
        return cls(pattern) if len(pattern) <= _LONGEST else None


UNKNOWN_VALUE = Unknown()
MAYBE_NONE = Unknown()  # None, or something else
_RANKS = 32  # indices of an array, beyond which it is not followed
_LONGEST = 400  # characters of a pattern of texts
_CHOICES = 64  # functions in a list, beyond which it is too much to follow
PLAIN = (bool, int, float, complex, str, bytes, type(None), np.generic, slice)  # never change
_LIBRARIES = ("numpy", "scipy", "math", "cmath", "numba", "builtins", "operator", "_operator",
              "functools", "_functools", "itertools", "bisect", "_bisect", "control", "copy",
              "statistics", "fractions", "decimal", "pandas", "heapq", "_heapq", "json",
              "re")  # fmt: skip


class Impure(Exception):  # noqa: N818 (it is what a walk finds)
    """A function is not one of its arguments alone."""

    def __init__(self, reason: str, advice: str) -> None:
        super().__init__(reason)
        self.reason, self.advice = reason, advice  # what it does, and what to do instead
        self.place = ""  # file and line


class Message(Impure):
    """A call that writes a message: nothing is lost where no way of the expressions reaches it."""


@dataclass(frozen=True)
class Local:
    """A function that a walked function defines: its syntax tree, and the names around it."""

    node: Any
    frame: Any


@dataclass(frozen=True)
class OneOf:
    """One of several functions or objects, and which is only known when the function runs."""

    choices: tuple[KnownValue, ...]


@dataclass(frozen=True)
class ListOf:
    """A list, tuple or dict that the call has made of functions or objects."""

    choices: tuple[KnownValue, ...]


@dataclass(frozen=True)
class RowOf:
    """A tuple, in its order, of objects or functions and others, as `zip` makes them, too."""

    parts: tuple[KnownValue, ...]


@dataclass(frozen=True)
class Given:
    """The arguments of a call."""

    places: tuple[KnownValue, ...] = ()
    names: Mapping[str, KnownValue] = field(default_factory=dict)

    @property
    def every(self) -> tuple[KnownValue, ...]:
        """All of them."""
        return (*self.places, *self.names.values())

    def __hash__(self) -> int:
        return hash((self.every, *self.names))

    def __add__(self, more: Given) -> Given:
        return Given(self.places + more.places, {**self.names, **more.names})


@dataclass(frozen=True)
class Bound:
    """A function some of whose arguments are given: a method, a `functools.partial`."""

    function: KnownValue
    given: Given


@dataclass(frozen=True)
class Cached:
    """A function that the call has wrapped by `functools.lru_cache`: results come again."""

    function: KnownValue


@dataclass(frozen=True)
class Pure:
    """An object of a library that the call has made, such as a spline."""

    # whether what it is called with may come back, as from `operator.itemgetter`
    gives_parts: bool = False


class Instance:
    """An object of somebody's class that the call has made."""

    def __init__(self, cls: type) -> None:
        self.cls, self.version = cls, 0  # how often something new was learnt
        self.attributes: dict[str, KnownValue] = {}  # what is known of each, whenever written

    def __hash__(self) -> int:  # what has been computed with it counts until it learns more
        return hash((id(self), self.version))

    def learn(self, name: str, value: KnownValue) -> None:
        """Note that an attribute is written."""
        before = self.attributes.get(name)
        after = value if before is None else least_upper_bound([before, value])
        if before is None or before != after:
            self.attributes[name] = after
            self.version += 1

    def absorb(self, other: Instance) -> None:
        """Note that it may be another one."""
        for name, value in list(other.attributes.items()):
            self.learn(name, value)


@dataclass(frozen=True)
class Parent:
    """What ``super()`` is in a method of an object that the call has made."""

    own: KnownValue
    cls: type


@dataclass(frozen=True, eq=False)
class KnownValue:
    """What is known of a value."""

    own: bool  # whether this call has made it (or it can never change): it may be written to
    inside: bool  # whether the same holds for what it holds
    # whether it keeps what is put into it (lists, tuples, dicts), instead of copying numbers
    holds: bool = False
    known: Any = UNKNOWN_VALUE  # the object itself, if it was there before the call
    # of an array that it has not made, how many indices reach a number, at most: fewer reach
    # a view, through which the array is written into
    rank: int | None = None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KnownValue) and self.marks == other.marks

    def __hash__(self) -> int:
        return hash(self.marks)

    @property
    def marks(self) -> tuple[Any, ...]:
        """What two values must have in common to be equal: arrays have no other equality."""
        kinds = Local | OneOf | ListOf | RowOf | Bound | Cached | Pure | Instance | Parent
        kinds |= Attributes | ArraysOf | TextLike
        known = self.known if isinstance(self.known, kinds) else id(self.known)
        return self.own, self.inside, self.holds, self.rank, known


@dataclass(frozen=True)
class ArraysOf(Unknown):
    """A list or tuple that the call has made of numbers and arrays alone."""

    part: KnownValue
    count: int | None = None  # of a tuple that is written out


FRESH = KnownValue(True, True)
VECTOR = KnownValue(False, True, rank=1)  # numbers that belong to the caller
OUTSIDE = KnownValue(False, False, True)
SLICE = KnownValue(True, True, known=slice(None))


def captured(thing: object) -> KnownValue:
    """Return what is known of an object that was there before the call."""
    if isinstance(thing, (*PLAIN, Flag)):
        return KnownValue(True, True, known=thing)
    if isinstance(thing, np.ndarray):
        is_open = thing.dtype.hasobject or thing.dtype.names or isinstance(thing, np.matrix)
        return replace(view(OUTSIDE, None if is_open else thing.ndim), known=thing)
    numbers = isinstance(thing, tuple | list | dict | set | frozenset) and all(
        isinstance(v, PLAIN) for v in (thing.values() if isinstance(thing, dict) else thing)
    )
    return KnownValue(False, numbers, True, known=thing)


def least_upper_bound(values: Iterable[KnownValue]) -> KnownValue:
    """Return what holds for each of several values."""
    values = list(values) or [FRESH]
    slices = [v for v in values if isinstance(v.known, slice)]
    return KnownValue(  # what may be a slice or a number chooses what may be a view
        own=all(v.own for v in values) and len(slices) in (0, len(values)),
        inside=all(v.inside for v in values),
        holds=any(v.holds for v in values),
        known=_of_any(values),
        rank=greatest_rank(v for v in values if not v.own),
    )


def greatest_rank(values: Iterable[KnownValue]) -> int | None:
    """Return how many indices reach a number of each of several arrays."""
    ranks = [v.rank for v in values]
    known = [rank for rank in ranks if rank is not None]
    return max(known) if known and len(known) == len(ranks) else None


def view(value: KnownValue, rank: int | None) -> KnownValue:
    """Return what is known of a view of an array, a number of which so many indices reach."""
    if value.own:
        return replace(forgotten(value), holds=False)
    if rank is None or rank > _RANKS:
        return KnownValue(False, False)
    return KnownValue(False, rank <= 1, rank=max(rank, 0))


def _of_any(values: list[KnownValue]) -> Any:
    """Return the object that several values are, or the choice between functions."""
    first = values[0].known
    if all(v.known is first for v in values):
        return first
    if all(isinstance(v.known, slice) for v in values):
        return SLICE.known
    if all(isinstance(v.known, Instance) for v in values):
        if any(v.known.cls is not first.cls for v in values):
            return OneOf(tuple(values))
        for value in values[1:]:
            first.absorb(value.known)
        return first
    if all(isinstance(v.known, RowOf) and len(v.known.parts) == _width(first) for v in values):
        columns = zip(*(v.known.parts for v in values), strict=True)
        return RowOf(tuple(map(least_upper_bound, columns)))
    if all(isinstance(v.known, ArraysOf) for v in values):
        counts = {v.known.count for v in values}
        part = least_upper_bound(v.known.part for v in values)
        return ArraysOf(part, counts.pop() if len(counts) == 1 else None)
    if all(isinstance(v.known, ListOf) for v in values):
        return ListOf(tuple(dict.fromkeys(c for v in values for c in v.known.choices)))
    if all(isinstance(v.known, str | TextLike) for v in values):
        texts = (v.known for v in values)
        patterns = [re.escape(k) if isinstance(k, str) else k.pattern for k in texts]
        return TextLike.of("|".join(dict.fromkeys(patterns))) or UNKNOWN_VALUE
    choice = function_choice(values)
    is_open = any(v.known is None or v.known is MAYBE_NONE for v in values)
    return MAYBE_NONE if is_open and choice is UNKNOWN_VALUE else choice


def _width(row: Any) -> int:
    return len(row.parts) if isinstance(row, RowOf) else -1


def row(values: Sequence[KnownValue]) -> KnownValue:
    """Return what is known of a tuple of these."""
    held = holder(values)
    if isinstance(held.known, ArraysOf):
        held = replace(held, known=replace(held.known, count=len(values)))
    is_mixed = isinstance(held.known, Unknown) and any(
        isinstance(function_choice([v]), OneOf) or not (v.own or v.holds) for v in values
    )
    return replace(held, known=RowOf(tuple(values))) if is_mixed else held


def element(value: KnownValue) -> KnownValue:
    """Return what is known of an element, whichever it is."""
    known = value.known
    if value.rank is not None and not value.own:
        return view(value, value.rank - 1) if value.rank > 1 else FRESH
    if isinstance(known, ArraysOf):
        return known.part
    plain = KnownValue(value.inside, value.inside, value.holds)
    if isinstance(known, ListOf):
        return least_upper_bound(known.choices)
    if isinstance(known, OneOf):
        lists = [c for c in known.choices if isinstance(c.known, list | tuple)]
        inner = [element(c) for c in lists if c.known]  # of an empty one there is none
        if inner and len(lists) == len(known.choices):
            return replace(plain, known=_of_any(inner))
        return least_upper_bound([plain, *inner]) if inner else replace(plain, known=known)
    if isinstance(known, Pure):
        return replace(plain, known=known)
    if isinstance(known, list | tuple | EnumType) and known:
        return one_among(plain, known)
    if (library(type(known)) or "").startswith("pandas"):
        return replace(plain, inside=True, holds=False)  # numbers, or a column of these
    return plain


def one_among(value: KnownValue, parts: Iterable[Any]) -> KnownValue:
    """Return what is known of one of the parts of a list that was there before the call."""
    parts = list(parts)
    if parts and all(isinstance(part, slice) for part in parts):
        return SLICE
    if parts and all(isinstance(part, (*PLAIN, np.ndarray)) for part in parts):
        return forgotten(least_upper_bound(map(captured, parts)))
    return replace(value, known=choice_among(parts))


def choice_among(parts: Iterable[Any]) -> Any:
    """Return the choice between the parts of a list that was there before the call."""
    values = [captured(part) for part in parts]
    is_long = len(values) > _CHOICES
    if is_long and any(is_somebodys(v.known) for v in values):
        raise Impure(f"chooses among more than {_CHOICES} objects", "keep their numbers in arrays")
    if is_long or all(isinstance(v.known, (*PLAIN, np.ndarray)) for v in values):
        return UNKNOWN_VALUE
    return OneOf(tuple(values))


def holder(values: Iterable[KnownValue]) -> KnownValue:
    """Return what is known of a list or tuple of these."""
    values = list(values)
    known = function_choice(values)
    known = ListOf(tuple(values)) if isinstance(known, OneOf) else known
    is_index = any(isinstance(v.known, slice | None) or v.known is MAYBE_NONE for v in values)
    if known is UNKNOWN_VALUE and not is_index and not any(v.holds for v in values):
        known = ArraysOf(forgotten(least_upper_bound(values)))
    return KnownValue(True, all(v.own and v.inside for v in values), True, known)


def function_choice(values: Iterable[KnownValue]) -> Any:
    """Return the choice between functions or objects, and None; UNKNOWN between others."""
    values = tuple(values)
    kinds = Local | Bound | Cached | OneOf | ListOf | RowOf | Instance | Pure
    given = [v.known for v in values if v.known is not None]  # None is none of them
    if not given or not all(isinstance(k, kinds) or callable(k) or is_somebodys(k) for k in given):
        return UNKNOWN_VALUE
    flat = [c for v in values for c in (v.known.choices if isinstance(v.known, OneOf) else (v,))]
    return OneOf(tuple(dict.fromkeys(flat))) if len(flat) <= _CHOICES else UNKNOWN_VALUE


def is_somebodys(thing: object) -> bool:
    """Whether a thing that was there before the call is an object of somebody's class."""
    plain = (Unknown, *PLAIN, np.ndarray, list, tuple, dict, set, frozenset, range, ModuleType)
    return not isinstance(thing, plain) and library(type(thing)) is None


def was_there(thing: object) -> bool:
    """Whether a thing is an object of somebody's class that was there before the call."""
    kinds = Local | OneOf | ListOf | RowOf | Bound | Cached | Pure | Instance | Parent
    return is_somebodys(thing) and not isinstance(thing, kinds)


def is_one_of(thing: object, several: Iterable[object]) -> bool:
    """Whether a thing is one of several, without asking its class what is equal to it."""
    return any(thing is one for one in several)


def has_no_truth(thing: object) -> bool:
    """Whether a thing is true or false without code of somebody: None, a list, a plain object."""
    cls = thing.cls if isinstance(thing, Instance) else type(thing)
    if thing is None or isinstance(thing, ListOf | RowOf):
        return True
    is_plain = all(getattr(cls, name, None) is None for name in ("__bool__", "__len__"))
    return is_plain and (isinstance(thing, Instance) or was_there(thing))


def is_itself_alone(value: KnownValue) -> bool:
    """Whether a value is an object that was there before, and equal to itself alone."""
    every = value.known.choices if isinstance(value.known, OneOf) else (value,)
    return all(was_there(v.known) and type(v.known).__eq__ is object.__eq__ for v in every)


def maybe_shared(value: KnownValue) -> KnownValue:
    """Return what is known of a list that may have been given what the call has not made."""
    known = UNKNOWN_VALUE if isinstance(value.known, ArraysOf) else value.known
    return replace(value, inside=False, known=known)


def forgotten(value: KnownValue) -> KnownValue:
    """Return the same without the object: a part of it, or another view."""
    return replace(value, known=UNKNOWN_VALUE)


def handed_out_again(value: KnownValue) -> KnownValue:
    """Return what is known of a result that a cache hands out again: it outlives the call."""
    known = value.known if isinstance(value.known, (*PLAIN, Pure, FunctionType)) else UNKNOWN_VALUE
    return replace(value, own=False, inside=False, known=known)


def is_builtin(thing: object) -> bool:
    """Whether a function is one of Python's own."""
    name = getattr(thing, "__name__", "")
    return getattr(builtins, name, None) is thing if isinstance(name, str) else False


def library(thing: object) -> str | None:
    """Return the name of the well-known library that a function or class is from."""
    owner = getattr(thing, "__self__", None)
    module = getattr(thing, "__module__", None) or ""
    if isinstance(owner, ModuleType):
        module = owner.__name__
    elif isinstance(thing, np.ufunc):
        module = "numpy"
    elif isinstance(owner, type):
        module = module or owner.__module__  # `chain.from_iterable`, `dict.fromkeys`
    elif owner is not None:
        return None  # a method of some object
    return module if module.partition(".")[0] in _LIBRARIES else None


def python_function(thing: object) -> FunctionType | None:
    """Return the plain Python function that is called, without what it is bound to."""
    if isinstance(thing, CPUDispatcher):
        return thing.py_func
    if isinstance(thing, MethodType):
        return python_function(thing.__func__)
    if isinstance(thing, FunctionType):
        return thing
    call = inspect.getattr_static(type(thing), "__call__", None)
    return call if isinstance(call, FunctionType) else None
