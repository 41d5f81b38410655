"""Which code a file may name: one rule for every function, wherever a file names it.

A study file names functions, and reading it runs the code around them, as a Makefile does.  What
may run without being asked is what makes loops of nlctl's blocks:

* modules of nlctl that do, `MADE_OF`;
* files in the study's own folder, where somebody has pointed at the study;
* installed packages that are built on nlctl or python-control, likewise; of python-control what
  makes systems, `SYSTEMS`.

Anything else needs the trust of this user, see `record`; so does all but the first of these in a
folder of results, which is data that somebody may have sent.  It is checked twice: what is named,
before anything is imported, and where it was defined, before anything is called.  Whatever is
trusted, a loop's function is called only if it can be one that returns a diagram.

What this user has run or trusted: a record of his own, by hash, outside of every folder.

A folder that was received cannot say that it is trusted.  What is recorded is one statement for
each file or module of a study: which study, what it calls the file, and what is in it.  Another
study, another content, another name: another statement.
"""

import functools
import hashlib
import importlib.util
import inspect
import json
import os
import re
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, Literal
from urllib.parse import unquote, urlparse

import control as ct
import platformdirs

from nlctl.errors import ParameterError
from nlctl.expressions.source import codes_in, in_cell
from nlctl.host.files import replace_file
from nlctl.host.former_name import present_name

from ..file.errors import Problem
from ..file.schema import Study
from ..file.toml import KeyPath
from .loading import loaded_with

_FORMAT = 1


def record_file() -> Path:
    """Return where the record is: in NLCTL_CONFIG_DIR, or the user's configuration."""
    folder = os.environ.get("NLCTL_CONFIG_DIR") or platformdirs.user_config_dir("nlctl")
    return Path(folder) / "trusted.json"


def statement(study: str, name: str, content: bytes) -> str:
    """Return what is recorded of one file of a study."""
    digest = hashlib.sha256(content).hexdigest()
    return hashlib.sha256("\0".join((study, name, digest)).encode()).hexdigest()


def remembered() -> frozenset[str]:
    """Return all statements; none where there is no record, or others could have written it."""
    path = record_file()
    try:
        if _is_others(path) or _is_others(path.parent):
            return frozenset()
        content = json.loads(path.read_bytes())
        if content["format"] != _FORMAT:
            return frozenset()
        return frozenset(map(str, content["statements"]))
    except (OSError, ValueError, KeyError, TypeError):
        return frozenset()


def _is_others(path: Path) -> bool:
    """Whether somebody else owns a path, or may write there."""
    if not hasattr(os, "getuid"):
        return False
    status = path.stat()
    return status.st_uid not in (os.getuid(), 0) or status.st_mode & 0o022 != 0


def remember(statements: Iterable[str]) -> bool:
    """Add statements to the record; return whether it holds them now."""
    # Where it cannot be written nothing is lost but the question that is asked again.
    before_it, path = remembered(), record_file()
    new = frozenset(statements) - before_it
    if not new:
        return True
    content = json.dumps({"format": _FORMAT, "statements": sorted(before_it | new)}, indent=1)
    before = os.umask(0o077)  # nobody else writes what this user trusts
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, lambda file: file.write(content.encode()))
    except OSError:
        return False
    finally:
        os.umask(before)
    return new <= remembered()


Reach = Literal["nlctl", "study", "all"]
"""What may run unasked: nlctl's own code, the study's folder and packages as well, or anything."""

MAKERS = ("control", "nlctl")  # a function that makes a diagram calls one of these
_ABOUT_LOOPS = "nlctl.analysis"  # and not of this one
MADE_OF = tuple(
    f"nlctl.{room}"
    for room in ("actuators", "blocks", "controllers", "delays", "diagrams", "faults", "functions")
) + (
    *(f"nlctl.{room}" for room in ("observers", "paper", "plants", "references", "sampling")),
    *(f"nlctl.{room}" for room in ("sliding", "sources")),
    *(f"nlctl.analysis.paper.{part}" for part in ("controllers", "loops", "rivals")),
    *(
        "nlctl.analysis.metrics",
        "nlctl.analysis.lyapunov.nussbaum.forecast",
        "nlctl.analysis.studies.kinds",
    ),
)
SYSTEMS = tuple(  # of python-control: not what draws, and what changes the settings of a process
    f"control.{room}"
    for room in ("bdalg", "canonical", "delay", "descfcn", "dtime", "flatsys", "frdata", "iosys")
) + (
    *(f"control.{room}" for room in ("lti", "mateqn", "modelsimp", "nlsys", "optimal", "robust")),
    *(f"control.{room}" for room in ("statefbk", "statesp", "stochsys", "xferfcn")),
)
NO_DIAGRAMS = {"None", "bool", "int", "float", "complex", "str", "bytes", "list", "tuple", "dict"}
SITES = ("site-packages", "dist-packages")
_LONGEST = 500  # characters of a function's name
NO_DIAGRAMS |= {"set", "Path", "ndarray", "DataFrame", "NoReturn", "Never"}
DIAGRAMS = {
    name
    for name, kind in vars(ct).items()
    if isinstance(kind, type) and issubclass(kind, ct.InputOutputSystem)
} | {"Block"}


