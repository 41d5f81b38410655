"""What a value does by itself where it is computed with: no code of somebody that is not walked."""

import enum
from collections import ChainMap, Counter, OrderedDict, defaultdict, deque
from types import BuiltinFunctionType, SimpleNamespace

from .values import (
    Bound,
    Cached,
    Impure,
    Instance,
    KnownValue,
    ListOf,
    Local,
    OneOf,
    Pure,
    RowOf,
    Unknown,
    library,
)

MEMORY = "keep what it remembers in a state of the block"
HOLDERS = (deque, OrderedDict, Counter, SimpleNamespace, defaultdict, ChainMap)
_WITHOUT_CODE = (
    Unknown
    | Local
    | Bound
    | Cached
    | Pure
    | RowOf
    | enum.Enum
    | enum.EnumType
    | BuiltinFunctionType
)


def check_object(value: KnownValue, what: str) -> None:
    """Check that what a value does by itself is known: no iterator, no class of somebody."""
    thing = value.known
    if isinstance(thing, _WITHOUT_CODE) or type(thing) in HOLDERS:
        return
    if isinstance(thing, OneOf | ListOf):
        for choice in thing.choices:
            check_object(choice, what)
        return
    if isinstance(thing, Instance):
        if issubclass(thing.cls, tuple) and "__iter__" not in vars(thing.cls):
            return
        raise Impure(f"{what} an object of type {thing.cls.__name__}", "use arrays")
    if isinstance(thing, tuple) and hasattr(thing, "_fields"):
        return
    if not value.own and hasattr(type(thing), "__next__"):
        raise Impure(f"uses up {type(thing).__name__}, which it did not make", MEMORY)
    if library(type(thing)) is None:
        raise Impure(f"{what} an object of type {type(thing).__name__}", "use arrays")
