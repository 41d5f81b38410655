"""Which code a study may name: what is read, imported and called when somebody opens a study file.

A study file names functions, and reading it runs the code around them, as a Makefile does.  So
before anything is imported, everything that it names is looked at: files in the study's folder and
installed packages are taken, anything else only from who says that he trusts it.  Whatever is
trusted, a function is called only if it can be one that returns a diagram: `check_loop_function`.
"""

from __future__ import annotations

import functools
import importlib.util
import inspect
import json
import re
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from pathlib import Path
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any
from urllib.parse import unquote, urlparse

import control as ct

from nlctl import errors
from nlctl.errors import ParameterError

from .errors import KeyPath, Problem
from .schema import Study

__all__ = [
    "check_function",
    "check_loop_function",
    "check_place",
    "untrusted",
    "untrusted_names",
]

_OWN = (Path(errors.__file__).parent, Path(__file__).parents[2])  # nlctl, analysis
MAKERS = ("control", "nlctl")  # whoever makes a diagram calls one of these
NO_DIAGRAMS = {"None", "bool", "int", "float", "complex", "str", "bytes", "list", "tuple", "dict"}
SITES = ("site-packages", "dist-packages")
_LONGEST = 500  # characters of a function's name
NO_DIAGRAMS |= {"set", "Path", "ndarray", "DataFrame", "NoReturn", "Never"}
DIAGRAMS = {
    name
    for name, kind in vars(ct).items()
    if isinstance(kind, type) and issubclass(kind, ct.InputOutputSystem)
} | {"Block"}


def untrusted(study: Study, folder: Path) -> list[Problem]:
    """Return what a study names outside of its folder and of installed packages.

    Nothing is imported to find that out.
    """
    return untrusted_names(_named(study), folder)


def untrusted_names(named: Iterable[tuple[KeyPath, str]], folder: Path) -> list[Problem]:
    """Return which of these functions and kinds, each with its place in the file, need trust."""
    return [
        Problem(place=place, message=f"{reason}: reading this study would run it. Trust it with "
                "--trust, or put it into the study's folder")
        for place, name in named
        if (reason := _reason(name, folder))
    ]  # fmt: skip


def _named(study: Study) -> Iterator[tuple[KeyPath, str]]:
    """Yield every function that a study names, with its place."""
    if ":" in study.loop:
        yield ("loop",), study.loop
    yield from _inside(study.options, ("options",))
    for name, choices in study.choices.items():
        yield from _inside(choices.options, ("choices", name, "options"))
    if study.metrics is not None:
        yield from _inside(study.metrics.more, ("metrics", "more"))
    for i, asked in enumerate(study.analysis):
        yield from _inside(asked.model_dump(), ("analysis", i))


def _inside(value: Any, place: KeyPath) -> Iterator[tuple[KeyPath, str]]:
    if isinstance(value, Mapping):
        if isinstance(value.get("function"), str):
            yield place, value["function"]
        for key, part in value.items():
            yield from _inside(part, (*place, key))
    elif isinstance(value, list | tuple):
        for i, part in enumerate(value):
            yield from _inside(part, (*place, i))


def _reason(name: str, folder: Path) -> str:
    """Return why a function's file or module needs trust; nothing if it needs none."""
    source = name.rpartition(":")[0]
    try:
        check_place(name)
        if source.endswith(".py"):
            path, home = (folder / source).resolve(), folder.resolve()
            inside = path.is_relative_to(home)
            return "" if inside else f"'{source}' is outside of the study's folder"
        places = _module_places(source)
    except (ParameterError, OSError):  # there is none such: said when it is looked for
        return ""
    homes = [*_OWN, *_installed(source.partition(".")[0]), folder.resolve()]
    outside = [p for p in places if not any(p.resolve().is_relative_to(home) for home in homes)]
    return f"'{source}' is '{outside[0]}', and no installed package" if outside else ""


def check_place(name: str) -> None:
    """Refuse the name of a function that cannot be one, or is of Python's standard library.

    Raises
    ------
    ParameterError
        With the rule.
    """
    source, colon, attribute = name.rpartition(":")
    if not (source and colon and attribute):
        raise ParameterError(
            f"a function is 'path/to/file.py:function' or 'module:function', got '{name}'"
        )
    if not name.isprintable():
        raise ParameterError(f"a function's name has characters that can be printed, got {name!r}")
    if len(name) > _LONGEST:
        raise ParameterError(
            f"a function's name has at most {_LONGEST} characters, got {len(name)}"
        )
    if source.endswith(".py"):
        return
    if not all(part.isidentifier() for part in source.split(".")):
        raise ParameterError(f"a module has names separated by dots, got '{source}'")
    if _is_standard(source) or source == "__main__":
        raise ParameterError(
            f"'{source}' is a module of Python's standard library, which makes nothing of a loop"
        )


def _is_standard(module: str | None) -> bool:
    return (module or "").partition(".")[0] in sys.stdlib_module_names


