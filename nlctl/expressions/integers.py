"""Integers that depend on the state: between which bounds they lie."""

from __future__ import annotations

import math

from .graph import Expr

_Range = tuple[float, float]
_EVERYTHING = (-math.inf, math.inf)


def integer_range(expr: Expr) -> _Range:
    """Return bounds of a number, infinite where none is known."""
    ranges: dict[Expr, _Range] = {}
    waiting = [expr]
    while waiting:
        node = waiting[-1]
        missing = [arg for arg in node.args if arg not in ranges and node.kind != "b"]
        if missing:
            waiting += missing
        else:
            ranges[node] = (0.0, 1.0) if node.kind == "b" else _of_node(node, ranges)
            waiting.pop()
    return ranges[expr]


def _of_node(node: Expr, ranges: dict[Expr, _Range]) -> _Range:
    if node.op == "const":
        return float(node.data), float(node.data)
    if node.value is not None:
        return float(node.value), float(node.value)
    parts = [ranges[arg] for arg in node.args]
    if node.op == "select":
        return min(parts[1][0], parts[2][0]), max(parts[1][1], parts[2][1])
    if node.op == "remainder" and parts[1][0] == parts[1][1] > 0:
        return 0.0, parts[1][0] - (1.0 if node.kind == "i" else 0.0)
    return _RULES[node.op](*parts) if node.op in _RULES else _EVERYTHING


def _product(a: _Range, b: _Range) -> _Range:
    ends = [0.0 if 0.0 in (x, y) else x * y for x in a for y in b]
    return min(ends), max(ends)


def _magnitude(a: _Range) -> _Range:
    inside = 0.0 if a[0] <= 0.0 <= a[1] else min(abs(a[0]), abs(a[1]))
    return inside, max(abs(a[0]), abs(a[1]))


_RULES = {
    **dict.fromkeys(("sign", "sin", "cos", "tanh", "erf"), lambda _: (-1.0, 1.0)),
    "arctan": lambda _: (-math.pi / 2, math.pi / 2),
    "arctan2": lambda _, __: (-math.pi, math.pi),
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": lambda a, b: (a[0] - b[1], a[1] - b[0]),
    "neg": lambda a: (-a[1], -a[0]),
    "mul": _product,
    "minimum": lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    "maximum": lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    "absolute": _magnitude,
    **{name: lambda a: (math.floor(a[0]), math.ceil(a[1])) if math.isfinite(a[0] + a[1])
       else _EVERYTHING for name in ("trunc", "floor", "ceil", "rint")},
}  # fmt: skip
