"""Expressions: what a diagram computes, each once.

An expression is a number, or a vector of more than `small` numbers that is computed in a loop.
A graph keeps one copy of each, so that sin(x1) of one block is that of another, and evaluates
constants.  It never changes the order of a sum.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from .limits import within_limits
from .signs import sign_of

SMALL = 8
BUDGET = 3000  # expressions of one function, beyond which it is better called than written out
UNLIMITED = 10**9
COMPARISONS = {"lt": "less", "le": "less_equal", "gt": "greater", "ge": "greater_equal",
               "eq": "equal", "ne": "not_equal"}  # fmt: skip
LOGIC = {"and": "logical_and", "or": "logical_or", "xor": "logical_xor", "not": "logical_not"}
_ARITHMETIC = {"add": "add", "sub": "subtract", "mul": "multiply", "div": "true_divide",
               "neg": "negative", "select": "where"}  # fmt: skip
NUMPY = COMPARISONS | LOGIC | _ARITHMETIC
BOOLEAN = {"mul": "and", "maximum": "or", "minimum": "and", "absolute": "",
           "add": None, "sub": None, "neg": None}  # fmt: skip  # of truth values alone
# operations that make integers of integers
INTEGER = ("add", "sub", "mul", "neg", "minimum", "maximum", "absolute", "remainder")
_NEUTRAL = {"mul": 1.0, "div": 1.0, "add": 0.0, "sub": 0.0}

ORDERS = ("lt", "le", "gt", "ge")
LINEAR = ("lu", "lu_solve")  # of whole matrices, see `linear_systems`
OF_FACTORS = ("lu_det", "lu_regular")  # numbers that are read from factors
SPECIAL = ("erf", "erfc")  # functions of `scipy.special` that are in the table of functions

_T = TypeVar("_T")


class Untraceable(Exception):  # noqa: N818 (it ends a trace; nobody else sees it)
    """A function does what expressions cannot say: it is called unchanged instead."""


class Ambiguous(Exception):  # noqa: N818 (it ends a trace: the block is refused)
    """A function does what means one thing in Python and another in machine code."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Expr:
    """One expression."""

    # ``"const"``, ``"table"`` (a vector of constants), ``"leaf"`` (read from an array),
    # ``"item"``, ``"slice"``, ``"concat"``, ``"sum"``, ``"call"`` (of an opaque function),
    # ``"solve"`` (signals that depend on each other), one of `LINEAR` and `OF_FACTORS`, an
    # operation of `NUMPY`, or NumPy's name of a function
    op: str
    args: tuple[Expr, ...]
    # what else it needs: a constant, (array, start, step) of a leaf, index or (start, step)
    # of a part, lengths of what is concatenated, (function, lengths) of a call or a solution
    data: Any
    size: int | None  # number of elements of a vector, None for a number
    kind: str  # ``"f"`` float, ``"i"`` integer, ``"b"`` truth value
    index: int  # its place in the graph, after all that it is made of
    varies: bool  # whether it depends on more than parameters
    sign: int  # what is seen of it, see `signs`
    # of an integer: what it is for the parameter values of the trace; None if it depends on
    # more than parameters
    value: int | None

    def __repr__(self) -> str:  # parts by their places: most are parts of many
        inside = [
            *(f"e{arg.index}" for arg in self.args),
            *([] if self.data is None else [self.data]),
        ]
        return f"e{self.index} = {self.op}({', '.join(map(str, inside))})"


def numpy_function(op: str) -> Any:
    """Return NumPy's function of an operation, SciPy's of what NumPy lacks."""
    if op in SPECIAL:
        from scipy import special

        return getattr(special, op)
    return getattr(np, NUMPY.get(op, op))


def needed(exprs: Iterable[Expr], known: Collection[Expr] = ()) -> tuple[Expr, ...]:
    """Return all that expressions are made of, parts first; nothing behind what is known."""
    parts = (lambda expr: () if expr in known else expr.args) if known else attrgetter("args")
    return parts_first(exprs, parts)


def parts_first(exprs: Iterable[Expr], parts: Callable[[Expr], Iterable[Expr]]) -> tuple[Expr, ...]:
    """Return expressions, their `parts`, the parts of these and so on, parts first."""
    nodes: dict[Expr, None] = {}
    waiting = list(exprs)
    while waiting:
        expr = waiting.pop()
        if expr not in nodes:
            nodes[expr] = None
            waiting.extend(parts(expr))
    return tuple(sorted(nodes, key=attrgetter("index")))


