"""Sums of polynomials of NumPy's modules, by Clenshaw's recurrences as these have them."""

from __future__ import annotations

from typing import Any

from numpy.polynomial import chebyshev, legendre

from ..arrays import traced
from ..graph import Untraceable
from .table import Facade, formula

__all__: list[str] = []


def _terms(np_: Facade, x: Any, c: Any) -> tuple[Any, list[Any]]:
    coefficients = traced(np_.graph, c)
    if coefficients.ndim != 1 or not len(coefficients):
        raise Untraceable("coefficients of several polynomials")
    return traced(np_.graph, x), list(coefficients)


@formula(chebyshev.chebval)
def _chebval(np_: Facade, x: Any, c: Any, tensor: bool = True) -> Any:
    """Return the sum of c_i T_i(x)."""
    x, c = _terms(np_, x, c)
    one, other = c[-2:] if len(c) > 1 else (c[0], 0.0)
    for factor in c[-3::-1]:
        one, other = factor - other, one + other * (2.0 * x)
    return one + other * x


@formula(legendre.legval)
def _legval(np_: Facade, x: Any, c: Any, tensor: bool = True) -> Any:
    """Return the sum of c_i P_i(x)."""
    x, c = _terms(np_, x, c)
    one, other = c[-2:] if len(c) > 1 else (c[0], 0.0)
    for degree in range(len(c) - 1, 1, -1):
        first = c[degree - 2] - other * ((degree - 1) / degree)
        one, other = first, one + other * x * ((2 * degree - 1) / degree)
    return one + other * x
