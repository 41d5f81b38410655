"""Modules, objects, classes and ufuncs, as a traced function sees them."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
import itertools
import logging
from collections import OrderedDict
from collections.abc import Callable
from types import FunctionType, MappingProxyType, ModuleType
from typing import Any, Protocol

import numpy as np

from .arrays import Special, Tracer, scalar, traced
from .graph import Graph, MessageWritten, Untraceable
from .library.laws import LAW_METHODS, FrozenLaw, is_law, of_law
from .library.rotations import enter_rotations
from .library.rows import chosen_rows, is_table
from .library.sparse import is_sparse, product_of
from .library.table import (
    UFUNC_OPERATIONS,
    WRITTEN,
    constant_value,
    of_ufunc,
    unwrapped,
    written_out,
)
from .operators import elementwise
from .registers import Kept

DICTS = (dict, OrderedDict, MappingProxyType)  # whose items are replaced like themselves
LIBRARIES = ("numpy", "scipy", "numba", "pandas", "json", "re")


_PLACES = ("loc", "iloc", "at", "iat")  # of a table of pandas: what is indexed


class OnStage(Protocol):
    """What stands for modules, classes and objects asks of the stage that it stands on."""

    graph: Graph
    classes: dict[type, type]
    kept: Kept

    def copied(self, function: object) -> Any:
        """Return a copy of a function whose global names and closure lead to the stage."""

    def called_object(self, thing: object) -> Any:
        """Return what calls a method, a `functools.partial`, or an object."""

    def instead(self, value: object) -> Any:
        """Return what stands for a value that was there before."""

    def fresh(self, value: Any) -> Any:
        """Return constants that a library has made: arrays as those of expressions."""

    def for_numbers(self, real: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that takes constants, and refuses tracers."""
        ...


def holds_tracers(value: object) -> bool:
    """Whether there are tracers in a value, or in a list, tuple or dict."""
    if isinstance(value, dict):
        return any(map(holds_tracers, value.values()))
    if isinstance(value, list | tuple | set):
        return any(map(holds_tracers, value))
    return isinstance(value, Tracer | Special | StagedObject)


def settled(value: Any) -> Any:
    """Return a value with arrays and numbers for what is constant."""
    if isinstance(value, Tracer):
        return constant_value(value)
    if type(value) in (list, tuple):
        return type(value)(map(settled, value))
    return (
        value.__dict__["_real"] if type(value) in (StagedObject, StagedType) else unwrapped(value)
    )


def is_of_a_library(thing: object) -> bool:
    """Whether a function, or an object's class, is one of a well-known library."""
    module = getattr(thing, "__module__", None) or type(thing).__module__
    return module.partition(".")[0] in LIBRARIES


class StagedModule:
    """A module whose functions are replaced."""

    def __init__(self, real: object, function: Callable[[str, Any], Any]) -> None:
        self._real, self._function = real, function

    def __getattr__(self, name: str) -> Any:
        real = getattr(self._real, name)
        unwrapped = not (callable(real) or isinstance(real, ModuleType | np.ndarray)) and (
            real is not np.r_ and real is not np.c_
        )
        return real if unwrapped else self._function(name, real)


class Messages:
    """What writes messages: a trace that reaches one ends, unless its level is off."""

    def __init__(self, real: logging.Logger) -> None:
        self._real = real

    def __call__(self, *_: object, **__: object) -> None:
        raise MessageWritten("a message is written")

    def __getattr__(self, name: str) -> Any:
        level = logging.getLevelName(name.upper())
        is_off = isinstance(level, int) and not self._real.isEnabledFor(level)
        return (lambda *_, **__: None) if is_off else self


class StagedType:
    """A class of a library: what it makes of constants is an object of the library."""

    def __init__(self, real: object, stage: OnStage) -> None:
        self.__dict__.update(_real=real, _stage=stage)

    def __call__(self, *arguments: object, **options: object) -> Any:
        written, given = WRITTEN.get(self._real), [*arguments, *options.values()]
        if written is not None and (
            self._real in (np.vectorize, np.matrix) or holds_tracers(given)
        ):
            return written(self._stage.graph, *arguments, **options)
        return self._stage.for_numbers(self._real)(*arguments, **options)

    def __getattr__(self, name: str) -> Any:
        real, stage = self.__dict__["_real"], self.__dict__["_stage"]
        if real.__module__.startswith("scipy.spatial.transform"):
            enter_rotations()
        written = WRITTEN.get((real, name))
        attribute = getattr(real, name)
        if written is None:
            return stage.for_numbers(attribute) if callable(attribute) else attribute
        return functools.partial(written, stage.graph)


