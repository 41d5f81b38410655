"""What can be done with arrays of expressions: arithmetic, choices, sums, products.

These are the operators and methods of `Tracer`.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from .arrays import Tracer, as_array, concatenated, full, full_index, mapped, traced
from .graph import Ambiguous, Expr, Graph, Untraceable


def elementwise(graph: Graph, name: str, *operands: Any) -> Tracer:
    """Return an operation on arrays, element by element, with NumPy's broadcasting."""
    arrays = [traced(graph, v) for v in operands]
    longs = {(a.ndim - a.axis, a.length) for a in arrays if a.axis is not None}
    if len(longs) > 1:
        raise Untraceable(f"{name} of arrays that are long in different ways")
    ndim = len(np.broadcast_shapes(*(a.shape for a in arrays)))
    if not longs:
        return Tracer(graph, mapped(lambda *e: graph.op(name, *e), *(a.cells for a in arrays)))
    ((place, length),) = longs
    cells = [
        a.cells if a.axis is not None or a.ndim < place else a.cells.squeeze(a.ndim - place)
        for a in arrays
    ]
    return Tracer(graph, mapped(lambda *e: graph.op(name, *e), *cells), ndim - place, length)


def total(array: Tracer, axis: Any = None) -> Tracer:
    """Return the sum of all elements, or along an axis, from left to right."""
    graph, cells, long = array.graph, array.cells, array.axis
    along = range(array.ndim) if axis is None else [operator.index(axis) % array.ndim]
    if long in along:
        cells = mapped(lambda e: graph.sum(e, array.length), cells)
    short = [i - (long is not None and i > long) for i in along if i != long]
    for i in sorted(short, reverse=True):
        parts = np.moveaxis(cells, i, 0)
        cells = as_array(parts[0]) if len(parts) else as_array(graph.const(0.0))
        for part in parts[1:]:
            cells = mapped(lambda a, b: graph.op("add", a, b), cells, as_array(part))
    if long is None or long in along:
        return Tracer(graph, as_array(cells))
    return Tracer(graph, as_array(cells), long - sum(i < long for i in along), array.length)


def product(a: Tracer, b: Tracer) -> Tracer:
    """Return the matrix product of vectors and matrices."""
    if a.ndim == 0 or b.ndim == 0 or b.ndim > 2 or a.ndim > 2:
        raise Untraceable("a product of these shapes")
    if a.shape[-1] != b.shape[0]:
        raise Untraceable(f"a product of shapes {a.shape} and {b.shape}")
    if b.ndim == 2:
        a = a[..., None]
        return total(elementwise(a.graph, "mul", a, b), -2)
    return total(elementwise(a.graph, "mul", a, b), -1)


def _assign(self: Tracer, key: Any, value: Any) -> None:
    """Assign to items; what is assigned to a part of a long array goes into that."""
    value = traced(self.graph, value)
    _check_kinds(self, value)
    if self.watched is not None:
        raise Untraceable("assignment to another shape of an array")
    if self.origin is not None:
        _assign_to_part(self, key, value)
    elif self.axis is None:
        if value.axis is not None:
            raise Untraceable("a long array assigned to a short one")
        if isinstance(key, np.ndarray | list | Tracer):
            raise Untraceable("assignment to places in an array")
        self.cells[tuple(full_index(key, self.ndim))] = value.cells if value.shape else value.only
    else:
        if self.ndim > 1:
            raise Untraceable("assignment to a part of a large matrix")
        (along,) = full_index(key, 1)
        whole = range(self.length)
        k = None if isinstance(along, slice) else whole[along]
        _write(self, whole[along] if k is None else range(k, k + 1), value)


def _check_kinds(self: Tracer, value: Tracer) -> None:
    """Check that an assignment rounds nothing: arrays of truth values take no others."""
    kinds = {e.kind for e in self.values.flat}
    if kinds and "f" not in kinds and {e.kind for e in value.cells.flat} != kinds:
        raise Untraceable("assignment to an array of integers or truth values")


def _assign_to_part(self: Tracer, key: Any, value: Tracer) -> None:
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
    if places.step != 1 or value.ndim > 1:
        raise Untraceable("assignment with a step, or of another shape")
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


