"""Records of arrays and numbers as one argument of machine code: a pointer to a table.

A named tuple goes by value, seven or nine numbers an array, through every call and assignment.
With the forty arrays of an integration that was a third of what compiling cost, and half of the
time of a run.
"""

from __future__ import annotations

import functools
import math
import struct
from collections.abc import Iterator
from typing import Annotated, Any, get_origin, get_type_hints

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import lower_getattr_generic, models, register_model

from ...upstream.numba_internals import (
    AttributeTemplate,
    as_dtype,
    infer_getattr,
    pack_array,
    populate_array,
)
from ..machine.address import data_address

_INT = ir.IntType(64)
_LINE = 8  # floats in a line of the cache
_FLOAT, _BITS = struct.Struct("=d"), struct.Struct("=q")
_ENTRY = 5  # numbers in the table for each field: a number, or an address and up to four lengths


_REST = [(0,) * (_ENTRY - 1 - ndim) for ndim in range(_ENTRY)]  # of an entry

# arrays in a record: their data type and dimensions
Reals1 = Annotated[np.ndarray, np.float64, 1]
Reals2 = Annotated[np.ndarray, np.float64, 2]
Reals3 = Annotated[np.ndarray, np.float64, 3]
Reals4 = Annotated[np.ndarray, np.float64, 4]
Places1 = Annotated[np.ndarray, np.int64, 1]
Places2 = Annotated[np.ndarray, np.int64, 2]
Places3 = Annotated[np.ndarray, np.int64, 3]
Unsigned1 = Annotated[np.ndarray, np.uint64, 1]


class Pointed(types.Type):
    """Type of a record: its fields' names and types, the table left out."""

    def __init__(self, fields: dict[str, Any]) -> None:
        self.fields = fields
        text = ", ".join(f"{name}: {kind}" for name, kind in fields.items())
        super().__init__(name=f"Pointed({text})")

    @functools.cached_property
    def formats(self) -> dict[str, tuple[Any, int]]:
        """Data type, or the type of a record inside, and number of dimensions of each field."""
        return {
            name: (kind, 0)
            if isinstance(kind, Pointed)
            else (as_dtype(getattr(kind, "dtype", kind)), getattr(kind, "ndim", 0))
            for name, kind in self.fields.items()
        }


@functools.cache
def type_of(record: Any) -> Pointed:
    """Return the type of a class of records in machine code, as its fields are annotated."""
    hints = get_type_hints(record, include_extras=True)
    return Pointed({name: _kind(hints[name]) for name in record._fields[:-1]})


def _kind(hint: Any) -> Any:
    """Return the type of a field: a number, an array by its data type and dimensions, a record."""
    if get_origin(hint) is Annotated:
        dtype, ndim = hint.__metadata__
        return types.Array(numba.from_dtype(np.dtype(dtype)), ndim, "C")
    return {float: types.float64, int: types.int64}.get(hint) or type_of(hint)


def with_table(record: Any, **values: Any) -> Any:
    """Return a named tuple of these values; its table holds as long as it does."""
    # Its last field is ``table``, the others are C-contiguous arrays, floats, integers, and records
    # that this function has made.
    numbers: list[int] = []
    for name, (dtype, ndim) in type_of(record).formats.items():
        numbers.extend(_entry(record, name, values[name], dtype, ndim))
    return record(**values, table=np.array(numbers, dtype=np.int64).reshape(-1, _ENTRY))


def _entry(record: Any, name: str, value: Any, dtype: Any, ndim: int) -> tuple[int, ...]:
    """Return what a table has for a field."""
    if not isinstance(value, np.ndarray):
        return (_number(record, name, value), *_REST[0])
    if value.dtype != dtype or value.ndim != ndim:
        _check_format(record, name, value)
    if not value.flags.c_contiguous:
        raise ValueError(f"'{name}' of {record.__name__} needs a C-contiguous array")
    return (data_address(value), *value.shape, *_REST[ndim])


def _number(record: Any, name: str, value: Any) -> int:
    """Return what a table has for a number: a float's bits, an integer; for a record its table."""
    if hasattr(value, "_fields"):
        _check_format(record, name, value)
        return data_address(value.table)
    if type(value) is float and type_of(record).fields[name] is types.float64:
        return _BITS.unpack(_FLOAT.pack(value))[0]
    if type(value) is int and type_of(record).fields[name] is types.int64:
        return value
    _check_format(record, name, value)
    return int(np.asarray(value).view(np.int64))


