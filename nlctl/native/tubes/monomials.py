"""Polynomials of few variables, each between -1 and 1, as rows of coefficients."""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True, eq=False)
class MonomialTable:
    """The monomials of degree 1 to some degree.

    Attributes
    ----------
    degrees : ndarray of shape (monomials,)
        The first ones are the variables themselves.
    even : ndarray of shape (monomials,)
        Whether it is never negative.
    products : ndarray of shape (pairs, 3)
        Numbers of two monomials and of their product, as far as that is one.
    has : ndarray of shape (monomials, variables)
        Whether a variable is in it.
    """

    degrees: np.ndarray
    even: np.ndarray
    products: np.ndarray
    has: np.ndarray

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """All of it."""
        return self.degrees, self.even, self.products, self.has


@functools.lru_cache(maxsize=16)
def monomials(variables: int, degree: int) -> MonomialTable:
    """Return all monomials of so many variables."""
    powers = [
        tuple(chosen.count(v) for v in range(variables))
        for total in range(1, degree + 1)
        for chosen in itertools.combinations_with_replacement(range(variables), total)
    ]
    numbers = {power: i for i, power in enumerate(powers)}
    sums = (
        (i, j, numbers.get(tuple(a + b for a, b in zip(p, q, strict=True))))
        for (p, i), (q, j) in itertools.product(numbers.items(), repeat=2)
        if sum(p) + sum(q) <= degree
    )
    return MonomialTable(
        degrees=np.array([sum(p) for p in powers], dtype=np.int64),
        even=np.array([all(a % 2 == 0 for a in p) for p in powers]),
        products=np.array([*sums], dtype=np.int64).reshape(-1, 3),
        has=np.array(powers) > 0,
    )
