"""Compiled programs on disk, so that a second start does not compile again.

A program's key is made of its source and of everything that its functions are made of, down to the
functions and constants that these refer to.  An edited equation has another key: what is found
under a key is never stale.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import re
import sys
import tempfile
import types
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

import numba
import numpy as np
import platformdirs

from .._files import replace_file


class Sourced(Protocol):
    """Emitted source, and what it refers to: a `Program`, or one that was lowered."""

    @property
    def source(self) -> str: ...

    def namespace(self, *, native: bool) -> dict[str, Any]: ...


def cache_folder() -> Path:
    """Return where compiled programs are kept: NLCTL_CACHE_DIR, or the user's cache folder."""
    return Path(os.environ.get("NLCTL_CACHE_DIR") or platformdirs.user_cache_dir("nlctl"))


def program_key(program: Sourced) -> str:
    """Return a key that changes whenever anything changes that the machine code depends on."""
    digest = hashlib.sha256(f"{numba.__version__} {platform.python_version()}".encode())
    digest.update(program.source.encode())
    seen: set[int] = set()
    parts = program.namespace(native=True)
    for name in sorted(parts):
        for text in (name, *_fingerprint(parts[name], seen)):
            digest.update(text.encode() + b"\0")
    return digest.hexdigest()[:32]


def _fingerprint(thing: Any, seen: set[int]) -> Iterator[str]:
    """Yield text for a function and for everything that it refers to."""
    if isinstance(thing, tuple | list):
        yield f"{type(thing).__name__} of {len(thing)}"
        for item in thing:
            yield from _fingerprint(item, seen)
        return
    function = getattr(thing, "py_func", thing)
    if not isinstance(function, types.FunctionType):
        yield _constant(thing)
        return
    if id(function) in seen:
        return
    seen.add(id(function))
    yield f"of {function.__module__}"  # what is on disk refers to it by this name
    yield from _code_text(function.__code__)
    for cell in function.__closure__ or ():
        yield from _fingerprint(cell.cell_contents, seen)
    for name in _all_names(function.__code__):
        if name in function.__globals__:
            yield name
            yield from _fingerprint(function.__globals__[name], seen)


def _code_text(code: types.CodeType) -> Iterator[str]:
    yield code.co_code.hex()
    yield " ".join(code.co_names + code.co_varnames + code.co_freevars)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code_text(constant)
        else:
            yield repr(constant)


def _all_names(code: types.CodeType) -> list[str]:
    """Return the global names of a code object and of those nested in it, in a fixed order."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names.update(_all_names(constant))
    return sorted(names)


def _constant(value: Any) -> str:
    """Return text for a value that machine code may contain; modules and types by their names."""
    if isinstance(value, types.ModuleType):
        return f"module {value.__name__} {getattr(value, '__version__', '')}"
    if isinstance(value, type):
        return f"type {value.__qualname__} {getattr(value, '_fields', '')}"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {value.tobytes().hex()}"
    return re.sub(r" at 0x[0-9a-f]+", "", repr(value))  # addresses differ between processes


def loaded(program: Sourced, functions: Mapping[str, Any]) -> types.ModuleType:
    """Return the program as a module whose file lies in the cache, where numba finds its code.

    Where the cache cannot be written to, a folder for this process alone takes its place.
    """
    key = program_key(program)
    name = f"nlctl_program_{key}"
    path = cache_folder() / f"{name}.py"
    try:
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(path, lambda file: file.write(program.source.encode()))
    except OSError:
        path = Path(tempfile.mkdtemp(prefix="nlctl-")) / f"{name}.py"
        path.write_text(program.source, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None, path
    assert spec.loader is not None, path
    module = importlib.util.module_from_spec(spec)
    module.__dict__.update(program.namespace(native=True) | dict(functions))
    sys.modules[name] = module  # numba looks the module up when it loads the code
    spec.loader.exec_module(module)
    return module
