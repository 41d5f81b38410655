"""A place for emitted source to live in: a module that exists in memory alone."""

from __future__ import annotations

import linecache
import sys
import types
from collections.abc import Mapping
from typing import Any

from .fingerprint import Sourced, program_key


def loaded(program: Sourced, functions: Mapping[str, Any]) -> types.ModuleType:
    """Return the program as a module, made of its own source.

    It is registered under the program's key, by which machine code that was kept finds it, and its
    lines are known to tracebacks.
    """
    name = f"nlctl_program_{program_key(program)}"
    file = f"<{name}>"
    lines = program.source.splitlines(keepends=True)
    linecache.cache[file] = (len(program.source), None, lines, file)
    module = types.ModuleType(name)
    module.__file__ = file
    module.__dict__.update(program.namespace(native=True) | dict(functions))
    exec(compile(program.source, file, "exec"), module.__dict__)
    sys.modules[name] = module  # machine code looks its globals up there
    return module
