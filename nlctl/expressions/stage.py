"""What a traced function finds instead of NumPy, math and the builtins.

Functions are traced as copies whose global names lead here.  What has no
place here refuses tracers, and the function is then called instead of traced.
"""

from __future__ import annotations

import builtins
import cmath
import collections
import contextlib
import dataclasses
import enum
import functools
import inspect
import logging
import math
import typing
import warnings
from collections.abc import Callable, Iterator
from fractions import Fraction
from types import BuiltinFunctionType, CellType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ..upstream.numba_internals import CPUDispatcher
from . import staged
from .arrays import Special, Tracer, python_number, scalar, traced
from .functions import MATH
from .gains import computes_gains
from .graph import Graph, Untraceable, numpy_function
from .library.creation import Joined, whole_numbers
from .library.linear_maps import enter_linear_maps
from .library.python import NUMBER_SAMPLES, Builtins, of_math
from .library.rotations import enter_rotations, turn_of
from .library.special import enter_scipy
from .library.splines import called_object, enter_splines
from .library.table import ARRAY_MAKERS, UFUNC_OPERATIONS, WRITTEN, NumberType, boxed, unwrapped
from .operators import elementwise
from .registers import Entries, Kept
from .rewritten import NumberKeys, followable_code, names_for
from .roots import roots
from .source import cells_of, codes_in, in_cell, is_dispatcher

_RAW = (bool, int, float, complex, str, bytes, type(None), np.generic, range, slice, Fraction)
_OPERATORS = ("_functools", "_operator", "operator", "functools", "itertools")
_OF_MATRICES = ("numpy.linalg", "scipy.linalg")  # what they return is nobody else's
_ITERATING = ("math", "statistics", "heapq")  # what takes generators as it takes lists
_KEPT = ("__dict__", "__weakref__", "__slots__")  # of a class: what Python makes itself
_OF_TUPLES = frozenset(vars(collections.namedtuple("_Tuple", ())))  # what Python makes of one
_LARGE = 65536  # elements of an array that stays as it is


