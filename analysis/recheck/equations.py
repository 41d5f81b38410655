"""Equations of the file, on boxes: values, slopes, and bounds that are proved by halving."""

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from .content import need, read_rational
from .integers import KNOWN_FUNCTIONS, UNITY, ZERO, Interval, exact_text

_INF = math.inf
_CELLS = 4_000
_TEXT = 100_000  # characters
_ARGUMENTS = {"number": 1, "symbol": 1, "power": 2, "+": 2, "*": 2, "/": 2, "minimum": 2,
              "maximum": 2} | dict.fromkeys(KNOWN_FUNCTIONS, 1)  # fmt: skip
_Box = Mapping[str, Interval]
_Slopes = tuple[Interval, Interval, list[Interval]]  # f here, f there, (here - there) / (x - x_0)


class WrittenEquation:
    """An expression as a list of nodes, each of nodes before it; the last one is its value."""

    def __init__(self, nodes: Any) -> None:
        need(isinstance(nodes, list) and bool(nodes), "an equation is empty")
        for i, node in enumerate(nodes):
            shaped = isinstance(node, list) and bool(node) and isinstance(node[0], str)
            need(shaped and _ARGUMENTS.get(node[0]) == len(node) - 1, f"unknown node {node!r}")
            operation, *arguments = node
            if operation == "power":
                n = arguments.pop()
                need(type(n) is int and 0 <= n <= 64, "an unknown power")
            for j in arguments:
                earlier = type(j) is int and 0 <= j < i
                need(earlier or operation in ("number", "symbol"), "a node is of those that follow")
        self.nodes = nodes

    def slopes(self, box: _Box, start: _Box, names: Sequence[str]) -> _Slopes:
        """Return f(x), f(x_0), s with f(x) = f(x_0) + s (x - x_0), x in `box`, x_0 in `start`."""
        # Coordinates without a name among `names` have the same value in x and x_0.
        values: list[_Slopes] = []
        for operation, *operands in self.nodes:
            if operation == "number":
                number = Interval.of(read_rational(operands[0]))
                values.append((number, number, [ZERO] * len(names)))
            elif operation == "symbol":
                need(operands[0] in box, f"no range of {operands[0]}")
                unit = [UNITY if name == operands[0] else ZERO for name in names]
                values.append((box[operands[0]], start[operands[0]], unit))
            elif operation in ("+", "*", "/", "minimum", "maximum"):
                values.append(_of_two(operation, *(values[i] for i in operands)))
            else:
                x, x_0, slopes = values[operands[0]]
                value, slope = KNOWN_FUNCTIONS.get(operation) or _power(operands[1])
                between, here = x.hull(x_0), value(x)  # of the mean value theorem
                there = here if x is x_0 else value(x_0)
                moved = [ZERO if s.low == s.high == 0 else slope(between) * s for s in slopes]
                values.append((here, there, moved))
        return values[-1]

    def on(self, box: _Box) -> Interval:
        """Return the value on a box."""
        return self.slopes(box, box, [])[0]

    def quotient_on(self, box: _Box) -> Interval:
        """Return (f(x, v) - f(x, 0)) / v on a box, for all v that it has."""
        return self.slopes(box, {**box, "v": ZERO}, ["v"])[2][0]

    def near_middle(self, box: _Box) -> Interval:
        """Return what f(X) and f(m) + s (X - m) have in common, m the centre of the box."""
        middle = _middle(box)
        names = [name for name in box if middle[name] is not box[name]]
        value, total, slopes = self.slopes(box, middle, names)
        for name, slope in zip(names, slopes, strict=True):
            total = total + slope * (box[name] - middle[name])
        return value.meet(total)

    def __str__(self) -> str:
        texts: list[str] = []
        for operation, *given in self.nodes:
            if operation == "number":
                texts.append(exact_text(read_rational(given[0])))
            elif operation == "symbol":
                texts.append(given[0])
            elif operation == "power":
                texts.append(f"{texts[given[0]]}^{given[1]}")
            elif operation in ("+", "*", "/"):
                texts.append(f"({texts[given[0]]} {operation} {texts[given[1]]})")
            else:
                texts.append(f"{operation}({', '.join(texts[i] for i in given)})")
            need(len(texts[-1]) <= _TEXT, "an equation is too long to be read")
        return texts[-1]


