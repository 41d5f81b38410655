"""Parts of what is taken apart: by names, by a place, by a key."""

from __future__ import annotations

import inspect
from abc import ABCMeta
from collections.abc import Sequence
from dataclasses import replace
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from .texts import named_by
from .values import (
    OUTSIDE,
    PLAIN,
    UNKNOWN_VALUE,
    Impure,
    Instance,
    KnownValue,
    OneOf,
    RowOf,
    TextLike,
    Unknown,
    captured,
    choice_among,
    element,
    forgotten,
    least_upper_bound,
    library,
    one_among,
)


def part_at(value: KnownValue, i: int, count: int) -> KnownValue:
    """Return what is known of one part of what is taken apart."""
    known = value.known
    if isinstance(known, RowOf):
        return known.parts[i] if len(known.parts) == count else OUTSIDE
    choices = known.choices if isinstance(known, OneOf) else (value,)
    rows = [c.known for c in choices]
    if all(isinstance(row, list | tuple) and len(row) == count for row in rows):
        column = [row[i] for row in rows]
        if all(isinstance(part, (*PLAIN, np.ndarray)) for part in column):
            return one_among(element(value), column)
        return _any_of(column)
    return element(value)


def _any_of(parts: Sequence[Any]) -> KnownValue:
    """Return what is known of one of several things that were there before the call."""
    whole = least_upper_bound(map(captured, parts))
    is_open = isinstance(whole.known, Unknown)
    return replace(whole, known=choice_among(parts)) if is_open else whole


def part_of_row(base: KnownValue, key: Any) -> KnownValue:
    """Return what is known of a part of a row."""
    parts = base.known.parts
    if isinstance(key, slice):
        return forgotten(base)
    is_known = type(key) is int and -len(parts) <= key < len(parts)
    return parts[key] if is_known else least_upper_bound(parts)


def part_of_one(base: KnownValue, keys: Sequence[Any]) -> KnownValue:
    """Return what is known of an element of one of several lists, or of one of several dicts."""
    known = [choice.known for choice in base.known.choices]
    if all(isinstance(thing, dict) for thing in known):
        key, inside = keys[0], KnownValue(base.inside, base.inside, True)
        if len(keys) > 1 or not isinstance(key, PLAIN):
            return inside
        parts = [thing[key] for thing in known if key in thing]
        return _any_of(parts) if parts else inside
    return element(base) if all(isinstance(thing, list | tuple) for thing in known) else base


def names_read(
    base: KnownValue, name: KnownValue, *others: KnownValue
) -> tuple[list[str], tuple[KnownValue, ...]]:
    """Return which attributes `getattr` may read: the one that is named, or all or a default."""
    if isinstance(name.known, str):
        return [name.known], ()
    thing, text = base.known, name.known
    cls = thing.cls if isinstance(thing, Instance) else type(thing)
    holds_functions = isinstance(thing, ModuleType) or type(thing) in (type, ABCMeta)
    of_others = library(thing if holds_functions else cls) is not None
    if (
        isinstance(thing, Unknown | OneOf)
        or of_others
        or (holds_functions and not isinstance(text, TextLike))
    ):
        raise Impure("calls getattr() by a name that is only known when it runs", "write it")
    held = thing.attributes if isinstance(thing, Instance) else getattr(thing, "__dict__", {})
    names = sorted(n for n in {*held, *dir(thing if holds_functions else cls)} if n[:2] != "__")
    return named_by(names, text) if isinstance(text, TextLike) else names, others


def is_plain_attribute(thing: object, name: str) -> bool:
    """Whether reading an attribute of an object runs no code that could do anything."""
    if library(type(thing)) is not None or isinstance(thing, type | super):
        return True
    member = inspect.getattr_static(thing, name, UNKNOWN_VALUE)
    if member is getattr(thing, "__dict__", {}).get(name, UNKNOWN_VALUE) is not UNKNOWN_VALUE:
        return True  # its own is a plain value, whatever it is
    if member is UNKNOWN_VALUE:
        return getattr(type(thing), "__getattr__", None) in (None, dict.__getitem__, dict.get)
    simple = (FunctionType, staticmethod, classmethod)
    return (
        isinstance(member, simple)
        or not hasattr(type(member), "__get__")
        or (type(member).__name__ in ("member_descriptor", "_tuplegetter", "getset_descriptor"))
    )