class Stage:
    """Everything that a traced function sees instead of the real thing."""

    def __init__(self, graph: Graph, kept: Kept | None = None, *, merging: bool = False) -> None:
        self.graph, self.merging, self.kept = graph, merging, kept or Kept(graph)
        self._copies: dict[int, tuple[Any, Any]] = {}
        self.classes: dict[type, type] = {}
        self._objects: dict[int, tuple[Any, Any]] = {}
        self._around: dict[int, tuple[Any, Any]] = {}
        self.numpy = staged.StagedModule(np, self._library)
        self.math = staged.StagedModule(math, self._math_function)
        self.cmath = staged.StagedModule(cmath, self._library)
        self._builtins = Builtins(self).namespace(self._import)

    def copied(self, function: object) -> Any:
        """Return a copy of a function whose global names and closure lead to the stage."""
        function = getattr(function, "py_func", function)
        if not isinstance(function, FunctionType):
            return self.called_object(function)
        if id(function) not in self._copies:
            around: dict[str, Any] = function.__globals__
            names = self._shared(around, dict)
            names |= {"__builtins__": self._builtins, "__package__": around.get("__package__")}
            names["__name__"] = function.__module__  # of classes that are defined inside
            cells = tuple(self._shared(cell, CellType) for cell in function.__closure__ or ())
            defaults = tuple(map(self.instead, function.__defaults__ or ()))
            is_users = not staged.is_of_a_library(function)
            code = followable_code(function, self.merging) if is_users else function.__code__
            names.update(names_for(self.graph, self._builtins["type"]))
            copy = FunctionType(code, names, function.__name__, defaults, cells)
            self._copies[id(function)] = (function, copy)  # before what may refer back to it
            keywords = (function.__kwdefaults__ or {}).items()
            copy.__kwdefaults__ = {k: self.instead(v) for k, v in keywords}
            vars(copy).update({k: self.instead(v) for k, v in vars(function).items()})
            inside = codes_in(function.__code__)
            for name in (name for code in inside for name in code.co_names):
                if name in around and name not in names:
                    value = self.instead(around[name])
                    names[name] = self.kept.variable(around, name, names, value)
            for cell, (name, given) in zip(cells, cells_of(function).items(), strict=True):
                if in_cell(cell, cell) is cell:
                    value = self.instead(given.cell_contents)
                    cell.cell_contents = self.kept.variable(given, name, cell, value)
        return self._copies[id(function)][1]

    def _shared(self, thing: Any, make: Callable[[], Any]) -> Any:
        """Return what stands for a module's names or a cell, the same in all functions there."""
        return self._around.setdefault(id(thing), (thing, make()))[1]

    def called_object(self, thing: object) -> Any:
        """Return what calls a method, a `functools.partial`, or an object."""
        if isinstance(thing, MethodType):
            if staged.is_of_a_library(thing.__func__):
                return self.for_numbers(thing)
            return functools.partial(self.copied(thing.__func__), self.instead(thing.__self__))
        if isinstance(thing, functools.partial):
            keywords = {k: self.instead(v) for k, v in thing.keywords.items()}
            first = map(self.instead, thing.args)
            return functools.partial(self.instead(thing.func), *first, **keywords)
        call = inspect.getattr_static(type(thing), "__call__", None)
        if staged.is_of_a_library(thing) and callable(thing):
            return self._call_of_a_library(thing)
        if isinstance(call, FunctionType):
            return functools.partial(self.copied(call), self.instead(thing))
        raise Untraceable(f"{thing!r} is not a plain function")

    def _call_of_a_library(self, thing: Any) -> Any:
        of_numbers = self.for_numbers(thing)

        def function(*arguments: object, **options: object) -> Any:
            given = staged.settled(arguments)
            if not staged.holds_tracers([*given, *options.values()]):
                return of_numbers(*given, **options)
            return boxed(thing, None, called_object(self.graph, thing, *arguments, **options))

        return function

    def instead(self, value: Any) -> Any:
        """Return what stands for a value that was there before."""
        if value is np or value is math or value is cmath:
            return self.numpy if value is np else self.math if value is math else self.cmath
        if isinstance(value, ModuleType):
            inside = value.__name__.partition(".")[0] in staged.LIBRARIES
            return staged.StagedModule(
                value, self._library if inside else lambda _, v: self.instead(v)
            )
        if type(value) is np.ndarray:
            return self.kept.elements(value, self.fresh)
        if type(value) is np.matrix:
            return WRITTEN[np.matrix](self.graph, value)
        if type(value) in _RAW or isinstance(value, np.generic | Tracer | Special | enum.Enum):
            return value
        if isinstance(value, logging.Logger) or value is warnings.warn:
            return staged.Messages(value)
        if value is warnings.simplefilter or value is warnings.filterwarnings:
            return staged.without_warnings
        if isinstance(value, type):
            return self._type(value)
        if type(value) in (list, tuple):
            return self.kept.elements(value, lambda v: type(v)(map(self.instead, v)))
        if type(value) in staged.DICTS:
            parts = {k: self.instead(v) for k, v in value.items()}
            if self.kept.holds(value):
                return Entries(self.kept, value, parts)
            return NumberKeys(parts) if all(isinstance(k, int | float) for k in parts) else parts
        if isinstance(value, BuiltinFunctionType):
            return self._instead_of_builtin(value)
        if isinstance(value, np.ufunc) or (callable(value) and self._is_known(value)):
            return self._library("", value)
        if isinstance(value, np.vectorize):
            return self._vectorized(value)
        if _is_column(value):
            return self._column(value)
        return self._instead_of_object(value)

    def _column(self, value: Any) -> Any:
        """Return a column of numbers of pandas: an array, and by labels its elements."""
        array = self.fresh(np.array(value, dtype=float))
        if isinstance(array, Tracer):
            array.is_column = hasattr(value, "iloc")
        if isinstance(array, Tracer) and hasattr(value, "index") and value.index.is_unique:
            array.labels = {k: i for i, k in enumerate(value.index) if isinstance(k, str)}
        return array

    def _is_known(self, value: object) -> bool:
        module = getattr(value, "__module__", None) or ""
        foreign = isinstance(value, np.ufunc) and getattr(np, value.__name__, None) is not value
        if foreign or module.startswith(
            ("scipy.special", "scipy.linalg", "scipy.integrate", "scipy.spatial.distance")
        ):
            enter_scipy()
        if module.startswith("scipy.interpolate"):
            enter_splines()
        if module.startswith(("scipy.integrate", "scipy.signal", "scipy.ndimage", "scipy.fft")):
            enter_linear_maps()
        try:
            return value in WRITTEN
        except TypeError:  # it has no hash
            return False

    def _instead_of_builtin(self, value: Any) -> Any:
        owner, name = getattr(value, "__self__", None), value.__name__
        if self.kept.holds(owner):
            raise Untraceable(f"{name}() of what a function writes, under another name")
        if owner is math:
            return getattr(self.math, name)
        if owner is builtins:
            return self._builtins[name]
        if self._is_known(value):
            return self._library(name, value)
        if isinstance(owner, ModuleType) and owner.__name__ in _OPERATORS:
            return value  # they use operators, as what they are given has them
        return self.for_numbers(value)

    def _instead_of_object(self, value: object) -> Any:
        if isinstance(value, functools.partial | MethodType):
            return self.called_object(value)
        if is_dispatcher(value):
            return functools.partial(self._dispatched, value)
        if isinstance(value, CPUDispatcher | FunctionType):
            if value in (dataclasses.dataclass, collections.namedtuple, typing.NamedTuple):
                return value  # they look at types, defaults and names alone
            if value is dataclasses.fields:
                return lambda thing: value(staged.settled(thing))
            if value in (dataclasses.replace, dataclasses.asdict, dataclasses.astuple):
                return functools.partial(staged.of_fields, self, value)
            if staged.is_of_a_library(value):
                return self._library("", value)
            return self.for_numbers(value) if computes_gains(value) else self.copied(value)
        if isinstance(value, functools._lru_cache_wrapper):
            return self.instead(value.__wrapped__)
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            cls: Any = self._copied_tuple(type(value))
            return cls._make(map(self.instead, value))
        if type(value).__module__ in _OPERATORS:
            return value  # itemgetter and its kind
        if staged.is_of_a_library(value) and callable(value) and hasattr(value, "__wrapped__"):
            return self.for_numbers(value)  # a function of NumPy
        if type(value).__module__.startswith("scipy.spatial.transform") and (
            type(value) is enter_rotations()
        ):
            return turn_of(self.graph, value)
        if id(value) not in self._objects:  # one and the same: it may be asked with `is`
            self._objects[id(value)] = (value, staged.StagedObject(value, self))
        return self._objects[id(value)][1]

    def _vectorized(self, value: Any) -> Any:
        """Return what `np.vectorize` has made of somebody's function."""
        if value.signature is not None or value.excluded or value.cache:
            raise Untraceable("np.vectorize with other arguments")
        return WRITTEN[np.vectorize](self.graph, self.instead(value.pyfunc), value.otypes)

    def _dispatched(self, function: Any, first: Any, *rest: object, **options: object) -> Any:
        """Return what a function returns that the type of its first argument chooses."""
        functions = set(map(function.dispatch, self._kinds(first)))
        if len(functions) > 1:
            raise Untraceable("a choice by the type of a number")
        return self.copied(functions.pop())(first, *rest, **options)

    def _kinds(self, value: object) -> list[type]:
        """Return the types that a value may have."""
        if isinstance(value, Tracer):
            return (
                [np.ndarray]
                if value.is_array
                else [type(v) for v in NUMBER_SAMPLES[value.only.kind]]
            )
        cls = type(staged.settled(value))
        return [next((real for real, copied in self.classes.items() if copied is cls), cls)]

    def parent(self, thing: Any, cls: type) -> Any:
        """Return what ``super()`` is in a method of somebody's object."""
        return staged.StagedParent(thing, self, cls)

    def _import(self, name: str, *rest: Any) -> Any:
        return self.instead(builtins.__import__(name, *rest))

    # -- libraries ---------------------------------------------------------------------------------

    def _library(self, name: str, real: object) -> Any:
        """Return a function or module of a library: its own version here, or for constants."""
        if isinstance(real, ModuleType):
            return staged.StagedModule(real, self._library)
        if isinstance(real, type):
            return self._type(real)
        if real is np.r_ or real is np.c_:
            return Joined(self.graph, real)
        if not callable(real):
            return real
        if type(real).__module__.startswith("scipy.stats"):  # a family of laws
            return self._instead_of_object(real)
        if (getattr(real, "__module__", None) or "").startswith("scipy.optimize"):
            search = roots().get(real)
            return self.for_numbers(real) if search is None else self.copied(search)
        if isinstance(real, np.ufunc):
            self._is_known(real)
            is_written = real in WRITTEN or real.__name__ in UFUNC_OPERATIONS
            return staged.Ufunc(self.graph, real, self.for_numbers(real)) if is_written else (
                self.for_numbers(real)
            )  # fmt: skip
        return self._written(real) if self._is_known(real) else self.for_numbers(real)

    def _written(self, real: Any) -> Callable[..., Any]:
        """Return a function of the table."""
        written, of_numbers, makes = WRITTEN[real], self.for_numbers(real), real in ARRAY_MAKERS
        module = getattr(real, "__module__", None) or ""
        folds, iterates = module.startswith(_OF_MATRICES), module in _ITERATING

        def function(*arguments: object, **options: object) -> Any:
            if iterates:
                arguments = tuple(list(v) if isinstance(v, Iterator) else v for v in arguments)
            given = [*staged.settled(arguments), *map(staged.settled, options.values())]
            if folds and not staged.holds_tracers(given):
                return of_numbers(*arguments, **options)
            if makes or staged.holds_tracers([*arguments, *options.values()]):
                options = {k: unwrapped(v) for k, v in options.items()}
                result = written(self.graph, *map(unwrapped, arguments), **options)
                return boxed(real, arguments[0] if arguments else None, result)
            return of_numbers(*arguments, **options)

        return function

    def for_numbers(self, real: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that takes constants, and refuses tracers."""

        def function(*arguments: object, **options: object) -> Any:
            every, named = (
                staged.settled(arguments),
                {k: staged.settled(v) for k, v in options.items()},
            )
            if staged.holds_tracers([*every, *named.values()]):
                function = inspect.unwrap(real) if callable(real) else real
                unwrapped = isinstance(function, FunctionType) and staged.is_of_a_library(function)
                written = function if unwrapped else None
                if written is None:
                    raise Untraceable(f"{_title(real)} is not known here")
                return self._traced_library(real, written, arguments, options)
            try:
                return self.fresh(real(*every, **named))
            except Exception as error:  # it has called a function of the user's, as `fsolve` does
                if any(map(callable, every)):
                    raise Untraceable(f"{_title(real)} is not known here") from error
                raise

        return function

    def _traced_library(
        self, real: object, written: FunctionType, given: tuple[Any, ...], named: Any
    ) -> Any:
        """Trace a function of a library that is plain Python as if it were somebody's."""
        try:
            return self.copied(written)(*given, **named)
        except Exception as error:  # whatever it does not expect of tracers
            raise Untraceable(f"{_title(real)} is not known here") from error

    def fresh(self, value: Any) -> Any:
        """Return constants that a library has made: arrays as those of expressions."""
        if type(value) is np.ndarray and value.dtype == float and value.ndim:
            try:
                return traced(self.graph, value) if value.size <= _LARGE else value
            except Untraceable:
                return value
        if type(value) in (list, tuple):
            return type(value)([self.fresh(v) for v in value])
        is_plain = isinstance(value, (*_RAW, np.ndarray, type)) or not staged.is_of_a_library(value)
        return value if is_plain else self._instead_of_object(value)

    def _math_function(self, name: str, real: Any) -> Any:
        if name not in MATH:
            return self._of_python(self._library(name, real))
        operation, of_numbers = MATH[name], self.for_numbers(real)
        count = numpy_function(operation).nin

        def function(*arguments: object) -> Any:
            if not staged.holds_tracers(arguments):
                return of_numbers(*arguments)
            if len(arguments) != count:
                return self._of_more(operation, function, arguments)
            if operation == "power":
                result = traced(self.graph, arguments[0]) ** arguments[1]
            else:
                result = elementwise(self.graph, operation, *arguments)
            return of_math(self.graph, operation, result, arguments)

        return function

    def _of_more(self, operation: str, one: Any, arguments: tuple[Any, ...]) -> Any:
        """Return a function of math of more arguments than NumPy's takes."""
        if operation == "log" and len(arguments) == 2:  # to a base
            return one(arguments[0]) / one(arguments[1])
        if operation == "hypot" and len(arguments) > 2:
            return functools.reduce(one, arguments)
        raise Untraceable(f"{operation} with other arguments")

    def _of_python(self, function: object) -> Any:
        """Return a function of math whose results are numbers of Python's own."""
        if not callable(function):
            return function

        def of_python(*arguments: object, **options: object) -> Any:
            result: Any = function(*arguments, **options)
            is_number = isinstance(result, Tracer) and not result.shape
            return python_number(self.graph, result.only) if is_number else result

        return of_python

    # -- classes -----------------------------------------------------------------------------------

    def _type(self, cls: type) -> Any:
        """Return a class: of somebody a copy whose methods lead here, of a library what makes."""
        if cls is np.float64:
            return NumberType(np.float64, self._float64)
        if cls is np.int64:
            return NumberType(np.int64, self._int64)
        if cls is np.errstate:
            return staged.errstate
        if cls is np.matrix:
            return staged.StagedType(cls, self)
        if cls is contextlib.suppress:
            return staged.suppressed
        if cls is warnings.catch_warnings:
            return staged.without_warnings
        raw = (BaseException, enum.Enum, np.generic, np.ndarray, np.ufunc)
        if cls is type or issubclass(cls, raw) or cls.__module__ in ("builtins", "abc", "typing"):
            return self._builtins[cls.__name__] if cls in (complex, float, int) else cls
        if staged.is_of_a_library(cls):
            return staged.StagedType(cls, self)
        if cls.__module__.partition(".")[0] in ("collections", "types", "decimal", "fractions",
                                                "functools", "itertools", "operator", "_operator",
                                                "numbers", "control", "nlctl"):  # fmt: skip
            return cls
        if issubclass(cls, tuple):
            return self._copied_tuple(cls)
        inherits = any(self._type(base) is not base for base in cls.__bases__)
        has_code = inherits or any(map(_has_code, vars(cls).values()))
        return self.copied_class(cls) if has_code else cls

    def _copied_tuple(self, cls: type) -> type:
        """Return a named tuple's class with methods that lead to the stage."""
        of_users = {k: v for k, v in vars(cls).items() if _has_code(v) and k not in _OF_TUPLES}
        if not of_users or not hasattr(cls, "_fields"):
            return cls
        if cls not in self.classes:
            self.classes[cls] = copied = type(cls.__name__, (cls,), {"__slots__": ()})
            for name, value in of_users.items():
                setattr(copied, name, self._member(value))
        return self.classes[cls]

    def _float64(self, value: object = 0.0) -> Any:
        """Return a number as one of NumPy's."""
        of_floats: Any = self._builtins["float"]
        number = of_floats.make(value)
        return scalar(self.graph, number.only) if isinstance(number, Tracer) else np.float64(number)

    def _int64(self, value: Any = 0) -> Any:
        """Return the integer that NumPy makes of a number."""
        is_traced = isinstance(value, Tracer)
        return whole_numbers(self.graph, value) if is_traced else np.int64(value)

    def copied_class(self, cls: type) -> type:
        """Return a copy of a class whose methods lead to the stage."""
        if cls not in self.classes:
            bases = tuple(self._type(b) for b in cls.__bases__)
            copied = type(cls)(cls.__name__, bases, {"__module__": cls.__module__})
            self.classes[cls] = copied
            slots = vars(cls).get("__slots__", ())
            for name, value in vars(cls).items():
                if name not in (*_KEPT, *((slots,) if isinstance(slots, str) else slots)):
                    type.__setattr__(copied, name, self._member(value))
        return self.classes[cls]

    def _member(self, value: object) -> Any:
        if isinstance(value, FunctionType):
            return self.copied(value)
        if isinstance(value, staticmethod | classmethod):
            return type(value)(self._member(value.__func__))
        if isinstance(value, property):
            parts = (value.fget, value.fset, value.fdel)
            return property(*(None if p is None else self._member(p) for p in parts))
        if isinstance(value, functools.cached_property):
            copied: Any = functools.cached_property(self._member(value.func))
            copied.__set_name__(copied, value.attrname or value.func.__name__)
            return copied
        return self.instead(value) if callable(value) or type(value) is np.ndarray else value


def _is_column(value: object) -> bool:
    """Whether a value is a column of numbers of pandas."""
    of_pandas = type(value).__module__.startswith("pandas") and getattr(value, "ndim", 0) == 1
    return of_pandas and getattr(value, "dtype", None) in (np.dtype(float), np.dtype(int))


def _has_code(value: object) -> bool:
    return isinstance(value, FunctionType | staticmethod | classmethod | property)


def _title(real: object) -> str:
    """Return a function's name as it is written."""
    module = (getattr(real, "__module__", None) or "").replace("numpy", "np")
    name = getattr(real, "__qualname__", None) or getattr(real, "__name__", repr(real))
    return f"{module}.{name}" if module and module != "builtins" else name
