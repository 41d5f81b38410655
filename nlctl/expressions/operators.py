"""What can be done with arrays of expressions: arithmetic, choices, sums, products.

These are the operators and methods of `Tracer`.
"""

from __future__ import annotations

import math
import operator
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from .arrays import (
    Special,
    Tracer,
    as_array,
    asked_by_enum,
    is_complex,
    mapped,
    python_number,
    scalar,
    traced,
)
from .graph import Ambiguous, Expr, Graph, Namespace, Untraceable, needed
from .integers import shifted, with_bits
from .promoted import is_numpys, widened

_Range = tuple[float, float]
_EVERYTHING = (-math.inf, math.inf)


def integer_range(expr: Expr) -> _Range:
    """Return bounds of a number, infinite where none is known."""
    ranges: dict[Expr, _Range] = {}
    waiting = [expr]
    while waiting:
        node = waiting[-1]
        missing = [arg for arg in node.args if arg not in ranges and node.kind != "b"]
        if missing:
            waiting += missing
        else:
            ranges[node] = (0.0, 1.0) if node.kind == "b" else _of_node(node, ranges)
            waiting.pop()
    return ranges[expr]


def _of_node(node: Expr, ranges: dict[Expr, _Range]) -> _Range:
    if node.op == "const":
        return float(node.data), float(node.data)
    if node.value is not None:
        return float(node.value), float(node.value)
    parts = [ranges[arg] for arg in node.args]
    if node.op == "select":
        parts = [_where(node, i, part, ranges) for i, part in enumerate(parts)]
        return min(parts[1][0], parts[2][0]), max(parts[1][1], parts[2][1])
    if node.op == "remainder" and parts[1][0] == parts[1][1] > 0:
        return 0.0, parts[1][0] - (1.0 if node.kind == "i" else 0.0)
    return _RULES[node.op](*parts) if node.op in _RULES else _EVERYTHING


_ABOVE = {"gt": True, "ge": True, "lt": False, "le": False}


def _where(node: Expr, place: int, within: _Range, ranges: dict[Expr, _Range]) -> _Range:
    """Return bounds of what a choice takes where it does so because of its size."""
    condition, (low, high) = node.args[0], within
    if condition.op not in _ABOVE or node.args[place] not in condition.args:
        return within
    is_left = node.args[place] is condition.args[0]
    limit = condition.args[is_left]
    end = (float(limit.data),) * 2 if limit.op == "const" else ranges.get(limit, _EVERYTHING)
    is_above = _ABOVE[condition.op] == (is_left == (place == 1))
    return (max(low, end[0]), high) if is_above else (low, min(high, end[1]))


def _product(a: _Range, b: _Range) -> _Range:
    ends = [0.0 if 0.0 in (x, y) else x * y for x in a for y in b]
    return min(ends), max(ends)


def _magnitude(a: _Range) -> _Range:
    inside = 0.0 if a[0] <= 0.0 <= a[1] else min(abs(a[0]), abs(a[1]))
    return inside, max(abs(a[0]), abs(a[1]))


_RULES = {
    **dict.fromkeys(("sign", "sin", "cos", "tanh", "erf"), lambda _: (-1.0, 1.0)),
    "arctan": lambda _: (-math.pi / 2, math.pi / 2),
    "arctan2": lambda _, __: (-math.pi, math.pi),
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": lambda a, b: (a[0] - b[1], a[1] - b[0]),
    "neg": lambda a: (-a[1], -a[0]),
    "mul": _product,
    "minimum": lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    "maximum": lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    "absolute": _magnitude,
    **{name: lambda a: (math.floor(a[0]), math.ceil(a[1])) if math.isfinite(a[0] + a[1])
       else _EVERYTHING for name in ("trunc", "floor", "ceil", "rint")},
}  # fmt: skip


NO_INTEGER = -(2.0**63)  # what NumPy casts NaN to, and what is too large for an integer
_FOLLOWED = 16  # values of an integer, each a way through a function


