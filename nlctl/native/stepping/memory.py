"""All that a run knows in one piece of memory, so that it is kept and put back by one copy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..integrate.memory import data_address, with_fields

_LINE = 64  # bytes of a line of the cache
_SHOWN = {  # what a step fills and nothing reads later
    ("samples",),
    ("y",),
    ("log", "t"),
    ("log", "row"),
}


def in_one_piece(work: Any) -> tuple[Any, np.ndarray]:
    """Return a workspace with its arrays in one piece of memory, and that memory."""
    found = {path: a for path, a in _arrays(work) if a.size and path not in _SHOWN}
    places: dict[int, int] = {}  # arrays that are the same memory stay so
    size = 0
    for array in found.values():
        if data_address(array) not in places:
            places[data_address(array)] = size
            size += -(-array.nbytes // _LINE) * _LINE
    whole = np.zeros(size + _LINE, np.uint8)
    first = -whole.ctypes.data % _LINE
    memory = whole[first : first + size]
    views = {}
    for path, array in found.items():
        begin = places[data_address(array)]
        views[path] = memory[begin : begin + array.nbytes].view(array.dtype).reshape(array.shape)
        views[path][:] = array
    return _with_arrays(work, views), memory


def _arrays(record: Any, path: tuple[str, ...] = ()) -> Any:
    """Yield the arrays of a record, and of those inside, by their names."""
    for name in record._fields[:-1]:
        value = getattr(record, name)
        if hasattr(value, "_fields"):
            yield from _arrays(value, (*path, name))
        elif isinstance(value, np.ndarray):
            yield (*path, name), value


def _with_arrays(record: Any, views: dict[tuple[str, ...], np.ndarray]) -> Any:
    """Return a record with other arrays."""
    own = {path[0]: view for path, view in views.items() if len(path) == 1}
    for name in {path[0] for path in views if len(path) > 1}:
        inside = {path[1:]: view for path, view in views.items() if path[0] == name}
        own[name] = _with_arrays(getattr(record, name), inside)
    return with_fields(record, **own)