_ABSENT = object()


class StagedObject:
    """An object of somebody's class: what its methods read is replaced as well."""

    __hash__ = None  # type: ignore[assignment]
    _forwards = True

    def __init__(self, real: object, stage: OnStage) -> None:
        self.__dict__.update(_real=real, _stage=stage)

    def __getattr__(self, name: str) -> Any:
        real, stage = self.__dict__["_real"], self.__dict__["_stage"]
        if stage.kept.has(real, name):
            return stage.kept.read(real, name)
        attribute = inspect.getattr_static(type(real), name, None)
        if name in getattr(real, "__dict__", {}) and not isinstance(attribute, property):
            return stage.instead(getattr(real, name))  # its own is what Python finds first
        if isinstance(attribute, property | functools.cached_property) and not is_of_a_library(
            real
        ):
            getter = attribute.fget if isinstance(attribute, property) else attribute.func
            return stage.copied(getter)(self)
        if isinstance(attribute, functools._lru_cache_wrapper):
            return functools.partial(stage.instead(attribute), self)
        of_formula = is_law(real) and name.startswith("_")  # of a family: SciPy's, in Python
        if isinstance(attribute, FunctionType) and (of_formula or not is_of_a_library(real)):
            return functools.partial(stage.copied(attribute), self)
        if is_law(real) and name in LAW_METHODS:
            return functools.partial(_of_held_law, self, name)
        if name == "ev" and is_of_a_library(real):  # a spline of two variables, point by point
            return functools.partial(self, grid=False)
        if name == "dot" and is_sparse(real):
            return functools.partial(_operated, self, "dot")
        if name in _PLACES and is_of_a_library(real):
            return StagedObject(getattr(real, name), stage)
        written = WRITTEN.get((type(real).__name__, name)) if is_of_a_library(real) else None
        if written is not None:
            return functools.partial(written, stage.graph)
        if is_of_a_library(real) and callable(getattr(real, name)):
            return stage.for_numbers(getattr(real, name))
        finder = inspect.getattr_static(type(real), "__getattr__", None)
        is_missing = inspect.getattr_static(real, name, _ABSENT) is _ABSENT
        if is_missing and isinstance(finder, FunctionType) and not is_of_a_library(real):
            return stage.copied(finder)(self, name)
        return stage.instead(getattr(real, name))

    def __setattr__(self, name: str, value: object) -> None:
        real, stage = self.__dict__["_real"], self.__dict__["_stage"]
        attribute = inspect.getattr_static(type(real), name, None)
        if isinstance(attribute, property) and not is_of_a_library(real):
            stage.copied(attribute.fset)(self, value)
        else:
            stage.kept.write(real, name, value)

    def __delattr__(self, name: str) -> None:
        raise Untraceable("a function that deletes a field of an object")

    def __call__(self, *arguments: object, **options: object) -> Any:
        if is_law(self._real) and holds_tracers([*arguments, *options.values()]):
            return FrozenLaw(self._stage.graph, self, arguments, options)
        return self._stage.called_object(self._real)(*arguments, **options)


def of_fields(stage: OnStage, function: Any, thing: Any, **changes: object) -> Any:
    """Return what a function of `dataclasses` makes, also of an object that was there before."""
    real = getattr(thing, "__dict__", {}).get("_real")
    if stage.kept.holds(real):
        raise Untraceable("fields of an object that is written into")
    fields = dataclasses.fields(thing if real is None else real)
    parts = {f.name: getattr(thing, f.name) for f in fields}
    if real is not None and function is dataclasses.replace:
        given = {f.name: parts[f.name] for f in fields if f.init}
        return stage.instead(type(real))(**{**given, **changes})
    if real is not None:
        return stage.instead(function(real, **changes))
    plain = all(isinstance(v, Tracer | int | float | str) for v in parts.values())
    if function is dataclasses.replace or changes or not plain:
        return stage.copied(function)(thing, **changes)
    copies = {k: v.copy() if getattr(v, "shape", ()) else v for k, v in parts.items()}
    return copies if function is dataclasses.asdict else tuple(copies.values())