def elementwise(graph: Graph, name: str, *operands: object) -> Tracer:
    """Return an operation on arrays, element by element, with NumPy's broadcasting."""
    special = next((v for v in operands if isinstance(v, Special)), None)
    if special is None and Special.of_complex and any(map(is_complex, operands)):
        operands = tuple(Special.of_complex(graph, v) if is_complex(v) else v for v in operands)
        special = next(v for v in operands if isinstance(v, Special))
    if special is not None:
        return special.operation(graph, name, operands)
    arrays = [traced(graph, v) for v in widened(graph, operands)]
    if all(not a.values.shape and a.axis is None for a in arrays):  # most are numbers
        return scalar(graph, graph.op(name, *(a.only for a in arrays)))
    longs = {(a.ndim - a.axis, a.length) for a in arrays if a.axis is not None}
    if len(longs) > 1 or (longs and _is_mixed(arrays, *longs)):
        arrays, longs = [a.short() for a in arrays], set()
    ndim = len(np.broadcast_shapes(*(a.shape for a in arrays)))
    if not longs:
        return Tracer(graph, mapped(lambda *e: graph.op(name, *e), *(a.cells for a in arrays)))
    ((place, length),) = longs
    cells = [
        a.cells if a.axis is not None or a.ndim < place else a.cells.squeeze(a.ndim - place)
        for a in arrays
    ]
    return Tracer(graph, mapped(lambda *e: graph.op(name, *e), *cells), ndim - place, length)


def _is_mixed(arrays: list[Tracer], long: tuple[int, int]) -> bool:
    """Whether one array is long along an axis, and another has elements of its own there."""
    place = long[0]
    return any(a.axis is None and a.ndim >= place and a.shape[-place] > 1 for a in arrays)


def with_counts(array: Tracer) -> Tracer:
    """Return an array with 0 and 1 for truth values, as NumPy's sums take them."""
    if all(e.kind != "b" for e in array.values.flat):
        return array
    return mapped_cells(array, array.graph.integer)


def total(array: Tracer, axis: Any = None) -> Tracer:
    """Return the sum of all elements, or along an axis, from left to right."""
    array = with_counts(array)
    graph, cells, long = array.graph, array.cells, array.axis
    along = range(array.ndim) if axis is None else [operator.index(axis) % array.ndim]
    if long in along:
        cells = mapped(lambda e: graph.sum(e, array.length), cells)
    short = [i - (long is not None and i > long) for i in along if i != long]
    for i in sorted(short, reverse=True):
        parts = np.moveaxis(cells, i, 0)
        cells = as_array(parts[0]).copy() if len(parts) else as_array(graph.const(0.0))
        for part in parts[1:]:
            cells = mapped(lambda a, b: graph.op("add", a, b), cells, as_array(part))
    if long is None or long in along:
        return Tracer(graph, as_array(cells))
    return Tracer(graph, as_array(cells), long - sum(i < long for i in along), array.length)


def product(a: Tracer, b: Tracer) -> Tracer:
    """Return the matrix product of vectors and matrices."""
    if a.ndim == 0 or b.ndim == 0:
        raise Untraceable("a product of a matrix and a number")
    if a.ndim > 2 or b.ndim > 2:
        return _batched(a, b)
    if a.shape[-1] != b.shape[0]:
        raise Untraceable(f"a product of shapes {a.shape} and {b.shape}")
    if b.ndim == 1 and b.axis is None and b.size > a.graph.small and a.axis == a.ndim - 1:
        b = b.as_long()
    if b.ndim == 2:
        a = (a.short() if b.axis == 1 else a)[..., None]  # rows that are long stay in one piece
        return total(elementwise(a.graph, "mul", a, b), -2)
    return total(elementwise(a.graph, "mul", a, b), -1)


def _matrix_product(graph: Graph, a: object, b: object) -> Any:
    a, b = (v.there() if isinstance(v, Tracer) else v for v in (a, b))
    if is_complex(a) or is_complex(b):
        assert Special.of_complex is not None
        return Special.of_complex(graph, a) @ b
    if any(isinstance(v, Special) or hasattr(type(v), "_forwards") for v in (a, b)):
        return NotImplemented
    return product(*(traced(graph, v) for v in widened(graph, (a, b))))


def _batched(a: Tracer, b: Tracer) -> Tracer:
    """Return the products of many matrices."""
    if a.ndim == 1 or b.ndim == 1:
        column = b.ndim == 1
        products = _batched(a, b.reshape(-1, 1)) if column else _batched(a.reshape(1, -1), b)
        return products[..., 0] if column else products[..., 0, :]
    a, b = a.short()[..., :, :, None], b.short()[..., None, :, :]
    return total(elementwise(a.graph, "mul", a, b), -2)