def _module_places(name: str) -> list[Path]:
    """Return the file or the folders of a top-level module, without importing it."""
    top = name.partition(".")[0]
    try:
        found = importlib.util.find_spec(top)
    except (ImportError, ValueError):  # of a module that hides where it is from
        found = None
    if found is None:
        raise ParameterError(f"there is no module '{top}'")
    folders = list(found.submodule_search_locations or ())
    return [Path(p) for p in folders] or [Path(found.origin or top)]


@functools.cache
def _installed(top: str) -> tuple[Path, ...]:
    """Return where installed packages are, and the sources of one that is installed in place."""
    paths = sysconfig.get_paths()
    sites = {Path(p).resolve() for p in (paths["purelib"], paths["platlib"])}
    sites |= {Path(p).resolve() for p in sys.path if Path(p).name in SITES}
    for name in metadata.packages_distributions().get(top, ()):
        text = metadata.distribution(name).read_text("direct_url.json")
        origin = json.loads(text) if text else {}
        if origin.get("dir_info", {}).get("editable"):
            sites.add(Path(unquote(urlparse(origin["url"]).path)).resolve())
    return tuple(sites)


def check_function(function: Any, name: str) -> None:
    """Refuse what no study needs to be called: functions of the standard library, builtins.

    Raises
    ------
    ParameterError
        With the rule.
    """
    if isinstance(function, ct.InputOutputSystem):
        raise ParameterError(
            f"'{name}' needs a function that returns a diagram, got the diagram itself: write "
            "'def make(): return ...' and name that"
        )
    plain = _plain(function)
    if not isinstance(plain, FunctionType | type) or _is_standard(plain.__module__):
        where = getattr(plain, "__module__", None) or type(plain).__name__
        raise ParameterError(
            f"'{name}' needs a function or a class of yours or of a package, got one of '{where}'"
        )


def check_loop_function(function: Any, name: str) -> None:
    """Refuse, without calling it, a function that is not known to return a diagram.

    That is known by its return annotation, or because it, or what it calls, uses control or nlctl.

    Raises
    ------
    ParameterError
        With the rule and what to do.
    """
    check_function(function, name)
    plain = _plain(function)
    waits = inspect.iscoroutinefunction(plain) or inspect.isgeneratorfunction(plain)
    if not isinstance(plain, FunctionType) or waits or inspect.isasyncgenfunction(plain):
        raise ParameterError(f"'{name}' needs a function that returns a diagram, got {plain!r}")
    told = _annotation(plain)
    if told and all(_outermost(part) in NO_DIAGRAMS for part in told.split("|")):
        raise ParameterError(f"'{name}' needs a function that returns a diagram, it returns {told}")
    if not DIAGRAMS & set(re.findall(r"\w+", told)) and not _uses_makers(plain, set()):
        raise ParameterError(
            f"nothing shows that '{name}' returns a diagram, so it is not called: neither it nor "
            "what it calls uses control or nlctl. Annotate it: def "
            f"{plain.__name__}(...) -> ct.InputOutputSystem"
        )


def _plain(function: Any) -> Any:
    """Return what is called in the end, without arguments that are given and wrappers."""
    while True:
        if isinstance(function, functools.partial):
            function = function.func
        elif hasattr(function, "__wrapped__"):
            function = function.__wrapped__
        else:
            return getattr(function, "__func__", function)


def _annotation(function: FunctionType) -> str:
    """Return a return annotation as text; nothing without one."""
    if "return" not in function.__annotations__:
        return ""
    given = function.__annotations__["return"]
    return given if isinstance(given, str) else inspect.formatannotation(given)


def _outermost(annotation: str) -> str:
    """Return the name in front of an annotation's brackets, without its module."""
    return annotation.strip().partition("[")[0].rpartition(".")[2]


def _uses_makers(thing: Any, seen: set[int]) -> bool:
    """Whether a function, or what it reaches, reads something of control or nlctl."""
    thing = _plain(thing)
    if isinstance(thing, ModuleType):
        return thing.__name__.partition(".")[0] in MAKERS
    if (getattr(thing, "__module__", None) or "").partition(".")[0] in MAKERS:
        return True
    if id(thing) in seen:
        return False
    seen.add(id(thing))
    if isinstance(thing, type):
        return any(_uses_makers(part, seen) for part in vars(thing).values() if callable(part))
    if not isinstance(thing, FunctionType):
        own = type(thing).__module__.partition(".")[0]
        return own not in sys.stdlib_module_names and _uses_makers(type(thing), seen)
    names = _names(thing.__code__)
    reached = [thing.__globals__[name] for name in names if name in thing.__globals__]
    reached += [cell.cell_contents for cell in thing.__closure__ or () if _is_filled(cell)]
    imported = {name.partition(".")[0] for name in names}  # inside of the function
    return bool(imported & set(MAKERS)) or any(_uses_makers(part, seen) for part in reached)


def _names(code: CodeType) -> set[str]:
    """Return the names that a function reads, and those inside of it."""
    inner = (part for part in code.co_consts if isinstance(part, CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _is_filled(cell: CellType) -> bool:
    try:
        return cell.cell_contents is not None
    except ValueError:
        return False
