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
    total = dict(a)
    for product, c in b.items():
        total[product] = total.get(product, Fraction(0)) + scale * c
    need(all(c.numerator.bit_length() <= _BITS for c in total.values()), "a number is too large")
    return {product: c for product, c in total.items() if c}


def _times(a: SumOfProducts, b: SumOfProducts) -> SumOfProducts:
    need(len(a) * len(b) <= _MOST, "an equation is too long")
    result: SumOfProducts = {}
    for one, c in a.items():
        for two, d in b.items():
            powers: dict[Any, int] = dict(one)
            for atom, n in two:
                powers[atom] = powers.get(atom, 0) + n
            product = tuple(sorted(powers.items(), key=repr))
            result = (
                plus(result, {product: c}, d) if product in result else result | {product: c * d}
            )
    return plus({}, result, Fraction(1))


def _function(operation: str, *arguments: SumOfProducts) -> SumOfProducts:
    inner = (tuple(sorted(one.items(), key=repr)) for one in arguments)
    return {(((operation, *inner), 1),): Fraction(1)}


def multiplied_out(equation: WrittenEquation) -> SumOfProducts:
    """Return an equation as a sum of products of symbols and functions of sums."""
    sums: list[SumOfProducts] = []
    for operation, *operands in equation.nodes:
        if operation == "number":
            sums.append(plus({}, NO_SYMBOLS, read_rational(operands[0])))
        elif operation == "symbol":
            sums.append(one_symbol(operands[0]))
        elif operation == "power":
            power = NO_SYMBOLS
            for _ in range(operands[1]):
                power = _times(power, sums[operands[0]])
            sums.append(power)
        elif operation == "+":
            sums.append(plus(sums[operands[0]], sums[operands[1]], Fraction(1)))
        elif operation == "*":
            sums.append(_times(sums[operands[0]], sums[operands[1]]))
        elif operation == "/" and sums[operands[1]].keys() == {()}:
            sums.append(plus({}, sums[operands[0]], 1 / sums[operands[1]][()]))
        elif operation == "/":
            sums.append(_times(sums[operands[0]], _function("/", sums[operands[1]])))
        else:
            sums.append(_function(operation, *(sums[i] for i in operands)))
    return sums[-1]


def as_equation(total: Mapping[tuple[Any, ...], Fraction]) -> WrittenEquation:
    """Return a sum of products as an equation."""
    nodes: list[list[Any]] = []

    def add(*node: object) -> int:
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
