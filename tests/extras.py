"""What only some machines have: skipped where it is missing, but never where CI is set."""

import importlib
import os
import shutil
from types import ModuleType

import pytest


def needed(module: str, extra: str) -> ModuleType:
    """Import a module of an extra, or skip all tests of the module that asks for it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        if os.environ.get("CI"):
            raise
    pytest.skip(f"needs {module}: pip install '.[{extra}]'", allow_module_level=True)


def needed_program(names: tuple[str, ...]) -> str:
    """Find a program by any of its names, or skip all tests of the module that asks for it."""
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None and os.environ.get("CI"):
        raise FileNotFoundError(f"none of {', '.join(names)} is installed")
    if found is None:
        pytest.skip(f"needs one of {', '.join(names)}", allow_module_level=True)
    return found
