"""What is known of functions that are called by name: NumPy, math, builtins, methods."""

from __future__ import annotations

import dataclasses
import enum
import functools
import inspect
import logging
import re
import warnings
from collections import ChainMap, defaultdict, namedtuple
from collections.abc import Sequence
from dataclasses import replace
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any, NamedTuple

import numpy as np

from ...expressions.gains import computes_gains
from ...expressions.source import cells_of, is_dispatcher
from . import made, operators
from . import method_names as named
from .checked import HOLDERS, MEMORY, check_object
from .handed_on import handed_on, result_of_reduce, rows_of_functions, written_places
from .values import (
    FRESH,
    OUTSIDE,
    PLAIN,
    SLICE,
    VECTOR,
    Bound,
    Cached,
    Given,
    Impure,
    Instance,
    KnownValue,
    ListOf,
    Local,
    Message,
    OneOf,
    Parent,
    Pure,
    Unknown,
    captured,
    element,
    forgotten,
    function_choice,
    holder,
    is_builtin,
    is_one_of,
    least_upper_bound,
    library,
    python_function,
    row,
)
from .views import LISTS_OF_VIEWS, VIEWS, viewed, viewed_by_function, views_of, with_objects
from .walk import Walk

OUTPUT = "leave output out of equations"
_RECORD = "make what it records an output of the block, what it reads again a state"
DRAW = "draw the values before the run and give them as an input"
_FILES = "read files before the run, and write them after it"
_ADVICE = {DRAW: named.DRAWING, MEMORY: named.SETTING, _FILES: named.OF_FILES}
_OTHERS = {name: advice for advice, names in _ADVICE.items() for name in names}
_TABLES = ("scipy.interpolate", "scipy.spatial", "scipy.sparse", "numpy.polynomial")
VARYING = ("numpy.random", "scipy.stats", "scipy.io", "numpy.testing", "numpy.lib")
_SEEDED = ("default_rng", "RandomState")
CONTAINERS = (np.ndarray | np.generic | np.ufunc | dict | list | tuple | set | frozenset | str
              | bytes | bool | int | float | complex | range)  # fmt: skip
WITH_METHODS = CONTAINERS | re.Pattern | re.Match  # whose methods are new each time they are read
_OF_TUPLES = [getattr(namedtuple("_", ""), n).__code__ for n in ("_replace", "_asdict")]
MAKING = (list, tuple, set, frozenset, dict, enumerate, zip, reversed, sorted, filter, map, iter)
TAKING = (*MAKING[:8], *HOLDERS)  # which call nothing, and put nothing into what they are given


def takes_alone(thing: object) -> bool:
    """Whether a function calls nothing, and puts nothing into what it is given."""
    return is_one_of(thing, TAKING)


def call(walk: Walk, thing: object, given: Given) -> KnownValue:
    """Return what is known of the result of calling an object."""
    if isinstance(thing, functools._lru_cache_wrapper):
        wrapped = walk.captured(thing, "__wrapped__", thing.__wrapped__)
        return walk.first_call(wrapped, given)
    if is_one_of(thing, (np.errstate, warnings.catch_warnings)) or (
        isinstance(thing, type) and issubclass(thing, BaseException)
    ):
        return FRESH
    owner = getattr(thing, "__self__", None)
    if is_builtin(thing):
        return _builtin(walk, thing, given)
    if isinstance(thing, BuiltinFunctionType) and isinstance(owner, CONTAINERS):
        bound = method(walk, captured(owner), thing.__name__, given)
        return OUTSIDE if bound is None else bound
    special = _of_python(walk, thing, given)
    if special is not None:
        return special
    module = library(thing)
    if module is not None and module.partition(".")[0] != "control":
        return _library(walk, thing, module, given)
    if isinstance(thing, type):
        return _made(walk, thing, given)
    return _called(walk, thing, owner, given)


