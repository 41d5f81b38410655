"""The Jacobian of a plain function as another plain function, in NumPy: exact, and readable."""

from __future__ import annotations

import hashlib
import linecache
from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import Any

import numpy as np

from .arrays import leaf_vector
from .bends import replaced_parts
from .derivatives import tangents
from .functions import FUNCTIONS
from .graph import (
    COMPARISONS,
    LINEAR,
    LOGIC,
    NUMPY,
    OF_FACTORS,
    SMALL,
    Expr,
    Graph,
    Untraceable,
    needed,
)
from .trace import trace

_NEXT_TO = 1e-7  # of numbers of size 1: what is right next to them
_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/"}


def jacobian_function(function: Callable, n: int, *others: int) -> Callable:
    """Make the Jacobian of ``function(x, ...)`` by x, of n numbers; others have these sizes."""
    # It takes the same arguments and returns an array of shape (results, n), where numbers that are
    # compared are equal that right next to it. What cannot be read, or has no derivative, is
    # `Untraceable`.
    graph, names = Graph(), "abcdefgh"[: 1 + len(others)]

    def arguments() -> tuple[Any, ...]:
        sizes = zip(names, (n, *others), strict=True)
        return tuple(leaf_vector(graph, name, 0, (size,)) for name, size in sizes)

    if max(n, *others, 0) > SMALL:
        raise Untraceable(f"arguments of more than {SMALL} numbers")
    with np.errstate(all="ignore"):
        results = [e for e, _ in trace(graph, function, arguments).pieces()]
    columns = [tangents(graph, results, _unit(graph, j)) for j in range(n)]
    columns = [_next_to_equals(graph, results, column) for column in columns]
    rows = [[column[i] for column in columns] for i in range(len(results))]
    return _compiled(_source(rows, names))


def _unit(graph: Graph, j: int) -> Callable[[Expr], Expr | None]:
    """Return the derivative of what is read by element j of the first argument."""
    return lambda leaf: graph.const(1.0) if leaf.data[:2] == ("a", j) else None


def _next_to_equals(
    graph: Graph, results: Sequence[Expr], slopes: Sequence[Expr | None]
) -> list[Expr | None]:
    """Return derivatives right next to points that have an expression of their own."""
    # ``v * (1 - abs(v)) if v != 0 else 0.0`` has the slope 1 at v = 0, and the second way has 0.
    x = [e for e in needed(results) if e.op == "leaf" and e.data[0] == "a"]
    asked = [
        e for e in needed(results) if e.op in ("eq", "ne") and not set(x).isdisjoint(needed([e]))
    ]
    met = [e if e.op == "eq" else graph.op("not", e) for e in asked]
    if not met:
        return list(slopes)
    equal, little = reduce(partial(graph.op, "or"), met), graph.const(_NEXT_TO)
    moved = {}
    for k, leaf in enumerate(x):  # in a direction of no zero and no two equal numbers
        size = graph.op("add", graph.op("absolute", leaf), graph.const(1.0 + 0.1 * k))
        beside = graph.op("add", leaf, graph.op("mul", little, size))
        moved[leaf] = graph.op("select", equal, beside, leaf)
    given = [e for e in slopes if e is not None]
    changed = iter(replaced_parts(graph, given, moved))
    return [None if e is None else next(changed) for e in slopes]


def _source(rows: list[list[Expr | None]], names: str) -> str:
    """Return the code of a function of these arguments that returns the expressions."""
    nodes = needed([e for row in rows for e in row if e is not None])
    texts: dict[Expr, str] = {}
    lines = [f"def jacobian({', '.join(names)}):"]
    for node in nodes:
        texts[node] = _written(node, [texts[arg] for arg in node.args])
        if node.op not in ("const", "leaf"):
            lines.append(f"    e{node.index} = {texts[node]}")
            texts[node] = f"e{node.index}"
    body = ", ".join(
        "[" + ", ".join("0.0" if e is None else texts[e] for e in row) + "]" for row in rows
    )
    return "\n".join([*lines, f"    return np.array([{body}])", ""])


def _written(node: Expr, parts: list[str]) -> str:
    """Return one expression in NumPy's words."""
    if node.op in LINEAR:
        return _of_linear_system(node, parts)
    if node.size is not None and node.op != "table":
        raise Untraceable("it computes with vectors of more than eight numbers")
    if node.op == "const":
        return {"nan": "np.nan", "inf": "np.inf", "-inf": "(-np.inf)"}.get(
            text := repr(node.data), f"({text})"
        )
    if node.op == "table":
        return f"({', '.join(map(repr, node.data))},)"
    if node.op == "item":
        return f"{parts[0]}[{node.data}]"
    if node.op in OF_FACTORS:
        return f"np.linalg.det({parts[0]})" if node.op == "lu_det" else "1.0"
    if node.op == "leaf":
        return f"{node.data[0]}[{node.data[1]}]"
    if node.op in _SIGNS and "b" not in [arg.kind for arg in node.args]:
        return f" {_SIGNS[node.op]} ".join(parts)
    name = NUMPY.get(node.op, node.op)
    if node.op not in {**FUNCTIONS, **COMPARISONS, **LOGIC} and name not in ("negative", "where"):
        raise Untraceable(f"it computes {node.op}")
    if not hasattr(np, name):
        raise Untraceable(f"NumPy has no {name}")
    return f"np.{name}({', '.join(parts)})"


def _of_linear_system(node: Expr, parts: list[str]) -> str:
    """Return a matrix, or what solves linear equations with it, row by row."""
    before = node.op == "lu_solve"
    pairs = zip(node.args[before:], parts[before:], strict=True)
    entries = ", ".join(f"*{text}" if arg.size else text for arg, text in pairs)
    if node.op == "lu":
        return f"np.array([{entries}]).reshape({node.data[0]}, {node.data[0]})"
    rows, columns = node.data[0]
    right = f"np.array([{entries}]).reshape({rows}, {columns})"
    return f"np.linalg.solve({parts[0]}, {right}).reshape({rows * columns})"


def _compiled(source: str) -> Callable:
    """Return the function of a source text, which stays readable for who asks for its source."""
    file = f"<nlctl jacobian {hashlib.sha256(source.encode()).hexdigest()[:16]}>"
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    names: dict[str, Any] = {"np": np, "__name__": __name__}
    exec(compile(source, file, "exec"), names)  # of this module's own making
    return names["jacobian"]
