"""Arrays of expressions that behave as NumPy arrays do, with shapes that are known."""

from __future__ import annotations

import operator
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import EnumType, Flag
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from .graph import Expr, Graph, Untraceable, catchable
from .protocols import parts_of_object

_MOST = 2048  # elements of an array that are kept individually
_TABLED = 256  # elements of a constant matrix beyond which each row is a table


def asked_by_enum() -> bool:
    """Whether what is asked of an array is asked to find a member of an enumeration."""
    frame = sys._getframe(2)
    cls = frame.f_locals.get("cls") if frame.f_globals.get("__name__") == "enum" else None
    return isinstance(cls, EnumType) and not issubclass(cls, Flag)  # these are made of others


class Special:
    """What stands for an array in a traced function and has operators of its own."""

    of_complex: ClassVar[Callable[..., Any] | None] = None  # what takes NumPy's complex numbers

    def operation(self, graph: Graph, name: str, operands: Sequence[Any]) -> Any:
        """Return an operation by its name, on operands of which one is this."""
        raise Untraceable(f"{name} of {type(self).__name__}")

    def as_array(self) -> Tracer:
        """Return the plain array that ``np.asarray`` makes of this."""
        raise Untraceable(f"{type(self).__name__} instead of an array")


class Computed(Special):
    """What has the operators of arithmetic, by its operations."""

    __array_ufunc__ = None
    __hash__ = None  # type: ignore[assignment]
    graph: Graph


def _operator(name: str, reflected: bool = False) -> Callable[..., Any]:
    def method(self: Computed, *other: object) -> Any:
        if self.graph.attempts and name == "div":
            raise Untraceable("try around a division of complex numbers")
        return self.operation(self.graph, name, (*other, self) if reflected else (self, *other))

    return method


for _name, _op in {"add": "add", "sub": "sub", "mul": "mul", "truediv": "div"}.items():
    setattr(Computed, f"__{_name}__", _operator(_op))
    setattr(Computed, f"__r{_name}__", _operator(_op, reflected=True))
for _name, _op in {"neg": "neg", "abs": "absolute", "eq": "eq", "ne": "ne"}.items():
    setattr(Computed, f"__{_name}__", _operator(_op))


def is_complex(value: object) -> bool:
    """Whether a value is a complex number or an array of them."""
    return isinstance(value, complex | np.complexfloating) or (
        isinstance(value, np.ndarray) and value.dtype.kind == "c"
    )