def _of_python(walk: Walk, thing: object, given: Given) -> KnownValue | None:
    """Return what is known of the result of functions of Python's own that make others."""
    places = given.places
    if is_dispatcher(thing) and places:
        return _dispatched(walk, thing, given)
    if thing is functools.partial:
        return KnownValue(True, True, known=Bound(places[0], Given(places[1:], given.names)))
    if thing is functools.wraps:
        after = Given((), {"wrapped": places[0]})
        return KnownValue(True, True, known=Bound(captured(functools.update_wrapper), after))
    if thing is functools.update_wrapper:
        return places[0]
    if thing is functools.lru_cache or thing is functools.cache:
        is_function = bool(places) and not isinstance(places[0].known, int | None)
        known = Cached(places[0]) if is_function else Bound(captured(functools.cache), Given())
        return KnownValue(True, True, known=known)
    if thing is functools.reduce and not isinstance(places[0].known, Unknown):
        return result_of_reduce(walk, places)
    if isinstance(thing, enum.EnumType) and len(places) == 1:
        missing = inspect.getattr_static(thing, "_missing_")
        if missing not in [vars(cls)["_missing_"] for cls in (enum.Enum, enum.Flag)]:
            raise Impure(f"looks up a member of {thing.__name__}, which has '_missing_'", "name it")
        return FRESH if issubclass(thing, enum.Flag) else element(captured(thing))
    if thing is np.frompyfunc:
        _call_functions(walk, places[:1])
        return KnownValue(True, True, known=Pure())
    if isinstance(thing, np.vectorize):
        _call_functions(walk, [walk.captured(thing, "pyfunc", thing.pyfunc)])
        return FRESH
    if thing is namedtuple or thing is NamedTuple:
        return made.named_tuple(given)
    if getattr(thing, "__code__", None) in _OF_TUPLES:
        return KnownValue(True, False, True)
    if thing is dataclasses.replace and places:
        return made.replaced_fields(walk, places[0], given.names)
    reading = (dataclasses.astuple, dataclasses.asdict, dataclasses.fields)
    return OUTSIDE if any(thing is reader for reader in reading) else None


def _made(walk: Walk, cls: type, given: Given) -> KnownValue:
    """Return what is known of a new object of somebody's class."""
    parts, holds = given.every, cls in HOLDERS
    if holds:
        _call_functions(walk, parts)
        parts = tuple(v for v in parts if not isinstance(v.known, type))
        if cls is defaultdict and parts and parts[:1] == given.places[:1]:
            made_anew = isinstance(parts[0].known, Unknown | None)
            parts = parts[1:] if made_anew else (walk.call(parts[0], Given()), *parts[1:])
    if issubclass(cls, tuple) and hasattr(cls, "_fields"):
        made.walk_tuple(walk, cls)
        holds = True
    if holds:
        is_new = cls is not ChainMap or all(v.own for v in parts[:1])  # it writes into that
        return KnownValue(is_new, all(v.own and v.inside for v in parts), True)
    return made.instance(walk, cls, given)


def _called(walk: Walk, thing: Any, owner: Any, given: Given) -> KnownValue:
    """Return what is known of the result of a function or method of Python code."""
    function = python_function(thing)
    if type(owner).__module__.startswith(VARYING):
        if thing.__name__ in named.OF_LAWS and type(owner).__module__.startswith("scipy.stats"):
            for name in ("args", "kwds") if hasattr(owner, "dist") else ():  # the law's numbers
                walk.captured(owner, name, getattr(owner, name))
            return FRESH
        raise Impure(f"draws random numbers with {thing.__name__}()", DRAW)
    if isinstance(owner, re.Pattern | re.Match):
        return KnownValue(True, True, known=Pure())
    if isinstance(owner, logging.Logger) and _says_nothing(walk, owner, thing.__name__):
        return FRESH
    if isinstance(owner, logging.Logger) or thing is warnings.warn:
        raise Message(f"writes messages with {thing.__name__}()", OUTPUT)
    if isinstance(thing, MethodType) and (library(type(owner)) or "").startswith("pandas"):
        if thing.__name__ not in named.OF_TABLES or "inplace" in given.names:
            raise Impure(f"calls {thing.__name__}() of pandas", "make an array of it before")
        return OUTSIDE
    cls = type(owner)  # of functions of numbers: splines, polynomials, rotations
    is_table = cls is np.poly1d or cls.__module__.startswith(_TABLES)
    if isinstance(thing, MethodType) and is_table:
        if thing.__name__.startswith(("set_", "add_")) or thing.__name__ in named.OF_SPARSE:
            raise Impure(f"changes with {thing.__name__}() what it did not make", MEMORY)
        return KnownValue(True, False, known=Pure())  # (other changes: named.CHANGING)
    # somebody's, or one of python-control's, can be read
    if function is None or (library(function) or "control").partition(".")[0] != "control":
        name = getattr(thing, "__qualname__", type(thing).__name__)
        module = getattr(thing, "__module__", None) or getattr(owner, "__name__", "")
        text = f"{module}.{name}" if module else name
        raise Impure(f"calls {text}, whose code cannot be read", "write the formula out")
    if computes_gains(thing):
        return KnownValue(True, all(v.own and v.inside for v in given.every), known=Pure())
    if isinstance(thing, FunctionType) or thing.__class__.__name__ == "CPUDispatcher":
        return walk.function(function, given)
    if not isinstance(thing, MethodType):
        walk.captured(type(thing), "__call__", function)
    first = captured(owner if owner is not None else thing)
    return walk.function(function, Given((first,)) + given)


