"""Functions of samples: plain Python that machine code calls, too, and that says what is wrong."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np
from numba.extending import overload

from nlctl.annotations import reporting
from nlctl.attributes import with_parameters_of
from nlctl.equations import equation

_F = TypeVar("_F", bound=Callable[..., Any])


_SHARED = """What arguments of the same name are.

Parameters
----------
t : ndarray, shape (n,)
    Sample times (s), increasing (two for integrals).
y : ndarray, shape (n,)
    Samples.
breaks : ndarray, shape (m,), optional
    Increasing times (s) at which y may jump or bend.  The limits there count as values.
"""


def of_samples(function: _F) -> _F:
    """Mark a function of samples as an equation that says which argument is not as annotated."""
    plain = equation(with_parameters_of(_SHARED)(function))
    called = reporting(plain, function.__name__, _lengths)
    overload(called, strict=False)(lambda *_, **__: plain)
    return called


def _lengths(given: Mapping[str, Any]) -> str | None:
    """Say that samples are in a row, one for each time."""
    shapes = {name: np.shape(given[name]) for name in ("t", "y") if name in given}
    if len(set(shapes.values())) == 1 and all(len(shape) == 1 for shape in shapes.values()):
        return None
    return f"samples in a row, one for each time, got shapes {', '.join(map(str, shapes.values()))}"
