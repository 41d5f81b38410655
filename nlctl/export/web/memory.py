"""The memory of a run as data of a program: what integrators work on, laid out by the linker.

Integrators take the address of a table, in which 64-bit numbers are numbers or addresses of arrays
and of further tables (`nlctl.native.integrate.memory`).  Here each array and table becomes a global
of LLVM's IR, and each address in a table a reference to one: the linker has the last word on where
they are, and the memory of a process of 64 bits becomes that of a machine of 32.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from ...native.integrate.memory import type_of
from ...native.machine.address import data_address

_NUMBER = 8  # bytes of every number in a run's memory


def memory_text(
    records: Mapping[str, Any], functions: Mapping[str, tuple[str, ...]], filled: Collection[str]
) -> str:
    """Return the globals of records, each with its path as a name: ``task.rows.memory``.

    Arrays of addresses of functions have the names of these; what is filled where it runs is 0.
    """
    symbols: dict[int, str] = {}
    lines = []
    for path, array in _arrays(records):
        address = data_address(array)
        if address in symbols:
            lines.append(f"@{path} = alias i64, ptr @{symbols[address]}")
            continue
        symbols[address] = path
        if path in functions:
            lines.append(_table(path, [("function", name) for name in functions[path]]))
        else:
            lines.append(_numbers(path, array, zero=path in filled))
    for path, record in _records(records):
        lines.append(_table(path, list(_entries(path, record, symbols))))
    return "\n".join(lines) + "\n"


def places_in_table(record: Any, names: Collection[str]) -> dict[str, int]:
    """Return where fields begin in the table of a record, in bytes."""
    fields = list(type_of(type(record)).fields)
    return {name: record.table.strides[0] * fields.index(name) for name in names}


def _records(records: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield all records by their paths."""
    for path, record in records.items():
        yield path, record
        inner = {
            f"{path}.{name}": value
            for name, value in record._asdict().items()
            if hasattr(value, "_fields")
        }
        yield from _records(inner)


def _arrays(records: Mapping[str, Any]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield all arrays that have elements, by their paths."""
    for path, record in _records(records):
        for name, value in record._asdict().items():
            if name != "table" and isinstance(value, np.ndarray) and value.size:
                yield f"{path}.{name}", value


def _entries(path: str, record: Any, symbols: Mapping[int, str]) -> Iterator[tuple[str, Any]]:
    """Yield the numbers of a table: as they are, or what they are the address of."""
    fields = [name for name in record._fields if name != "table"]
    for name, row in zip(fields, record.table, strict=True):
        value = getattr(record, name)
        if hasattr(value, "_fields"):
            yield "address", f"{path}.{name}"
        elif isinstance(value, np.ndarray) and value.size:
            yield "address", symbols[data_address(value)]
        else:
            yield "number", int(row[0])
        yield from (("number", int(code)) for code in row[1:])


def _table(path: str, entries: list[tuple[str, Any]]) -> str:
    """Return a table as pairs of 32 bits, the lower ones first: an address has no more."""
    pairs = []
    for kind, what in entries:
        if kind == "number":
            low, high = what & 0xFFFFFFFF, what >> 32 & 0xFFFFFFFF
            pairs += [f"i32 {low}", f"i32 {high}"]
        else:
            pairs += [f"i32 ptrtoint (ptr @{what} to i32)", "i32 0"]
    return f"@{path} = global [{len(pairs)} x i32] [{', '.join(pairs)}], align 64"


def _numbers(path: str, array: np.ndarray, *, zero: bool) -> str:
    """Return an array by its bits."""
    bits = np.frombuffer(array.tobytes(), dtype=np.int64)
    kind = f"[{bits.size} x i64]"
    if zero or not bits.any():
        return f"@{path} = global {kind} zeroinitializer, align 64"
    values = ", ".join(f"i64 {value}" for value in bits.tolist())
    return f"@{path} = global {kind} [{values}], align 64"
