"""What a traced function finds in the place of NumPy, math and the builtins.

Functions are not traced as they stand but as copies whose global names lead here.  What has no
place here refuses tracers, and the function is then called instead of traced.
"""

from __future__ import annotations

import builtins
import math
from collections.abc import Callable, Iterator
from types import BuiltinFunctionType, CellType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core.registry import CPUDispatcher

from ._trace_array import Tracer, concatenated, full, traced
from ._trace_graph import NUMPY, Graph, Untraceable
from ._trace_operators import elementwise, product, total
from ._vector_math import FUNCTIONS

_OPERATIONS = {name: op for op, name in NUMPY.items()} | {name: name for name in FUNCTIONS}
_MATH = {
    "fabs": "absolute", "pow": "power", "asin": "arcsin", "acos": "arccos", "atan": "arctan",
    "atan2": "arctan2", "asinh": "arcsinh", "acosh": "arccosh", "atanh": "arctanh",
}  # fmt: skip
_LIBRARIES = ("numpy", "scipy", "numba")
_BUILTINS = ("min", "max", "float", "isinstance", "type", "hasattr", "round")


def holds_tracers(value: Any) -> bool:
    """Whether there are tracers in a value, or in a list or tuple."""
    if isinstance(value, list | tuple):
        return any(map(holds_tracers, value))
    return isinstance(value, Tracer)


class Stage:
    """Everything that a traced function sees instead of the real thing."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self._copies: dict[int, tuple[Any, Any]] = {}
        self.numpy = _Module(np, self._numpy_function)
        self.math = _Module(math, self._math_function)

    def copied(self, function: Any) -> Any:
        """Return a copy of a function whose global names and closure lead to the stage."""
        function = getattr(function, "py_func", function)
        if not isinstance(function, FunctionType):
            raise Untraceable(f"{function!r} is no plain function")
        if id(function) not in self._copies:
            names: dict[str, Any] = {"__builtins__": builtins}
            cells = tuple(CellType() for _ in function.__closure__ or ())
            copy = FunctionType(
                function.__code__, names, function.__name__, function.__defaults__, cells
            )
            copy.__kwdefaults__ = function.__kwdefaults__
            self._copies[id(function)] = (function, copy)  # before what may refer back to it
            for name in _names(function.__code__):
                if name in function.__globals__:
                    names[name] = self._instead(function.__globals__[name])
                elif name in _BUILTINS:
                    names[name] = self._builtin(name)
            for cell, given in zip(cells, function.__closure__ or (), strict=True):
                cell.cell_contents = self._instead(given.cell_contents)
        return self._copies[id(function)][1]

    def _instead(self, value: Any) -> Any:
        """Return what stands for a global value."""
        if value is np or value is math:
            return self.numpy if value is np else self.math
        if isinstance(value, ModuleType):
            return _Module(value, _forbidden)
        library = (getattr(value, "__module__", None) or "").partition(".")[0]
        name = getattr(value, "__name__", "")
        if isinstance(value, np.ufunc) or (callable(value) and getattr(np, name, None) is value):
            return getattr(self.numpy, name)
        if isinstance(value, BuiltinFunctionType) and library == "math":
            return getattr(self.math, name)
        if isinstance(value, CPUDispatcher):
            return self.copied(value)
        if isinstance(value, FunctionType):
            return _for_numbers(value) if library in _LIBRARIES else self.copied(value)
        if callable(value) and not isinstance(value, type) and library != "builtins":
            return lambda *arguments, **options: _forbidden(repr(value), value)  # may have a memory
        return value

    def _ufunc(self, operation: str, real: Callable[..., Any]) -> Callable[..., Any]:
        count = getattr(np, operation if operation in FUNCTIONS else NUMPY[operation]).nin

        def function(*arguments: Any, **options: Any) -> Any:
            if not any(map(holds_tracers, arguments)):
                return real(*arguments, **options)
            if options or len(arguments) != count:
                raise Untraceable(f"{operation} with other arguments")
            if operation == "power":
                return traced(self.graph, arguments[0]) ** arguments[1]
            return elementwise(self.graph, operation, *arguments)

        return function

    def _numpy_function(self, name: str, real: Any) -> Any:
        own = getattr(_Numpy, name, None)
        if own is not None:
            return lambda *arguments, **options: own(self.graph, *arguments, **options)
        operation = _OPERATIONS.get(getattr(real, "__name__", name))
        if isinstance(real, np.ufunc) and operation:
            return self._ufunc(operation, real)
        if isinstance(real, ModuleType):
            return _Module(real, _forbidden)
        return _for_numbers(real)

    def _math_function(self, name: str, real: Any) -> Any:
        operation = _MATH.get(name, name)
        known = operation in FUNCTIONS and name != "remainder"  # NumPy's is another one
        return self._ufunc(operation, real) if known else _for_numbers(real)

    def _builtin(self, name: str) -> Any:
        if name == "float":
            return lambda value=0.0: value if isinstance(value, Tracer) else float(value)
        if name in ("min", "max"):
            return lambda *values: self._extreme(name, values)
        return _for_numbers(getattr(builtins, name))

    def _extreme(self, name: str, values: Any) -> Any:
        """Python's min and max: the first of those that no other is beyond."""
        values = list(values[0]) if len(values) == 1 else list(values)
        if not holds_tracers(values):
            return getattr(builtins, name)(values)
        found = traced(self.graph, values[0])
        for value in values[1:]:
            beyond = elementwise(self.graph, "lt" if name == "min" else "gt", value, found)
            found = elementwise(self.graph, "select", beyond, value, found)
        return found


