"""Objects that NumPy makes arrays of, by methods of their classes: `__array__`, or as lists."""

import inspect
from types import FunctionType
from typing import Any

from .graph import Untraceable

_RULING = ("__array_ufunc__", "__array_function__", "__array_interface__", "__array_struct__")
_OF_LISTS = ("__len__", "__getitem__")


def array_protocol(cls: type) -> tuple[str, ...]:
    """Return the methods by which NumPy makes an array of an object; none if it has no such."""
    if any(hasattr(cls, name) for name in _RULING) or cls.__module__.startswith(__package__ or "."):
        return ()
    if _is_written(cls, "__array__"):
        return ("__array__",)
    if not all(_is_written(cls, name) for name in _OF_LISTS):
        return ()
    return (*_OF_LISTS, "__iter__") if _is_written(cls, "__iter__") else _OF_LISTS


def _is_written(cls: type, name: str) -> bool:
    return isinstance(inspect.getattr_static(cls, name, None), FunctionType)


def without_objects(value: Any) -> Any:
    """Return a value, or a list, with the arrays of the objects in it."""
    if type(value) in (list, tuple):
        return type(value)(map(without_objects, value))
    return parts_of_object(value) if array_protocol(_class_of(value)) else value


def _class_of(value: Any) -> type:
    is_staged = hasattr(type(value), "_forwards")
    return type(value.__dict__["_real"] if is_staged else value)


def is_asked_for_copies(value: Any) -> bool:
    """Whether NumPy leaves it to an object to copy the array that it returns."""
    cls = _class_of(value)
    return array_protocol(cls) == ("__array__",) and "copy" in _parameters(cls)


def _parameters(cls: type) -> tuple[str, ...]:
    return tuple(inspect.signature(cls.__array__).parameters)  # type: ignore[attr-defined]


def parts_of_object(value: Any, *, copy: bool = False) -> Any:
    """Return the array, or the list, that NumPy asks an object for."""
    methods = array_protocol(_class_of(value))
    if "__iter__" in methods:
        return list(value)
    if methods == _OF_LISTS:
        return [value[k] for k in range(len(value))]
    if not methods:
        raise Untraceable(f"values of type {type(value).__name__}")
    array = value.__array__(copy=True) if copy else value.__array__()
    if not hasattr(array, "shape"):
        raise Untraceable(f"values of type {type(value).__name__}")
    return array