def _of_held_law(law: StagedObject, name: str, x: Any, *numbers: Any, **named: Any) -> Any:
    """Return a function of a law of probability, which may have its numbers already."""
    real, stage = law.__dict__["_real"], law.__dict__["_stage"]
    if not holds_tracers([x, *numbers, *named.values()]):
        return stage.for_numbers(getattr(real, name))(x, *numbers, **named)
    if not hasattr(real, "dist"):
        return of_law(stage.graph, law, name, x, *numbers, **named)
    return of_law(stage.graph, StagedObject(real.dist, stage), name, x, *real.args, **real.kwds)


def _forwarded(name: str) -> Callable[..., Any]:
    """Return an operator of an object: its class's own, on the stage."""

    def method(self: StagedObject, *rest: object) -> Any:
        real, stage = self.__dict__["_real"], self.__dict__["_stage"]
        attribute = inspect.getattr_static(type(real), name, None)
        if isinstance(attribute, FunctionType) and not is_of_a_library(real):
            return stage.copied(attribute)(self, *rest)
        if name in ("__eq__", "__ne__") and attribute is inspect.getattr_static(object, name):
            return (self is rest[0]) == (name == "__eq__")
        if name in ("__eq__", "__ne__"):
            raise Untraceable(f"comparison of an object of {type(real).__name__}")
        if name == "__iter__" and hasattr(real, "__iter__"):
            return iter([stage.instead(v) for v in real])
        if name == "__len__" and hasattr(real, "__len__"):
            return len(real)
        if name == "__len__":  # as Python says; list() asks, and takes it for an answer
            raise TypeError(f"object of type {type(real).__name__} has no len()")
        if name == "__getitem__" and is_table(real) and holds_tracers(settled(rest[0])):
            return chosen_rows(stage.graph, real, rest[0])
        if name == "__getitem__" and hasattr(real, "__getitem__"):
            return stage.instead(real[settled(rest[0])])
        if name == "__bool__":
            return bool(real)
        if len(rest) == 1 and is_of_a_library(real):
            return _operated(self, name, rest[0])
        raise Untraceable(f"{name} of an object of {type(real).__name__}")

    return method


def _operated(thing: StagedObject, name: str, other: Any) -> Any:
    """Return what an operator of an object of a library makes of another operand."""
    real, stage = thing.__dict__["_real"], thing.__dict__["_stage"]
    known = settled(other)
    if not holds_tracers(known) and hasattr(real, name):
        result = getattr(real, name)(known)
        if result is not NotImplemented:
            return stage.fresh(result)
    if not is_sparse(real):
        raise Untraceable(f"{name} of an object of {type(real).__name__}")
    return product_of(stage.graph, real, name, other)


for _name in ("add", "sub", "mul", "truediv", "matmul", "pow", "mod", "floordiv"):
    for _kind in ("", "r"):
        _full = f"__{_kind}{_name}__"
        setattr(StagedObject, _full, _forwarded(_full))
for _name in ("neg", "pos", "abs", "invert", "eq", "ne", "lt", "le", "gt", "ge", "iter", "len",
              "getitem", "contains", "bool", "enter", "exit"):  # fmt: skip
    setattr(StagedObject, f"__{_name}__", _forwarded(f"__{_name}__"))


class StagedParent:
    """What ``super()`` is in a method of somebody's object."""

    def __init__(self, thing: StagedObject, stage: OnStage, cls: type) -> None:
        original = {copied: real for real, copied in stage.classes.items()}.get(cls, cls)
        order = type(thing.__dict__["_real"]).__mro__
        self.__dict__.update(_thing=thing, _stage=stage, _rest=order[order.index(original) + 1 :])

    def __getattr__(self, name: str) -> Any:
        for cls in self.__dict__["_rest"]:
            if name in vars(cls):
                return self._bound(vars(cls)[name])
        raise AttributeError(name)

    def _bound(self, attribute: object) -> Any:
        thing, stage = self.__dict__["_thing"], self.__dict__["_stage"]
        if isinstance(attribute, FunctionType):
            return functools.partial(stage.copied(attribute), thing)
        if isinstance(attribute, property):
            return stage.copied(attribute.fget)(thing)
        return stage.instead(
            attribute.__func__ if isinstance(attribute, staticmethod) else attribute
        )


