"""A plan carried out by NumPy: the twin of its machine code, in plain Python.

It runs where there is no machine code (NUMBA_DISABLE_JIT=1), and it is what machine code is
compared with in tests: the same levels, loops and places in memory, but NumPy's functions, and no
access outside of an array.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...expressions.graph import LINEAR, Expr, numpy_function
from ...expressions.linear_systems import values as of_linear_system
from .plan import CALLS, Function, FunctionPlan, LoopOfLevel

_Opaque = Callable[[np.ndarray, int, int], None]  # of c, a row of it, and the member


def interpreted_function(
    function: Function, lanes: int, calls: Mapping[str, _Opaque]
) -> Callable[..., None]:
    """Return one function of a program."""

    def run(*arrays: np.ndarray) -> None:
        memory = dict(zip(function.arguments, arrays, strict=True))
        if function.copied:
            source, target = arrays[:2]
            target[: function.copied] = source[: function.copied]
        with np.errstate(all="ignore"):
            _Run(function.plan, memory, lanes, calls).run()

    return run


class _Run:
    """One evaluation: `values` are what has been computed so far."""

    def __init__(
        self,
        plan: FunctionPlan,
        memory: dict[str, np.ndarray],
        lanes: int,
        calls: Mapping[str, _Opaque],
    ) -> None:
        self.plan, self.memory, self.lanes, self.calls = plan, memory, lanes, calls
        self.values: dict[Expr, Any] = {}

    def run(self) -> None:
        for level in self.plan.levels:
            for node in level.numbers:
                self._number(node)
            for loop in level.loops:
                self._loop(loop)

    def _number(self, node: Expr) -> None:
        if node.op in CALLS and node not in self.plan.known:
            _, row = self.plan.stored[node]
            if node.op in LINEAR:
                self._linear(node, row)
                return
            for lane in range(self.lanes):
                self.calls[node.data[0]](self.memory["c"], row, lane)
            return
        where = self.plan.place(node)
        self.values[node] = self._operation(node) if where is None else self._row(*where)
        self._store(node)

    def _linear(self, node: Expr, row: int) -> None:
        end = row + sum(node.data[1])
        self._check("c", row, end + (node.size or 1) - 1)
        c = self.memory["c"]
        c[end : end + (node.size or 1)] = of_linear_system(node, c[row:end])

    def _store(self, node: Expr) -> None:
        for array, row in self.plan.places.get(node, ()):
            self._check(array, row, row)
            self.memory[array][row] = self.values[node]

    def _loop(self, loop: LoopOfLevel) -> None:
        outer, self.values = self.values, dict(self.values)
        sums = [node for node in loop.nodes if node.op == "sum"]
        for node in loop.nodes:
            self._reads(node.args)
            if node in sums:
                term = np.broadcast_to(self.values[node.args[0]], (loop.size, self.lanes))
                outer[node] = self.values[node] = term.sum(axis=0)
            else:
                self.values[node] = self._operation(node)
        for store in loop.stores:
            self._reads((store.expr,))
            self._check(store.array, store.row, store.row + store.size - 1)
            rows = slice(store.row, store.row + store.size)
            self.memory[store.array][rows] = self.values[store.expr]
        self.values = outer
        for node in sums:
            self._store(node)

    def _operation(self, node: Expr) -> Any:
        if node.op == "const":
            return np.bool_(node.data) if node.kind == "b" else np.float64(node.data)
        return numpy_function(node.op)(*(self.values[a] for a in node.args))

    def _reads(self, args: tuple[Expr, ...]) -> None:
        for arg in args:
            if arg.size and arg not in self.values:
                self.values[arg] = self._elements(arg)

    def _elements(self, vector: Expr) -> np.ndarray:
        if vector.op == "table" and vector not in self.plan.stored:
            return np.array(vector.data)[:, None]
        array, row, step = self.plan.elements(vector)
        last = row + step * ((vector.size or 1) - 1)
        self._check(array, row, last)
        return self.memory[array][row + step * np.arange(vector.size or 1)]

    def _row(self, array: str, row: int) -> np.ndarray:
        self._check(array, row, row)
        return self.memory[array] if array == "t" else self.memory[array][row]

    def _check(self, array: str, first: int, last: int) -> None:
        rows = 1 if array == "t" else len(self.memory[array])
        if not (0 <= first < rows and 0 <= last < rows):
            raise IndexError(f"rows {first} to {last} of '{array}', which has {rows}")
