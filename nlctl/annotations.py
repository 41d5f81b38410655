"""Arguments that are not what a function's annotations say: one check for all public functions.

Python and its libraries take what they can use and fail where they cannot, deep inside and in
their own words.  `as_annotated` looks at the arguments of a call that failed so: where one of them
is not what its annotation says, that is what the error says.  What works is not restricted, and
what a function refuses in its own words it refuses as before.
"""

from __future__ import annotations

import ast
import collections.abc
import functools
import importlib
import inspect
import math
import sys
import traceback
import types
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, TypeVar, Union

import numpy as np
import numpy.typing as npt

from .errors import DivergedError, ParameterError, UnknownKeywordError, UsageError
from .host.checkout import SOURCES
from .names import unknown

_F = TypeVar("_F", bound=Callable[..., Any])
_MANY = (collections.abc.Sequence, collections.abc.Collection, collections.abc.Iterable,
         collections.abc.Set, list, set, frozenset)  # fmt: skip
_SHOWN = 60  # characters of a value
_LARGEST = 2**63  # of integers that libraries take


def as_numbers(value: object) -> np.ndarray | None:
    """Return `value` as a float array, or None if it holds anything but real numbers."""
    try:
        array = np.asarray(value)
        if isinstance(value, np.ma.MaskedArray) and array.dtype.kind in "iuf":
            array = np.ma.filled(value.astype(float), np.nan)  # what is masked is not known
    except ValueError:  # rows of different lengths
        return None
    return array.astype(float) if array.dtype.kind in "iuf" else None


def as_annotated(function: _F) -> _F:
    """Let a function say which argument is not what its annotation says, where a call fails."""
    if isinstance(function, type):
        reported: Any = function
        reported.__init__ = reporting(reported.__init__, reported.__name__)
        return reported
    from .attributes import with_returned

    called = reporting(function, function.__name__)
    called.__doc__ = with_returned(function)
    return called


def reporting(
    function: Any, who: str, rule: Callable[[Mapping[str, Any]], str | None] | None = None
) -> Any:
    """Return a function that says which argument is not as annotated."""

    @functools.wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except (UsageError, DivergedError):
            raise
        except Exception as error:
            if isinstance(error, TypeError) and (refusal := _refusal(function, who, args, kwargs)):
                raise refusal from None
            if _says_it(error) or (rest := _complaint(function, who, args, kwargs, rule)) is None:
                raise
            raise ParameterError(rest) from error

    return called


_REPORTING = reporting(len, "len").__code__  # all of them share it


def unreported(function: Any) -> Any:
    """Return the function that a reporting one calls, and any other as it is."""
    while getattr(function, "__code__", None) is _REPORTING:
        cells = dict(zip(function.__code__.co_freevars, function.__closure__, strict=True))
        function = cells["function"].cell_contents
    return function


def _says_it(error: Exception) -> bool:
    """Whether an error says what is wrong: it names a file, or this project raises it."""
    if getattr(error, "filename", None):
        return True
    last = traceback.extract_tb(error.__traceback__)[-1]
    ours = any(Path(last.filename).is_relative_to(folder) for folder in SOURCES)
    return ours and (last.line or "").startswith("raise ")


def _refusal(
    function: Any, who: str, args: tuple[Any, ...], kwargs: Mapping[str, Any]
) -> Exception | None:
    """Return the error for an argument that a function does not take so, if there is one."""
    parameters = inspect.signature(function).parameters
    by_name = [name for name, one in parameters.items() if one.kind is one.KEYWORD_ONLY]
    if by_name and len(args) > 1 and set(parameters) - set(by_name) == {"self"}:
        return UnknownKeywordError(
            f"{who} takes its fields by name: {who}({', '.join(f'{name}=...' for name in by_name)})"
        )
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values()):
        return None
    known = [name for name in parameters if name != "self"]
    wrong = next((name for name in kwargs if name not in known), None)
    return (
        None
        if wrong is None
        else unknown("argument", wrong, known, f"of {who}", UnknownKeywordError)
    )


def _complaint(function: Any, who: str, args: Any, kwargs: Any, rule: Any) -> str | None:
    """Return in words which argument is not as annotated; None where all are."""
    signature, rules = inspect.signature(function), _annotations(function)
    try:
        bound = signature.bind(*args, **kwargs).arguments
    except TypeError:  # Python's own sentence says what is missing
        return None
    given: list[tuple[str, Any, Any]] = []
    for name, value in bound.items():
        by_name = signature.parameters[name].kind is inspect.Parameter.VAR_KEYWORD
        pairs = value.items() if by_name else [(name, value)]
        given += [(shown_as, one, rules[name]) for shown_as, one in pairs if name in rules]
    for strict in (False, True):
        for name, value, kind in given:
            may_be_infinite = "inf" in repr(getattr(signature.parameters.get(name), "default", 0))
            if not _fits(value, kind, strict and not may_be_infinite):
                return f"{who} needs {name} to be {_words(kind)}, got {_shown(value)}"
    broken = None if rule is None else rule(bound)
    return None if broken is None else f"{who} needs {broken}"


@functools.cache
def _annotations(function: Any) -> dict[str, Any]:
    """Return annotations as objects, those that can be found."""
    hints = {}
    for name, text in function.__annotations__.items():
        try:
            hints[name] = _evaluated(function, {name: text})[name]
        except Exception:  # an annotation may be any expression
            continue
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is parameter.VAR_POSITIONAL and name in hints:
            hints[name] = tuple[hints[name], ...]
    return hints


def _evaluated(function: Any, annotations: dict[str, Any]) -> dict[str, Any]:
    holder: Any = types.SimpleNamespace(__annotations__=annotations)
    names = inspect.unwrap(function).__globals__
    try:
        return typing.get_type_hints(holder, names)
    except NameError:
        return typing.get_type_hints(holder, names | _imported_for_types(names["__name__"]))


