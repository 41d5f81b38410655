"""The former name of `nlctl.analysis`, ``analysis``: the same modules, and one warning.

The package ``analysis`` of a wheel is its ``__init__.py`` alone, which calls `use_former_name`; in
a checkout that is what the folder does under its former name.  A user's own ``analysis.py`` comes
first, as the folder of a script does on ``sys.path``.
"""

import filecmp
import functools
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import CodeType, ModuleType
from typing import Any

from .checkout import ANALYSIS

FORMER = "analysis"
GONE_IN = "0.2"


class _SameModules:
    """Finds what is in ``analysis`` and loads what `nlctl.analysis` has, no second copy of it."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = find_spec(f"nlctl.{name}") if name.startswith(f"{FORMER}.") else None
        if spec is None:
            return None
        is_package = spec.submodule_search_locations is not None
        loader: Any = _SameModules
        return ModuleSpec(name, loader, origin=spec.origin, is_package=is_package)

    @staticmethod
    def create_module(spec: ModuleSpec) -> ModuleType:
        module = import_module(f"nlctl.{spec.name}")
        spec.loader_state = module.__spec__
        for name, loaded in list(sys.modules.items()):  # Python would bind them in their package,
            if name.startswith(f"{ANALYSIS}."):  # where functions have their names: lyapunov.ledger
                sys.modules.setdefault(name.removeprefix("nlctl."), loaded)
        return module

    @staticmethod
    def exec_module(module: ModuleType) -> None:
        spec: Any = module.__spec__  # of the former name: Python has just put it there
        module.__spec__ = spec.loader_state

    @staticmethod
    def get_code(name: str) -> CodeType | None:  # of `python -m analysis.recheck`
        spec: Any = find_spec(f"nlctl.{name}")
        return spec.loader.get_code(f"nlctl.{name}")


def use_former_name() -> None:
    """Make ``import analysis`` mean `nlctl.analysis`, with a warning at the line that imports."""
    warn_of_it(stacklevel=4)
    sys.modules[FORMER] = import_module(ANALYSIS)
    sys.meta_path.insert(0, _SameModules)


def is_former(spec: ModuleSpec | None) -> bool:
    """Whether a module that is called ``analysis`` is nlctl's, and not one of a user."""
    if spec is None or spec.name == ANALYSIS:
        return spec is not None
    ours = find_spec(ANALYSIS)  # of an editable install there is a copy elsewhere
    if spec.origin is None or ours is None or ours.origin is None:
        return False
    return filecmp.cmp(spec.origin, ours.origin, shallow=False)


def present_name(module: str) -> str:
    """Return what a module is called now; of a user's own ``analysis`` that is as before."""
    of_ours = module.partition(".")[0] == FORMER and is_former(find_spec(FORMER))
    return f"nlctl.{module}" if of_ours else module


@functools.cache
def warn_of_it(stacklevel: int = 2) -> None:
    """Warn of the former name, once in a process, at the line of the caller or further up."""
    warnings.warn(
        f"'{FORMER}' is '{ANALYSIS}' now: write that, the old name goes in version {GONE_IN}",
        FutureWarning,
        stacklevel=stacklevel,
    )
