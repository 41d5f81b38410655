"""Functions of samples: plain Python that machine code calls, too, and that says what is wrong."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np
from numba.extending import overload

from nlctl.annotations import reporting
from nlctl.equations import equation

_F = TypeVar("_F", bound=Callable[..., Any])
_SAMPLES = {  # what arguments of the same name are, as an entry of a docstring
    "t": "t : ndarray, shape (n,)\n    Sample times (s), increasing (two for integrals).\n",
    "y": "y : ndarray, shape (n,)\n    Samples.\n",
}
_BREAKS = (
    "breaks : ndarray, shape (m,), optional\n    Increasing times (s) at which y may jump or bend. "
    " The limits there count as values.\n"
)


def of_samples(function: _F) -> _F:
    """Mark a function of samples as an equation that says which argument is not as annotated."""
    if function.__doc__:  # Python has none with -OO
        function.__doc__ = _described(function, function.__doc__)
    plain = equation(function)
    called = reporting(plain, function.__name__, _lengths)
    overload(called, strict=False)(lambda *_, **__: plain)
    return called


def _described(function: Any, text: str) -> str:
    """Return a docstring with what all of them take: times and samples first, breaks last."""
    names, doc = inspect.signature(function).parameters, inspect.cleandoc(text)
    shared = "".join(entry for name, entry in _SAMPLES.items() if name in names)
    if not shared:
        return doc
    before, _, after = doc.partition("\n\nReturns\n")
    summary, _, others = before.partition("\n\nParameters\n----------\n")
    entries = f"{shared}{others}\n" if others else shared
    section = f"Parameters\n----------\n{entries}{_BREAKS if 'breaks' in names else ''}"
    return f"{summary}\n\n{section}\nReturns\n{after}"


def _lengths(given: Mapping[str, Any]) -> str | None:
    """Say that samples are in a row, one for each time."""
    shapes = {name: np.shape(given[name]) for name in ("t", "y") if name in given}
    if len(set(shapes.values())) == 1 and all(len(shape) == 1 for shape in shapes.values()):
        return None
    return f"samples in a row, one for each time, got shapes {', '.join(map(str, shapes.values()))}"
