"""What a function asks of the world outside when it is called: files, clocks, chance, its frame.

No key of the function changes with the answer, so that what keeps results by a key names it.
"""

from __future__ import annotations

import dis
import functools
import itertools
import types
from collections.abc import Callable, Iterator
from typing import Any

from ...expressions.source import cells_of, codes_in, in_cell

_EVERYTHING = frozenset[str]()
_MODULES: dict[str, tuple[str, frozenset[str]]] = {  # by module; all of it if nothing is named
    "time": ("the time", _EVERYTHING),
    "random": ("chance", _EVERYTHING),
    "secrets": ("chance", _EVERYTHING),
    "subprocess": ("other programs", _EVERYTHING),
    "socket": ("the network", _EVERYTHING),
    "urllib": ("the network", _EVERYTHING),
    "sqlite3": ("files", _EVERYTHING),
    "os": ("the system", frozenset({"popen", "system", "read", "times", "urandom", "getpid"})),
    "numpy": ("files", frozenset({"load", "fromregex"})),
    "numpy.random": ("chance", _EVERYTHING),
    "json": ("files", frozenset({"load"})),
    "pickle": ("files", frozenset({"load"})),
    "tomllib": ("files", frozenset({"load"})),
    "joblib": ("files", frozenset({"load"})),
}
_FRAMES = {"_getframe", "currentframe", "__globals__", "__annotations__", "__builtins__"}


def asked_outside(function: types.FunctionType) -> Iterator[str]:
    """Yield what a function asks, with the words that ask, ``time.time``."""
    cells, names = cells_of(function), function.__globals__
    for code in codes_in(function.__code__):
        for word, follower in _pairs(code):
            thing = in_cell(cells[word]) if word in cells else names.get(word)
            if not isinstance(thing, types.ModuleType):
                continue
            if answer := outside_of(thing.__name__, follower):
                yield f"{answer} when it is called ('{word}.{follower}'"
        for name in sorted(_FRAMES.intersection(code.co_names)):
            yield f"what '{name}' finds ('{name}'"


def outside_of(module: str, name: str) -> str:
    """Return what a function of a module asks of the world; nothing if it asks nothing."""
    for place in (module, f"{module}.{name}", module.partition(".")[0]):
        answer, names = _MODULES.get(place, ("", _EVERYTHING))
        if answer and (not names or name in names):
            return answer
    return ""


def imports_in(function: types.FunctionType, is_library: Callable[[str], bool]) -> list[str]:
    """Return the modules that a function imports when it is called, other than libraries."""
    # Whether one is imported already, and under which name, changes while a loop is used.
    modules = {
        word
        for code in codes_in(function.__code__)
        for what, word in _words(code)
        if what == "IMPORT_NAME" and not is_library(word)
    }
    return sorted(modules)


@functools.lru_cache(maxsize=4096)  # code never changes
def _words(code: types.CodeType) -> tuple[tuple[str, Any], ...]:
    """Return the instructions of a code object, each with what it is about."""
    return tuple((step.opname, step.argval) for step in dis.get_instructions(code))


@functools.lru_cache(maxsize=4096)
def _pairs(code: types.CodeType) -> tuple[tuple[str, str], ...]:
    """Return words of a code object that stand next to each other."""
    words = (word for _, word in _words(code))
    near = ((a, b) for a, b in itertools.pairwise(words) if isinstance(a, str))
    return tuple(dict.fromkeys((a, b) for a, b in near if isinstance(b, str)))