@dataclass(eq=False, repr=False)
class Tracer:
    """An array of expressions, instead of an array of floats.

    One of its axes may be long: along it every cell is a vector (or a number that is repeated).
    Assigning to items changes it, as it changes an array.  A part of a short array is a view, as
    NumPy's are.  A part of a long one knows where it is from: what is assigned to it goes there,
    and it is not read any more once the whole has changed otherwise.
    """

    graph: Graph
    values: np.ndarray  # its shape is the array's without the long axis
    axis: int | None = None  # the long axis
    length: int = 1  # size of the long axis, 1 if there is none
    # the long array that this is a part of, and how often that had been assigned to
    origin: tuple[Tracer, int] | None = None
    place: range | None = None  # where in the origin a part of one dimension lies
    version: int = 0  # how often a long array has been assigned to
    # elements of which this was made, as another shape or as a choice, and what they were then
    watched: tuple[tuple[np.ndarray, tuple[Expr, ...]], ...] = ()
    missing: Expr | None = None  # where this is None, as it was before something was chosen
    is_pythons: bool = False  # whether it is known to be a number of Python's own, not NumPy's
    is_box: bool | None = False  # whether it is an array without axes; None: in some branches
    is_column: bool = False  # whether it is a column of a table of pandas
    labels: Mapping[str, int] = field(default_factory=dict)  # of a column of pandas: where each is

    __array_ufunc__ = None  # NumPy's arrays leave arithmetic with tracers to these
    methods: ClassVar[Callable[[Tracer, str], Any] | None] = None  # what finds those of arrays

    def __getattr__(self, name: str) -> Any:
        method = None if name.startswith("__") else Tracer.methods
        if method is None:
            raise AttributeError(name)
        return method(self, name)  # pyright: ignore[reportCallIssue]

    __hash__ = None  # type: ignore[assignment]

    if TYPE_CHECKING:  # what `operators` and `indexing` give it

        def __getitem__(self, key: object) -> Any: ...
        def __setitem__(self, key: object, value: object) -> None: ...
        def __add__(self, other: object) -> Any: ...
        def __radd__(self, other: object) -> Any: ...
        def __sub__(self, other: object) -> Any: ...
        def __rsub__(self, other: object) -> Any: ...
        def __mul__(self, other: object) -> Any: ...
        def __rmul__(self, other: object) -> Any: ...
        def __truediv__(self, other: object) -> Any: ...
        def __rtruediv__(self, other: object) -> Any: ...
        def __pow__(self, other: object) -> Any: ...
        def __and__(self, other: object) -> Any: ...
        def __or__(self, other: object) -> Any: ...
        def __neg__(self) -> Any: ...

    @property
    def cells(self) -> np.ndarray:
        """The expressions."""
        if self.missing is not None and self.graph.decisions.get(self.missing) is not False:
            raise Untraceable("what may be None")
        if self.origin is not None and self.origin[0].version != self.origin[1]:
            raise Untraceable("part of an array that has been assigned to since")
        if self.watched and any(tuple(elements.flat) != then for elements, then in self.watched):
            raise Untraceable("another shape of an array that has been assigned to since")
        return self.values

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        shape = list(self.values.shape)
        if self.axis is not None:
            shape.insert(self.axis, self.length)
        return tuple(shape)

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of elements."""
        return int(np.prod(self.shape))

    @property
    def dtype(self) -> np.dtype:
        """What an array of floats says."""
        if any(e.kind != "f" for e in self.values.flat):
            raise Untraceable("the type of an array of integers or truth values")
        return np.dtype(float)

    @property
    def real(self) -> Tracer:
        """The array: its numbers are real."""
        return self

    @property
    def imag(self) -> Tracer:
        """Zeros."""
        return Tracer(self.graph, mapped(lambda _: self.graph.const(0.0), self.values), self.axis,
                      self.length)  # fmt: skip

    @property
    def T(self) -> Tracer:  # noqa: N802 (NumPy's name)
        """The transpose."""
        if self.ndim < 2:
            return self
        axis = None if self.axis is None else self.ndim - 1 - self.axis
        return self._part(self.cells.T, axis, self.length)

    def _part(
        self, cells: np.ndarray, axis: int | None, length: int, place: range | None = None
    ) -> Tracer:
        """Return a view of this array, or of what this is a part of."""
        origin = self.origin or ((self, self.version) if self.axis is not None else None)
        return Tracer(self.graph, cells, axis, length, origin, place, watched=self.watched)

    def _text(self, *_: object) -> str:
        raise Untraceable("a text of what is only known when it runs")

    def __repr__(self) -> str:
        if asked_by_enum():  # for the text of its error: it is not a member's value
            raise catchable(ValueError)
        return self._text()

    __str__ = __format__ = _text

    def __len__(self) -> int:
        if not self.shape:
            raise TypeError("a number has no length")
        return self.shape[0]

    def __iter__(self) -> Iterator[Tracer]:
        return (self.item_at(i) for i in range(len(self)))

    def item_at(self, key: object) -> Tracer:
        """Return the elements at places that are known: a view where NumPy's is one."""
        if holds_arrays(key):
            return self._at(key)
        keys = full_index(key, self.ndim)
        if self.axis is None:
            cells = as_array(self.cells[tuple(keys)])
            place = self._place(keys[0]) if len(keys) == 1 else None
            if not cells.shape and any(k is ... for k in (key if type(key) is tuple else [key])):
                return Tracer(self.graph, as_array(self.cells[(*keys, ...)]), is_box=True)
            if not cells.shape:
                return Tracer(self.graph, cells)
            return self._part(cells, None, 1, place)
        position = [i for i, k in enumerate(keys) if k is not None][self.axis]
        before = sum(k is None or isinstance(k, slice) for k in keys[:position])
        along = keys.pop(position)
        cells = as_array(self.cells[tuple(keys)])
        if not isinstance(along, slice):
            k = range(self.length)[along]
            parts = mapped(lambda e: self.graph.item(e, k), cells)
            return self._part(parts, None, 1) if parts.shape else Tracer(self.graph, parts)
        indices = range(self.length)[along]
        place = self._place(along) if self.ndim == 1 and not keys else None
        if len(indices) <= self.graph.small:
            parts = [mapped(lambda e, k=k: self.graph.item(e, k), cells) for k in indices]
            return self._part(_stacked(parts, before, cells.shape), None, 1, place)
        start, step, size = indices.start, indices.step, len(indices)
        cells = mapped(lambda e: self.graph.part(e, start, step, size), cells)
        return self._part(cells, before, size, place)

    def _place(self, key: Any) -> range | None:
        """Return where a part of one dimension lies in the origin."""
        whole = self.place if self.origin is not None else range(self.length)
        is_short = self.origin is self.axis is None
        is_part = isinstance(key, slice) and self.ndim == 1 and not is_short
        return whole[key] if is_part and whole is not None else None

    def _at(self, key: Any) -> Tracer:
        """Return copies of the elements at places that are fixed, as NumPy finds them."""
        places = np.arange(self.size).reshape(self.shape)[key]
        indices = places.reshape(-1)
        if self.axis is None or indices.size <= self.graph.small or self.ndim > 1:
            return Tracer(self.graph, as_array(self.elements()[key]))
        steps = np.unique(np.diff(indices))
        if places.ndim > 1 or steps.size != 1 or steps[0] == 0:
            return Tracer(self.graph, as_array(self.elements()[key]))
        part = self.graph.part(self.only, int(indices[0]), int(steps[0]), indices.size)
        return Tracer(self.graph, as_array(part), 0, indices.size)

    def elements(self) -> np.ndarray:
        """Return all elements, each an expression of its own, in the array's shape."""
        if self.axis is None:
            return self.cells
        if self.size > _MOST:
            raise Untraceable("too many elements to be written out")
        parts = [mapped(lambda e, k=k: self.graph.item(e, k), self.cells)
                 for k in range(self.length)]  # fmt: skip
        return np.stack(parts, axis=self.axis)

    def short(self) -> Tracer:
        """Return the array without a long axis."""
        return self if self.axis is None else Tracer(self.graph, self.elements())

    def copy(self) -> Tracer:
        """Return a copy."""
        return Tracer(self.graph, self.cells.copy(), self.axis, self.length, is_box=self.is_box)

    def ravel(self, order: str = "C") -> Tracer:
        """Return the array in one dimension: a view where it is contiguous, otherwise a copy."""
        in_one_piece = self.values.flags["F" if order == "F" else "C"]
        if self.axis is not None:
            in_one_piece = self.origin is None or getattr(self.place, "step", 0) == 1
        return self.reshape(-1, order=order) if in_one_piece else self.flatten(order)

    def flatten(self, order: str = "C") -> Tracer:
        """Return a copy in one dimension."""
        return self.reshape(-1, order=order).copy()

    def reshape(self, *shape: Any, order: Any = "C") -> Tracer:
        """Return the array in another shape."""
        several = len(shape) == 1 and isinstance(shape[0], tuple | list)
        target = tuple(operator.index(n) for n in (shape[0] if several else shape))
        if order != "C":  # NumPy knows what is a view; of a long array it cannot be written to
            return self._part(self.elements().reshape(target, order=order), None, 1)
        if self.ndim == 1 and target in ((-1,), (self.size,)):
            return self
        if self.axis is not None and self.ndim > 1:
            return self._part(self.elements().reshape(target), None, 1)._as_long_if_many()
        if self.axis is not None:
            return self._in_rows(target)
        place = self.place if self.ndim == len(target) == 1 else None
        array = self._part(self.cells.reshape(target), None, 1, place)
        array.is_box = not target and (self.ndim > 0 or self.is_box)
        return array._as_long_if_many()

    def _in_rows(self, shape: tuple[int, ...]) -> Tracer:
        """Return a long array as a small matrix."""
        places = np.arange(self.size).reshape(shape)
        if self.size > _MOST:
            raise Untraceable("reshaping a long array")
        cells = mapped(lambda k: self.graph.item(self.only, int(k)), places)
        return self._part(cells, None, 1)

    def _as_long_if_many(self) -> Tracer:
        many = self.axis is None and self.ndim == 1 and self.size > self.graph.small
        return self.as_long() if many else self

    def as_long(self) -> Tracer:
        """Return elements of a small matrix as a long array of one dimension."""
        pieces = [(e, 1) for e in self.cells.flat]
        array = Tracer(self.graph, as_array(self.graph.joined(pieces)), 0, self.size)
        array.watched = (self.watch(),)
        return array

    @property
    def is_array(self) -> bool:
        """Whether it is an array for NumPy, with or without axes, and not a number."""
        if self.is_box is None:
            raise Untraceable("an array without axes in one branch, another in the other one")
        return self.ndim > 0 or self.is_box

    def where_there(self) -> Tracer:
        """Return the array as it is where it is not None."""
        return self if self.missing is None else replace(self, missing=None)

    def there(self) -> Tracer:
        """Return the array: where it is None, Python raises an error."""
        if self.missing is not None:
            self.graph.guard(self.graph.op("not", self.missing), TypeError)
        return self.where_there()

    def watch(self) -> tuple[np.ndarray, tuple[Expr, ...]]:
        """Return the elements with what they are now: whether they are assigned to later."""
        return self.values, tuple(self.values.flat)

    def pieces(self) -> list[tuple[Expr, int]]:
        """Return the elements in order, each expression with its number of elements."""
        if self.axis is not None:
            return [(self.graph.number(self.only), self.length)]
        return [(self.graph.number(e), 1) for e in self.cells.flat]

    @property
    def only(self) -> Expr:
        """The expression of an array of one element."""
        return self.cells.reshape(-1)[0]


