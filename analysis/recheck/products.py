"""Equations as sums of products with rational coefficients, in which what is equal cancels."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from .content import need, read_rational
from .equations import WrittenEquation

_MOST, _BITS = 20_000, 20_000  # products of terms, and bits of a coefficient
SumOfProducts = dict[tuple[Any, ...], Fraction]  # by product: a tuple of pairs (atom, power)
NO_SYMBOLS: SumOfProducts = {(): Fraction(1)}


def one_symbol(name: str) -> SumOfProducts:
    """Return a symbol as a sum."""
    return {((("symbol", name), 1),): Fraction(1)}


def plus(a: SumOfProducts, b: SumOfProducts, scale: Fraction) -> SumOfProducts:
    """Return a + scale b."""
    made = dict(a)
    for product, c in b.items():
        made[product] = made.get(product, Fraction(0)) + scale * c
    need(all(c.numerator.bit_length() <= _BITS for c in made.values()), "a number is too large")
    return {product: c for product, c in made.items() if c}


def _times(a: SumOfProducts, b: SumOfProducts) -> SumOfProducts:
    need(len(a) * len(b) <= _MOST, "an equation is too long")
    made: SumOfProducts = {}
    for one, c in a.items():
        for two, d in b.items():
            powers: dict[Any, int] = dict(one)
            for atom, n in two:
                powers[atom] = powers.get(atom, 0) + n
            product = tuple(sorted(powers.items(), key=repr))
            made = plus(made, {product: c}, d) if product in made else made | {product: c * d}
    return plus({}, made, Fraction(1))


def _function(operation: str, *arguments: SumOfProducts) -> SumOfProducts:
    inner = (tuple(sorted(one.items(), key=repr)) for one in arguments)
    return {(((operation, *inner), 1),): Fraction(1)}


def multiplied_out(equation: WrittenEquation) -> SumOfProducts:
    """Return an equation as a sum of products of symbols and functions of sums."""
    found: list[SumOfProducts] = []
    for operation, *given in equation.nodes:
        if operation == "number":
            found.append(plus({}, NO_SYMBOLS, read_rational(given[0])))
        elif operation == "symbol":
            found.append(one_symbol(given[0]))
        elif operation == "power":
            made = NO_SYMBOLS
            for _ in range(given[1]):
                made = _times(made, found[given[0]])
            found.append(made)
        elif operation == "+":
            found.append(plus(found[given[0]], found[given[1]], Fraction(1)))
        elif operation == "*":
            found.append(_times(found[given[0]], found[given[1]]))
        elif operation == "/" and found[given[1]].keys() == {()}:
            found.append(plus({}, found[given[0]], 1 / found[given[1]][()]))
        elif operation == "/":
            found.append(_times(found[given[0]], _function("/", found[given[1]])))
        else:
            found.append(_function(operation, *(found[i] for i in given)))
    return found[-1]


def as_equation(total: Mapping[tuple[Any, ...], Fraction]) -> WrittenEquation:
    """Return a sum of products as an equation."""
    nodes: list[list[Any]] = []

    def add(*node: Any) -> int:
        nodes.append(list(node))
        return len(nodes) - 1

    def atom_of(operation: str, *inner: Any) -> int:
        if operation == "symbol":
            return add(operation, *inner)
        places = [sum_of(dict(one)) for one in inner]
        return add(operation, *([add("number", "1")] if operation == "/" else []), *places)

    def sum_of(terms: Mapping[tuple[Any, ...], Fraction]) -> int:
        whole = add("number", "0")
        for product, c in terms.items():
            term = add("number", str(c))
            for atom, n in product:
                term = add("*", term, add("power", atom_of(*atom), n))
            whole = add("+", whole, term)
        return whole

    sum_of(total)
    return WrittenEquation(nodes)
