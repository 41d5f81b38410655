"""Records of arrays and numbers as one argument of machine code: a pointer to a table.

A named tuple goes by value, seven or nine numbers an array, through every call and assignment.
With the forty arrays of an integration that was a third of what compiling cost, and half of the
time of a run.
"""

from __future__ import annotations

import functools
import math
from typing import Any

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

_INT = ir.IntType(64)
_LINE = 8  # floats in a line of the cache
_ENTRY = 5  # numbers in the table for each field: a number, or an address and up to four lengths


class Pointed(types.Type):
    """Type of a record: its fields' names and types, the table left out."""

    def __init__(self, fields: dict[str, Any]) -> None:
        self.fields = fields
        text = ", ".join(f"{name}: {kind}" for name, kind in fields.items())
        super().__init__(name=f"Pointed({text})")

    @functools.cached_property
    def formats(self) -> dict[str, tuple[np.dtype, int]]:
        """Data type and number of dimensions of each field."""
        return {
            name: (as_dtype(getattr(kind, "dtype", kind)), getattr(kind, "ndim", 0))
            for name, kind in self.fields.items()
        }


def type_of(value: Any) -> Pointed:
    """Return the type of a record that `with_table` has made, in machine code."""
    return Pointed({name: numba.typeof(getattr(value, name)) for name in _named(value)})


def with_table(record: Any, like: Any = None, **values: Any) -> Any:
    """Return a named tuple of these values; its table holds as long as it does.

    Its last field is ``table``, the others are C-contiguous arrays, floats and integers.

    Parameters
    ----------
    record : class
        Of named tuples.
    like : Pointed, optional
        What machine code takes it for.
    **values
        Its fields.

    Raises
    ------
    TypeError
        If a field has another type than machine code takes it for.
    ValueError
        If an array is not C-contiguous: the table has no strides.
    """
    for name, wanted in like.formats.items() if like else ():
        found = np.asarray(values[name])
        plain = found.dtype == object  # functions in the place of addresses, without JIT
        if (found.dtype, found.ndim) != wanted and not plain:
            raise TypeError(
                f"'{name}' of {record.__name__} needs {wanted[1]} dimensions of {wanted[0]}, got "
                f"{found.ndim} of {found.dtype}"
            )
    rows = []
    for name in _named(record):
        value = values[name]
        if isinstance(value, np.ndarray):
            if not value.flags.c_contiguous:
                raise ValueError(f"'{name}' of {record.__name__} needs a C-contiguous array")
            row = [value.ctypes.data, *value.shape]
        else:
            row = [int(np.asarray(value).view(np.int64))]  # a float's bits, or an integer
        rows.append(row + [0] * (_ENTRY - len(row)))
    return record(**values, table=np.array(rows, dtype=np.int64))


def zeros(shape: tuple[int, ...]) -> np.ndarray:
    """Return zeros that begin with a line of the cache, so that no SIMD register reads two."""
    size = math.prod(shape)
    whole = np.zeros(size + _LINE)
    first = -whole.ctypes.data // whole.itemsize % _LINE
    return whole[first : first + size].reshape(shape)


def _named(record: Any) -> tuple[str, ...]:
    return record._fields[:-1]


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
