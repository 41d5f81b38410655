"""Reading and writing elements: at known places, by masks, and where an integer says.

These are the item operators of `Tracer`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .arrays import (
    Tracer,
    as_array,
    concatenated,
    full,
    full_index,
    holds_arrays,
    mapped,
    python_number,
    scalar,
    traced,
)
from .constants import constant_value
from .graph import Graph, Untraceable
from .many_pieces import at_place
from .masked import Masked, MaskedPlaces
from .operators import elementwise, integer_followed, integer_range, mapped_cells

GATHERED = 64  # places among which an integer may choose
_EXACT = 2.0**53  # below it integers are floats


def _item(self: Tracer, key: Any) -> Any:
    """Return elements; those of a mask, or at a place that the state decides, as choices."""
    self, key = self.there(), _settled(key)
    if isinstance(key, str) and key in self.labels:
        return self.item_at(self.labels[key])
    if isinstance(key, Tracer) and _is_mask(key):
        return Masked(self, key)
    if (
        isinstance(key, tuple)
        and key
        and _is_mask(key[0])
        and all(isinstance(k, int) for k in key[1:])
    ):
        return Masked(self[(slice(None), *key[1:])], key[0])
    if isinstance(key, Tracer) and key.shape:
        items = [_item(self, k) for k in key.short().reshape(-1)]
        return traced(self.graph, items).reshape(key.shape + self.shape[1:])
    place = _open_place(key)
    return self.item_at(key) if place is None else _gathered(self, key, place)


def _settled(key: object) -> Any:
    """Return an index with numbers for what is known."""
    if isinstance(key, MaskedPlaces):
        return _settled(key.mask)
    if isinstance(key, tuple) and len(key) == 1 and isinstance(key[0], MaskedPlaces):
        return _settled(key[0].mask)
    if isinstance(key, tuple):
        return tuple(map(_settled, key))
    if isinstance(key, list) and any(isinstance(k, Tracer) for k in key):
        return [_settled(k) for k in key]
    if not isinstance(key, Tracer):
        return key
    kinds = {e.kind for e in key.values.flat}
    if kinds <= {"i", "b"} and all(e.op == "const" for e in key.values.flat):
        numbers = mapped(lambda e: bool(e.data) if e.kind == "b" else e.value, key.elements())
        return numbers.astype(bool if kinds == {"b"} else int)[()]
    return key


def _is_mask(key: object) -> bool:
    return isinstance(key, Tracer) and {e.kind for e in key.values.flat} == {"b"}


def _open_place(key: object) -> int | None:
    """Return which part of an index is an integer that the state decides."""
    keys = key if isinstance(key, tuple) else (key,)
    for i, k in enumerate(keys):
        if isinstance(k, Tracer) and k.shape:
            raise Untraceable("indexing by an array that depends on the state")
        if isinstance(k, Tracer) and k.only.kind == "i" and k.only.value is None:
            return i
    return None


def _with(key: object, place: int, index: int | slice) -> Any:
    """Return an index with another one in one place."""
    if not isinstance(key, tuple):
        return index
    return (*key[:place], index, *key[place + 1 :])


def _candidates(self: Tracer, key: Any, place: int) -> tuple[Tracer, range]:
    """Return an integer in an index, and the places that it may name; beyond is an error."""
    keys = key if isinstance(key, tuple) else (key,)
    if any(k is None or k is ... for k in keys):
        raise Untraceable("new axes next to an integer that depends on the state")
    return keys[place], _places_of(self.graph, keys[place], self.shape[place])


def _places_of(graph: Graph, chosen: Tracer, length: int) -> range:
    """Return the places of a row that an integer may name; beyond is an error."""
    low, high = integer_range(chosen.only)
    first, last = max(low, -length), min(high, length - 1)
    if first > last:
        raise Untraceable("an integer that names no place")
    guard(graph, chosen, "ge", first, low)
    guard(graph, chosen, "le", last, high)
    return range(int(first), int(last) + 1)


def guard(graph: Graph, chosen: Tracer, name: str, bound: float, possible: float) -> None:
    """Note that Python raises an error beyond a bound, unless that is never reached."""
    if bound != possible:
        graph.guard(elementwise(graph, name, chosen, bound).only, IndexError)


def _gathered(self: Tracer, key: object, place: int) -> Any:
    chosen, places = _candidates(self, key, place)
    if len(places) > GATHERED:
        return _looked_up(self, key, place, chosen)
    choice = _item(self, _with(key, place, places[-1]))
    for k in reversed(places[:-1]):
        here = elementwise(self.graph, "eq", chosen, k)
        choice = elementwise(self.graph, "select", here, _item(self, _with(key, place, k)), choice)
    return choice


def _looked_up(self: Tracer, key: object, place: int, chosen: Tracer) -> Any:
    """Return the item at a place of a long table of numbers."""
    numbers, graph = constant_value(_item(self, _with(key, place, slice(None)))), self.graph
    k = elementwise(graph, "select", elementwise(graph, "lt", chosen, 0),
                    elementwise(graph, "add", chosen, self.shape[place]), chosen)  # fmt: skip
    if isinstance(numbers, Tracer) and numbers.ndim == 1 and numbers.values.flat[0].kind == "f":
        return scalar(graph, at_place(graph, k, numbers))
    if isinstance(numbers, Tracer) or numbers.dtype == bool:
        raise Untraceable("an integer that may name too many places")
    axis = sum(not isinstance(k, int) for k in key[:place]) if isinstance(key, tuple) else 0
    rows = np.moveaxis(numbers, axis, -1)
    cells = np.empty(rows.shape[:-1], dtype=object)
    for index in np.ndindex(cells.shape):
        cells[index] = at_place(graph, k, rows[index])
    return Tracer(graph, cells)


def item_at(graph: Graph, whole: Any, key: object) -> Any:
    """Return what Python finds at a key; of numbers, and NumPy's, what expressions choose."""
    keys = key if isinstance(key, tuple) else (key,)
    if not any(isinstance(k, Tracer) for k in keys):
        return whole[key]
    if type(whole) in (list, tuple):
        return _of_list(graph, whole, key)
    return (traced(graph, whole) if type(whole) is np.ndarray else whole)[key]


