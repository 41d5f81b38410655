"""When each expression of a function is computed: numbers, loops, and what lies in memory.

The generator of machine code and the interpreter both walk a plan; neither decides anything else.
A function is a sequence of levels.  In each, numbers come first, then one loop for every length of
vectors; the sums of a loop are numbers of the next level.  A vector is computed where it is used,
in one loop; one that is used in several, or element by element, lies in memory.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from ...expressions.graph import LINEAR, OF_FACTORS, Expr, needed

_Loop = tuple[int, int]  # level and length
CALLS = ("call", "solve", *LINEAR)  # their arguments lie in memory, in front of their results
STORED = ("concat", *CALLS)  # vectors that are made in memory
ITEMS = ("item", *OF_FACTORS)  # numbers that are read from a vector
READ = (*STORED, "leaf", "table", *ITEMS, "slice")  # what a loop reads and does not compute


@dataclass(frozen=True, kw_only=True)
class Store:
    """Something to be written: `size` consecutive rows of an array, from `row` on."""

    array: str
    row: int
    expr: Expr
    size: int


@dataclass(frozen=True, kw_only=True)
class FunctionPlan:
    """What is computed when."""

    # expressions that lie in memory when the function begins, and where: (array, row)
    known: Mapping[Expr, tuple[str, int]]
    nodes: tuple[Expr, ...]  # everything that is needed, in an order in which it can be computed
    level: dict[Expr, int]  # when each is known
    stored: dict[Expr, tuple[str, int]]  # vectors that lie in memory, and where: (array, row)
    loops: dict[_Loop, list[Expr]]  # for every loop its vectors and sums, in order
    stores: tuple[Store, ...]  # everything to be written, the vectors in memory included
    rows: int  # rows of memory that are taken, those before included

    @cached_property
    def levels(self) -> "tuple[Level, ...]":
        """The levels, in order."""
        inner: dict[_Loop, list[Store]] = {}
        for store in self.stores:
            if store.size > 1:
                inner.setdefault((self.level[store.expr], store.size), []).append(store)
        numbers: dict[int, list[Expr]] = {}
        for node in self.nodes:
            called = node.op in CALLS and node not in self.known
            if (node.size is None and not self.summed(node)) or called:
                numbers.setdefault(self.level[node], []).append(node)
        loops: dict[int, list[LoopOfLevel]] = {}
        for loop, nodes in sorted(self.loops.items(), key=lambda item: item[0]):
            part = LoopOfLevel(size=loop[1], nodes=tuple(nodes), stores=tuple(inner.get(loop, ())))
            loops.setdefault(loop[0], []).append(part)
        count = max(self.level.values(), default=-1) + 1
        return tuple(
            Level(numbers=tuple(numbers.get(i, ())), loops=tuple(loops.get(i, ())))
            for i in range(count)
        )

    @cached_property
    def places(self) -> dict[Expr, list[tuple[str, int]]]:
        """Where each number is to be written: (array, row)."""
        places: dict[Expr, list[tuple[str, int]]] = {}
        for store in self.stores:
            if store.size == 1:
                places.setdefault(store.expr, []).append((store.array, store.row))
        return places

    def summed(self, node: Expr) -> bool:
        """Whether a number comes out of a loop of this function."""
        return node.op == "sum" and node not in self.known

    def place(self, node: Expr) -> tuple[str, int] | None:
        """Return where a number is read from memory, None if it is computed."""
        if node in self.known:
            return self.known[node]
        if node.op == "leaf":
            return node.data[0], node.data[1]
        if node.op in ITEMS:
            array, row, _ = self.elements(node.args[0])
            return array, row + node.data
        return None

    def elements(self, vector: Expr) -> tuple[str, int, int]:
        """Return where the elements of a vector in memory are: array, first row, distance."""
        if vector in self.stored:
            array, row = self.stored[vector]
            called = vector.op in CALLS and vector not in self.known
            return array, row + (sum(vector.data[1]) if called else 0), 1
        if vector.op == "slice":
            array, row, step = self.elements(vector.args[0])
            return array, row + step * vector.data[0], step * vector.data[1]
        return vector.data


@dataclass(frozen=True, kw_only=True)
class LoopOfLevel:
    """A loop: vectors and sums that are computed element by element, and what is written."""

    size: int
    nodes: tuple[Expr, ...]
    stores: tuple[Store, ...]


@dataclass(frozen=True, kw_only=True)
class Level:
    """Numbers (and calls, and searches), then loops, whose sums are numbers afterwards."""

    numbers: tuple[Expr, ...]
    loops: tuple[LoopOfLevel, ...]


@dataclass(frozen=True, kw_only=True)
class Function:
    """One function of a program."""

    arguments: tuple[str, ...]  # the arrays that it reads and writes
    plan: FunctionPlan
    copied: int = 0  # so many rows of the first array are copied to the second before anything else


def split(store: Store, known: Collection[Expr] = ()) -> list[Store]:
    """Divide what is concatenated into its parts, unless it lies in memory already."""
    if store.expr.op != "concat" or store.expr in known:
        return [store]
    parts, row = [], store.row
    for piece, length in zip(store.expr.args, store.expr.data, strict=True):
        parts += split(Store(array=store.array, row=row, expr=piece, size=length), known)
        row += length
    return parts


def plan_function(
    stores: Sequence[Store], known: dict[Expr, tuple[str, int]], rows: int
) -> FunctionPlan:
    """Plan a function."""
    stores = [part for store in stores for part in split(store, known)]
    nodes = needed([s.expr for s in stores], known)
    stored = dict(known)
    places = {s.expr: s.row for s in stores if s.array == "c"}  # it is to lie there anyway
    for node in _in_memory(nodes, known):
        if node in places and node.op not in CALLS:
            stored[node] = ("c", places[node])
        else:
            stored[node], rows = ("c", rows), rows + _rows(node)
    level = _levels(nodes, known)
    written = _written(stores, nodes, stored, known)
    users = _loops(nodes, level, stored, known, written)
    for node, used_in in users.items():
        if len(used_in) > 1 and node not in stored and node.kind != "b":
            stored[node], rows = ("c", rows), rows + (node.size or 1)
    written = _written(stores, nodes, stored, known)  # again: what is in memory is computed once
    users = _loops(nodes, level, stored, known, written)
    loops: dict[_Loop, list[Expr]] = {}
    for node in nodes:
        for loop in users.get(node, ()):
            loops.setdefault(loop, []).append(node)
    for store in written:
        if store.size > 1:
            loops.setdefault((level[store.expr], store.size), [])
    return FunctionPlan(
        known=known,
        nodes=nodes,
        level=level,
        stored=stored,
        loops=loops,
        stores=tuple(written),
        rows=rows,
    )


def _rows(node: Expr) -> int:
    """Rows in memory: a call has its arguments there as well, before its results."""
    # Behind these are whether an opaque function has failed, and with which arguments.
    given = sum(node.data[1]) if node.op in CALLS else 0
    return (node.size or 1) + given + (1 + given if node.op == "call" else 0)


def _in_memory(nodes: Sequence[Expr], known: Collection[Expr]) -> list[Expr]:
    """Return the vectors that must lie in memory."""
    vectors: dict[Expr, None] = {}
    for node in nodes:
        if node in known:
            continue
        if node.op in CALLS:
            vectors[node] = None
        for arg in node.args:
            apart = node.op in (*ITEMS, "slice") or (arg.op in STORED and node.op not in STORED)
            if apart and arg.size and arg not in known:
                vectors[arg] = None
    return list(vectors)


def _levels(nodes: Sequence[Expr], known: Collection[Expr]) -> dict[Expr, int]:
    """Return when each expression is known: after the loops that it needs."""
    level: dict[Expr, int] = {}
    for node in nodes:
        level[node] = 0
        for arg in node.args if node not in known else ():
            ready = arg in known or arg.op in CALLS or arg.size is None
            copied = node.op in CALLS and arg.size is not None
            waits = copied or (node.op in (*ITEMS, "slice") and not ready)
            joined = arg.op == "concat" and node.op not in STORED and not waits
            later = (node.op == "sum") + waits + joined
            level[node] = max(level[node], level[arg] + later)
    return level


def _written(
    stores: Sequence[Store],
    nodes: Sequence[Expr],
    stored: dict[Expr, tuple[str, int]],
    known: Collection[Expr],
) -> list[Store]:
    """Return all stores: what lies in memory must get there."""
    inner = []
    for node, (array, row) in stored.items():
        if node not in known and node.op not in CALLS:
            inner += split(Store(array=array, row=row, expr=node, size=node.size or 1), known)
    for node in nodes:
        if node.op in CALLS and node in stored and node not in known:
            row = stored[node][1]
            for arg, size in zip(node.args, node.data[1], strict=True):
                inner += split(Store(array="c", row=row, expr=arg, size=size), known)
                row += size
    return list(dict.fromkeys([*inner, *stores]))


def _loops(
    nodes: Sequence[Expr],
    level: dict[Expr, int],
    stored: dict[Expr, tuple[str, int]],
    known: Collection[Expr],
    written: Sequence[Store],
) -> dict[Expr, set[_Loop]]:
    """Return in which loops each vector and sum is computed."""
    users: dict[Expr, set[_Loop]] = {}
    for store in written:
        if store.expr.size:
            users.setdefault(store.expr, set()).add((level[store.expr], store.size))
    for node in reversed(nodes):
        if node.op == "sum" and node not in known:
            users[node] = {(level[node] - 1, node.args[0].size or 1)}
        if node in known or node.op in READ or node not in users:
            users.pop(node, None)
            continue
        if node in stored:
            users[node] = {min(users[node])}  # elsewhere it is read
        for arg in node.args:
            if arg.size:
                users.setdefault(arg, set()).update(users[node])
    return {node: loops for node, loops in users.items() if node.size or node.op == "sum"}
