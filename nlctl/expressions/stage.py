"""What a traced function finds in the place of NumPy, math and the builtins.

Functions are not traced as they stand but as copies whose global names lead here.  What has no
place here refuses tracers, and the function is then called instead of traced.
"""

from __future__ import annotations

import builtins
import functools
import inspect
import math
from collections.abc import Callable, Iterator
from types import BuiltinFunctionType, CellType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ..upstream.numba_internals import CPUDispatcher
from .arrays import Tracer, concatenated, full, traced
from .functions import FUNCTIONS, MATH
from .graph import NUMPY, Graph, Untraceable
from .operators import elementwise, product, total

_OPERATIONS = {name: op for op, name in NUMPY.items()} | {name: name for name in FUNCTIONS}
_LIBRARIES = ("numpy", "scipy", "numba")
_RAW = (bool, int, float, complex, str, bytes, type(None), np.ndarray, np.generic, range, slice)
_SAFE = ("abs", "all", "any", "bool", "dict", "divmod", "enumerate", "filter", "int", "iter", "len",
         "list", "map", "next", "pow", "range", "reversed", "set", "slice", "sorted", "sum",
         "tuple", "zip")  # fmt: skip  # these ask their arguments, as they do of arrays


def holds_tracers(value: Any) -> bool:
    """Whether there are tracers in a value, or in a list, tuple or dict."""
    if isinstance(value, dict):
        return any(map(holds_tracers, value.values()))
    if isinstance(value, list | tuple | set):
        return any(map(holds_tracers, value))
    return isinstance(value, Tracer)


