"""What comes out of what goes through containers: `zip`, `enumerate`, all of itertools."""

from __future__ import annotations

import ast
import sys
from collections.abc import Sequence
from dataclasses import replace
from types import FunctionType
from typing import Any

import numpy as np

from .texts import is_text, joined
from .values import (
    FRESH,
    OUTSIDE,
    UNKNOWN_VALUE,
    ArraysOf,
    Bound,
    Cached,
    Given,
    Instance,
    KnownValue,
    ListOf,
    Local,
    OneOf,
    Pure,
    RowOf,
    Unknown,
    element,
    forgotten,
    function_choice,
    holder,
    least_upper_bound,
)
from .walk import Walk

# of itertools, what yields rows of what it is given; where it is of one thing in each place
_OF_ROWS = ("product", "permutations", "combinations", "combinations_with_replacement",
            "zip_longest", "pairwise", "batched", "tee", "groupby")  # fmt: skip
_ZIPPED = ("product", "zip_longest")
_OF_ONE = (list, tuple, set, frozenset, iter, reversed, sorted)


def _functions_in(given: Sequence[KnownValue]) -> Any:
    """Return the choice between the functions in what is gone through, for what calls one."""
    parts = [element(v) for v in given]
    kinds = OneOf | RowOf | Instance | Bound | Cached | Local | FunctionType
    functions = [v for v in parts if isinstance(v.known, kinds)]
    functions = [
        v if isinstance(v.known, OneOf | RowOf) else replace(v, known=OneOf((v,)))
        for v in functions
    ]
    return ListOf(tuple(functions)) if functions else UNKNOWN_VALUE


def rows_of_functions(thing: object, given: Sequence[KnownValue]) -> Any:
    """Return the rows of `zip` or `enumerate` where there are functions or objects in them."""
    kept = _functions_in(given)
    is_followed = any((v.own and v.inside) or v.rank is not None for v in given)
    is_mixed = is_followed and not all(v.inside for v in given)
    if thing in _OF_ONE and kept is UNKNOWN_VALUE and len(given) == 1:
        part = element(given[0])
        is_array = isinstance(part.known, Unknown | np.ndarray) and not part.holds
        return ArraysOf(forgotten(part)) if is_array else kept
    if not (isinstance(kept, ListOf) or is_mixed) or thing not in (zip, enumerate):
        return kept
    parts = tuple(map(element, given))
    parts = parts if thing is zip else (FRESH, parts[0])
    every = all(v.own and v.inside for v in parts)
    return ListOf((KnownValue(True, every, True, known=RowOf(parts)),))


def handed_on(module: str, name: str, places: Sequence[KnownValue]) -> KnownValue | None:
    """Return what is known of what Python's functions hand on of what they are given."""
    if (module, name) == ("copy", "copy") and places:
        return KnownValue(True, places[0].inside or not places[0].holds, places[0].holds)
    if (module, name) == ("builtins", "fromkeys"):
        return holder(places[1:])
    if (module, name) == ("builtins", "mappingproxy") and places:
        return replace(forgotten(places[0]), holds=True)
    if name == "getitem" and module in ("operator", "_operator"):
        return element(places[0])
    if name in ("nlargest", "nsmallest", "merge") and module in ("heapq", "_heapq"):
        return holder(map(element, places))
    if module != "itertools" or name == "count":
        return None
    parts = list(places[:1]) if name == "repeat" else list(map(element, places))
    if name == "from_iterable":
        parts = list(map(element, parts))
    held = holder([holder(parts)] if name in _OF_ROWS else parts)
    return replace(held, known=rows_of_functions(zip, places)) if name in _ZIPPED else held


def written_places(thing: object, name: str, given: Given) -> list[tuple[KnownValue, str]]:
    """Return the arguments that a function may write into, and by which of its own it does."""
    ways = [
        k for k, v in given.names.items() if k.startswith("overwrite_") and v.known is not False
    ]
    if ways:  # of SciPy: it takes their memory for its result
        return [(value, f"{ways[0]}=True") for value in given.places]
    begin = {"clip": 3, "dot": 2}.get(name, sys.maxsize)
    begin = thing.nin if isinstance(thing, np.ufunc) else begin
    return [(value, "out") for value in given.places[begin:]]


def holds_others(value: KnownValue) -> bool:
    """Whether a value is a list or dict that holds what the call has not made."""
    is_container = isinstance(value.known, list | tuple | dict) or (value.own and value.holds)
    return is_container and not value.inside


def result_of_plain(kind: type, values: Sequence[KnownValue]) -> KnownValue:
    """Return what is known of the result of an operator of numbers, arrays and containers."""
    if kind in (ast.Add, ast.Mult, ast.BitOr) and any(map(holds_others, values)):
        return KnownValue(True, False, True)  # a list or dict of what is in both
    if kind is ast.Add and values and all(map(is_text, values)):
        return joined(values)
    of_library = any(isinstance(v.known, Pure) for v in values)
    return KnownValue(True, True, known=Pure()) if of_library else FRESH


def result_of_reduce(walk: Walk, places: Sequence[KnownValue]) -> KnownValue:
    """Return what is known of what `functools.reduce` makes, which it hands on each time."""
    part, count = element(places[1]), 1
    if isinstance(places[1].known, ListOf | list | tuple):
        known = places[1].known
        count = len(known.choices if isinstance(known, ListOf) else known)
    results = [least_upper_bound([part, *places[2:]])]
    if not isinstance(function_choice(results), OneOf):  # numbers: whatever comes out of it
        return least_upper_bound([*results, walk.call(places[0], Given((OUTSIDE, part)))])
    for _ in range(count):  # functions of functions: each is made of those before
        results.append(walk.call(places[0], Given((results[-1], part))))
    return least_upper_bound(results)
