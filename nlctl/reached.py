"""What a function reaches: the names that its code reads, and what it finds around it."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from types import CellType, CodeType, FunctionType
from typing import Any


@functools.lru_cache(maxsize=4096)
def names_read(code: CodeType) -> tuple[str, ...]:
    """Return the names that a code object and those nested in it read, in a fixed order."""
    inside = (part for part in code.co_consts if isinstance(part, CodeType))
    return tuple(sorted({*code.co_names, *(name for part in inside for name in names_read(part))}))


def in_cell(cell: CellType, empty: object = None) -> Any:
    """Return what is in the cell of a closure, something else if it is not filled."""
    try:
        return cell.cell_contents
    except ValueError:
        return empty


def around(function: FunctionType, names: Iterable[str] | None = None) -> list[Any]:
    """Return what a function closes over, and globals: those of some names, or all it reads."""
    names = names_read(function.__code__) if names is None else names
    held = [in_cell(cell) for cell in function.__closure__ or ()]
    return held + [function.__globals__[name] for name in names if name in function.__globals__]
