"""Numbers of a function: each expression is one value."""

from collections import Counter
from collections.abc import Callable, Collection
from typing import Any

from ....expressions.graph import COMPARISONS, LINEAR, LOGIC, Expr
from ..plan import CALLS, FunctionPlan
from .functions import CALLED, applied, sin_cos
from .linear_systems import ROUTINES
from .text import Body, Value

_COMPARE = {"lt": "olt", "le": "ole", "gt": "ogt", "ge": "oge", "eq": "oeq", "ne": "une"}
ARITHMETIC = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
_MERGED = 32  # numbers that are written to memory
PACKED = 4  # numbers of one member whose sines, powers, ... are computed together


class Writer:
    """Writes one function; `names` says what each expression is called so far."""

    def __init__(self, b: Body, plan: FunctionPlan, lanes: int, exact: Collection[Expr]) -> None:
        # `lanes` members, and operations that are `exact`: rounded one by one
        self.b, self.plan, self.lanes, self.exact = b, plan, lanes, exact
        self.width = 0 if lanes == 1 else lanes
        self.names: dict[Expr, Value] = {}
        # to merge neighbours takes the compiler a time that grows with the square of their number
        self.alone = sum(s.array == "c" and s.size == 1 for s in plan.stores) > _MERGED
        # sines and cosines of those that have been computed, by the angle's name
        self.pairs: dict[str, dict[str, Value]] = {}
        kinds = Counter(
            a for n in plan.nodes for a in n.args if n.op in ("sin", "cos") and n not in plan.known
        )
        # angles of which sine and cosine are needed
        self.both = {angle for angle, count in kinds.items() if count == 2 and not b.portable}

    def number(self, node: Expr) -> None:
        """Compute or read a number, and write it where it is to lie."""
        if node.op in CALLS and node not in self.plan.known:
            self._call(node)
            return
        if node not in self.names:
            where = self.plan.place(node)
            if where is None:
                self.b.note(one_line(node))
                self.names[node] = self.operation(node)
            else:
                array, row = where
                self.names[node] = self.b.load(self.b.address(array, row * self.lanes), self.width)
        self.stored(node)

    def stored(self, node: Expr) -> None:
        """Write a number where it is to lie."""
        for array, row in self.plan.places.get(node, ()):
            value = self.b.wide(self.names[node], self.width) if self.width else self.names[node]
            alone = array == "c" and self.alone
            self.b.store(value, self.b.address(array, row * self.lanes), alone=alone)

    def _call(self, node: Expr) -> None:
        """Call a function member by member; arguments and results are in memory."""
        if node.op in LINEAR:
            self._linear(node)
            return
        name, _ = node.data
        if node.op == "call":
            self.b.module.declared[f"declare void @{name}(ptr, i64, i64)"] = None
        _, row = self.plan.stored[node]
        for lane in range(self.lanes):
            self.b.write(f"call void @{name}(ptr %c, i64 {row}, i64 {lane})")

    def _linear(self, node: Expr) -> None:
        """Compute factors or a solution in memory, member by member."""
        (_, row), sizes = self.plan.stored[node], node.data[0]
        given = (sizes,) if isinstance(sizes, int) else sizes
        for lane in range(self.lanes):
            where = self.b.address("c", row * self.lanes + lane)
            self.b.routine(node.op, ROUTINES[node.op], where, given, self.lanes)

    def operation(self, node: Expr) -> Value:
        """Return an operation on what has names already."""
        b, args = self.b, [self.names[a] for a in node.args]
        if node.op == "const":
            return b.literal(node.data, self.width, "b" if node.kind == "b" else "f")
        if node.op in ARITHMETIC:
            return b.op(ARITHMETIC[node.op], *args, exact=node in self.exact)
        if node.op in COMPARISONS:
            return b.compare(_COMPARE[node.op], *args)
        if node.op == "not":
            return b.logic("xor", args[0], b.literal(True, args[0].width, "b"))
        if node.op in LOGIC:
            return b.logic(node.op, *args)
        if node.op == "neg":
            return b.neg(args[0])
        if node.op == "select":
            return b.select(*args)
        if node.op in ("sin", "cos"):
            return self.angle(args[0], node.args[0] in self.both, node.op)
        return applied(b, node.op, *args)

    def angle(self, x: Value, both: bool, name: str) -> Value:
        """Return sine or cosine; where both are needed they are computed together."""
        if not both:
            return sin_cos(self.b, x, {name})[name]
        if x.text not in self.pairs:
            self.pairs[x.text] = sin_cos(self.b, x, {"sin", "cos"})
        return self.pairs[x.text][name]

    # -- functions of several numbers together

    def numbers(self, nodes: tuple[Expr, ...]) -> None:
        """Compute the numbers of a level; those of one member four at a time where that pays."""
        if self.lanes > 1 or self.b.portable:
            for node in nodes:
                self.number(node)
            return
        depths = _depths(nodes, self._is_packable)
        for depth in sorted(set(depths.values())):
            here = [node for node in nodes if depths[node] == depth]
            waiting = [node for node in here if self._is_packable(node)]
            for node in here:
                if node not in waiting:
                    self.number(node)
            self._pack(waiting)

    def _is_packable(self, node: Expr) -> bool:
        return node.op in CALLED and node.size is None and node not in self.plan.known

    def _pack(self, nodes: list[Expr]) -> None:
        families: dict[str, list[Expr]] = {}
        for node in nodes:
            families.setdefault("angle" if node.op in ("sin", "cos") else node.op, []).append(node)
        for members in families.values():
            angles = list(dict.fromkeys(node.args[0] for node in members))
            for at in range(0, len(angles), PACKED):
                part = angles[at : at + PACKED]
                mine = [node for node in members if node.args[0] in part]
                if len(part) > 1:
                    self._side_by_side(mine, part)
                for node in mine:
                    self.number(node)

    def _side_by_side(self, nodes: list[Expr], angles: list[Expr]) -> None:
        """Compute functions of up to four numbers as functions of one vector."""
        b = self.b
        for node in nodes:
            b.note(one_line(node))
        x = b.gathered([self.names[a] for a in angles], 2 if len(angles) == 2 else PACKED)
        kinds = {node.op for node in nodes}
        if kinds <= {"sin", "cos"}:
            values = sin_cos(b, x, kinds)
        else:
            values = {kind: applied(b, kind, x) for kind in kinds}
        for node in nodes:
            self.names[node] = b.element(values[node.op], angles.index(node.args[0]))


def _depths(nodes: tuple[Expr, ...], is_packable: Callable[..., Any]) -> dict[Expr, int]:
    """Return how many functions stand one behind the other before each number of a level."""
    depth: dict[Expr, int] = {}
    for node in nodes:
        depth[node] = max((depth[a] + is_packable(a) for a in node.args if a in depth), default=0)
    return depth


def one_line(node: Expr) -> str:
    """Return an expression in a line."""
    if node.op == "const":
        return f"{node.data:g}"
    if node.op == "leaf":
        array, start, step = node.data
        return f"{array}[{start}]" if node.size is None else f"{array}[{start}::{step}]"
    inside = ", ".join(
        one_line(a) if a.op in ("const", "leaf") else f"e{a.index}" for a in node.args
    )
    return f"e{node.index} = {node.op}({inside})"
