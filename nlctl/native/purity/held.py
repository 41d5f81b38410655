"""What an object holds that Python's own attributes do not show: of libraries, and of C.

A spline of SciPy, a table of pandas, a bound function of a list: their content is part of what an
equation computes.  What nobody can see into is named.
"""

from __future__ import annotations

import contextvars
import copyreg
import threading
import types
import weakref
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .outside import outside_of

OPAQUE = "\2"  # begins a text that names what nobody can see into
NAMED = "\3"  # begins a text that says all of an object
# where pandas keeps content: how it is laid out in memory may change
LAID_OUT = ("_mgr", "_item_cache", "_flags", "_cache")
_TOLD_BY_TEXT = {"numba", "llvmlite", "pydantic", "pydantic_core", "annotated_types"} | {
    *("typing", "typing_extensions", "matplotlib", "jinja2", "rich", "abc", "inspect", "ast"),
    "enum",  # machinery: what it is made of computes nothing, or is gone through
}
_LOCKS = ("lock", "RLock")  # of _thread: they hold nothing
_RANDOM = ("Generator", "RandomState", "BitGenerator", "SeedSequence", "Random")
_TOLD = (type, bool, int, float, complex, bytes, range, slice, type(None), type(...), np.generic)
_LIKE_LISTS = (type({}.keys()), type({}.values()), type({}.items()))
_BOUND = (types.BuiltinFunctionType, types.MethodWrapperType)


def held_by(thing: object, is_library: Callable[[str], bool]) -> Any:
    """Return what an object of a library holds, as data and other objects."""
    kind = type(thing)
    top = (getattr(kind, "__module__", None) or "").partition(".")[0]  # arrays of ctypes have none
    if isinstance(thing, _TOLD) or (top == "_thread" and kind.__name__ in _LOCKS):
        return None
    if isinstance(thing, contextvars.ContextVar):  # NumPy's says how errors are reported
        is_numpys = thing.name.startswith("numpy")
        return None if is_numpys else ("variable", thing.name, *_value_of(thing))
    if isinstance(thing, threading.local):
        return ("local", kind.__name__, vars(thing))
    if isinstance(thing, weakref.WeakKeyDictionary):
        kept = [pair for pair in thing.items() if not isinstance(pair[0], type)]
        return (kind.__name__, kept) if kept else None  # by class: what singledispatch has found
    if isinstance(thing, weakref.WeakValueDictionary | weakref.WeakSet):
        return (kind.__name__, dict(thing) if isinstance(thing, Mapping) else set(thing))
    if any(base.__name__ in _RANDOM for base in kind.__mro__):
        return f"{OPAQUE}a random generator ({kind.__name__})"
    if isinstance(thing, np.ndarray):
        return _of_array(thing)
    if isinstance(thing, np.ufunc):
        return _of_ufunc(thing)
    if isinstance(thing, _BOUND):
        return _of_bound(thing, is_library)
    if isinstance(thing, types.MappingProxyType):
        return ("mapping", dict(thing))
    if isinstance(thing, memoryview):
        return ("memory", thing.format, thing.shape, thing.tobytes())
    if isinstance(thing, weakref.ref):
        return ("reference", thing())
    if isinstance(thing, _LIKE_LISTS):
        return (kind.__name__, list(thing))
    if top == "pandas" and (content := _of_pandas(thing)) is not None:
        return content
    if top == "scipy" and (content := _of_scipy(thing)) is not None:
        return content
    return None if top in _TOLD_BY_TEXT else reduced(thing)


def _value_of(variable: contextvars.ContextVar[Any]) -> tuple[Any, ...]:
    try:
        return (variable.get(),)
    except LookupError:  # neither set nor with a default
        return ()


