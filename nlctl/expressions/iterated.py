"""Loops whose end depends on what is computed: Newton's method, halving, a tolerance.

Each pass is written out, and what it assigns is chosen: the new value where the loop still runs,
otherwise what there was.  Python ends each such loop; where more passes are needed than are
written out, the result is NaN, and a run that ends there calls the function instead.  Where a pass
ends the values hardly differ, so that what only later passes ask for is not located.
"""

from __future__ import annotations

import ast
import functools
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Sequence, Sized
from typing import Any

import numpy as np

from .arrays import Tracer, scalar
from .graph import Expr, Graph, Untraceable
from .merged import call_instead, chosen, later, truth_test, truth_value
from .operators import elementwise

WRITTEN_PASSES = 64  # that are written out of a loop that ends at a tolerance
_LONG, _FEWEST = 1200, 16  # expressions of its passes after which there is no other, but so many
_ALWAYS_NEW = (ast.Yield, ast.YieldFrom, ast.Await, ast.Try, ast.With, ast.Delete, ast.Global,
               ast.Nonlocal, ast.FunctionDef, ast.ClassDef, ast.Continue, ast.Match)  # fmt: skip
_CHANGING = {"append", "extend", "insert", "pop", "remove", "clear", "sort", "reverse", "update",
             "add", "discard", "fill", "appendleft", "popleft", "setdefault"}  # fmt: skip