@dataclass(frozen=True, kw_only=True)
class Grant:
    """What code of one study may run."""

    reach: Reach
    folder: Path  # what paths in the study are relative to
    study: str  # a key of the study, see `sealed.digest_of`

    def admits(self, path: Path) -> str:
        """Return why a file may not be run; nothing if it may."""
        path, home = path.resolve(), self.folder.resolve()
        name = os.path.relpath(path, home)
        if self.reach == "all" or (self.reach == "study" and _is_own(path, home)):
            return ""
        if self._is_recorded(name, path):
            return ""
        if self.reach == "study":
            return f"'{name}' is outside of the study's folder"
        return f"'{name}' is code that this user has neither run nor trusted as it is"

    def refuses(self, path: Path) -> str:
        """Return why a file may not be run, and what to do; nothing if it may."""
        reason = self.admits(path)
        return f"{reason}: {self.remedy}" if reason else ""

    def admits_module(self, name: str) -> str:
        """Return why a module may not be imported; nothing if it may, or if there is none."""
        name = present_name(name)
        if name.partition(".")[0] == "nlctl":
            fits = name in ("nlctl", _ABOUT_LOOPS) or _is_in(name, MADE_OF)
            return "" if fits or self.reach == "all" else f"'{name}' does nothing with a loop"
        try:
            places = _module_places(name)
        except (ParameterError, OSError):  # said when it is looked for
            return ""
        if self.reach == "all" or self._is_recorded(f"module {name}", _source(places[0])):
            return ""
        if self.reach == "nlctl":
            return f"'{name}' is a module that this user has neither run nor trusted for it"
        home, top = self.folder.resolve(), name.partition(".")[0]
        homes = [*_installed(top), home]
        outside = [p for p in places if not any(p.resolve().is_relative_to(h) for h in homes)]
        if outside:
            return f"'{name}' is '{outside[0]}', and no installed package"
        if all(_is_own(p.resolve(), home) for p in places):
            return ""
        if top == "control" and name != top and not _is_in(name, SYSTEMS):
            return f"'{name}' does nothing with a loop"
        if top in _built_on():
            return ""
        return f"'{top}' is not built on nlctl or python-control"

    def _is_recorded(self, name: str, path: Path) -> bool:
        try:
            return statement(self.study, name, path.read_bytes()) in remembered()
        except OSError:
            return False

    @property
    def remedy(self) -> str:
        """What to do about what is refused."""
        here = ", or put it into the study's folder" if self.reach == "study" else ""
        return f"reading this study would run it. Trust it with --trust{here}"


def _is_in(module: str, rooms: Iterable[str]) -> bool:
    """Whether a module is one of these, or in one of them."""
    return any(module == room or module.startswith(f"{room}.") for room in rooms)


def _is_own(path: Path, home: Path) -> bool:
    """Whether a file is of a study's folder, and not of packages that are installed in there."""
    return path.is_relative_to(home) and not set(SITES) & set(path.relative_to(home).parts)


def untrusted(named: Iterable[tuple[KeyPath, str]], grant: Grant) -> list[Problem]:
    """Return which of these functions and kinds need trust, each with its place in the file."""
    # Nothing is imported to find that out.
    return [
        Problem(place=place, message=f"{reason}: {grant.remedy}", needs_trust=True)
        for place, name in named
        if (reason := _reason(name, grant))
    ]


def _reason(name: str, grant: Grant) -> str:
    """Return why a function's file or module needs trust; nothing if it needs none."""
    source = name.rpartition(":")[0]
    try:
        check_place(name)
    except ParameterError:  # said when it is looked for
        return ""
    if not source.endswith(".py"):
        return grant.admits_module(source)
    path = (grant.folder / source).resolve()  # of "no-such/../file.py", too
    return grant.admits(path) if path.is_file() else ""


def check_defined(function: object, name: str, grant: Grant) -> None:
    """Refuse a function that another module defines than one that may run."""
    # A file may have the names of others: ``from pandas import read_pickle``.
    module = getattr(_plain(function), "__module__", None) or ""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None or not grant.admits(Path(file)):  # none: made by text that a file has run
        return
    if reason := grant.admits_module(module):
        raise ParameterError(f"'{name}' is a function of '{module}', and {reason}: {grant.remedy}")


def named_in(study: Study) -> Iterator[tuple[KeyPath, str]]:
    """Yield every function that a study names, with its place; its kinds not among them."""
    if ":" in study.loop:
        yield ("loop",), study.loop
    yield from _inside(study.options, ("options",))
    for name, choices in study.choices.items():
        yield from _inside(choices.options, ("choices", name, "options"))
    if study.metrics is not None:
        yield from _inside(study.metrics.more, ("metrics", "more"))
    for i, asked in enumerate(study.analysis):
        yield from _inside(asked.model_dump(), ("analysis", i))