def _says_nothing(walk: Walk, logger: logging.Logger, name: str) -> bool:
    """Whether messages of a level go nowhere: each run makes sure that this is still so."""
    level = logging.getLevelName(name.upper())
    if type(logger) is not logging.Logger or not isinstance(level, int):
        return False
    walk.captured(logger.manager, "disable", logger.manager.disable)
    around: logging.Logger | None = logger
    while around is not None:
        for attribute in ("level", "disabled", "parent"):
            walk.captured(around, attribute, getattr(around, attribute))
        around = around.parent
    return not logger.isEnabledFor(level)


def _dispatched(walk: Walk, thing: Any, given: Given) -> KnownValue:
    """Return what is known of a function that the type of its first argument chooses."""
    cell = cells_of(thing.register)["registry"]
    walk.captured(cell, "registry", cell.cell_contents)
    first, results = given.places[0], []
    for value in first.known.choices if isinstance(first.known, OneOf) else (first,):
        known, now = value.known, Given((value, *given.places[1:]), given.names)
        cls = known.cls if isinstance(known, Instance) else type(known)
        functions = [thing.dispatch(cls)]
        if isinstance(known, Unknown):
            functions = list(thing.registry.values())
        results += [walk.call(captured(function), now) for function in functions]
    return least_upper_bound(results)


def method(walk: Walk, base: KnownValue, name: str, given: Given) -> KnownValue | None:
    """Return what is known of the result of a method of a container; None if it is another's."""
    thing = base.known
    if isinstance(thing, ListOf):
        return _of_list(base, name, given.places)
    if isinstance(thing, Pure) and name == "rvs":
        raise Impure("draws random numbers with rvs()", DRAW)
    if isinstance(thing, Pure) and name == "shuffle":
        _written(given.places[0], "shuffle()")
    if isinstance(thing, ModuleType | type | super | OneOf | Instance | Bound | Pure | Parent):
        return None
    if not isinstance(thing, Unknown | CONTAINERS):
        if name in named.CHANGING and not isinstance(
            getattr(type(thing), name, None), FunctionType
        ):
            _written(base, f"{name}()")
        return None
    if type(thing).__module__ not in ("builtins", "numpy", Unknown.__module__):
        member = getattr(type(thing), name, None)  # a class of somebody, or a named tuple's field
        if isinstance(member, FunctionType) or not callable(member):
            return None
    if name == "at" and isinstance(thing, np.ufunc):
        _written(given.places[0], "an array with .at()")
        return FRESH
    if name in named.READING:
        _check_no_object(base, name)
        if given.names.get("inplace", captured(False)).known is not False:
            _written(base, f"{name}(inplace=True)")
        if name == "astype" and given.names.get("copy", captured(True)).known is not True:
            return viewed(name, base)
        return _read(base, name, given.places)
    if name in VIEWS:
        return viewed(name, base, given)
    if name in named.CHANGING:
        _written(base, f"{name}()", _RECORD if name in named.RECORDING else MEMORY)
        return least_upper_bound([element(base), *given.places[1:2]]) if base.holds else FRESH
    if isinstance(thing, dict | tuple | list) and not isinstance(thing, Unknown):
        return None
    results = made.of_tuples(walk, name, given) if base.own else []
    if results:  # only these have it, of all that a call can make
        return least_upper_bound(results)
    raise Impure(f"calls a method '{name}()' that is not known", "use NumPy's functions")


def _of_list(base: KnownValue, name: str, given: Sequence[KnownValue]) -> KnownValue:
    """Return what is known of the result of a method of a list or dict of functions."""
    if name in ("values", "copy"):
        return base
    if name == "items":
        return holder([row([FRESH, element(base)])])
    if name == "get":
        return least_upper_bound([element(base), *given[1:]])
    if name in ("keys", "index", "count"):
        return FRESH
    raise Impure(f"calls {name}() of a list of functions or objects", "make a new list")