def _truth(self: Tracer) -> bool:
    if self.size != 1 or self.axis is not None:
        raise Untraceable("the truth value of an array")
    if self.missing is not None and self.graph.decided(self.missing):
        return False
    condition = self.graph.op("ne", self.only, self.graph.const(0.0))
    return self.graph.decided(self.only if self.only.kind == "b" else condition)


def _invert(self: Tracer) -> Tracer:
    """Return the negation of NumPy's truth values; of Python's own ~True is -2."""
    if all(e.kind == "i" for e in self.cells.flat):
        return _as_their_result(elementwise(self.graph, "sub", -1, self), [self])
    if any(e.kind != "b" for e in self.cells.flat):
        raise Untraceable("~ of numbers")
    if not all(map(is_of_arrays, self.cells.flat)):
        raise Ambiguous("takes ~ of a truth value, and ~True is -2 in Python: write not")
    return elementwise(self.graph, "not", self)


def is_of_arrays(expr: Expr) -> bool:
    """Whether a number is one of NumPy's: it depends on states or inputs."""
    return any(
        node.op in ("call", "solve") or (node.op == "leaf" and node.data[0] in ("x", "u"))
        for node in needed([expr])
    )


def _without_offset(number: Expr) -> tuple[Expr, int]:
    """Return k and 1 of k + 1: what is decided of one is of all."""
    more = 0
    while number.op in ("add", "sub"):
        left, right = number.args
        if right.op == "const":
            more += int(right.data) if number.op == "add" else -int(right.data)
            number = left
        elif left.op == "const" and number.op == "add":
            number, more = right, more + int(left.data)
        else:
            break
    return number, more


def integer_followed(self: Tracer, least: float = -np.inf, most: float = np.inf) -> int:
    """Return an integer; one that the state decides is followed to each of its values."""
    # of which none is below `least` or above `most`
    if not _is_integer(self):
        raise Untraceable("an integer that depends on the state")
    if self.only.value is not None:
        return self.graph.assumed(self.only)
    (number, more), beyond = _without_offset(self.only), []
    whole = number
    if number.op == "select" and number.args[2].data == NO_INTEGER:
        number, beyond = number.args[1], [int(NO_INTEGER)]  # of NaN, what NumPy makes of it
    low, high = integer_range(number)
    if least > -np.inf:
        low, high, beyond = max(low, least - more), min(high, most - more), []
    if high - low >= _FOLLOWED:
        raise Untraceable("an integer that may have too many values")
    values = [*range(int(low), int(high) + 1), *beyond]
    equal = {k: self.graph.op("eq", whole, self.graph.const(k)) for k in values}
    decided = next((k for k in values[:-1] if self.graph.decided(equal[k])), values[-1])
    self.graph.implied.update({equal[k]: k == decided for k in values})
    return decided + more


def _hash(self: Tracer) -> int:
    """Return the hash of a constant, or of the value of an integer that is followed."""
    if not self.shape and self.only.op == "const":
        return hash(self.only.data)
    if asked_by_enum():
        raise TypeError("compared with each member")
    return hash(integer_followed(self))


def _floor_division(self: Tracer, other: object) -> Any:
    if self.graph.attempts:
        _ask_divisor(self.graph, self, other)
    if _is_integer(self) and self.only.value is not None and isinstance(other, int):
        return operator.floordiv(integer_followed(self), other)
    return floor_quotient(self.graph, self, other)


def _floor_division_by(self: Tracer, other: object) -> Any:
    if self.graph.attempts:
        _ask_divisor(self.graph, other, self)
    return floor_quotient(self.graph, other, self)


def floor_quotient(graph: Graph, a: object, b: object) -> Tracer:
    """Return NumPy's floor_divide."""
    both = [traced(graph, v) for v in (a, b)]
    are_integers = all(e.kind == "i" for array in both for e in array.values.flat)
    if are_integers and not all(e.op == "const" and e.data for e in both[1].values.flat):
        raise Untraceable("floor division by an integer that depends on the state")
    quotient = elementwise(graph, "floor_divide", a, b)
    return mapped_cells(quotient, graph.integer) if are_integers else quotient