def _of_scipy(thing: Any) -> Any:
    """Return what an object holds that keeps notes on itself besides, or memory that nobody set."""
    kind = type(thing)
    room = kind.__module__.split(".")[1]
    if room == "sparse" and hasattr(thing, "tocoo"):
        coordinates = thing.tocoo()
        return ("sparse", kind.__name__, coordinates.shape, *coordinates.coords, coordinates.data)
    if room == "stats" and hasattr(thing, "dist"):
        return ("law", *_of_laws(thing.dist), thing.args, thing.kwds)
    if room == "stats" and hasattr(thing, "_updated_ctor_param"):
        return ("laws", *_of_laws(thing))
    if room == "interpolate" and hasattr(thing, "_eval_args"):
        return ("spline", kind.__name__, thing._eval_args, getattr(thing, "ext", None))
    if room == "spatial" and (hasattr(thing, "points") or hasattr(thing, "_points")):
        known = ("points", "_points", "simplices", "neighbors", "equations", "vertices", "regions")
        return ("mesh", kind.__name__, {k: v for k, v in vars(thing).items() if k in known})
    return None


def _of_laws(family: Any) -> tuple[Any, ...]:
    """Return what SciPy makes a copy of a family of laws from: a histogram's numbers, too."""
    return (type(family), family.name, family._updated_ctor_param())


def inherited(thing: object) -> Any:
    """Return what an object of a class of one's own has of what the class inherits from."""
    if any(base.__module__.startswith("pandas.") for base in type(thing).__mro__):
        return _of_pandas(thing)
    return reduced(thing)


def reduced(thing: object) -> Any:
    """Return what a pickle of an object would hold, or a text that says that there is none."""
    name = f"{getattr(type(thing), '__module__', None) or 'ctypes'}.{type(thing).__qualname__}"
    try:
        taken_apart = copyreg.dispatch_table.get(type(thing))  # of texts to look for, and others
        pieces = taken_apart(thing) if taken_apart else thing.__reduce_ex__(4)
    except Exception:  # whatever an object raises that is not to be taken apart
        return f"{OPAQUE}an object of {name}"
    if isinstance(pieces, str):
        return f"{NAMED}{getattr(thing, '__module__', '')}.{pieces}"
    parts = list(pieces[:3])
    if len(parts) > 2 and isinstance(parts[2], dict):  # of laws, which draw from it
        parts[2] = {k: v for k, v in parts[2].items() if k != "_random_state"}
    parts += [list(part) for part in pieces[3:5] if part is not None]
    return ("object", name, *parts)


def _of_array(thing: np.ndarray) -> Any:
    more = getattr(thing, "__dict__", None) or None
    if isinstance(thing, np.ma.MaskedArray):
        return ("masked", thing.filled(0), np.ma.getmaskarray(thing))
    if thing.dtype.hasobject:
        return ("objects", thing.shape, thing.tolist(), more)
    return ("array of objects'", more, np.asarray(thing)) if more else None


def _of_ufunc(thing: np.ufunc) -> Any:
    """Return nothing for a function that NumPy or SciPy names; of another's nobody sees into."""
    from scipy import special

    for module in (np, special):
        if getattr(module, thing.__name__, None) is thing:
            return None
    return f"{OPAQUE}a compiled function ('{thing.__name__}')"


def _of_bound(thing: Any, is_library: Callable[[str], bool]) -> Any:
    """Return what a function of C is bound to; one of a module is known by its name."""
    held = getattr(thing, "__self__", None)
    if held is not None and not isinstance(held, types.ModuleType | type):
        return ("bound", thing.__name__, held)
    top = str(getattr(thing, "__module__", None) or "builtins").partition(".")[0]
    if asked := outside_of(top, thing.__name__):
        return f"{OPAQUE}{asked} when it is called ('{thing.__name__}')"
    if is_library(top) or top == "builtins":
        return None
    return f"{OPAQUE}a compiled function of '{top}' ('{thing.__name__}')"


def _of_pandas(thing: object) -> Any:
    """Return what a table, a column or an index holds, however it is laid out in memory."""
    import pandas as pd

    if isinstance(thing, pd.DataFrame):
        columns = [thing.iloc[:, i] for i in range(thing.shape[1])]
        return ("table", list(map(str, thing.columns)), thing.index, columns, dict(thing.attrs))
    if isinstance(thing, pd.MultiIndex):
        return ("index", list(map(str, thing.names)), thing.tolist())
    if isinstance(thing, pd.Index | pd.Series):
        index = thing.index if isinstance(thing, pd.Series) else None
        return ("column", str(thing.name), str(thing.dtype), np.asarray(thing), index)
    if isinstance(thing, pd.api.extensions.ExtensionArray):
        return ("values", str(thing.dtype), np.asarray(thing))
    return None