class Stage:
    """Everything that a traced function sees instead of the real thing."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self._copies: dict[int, tuple[Any, Any]] = {}
        self.numpy = _Module(np, self._numpy_function)
        self.math = _Module(math, self._math_function)
        self._builtins = {name: self._builtin(name, v) for name, v in vars(builtins).items()}

    def copied(self, function: Any) -> Any:
        """Return a copy of a function whose global names and closure lead to the stage."""
        function = getattr(function, "py_func", function)
        if not isinstance(function, FunctionType):
            return self._called_object(function)
        if id(function) not in self._copies:
            names: dict[str, Any] = {"__builtins__": self._builtins}
            names["__package__"] = function.__globals__.get("__package__")
            cells = tuple(CellType() for _ in function.__closure__ or ())
            defaults = tuple(map(self.instead, function.__defaults__ or ()))
            copy = FunctionType(function.__code__, names, function.__name__, defaults, cells)
            self._copies[id(function)] = (function, copy)  # before what may refer back to it
            keywords = (function.__kwdefaults__ or {}).items()
            copy.__kwdefaults__ = {k: self.instead(v) for k, v in keywords}
            for name in _names(function.__code__):
                if name in function.__globals__:
                    names[name] = self.instead(function.__globals__[name])
            for cell, given in zip(cells, function.__closure__ or (), strict=True):
                cell.cell_contents = self.instead(given.cell_contents)
        return self._copies[id(function)][1]

    def _called_object(self, thing: Any) -> Any:
        """Return what calls a method, a `functools.partial`, or an object."""
        if isinstance(thing, MethodType):
            return functools.partial(self.copied(thing.__func__), self.instead(thing.__self__))
        if isinstance(thing, functools.partial):
            keywords = {k: self.instead(v) for k, v in thing.keywords.items()}
            first = map(self.instead, thing.args)
            return functools.partial(self.instead(thing.func), *first, **keywords)
        call = vars(type(thing)).get("__call__")
        if isinstance(call, FunctionType) and not _is_of_a_library(thing):
            return functools.partial(self.copied(call), self.instead(thing))
        raise Untraceable(f"{thing!r} is not a plain function")

    def instead(self, value: Any) -> Any:
        """Return what stands for a value that was there before."""
        if value is np or value is math:
            return self.numpy if value is np else self.math
        if isinstance(value, ModuleType):
            inside = value.__name__.partition(".")[0] in _LIBRARIES
            return _Module(value, _constant if inside else lambda _, real: self.instead(real))
        if type(value) in _RAW or isinstance(value, type | np.generic | Tracer):
            return value
        if type(value) in (list, tuple):
            return type(value)(map(self.instead, value))
        if type(value) is dict:
            return {k: self.instead(v) for k, v in value.items()}
        name = getattr(value, "__name__", "")
        if isinstance(value, np.ufunc) or (callable(value) and getattr(np, name, None) is value):
            return getattr(self.numpy, name)
        if isinstance(value, BuiltinFunctionType):
            return self._instead_of_builtin(value, name)
        return self._instead_of_object(value)

    def _instead_of_builtin(self, value: Any, name: str) -> Any:
        owner = getattr(value, "__self__", None)
        if owner is math:
            return getattr(self.math, name)
        return self._builtins[name] if owner is builtins else _for_numbers(value)

    def _instead_of_object(self, value: Any) -> Any:
        if isinstance(value, functools.partial | MethodType):
            return self._called_object(value)
        if isinstance(value, CPUDispatcher | FunctionType):
            return _for_numbers(value) if _is_of_a_library(value) else self.copied(value)
        if isinstance(value, functools._lru_cache_wrapper):
            return self.instead(value.__wrapped__)
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return type(value)(*map(self.instead, value))
        return _Object(value, self)

    def _import(self, name: str, *rest: Any) -> Any:
        return self.instead(builtins.__import__(name, *rest))

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
            return _Module(real, _constant)
        return _for_numbers(real)

    def _math_function(self, name: str, real: Any) -> Any:
        if name not in MATH:
            return _for_numbers(real)
        known = self._ufunc(MATH[name], real)

        def function(*arguments: Any) -> Any:
            result = known(*arguments)
            if isinstance(result, Tracer):
                self._guard(result, arguments)
            return result

        return function

    def _guard(self, result: Tracer, arguments: Any) -> None:
        """Note when Python's function raises an error where NumPy's gives NaN or infinity."""
        graph = self.graph
        if result.shape:
            raise Untraceable("a function of math of an array")
        finite = _Numpy.isfinite(graph, result)
        for value in arguments:
            given = traced(graph, value)
            nan = elementwise(graph, "ne", given, given)
            infinite = elementwise(graph, "eq", elementwise(graph, "absolute", given), np.inf)
            passed = elementwise(graph, "and", infinite, elementwise(graph, "eq", result, result))
            finite = elementwise(graph, "or", finite, elementwise(graph, "or", nan, passed))
        if finite.only.op != "const" or not finite.only.data:
            graph.guards.append(finite.only)

    def _builtin(self, name: str, real: Any) -> Any:
        if name == "float":
            return lambda value=0.0: value if isinstance(value, Tracer) else float(value)
        if name in ("min", "max"):
            return lambda *values, **options: self._extreme(name, values, options)
        if name == "__import__":
            return self._import
        if name in ("getattr", "hasattr"):
            checked = _for_numbers(real)
            return lambda thing, *rest: (
                real(thing, *rest) if type(thing) is _Object else checked(thing, *rest)
            )
        if name == "isinstance":
            return lambda thing, kind: _for_numbers(real)(_real(thing), kind)
        if name == "type":
            return lambda thing: _for_numbers(real)(_real(thing))
        is_error = isinstance(real, type) and issubclass(real, BaseException)
        plain = name in _SAFE or is_error or not callable(real) or name == "__build_class__"
        return real if plain else _for_numbers(real)

    def _extreme(self, name: str, values: Any, options: Any) -> Any:
        """Python's min and max: the first of those that no other is beyond."""
        values = list(values[0]) if len(values) == 1 else list(values)
        if not holds_tracers(values):
            return getattr(builtins, name)(values, **options)
        if options or any(isinstance(v, Tracer) and v.shape for v in values):
            raise Untraceable(f"{name} of arrays, or with {', '.join(options)}")
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


