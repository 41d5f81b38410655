"""`nlctl.analysis` in a checkout, where its folder lies next to `nlctl` and not inside of it.

A wheel has it inside, where Python finds it by itself, and this module does nothing.  In a
checkout, an unpacked sdist and an editable install this one name is looked up next to this very
file, so that the analysis always is of the same checkout as `nlctl`, whatever else is installed.  A
symbolic link is a text on Windows and its content twice in archives; the repository's root in
``nlctl.__path__`` would make ``nlctl.tests`` a module; what hatch's exact editable installs write
names the checkout that was installed, also where ``PYTHONPATH`` names another one.
"""

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType

ANALYSIS = "nlctl.analysis"
NLCTL_FOLDER = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
NEXT_TO_IT = os.path.join(os.path.dirname(NLCTL_FOLDER), "analysis")
_IS_CHECKOUT = not os.path.isfile(os.path.join(NLCTL_FOLDER, "analysis", "__init__.py")) and (
    os.path.isfile(os.path.join(NEXT_TO_IT, "__init__.py"))
)
SOURCES = (NLCTL_FOLDER, NEXT_TO_IT) if _IS_CHECKOUT else (NLCTL_FOLDER,)
"""The folders with all of nlctl's modules."""


def file_of_nlctl(name: str) -> Path:
    """Return where a file of nlctl is, such as ``native/run.py`` or ``analysis/catalogue.py``."""
    is_next_to_it = _IS_CHECKOUT and name.startswith("analysis/")
    return Path(os.path.dirname(NEXT_TO_IT) if is_next_to_it else NLCTL_FOLDER) / name


class _NextToIt:
    """Finds one module."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != ANALYSIS:
            return None
        file = os.path.join(NEXT_TO_IT, "__init__.py")
        return spec_from_file_location(name, file, submodule_search_locations=[NEXT_TO_IT])


def find_analysis() -> None:
    """Let Python find `nlctl.analysis` if this is a checkout."""
    if _IS_CHECKOUT:
        sys.meta_path.insert(0, _NextToIt)