def _power(n: int) -> tuple[Callable[[Interval], Interval], Callable[[Interval], Interval]]:
    return lambda x: x.power(n), lambda x: Interval.of(n) * x.power(max(n - 1, 0))


_VALUES: dict[str, Callable[[Interval, Interval], Interval]] = {
    "+": lambda x, y: x + y,
    "*": lambda x, y: x * y,
    "/": lambda x, y: x / y,
    "minimum": lambda x, y: Interval(min(x.low, y.low), min(x.high, y.high)),
    "maximum": lambda x, y: Interval(max(x.low, y.low), max(x.high, y.high)),
}


def _of_two(operation: str, one: _Slopes, two: _Slopes) -> _Slopes:
    (x, x_0, dx), (y, y_0, dy) = one, two
    here = _VALUES[operation](x, y)
    there = here if x is x_0 and y is y_0 else _VALUES[operation](x_0, y_0)
    both = list(zip(dx, dy, strict=True))
    if operation == "+":
        return here, there, [a + b for a, b in both]
    if operation == "*":
        slopes_of_product = [a * y_0 + x * b for a, b in both]
        if len(both) == 1:  # of one coordinate the slope is unique, and both ways enclose it
            slopes_of_product = [
                m.meet(a * y + x_0 * b) for m, (a, b) in zip(slopes_of_product, both, strict=True)
            ]
        return here, there, slopes_of_product
    if operation == "/":
        return here, there, [(a - there * b) / y for a, b in both]
    for (p, p_0, slopes), (q, q_0, _) in ((one, two), (two, one)):
        lower = max(p.high, p_0.high) < min(q.low, q_0.low)
        higher = min(p.low, p_0.low) > max(q.high, q_0.high)
        if lower if operation == "minimum" else higher:
            return here, there, slopes
    return here, there, [a.hull(b) for a, b in both]  # between them, whichever is taken


def stays(
    enclosed: Callable[[_Box], Interval], box: _Box, low: Fraction, high: Fraction, line: str
) -> None:
    """Prove low <= f <= high on a box, by halving it across the side that matters most."""
    waiting, cells = [box], 0
    while waiting:
        cell, cells = waiting.pop(), cells + 1
        need(cells <= _CELLS, f"{line}: not decided on {_CELLS} boxes")
        value = enclosed(cell)
        if not (low <= value.bottom and value.top <= high):
            for part in (value, enclosed(_middle(cell))):
                need(part.top >= low and part.bottom <= high, line)
            waiting += _halves(enclosed, cell, line)


def _middle(cell: _Box) -> dict[str, Interval]:
    """Return the centre of a cell, with all of the sides that have no end."""

    def centre(x: Interval) -> Interval:
        m = (x.low + x.high) // 2
        return Interval(m, m)

    return {n: centre(x) if 0 < x.high - x.low < _INF else x for n, x in cell.items()}


def _halves(enclosed: Callable[[_Box], Interval], cell: _Box, line: str) -> list[_Box]:
    """Halve a cell across the side by which the range becomes the shortest."""
    choices: list[tuple[Any, int, list[_Box]]] = []
    for name, x in cell.items():
        if 1 < x.high - x.low < _INF:
            m = (x.low + x.high) // 2
            halves: list[_Box] = [
                {**cell, name: Interval(x.low, m)},
                {**cell, name: Interval(m, x.high)},
            ]
            one, other = map(enclosed, halves)
            length = max(one.high, other.high) - min(one.low, other.low)
            choices.append((length, len(choices), halves))
    need(bool(choices), f"{line}: not decided")
    return min(choices)[2]