def as_array(cells: object) -> np.ndarray:
    """Return cells as an array; NumPy hands out a single element as it is."""
    if isinstance(cells, np.ndarray):
        return cells
    box = np.empty((), dtype=object)
    box[()] = cells
    return box


def mapped(function: Callable[..., Any], *cells: np.ndarray) -> np.ndarray:
    return as_array(np.frompyfunc(function, len(cells), 1)(*cells))


def _stacked(parts: Sequence[np.ndarray], axis: int, shape: tuple[int, ...]) -> np.ndarray:
    if parts:
        return np.stack(parts, axis=axis)
    return np.empty((*shape[:axis], 0, *shape[axis:]), dtype=object)


def holds_arrays(key: Any) -> bool:
    """Whether there are lists or arrays in an index."""
    keys = key if isinstance(key, tuple) else (key,)
    return any(isinstance(k, list | bool) or np.ndim(k) for k in keys if not isinstance(k, Tracer))


def full_index(key: Any, ndim: int) -> list[Any]:
    """Return an index as a list with an entry for every axis."""
    keys = list(key) if isinstance(key, tuple) else [key]
    if any(isinstance(k, list | np.ndarray) or getattr(k, "shape", ()) for k in keys):
        raise Untraceable("indexing by arrays")
    keys = [k if k is None or k is ... or isinstance(k, slice) else operator.index(k) for k in keys]
    missing = [slice(None)] * (ndim - sum(k is not None and k is not ... for k in keys))
    at = keys.index(...) if ... in keys else len(keys)
    return [*keys[:at], *missing, *keys[at + 1 :]]