def _of_list(graph: Graph, whole: Any, key: Any) -> Any:
    """Return an element of a list: a choice of numbers of one type, or the way of each element."""
    types = {v.only.kind if isinstance(v, Tracer) and not v.shape else type(v) for v in whole}
    if types <= {"f", float}:
        return traced(graph, whole)[key]
    if types in ({int}, {np.float64}) and max(map(abs, whole)) < _EXACT:
        element = traced(graph, np.array(whole))[key]
        return python_number(graph, element.only) if types == {int} else element
    if not isinstance(key, Tracer) or _open_place(key) is None:
        return whole[key]
    places = _places_of(graph, key, len(whole))
    return whole[integer_followed(key, places[0], places[-1])]


def _scattered(self: Tracer, key: object, place: int, value: object) -> None:
    chosen, places = _candidates(self, key, place)
    if len(places) > GATHERED:
        raise Untraceable("an integer that may name too many places")
    for k in places:
        here = elementwise(self.graph, "eq", chosen, k)
        at = _with(key, place, k)
        old = _item(self, at)
        new = traced(self.graph, value)
        _assign(self, at, elementwise(self.graph, "select", here, new, old))


def _masked(self: Tracer, mask: Tracer, value: Any) -> None:
    """Assign where a mask holds."""
    if isinstance(value, Masked):
        value = value.whole_for(mask)
    elif np.ndim(value) if not isinstance(value, Tracer) else value.shape:
        raise Untraceable("an array assigned to the places of a mask")
    if mask.shape != self.shape[: mask.ndim]:
        raise Untraceable("a mask of another shape")
    mask = mask.reshape(mask.shape + (1,) * (self.ndim - mask.ndim))
    chosen = elementwise(self.graph, "select", mask, value, self)
    _assign(self, ..., chosen)


