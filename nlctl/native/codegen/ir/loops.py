"""Loops over the elements of vectors, and their sums.

For one member a turn takes four elements as one vector; the last elements are taken once more
together with those before them, so that no turn is shorter.  With several members a turn is one
element of each, three to a round.
"""

from ....expressions.graph import Expr
from ..plan import LoopOfLevel
from .numbers import Writer, one_line
from .text import Turns, Value, constant, float_text

_WIDE = 4  # elements of one member together
PER_ROUND = 3  # elements of several members in a round
_STRAIGHT = 16  # turns of one member up to which they are written one after the other


def elements_per_turn(size: int) -> int:
    """Return how many elements of one member a turn of a loop takes."""
    return next(k for k in (_WIDE, 2, 1) if k <= size)


class LoopWriter:
    """Writes one loop with the sums that begin before and end after it."""

    def __init__(self, w: Writer, loop: LoopOfLevel) -> None:
        self.w, self.b, self.loop, self.lanes = w, w.b, loop, w.lanes
        self.step = 1 if self.lanes > 1 else elements_per_turn(loop.size)
        self.chunk = w.width or self.step
        self.sums = [node for node in loop.nodes if node.op == "sum"]

    def write(self) -> None:
        names, size = self.w.names, self.loop.size
        self.b.note(f"{size} elements: {', '.join(map(one_line, self.loop.nodes))}")
        for node in self.sums:
            names[node] = constant(0.0, self.chunk)
        turns = size // self.step
        done = self._rounds(turns) if turns > (_STRAIGHT if self.lanes == 1 else 1) else 0
        for k in range(done, turns):
            self._turn(None, k * self.step)
        if size > turns * self.step:
            self._turn(None, size - self.step, skipped=self.step - size % self.step)
        for node in self.sums:
            if self.lanes == 1:
                names[node] = self.b.halved(names[node], self.b.add)
            self.w.stored(node)

    def _rounds(self, turns: int) -> int:
        """Write as many turns as fit into rounds as a loop; return how many these are."""
        b, names = self.b, self.w.names
        per = PER_ROUND if self.lanes > 1 and turns >= PER_ROUND else 1
        loop = Turns(b, [Value("0", 0, "i"), *[constant(0.0, self.chunk)] * len(self.sums)])
        index, *entries = loop.carried
        names.update(zip(self.sums, entries, strict=True))
        for k in range(per):
            self._turn(index.text, k * self.step)
        following = b.new(f"add i64 {index.text}, {per * self.step}")
        done = turns // per * per
        more = b.new(f"icmp slt i64 {following.text}, {done * self.step}")
        loop.end(more, [following, *(names[node] for node in self.sums)])
        return done

    def _turn(self, index: str | None, at: int, skipped: int = 0) -> None:
        """Write what is computed for the elements from index + at on."""
        # The first `skipped` of them have been added to the sums before.
        w = self.w
        outer, pairs = w.names, w.pairs
        w.names, w.pairs = dict(outer), {}
        for node in self.loop.nodes:
            self._reads(node.args, index, at)
            if node.op == "sum":
                term = self._kept(self.b.wide(w.names[node.args[0]], self.chunk), skipped)
                w.names[node] = outer[node] = self.b.add(w.names[node], term)
            else:
                w.names[node] = w.operation(node)
        for store in self.loop.stores:
            self._reads((store.expr,), index, at)
            array, row, step = store.array, store.row, self.lanes
            where = self.b.address(array, (row + at) * step, index, step)
            self.b.store(self.b.wide(w.names[store.expr], self.chunk), where)
        w.names, w.pairs = outer, pairs

    def _kept(self, term: Value, skipped: int) -> Value:
        """Return a vector with its first elements set to 0."""
        if not skipped:
            return term
        order = [i + (term.width if i < skipped else 0) for i in range(term.width)]
        return self.b.shuffled(term, constant(0.0, term.width), order)

    def _reads(self, args: tuple[Expr, ...], index: str | None, at: int) -> None:
        for arg in args:
            if arg.size and arg not in self.w.names:
                self.w.names[arg] = self._element(arg, index, at)

    def _element(self, vector: Expr, index: str | None, at: int) -> Value:
        """Read the elements of a vector that lie in memory."""
        b = self.b
        if vector.op == "table" and vector not in self.w.plan.stored:
            return self._of_table(vector, index, at)
        array, row, step = self.w.plan.elements(vector)
        if self.lanes > 1:
            first = (row + step * at) * self.lanes
            return b.load(b.address(array, first, index, step * self.lanes), self.chunk)
        if step == 1:
            return b.load(b.address(array, row + at, index), self.chunk)
        parts = [
            b.load(b.address(array, row + step * (at + k), index, step), 0)
            for k in range(self.chunk)
        ]
        return b.gathered(parts, self.chunk)

    def _of_table(self, vector: Expr, index: str | None, at: int) -> Value:
        b = self.b
        if index is None and self.lanes > 1:
            return constant(vector.data[at], self.chunk)
        if index is None:
            parts = vector.data[at : at + self.step]
            return Value(f"<{', '.join(f'double {float_text(v)}' for v in parts)}>", self.chunk)
        moved = b.new(f"add i64 {index}, {at}").text
        where = b.moved(b.module.table(vector.data), moved)
        if self.lanes > 1:
            return b.wide(b.load(where, 0), self.chunk)
        return b.load(where, self.chunk)