def deduce(
    known: dict[Expr, _T], node: Expr, parts: Callable[[Expr], Iterable[Expr]],
    make: Callable[[Expr], _T],
) -> _T:  # fmt: skip
    """Return what is made of an expression, after what is made of its parts, however deep."""
    waiting = [node]
    while waiting:
        last = waiting[-1]
        before = None if last in known else next((p for p in parts(last) if p not in known), None)
        if before is not None:
            waiting.append(before)
            continue
        waiting.pop()
        if last not in known:
            known[last] = make(last)
    return known[node]


CATCHABLE = "is catchable"  # attribute of an error that a traced function may catch


def catchable(error: type[Exception]) -> Exception:
    """Return an error that Python raises where a traced function is."""
    raised = error("as Python does")
    vars(raised)[CATCHABLE] = True
    return raised


class Namespace(dict[str, Any]):
    """Builtins of the copies of functions that are traced, known by it from other code."""


class MessageWritten(Untraceable):
    """A way through a function writes a message."""


class Graph:
    """All expressions of a diagram."""

    nothing_fails = True  # whether a way that returns nothing is one that raises an error

    def __init__(self, lengths: Mapping[str, int] | None = None, small: int = SMALL) -> None:
        self.nodes: list[Expr] = []
        self.small = small  # arrays up to this size are numbers of their own, longer ones are loops
        self.settles = False  # whether conditions of parameters that are integers are decided
        self.merges = False  # whether choices of numbers are followed at once, not way by way
        self.limit = UNLIMITED  # largest number of expressions for now
        # sizes of the arrays that are read, as far as known: nothing is read beyond
        self.lengths = dict(lengths or {})
        # conditions without which Python would have raised an error on this path
        self.guards: list[Expr] = []
        self.branches = 0  # how many branches are around that may not be taken
        self.attempts = 0  # how many ``try`` are around: an error in these is a way of its own
        # expressions that are numbers of Python's own somewhere, which raise errors where NumPy's
        # are infinite
        self.of_python: set[Expr] = set()
        # choices between one of Python's integers and a float, where no path knows which
        self.mixed: set[Expr] = set()
        # what is taken to hold on the path through a function that is being traced
        self.decisions: dict[Expr, bool] = {}
        self.answers: Callable[[Expr], bool] | None = None  # what decides of the rest
        self.implied: dict[Expr, bool] = {}  # what follows from that
        # integer parameters that steer what is computed: place in `p`, and value
        self.assumptions: dict[int, int] = {}
        self.nominal: dict[int, float] = {}  # values of other parameters now, by place in `p`
        # what is computed in passes of loops that may have ended, a set for each such loop
        self.passing: list[set[Expr]] = []
        self.of_passes: set[Expr] = set()  # what only later passes of such loops compute
        self.is_cut = False  # whether Python may do more than is written out, and there is NaN
        self._known: dict[Any, Expr] = {}
        self._results: dict[tuple[Any, ...], Expr] = {}

    def decided(self, condition: Expr) -> bool:
        """Return whether a condition holds on this path; ask the tracer if that is open."""
        if condition.op == "const":
            return bool(condition.data)
        if condition in self.implied:
            return self.implied[condition]
        if condition not in self.decisions:
            values = [a.data if a.op == "const" else a.value for a in condition.args]
            if self.settles and values and None not in values:
                for integer in condition.args:
                    self.assumed(integer)
                return bool(numpy_function(condition.op)(*values))
            if self.answers is None:
                raise Untraceable("a condition that is only known when it runs")
            self.decisions[condition] = self.answers(condition)
        return self.decisions[condition]

    def guard(self, condition: Expr, error: type[Exception]) -> None:
        """Note what holds unless Python raises an error; within ``try`` ask, and raise it."""
        if not self.attempts:
            self.guards.append(condition)
        elif not self.decided(condition):
            raise catchable(error)

    def limited(self, condition: Expr) -> None:
        """Note where what is written out suffices: elsewhere the function is to be called."""
        if condition.op != "const" or not condition.data:
            self.is_cut = True
            self.guards.append(condition)  # no error, which somebody might catch

    def assumed(self, integer: Expr) -> int:
        """Return the value of an integer; from now on the parameters behind it are fixed."""
        parts = [integer]
        while parts:
            part = parts.pop()
            parts.extend(part.args)
            if part.op == "leaf" and part.value is not None:
                self.assumptions[part.data[1]] = part.value
        return integer.value or 0

    def node(
        self,
        op: str,
        *args: Expr,
        data: object = None,
        size: int | None = None,
        kind: str = "f",
        varies: bool = False,
        value: int | None = None,
    ) -> Expr:
        """Return the one expression that is made of these parts."""
        key = (op, args, None if data is None else repr(data), size, kind)
        known = self._known.get(key)
        if known is None:
            if len(self.nodes) >= self.limit:
                raise Untraceable("too long to be written out")
            self._check_lengths(op, args, data, size)
            varies = varies or any(a.varies for a in args)
            known = self._known[key] = Expr(
                op=op, args=args, data=data, size=size, kind=kind,
                index=len(self.nodes), varies=varies, sign=sign_of(op, args, data), value=value,
            )  # fmt: skip
            self.nodes.append(known)
        return known

    def like(self, node: Expr, *args: Expr) -> Expr:
        """Return the operation of an expression, of other arguments."""
        return self.node(
            node.op, *args, data=node.data, size=node.size, kind=node.kind,
            varies=node.varies, value=node.value,
        )  # fmt: skip

    def _check_lengths(self, op: str, args: tuple[Expr, ...], data: Any, size: int | None) -> None:
        """Check that nothing is read beyond the end of what it is read from."""
        if op == "concat":
            fits = sum(data) == size and all(
                a.size in (None, n) for a, n in zip(args, data, strict=True)
            )
        elif op in ("item", "slice"):
            start, step = (data, 0) if op == "item" else data
            ends = (start, start + step * ((size or 1) - 1))
            fits = all(0 <= i < (args[0].size or 0) for i in ends)
        elif op == "leaf" and data[0] in self.lengths:
            array, start, step = data
            ends = (start, start + step * ((size or 1) - 1))
            fits = all(0 <= i < self.lengths[array] for i in ends)
        elif op in ("const", "table", "leaf", "call", "solve", "sum", *LINEAR, *OF_FACTORS):
            return
        else:
            fits = all(a.size in (None, size) for a in args)
        if not fits:
            raise Untraceable(f"{op} of {data} does not fit into its array")

    def const(self, value: Any) -> Expr:
        """Return a constant number; a bool and an int keep their kind."""
        kind = "b" if isinstance(value, bool | np.bool_) else "f"
        if kind == "f" and isinstance(value, int | np.integer):
            kind = "i"
        number = bool(value) if kind == "b" else float(value)
        whole = int(value) if kind == "i" else None
        return self.node("const", data=number, kind=kind, value=whole)

    def leaf(self, array: str, start: int, size: int | None, kind: str = "f", value: Any = None):
        """Return an entry of an argument of the program, or consecutive ones."""
        where = (array, start, 1 if size else 0)
        return self.node("leaf", data=where, size=size, kind=kind, varies=array != "p", value=value)

    def op(self, name: str, *args: Expr) -> Expr:
        """Return an operation on numbers, or on the elements of vectors."""
        key = (name, *args)  # every way through a function begins as others did
        if key not in self._results:
            self._results[key] = self._operation(name, *args)
        for computed in self.passing:
            computed.add(self._results[key])
        return self._results[key]

    def _operation(self, name: str, *args: Expr) -> Expr:
        kinds = {a.kind for a in args}
        if kinds == {"i", "b"} and name in ("add", "sub", "mul"):  # as in sum([x > 0, y > 0])
            args, kinds = tuple(map(self.integer, args)), {"i"}
        if kinds == {"i"} and name in INTEGER:
            return self._of_integers(name, *args)
        if kinds == {"b"} and name in BOOLEAN:
            return self._of_truth_values(name, *args)
        kind, args = self._kinds(name, args)
        sizes = {a.size for a in args if a.size is not None}
        if len(sizes) > 1:
            raise Untraceable(f"{name} of vectors of sizes {sizes}")
        if all(a.op == "const" for a in args):
            if name == "select":
                return args[1] if args[0].data else args[2]
            with np.errstate(all="ignore"):
                return self.const(numpy_function(name)(*(a.data for a in args))[()])
        simple = self._simplified(name, *args)
        return simple or self.node(name, *args, size=max(sizes, default=None), kind=kind)

    def _kinds(self, name: str, args: tuple[Expr, ...]) -> tuple[str, tuple[Expr, ...]]:
        """Return the kind of a result, and the arguments in the kinds that it takes."""
        if name in LOGIC:
            return "b", tuple(map(self.truth, args))
        if name == "select":
            kinds = {a.kind for a in args[1:]}
            kind = kinds.pop() if len(kinds) == 1 else "f"
            condition = self.truth(args[0])
            rest = args[1:] if kind in "bi" else tuple(self.number(a) for a in args[1:])
            return kind, (condition, *rest)
        return "b" if name in COMPARISONS else "f", tuple(self.number(a) for a in args)

    def _of_integers(self, name: str, *args: Expr) -> Expr:
        """Return an integer that is made of integers."""
        values = [a.value for a in args]
        if name == "remainder" and values[1] in (0, None):
            raise Untraceable("a remainder by 0, or by an integer that depends on the state")
        is_constant = None not in values
        value = int(numpy_function(name)(*values)) if is_constant else None
        if all(a.op == "const" for a in args):
            return self.const(value)
        simple = None if is_constant else self._simplified(name, *args)
        sizes = {a.size for a in args if a.size is not None}
        return simple or self.node(
            name, *args, size=max(sizes, default=None), kind="i", value=value
        )

    def integer(self, a: Expr) -> Expr:
        """Return a number that is whole as an integer, a truth value as 0 or 1."""
        if a.kind == "b":
            return self.op("select", a, self.const(1), self.const(0))
        if a.op == "const":
            return a if a.kind == "i" else self.const(int(a.data))
        return a if a.kind == "i" else self.node(a.op, *a.args, data=a.data, size=a.size, kind="i")

    def may_be_whole(self, a: Expr) -> bool:
        """Whether Python may have an integer here, of which it makes arrays of integers."""
        if a.kind != "f" or a in self.mixed:
            return True
        if not self.mixed or a.op not in (*INTEGER, "select", "concat"):
            return a.op == "const" and bool(self.mixed) and float(a.data).is_integer()
        return all(map(self.may_be_whole, a.args[a.op == "select" :]))

    def _of_truth_values(self, name: str, *args: Expr) -> Expr:
        """Return what NumPy makes of truth values alone."""
        # Of Python's own, such as ``t > 1``, a sum is 2 and not True.
        meaning = BOOLEAN[name]
        if meaning is None:
            raise Ambiguous(
                f"computes with truth values ({NUMPY.get(name, name)}), which means one thing for "
                "Python's and another for NumPy's: write np.where(condition, 1.0, 0.0)"
            )
        return self.op(meaning, *args) if meaning else args[0]

    def number(self, a: Expr) -> Expr:
        """Return an expression as a float."""
        if a.op == "const":
            return a if a.kind == "f" else self.const(float(a.data))
        return self.op("select", a, self.const(1.0), self.const(0.0)) if a.kind == "b" else a

    def truth(self, a: Expr) -> Expr:
        """Return an expression as a truth value."""
        return a if a.kind == "b" else self.op("ne", a, self.const(0.0))

    def _simplified(self, name: str, *args: Expr) -> Expr | None:
        """Return what is the same and simpler; at most the sign of a zero differs."""
        a, b = args[0], args[-1]
        is_const = [x.op == "const" for x in args]
        if name == "select":
            if args[1] is args[2] or (is_const[0] and a.data):
                return args[1]
            if a.size is None and all(arg.op == "concat" for arg in args[1:]):
                return self._choice_of_pieces(*args)
            return args[2] if is_const[0] else self._inner_select(*args)
        for this, other, is_number in ((a, b, is_const[-1]), (b, a, is_const[0])):
            is_reversed = this is b and name in ("div", "sub") and len(args) == 2
            is_neutral = is_number and other.data == _NEUTRAL.get(name)
            if is_neutral and not is_reversed and not (name == "sub" and np.signbit(other.data)):
                return this  # x - (-0.0) is how a zero's sign is asked for
        if name == "copysign" and is_const[-1] and b.data == b.data:
            size = self.op("absolute", a)
            return size if np.copysign(1.0, b.data) > 0.0 else self.op("neg", size)
        if name == "sub" and is_const[0] and a.data == 0.0:
            return self.op("neg", b)
        inner = a.args[0] if name == "neg" and a.op == "neg" else None
        return within_limits(self, name, a, b) if name in ("eq", "ne") else inner

    def _choice_of_pieces(self, condition: Expr, a: Expr, b: Expr) -> Expr | None:
        """Choose piece by piece: what is the same on both ways depends on no condition."""
        if a.data != b.data:
            return None
        pairs = zip(a.args, b.args, a.data, strict=True)
        return self.joined([(self.op("select", condition, x, y), n) for x, y, n in pairs])

    def _inner_select(self, condition: Expr, a: Expr, b: Expr) -> Expr | None:
        """Choose between two operations that differ in one argument by choosing that."""
        if a.op != b.op or a.data is not None or a.op in ("const", "sum", "concat"):
            return None
        places = [i for i, (x, y) in enumerate(zip(a.args, b.args, strict=True)) if x is not y]
        if len(places) != 1:
            return None
        (i,) = places
        chosen = self.op("select", condition, a.args[i], b.args[i])
        return self.op(a.op, *a.args[:i], chosen, *a.args[i + 1 :])

    def power(self, base: Expr, exponent: int) -> Expr:
        """Return an integer power as products."""
        if exponent < 0:
            return self.op("div", self.const(1.0), self.power(base, -exponent))
        if exponent == 0:
            return self.const(1.0)
        half = self.power(base, exponent // 2)
        square = self.op("mul", half, half)
        return self.op("mul", square, base) if exponent % 2 else square

    def item(self, vector: Expr, k: int) -> Expr:
        """Return element k of a vector; a number stands for a vector of equal elements."""
        if vector.size is None:
            return vector
        if vector.kind == "b":
            return self.op("ne", self.item(self.number(vector), k), self.const(0.0))
        if vector.op == "leaf":
            array, start, step = vector.data
            return self.leaf(array, start + k * step, None, vector.kind)
        if vector.op == "table":
            return self.const(vector.data[k])
        if vector.op == "slice":
            return self.item(vector.args[0], vector.data[0] + k * vector.data[1])
        if vector.op == "concat":
            for piece, length in zip(vector.args, vector.data, strict=True):
                if k < length:
                    return self.item(piece, k)
                k -= length
        return self.node("item", vector, data=k, kind=vector.kind)

    def part(self, vector: Expr, start: int, step: int, size: int) -> Expr:
        """Return every step-th element of a vector, `size` of them."""
        if vector.size is None or (start, step, size) == (0, 1, vector.size):
            return vector
        if vector.kind == "b":
            whole = self.part(self.number(vector), start, step, size)
            return self.op("ne", whole, self.const(0.0))
        if vector.op == "leaf":
            array, begin, stride = vector.data
            where = (array, begin + start * stride, stride * step)
            return self.node("leaf", data=where, size=size, kind=vector.kind, varies=vector.varies)
        if vector.op == "table":
            return self.table([vector.data[start + i * step] for i in range(size)])
        if vector.op == "slice":
            begin, stride = vector.data
            return self.part(vector.args[0], begin + start * stride, stride * step, size)
        if vector.op == "concat" and step == 1:
            return self._part_of_joined(vector, start, size)
        return self.node("slice", vector, data=(start, step), size=size, kind=vector.kind)

    def _part_of_joined(self, vector: Expr, start: int, size: int) -> Expr:
        pieces, at = [], 0
        for piece, length in zip(vector.args, vector.data, strict=True):
            begin, end = max(start - at, 0), min(start + size - at, length)
            if end - begin == 1:
                pieces.append((self.item(piece, begin), 1))
            elif begin < end:
                pieces.append((self.part(piece, begin, 1, end - begin), end - begin))
            at += length
        return self.joined(pieces)

    def joined(self, pieces: Sequence[tuple[Expr, int]]) -> Expr:
        """Return vectors and numbers, each with its length, one after the other."""
        if len(pieces) == 1:
            return pieces[0][0]
        args, lengths = zip(*((self.number(e), n) for e, n in pieces), strict=True)
        if all(e.op in ("const", "table") for e in args):
            parts = (np.broadcast_to(e.data, n) for e, n in zip(args, lengths, strict=True))
            return self.table(list(np.concatenate(list(parts))))
        return self.node("concat", *args, data=lengths, size=sum(lengths))

    def table(self, values: Sequence[float]) -> Expr:
        """Return a vector of constants."""
        return self.node("table", data=tuple(map(float, values)), size=len(values))

    def sum(self, vector: Expr, size: int) -> Expr:
        """Return the sum of a vector."""
        if vector.size is None:
            return self.op("mul", self.const(float(size)), vector)
        return self.node("sum", self.number(vector))