def mapped_cells(array: Tracer, function: Callable[[Expr], Expr]) -> Tracer:
    """Return an array of what a function makes of each expression."""
    return Tracer(array.graph, mapped(function, array.cells), array.axis, array.length)


def bits(graph: Graph, name: str, *operands: object) -> Tracer:
    """Return ``&``, ``|`` or ``^``, element by element: of truth values, or bits of integers."""
    a, b = (traced(graph, v) for v in operands)
    if all(e.kind == "b" for array in (a, b) for e in array.values.flat):
        return elementwise(graph, name, a, b)
    cells = np.broadcast_arrays(a.elements(), b.elements())
    return Tracer(graph, mapped(lambda p, q: with_bits(graph, name, _one_bit(graph, p), q), *cells))


def _one_bit(graph: Graph, number: Expr) -> Expr:
    """Return an integer that is 0 or 1 as a truth value."""
    is_bit = number.kind == "i" and number.value is None and integer_range(number) == (0.0, 1.0)
    return graph.truth(number) if is_bit else number


def moved_bits(graph: Graph, number: object, places: object, way: int) -> Tracer:
    """Return integers with their bits moved, to the left where `way` is 1; how far is known."""
    array, by = traced(graph, number), traced(graph, places)
    if by.shape or by.only.kind != "i":
        raise Untraceable("a shift by something else than one integer")
    count = integer_followed(by)
    if count < 0:
        raise ValueError("negative shift count")
    return mapped_cells(array, lambda e: shifted(graph, e, way * count))


def _is_integer(value: object) -> bool:
    return isinstance(value, Tracer) and value.size == 1 and value.only.kind == "i"


def _power(base: Any, exponent: Any) -> Any:
    """Return a power: with a whole exponent, known or assumed, as products."""
    base, exponent = (v.there() if isinstance(v, Tracer) else v for v in (base, exponent))
    if _is_integer(exponent) and exponent.only.value is not None:
        exponent = integer_followed(exponent)
    if isinstance(exponent, float) and exponent.is_integer():
        exponent = int(exponent)
    if isinstance(exponent, Tracer):
        if exponent.graph.attempts:
            raise Untraceable("try around a power of what may be Python's own numbers")
        return elementwise(exponent.graph, "power", base, exponent)
    if not isinstance(base, Tracer):
        return base**exponent
    whole = isinstance(exponent, int | np.integer) and abs(exponent) <= 64
    if base.graph.attempts and not is_numpys(base.graph, base):
        if not (whole and exponent > 0 and base.is_pythons and base.only.kind == "f"):
            raise Untraceable("try around a power of what may be Python's own numbers")
        _ask_size(base, int(exponent))
    if whole:
        powers = mapped_cells(base, lambda e: base.graph.power(e, int(exponent)))
        return _as_their_result(powers, [base])
    return elementwise(base.graph, "power", base, exponent)


def _ask_size(base: Tracer, exponent: int) -> None:
    """Raise an error where the power of a float of Python's own is too large."""
    graph, infinity = base.graph, base.graph.const(math.inf)
    power, size = (graph.op("absolute", graph.power(base.only, n)) for n in (exponent, 1))
    too_large = graph.op("and", graph.op("eq", power, infinity), graph.op("lt", size, infinity))
    graph.guard(graph.op("not", too_large), OverflowError)


_OF_BITS: dict[str, Callable[..., Any]] = dict.fromkeys(("and", "or", "xor"), bits)
_OPERANDS = Tracer | np.ndarray | float | int | bool | complex | np.generic


def _is_none_here(value: object) -> bool:
    """Whether a number that may be None is so on this way."""
    if not isinstance(value, Tracer) or value.missing is None:
        return False
    if value.where_there().shape:
        raise Untraceable("comparison of what may be None or an array")
    return value.graph.decided(value.missing)


def _operator(name: str, swapped: bool = False) -> Callable[[Any, Any], Any]:
    def method(self: Tracer, other: object) -> Any:
        if name in ("eq", "ne") and any(map(_is_none_here, (self, other))):  # no error of None
            return name == "ne"
        self, other = self.there(), other.there() if isinstance(other, Tracer) else other
        if type(other) is Fraction and not self.shape and self.only.kind == "f":
            other = float(other) if name in _BINARY.values() else other  # as Python does it
        row = bool(self.shape) and isinstance(other, list | tuple)
        if not (row or isinstance(other, _OPERANDS)):
            if name in ("eq", "ne"):
                raise Untraceable("comparison with what is not a number")  # Python would say False
            return NotImplemented  # one of Python's own numbers adds to no list
        operands = (other, self) if swapped else (self, other)
        if name in ("div", "remainder") and self.graph.attempts:
            _ask_divisor(self.graph, *operands)
        result = _OF_BITS.get(name, elementwise)(self.graph, name, *operands)
        return _as_their_result(result, operands)

    return method