class PassWriter(ast.NodeTransformer):
    """Writes passes that may not be taken any more instead of passes."""

    def __init__(self) -> None:
        self.count, self.function = 0, ast.Module([], [])
        self.passing: set[str] = set()  # names that no pass hands to another, or to what follows

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        around, self.function = self.function, node
        self.generic_visit(node)
        self.function = node
        for place, statement in enumerate(node.body):
            rest = node.body[place + 1 :]
            if isinstance(statement, ast.For | ast.While) and _leaves(statement, ast.Return):
                if len(rest) > 1 or not all(isinstance(s, ast.Return | ast.Raise) for s in rest):
                    break
                if not rest and not _is_endless(statement):
                    rest = [ast.Return(call_instead("nothing"))]
                written = self._loop(statement, rest)
                node.body[place:] = written or node.body[place:]
                break
        self.function = around
        return ast.fix_missing_locations(node)

    def visit_While(self, node: ast.While) -> Any:
        self.generic_visit(node)
        return node if _leaves(node, ast.Return) else self._loop(node) or node

    def visit_For(self, node: ast.For) -> Any:
        self.generic_visit(node)
        if _leaves(node, ast.Return):
            return node
        if _leaves(node, ast.Break):
            return self._loop(node) or node
        return self._counted(node)

    def _counted(self, node: ast.For) -> Any:
        """Note the passes of a loop that asks in each: there may be a search by halves in it."""
        if not any(isinstance(part, ast.If | ast.IfExp | ast.Call) for part in ast.walk(node)):
            return node
        self.count += 1
        name = f"passes@{self.count}"
        begin = ast.Assign([ast.Name(name, ast.Store())], call_instead("passes"))
        end = ast.Expr(_method(name, "end"))
        return [_placed(ast.copy_location(s, node), node) for s in (begin, node, end)]

    def _loop(
        self, node: ast.For | ast.While, rest: Sequence[ast.stmt] | None = None
    ) -> list[ast.stmt] | None:
        """Return a loop, and what follows one that returns; None where it stays as it is."""
        self.count += 1
        name = f"loop@{self.count}"
        outside, self.passing = self.passing, _alone(node, self.function)
        written = self._written(name, node, rest)
        self.passing = outside
        return written

    def _written(
        self, name: str, node: ast.For | ast.While, rest: Sequence[ast.stmt] | None
    ) -> list[ast.stmt] | None:
        body = self._passes(name, node.body)
        if body is None or (node.orelse and isinstance(node, ast.While)):
            return None
        call = functools.partial(_method, name)
        if isinstance(node, ast.While):
            goes_on = ast.UnaryOp(ast.Not(), call("goes_on", later(truth_test(node.test))))
            head: list[ast.stmt] = [ast.If(goes_on, [ast.Break()], [])]
            loop: ast.stmt = ast.While(call("next_pass"), self._tried(name, head + body), [])
        else:
            item = f"item@{self.count}"
            taken = ast.Assign([node.target], ast.Name(item, ast.Load()))
            first = self._segment(name, [taken])
            if first is None:
                return None
            over = ast.UnaryOp(ast.Not(), call("next_pass", ast.Constant(False)))
            counted: list[ast.stmt] = [ast.If(over, [ast.Break()], [])]
            target = ast.Name(item, ast.Store())
            items = call("items", node.iter)
            loop = ast.For(target, items, self._tried(name, counted + first + body), [])
        begin = ast.Assign([ast.Name(name, ast.Store())], call_instead("loop"))
        whole: list[ast.stmt] = [begin, loop, ast.Expr(call("end"))]
        if node.orelse:
            fails = isinstance(node.orelse[0], ast.Raise)
            last = [ast.Expr(call("fails"))] if fails else self._segment(name, node.orelse)
            if last is None:
                return None
            whole += last
        if rest is not None:
            ends = rest[0] if rest else None
            other = later(ends.value) if isinstance(ends, ast.Return) and ends.value else None
            whole.append(ast.Return(call("result", other or ast.Constant(None))))
        return [ast.copy_location(_placed(s, node), node) for s in whole]

    def _tried(self, name: str, body: list[ast.stmt]) -> list[ast.stmt]:
        """Return a pass whose errors matter only where it is taken."""
        error = f"error@{self.count}"
        raised = ast.If(_method(name, "raises", ast.Name(error, ast.Load())), [ast.Raise()], [])
        caught = ast.ExceptHandler(ast.Name("Exception", ast.Load()), error, [raised, ast.Break()])
        return [ast.Try(body, [caught], [], [])]

    def _passes(self, name: str, body: Sequence[ast.stmt]) -> list[ast.stmt] | None:
        """Return the statements of one pass, divided where it may end."""
        written: list[ast.stmt] = []
        segment: list[ast.stmt] = []
        for statement in body:
            end = _end(statement)
            if end is None:
                segment.append(statement)
                continue
            test, before, result, after = end
            done = f"end@{self.count}"
            asks: list[ast.stmt] = [ast.Assign([ast.Name(done, ast.Store())], truth_test(test))]
            condition = ast.Name(done, ast.Load())
            parts = [self._segment(name, segment), asks]
            if before:
                parts.append(self._segment(name, [ast.If(condition, before, [])]))
            if result is not None:
                parts.append([ast.Expr(_method(name, "returns", condition, later(result)))])
            stops = ast.If(_method(name, "stops", condition), [ast.Break()], [])
            parts.append([stops])
            for part in parts:
                if part is None:
                    return None
                written += part
            segment = list(after)
        last = self._segment(name, segment)
        return None if last is None else written + last

    def _segment(self, name: str, body: Sequence[ast.stmt]) -> list[ast.stmt] | None:
        """Return statements after which what they assign is chosen; None where more happens."""
        if not body:
            return []
        assigned, written = _assigned(body)
        if assigned is None:
            return None
        assigned = [n for n in assigned if n not in self.passing]
        names = (
            ast.Tuple([ast.Constant(n) for n in part], ast.Load()) for part in (assigned, written)
        )
        begin = ast.Expr(_method(name, "begins", *names))
        if not assigned:
            return [begin, *body, ast.Expr(_method(name, "chosen"))]
        targets = ast.Tuple([ast.Name(n, ast.Store()) for n in assigned], ast.Store())
        return [begin, *body, ast.Assign([targets], _method(name, "chosen"))]


def _placed(statement: ast.stmt, like: ast.stmt) -> ast.stmt:
    for part in ast.walk(statement):
        if "lineno" in part._attributes and not hasattr(part, "lineno"):
            ast.copy_location(part, like)
    return statement


def _method(name: str, method: str, *given: ast.expr) -> ast.Call:
    return ast.Call(ast.Attribute(ast.Name(name, ast.Load()), method, ast.Load()), list(given), [])


