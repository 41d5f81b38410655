"""The table of functions that are written in terms of others, and who looks something up in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from types import FunctionType
from typing import Any

import numpy as np

from ..arrays import Special, Tracer, traced
from ..constants import constant_value
from ..functions import FUNCTIONS
from ..graph import NUMPY, Graph, Untraceable
from ..operators import elementwise

# of a function of a library: the same of arrays of expressions; it takes the graph first
WRITTEN: dict[Any, Callable[..., Any]] = {}
# functions whose results a traced function may change: taken from here even of numbers
ARRAY_MAKERS: set[Any] = set()
ARRAY_METHODS: dict[str, Any] = {}  # of an array's method: the function that does the same
UFUNC_OPERATIONS = {name: op for op, name in NUMPY.items()} | {name: name for name in FUNCTIONS}
UFUNC_OPERATIONS["divide"] = "div"  # of the name of a ufunc: the operation of expressions


def of(*functions: object, makes: bool = False) -> Callable[[Any], Any]:
    """Enter a function of a graph and arguments into the table."""

    def entered(written: Callable[..., Any]) -> Any:
        enter(functions, written, makes=makes)
        return written

    return entered


def formula(*functions: object) -> Callable[[Any], Any]:
    """Enter a function that is a formula of others, which it takes from its first argument."""

    def entered(written: Callable[..., Any]) -> Any:
        def of_graph(graph: Graph, *rest: object, **named: Any) -> Any:
            arrays = [traced(graph, v) if isinstance(v, list) else v for v in rest]
            return written(Facade(graph), *arrays, **named)

        enter(functions, of_graph)
        return written

    return entered


def enter(functions: Iterable[Any], written: Callable[..., Any], *, makes: bool = False) -> None:
    """Enter a function into the table under each of its names."""
    for function in functions:
        WRITTEN[function] = written
        if makes:
            ARRAY_MAKERS.add(function)


class NumberType:
    """A type of numbers that a traced function finds: called, it takes expressions."""

    def __init__(self, real: type, make: Callable[..., Any]) -> None:
        self.real, self.make = real, make

    def __call__(self, *arguments: object, **options: object) -> Any:
        return self.make(*arguments, **options)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.real, name)

    def __eq__(self, other: object) -> bool:
        return unwrapped(other) is self.real

    def __hash__(self) -> int:
        return hash(self.real)

    @property
    def dtype(self) -> np.dtype:
        """What NumPy's own arrays, of constants, take it for."""
        return np.dtype(self.real)

    def __or__(self, other: object) -> Any:
        return self.real | unwrapped(other)  # type: ignore[operator]

    __ror__ = __or__


def unwrapped(value: object) -> Any:
    """Return the type that stands behind a value, any other value as it is."""
    return value.real if isinstance(value, NumberType) else value


def known_numbers(value: object, what: str) -> np.ndarray:
    """Return numbers that do not depend on the state."""
    known = constant_value(value) if isinstance(value, Tracer) else value
    if isinstance(known, list | tuple):
        known = [known_numbers(v, what) for v in known]
    if isinstance(known, Tracer):
        raise Untraceable(f"{what} that depend on the state or on parameters")
    return np.asarray(known)


class Facade:
    """What formulas find as NumPy: its functions, of arrays of expressions."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph

    def __getattr__(self, name: str) -> Any:
        real = getattr(np, name)
        if not callable(real):
            return real
        return lambda *arguments, **options: written_out(self.graph, real, *arguments, **options)


def on_expressions(graph: Graph, function: FunctionType) -> Any:
    """Return one of our formulas of numbers, and what it calls, as formulas of expressions."""
    names = dict(function.__globals__, np=Facade(graph))
    for name in function.__code__.co_names:
        if isinstance(names.get(name), FunctionType):
            names[name] = on_expressions(graph, names[name])
    return FunctionType(function.__code__, names)


def written_out(graph: Graph, function: object, *arguments: object, **options: object) -> Any:
    """Return a function of a library of arrays of expressions."""
    if function in WRITTEN:
        return WRITTEN[function](graph, *arguments, **options)
    name = UFUNC_OPERATIONS.get(getattr(function, "__name__", ""))
    if name is None or not isinstance(function, np.ufunc):
        raise Untraceable(f"{getattr(function, '__name__', function)} is not known here")
    return of_ufunc(graph, function, lambda *a: elementwise(graph, name, *a), arguments, options)


def of_ufunc(
    graph: Graph,
    function: Callable[..., Any],
    written: Callable[..., Any],
    arguments: tuple[Any, ...],
    options: Any,
) -> Any:
    """Return a ufunc, with the options that all have."""
    count = function.nin
    out, where = options.get("out"), options.get("where", True)
    dtype = options.get("dtype")
    if len(arguments) > count:
        out, arguments = arguments[count], arguments[:count]
    out = out[0] if isinstance(out, tuple) else out
    are_known = set(options) <= {"out", "where", "dtype", "casting"}
    if not are_known or len(arguments) < count or dtype not in (None, float, np.float64):
        raise Untraceable(f"{function.__name__} with other arguments")
    if where is not True:
        if out is None:
            raise Untraceable("where= without out=: what is not computed is arbitrary")
        out[...] = elementwise(graph, "select", where, written(*arguments), out)
        return out
    result = written(*arguments)
    if out is None:
        return result
    out[...] = result
    return out


_BOXING = ("array", "asarray", "asanyarray", "copy", "where", "select", "piecewise", "require",
           "full", "zeros", "ones", "empty", "full_like", "zeros_like", "ones_like", "empty_like",
           "tensordot", "splev")  # fmt: skip
_KEEPING = ("squeeze", "reshape")  # of an array; of a number there is another number


def boxed(real: object, first: object, result: Any) -> Any:
    """Return the result of a function as an array without axes, where NumPy's is one."""
    if not isinstance(result, Tracer) or result.is_array or result.is_pythons:
        return result
    name = getattr(real, "__name__", type(real).__name__)
    if name in _KEEPING and isinstance(first, Tracer) and first.is_array:
        return replace(result, is_box=True)  # the element itself: what is written goes there
    is_table = type(real).__module__.startswith("scipy.interpolate")
    return replace(result.copy(), is_box=True) if name in _BOXING or is_table else result


def is_traced(value: object) -> bool:
    """Whether a value is one of expressions."""
    return isinstance(value, Tracer | Special)


def _method(array: Tracer, name: str) -> Any:
    """Return a method of an array, or the part that it names."""
    if name in array.labels:
        return array.item_at(array.labels[name])
    if array.is_column and name in ("iloc", "iat"):
        return array
    if name not in ARRAY_METHODS:
        text = f"an array of expressions has no {name}"
        method = hasattr(np.ndarray, name) or hasattr(np.float64, name)
        raise Untraceable(text) if method else AttributeError(text)
    method = ARRAY_METHODS[name]
    if method in WRITTEN:  # a function that does the same
        return lambda *rest, **named: boxed(
            method, array, written_out(array.graph, method, array, *rest, **named)
        )
    return lambda *rest, **named: method(
        array.graph, array, *map(unwrapped, rest), **{k: unwrapped(v) for k, v in named.items()}
    )


Tracer.methods = staticmethod(_method)