def _read(base: KnownValue, name: str, given: Sequence[KnownValue]) -> KnownValue:
    """Return what is known of the result of a method that changes nothing."""
    if name == "get" and given:
        key = given[0].known
        if isinstance(base.known, dict) and isinstance(key, str):
            default = given[1] if len(given) > 1 else FRESH
            return captured(base.known[key]) if key in base.known else default
        parts = [captured(v) for v in base.known.values()] if isinstance(base.known, dict) else []
        known = function_choice([*parts, *given[1:]])
        return replace(least_upper_bound([element(base), *given[1:]]), known=known)
    if isinstance(base.known, dict) and name in ("values", "items"):
        return KnownValue(True, base.inside, True, known=tuple(getattr(base.known, name)()))
    kept = base.holds and name in ("items", "keys", "values", "copy", "_asdict", "_replace")
    return KnownValue(True, base.inside, True) if kept else FRESH


def _check_no_object(base: KnownValue, name: str) -> None:
    """Check that a method is not one of an object of which nothing is known."""
    if isinstance(base.known, Unknown) and base.holds and not (base.own or base.inside):
        raise Impure(f"calls {name}() of what may be an object", "name the object")


def _written(base: KnownValue, what: str, advice: str = MEMORY) -> None:
    if not base.own:
        raise Impure(f"changes with {what} what it did not make", advice)


def _builtin(walk: Walk, thing: Any, given: Given) -> KnownValue:
    name, places = thing.__name__, given.places
    result = operators.of_builtin(walk, name, places, given.names.get("start", captured(0)))
    if result is not None:
        return result
    if (name, len(places)) in made.OF_ATTRIBUTES:
        return made.OF_ATTRIBUTES[name, len(places)](walk, *places)
    by_key = _by_key(walk, name, given)
    is_ordered = not by_key and bool(places) and operators.ordered(walk, name, places)
    checked = () if is_ordered else places[:1] if name == "next" else places
    for value in checked if name not in ("isinstance", "issubclass", "callable", "type") else ():
        if name not in _ITERATING or not made.iterates(walk, value):
            _check_parts(value, name, moves=by_key or name in _MOVING)
    if name == "slice":
        return SLICE
    if name == "type" and len(places) == 1:
        return made.class_of_value(places[0])
    if name in ("min", "max"):
        parts = [element(places[0])] if len(places) == 1 else [forgotten(v) for v in places]
        return least_upper_bound([*parts, *(v for k, v in given.names.items() if k == "default")])
    if thing is map and not isinstance(places[0].known, Unknown):
        return holder([walk.call(places[0], Given(tuple(map(element, places[1:]))))])
    if thing in MAKING:
        _call_functions(walk, given.places if by_key else given.every)
        held = holder(element(v) if k == "**" else v for k, v in given.names.items())
        inside = held.inside and all(v.inside for v in places)
        return KnownValue(True, inside, True, known=rows_of_functions(thing, places))
    if name == "next":
        _written(places[0], "next()")
        return least_upper_bound([element(places[0]), *places[1:]])
    if thing is object:
        return KnownValue(True, True, True, known=Instance(object))
    of_number = name != "hash" or isinstance(places[0].known, (Unknown, *PLAIN))
    if name in named.NUMBERS_AND_TEXTS and of_number:
        walk.numba_differs += ["text"] if name in ("str", "repr", "format") else []
        return FRESH
    if name == "print":
        raise Message("calls print()", OUTPUT)
    raise Impure(f"calls {name}()", OUTPUT if name in ("input", "open") else "do without it")


_ITERATING = ("list", "tuple", "set", "enumerate", "zip", "map", "filter", "iter", "sum", "sorted",
              "min", "max", "any", "all")  # fmt: skip
_MOVING = ("next", "list", "tuple", "enumerate", "zip", "reversed", "map", "filter", "iter",
           "len")  # fmt: skip


def _by_key(walk: Walk, name: str, given: Given) -> bool:
    """Walk the key by which things are put in order, if there is one: they are only moved then."""
    key = given.names.get("key", captured(None))
    if name not in ("min", "max", "sorted") or key.known is None:
        return False
    places = list(given.places)
    places = [element(places[0])] if len(places) == 1 else places
    if not isinstance(key.known, Unknown):
        walk.call(key, Given((least_upper_bound(places),)))
    return True