def _statements(body: Sequence[ast.stmt], *, loops: bool = False) -> Iterable[ast.stmt]:
    """Yield statements and those in their branches; with `loops` those in loops, too."""
    for statement in body:
        yield statement
        if loops or not isinstance(statement, ast.For | ast.While):
            for field in ("body", "orelse"):
                yield from _statements(getattr(statement, field, None) or (), loops=loops)


def _is_endless(node: ast.For | ast.While) -> bool:
    """Whether a loop is left by its statements alone."""
    return isinstance(node, ast.While) and isinstance(node.test, ast.Constant)


def _leaves(node: ast.For | ast.While, kind: type[ast.stmt]) -> bool:
    """Whether a loop has a ``break`` of its own, or returns from anywhere in it."""
    every = _statements(node.body, loops=kind is ast.Return)
    return any(isinstance(s, kind) for s in every)


def _alone(node: ast.For | ast.While, function: ast.AST) -> set[str]:
    """Return the names that are read in a loop alone: whatever they are when it has ended."""
    loops = (n for n in ast.walk(function) if isinstance(n, ast.For | ast.While) and n is not node)
    if any(part is node for loop in loops for part in ast.walk(loop)):
        return set()  # the next pass of the loop around it reads them
    inside, every = (
        Counter(
            n.id for n in ast.walk(part) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)
        )
        for part in (node, function)
    )
    stored = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    return {name for name in stored if inside[name] == every[name]}


_End = tuple[ast.expr, list[ast.stmt], ast.expr | None, list[ast.stmt]]


def _end(statement: ast.stmt) -> _End | None:
    """Return when a statement ends its loop, what it does before, returns, and does else."""
    always = ast.Constant(True)
    if isinstance(statement, ast.Break):
        return always, [], None, []
    if isinstance(statement, ast.Return):
        return always, [], statement.value or ast.Constant(None), []
    if not isinstance(statement, ast.If):
        return None
    *before, last = statement.body
    if isinstance(last, ast.Break):
        return statement.test, before, None, statement.orelse
    if isinstance(last, ast.Return):
        return statement.test, before, last.value or ast.Constant(None), statement.orelse
    return None


def _assigned(body: Sequence[ast.stmt]) -> tuple[list[str] | None, list[str]]:
    """Return the names that statements assign, and those of arrays that they write into."""
    names: dict[str, None] = {}
    written: dict[str, None] = {}
    inner = (s for s in _statements(body))
    if any(isinstance(s, ast.Return | ast.Break | ast.Raise) for s in inner):
        return None, []
    local = {g.target.id for s in body for n in ast.walk(s) for g in getattr(n, "generators", ())
             if isinstance(g.target, ast.Name)}  # fmt: skip
    for part in (n for s in body for n in ast.walk(s)):
        if isinstance(part, _ALWAYS_NEW):
            return None, []
        method = part.func if isinstance(part, ast.Call) else None
        if isinstance(method, ast.Attribute) and method.attr in _CHANGING:
            return None, []
        if isinstance(part, ast.Attribute) and isinstance(part.ctx, ast.Store):
            return None, []
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store) and part.id not in local:
            names[part.id] = None
        target = part.target if isinstance(part, ast.AugAssign) else part
        while isinstance(target, ast.Subscript) and isinstance(part, ast.AugAssign | ast.Subscript):
            target = target.value
        is_stored = isinstance(part, ast.AugAssign) or (
            isinstance(part, ast.Subscript) and isinstance(part.ctx, ast.Store)
        )
        if is_stored and not isinstance(target, ast.Name):
            return None, []
        if is_stored and isinstance(target, ast.Name):
            written[target.id] = None
    return list(names), list(written)


# -- what runs instead -----------------------------------------------------------------------------


_MISSING = object()
NOT_RETURNED = object()  # what a function returns that ends without saying so


