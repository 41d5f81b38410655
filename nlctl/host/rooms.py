"""Rooms of nlctl: what is public there and not at the top.

The top once had all blocks, errors and results: ``nlctl.BoucWen`` still is
`nlctl.actuators.BoucWen`, with a warning that says so.  Where a name is now is read from the
``__all__`` of the rooms, whose import would take seconds.
"""

import ast
import difflib
import functools
import os
import warnings
from collections.abc import Iterable
from importlib import import_module
from importlib.util import find_spec

from .checkout import NLCTL_FOLDER
from .former_name import GONE_IN

__all__ = ["face", "found_in_room", "public_names"]

_MOVED_TO = ("actuators", "controllers", "describing", "errors", "native", "observers", "plants")
_MOVED_TO += ("references", "sampling", "sensitivities", "sources")


def face(room: str) -> str:
    """Return the file with the public names of a room, whether it is a package or a module."""
    package = os.path.join(NLCTL_FOLDER, room, "__init__.py")
    return package if os.path.isfile(package) else os.path.join(NLCTL_FOLDER, f"{room}.py")


def public_names(room: str) -> list[str]:
    """Return the ``__all__`` of a room, which is not imported."""
    return _listed_in(face(room))


def _listed_in(path: str) -> list[str]:
    """Return the ``__all__`` of a file."""
    with open(path, "rb") as file:
        statements = ast.parse(file.read()).body
    return next(
        ast.literal_eval(one.value)
        for one in statements
        if isinstance(one, ast.Assign) and ast.unparse(one.targets[0]) == "__all__"
    )


@functools.cache
def _places() -> dict[str, str]:
    """Return the room of each name that may have been at the top."""
    return {name: room for room in _MOVED_TO for name in public_names(room)}


def found_in_room(name: str) -> object:
    """Return what a former name of the top means, with a warning where it is used; or None.

    Python asks for every module of nlctl that it is about to import, too.
    """
    if name.startswith("_") or os.path.isfile(face(name)) or name not in _places():
        return None
    place = f"nlctl.{_places()[name]}"
    warnings.warn(
        f"nlctl.{name} is {place}.{name} now: write that, the short name goes in version {GONE_IN}",
        DeprecationWarning,
        stacklevel=3,
    )
    thing = getattr(import_module(place), name)
    setattr(import_module("nlctl"), name, thing)
    return thing


def _place_in_analysis(name: str) -> str | None:
    """Return the room of the analysis that has a name, which is not imported."""
    for room in ("lyapunov", "metrics", "robustness", "studies"):
        spec = find_spec(f"nlctl.analysis.{room}")
        if spec and spec.origin and name in _listed_in(spec.origin):
            return f"nlctl.analysis.{room}"
    return None


def with_nearest(name: str, listed: Iterable[str]) -> str:
    """Return what is said of a name that the top does not have."""
    refused = f"module 'nlctl' has no attribute '{name}'"
    if name.startswith("_"):  # tools look for many of these
        return refused
    place = _place_in_analysis(name)
    if place is not None:
        return f"{refused}; it is {place}.{name}"
    places = {n: f"nlctl.{r}" for n, r in _places().items()} | dict.fromkeys(listed, "nlctl")
    by_small = {known.lower(): known for known in places}
    near = difflib.get_close_matches(name.lower(), by_small, n=1)
    hint = [f"; nearest: {places[by_small[n]]}.{by_small[n]}" for n in near]
    return f"{refused}{''.join(hint)}"