class _Object:
    """An object of somebody's class: what its methods read is replaced as well."""

    def __init__(self, real: Any, stage: Stage) -> None:
        self.__dict__.update(_real=real, _stage=stage)

    def __getattr__(self, name: str) -> Any:
        real, stage = self.__dict__["_real"], self.__dict__["_stage"]
        found = inspect.getattr_static(type(real), name, None)
        if name in getattr(real, "__dict__", {}) and not isinstance(found, property):
            return stage.instead(getattr(real, name))  # its own is what Python finds first
        if isinstance(found, property | functools.cached_property) and not _is_of_a_library(real):
            getter = found.fget if isinstance(found, property) else found.func
            return stage.copied(getter)(self)
        if isinstance(found, FunctionType) and not _is_of_a_library(real):
            return functools.partial(stage.copied(found), self)
        return stage.instead(getattr(real, name))

    def __setattr__(self, name: str, value: Any) -> None:
        raise Untraceable("a function that changes an object")

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self._stage._called_object(self._real)(*arguments, **options)


def _real(thing: Any) -> Any:
    return thing.__dict__["_real"] if type(thing) is _Object else thing


def _is_of_a_library(thing: Any) -> bool:
    """Whether a function, or an object's class, is one of a well-known library."""
    module = getattr(thing, "__module__", None) or type(thing).__module__
    return module.partition(".")[0] in _LIBRARIES


def _constant(name: str, real: Any) -> Any:
    """Return a function or module of a library, for constants alone."""
    return _Module(real, _constant) if isinstance(real, ModuleType) else _for_numbers(real)


def _for_numbers(real: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that refuses tracers."""

    def function(*arguments: Any, **options: Any) -> Any:
        every = (*arguments, *options.values())
        if any(map(holds_tracers, every)) or any(type(v) is _Object for v in every):
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
        if not holds_tracers(array):
            return np.zeros_like(array)
        array = traced(graph, array)
        _ = array.dtype  # which refuses all but floats
        return full(graph, array.shape, 0.0)

    empty_like = zeros_like

    @staticmethod
    def ones_like(graph, array):
        return elementwise(graph, "add", _Numpy.zeros_like(graph, array), 1.0)

    @staticmethod
    def array(graph, values, dtype=None):
        if not holds_tracers(values) and np.array(values, dtype).dtype != float:
            return np.array(values, dtype)  # an array of integers rounds what it is assigned
        _only_floats(dtype)
        made = traced(graph, values).copy()
        if not made.shape or all(e.kind != "f" for e in made.cells.flat):
            raise Untraceable("an array without axes, or of integers or truth values")
        return made

    @staticmethod
    def asarray(graph, values, dtype=None):
        if not isinstance(values, Tracer) or not values.shape:
            return _Numpy.array(graph, values, dtype)
        if dtype is not None:
            _only_floats(dtype)
            _ = values.dtype  # which refuses all but floats
        return values

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
        if axis not in (0, -1):
            raise Untraceable("arrays that are concatenated along another axis")
        return concatenated(graph, [traced(graph, p) for p in parts])

    @staticmethod
    def hstack(graph, parts):
        parts = [traced(graph, p) for p in parts]
        return concatenated(graph, [p if p.shape else p.reshape(1) for p in parts])

    @staticmethod
    def append(graph, array, values):
        return _Numpy.hstack(graph, [traced(graph, v).reshape(-1) for v in (array, values)])

    @staticmethod
    def atleast_1d(graph, values):
        array = traced(graph, values)
        return array if array.shape else array.reshape(1)

    @staticmethod
    def ravel(graph, values):
        return traced(graph, values).reshape(-1)

    @staticmethod
    def reshape(graph, values, shape):
        return traced(graph, values).reshape(shape)

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
