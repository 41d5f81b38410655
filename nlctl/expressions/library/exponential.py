"""The exponential of a matrix of expressions.

Source: N. J. Higham, The scaling and squaring method for the matrix exponential revisited, 2005.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from ..operators import product
from .table import WRITTEN, Facade

_SQUARINGS = 4
_LARGEST = 5.37 * 2**_SQUARINGS  # norm up to which the approximant is exact to rounding
_ROWS = 4  # more would be longer than what is called
# of Pade's approximant of order 13: k-th over the first
_PADE = [
    math.factorial(26 - k) * math.factorial(13)
    / (math.factorial(26) * math.factorial(13 - k) * math.factorial(k))
    for k in range(14)
]  # fmt: skip


def expm(graph: Graph, a: Any) -> Tracer:
    """Return e^A; NaN where its norm is so large that SciPy would square more often."""
    matrix = traced(graph, a)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise Untraceable("the exponential of a matrix that is not square")
    if matrix.shape[0] > _ROWS:
        raise Untraceable(f"the exponential of a matrix of more than {_ROWS} rows")
    np_, one = Facade(graph), traced(graph, np.eye(matrix.shape[0]))
    norm = np_.max(np_.sum(np_.abs(matrix), axis=0))
    small = matrix / 2.0**_SQUARINGS
    powers = [one, product(small, small)]
    powers += [product(powers[1], powers[1])]
    powers += [product(powers[1], powers[2])]
    even, odd = (_of_powers(powers, _PADE[k::2]) for k in (0, 1))
    odd = product(small, odd)
    result = WRITTEN[np.linalg.solve](graph, even - odd, even + odd)
    for _ in range(_SQUARINGS):
        result = product(result, result)
    return np_.where(norm <= _LARGEST, result, np.nan)


def _of_powers(powers: list[Tracer], factors: list[float]) -> Tracer:
    """Return the polynomial in the square, of which the powers up to the third are there."""
    low, high = factors[:4], factors[4:]
    upper: Any = sum(f * p for f, p in zip(high, powers[1:], strict=False))
    lower: Any = sum(f * p for f, p in zip(low, powers, strict=False))
    return lower + product(powers[3], upper)