class Loop:
    """A loop that is written out: where it still runs, and what it has changed."""

    def __init__(self, graph: Graph, is_raised: Callable[[BaseException], bool]) -> None:
        self.graph, self.passes, self.is_raised = graph, 0, is_raised
        self.running: Expr = graph.const(True)
        self.results: list[tuple[Expr, Any]] = []
        self.first: set[Expr] = set()
        self.later: set[Expr] = set()
        self.before: dict[str, Any] = {}
        self.copies: dict[str, Any] = {}
        self.others: dict[str, Any] = {}
        self.names: Sequence[str] = ()
        self.guards, self.size, self.is_cut = 0, len(graph.nodes), False
        self.is_short = False  # so few passes that all are written out, however long these are

    def items(self, values: Any) -> Any:
        """Note of how many items the passes are."""
        self.is_short = not isinstance(values, Sized) or len(values) <= WRITTEN_PASSES
        return values

    def next_pass(self, is_endless: bool = True) -> bool:
        """Count passes; there is none after too many of a number that is not known."""
        self.passes += 1
        if self.passes == 1:
            self.graph.passing.append(self.first)
        elif self.passes == 2:
            self.graph.passing[-1] = self.later
        if self.running.op == "const":
            return True
        size = len(self.graph.nodes) - self.size
        is_large = size > _LONG and self.passes > _FEWEST and not self.is_short
        is_long = is_large or (is_endless and self.passes > WRITTEN_PASSES)
        self.is_cut |= is_long
        return not is_long

    def goes_on(self, test: Callable[[], Any]) -> bool:
        """Note the condition of another pass."""
        guards = len(self.graph.guards)
        condition = self._truth(test())
        self._guarded(guards)
        self.running = self.graph.op("and", self.running, condition)
        return not self._is_over

    def stops(self, condition: Any) -> bool:
        """Note what ends the loop; return whether it is over in any case."""
        ends = self.graph.op("not", self._truth(condition))
        self.running = self.graph.op("and", self.running, ends)
        return self._is_over

    def returns(self, condition: Any, value: Callable[[], Any]) -> None:
        """Note what is returned where a condition holds."""
        where = self.graph.op("and", self.running, self._truth(condition))
        if where.op != "const" or where.data:
            guards = len(self.graph.guards)
            self.results.append((where, value()))
            self._guarded(guards, where)

    def begins(self, names: Sequence[str], written: Sequence[str]) -> None:
        """Keep what names have before statements that may not be reached any more."""
        values = sys._getframe(1).f_locals
        self.names, self.guards = names, len(self.graph.guards)
        if self._is_sure:
            return
        self.before = {name: values.get(name, _MISSING) for name in (*names, *written)}
        self.copies = {name: _copied(self.before[name]) for name in written}
        self.others = {k: (v, _content(v)) for k, v in values.items() if k not in self.copies}

    def chosen(self) -> tuple[Any, ...]:
        """Return what the names have now where the loop runs, what they had elsewhere."""
        values = sys._getframe(1).f_locals
        now = [values.get(name, _MISSING) for name in self.names]
        if self._is_sure:
            return tuple(now)
        kept = ((v, c) for k, (v, c) in self.others.items() if values.get(k) is v)
        if any(_content(value) != content for value, content in kept):
            raise Untraceable("a loop that changes an array or an object in a function it calls")
        self._guarded(self.guards)
        for name, copy in self.copies.items():
            self._restored(self.before[name], copy)
        pairs = zip(self.names, now, strict=True)
        return tuple(self._either(value, self.before[name]) for name, value in pairs)

    def raises(self, error: Exception) -> bool:
        """Whether an error ends what runs; in a pass that may not be taken it ends that."""
        if self._is_sure or not self.is_raised(error):
            return True
        self.fails()
        return False

    def end(self) -> None:
        """Note that more passes are NaN, and what later passes alone ask for."""
        if self.passes:
            self.graph.passing.pop()
        self.graph.of_passes |= self.later - self.first
        if self.is_cut:
            self.graph.limited(self.graph.op("not", self.running))
            self.running = self.graph.const(False)

    def fails(self) -> None:
        """Note that Python raises an error, or would still be busy, where the loop runs."""
        self.graph.guard(self.graph.op("not", self.running), RuntimeError)
        self.running = self.graph.const(False)

    def result(self, other: Callable[[], Any] | None) -> Any:
        """Return what the loop has returned, and what follows it elsewhere."""
        op = self.graph.op
        returned = functools.reduce(lambda a, b: op("or", a, b), [c for c, _ in self.results],
                                    self.graph.const(False))  # fmt: skip
        if other is None:
            self.graph.guard(returned, RuntimeError)
            if not self.results:
                raise Untraceable("a loop that never returns")
            *rest, (_, value) = self.results
        else:
            guards = len(self.graph.guards)
            rest, value = self.results, other()
            self._guarded(guards, op("not", returned))
            if value is NOT_RETURNED and any(isinstance(v, list | tuple) for _, v in rest):
                self.graph.guard(returned, TypeError)  # what is taken apart is not None
                *rest, (_, value) = rest
            value = None if value is NOT_RETURNED else value
        for condition, earlier in reversed(rest):
            value = self._selected(condition, earlier, value)
        return value

    @property
    def _is_sure(self) -> bool:
        return self.running.op == "const" and bool(self.running.data)

    @property
    def _is_over(self) -> bool:
        return self.running.op == "const" and not self.running.data

    def _truth(self, value: Any) -> Expr:
        if isinstance(value, Tracer) and not value.shape:
            return truth_value(self.graph, value).only
        return self.graph.const(bool(value))

    def _guarded(self, since: int, where: Expr | None = None) -> None:
        """Let errors matter only where they are reached."""
        elsewhere = self.graph.op("not", self.running if where is None else where)
        for k in range(since, len(self.graph.guards)):
            self.graph.guards[k] = self.graph.op("or", elsewhere, self.graph.guards[k])

    def _restored(self, thing: Any, kept: Any) -> None:
        """Write into an array or list what it had where the loop does not run any more."""
        if isinstance(thing, Tracer) and thing.shape:
            where = scalar(self.graph, self.running)
            thing[...] = elementwise(self.graph, "select", where, thing, kept)
        elif isinstance(thing, list):
            thing[:] = [self._either(a, b) for a, b in zip(thing, kept, strict=True)]
        elif (
            not isinstance(thing, Tracer | int | float | bool | np.generic)
            and thing is not _MISSING
        ):
            raise Untraceable(f"a loop that writes into {type(thing).__name__}")

    def _either(self, now: Any, before: Any) -> Any:
        if before is _MISSING:
            single = isinstance(now, Tracer) and now.size == 1
            is_truth = single and now.where_there().only.kind == "b"
            before = now if is_truth else np.nan
        return self._selected(self.running, now, before)

    def _selected(self, condition: Expr, one: Any, other: Any) -> Any:
        if one is other or condition.op == "const":
            return one if one is other or condition.data else other
        if type(one) is type(other) and isinstance(one, list | tuple):
            parts = [self._selected(condition, a, b) for a, b in zip(one, other, strict=True)]
            return type(one)(parts)
        numbers = Tracer | bool | int | float | np.generic
        if all(isinstance(v, numbers) or v is None for v in (one, other)):
            return chosen(self.graph, condition, one, other)
        if type(one) is type(other) and isinstance(one, str | None) and one == other:
            return one
        raise Untraceable("a loop whose end depends on what is computed, and that changes objects")


def _copied(value: Any) -> Any:
    if isinstance(value, Tracer):
        return value.copy()
    return list(value) if isinstance(value, list) else value


def _content(value: Any, depth: int = 3) -> Any:
    """Return something that is another when a value has been written into."""
    if isinstance(value, Tracer):
        value = value.where_there()
        return tuple(map(id, value.elements().flat)) if value.shape else id(value.only)
    if not depth or isinstance(value, Loop | type):
        return id(value)
    if isinstance(value, list | tuple | dict):
        parts = value.values() if isinstance(value, dict) else value
        return id(value), tuple(_content(v, depth - 1) for v in parts)
    held = getattr(value, "__dict__", None)
    if type(held) is dict and "_real" not in held and not callable(value):
        return id(value), tuple(_content(v, depth - 1) for v in held.values())
    return id(value)
