"""Which of Python's and NumPy's types a number has, and what NumPy makes of several."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from .arrays import Tracer
from .graph import Expr, Graph

_WIDE = (np.dtype(float), np.dtype(int), np.dtype(bool))


def widened(graph: Graph, operands: Sequence[object]) -> Sequence[object]:
    """Return operands with doubles for single precision and short integers next to doubles."""
    narrow = [v for v in operands if isinstance(v, np.ndarray | np.generic) and v.dtype not in _WIDE
              and v.dtype.kind in "fiu" and v.dtype.itemsize <= 8]  # fmt: skip
    if not narrow:
        return operands
    floats = [v for v in operands if isinstance(v, Tracer) and _is_of_floats(v)]
    if any(v.dtype.kind == "f" for v in narrow):  # next to Python's own numbers it stays single
        floats = [v for v in floats if is_numpys(graph, v)]
    if not floats:
        return operands
    return [np.asarray(v, dtype=float)[()] if any(v is n for n in narrow) else v for v in operands]


def _is_of_floats(array: Tracer) -> bool:
    return all(e.kind == "f" for e in array.values.flat)


def is_numpys(graph: Graph, value: object) -> bool:
    """Whether a number is known to be one of NumPy's: it is made of states or inputs."""
    if not isinstance(value, Tracer) or value.shape:
        return isinstance(value, Tracer | np.ndarray | np.generic)
    return not value.is_pythons and _comes_from_arrays(value.only, graph.of_python)


def _comes_from_arrays(expr: Expr, without: Collection[Expr]) -> bool:
    """Whether an expression depends on states or inputs, other than by some expressions."""
    known: dict[Expr, bool] = dict.fromkeys(without, False)
    waiting = [expr]
    while waiting:
        node = waiting[-1]
        if node in known:
            waiting.pop()
        elif node.op in ("call", "solve", "leaf"):
            known[node] = node.op != "leaf" or node.data[0] in ("x", "u")
        elif missing := [arg for arg in node.args if arg not in known]:
            waiting += missing
        else:
            every = node.op == "select"  # either may be what comes out
            known[node] = (all if every else any)(known[a] for a in node.args[every:])
    return known[expr]
