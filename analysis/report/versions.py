"""What a report was made with."""

from __future__ import annotations

import platform
from importlib.metadata import version

__all__ = ["versions"]

PACKAGES = ("nlctl", "control", "numpy", "scipy", "pandas", "numba", "matplotlib")


def versions(*others: str) -> dict[str, str]:
    """Return the machine, Python, and the versions of the packages that every report needs.

    Parameters
    ----------
    *others : str
        Names of further packages.
    """
    own = {"system": f"{platform.system()} {platform.machine()}"}
    own["Python"] = platform.python_version()
    return own | {name: version(name) for name in (*PACKAGES, *others)}