def _assign(self: Tracer, key: Any, value: object) -> None:
    """Assign to items; what is assigned to a part of a long array goes into that."""
    key = _settled(key)
    if _is_mask(key):
        return _masked(self, key, value)
    if isinstance(key, Tracer) and key.shape:
        value = traced(self.graph, value)
        for i, k in enumerate(key):
            _assign(self, k, value[i] if value.shape else value)
        return None
    place = _open_place(key)
    if place is not None:
        return _scattered(self, key, place, value)
    value = _in_its_kind(self, traced(self.graph, value))
    if self.watched:
        raise Untraceable("assignment to another shape of an array")
    if holds_arrays(key):
        return _assign_at(self, key, value)
    if self.origin is not None:
        return _assign_to_part(self, key, value)
    if self.ndim > 1:
        _keep_elements(self)
    if self.axis is None:
        cells = value.elements()
        if value.axis is None and not cells.shape:
            cells = value.only
        self.cells[tuple(full_index(key, self.ndim))] = cells
        return None
    (along,) = full_index(key, 1)
    whole = range(self.length)
    k = None if isinstance(along, slice) else whole[along]
    _write(self, whole[along] if k is None else range(k, k + 1), value)
    return None


def _keep_elements(self: Tracer) -> None:
    """Keep the elements of a large matrix individually; parts that were read before are stale."""
    if self.axis is not None:
        self.values, self.axis, self.length = self.elements(), None, 1
        self.version += 1


def _assign_at(self: Tracer, key: Any, value: Tracer) -> None:
    """Assign to places that an array of integers or truth values names."""
    if self.origin is not None:
        raise Untraceable("assignment to places in a part of a long array")
    cells = self.elements()
    cells[key] = value.elements() if value.shape else value.only
    if self.axis is not None and self.ndim > 1:
        self.values, self.axis, self.length, self.version = cells, None, 1, self.version + 1
    elif self.axis is not None:
        joined = self.graph.joined([(e, 1) for e in cells])
        self.values, self.version = as_array(joined), self.version + 1


def _in_its_kind(self: Tracer, value: Tracer) -> Tracer:
    """Return a value as an array takes it: one of floats as floats, others take no others."""
    kinds, given = ({e.kind for e in array.cells.flat} for array in (self, value))
    if kinds == {"f"} and given != kinds:
        return mapped_cells(value, self.graph.number)
    if kinds and "f" not in kinds and given != kinds:
        raise Untraceable("assignment to an array of integers or truth values")
    return value


def _assign_to_part(self: Tracer, key: object, value: Tracer) -> None:
    assert self.origin is not None
    _ = self.cells  # is it still what the whole has there?
    (along,) = full_index(key, self.ndim) if self.ndim == 1 else (None,)
    if self.place is None or self.place.step != 1 or along is None:
        raise Untraceable("assignment to a part of a long array")
    k = None if isinstance(along, slice) else self.place[along]
    root = self.origin[0]
    _write(root, self.place[along] if k is None else range(k, k + 1), value)
    start, stop = self.place.start, self.place.stop
    renewed = root[start:stop]
    self.values, self.origin = renewed.values, renewed.origin


def _write(whole: Tracer, places: range, value: Tracer) -> None:
    """Assign to consecutive elements of a long array of one dimension."""
    if value.ndim > 1:
        raise Untraceable("assignment of another shape")
    if places.step != 1:
        return _assign_at(whole, list(places), value)
    if not value.shape or value.shape == (1,):
        middle = full(whole.graph, (len(places),), value.reshape(1)[0])
    elif value.size == len(places):
        middle = value
    else:
        raise Untraceable("assignment of another shape")
    before, after = whole[: places.start], whole[places.stop :]
    parts = [p for p in (before, middle, after) if p.size]
    joined = concatenated(whole.graph, parts)
    if joined.shape != whole.shape:
        raise Untraceable("assignment of another shape")
    whole.values, whole.version = joined.cells, whole.version + 1


Tracer.__getitem__ = _item  # type: ignore[attr-defined]
Tracer.__setitem__ = _assign  # type: ignore[attr-defined]
