"""Files of a study as modules: each under a name of its own, with its neighbours.

Two studies may each have a ``plant.py``; both are loaded, none is taken for the other.  A file
imports what lies next to it by its plain name, as a script does; installed packages come first.
"""

import builtins
import contextlib
import hashlib
import importlib.util
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import cloudpickle

from nlctl.errors import ParameterError
from nlctl.host.former_name import FORMER, is_former

Admits = Callable[[Path], str]
"""Returns why a file may not be run; nothing if it may."""

_BESIDE: dict[str, set[str]] = {}  # names of modules -> those of the neighbours that they import
_FILES: dict[str, tuple[Path, bytes]] = {}  # by name of the module, with what was run


def load_file(path: Path, admits: Admits | None = None) -> ModuleType:
    """Return the module in a file; it is run once in a process."""
    path = path.resolve()
    if not path.is_file():
        raise ParameterError(f"there is no file '{path}'")
    return _loaded(_name_of(path), path, admits)


def loaded_with(path: Path) -> dict[Path, bytes]:
    """Return what was run of a file that was loaded, and of all neighbours that it has imported."""
    todo, files = [_name_of(path.resolve())], dict[str, tuple[Path, bytes]]()
    while todo:
        name = todo.pop()
        if name not in files and name in _FILES:
            files[name] = _FILES[name]
            todo += _BESIDE.get(name, ())
    return dict(files.values())


def _name_of(path: Path) -> str:
    """Return the name that a file has as a module: its own, and a key of its place."""
    stem = path.parent.name if path.name == "__init__.py" else path.stem
    return f"{stem}_{hashlib.sha256(str(path).encode()).hexdigest()[:8]}"


def _loaded(name: str, path: Path, admits: Admits | None) -> ModuleType:
    if name in sys.modules:
        return sys.modules[name]
    if reason := "" if admits is None else admits(path):
        raise ParameterError(reason)
    within = [str(path.parent)] if path.name == "__init__.py" else None
    spec: Any = importlib.util.spec_from_file_location(
        name, path, submodule_search_locations=within
    )
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    top = path.parents[name.count(".") + (path.name == "__init__.py")]
    module.__dict__["__builtins__"] = vars(builtins) | {"__import__": _importer(name, top, admits)}
    try:
        content = path.read_bytes()  # never __pycache__, which others may have made
        _FILES[name] = path, content
        exec(_compiled(content, path), module.__dict__)
    except BaseException:
        del sys.modules[name]
        raise
    cloudpickle.register_pickle_by_value(module)  # worker processes cannot import it
    return module


def _compiled(content: bytes, path: Path) -> Any:
    """Return the code of a file, which must be Python."""
    try:
        return compile(content, str(path), "exec", dont_inherit=True)
    except (SyntaxError, ValueError) as error:  # ValueError: zeros in it, before Python 3.12
        line = getattr(error, "lineno", None)
        where = f"line {line}: " if line else ""
        raise ParameterError(
            f"'{path}' is not Python: {where}{getattr(error, 'msg', None) or error}"
        ) from None


def _importer(importing: str, folder: Path, admits: Admits | None) -> Callable[..., Any]:
    """Return what ``import`` means in a module whose top-level neighbours are in `folder`."""

    def import_(
        name: str,
        globals: Any = None,  # noqa: A002 (Python's own names)
        locals: Any = None,  # noqa: A002
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> Any:
        if level:
            package = str((globals or {}).get("__package__") or "")
            full = importlib.util.resolve_name("." * level + name, package)
        else:
            top, dot, rest = name.partition(".")
            path = _neighbour(top, folder)
            if path is None:
                return builtins.__import__(name, globals, locals, fromlist or (), level)
            _loaded(_name_of(path), path, admits)
            full = _name_of(path) + dot + rest
        for part in _parents(full):
            _inner(part, admits)
        for item in fromlist or ():
            with contextlib.suppress(ModuleNotFoundError):
                _inner(f"{full}.{item}", admits)
        whole = _top(full)
        _BESIDE.setdefault(importing, set()).update(n for n in _FILES if _top(n) == whole)
        return sys.modules[full if fromlist else whole]

    return import_


def _top(full: str) -> str:
    return full.partition(".")[0]


def _parents(full: str) -> Iterator[str]:
    """Yield ``a``, ``a.b``, ``a.b.c``."""
    parts = full.split(".")
    for count in range(1, len(parts) + 1):
        yield ".".join(parts[:count])


def _inner(full: str, admits: Admits | None) -> None:
    """Load a module of a package, unless it is there."""
    package, _, name = full.rpartition(".")
    if full in sys.modules or not package:
        return
    parent = sys.modules[package]
    places = [Path(p) for p in getattr(parent, "__path__", ())]
    files = [f for p in places for f in (p / name / "__init__.py", p / f"{name}.py") if f.is_file()]
    if not files:
        raise ModuleNotFoundError(f"there is no module '{name}' in '{package}'", name=full)
    setattr(parent, name, _loaded(full, files[0].resolve(), admits))


def _neighbour(name: str, folder: Path) -> Path | None:
    """Return the file of a module that lies in a folder; None where an installed one has its name.

    A folder without ``__init__.py`` is not a module.
    """
    files = [
        path.resolve()
        for path in (folder / name / "__init__.py", folder / f"{name}.py")
        if path.is_file()
    ]
    if not files or name in sys.builtin_module_names or name in sys.stdlib_module_names:
        return None
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        spec = None
    if name == FORMER and is_former(spec):  # it hides no file of a user's
        spec = None
    same = spec is not None and spec.origin is not None and Path(spec.origin).resolve() in files
    return files[0] if spec is None or same else None