def _as_their_result(result: Any, operands: Sequence[Any]) -> Any:
    """Return a result, one of Python's own numbers where its operands are."""
    if result is NotImplemented or not all(map(_is_pythons, operands)):
        return result
    return python_number(result.graph, result.only)


def _is_pythons(value: object) -> bool:
    return value.is_pythons if isinstance(value, Tracer) else type(value) in (float, int, bool)


def _ask_divisor(graph: Graph, a: object, b: object) -> None:
    """Follow the error of Python's own division by zero, of which NumPy's knows none."""
    frame = sys._getframe(1)
    while frame.f_globals is globals() and frame.f_back is not None:
        frame = frame.f_back
    if not isinstance(frame.f_globals.get("__builtins__"), Namespace):
        return  # formulas of functions of NumPy divide as NumPy does
    if isinstance(b, Tracer) and b.only.op == "cos":
        return  # never 0: no number in a computer is an odd multiple of pi / 2
    if _is_pythons(a) and _is_pythons(b):
        graph.guard(elementwise(graph, "ne", b, 0.0).only, ZeroDivisionError)
    elif not (is_numpys(graph, a) or is_numpys(graph, b)):
        raise Untraceable("try around a division of what may be Python's own numbers")


def _in_place(name: str) -> Callable[[Any, Any], Any]:
    def method(self: Tracer, other: object) -> Any:
        if not self.is_array:
            return _operator(name)(self, other)  # a number is not changed but replaced
        result = _OF_BITS.get(name, elementwise)(self.graph, name, self, other)
        if result.shape != self.shape:
            raise Untraceable("assignment of another shape")
        self[...] = result
        return self

    return method


def _shift(way: int, swapped: bool) -> Callable[[Tracer, object], Any]:
    def method(self: Tracer, other: object) -> Any:
        operands = (other, self) if swapped else (self, other)
        return _as_their_result(moved_bits(self.graph, *operands, way), operands)

    return method


def _of_one(name: str, value: Tracer) -> Tracer:
    """Return an operation on one number or array."""
    return _as_their_result(elementwise(value.graph, name, value.there()), [value])


def _positive(value: Tracer) -> Tracer:
    """Return a copy; of truth values it is the question of ``-value``."""
    return -value if any(e.kind == "b" for e in value.values.flat) else value.copy()


_BINARY = {"add": "add", "sub": "sub", "mul": "mul", "truediv": "div", "mod": "remainder"}
for _name, _op in (_BINARY | {"and": "and", "or": "or", "xor": "xor"}).items():
    setattr(Tracer, f"__{_name}__", _operator(_op))
    setattr(Tracer, f"__r{_name}__", _operator(_op, swapped=True))
    setattr(Tracer, f"__i{_name}__", _in_place(_op))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Tracer, f"__{_name}__", _operator(_name))
for _name, _op in {"neg": "neg", "abs": "absolute"}.items():
    _method = lambda self, op=_op: _of_one(op, self)  # noqa: E731
    setattr(Tracer, f"__{_name}__", _method)
for _name, _method in {
    "invert": _invert,
    "bool": _truth,
    "index": integer_followed,
    "int": integer_followed,
    "pow": _power,
    "rpow": lambda self, other: _power(other, self),
    "hash": _hash,
    "floordiv": _floor_division,
    "rfloordiv": _floor_division_by,
    "divmod": lambda self, other: (self // other, self % other),
    "rdivmod": lambda self, other: (other // self, other % self),
    "pos": _positive,
    **{
        f"{back}{name}shift": _shift(way, bool(back))
        for name, way in (("l", 1), ("r", -1))
        for back in ("", "r")
    },
    "matmul": lambda self, other: _matrix_product(self.graph, self, other),
    "rmatmul": lambda self, other: _matrix_product(self.graph, other, self),
}.items():
    setattr(Tracer, f"__{_name}__", _method)
