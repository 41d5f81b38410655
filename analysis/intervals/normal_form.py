"""Equations as sums of products, in which what is equal cancels exactly.

Balls enclose f(x) - f(x) by twice the width of f.  A plant that a regressor spans leaves nothing
of its equation when the right multiple of the regressor is taken away; that is seen only if both
are brought into one form first: sums of products of atoms, with rational coefficients.  An atom is
a symbol, or a function of a sum such as sin(2 x1).
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, fmpq, fmpq_mat

from nlctl.expressions.functions import FUNCTIONS

from .arithmetic import Ball, as_ball
from .numpy_functions import NumPyFunctions, calling, of_lifted
from .paths import Undecided

LARGEST_POWER = 12  # powers up to which a sum is multiplied out
EVERYWHERE = ("sin", "cos", "tanh", "exp", "arctan", "arcsinh", "absolute", "minimum", "maximum",
              "hypot", "logaddexp", "sinc", "table")  # fmt: skip  # continuous, for all numbers


@dataclass(frozen=True)
class Atom:
    """A symbol, or a function of sums that is not divided any further."""

    name: str  # of the symbol, or of the function
    # monomials of the sums that it is a function of; empty for a symbol
    arguments: tuple[Monomials, ...] = ()
    data: tuple[tuple[float, ...], ...] = ()  # break points and values of a table

    @property
    def names(self) -> set[str]:
        """Names of the symbols that it depends on."""
        inner = (atom for terms in self.arguments for atom in _atoms(terms))
        return {self.name} if not self.arguments else {n for atom in inner for n in atom.names}

    def __repr__(self) -> str:
        given = ", ".join(str(_in_order(terms)) for terms in self.arguments)
        return f"{self.name}({given}){self.data or ''}" if given else self.name

    def on(self, values: Mapping[str, Any]) -> Any:
        """Return the value where symbols have these values."""
        if not self.arguments:
            return values[self.name]
        given = [_value(terms, values) for terms in self.arguments]
        if self.name == "inverse":
            return 1 / given[0]
        if self.name == "absolute":
            return abs(given[0])
        if self.name == "table":
            return given[0].table(*self.data)
        if len(given) > 1:
            return getattr(given[0], self.name)(given[1])
        return given[0].apply(self.name)


Product = frozenset[tuple[Atom, int]]
Monomials = frozenset[tuple[Product, Fraction]]
_ONE: Product = frozenset()


def _atoms(terms: Monomials) -> Iterator[Atom]:
    return (atom for product, _ in terms for atom, _ in product)


@functools.lru_cache(4096)
def _in_order(terms: Monomials) -> list[tuple[list[tuple[Atom, int]], Fraction]]:
    """Return terms in an order that is the same in every process: sums of balls depend on it."""
    return sorted(
        [(sorted(product, key=str), coefficient) for product, coefficient in terms], key=str
    )


def _value(terms: Monomials, values: Mapping[str, Any]) -> Any:
    total: Any = Ball(arb(0))
    for factors, coefficient in _in_order(terms):
        term: Any = Ball(arb(fmpq(coefficient.numerator, coefficient.denominator)))
        for atom, n in factors:
            term = term * atom.on(values) ** n
        total = total + term
    return total


def as_sum(x: object) -> Any:
    """Return a number as a sum; NotImplemented for what is not a number."""
    if isinstance(x, Sum):
        return x
    if isinstance(x, Fraction):
        return Sum({_ONE: x})
    ball = as_ball(x)
    if ball is NotImplemented or isinstance(x, Ball | arb):
        return NotImplemented
    return Sum({_ONE: exact(x)})


class Sum(NumPyFunctions):
    """A sum of products of atoms, as equations compute with it."""

    __slots__ = ("partial", "terms")
    rank = 2

    def __init__(
        self, terms: Mapping[Product, Fraction], partial: frozenset[Atom] = frozenset()
    ) -> None:
        # rational coefficient of every product, a set of pairs (atom, power); none is 0
        self.terms = {product: c for product, c in terms.items() if c}
        # atoms without a value somewhere, or with a jump, which took part even if they have
        # cancelled: the sum is what the equation is only where they have a value
        self.partial = partial

    lifted = staticmethod(as_sum)
    minimum, maximum = calling("pair", "minimum"), calling("pair", "maximum")

    def __repr__(self) -> str:
        return f"Sum({self.terms})"

    @property
    def names(self) -> set[str]:
        """Names of the symbols that it depends on."""
        inner = {name for atom in _atoms(self.key()) for name in atom.names}
        return inner.union(*(atom.names for atom in self.partial))

    def key(self) -> Monomials:
        """Its terms, to be compared: of sums themselves no comparison has an answer."""
        return frozenset(self.terms.items())

    def _compared(self, order: str, other: object) -> Any:
        raise Undecided("a comparison of symbols has no answer for all values")

    def coefficient(self, product: Product) -> Fraction:
        """Return the coefficient of a product; 0 where it does not occur."""
        return self.terms.get(product, Fraction(0))

    def on(self, values: Mapping[str, Any]) -> Any:
        """Return the value where symbols have these values, balls by name."""
        for atom in self.partial:
            if not as_ball(atom.on(values)).value.is_finite():
                raise Undecided(f"{atom.name} has no value somewhere")
        return _value(self.key(), values)

    def __neg__(self) -> Sum:
        return Sum({product: -c for product, c in self.terms.items()}, self.partial)

    @of_lifted
    def __add__(self, other: Sum) -> Any:
        terms = dict(self.terms)
        for product, c in other.terms.items():
            terms[product] = terms.get(product, Fraction(0)) + c
        return Sum(terms, self.partial | other.partial)

    @of_lifted
    def __mul__(self, other: Sum) -> Any:
        terms: dict[Product, Fraction] = {}
        for one, c in self.terms.items():
            for two, d in other.terms.items():
                powers = dict(one)
                for atom, n in two:
                    powers[atom] = powers.get(atom, 0) + n
                product = frozenset(powers.items())
                terms[product] = terms.get(product, Fraction(0)) + c * d
        return Sum(terms, self.partial | other.partial)

    @of_lifted
    def __truediv__(self, other: Sum) -> Any:
        constant = other.coefficient(_ONE)
        if other.key() == {(_ONE, constant)} and not other.partial:
            return self * (1 / constant)
        return self * other._function("inverse")

    def _whole_power(self, n: int) -> Sum:
        if n > LARGEST_POWER:
            raise Undecided(f"a power of {n}")
        return super()._whole_power(n)

    def __abs__(self) -> Sum:
        return self._function("absolute")

    def apply(self, name: str) -> Sum:
        """Return a function of the table that has an enclosure, as an atom."""
        assert name == "sinc" or FUNCTIONS[name].enclosure is not None
        return self._function(name)

    def pair(self, name: str, other: object) -> Sum:
        """Return a function of two arguments, as an atom."""
        return self._function(name, as_sum(other))

    def table(self, xp: tuple[float, ...], fp: tuple[float, ...]) -> Sum:
        """Return the linear interpolation of a table, as an atom."""
        return self._function("table", data=(xp, fp))

    def _function(self, name: str, *others: Sum, data: tuple[Any, ...] = ()) -> Sum:
        atom = Atom(name, tuple(argument.key() for argument in (self, *others)), data)
        undefined = frozenset([] if name in EVERYWHERE else [atom])
        partial = undefined.union(self.partial, *(argument.partial for argument in others))
        return Sum({frozenset([(atom, 1)]): Fraction(1)}, partial)


def exact(number: Any) -> Fraction:
    """Return a number as the fraction that it is."""
    return number if isinstance(number, Fraction) else Fraction(float(number))


def indeterminate(name: str) -> Sum:
    """Return a symbol as a sum, which equations take instead of a number."""
    return Sum({frozenset([(Atom(name), 1)]): Fraction(1)})


def rational(x: object) -> fmpq:
    """Return a finite number as a rational one of flint."""
    if isinstance(x, fmpq):
        return x
    fraction: Fraction = exact(x)
    return fmpq(fraction.numerator, fraction.denominator)


def exact_matrix(M: np.ndarray) -> fmpq_mat:
    """Return a matrix of finite floats, as it is."""
    rows, columns = M.shape
    return fmpq_mat(rows, columns, [rational(v) for v in M.ravel()])


def is_positive_definite(M: fmpq_mat) -> bool:
    """Whether a symmetric matrix is, by its leading minors."""
    rows = M.tolist()
    return all(
        fmpq_mat(k, k, [v for row in rows[:k] for v in row[:k]]).det() > 0
        for k in range(1, len(rows) + 1)
    )