def _inside(value: object, place: KeyPath) -> Iterator[tuple[KeyPath, str]]:
    if isinstance(value, Mapping):
        if isinstance(value.get("function"), str):
            yield place, value["function"]
        for key, part in value.items():
            yield from _inside(part, (*place, key))
    elif isinstance(value, list | tuple):
        for i, part in enumerate(value):
            yield from _inside(part, (*place, i))


def remember_code(study: Study, key: str, folder: Path) -> None:
    """Record that this user has run the code of a study."""
    kinds = [asked.kind for asked in study.analysis if ":" in asked.kind]
    remember([*_statements([*(name for _, name in named_in(study)), *kinds], key, folder)])


def _statements(names: Iterable[str], key: str, folder: Path) -> Iterator[str]:
    home = folder.resolve()
    for name in dict.fromkeys(names):
        source = name.rpartition(":")[0]
        if source.endswith(".py"):
            run = loaded_with(folder / source)
            contents = {os.path.relpath(path, home): content for path, content in run.items()}
        elif present_name(source).partition(".")[0] == "nlctl":
            continue
        else:
            contents = {f"module {source}": _source(_module_places(source)[0]).read_bytes()}
        yield from (statement(key, place, content) for place, content in contents.items())


def check_place(name: str) -> None:
    """Refuse the name of a function that cannot be one, or is of Python's standard library."""
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
            f"'{source}' is a module of Python's standard library, which does nothing with a loop"
        )


def _is_standard(module: str | None) -> bool:
    return (module or "").partition(".")[0] in sys.stdlib_module_names


def _module_places(name: str) -> list[Path]:
    """Return the file or the folders of a top-level module, without importing it."""
    top = name.partition(".")[0]
    try:
        spec = importlib.util.find_spec(top)
    except (ImportError, ValueError):  # of a module that hides where it is from
        spec = None
    if spec is None:
        raise ParameterError(f"there is no module '{top}'")
    folders = list(spec.submodule_search_locations or ())
    return [Path(p) for p in folders] or [Path(spec.origin or top)]


def _source(place: Path) -> Path:
    """Return the file of a top-level module that stands for it."""
    return place / "__init__.py" if place.is_dir() else place


@functools.cache
def _built_on() -> frozenset[str]:
    """Return the top-level modules of python-control, and of packages that need it or nlctl."""
    modules = {"control"}
    for name, packages in metadata.packages_distributions().items():
        needed = (need for p in packages for need in metadata.distribution(p).requires or ())
        plain = {re.split(r"[^\w.-]", need)[0].lower() for need in needed if "extra ==" not in need}
        if plain & set(MAKERS):
            modules.add(name)
    return frozenset(modules)


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


def check_function(function: object, name: str) -> None:
    """Refuse what no study needs to be called: functions of the standard library, builtins."""
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


def check_loop_function(function: object, name: str) -> None:
    """Refuse, without calling it, a function that is not known to return a diagram."""
    # That is known by its return annotation, or because it, or what it calls, uses control or
    # nlctl.
    check_function(function, name)
    plain = _plain(function)
    waits = inspect.iscoroutinefunction(plain) or inspect.isgeneratorfunction(plain)
    if not isinstance(plain, FunctionType) or waits or inspect.isasyncgenfunction(plain):
        raise ParameterError(f"'{name}' needs a function that returns a diagram, got {plain!r}")
    annotation = _annotation(plain)
    if annotation and all(_outermost(part) in NO_DIAGRAMS for part in annotation.split("|")):
        raise ParameterError(
            f"'{name}' needs a function that returns a diagram, it returns {annotation}"
        )
    if not DIAGRAMS & set(re.findall(r"\w+", annotation)) and not _uses_makers(plain, set()):
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


def _uses_makers(member: object, seen: set[int]) -> bool:
    """Whether a function, or what it reaches, reads something of control or nlctl."""
    member = _plain(member)
    if isinstance(member, ModuleType):
        return _is_maker(member.__name__)
    if _is_maker(getattr(member, "__module__", None) or ""):
        return True
    if id(member) in seen:
        return False
    seen.add(id(member))
    if isinstance(member, type):
        return any(_uses_makers(part, seen) for part in vars(member).values() if callable(part))
    if not isinstance(member, FunctionType):
        module = type(member).__module__.partition(".")[0]
        return module not in sys.stdlib_module_names and _uses_makers(type(member), seen)
    names = {name for code in codes_in(member.__code__) for name in code.co_names}
    reached = [member.__globals__[name] for name in names if name in member.__globals__]
    reached += [held for cell in member.__closure__ or () if (held := in_cell(cell)) is not None]
    imported = {name.partition(".")[0] for name in names}  # inside of the function
    return bool(imported & set(MAKERS)) or any(_uses_makers(part, seen) for part in reached)


def _is_maker(module: str) -> bool:
    return module.partition(".")[0] in MAKERS and not _is_in(module, [_ABOUT_LOOPS])