_REDUCING = {"add": np.sum, "multiply": np.prod, "maximum": np.max, "minimum": np.min,
             "logical_and": np.all, "logical_or": np.any}  # fmt: skip
_ACCUMULATING = {"add": np.cumsum, "multiply": np.cumprod}


class Ufunc:
    """A function of NumPy or SciPy, element by element."""

    def __init__(self, graph: Graph, real: np.ufunc, unwrapped: Callable[..., Any]) -> None:
        self.graph, self.real, self.plain = graph, real, unwrapped

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        if not holds_tracers([*arguments, *options.values()]):
            return self.plain(*arguments, **options)
        options = {k: unwrapped(v) for k, v in options.items()}
        return of_ufunc(self.graph, self.real, self._written, arguments, options)

    def _written(self, *arguments: Any) -> Any:
        if self.real in WRITTEN:
            return WRITTEN[self.real](self.graph, *arguments)
        name = UFUNC_OPERATIONS[self.real.__name__]
        if name == "power":
            return _base(self.graph, arguments[0]) ** arguments[1]
        return elementwise(self.graph, name, *arguments)

    def reduce(self, values: Any, axis: object = 0, **options: Any) -> Any:
        """Return what is left of an array when two elements become one."""
        if not holds_tracers(values):
            return self.plain_method("reduce", values, axis, **options)
        if self.real.__name__ in _REDUCING:
            return written_out(self.graph, _REDUCING[self.real.__name__], values, axis, **options)
        if options or axis != 0:
            raise Untraceable(f"{self.real.__name__}.reduce with other arguments")
        return functools.reduce(self, list(traced(self.graph, values)))

    def plain_method(self, name: str, *values: object, **options: object) -> Any:
        """Return what a method of NumPy's makes of constants."""
        return getattr(self.real, name)(*map(settled, values), **options)

    def accumulate(self, values: Any, axis: object = 0) -> Any:
        """Return all that is left on the way."""
        if not holds_tracers(values):
            return self.plain_method("accumulate", values, axis)
        array = traced(self.graph, values)
        if self.real.__name__ in _ACCUMULATING:
            return written_out(self.graph, _ACCUMULATING[self.real.__name__], array, axis)
        if axis != 0:
            raise Untraceable(f"{self.real.__name__}.accumulate along another axis")
        return traced(self.graph, list(itertools.accumulate(array, self)))

    def outer(self, a: Any, b: Any) -> Any:
        """Return all results of an element of one and of the other."""
        a, b = _base(self.graph, a), _base(self.graph, b)
        return self(a.reshape(a.shape + (1,) * b.ndim), b)

    def at(self, array: Any, indices: Any, *others: Any) -> None:
        """Change elements in place, one after the other: a place may come several times."""
        known = settled(indices)
        if not isinstance(array, Tracer) or holds_tracers(known):
            raise Untraceable(f"{self.real.__name__}.at of places that depend on the state")
        places = np.arange(array.size).reshape(array.shape)[known]
        values = [traced(self.graph, v).elements() for v in others]
        if any(v.shape not in ((), np.shape(places)) for v in values):  # NumPy 2.4 reads beyond
            raise Untraceable(f"{self.real.__name__}.at of values that are repeated")
        given = [np.broadcast_to(v, np.shape(places)).ravel() for v in values]
        for k, place in enumerate(np.ravel(places)):
            key = tuple(map(int, np.unravel_index(place, array.shape)))
            array[key] = self(array[key], *(scalar(self.graph, v[k]) for v in given))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.real, name)


def _base(graph: Graph, value: object) -> Any:

    return value if isinstance(value, Special) else traced(graph, value)


def errstate(**how: Any) -> Any:
    """Return what says how NumPy reports errors, unless it raises or calls something."""
    if not {"ignore", "warn", None}.issuperset(how.values()):
        raise Untraceable("NumPy's errors as errors of Python's")
    return np.errstate(**how)


def without_warnings(*_: object, **__: object) -> Any:
    """Return a context in which nothing is said about warnings: expressions give none."""
    return contextlib.nullcontext()


def suppressed(*_: object) -> Any:
    """Refuse what the words of a function do not show."""
    raise Untraceable("contextlib.suppress under a name that is not global")