@functools.cache
def _imported_for_types(module: str) -> dict[str, Any]:
    """Return what a module imports under ``if TYPE_CHECKING:``."""
    home, names = sys.modules[module], {}
    for node in ast.parse(inspect.getsource(home)).body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            for line in node.body:
                if isinstance(line, ast.Import):
                    names |= {a.asname or a.name: importlib.import_module(a.name)
                              for a in line.names}  # fmt: skip
                if isinstance(line, ast.ImportFrom):
                    source = "." * line.level + (line.module or "")
                    imported = importlib.import_module(source, home.__package__)
                    names |= {a.asname or a.name: getattr(imported, a.name) for a in line.names}
    return names


def _fits(value: object, rule: object, strict: bool) -> bool:
    """Whether a value is what an annotation says; strictly, also what libraries can use."""
    origin, parts = typing.get_origin(rule), typing.get_args(rule)
    if rule is npt.ArrayLike or rule is np.ndarray or origin is np.ndarray:
        return _is_array(value, strict, like=rule is npt.ArrayLike)
    if origin in (Union, types.UnionType):
        return any(_fits(value, part, strict) for part in parts)
    if origin is Literal:
        return any(type(value) is type(part) and value == part for part in parts)
    if origin is tuple:
        return _is_tuple(value, parts, strict)
    if _is_mapping(rule):
        keys, values = parts or (Any, Any)
        return isinstance(value, Mapping) and all(
            _fits(k, keys, strict) and _fits(v, values, strict) for k, v in value.items()
        )
    if rule in _MANY or origin in _MANY:
        once = (origin or rule) is collections.abc.Iterable and not hasattr(type(value), "__len__")
        return hasattr(type(value), "__next__") if once else _is_many(value, parts, strict)
    if rule is collections.abc.Callable or origin is collections.abc.Callable:
        return callable(value)
    return _is_one(value, origin or rule, strict)


def _is_mapping(rule: object) -> bool:
    kind = typing.get_origin(rule) or rule
    return isinstance(kind, type) and issubclass(kind, Mapping) and kind.__module__ in (
        "collections.abc", "builtins")  # fmt: skip


def _is_one(value: Any, kind: object, strict: bool) -> bool:
    """Whether a value is a number, a text, or an object of a class."""
    if kind is Any:
        return True
    if kind is None or kind is type(None):
        return value is None
    if kind is bool:
        return isinstance(value, bool | np.bool_)
    if kind is int:
        is_integer = isinstance(value, int | np.integer) and not isinstance(value, bool)
        return is_integer and not (strict and abs(value) >= _LARGEST)
    if kind is float:
        return _is_number(value, strict)
    if kind is str:
        return isinstance(value, str)
    if not isinstance(kind, type) or kind is object or getattr(kind, "_is_protocol", False):
        return True  # nobody can say
    return isinstance(value, kind)


def _is_number(value: object, strict: bool) -> bool:
    array = as_numbers(value)
    if array is None or array.ndim or isinstance(value, bool | np.bool_ | str):
        return False
    return not strict or (math.isfinite(array) and abs(float(array)) < _LARGEST)


def _is_array(value: object, strict: bool, like: bool) -> bool:
    """Whether a value is an array of numbers, or like one; strictly, of finite ones."""
    array = as_numbers(value)
    if array is None:
        return False
    is_one = like or (isinstance(value, np.ndarray) and array.ndim > 0)
    return not strict or bool(is_one and array.size and np.isfinite(array).all())


def _is_tuple(value: Any, parts: Any, strict: bool) -> bool:
    if not _is_many(value, (), strict) or (strict and not isinstance(value, list | tuple)):
        return False
    if len(parts) == 2 and parts[1] is Ellipsis:
        return all(_fits(one, parts[0], strict) for one in value)
    return len(value) == len(parts) and all(map(_fits, value, parts, [strict] * len(parts)))


def _is_many(value: Any, parts: Any, strict: bool) -> bool:
    """Whether a value is a sequence of what it should be; a text is one only of texts."""
    if isinstance(value, str):
        return parts[:1] == (str,)
    sized = hasattr(type(value), "__iter__") and hasattr(type(value), "__len__")
    if not sized or isinstance(value, bytes | Mapping | type):
        return False
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return False
    return not parts or all(_fits(one, parts[0], strict) for one in value)


def _words(rule: object) -> str:
    """Return an annotation in words."""
    origin, parts = typing.get_origin(rule), typing.get_args(rule)
    if rule is npt.ArrayLike or rule is np.ndarray or origin is np.ndarray:
        return "an array of finite numbers"
    if origin in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_words(part) for part in parts))
    if origin is Literal:
        return " or ".join(repr(part) for part in parts)
    if origin is tuple:
        return f"a tuple of {_words(parts[0])}" if parts else "a tuple"
    if _is_mapping(rule):
        values = "" if parts[1:] in ((), (Any,), (object,)) else f" to {_words(parts[1])}"
        return "a mapping" + (f" of {_words(parts[0])}{values}" if parts else "")
    if rule in _MANY or origin in _MANY:
        return f"a list of {_words(parts[0])}" if parts else "a list"
    if rule is collections.abc.Callable or origin is collections.abc.Callable:
        return "a function"
    known = {bool: "True or False", int: "an integer", float: "a finite number", str: "text",
             type(None): "None", Any: "anything"}  # fmt: skip
    return known.get(rule) or f"of type {getattr(origin or rule, '__name__', rule)}"


def _shown(value: object) -> str:
    """Return a short text of a value, in one line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # whatever an object of others raises
        text = f"an object of type {type(value).__name__}"
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}... of type {type(value).__name__}"
