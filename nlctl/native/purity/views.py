"""Whose memory arrays share: what is known of views, by indices and by functions of NumPy.

Through a view of an array of somebody that is written into, through a row of a view as well, but
not through a number of it.  So of each view it is known how many indices reach a number.
"""

import ast
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .values import (
    FRESH,
    MAYBE_NONE,
    OUTSIDE,
    ArraysOf,
    Given,
    KnownValue,
    Unknown,
    captured,
    element,
    forgotten,
    greatest_rank,
    least_upper_bound,
    view,
)

# functions and methods that may return part of what they are given, with as many indices or fewer
_OF_SAME_RANK = {"asarray", "asanyarray", "ascontiguousarray", "asfortranarray", "squeeze",
                 "transpose", "swapaxes", "moveaxis", "rollaxis", "diagonal", "diag", "flip",
                 "fliplr", "flipud", "rot90", "real", "imag", "real_if_close", "view",
                 "matrix_transpose", "permute_dims", "nan_to_num", "to_numpy", "require",
                 "asarray_chkfinite", "trim_zeros", "T", "mT", "astype", "array"}  # fmt: skip
_MORE = {"expand_dims": 1, "sliding_window_view": 1}  # indices more
_AT_LEAST = {"atleast_1d": 1, "atleast_2d": 2, "atleast_3d": 3}
_OF_SHAPE = ("reshape", "broadcast_to")
_FLAT = ("ravel", "flat", "frombuffer")
_UNKNOWN = ("asmatrix", "as_strided", "ndarray")
VIEWS = {*_OF_SAME_RANK, *_MORE, *_AT_LEAST, *_OF_SHAPE, *_FLAT, *_UNKNOWN} - {"array", "astype"}
_NO_OTHERS = Given()
LISTS_OF_VIEWS = {"broadcast_arrays", "split", "array_split", "hsplit", "vsplit", "dsplit",
                  "unstack", "meshgrid"}  # fmt: skip
_MEASURES = ("shape", "size", "ndim", "dtype", "itemsize", "nbytes", "strides")  # of an array


def viewed(name: str, base: KnownValue, how: Given = _NO_OTHERS) -> KnownValue:
    """Return what is known of what a function or a method of this name makes of an array."""
    listed = isinstance(base.known, list | tuple) or (base.own and base.holds)
    if listed or (name == "diag" and base.rank == 1):
        return FRESH  # a copy
    return view(base, _rank(name, base.rank, how) if base.rank is not None else None)


def viewed_by_function(name: str, given: Given) -> KnownValue:
    """Return what is known of the result of a function of NumPy that may be a view."""
    several = given.places if name in _AT_LEAST else ()
    if len(several) > 1:
        return views_of(name, [viewed(name, value) for value in several])
    if name == "ndarray" or not given.places:
        return viewed(name, least_upper_bound(given.every))
    return viewed(name, given.places[0], Given(given.places[1:2], given.names))


def _rank(name: str, rank: int, how: Given) -> int | None:
    """Return how many indices reach a number of a view of an array of this rank."""
    if name in _OF_SHAPE:
        return _count(how)
    if name in _MORE:
        more = _count(how)
        return None if more is None else rank + more
    if name in _UNKNOWN or (name == "view" and how.every):
        return None
    return 1 if name in _FLAT else max(rank, _AT_LEAST.get(name, 0))


def _count(how: Given) -> int | None:
    """Return how many numbers a shape has, or how many axes are named."""
    if len(how.places) > 1:
        return len(how.places)
    named = [v for k, v in how.names.items() if k in ("shape", "newshape", "axis")]
    known = [v.known for v in (*how.places, *named)]
    if len(known) != 1:
        return None
    if isinstance(known[0], int | np.integer):
        return 1
    if isinstance(known[0], ArraysOf):
        return known[0].count
    return len(known[0]) if isinstance(known[0], tuple) else None


def views_of(name: str, values: Sequence[KnownValue]) -> KnownValue:
    """Return what is known of a list of views of arrays, each of which is whose the array is."""
    if name == "unstack":
        values = [element(value) for value in values[:1]]
    elif name not in (*_AT_LEAST, "broadcast_arrays", "meshgrid"):  # of one array
        values = values[:1]
    if all(v.own for v in values):
        return KnownValue(True, all(v.inside for v in values), True)
    return KnownValue(True, False, True, known=ArraysOf(view(OUTSIDE, greatest_rank(values))))


def with_objects(given: Given) -> KnownValue | None:
    """Return what is known of an array of objects, which keeps what is put into it."""
    kinds = [v.known for v in (*given.places[1:], given.names.get("dtype", FRESH))]
    if not any(kind is object or (type(kind) is str and kind in ("O", "object")) for kind in kinds):
        return None
    return KnownValue(True, all(v.own and v.inside for v in given.every), True)


def is_array(value: KnownValue) -> bool:
    """Whether a value is an array or a number that the call has not made."""
    is_open = isinstance(value.known, Unknown) and not (value.own or value.holds)
    return is_open or isinstance(value.known, np.ndarray)


def attribute_of_array(base: KnownValue, name: str) -> KnownValue:
    """Return what is known of an attribute of an array: a view of it, or what it measures."""
    if name in _MEASURES:
        return FRESH
    return view(base, None) if name == "base" else viewed(name, base)


def indexed(
    base: KnownValue, indices: Sequence[ast.expr], values: Sequence[KnownValue]
) -> KnownValue:
    """Return what is known of what is reached by indices of an array, or of anything."""
    keys = [v.known for v in values]
    is_list = any(isinstance(index, ast.List) for index in indices)
    if not base.holds and (is_list or any(isinstance(key, np.ndarray | list) for key in keys)):
        return replace(forgotten(base), own=True, rank=None)  # a copy of these elements
    if isinstance(base.known, np.ndarray) and base.known.dtype.names and type(keys[0]) is str:
        return captured(base.known[keys[0]])
    is_view = any(isinstance(key, slice | type(None)) for key in keys)
    is_open = any(v.holds or (isinstance(v.known, Unknown) and not v.own) for v in values)
    is_open |= any(key is MAYBE_NONE for key in keys)
    if base.rank is None:
        return forgotten(base) if is_view or is_open else element(base)
    if is_open:  # one of them may be a tuple, and have new axes in it
        numbers = all(isinstance(key, ArraysOf) for key in keys)
        return forgotten(base) if numbers else view(base, None)
    rank = base.rank - sum(not isinstance(key, slice | type(None)) for key in keys)
    if rank > 0 or is_view:
        return view(base, rank + sum(key is None for key in keys))
    return FRESH
