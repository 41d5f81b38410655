"""What only some machines have: tests skip where it is missing, but fail where CI is set."""

import importlib
import os
import shutil
from types import ModuleType
from typing import NoReturn

import pytest


def needed(module: str, extra: str) -> ModuleType:
    """Import a module of an extra; for fixtures and tests, since what is not run needs nothing."""
    try:
        return importlib.import_module(module)
    except ImportError:
        missing(f"needs {module}: pip install '.[{extra}]'")


def needed_program(names: tuple[str, ...]) -> str:
    """Find a program by any of its names."""
    return next(filter(None, map(shutil.which, names)), None) or missing(f"needs {names[0]}")


def missing(reason: str) -> NoReturn:
    """Skip the test that is running, or fail it in continuous integration."""
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)