class _Module:
    """A module whose functions are replaced."""

    def __init__(self, real: Any, function: Callable[[str, Any], Any]) -> None:
        self._real, self._function = real, function

    def __getattr__(self, name: str) -> Any:
        real = getattr(self._real, name)
        is_type = isinstance(real, type)
        plain = is_type or not (callable(real) or isinstance(real, ModuleType))
        return real if plain else self._function(name, real)


def _forbidden(name: str, real: Any) -> Any:
    raise Untraceable(f"{name} is not known here")


def _for_numbers(real: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that refuses tracers."""

    def function(*arguments: Any, **options: Any) -> Any:
        if any(map(holds_tracers, (*arguments, *options.values()))):
            raise Untraceable(f"{real!r} is not known here")
        return real(*arguments, **options)

    return function


def _names(code: CodeType) -> Iterator[str]:
    """Yield the names that a function and those inside it may look up."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _only_floats(dtype: Any) -> None:
    if dtype not in (None, float, np.float64):
        raise Untraceable(f"arrays of {dtype}")


class _Numpy:
    """Functions of NumPy that are no ufuncs."""

    @staticmethod
    def zeros(graph, shape, dtype=float):
        _only_floats(dtype)
        return full(graph, shape, 0.0)

    empty = zeros

    @staticmethod
    def ones(graph, shape, dtype=float):
        _only_floats(dtype)
        return full(graph, shape, 1.0)

    @staticmethod
    def full(graph, shape, value):
        return full(graph, shape, value)

    @staticmethod
    def zeros_like(graph, array):
        return full(graph, array.shape, 0.0) if holds_tracers(array) else np.zeros_like(array)

    empty_like = zeros_like

    @staticmethod
    def ones_like(graph, array):
        return full(graph, array.shape, 1.0) if holds_tracers(array) else np.ones_like(array)

    @staticmethod
    def array(graph, values, dtype=None):
        if not holds_tracers(values) and np.array(values, dtype).dtype != float:
            return np.array(values, dtype)  # an array of integers rounds what it is assigned
        _only_floats(dtype)
        return traced(graph, values).copy()

    @staticmethod
    def asarray(graph, values, dtype=None):
        return values if isinstance(values, Tracer) else _Numpy.array(graph, values, dtype)

    @staticmethod
    def copy(graph, values):
        return traced(graph, values).copy()

    @staticmethod
    def sum(graph, values, axis=None):
        return total(traced(graph, values), axis)

    @staticmethod
    def dot(graph, a, b):
        return product(traced(graph, a), traced(graph, b))

    matmul = dot

    @staticmethod
    def concatenate(graph, parts, axis=0):
        return concatenated(graph, [traced(graph, p) for p in parts])

    @staticmethod
    def hstack(graph, parts):
        return concatenated(graph, [traced(graph, p).reshape(-1) for p in parts])

    @staticmethod
    def append(graph, array, values):
        return _Numpy.hstack(graph, [array, values])

    @staticmethod
    def where(graph, condition, a, b):
        return elementwise(graph, "select", condition, a, b)

    @staticmethod
    def clip(graph, values, low, high):
        return elementwise(graph, "minimum", elementwise(graph, "maximum", values, low), high)

    @staticmethod
    def square(graph, values):
        return elementwise(graph, "mul", values, values)

    @staticmethod
    def isnan(graph, values):
        return elementwise(graph, "ne", values, values)

    @staticmethod
    def isfinite(graph, values):
        return elementwise(graph, "lt", elementwise(graph, "absolute", values), np.inf)

    @staticmethod
    def size(graph, values):
        return traced(graph, values).size

    @staticmethod
    def shape(graph, values):
        return traced(graph, values).shape