def scalar(graph: Graph, expr: Expr) -> Tracer:
    """Return an array without axes that holds one expression."""
    return Tracer(graph, as_array(expr))


def python_number(graph: Graph, expr: Expr) -> Tracer:
    """Return a number that is one of Python's own."""
    graph.of_python.add(expr)
    return Tracer(graph, as_array(expr), is_pythons=True)


def traced(graph: Graph, value: object) -> Tracer:
    """Return numbers, tracers and nested lists of them as a tracer."""
    if isinstance(value, Tracer):
        return value
    if type(value) is float or type(value) is bool:
        return scalar(graph, graph.const(value))
    if isinstance(value, Special):  # functions of NumPy make of some of these others of their kind
        raise Untraceable(f"{type(value).__name__} instead of an array")
    if isinstance(value, list | tuple):
        parts = [traced(graph, v) for v in value]
        if any(p.shape != parts[0].shape for p in parts):
            raise Untraceable("rows of different lengths")
        if parts and any(p.axis is not None for p in parts):
            if any(p.axis != 0 or p.ndim != 1 for p in parts) or len(parts) > graph.small:
                return Tracer(graph, np.stack([p.elements() for p in parts]))
            rows = _stacked([p.cells for p in parts], 0, ())
            return Tracer(graph, rows, 1, parts[0].length)
        if len(parts) > graph.small and parts[0].ndim == 0:
            return concatenated(graph, [p.reshape(1) for p in parts])
        return Tracer(graph, _stacked([p.cells for p in parts], 0, ()))
    if not (type(value) is np.ndarray or isinstance(value, bool | int | float | np.generic)):
        return traced(graph, parts_of_object(value))
    array = np.asarray(value)
    if array.dtype == object and array.shape and all(_is_number(v) for v in array.flat):
        return traced(graph, array.tolist())  # what NumPy has made of tracers, one by one
    if array.dtype not in (np.dtype(float), np.dtype(int), np.dtype(bool)):
        raise Untraceable(f"values of type {array.dtype}")  # they would be rounded otherwise
    return _constants(graph, array)