def _truth(self: Tracer) -> bool:
    if self.size != 1 or self.axis is not None:
        raise Untraceable("the truth value of an array")
    condition = self.graph.op("ne", self.only, self.graph.const(0.0))
    return self.graph.decided(self.only if self.only.kind == "b" else condition)


def _invert(self: Tracer) -> Tracer:
    """Return the negation of NumPy's truth values; of Python's own ~True is -2."""
    if any(e.kind != "b" for e in self.cells.flat):
        raise Untraceable("~ of numbers")
    if not all(map(_is_of_arrays, self.cells.flat)):
        raise Ambiguous("takes ~ of a truth value, and ~True is -2 in Python: write not")
    return elementwise(self.graph, "not", self)


def _is_of_arrays(condition: Expr) -> bool:
    """Whether a condition is one of NumPy's: it depends on states or inputs."""
    waiting = [condition]
    while waiting:
        expr = waiting.pop()
        if expr.op in ("call", "solve") or (expr.op == "leaf" and expr.data[0] in ("x", "u")):
            return True
        waiting.extend(expr.args)
    return False


def _integer(self: Tracer) -> int:
    if not _is_integer(self):
        raise Untraceable("an integer that depends on the state")
    return self.graph.assumed(self.only)


def _is_integer(value: Any) -> bool:
    return isinstance(value, Tracer) and value.size == 1 and value.only.kind == "i"


def _power(base: Any, exponent: Any) -> Any:
    """Return a power: with a whole exponent, known or assumed, as products."""
    exponent = _integer(exponent) if _is_integer(exponent) else exponent
    if isinstance(exponent, float) and exponent.is_integer():
        exponent = int(exponent)
    if isinstance(exponent, Tracer):
        return elementwise(exponent.graph, "power", base, exponent)
    if not isinstance(base, Tracer):
        return base**exponent
    if isinstance(exponent, int | np.integer) and abs(exponent) <= 64:
        cells = mapped(lambda e: base.graph.power(e, int(exponent)), base.cells)
        return Tracer(base.graph, cells, base.axis, base.length)
    return elementwise(base.graph, "power", base, exponent)


def _operator(name: str, swapped: bool = False) -> Callable[[Any, Any], Any]:
    def method(self: Tracer, other: Any) -> Any:
        if not isinstance(other, Tracer | np.ndarray | float | int | bool | np.generic):
            if name in ("eq", "ne"):
                raise Untraceable("comparison with what is not a number")  # Python would say False
            return NotImplemented  # a tuple is not an array
        return elementwise(self.graph, name, *((other, self) if swapped else (self, other)))

    return method


def _in_place(name: str) -> Callable[[Any, Any], Any]:
    def method(self: Tracer, other: Any) -> Any:
        result = elementwise(self.graph, name, self, other)
        if not self.shape:
            return result  # a number is not changed but replaced
        if result.shape != self.shape:
            raise Untraceable("assignment of another shape")
        _assign(self, slice(None), result)
        return self

    return method


_BINARY = {"add": "add", "sub": "sub", "mul": "mul", "truediv": "div", "mod": "remainder"}
for _name, _op in (_BINARY | {"and": "and", "or": "or", "xor": "xor"}).items():
    setattr(Tracer, f"__{_name}__", _operator(_op))
    setattr(Tracer, f"__r{_name}__", _operator(_op, swapped=True))
    setattr(Tracer, f"__i{_name}__", _in_place(_op))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Tracer, f"__{_name}__", _operator(_name))
for _name, _op in {"neg": "neg", "abs": "absolute"}.items():
    setattr(Tracer, f"__{_name}__", lambda self, op=_op: elementwise(self.graph, op, self))
for _name, _method in {
    "setitem": _assign,
    "invert": _invert,
    "bool": _truth,
    "index": _integer,
    "int": _integer,
    "pow": _power,
    "rpow": lambda self, other: _power(other, self),
    "floordiv": lambda self, other: operator.floordiv(_integer(self), other),
    "matmul": lambda self, other: product(self, traced(self.graph, other)),
    "rmatmul": lambda self, other: product(traced(self.graph, other), self),
}.items():
    setattr(Tracer, f"__{_name}__", _method)
Tracer.sum, Tracer.dot = total, Tracer.__matmul__  # type: ignore[attr-defined]
