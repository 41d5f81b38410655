"""Functions that move within a narrow range of their argument alone, and by what that is measured.

exp(-(x / w)^2), tanh(x / w), 1 / (1 + (x / w)^2) and high powers are constants, to rounding, but
for the few w around 0.  What a step that begins and ends there sees of them says nothing of what
lies in between, whether they are rates or what a condition compares.  One number measures it: where
it moves by 1 the function moves by a factor e at most, and farther than `RANGE` from 0 it is flat.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from .graph import Expr, Graph, deduce, needed
from .signs import NEVER_NEGATIVE, POSITIVE

RANGE = 36.0  # e^-36 is less than rounding
# of the integrators of both engines, in this measure and in parts of a step
LEADS = 8.0  # what a step may lead through: e^-8 of a pulse is seen
UNEXAMINED = 2.0  # what an argument moves by in a step that is not examined
SHORTER = 0.3  # part to be tried of a step that is too long
ITSELF, AREA, WAVE = 0, -1, -2  # kinds; others are exponents
_ORDERS, _APART = (8, 128, 2048, 32768, 524288), 4  # of what exponents of parameters are near
_LEAST_BASE = 1e-300  # a power of 0 is one of this, for its logarithm
_HIGH = 6  # powers from which on a function is as good as 0 around the root of what it is of
# what functions are measured by, in arguments; erf(6) is 1
_FACTORS = {
    "exp": 1.0, "expm1": 1.0, "exp2": math.log(2.0), "cosh": 1.0, "sinh": 1.0, "tanh": 2.0,
    "erf": 6.0, "erfc": 6.0,
}  # fmt: skip
_SHARP = (*_FACTORS, "arctan", "logaddexp")
_WAVE = LEADS / (0.5 * math.pi)  # of a sine inside: a step leads through a quarter of it


@dataclass(frozen=True)
class SharpArgument:
    """What moves gently, and how a function is measured by it."""

    expr: Expr
    # ``ITSELF``: it is the number; ``AREA``: twice its arsinh is, as of what has the tails of
    # 1 / x; ``WAVE``: it is, and nothing is flat anywhere; an exponent: that times the logarithm
    # of its size
    kind: int


def sharp_arguments(graph: Graph, nodes: Iterable[Expr]) -> tuple[SharpArgument, ...]:
    """Return by what the sharp functions among some expressions are measured."""
    arguments: dict[SharpArgument, None] = {}
    powers: dict[Expr, int] = {}
    for node in nodes:
        if not node.varies:
            continue
        if node.op in _FACTORS:
            factor, number = graph.const(_FACTORS[node.op]), graph.number(node.args[0])
            arguments[SharpArgument(graph.op("mul", factor, number), ITSELF)] = None
        elif node.op == "logaddexp":
            difference = graph.op("sub", *map(graph.number, node.args))
            arguments[SharpArgument(difference, ITSELF)] = None
        elif node.op == "arctan":
            arguments[SharpArgument(graph.number(node.args[0]), AREA)] = None
        elif node.op == "power" and node.args[1].op != "const":
            arguments |= dict.fromkeys(_open_power(graph, node))
        else:
            base, exponent, is_sharp = _flat_power(node)
            if is_sharp and base.varies and _is_gentle(base):
                powers[base] = max(powers.get(base, 0), exponent)
    known = (SharpArgument(graph.number(base), exponent) for base, exponent in powers.items())
    measured = (*arguments, *known)
    return (*measured, *_waves(graph, [argument.expr for argument in measured]))


def _waves(graph: Graph, arguments: Iterable[Expr]) -> dict[SharpArgument, None]:
    """Return by what the waves among arguments are measured: a few values do not show one."""
    factor = graph.const(_WAVE)
    return {
        SharpArgument(graph.op("mul", factor, graph.number(node.args[0])), WAVE): None
        for node in needed(arguments)
        if node.op in ("sin", "cos", "tan") and node.varies
    }


def _open_power(graph: Graph, node: Expr) -> Iterator[SharpArgument]:
    """Yield by what a power is measured whose exponent is a parameter, or varies."""
    base, exponent = map(graph.number, node.args)
    size, one = graph.op("absolute", exponent), graph.const(1.0)
    if exponent.varies or not base.varies:
        some = graph.op("maximum", graph.op("absolute", base), graph.const(_LEAST_BASE))
        moves = graph.op("mul", exponent, graph.op("log", some))
        yield SharpArgument(moves, ITSELF)
    elif _is_gentle(base):
        is_sharp = graph.op("ge", size, graph.const(float(_HIGH)))
        if _has_no_root(base):
            is_sharp = graph.op("or", is_sharp, graph.op("lt", exponent, graph.const(0.0)))
        for order in _ORDERS:
            is_near = graph.op("lt", size, graph.const(order * _APART))
            if order > _ORDERS[0]:
                above = graph.op("ge", size, graph.const(order / _APART))
                is_near = graph.op("and", is_near, above)
            chosen = graph.op("select", graph.op("and", is_sharp, is_near), base, one)
            yield SharpArgument(chosen, order)


def _flat_power(node: Expr) -> tuple[Expr, int, bool]:
    """Return of what a node is which power, and whether it is flat far from 0, or next to it."""
    if node.op == "div" and node.args[1].varies:
        base, exponent = as_power(node.args[1])
        while base.op == "sqrt" and base.sign != POSITIVE:
            base = base.args[0]
        return base, exponent, _has_no_root(base)
    if node.op == "power":
        base, exponent = node.args[0], float(node.args[1].data)
        divides = exponent < 0.0 and _has_no_root(base)
        return base, math.ceil(abs(exponent)), divides or abs(exponent) >= _HIGH
    base, exponent = as_power(node)
    return base, exponent, exponent >= _HIGH


def _has_no_root(divisor: Expr) -> bool:
    """Whether what is divided by is never 0, with parameters that are not."""
    if divisor.sign == POSITIVE or divisor.op != "add":
        return divisor.sign == POSITIVE
    terms = [divisor]
    while sums := [term for term in terms if term.op == "add"]:
        terms = [term for term in terms if term.op != "add"]
        terms += [arg for total in sums for arg in total.args]
    return all(term.sign >= NEVER_NEGATIVE or not term.varies for term in terms)


def _is_gentle(base: Expr) -> bool:
    """Return whether no sharp function is in it, which is measured by its own argument."""
    return not any(node.varies and node.op in _SHARP for node in needed([base]))


def as_power(expr: Expr) -> tuple[Expr, int]:
    """Return an expression as a power of another with a whole exponent: mostly itself to the 1.

    Of products those are seen that are written as such, as x**6 is: x x x x x x.
    """
    powers: dict[Expr, tuple[Expr, int]] = {}
    return deduce(powers, expr, _factors, lambda product: _power(product, powers))


def _factors(expr: Expr) -> tuple[Expr, ...]:
    return expr.args if expr.op == "mul" else ()


def _power(expr: Expr, powers: dict[Expr, tuple[Expr, int]]) -> tuple[Expr, int]:
    if expr.op == "power" and expr.args[1].op == "const":
        exponent = abs(float(expr.args[1].data))
        return (expr.args[0], int(exponent)) if exponent.is_integer() else (expr, 1)
    if expr.op == "mul":
        (base, exponent), (other, more) = (powers[factor] for factor in expr.args)
        if base is other:
            return base, exponent + more
    return expr, 1
