"""From a plan to readable source of one function over members side by side.

With several members ("lanes") every number is a vector, one element per member.  With one member
numbers are numbers, and loops take `WIDE` elements at a time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from ..expressions.graph import Expr
from ._lower_blocks import Call
from ._lower_plan import Loop, Plan, Store

WIDE = 8
INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "gt": ">",
         "ge": ">=", "eq": "==", "ne": "!=", "and": "&", "or": "|", "xor": "^"}  # fmt: skip
SHORT = 60  # characters up to which an expression that is used once is written where it is used


def written(
    header: str, plan: Plan, known: dict[Expr, Any], lanes: int, calls: dict[str, Call],
    tables: dict[Expr, str],
) -> list[str]:  # fmt: skip
    """Return the source lines of a function.

    Parameters
    ----------
    header : str
        Its name and arguments.
    plan : Plan
    known : mapping
        Expressions that lie in memory when it begins.
    lanes : int
        Number of members.
    calls : mapping
        Opaque functions by name.
    tables : mapping
        Names of vectors of constants; new ones are added.
    """
    writer = _Writer(plan, known, lanes, calls, tables)
    body = list(writer.lines())
    return [f"def {header}:", *(f"    {line}" for line in body or ["pass"])]


class _Writer:
    """Writes one function; `names` says how each expression is called so far."""

    def __init__(
        self, plan: Plan, known: Any, lanes: int, calls: dict[str, Call], tables: dict[Expr, str]
    ) -> None:
        self.plan, self.known, self.lanes, self.calls = plan, known, lanes, calls
        self.tables = tables
        self.names: dict[Expr, str] = {}
        self.count = 0
        self.uses = Counter(a for n in plan.nodes if n not in known for a in n.args)
        self.uses.update(s.expr for s in plan.stores)
        loops = (n for n in plan.nodes if n not in known and (n.size or n.op == "sum"))
        self.uses.update(a for n in loops for a in n.args if not a.size)  # not once but n times

    def lines(self) -> Iterator[str]:
        """Yield all lines: level by level numbers, then loops."""
        for level in range(max(self.plan.level.values(), default=0) + 1):
            for node in self.plan.nodes:
                if self.plan.level[node] == level and not self._summed(node):
                    yield from self._number(node)
                    yield from self._number_stores(node)
            for loop, nodes in sorted(self.plan.loops.items(), key=lambda item: item[0]):
                if loop[0] == level:
                    yield from self._loop(loop, nodes)
            for node in self.plan.nodes:
                if self._summed(node) and self.plan.level[node] == level + 1:
                    yield from self._number_stores(node)

    def _summed(self, node: Expr) -> bool:
        """Whether a number comes out of a loop of this function."""
        return node.op == "sum" and node not in self.known

    def _number(self, node: Expr) -> Iterator[str]:
        """Give a number its name, and yield the line that computes it."""
        if node.op == "call" and node not in self.known:
            yield f"for lane in range({self.lanes}):"
            yield f"    {node.data[0]}(c, {self.plan.stored[node][1]}, lane)"
        elif node.size is None and node.op == "const":
            self.names[node] = _constant(node.data)
        elif node.size is None:
            place = self._place(node)
            text = place or self._operation(node)
            if self.uses[node] == 1 and len(text) < SHORT and (place or _is_cheap(node)):
                self.names[node] = text
                return
            self.names[node] = self._new_name(node)
            yield f"{self.names[node]} = {_bare(text)}"

    def _new_name(self, node: Expr) -> str:
        if node.op == "leaf" and node not in self.known and node.size is None:
            return f"{node.data[0]}{node.data[1]}"
        if node in self.known and node.size is None:
            return f"c{self.known[node][1]}"
        self.count += 1
        return f"v{self.count}" if node.size is None else f"w{self.count}"

    def _number_stores(self, node: Expr) -> Iterator[str]:
        for store in self.plan.stores:
            if store.expr is node and store.size == 1:
                yield self._store(store)

    def _store(self, store: Store) -> str:
        name = _bare(self.names[store.expr])
        if self.lanes == 1:
            return f"{store.array}[{store.row}, 0] = {name}"
        if store.expr.op == "const":
            name = f"repeated({name}, L)"
        return f"store({store.array}, {store.row} * L, {name})"

    def _place(self, node: Expr) -> str | None:
        """Return how a number is read from memory, None if it is computed."""
        if node in self.known:
            array, row = self.known[node]
        elif node.op == "leaf":
            array, row, _ = node.data
        elif node.op == "item":
            array, row = self._memory(node.args[0])
            row += node.data
        else:
            return None
        if self.lanes == 1:
            return "t[0]" if array == "t" else f"{array}[{row}, 0]"
        return f"load({array}, {row} * L, L)"

    def _memory(self, vector: Expr) -> tuple[str, int]:
        """Return where a vector lies."""
        array, row = self.plan.stored[vector]
        return array, row + (sum(vector.data[1]) if vector.op == "call" else 0)

    def _operation(self, node: Expr) -> str:
        """Return an operation on what has names already."""
        args = [self.names[a] for a in node.args]
        if node.op in INFIX:
            return f"({args[0]} {INFIX[node.op]} {args[1]})"
        if node.op == "neg":
            return f"(-{args[0]})"
        if node.op == "not":
            return f"select({args[0]}, False, True)"
        return f"{node.op}({', '.join(map(_bare, args))})"

    def _loop(self, loop: Loop, nodes: Sequence[Expr]) -> Iterator[str]:
        """Yield one loop, with the sums that begin before and end after it."""
        width, (_, size) = self.lanes if self.lanes > 1 else WIDE, loop
        sums = [node for node in nodes if node.op == "sum"]
        for node in sums:
            self.names[node] = self._new_name(node)
            yield f"{self.names[node]} = repeated(0.0, {width if self.lanes == 1 else 'L'})"
        if self.lanes > 1:
            yield f"for i in range({size}):"
            yield from (f"    {line}" for line in self._body(loop, nodes, width))
            return
        whole = size - size % WIDE
        if whole:
            yield f"for i in range(0, {whole}, {WIDE}):"
            yield from (f"    {line}" for line in self._body(loop, nodes, WIDE))
        if size > whole:
            yield f"i = {whole}"
            yield from self._body(loop, nodes, size - whole)
        for node in sums:
            yield f"{self.names[node]} = total({self.names[node]})"

    def _body(self, loop: Loop, nodes: Sequence[Expr], count: int) -> Iterator[str]:
        """Yield the body of a loop, for `count` elements at a time."""
        outer, self.names = self.names, dict(self.names)
        stores = [s for s in self.plan.stores if (self.plan.level[s.expr], s.size) == loop]
        stores = [s for s in stores if s.size > 1]
        for node in nodes:
            yield from self._reads(node.args, count)
            if node.op == "sum":
                term = self.names[node.args[0]]
                part = (
                    f"first({_bare(term)}, {count})" if self.lanes == 1 and count < WIDE else term
                )
                yield f"{self.names[node]} = {self.names[node]} + {part}"
                continue
            text = self._operation(node)
            if self.uses[node] == 1 and len(text) < SHORT and _is_cheap(node):
                self.names[node] = text
            else:
                self.names[node] = self._new_name(node)
                yield f"{self.names[node]} = {_bare(text)}"
        for store in stores:
            yield from self._reads([store.expr], count)
            yield self._store_in_loop(store, count)
        self.names = outer

    def _store_in_loop(self, store: Store, count: int) -> str:
        name = _bare(self.names[store.expr])
        if store.expr.size is None:
            name = f"repeated({name}, {'L' if self.lanes > 1 else WIDE})"
        if self.lanes > 1:
            return f"store({store.array}, ({store.row} + i) * L, {name})"
        if count < WIDE:
            return f"store_first({store.array}, {store.row} + i, {name}, {count})"
        return f"store({store.array}, {store.row} + i, {name})"

    def _reads(self, args: Sequence[Expr], count: int) -> Iterator[str]:
        """Yield lines that read what is not computed in this loop."""
        for arg in args:
            if arg.size and arg not in self.names:
                self.names[arg] = self._new_name(arg)
                yield f"{self.names[arg]} = {self._element(arg, count)}"

    def _element(self, vector: Expr, count: int) -> str:
        """Return how a vector's elements at i are read."""
        step = 1
        if vector.op == "table" and vector not in self.known:
            array, row = self.tables.setdefault(vector, f"K{len(self.tables)}"), 0
            if self.lanes > 1:
                return f"repeated({array}[i], L)"  # all members have it, also where it is stored
        elif vector in self.plan.stored:
            array, row = self._memory(vector)
        elif vector.op == "slice":
            array, row = self._memory(vector.args[0])
            row, step = row + vector.data[0], vector.data[1]
        else:
            array, row, step = vector.data
        place = f"{row} + i" if step == 1 else f"{row} + {step} * i"
        if self.lanes > 1:
            return f"load({array}, ({place}) * L, L)"
        if step == 1 and count == WIDE:
            return f"load({array}, {place}, {WIDE})"
        return f"gather({array}, {place}, {step}, {WIDE}, {count})"


def _is_cheap(node: Expr) -> bool:
    return node.op in INFIX or node.op in ("neg", "select")


def _constant(value: Any) -> str:
    if isinstance(value, bool):
        return str(value)
    text = repr(float(value)).replace("inf", "np.inf").replace("nan", "np.nan")
    return f"({text})" if text.startswith("-") else text


def _bare(text: str) -> str:
    """Return an expression without parentheses around all of it."""
    if not text.startswith("("):
        return text
    depth = 0
    for i, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if depth == 0:
            return text[1:-1] if i == len(text) - 1 else text
    return text