def _check_parts(value: KnownValue, name: str, moves: bool) -> None:
    """Check what a builtin does with a value, and with what is in it unless it only moves that."""
    known = value.known
    if isinstance(known, ListOf) and moves:
        return
    check_object(value, f"calls {name}() of")
    if isinstance(known, list | tuple) and not moves:
        for part in known:
            if not callable(part) or not isinstance(part, FunctionType | MethodType | np.ufunc):
                check_object(captured(part), f"calls {name}() of a list that holds")


def _library(walk: Walk, thing: object, module: str, given: Given) -> KnownValue:
    name = getattr(thing, "__name__", "")
    if name in _SEEDED and given.places and type(given.places[0].known) is int:
        return KnownValue(True, True, known=Pure())  # its numbers are the same in every call
    if module.startswith("scipy.stats") and hasattr(thing, "freeze"):
        return KnownValue(True, True, known=Pure())  # a law of probability, with its numbers
    if module.startswith(VARYING) and not module.startswith("numpy.lib.stride_tricks"):
        raise Impure(f"calls {module}.{name}, which may differ from call to call", DRAW)
    if module.startswith("pandas") and name.startswith(("read_", "to_")):
        raise Impure(f"calls {name}, which reads or writes files", _FILES)
    if name in _OTHERS and (module, name) != ("json", "loads"):  # which takes a text apart
        raise Impure(f"calls {module}.{name}, which is more than its result", _OTHERS[name])
    asked, given = given, operators.with_arrays(walk, given, module)
    arrays = module.startswith(("numpy", "scipy")) and all(map(_holds_numbers, given.every))
    _call_functions(walk, given.every, VECTOR if arrays else OUTSIDE)
    for value in given.every:
        if not callable(value.known):
            check_object(value, f"hands {name}")
    if name in named.WRITERS or (module.endswith("operator") and name in named.IN_PLACE):
        _written(given.places[0], f"{name}()")
        return element(given.places[0]) if "heap" in name else FRESH
    parts = handed_on(module, name, given.places)
    if parts is not None:
        return parts
    if module in ("operator", "_operator") and isinstance(thing, type):
        return KnownValue(True, True, known=Pure(gives_parts=True))
    if _makes_objects(thing, module):
        # it may hold what it is given, instead of copies
        return KnownValue(True, all(v.own and v.inside for v in given.every), known=Pure())
    for value, how in written_places(thing, name, given):
        _written(value, f"{name}(..., {how})")
    may_be_it = given.names.get("copy", captured(True)).known is not True
    may_be_it |= name == "array" and given.places != asked.places  # which an object may not copy
    if name == "nan_to_num" and may_be_it:
        _written(given.places[0], f"{name}()")
    if name in LISTS_OF_VIEWS and (name != "meshgrid" or may_be_it):
        return views_of(name, given.places)
    if name == "einsum" and len(given.places) == 2:
        return forgotten(given.places[1])
    if name in VIEWS or may_be_it or module.startswith("numpy.ma"):
        return viewed_by_function(name, given)
    return with_objects(given) or FRESH


def _makes_objects(thing: object, module: str) -> bool:
    """Whether a function of a library makes objects, such as splines and rotations."""
    cls = thing if isinstance(thing, type) else getattr(thing, "__self__", None)
    if isinstance(cls, type) and not issubclass(cls, np.generic | np.ndarray | CONTAINERS):
        return module.partition(".")[0] in ("numpy", "scipy")
    return module.startswith(("scipy.interpolate", "scipy.spatial", "scipy.sparse", "re"))


def _holds_numbers(value: KnownValue) -> bool:
    """Whether nothing that a value holds may be somebody's object."""
    return value.inside or not value.holds or callable(value.known)


def _call_functions(walk: Walk, values: Any, part: KnownValue = OUTSIDE) -> None:
    """Walk functions that are handed on: they will be called with anything."""
    for value in values:
        thing = value.known
        if isinstance(thing, Unknown | type | Pure) or not made.may_be_called(thing):
            continue
        if isinstance(thing, OneOf):  # some of them may be lists
            _call_functions(walk, thing.choices, part)
        elif isinstance(thing, Local | Bound | Cached | Instance) or callable(thing):
            count = getattr(thing, "nin", 2 if library(thing) else 8)
            walk.call(value, Given((part,) * count))