def _is_number(value: object) -> bool:
    return isinstance(value, bool | int | float) or (isinstance(value, Tracer) and not value.shape)


def _constants(graph: Graph, array: np.ndarray) -> Tracer:
    long = [i for i, n in enumerate(array.shape) if n > graph.small]
    is_large = array.size > _TABLED and array.shape[0] <= _TABLED
    by_rows = len(long) == 1 or is_large
    if not long or not by_rows or array.ndim > 2 or array.dtype != float:
        if array.size > _MOST:
            raise Untraceable("a large matrix")
        return Tracer(graph, mapped(graph.const, array.astype(object)))
    moved = np.moveaxis(array, long[-1], -1)
    cells = np.empty(moved.shape[:-1], dtype=object)
    for index in np.ndindex(cells.shape):
        cells[index] = graph.table(list(moved[index]))
    return Tracer(graph, cells, long[-1], array.shape[long[-1]])


def leaf_vector(
    graph: Graph, array: str, start: int, shape: tuple[int, ...], kind: str = "f"
) -> Tracer:
    """Return part of an argument of the program as an array of the given shape."""
    numbers = np.arange(start, start + int(np.prod(shape))).reshape(shape)
    long = [i for i, n in enumerate(shape) if n > graph.small]
    if not long or len(shape) > 2:
        if numbers.size > _MOST:
            raise Untraceable("a large matrix")
        return Tracer(graph, mapped(lambda i: graph.leaf(array, int(i), None, kind), numbers))
    moved = np.moveaxis(numbers, long[-1], -1)  # of a large matrix the rows stay in one piece
    step, size = int(moved.flat[1] - moved.flat[0]), moved.shape[-1]

    def column(i: int) -> Expr:
        where = (array, int(i), step)
        return graph.node("leaf", data=where, size=size, varies=array != "p")

    return Tracer(graph, mapped(column, moved[..., 0]), long[-1], size)


def full(graph: Graph, shape: Any, value: object) -> Tracer:
    """Return an array of equal elements."""
    several = isinstance(shape, list | tuple)
    shape = tuple(map(operator.index, shape if several else [shape]))
    number = traced(graph, value)
    if number.size != 1 or number.only.kind != "f":
        raise Untraceable("an array that is filled with something else than one float")
    long = [i for i, n in enumerate(shape) if n > graph.small]
    if len(long) > 1 or len(shape) > 2:
        if np.prod(shape) > _MOST:
            raise Untraceable("a large matrix")
        return Tracer(graph, np.full(shape, as_array(number.only)))
    cells = np.full([n for n in shape if n <= graph.small], as_array(number.only))
    return Tracer(graph, cells, *([long[0], shape[long[0]]] if long else []))


def concatenated(graph: Graph, parts: Sequence[Tracer]) -> Tracer:
    """Return arrays of one dimension, one after the other."""
    if any(p.ndim != 1 for p in parts):
        raise Untraceable("joining matrices or numbers")
    size = sum(p.size for p in parts)
    if size <= graph.small:
        return Tracer(graph, np.concatenate([p.cells.reshape(-1) for p in parts]))
    pieces: list[tuple[Expr, int]] = []
    for part in parts:
        if part.axis is None:
            pieces += [(e, 1) for e in part.cells.reshape(-1)]
        else:
            pieces.append((part.only, part.length))
    return Tracer(graph, as_array(graph.joined(pieces)), 0, size)