def _check_format(record: Any, name: str, value: Any) -> None:
    """Refuse a field of another type than machine code takes it for."""
    wanted, plain = type_of(record).formats[name], False
    if hasattr(value, "_fields"):
        found: tuple[Any, int] = (type_of(type(value)), 0)
    else:
        array = np.asarray(value)
        found = (array.dtype, array.ndim)
        plain = array.dtype.hasobject  # functions instead of addresses, without JIT
    if found != wanted and not plain:
        raise TypeError(
            f"'{name}' of {record.__name__} needs {wanted[1]} dimensions of {wanted[0]}, got "
            f"{found[1]} of {found[0]}"
        )


def with_fields(record: Any, **changes: Any) -> Any:
    """Return a record with other values of some fields."""
    kind, table = type(record), record.table.copy()
    formats = type_of(kind).formats
    for name, value in changes.items():
        table[list(formats).index(name)] = _entry(kind, name, value, *formats[name])
    return record._replace(**changes, table=table)


def grown(record: Any, names: tuple[str, ...], room: int) -> Any:
    """Return a record with so many rows in some of its arrays; what they hold stays."""
    changes = {}
    for name in names:
        before = getattr(record, name)
        changes[name] = np.zeros((room, *before.shape[1:]), dtype=before.dtype)
        changes[name][: before.shape[0]] = before
    return with_fields(record, **changes)


def arrays_of(record: Any, **shapes: tuple[int, ...]) -> Any:
    """Return a record of zeros, of the types of its fields and of these shapes."""
    formats = type_of(record).formats
    made = {name: np.zeros(shape, dtype=formats[name][0]) for name, shape in shapes.items()}
    return with_table(record, **made)


def arrays_alike(record: Any, shape: tuple[int, ...], **others: tuple[int, ...]) -> Any:
    """Return a record of zeros of one shape, but for some of its fields."""
    return arrays_of(record, **dict.fromkeys(record._fields[:-1], shape) | others)


def named_arrays(
    record: Any, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], np.ndarray]]:
    """Yield the arrays of a record, and of those inside, with their names."""
    for name in record._fields[:-1]:
        value = getattr(record, name)
        if hasattr(value, "_fields"):
            yield from named_arrays(value, (*path, name))
        elif isinstance(value, np.ndarray):
            yield (*path, name), value


def zeros(shape: tuple[int, ...]) -> np.ndarray:
    """Return zeros that begin with a line of the cache, so that no SIMD register reads two."""
    size = math.prod(shape)
    whole = np.zeros(size + _LINE)
    first = -whole.ctypes.data // whole.itemsize % _LINE
    return whole[first : first + size].reshape(shape)


@register_model(Pointed)
class _PointedModel(models.PrimitiveModel):
    def __init__(self, manager, fe_type):
        super().__init__(manager, fe_type, _INT.as_pointer())


@infer_getattr
class _Attributes(AttributeTemplate):
    key = Pointed

    def generic_resolve(self, kind, name):
        return kind.fields.get(name)


@lower_getattr_generic(Pointed)
def _field(context, builder, kind, pointer, name):
    """Return a field as the table has it, which no machine code changes."""
    row, wanted = _ENTRY * list(kind.fields).index(name), kind.fields[name]
    unchanged = builder.module.add_metadata([])

    def number(i):
        found = builder.load(builder.gep(pointer, [_INT(row + i)]))
        found.set_metadata("invariant.load", unchanged)  # not to be read again after each store
        return found

    if isinstance(wanted, Pointed):
        return builder.inttoptr(number(0), context.get_value_type(wanted))
    if not isinstance(wanted, types.Array):
        return builder.bitcast(number(0), context.get_value_type(wanted))
    array = context.make_array(wanted)(context, builder)
    itemsize = context.get_abi_sizeof(context.get_data_type(wanted.dtype))
    shape = [number(1 + i) for i in range(wanted.ndim)]
    strides = [_INT(itemsize)]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    populate_array(
        array,
        data=builder.inttoptr(number(0), array.data.type),
        shape=pack_array(builder, shape),
        strides=pack_array(builder, strides),
        itemsize=_INT(itemsize),
        meminfo=None,  # the caller's record owns the memory
    )
    return array._getvalue()
