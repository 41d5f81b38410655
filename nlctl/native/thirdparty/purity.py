"""Whether a function is one of its arguments alone, found without calling it.

python-control calls the functions of a block in any order and any number of times.  One that
remembers, that changes what it was given, or that differs from call to call computes something
else in machine code.  So its syntax tree is walked, and the functions that it calls are walked
with it: for every value it is known whose it is.  What is not understood is refused.
"""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from . import known_calls
from .captured import Captured, noted
from .known_calls import MEMORY
from .source import Definition, Unreadable, definition
from .values import (
    FRESH,
    OUTSIDE,
    SLICE,
    UNKNOWN,
    Impure,
    Local,
    OneOf,
    Unknown,
    Value,
    captured,
    element,
    forgotten,
    holder,
    joined,
    library,
    one_of,
)

BUDGET = 400  # bodies that are walked for one function, before it is too much to follow
CHANGES = "work on a copy, as in x.copy()"


@dataclass(eq=False)
class Frame:
    """The names of one call."""

    names: dict[str, Value]
    function: Any  # the plain function that is called, or around it
    parent: Frame | None = None
    shared: dict[str, str] = field(default_factory=dict)  # declared global or nonlocal


def check_pure(function: Any, arguments: Sequence[Value]) -> list[Captured]:
    """Check that a function depends on its arguments alone and changes nothing.

    Parameters
    ----------
    function : callable
    arguments : sequence of Value
        What is known of its arguments.

    Returns
    -------
    list of Captured
        What it reads from around it: constants, as long as they stay what they are.

    Raises
    ------
    Impure
        With the reason, and the place in ``place``.
    """
    walk = Walk()
    walk.call(captured(function), list(arguments), {})
    return list(walk.read.values())


class Walk:
    """Walks a function and all that it calls."""

    def __init__(self) -> None:
        self.done: dict[Any, Value] = {}
        self.walked: set[ast.AST] = set()  # functions inside others, while they are walked
        self.read: dict[tuple[int, str], Captured] = {}
        self.bodies = 0

    def captured(self, holder: Any, name: str, value: Any) -> Value:
        """Return what is known of a value that is read from around a function, and note it."""
        if (id(holder), name) not in self.read:
            self.read[id(holder), name] = noted(holder, name, value)
        return captured(value)

    def call(self, function: Value, given: list[Value], named: dict[str, Value]) -> Value:
        """Return what is known of the result of a call."""
        thing = function.known
        if isinstance(thing, Unknown):
            raise Impure("calls what is only known when it runs", "call a function by its name")
        if isinstance(thing, OneOf):
            return joined([self.call(choice, given, named) for choice in thing.choices])
        if isinstance(thing, Local):
            return self.body(thing.node, thing.frame.function, thing.frame, given, named)
        if isinstance(thing, functools.partial):
            first = [captured(v) for v in thing.args]
            more = {k: captured(v) for k, v in thing.keywords.items()}
            return self.call(captured(thing.func), first + given, more | named)
        return known_calls.call(self, thing, given, named)

    def function(self, thing: FunctionType, given: list[Value], named: dict[str, Value]) -> Value:
        """Return what is known of the result of somebody's Python function."""
        try:
            return self.body(definition(thing), thing, None, given, named)
        except Unreadable as error:
            raise Impure(f"calls {thing.__qualname__}: {error}", "see there") from None

    def body(
        self,
        node: Definition,
        function: FunctionType,
        parent: Frame | None,
        given: list[Value],
        named: dict[str, Value],
    ) -> Value:
        frame = Frame(_bound(node.args, function, parent, given, named), function, parent)
        self.bodies += 1
        if self.bodies > BUDGET:
            raise Impure("calls too many functions to be followed", "make it simpler")
        if parent is not None:  # what it finds in the names around it may have changed
            if node in self.walked:
                return OUTSIDE  # it calls itself
            self.walked.add(node)
            result = _Body(self, frame).result(node)
            self.walked.discard(node)
            return result
        key = (node, function, *frame.names.items())
        if key not in self.done:
            self.done[key] = OUTSIDE  # while it is being walked: it may call itself
            self.done[key] = _Body(self, frame).result(node)
        return self.done[key]


def _bound(
    arguments: ast.arguments,
    function: FunctionType,
    parent: Frame | None,
    given: list[Value],
    named: dict[str, Value],
) -> dict[str, Value]:
    """Return the names of a call's arguments with their values."""
    places = [a.arg for a in arguments.posonlyargs + arguments.args]
    names = [*places, *(a.arg for a in arguments.kwonlyargs)]
    found = dict.fromkeys(names, OUTSIDE)
    if parent is None:  # a function's own defaults are objects that outlive the call
        defaults = function.__defaults__ or ()
        ends = places[len(places) - len(defaults) :]
        found |= {k: captured(v) for k, v in zip(ends, defaults, strict=True)}
        found |= {k: captured(v) for k, v in (function.__kwdefaults__ or {}).items()}
    found |= dict(zip(places, given, strict=False))
    found |= {k: v for k, v in named.items() if k in names}
    if arguments.vararg:
        found[arguments.vararg.arg] = holder(given[len(places) :])
    if arguments.kwarg:
        found[arguments.kwarg.arg] = holder(v for k, v in named.items() if k not in names)
    return found


class _Body(ast.NodeVisitor):
    """Walks one body: statements in their order, expressions to what is known of them."""

    def __init__(self, walk: Walk, frame: Frame) -> None:
        self.walk, self.frame = walk, frame
        self.returned: list[Value] = []

    def result(self, node: Definition) -> Value:
        if isinstance(node, ast.Lambda):
            return self.visit(node.body)
        self.statements(node.body)
        return joined(self.returned)

    def visit(self, node: ast.AST) -> Any:
        try:
            return super().visit(node)
        except Impure as error:
            if not error.place and hasattr(node, "lineno"):
                code = self.frame.function.__code__
                error.place = f"{code.co_filename}, line {node.lineno}"  # type: ignore[attr-defined]
            raise

    def generic_visit(self, node: ast.AST) -> Any:
        what = type(node).__name__
        raise Impure(f"has a {what} statement or expression", f"write it without {what}")

    def statements(self, body: Sequence[ast.stmt]) -> None:
        for statement in body:
            self.visit(statement)

    # names

    def lookup(self, name: str) -> Value:
        frame: Frame | None = self.frame
        while frame is not None:
            if name in frame.names:
                return frame.names[name]
            frame = frame.parent
        function = self.frame.function
        cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
        try:
            if name in cells:
                return self.walk.captured(cells[name], name, cells[name].cell_contents)
        except ValueError:  # an empty cell: the name has no value yet
            return OUTSIDE
        builtin = function.__globals__.get("__builtins__", {})
        builtin = builtin if isinstance(builtin, dict) else vars(builtin)
        if name in function.__globals__:
            return self.walk.captured(function.__globals__, name, function.__globals__[name])
        return captured(builtin[name]) if name in builtin else OUTSIDE

    def assign(self, name: str, value: Value) -> None:
        kind = self.frame.shared.get(name)
        if kind == "global":
            raise Impure(f"writes the global '{name}'", MEMORY)
        if kind is None:
            self.frame.names[name] = value
            return
        frame = self.frame.parent
        while frame is not None and name not in frame.names:
            frame = frame.parent
        if frame is None:
            raise Impure(f"writes '{name}', a variable of the function around it", MEMORY)
        frame.names[name] = joined([frame.names[name], value])

    def bind(self, target: ast.expr, value: Value) -> None:
        """Assign to a name, an item, an attribute, or several of these."""
        if isinstance(target, ast.Name):
            self.assign(target.id, value)
        elif isinstance(target, ast.Tuple | ast.List):
            for part in target.elts:
                self.bind(part, element(value))
        elif isinstance(target, ast.Starred):
            self.bind(target.value, replace(element(value), own=True, holds=True))
        elif isinstance(target, ast.Subscript | ast.Attribute):
            self.write(target, value)
        else:
            self.generic_visit(target)

    def write(self, target: ast.Subscript | ast.Attribute, value: Value) -> None:
        base = self.visit(target.value)
        if isinstance(target, ast.Subscript):
            self.visit(target.slice)
        if not base.own:
            text = ast.unparse(target.value)
            raise Impure(f"writes into '{text}', which it did not make", f"{MEMORY}, or {CHANGES}")
        if base.holds and isinstance(target.value, ast.Name):
            inside = base.inside and value.own and value.inside
            self.assign(target.value.id, replace(base, inside=inside))

    # statements

    def visit_Expr(self, node: ast.Expr) -> None:
        self.visit(node.value)

    def visit_Pass(self, node: ast.AST) -> None:
        pass

    visit_Break = visit_Continue = visit_Pass

    def visit_Return(self, node: ast.Return) -> None:
        self.returned.append(FRESH if node.value is None else self.visit(node.value))

    def visit_Assign(self, node: ast.Assign) -> None:
        value, parts = self.visit(node.value), node.value
        for target in node.targets:
            pairs = _pairs(target, parts)
            values = [self.visit(part) for _, part in pairs]  # a, b = c, d
            for (part, _), each in zip(pairs, values, strict=True):
                self.bind(part, each)
            if not pairs:
                self.bind(target, value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.bind(node.target, self.visit(node.value))

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        added = self.visit(node.value)
        if isinstance(node.target, ast.Name):
            value = self.lookup(node.target.id)
            if not value.own:
                name, mark = node.target.id, _SIGNS.get(type(node.op), "+")
                raise Impure(
                    f"changes '{name}' in place with {mark}=, which it did not make",
                    f"write {name} = {name} {mark} ...",
                )
            keeps = value.holds and not (added.own and added.inside)
            self.assign(
                node.target.id, forgotten(replace(value, inside=value.inside and not keeps))
            )
            return
        base = self.visit(node.target.value)
        if base.holds and not base.inside:
            text = ast.unparse(node.target.value)
            raise Impure(f"changes an element of '{text}'", f"{MEMORY}, or {CHANGES}")
        self.write(node.target, added)

    def visit_Delete(self, node: ast.Delete) -> None:
        for target in node.targets:
            if isinstance(target, ast.Name):
                self.assign(target.id, OUTSIDE)
            else:
                self.bind(target, FRESH)

    def visit_Global(self, node: ast.Global) -> None:
        self.frame.shared |= dict.fromkeys(node.names, "global")

    def visit_Nonlocal(self, node: ast.Nonlocal) -> None:
        self.frame.shared |= dict.fromkeys(node.names, "nonlocal")

    def visit_If(self, node: ast.If) -> None:
        self.visit(node.test)
        self.either([node.body, node.orelse])

    def either(self, bodies: Sequence[Sequence[ast.stmt]]) -> None:
        """Walk several ways of which one is taken."""
        before, ends = self.frame.names, []
        for body in bodies:
            self.frame.names = dict(before)
            self.statements(body)
            ends.append(self.frame.names)
        self.frame.names = _merged(ends)

    def visit_For(self, node: ast.For) -> None:
        over = self.visit(node.iter)
        self.iterated(over, node.iter)
        self.repeated(node, lambda: self.bind(node.target, element(over)))

    def visit_While(self, node: ast.While) -> None:
        self.repeated(node, lambda: self.visit(node.test))

    def repeated(self, node: ast.For | ast.While, begin: Any) -> None:
        """Walk a loop until nothing new is learnt."""
        while True:
            before = dict(self.frame.names)
            begin()
            self.statements(node.body)
            self.frame.names = _merged([before, self.frame.names])
            if self.frame.names == before:
                break
        self.statements(node.orelse)

    def iterated(self, value: Value, node: ast.AST) -> None:
        if not value.own and hasattr(value.known, "__next__"):
            raise Impure(f"uses up '{ast.unparse(node)}', which it did not make", MEMORY)

    def visit_Match(self, node: ast.Match) -> None:
        subject = self.visit(node.subject)
        for case in node.cases:
            for part in ast.walk(case.pattern):
                name = getattr(part, "name", None) or getattr(part, "rest", None)
                if name:
                    self.assign(name, Value(subject.own and subject.inside, subject.inside))
                if isinstance(part, ast.MatchClass):
                    self.generic_visit(part)
            if case.guard is not None:
                self.visit(case.guard)
        self.either([case.body for case in node.cases] + [[]])

    def visit_Assert(self, node: ast.Assert) -> None:
        self.visit(node.test)

    def visit_Raise(self, node: ast.Raise) -> None:
        if node.exc is not None:
            self.visit(node.exc)

    def visit_Try(self, node: ast.Try | ast.TryStar) -> None:
        raise Impure("has try ... except or finally", "write an if for the case that fails")

    visit_TryStar = visit_Try

    def visit_With(self, node: ast.With) -> None:
        for item in node.items:
            call = item.context_expr
            made = self.visit(call.func).known if isinstance(call, ast.Call) else UNKNOWN
            if made is not np.errstate or item.optional_vars is not None:
                raise Impure("has a with statement", "do without it")
        self.statements(node.body)

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            module = importlib.import_module(alias.name)
            top = importlib.import_module(alias.name.partition(".")[0])
            self.assign(alias.asname or top.__name__, captured(module if alias.asname else top))

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        package = self.frame.function.__globals__.get("__package__")
        module = importlib.import_module("." * node.level + (node.module or ""), package)
        for alias in node.names:
            self.assign(alias.asname or alias.name, captured(getattr(module, alias.name)))

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        if node.decorator_list:
            raise Impure("decorates a function inside", "define it outside")
        self.assign(node.name, Value(True, True, known=Local(node, self.frame)))

    # expressions

    def visit_Lambda(self, node: ast.Lambda) -> Value:
        return Value(True, True, known=Local(node, self.frame))

    def visit_Constant(self, node: ast.Constant) -> Value:
        return captured(node.value) if node.value is not ... else SLICE

    def visit_Name(self, node: ast.Name) -> Value:
        return self.lookup(node.id)

    def visit_NamedExpr(self, node: ast.NamedExpr) -> Value:
        value = self.visit(node.value)
        self.assign(node.target.id, value)
        return value

    def visit_BinOp(self, node: ast.BinOp) -> Value:
        self.operands([self.visit(node.left), self.visit(node.right)])
        return FRESH

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Value:
        self.operands([self.visit(node.operand)])
        return FRESH

    def operands(self, values: Sequence[Value]) -> None:
        """Check that operators are those of numbers, arrays and containers."""
        for value in values:
            kind = type(value.known)
            if not isinstance(value.known, Unknown) and library(kind) is None:
                raise Impure(f"computes with an object of type {kind.__name__}", "use arrays")

    def visit_Compare(self, node: ast.Compare) -> Value:
        self.operands([self.visit(part) for part in (node.left, *node.comparators)])
        for test, part in zip(node.ops, node.comparators, strict=True):
            is_none = isinstance(part, ast.Constant) and part.value is None
            if isinstance(test, ast.Is | ast.IsNot) and not is_none:
                raise Impure("tests identity with 'is'", "write == or !=")
        return FRESH

    def visit_BoolOp(self, node: ast.BoolOp) -> Value:
        return joined([self.visit(part) for part in node.values])

    def visit_IfExp(self, node: ast.IfExp) -> Value:
        self.visit(node.test)
        return joined([self.visit(node.body), self.visit(node.orelse)])

    def visit_Tuple(self, node: ast.Tuple | ast.List | ast.Set) -> Value:
        return holder([self.visit(part) for part in node.elts])

    visit_List = visit_Set = visit_Tuple

    def visit_Dict(self, node: ast.Dict) -> Value:
        for part in node.keys:
            if part is not None:
                self.visit(part)
        return holder([self.visit(part) for part in node.values])

    def visit_Starred(self, node: ast.Starred) -> Value:
        return element(self.visit(node.value))

    def visit_Slice(self, node: ast.Slice) -> Value:
        for part in (node.lower, node.upper, node.step):
            if part is not None:
                self.visit(part)
        return SLICE

    def visit_JoinedStr(self, node: ast.JoinedStr) -> Value:
        for part in ast.walk(node):
            if isinstance(part, ast.FormattedValue):
                self.visit(part.value)
        return FRESH

    def visit_Subscript(self, node: ast.Subscript) -> Value:
        base = self.visit(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        values = [self.visit(index) for index in indices]
        keys = [v.known for v in values]
        if isinstance(base.known, OneOf):
            return base
        if isinstance(base.known, dict | list | tuple) and isinstance(keys[0], Unknown):
            parts = base.known.values() if isinstance(base.known, dict) else base.known
            return replace(element(base), known=one_of(map(captured, parts)))
        if isinstance(base.known, dict | list | tuple):
            try:
                key: Any = keys[0] if len(keys) == 1 else tuple(keys)
                return captured(base.known[key])
            except (LookupError, TypeError):
                return OUTSIDE  # it raises where it runs
        self.operands([base])
        if any(isinstance(key, slice | type(None)) for key in keys):
            return forgotten(base)  # a view
        if any(isinstance(v.known, Unknown) and not v.own for v in values):
            return forgotten(base)
        whole = isinstance(base.known, np.ndarray) and len(keys) == base.known.ndim
        return FRESH if whole else element(base)

    def visit_Attribute(self, node: ast.Attribute) -> Value:
        return self.attribute(self.visit(node.value), node.attr)

    def attribute(self, base: Value, name: str) -> Value:
        """Return what is known of an attribute; a property is walked."""
        thing = base.known
        if isinstance(thing, Unknown):
            return base
        if isinstance(thing, np.ndarray):
            return forgotten(base)
        found = inspect.getattr_static(type(thing), name, None)
        if isinstance(found, property | functools.cached_property) and library(type(thing)) is None:
            getter = found.fget if isinstance(found, property) else found.func
            result = self.walk.call(captured(getter), [base], {})
            return result if not result.own else FRESH
        if isinstance(thing, ModuleType) or _is_plain_attribute(thing, name):
            value = getattr(thing, name, UNKNOWN)
            if isinstance(value, Unknown):
                return OUTSIDE
            if isinstance(value, MethodType) or isinstance(thing, super):
                return captured(value)  # made anew each time
            return self.walk.captured(thing, name, value)
        raise Impure(f"reads '.{name}' of an object that computes it", "use a plain attribute")

    def visit_Call(self, node: ast.Call) -> Value:
        given = [self.visit(part) for part in node.args]
        named = {k.arg or "**": self.visit(k.value) for k in node.keywords}
        if "out" in named and not named["out"].own:
            raise Impure("writes into an array with out=, which it did not make", CHANGES)
        if isinstance(node.func, ast.Attribute):
            base = self.visit(node.func.value)
            bound = known_calls.method(self.walk, base, node.func.attr, given, named)
            if bound is not None:
                return bound
        function = self.visit(node.func)
        if function.known is super and not given:
            return self.parent_class()
        if function.known is getattr and isinstance(given[1].known, str):
            return self.attribute(given[0], given[1].known)
        return self.walk.call(function, given, named)

    def parent_class(self) -> Value:
        """Return what ``super()`` stands for."""
        own, cls = next(iter(self.frame.names.values()), OUTSIDE), self.lookup("__class__")
        if isinstance(own.known, Unknown) or not isinstance(cls.known, type):
            raise Impure("calls super() of what is only known when it runs", "name the class")
        return captured(super(cls.known, own.known))

    def visit_ListComp(self, node: ast.ListComp | ast.SetComp | ast.GeneratorExp) -> Value:
        return self.comprehended(node.generators, [node.elt])

    visit_SetComp = visit_GeneratorExp = visit_ListComp

    def visit_DictComp(self, node: ast.DictComp) -> Value:
        return self.comprehended(node.generators, [node.key, node.value])

    def comprehended(self, loops: Sequence[ast.comprehension], parts: Sequence[ast.expr]) -> Value:
        before = dict(self.frame.names)
        for loop in loops:
            over = self.visit(loop.iter)
            self.iterated(over, loop.iter)
            self.bind(loop.target, element(over))
            for condition in loop.ifs:
                self.visit(condition)
        made = holder([self.visit(part) for part in parts])
        self.frame.names = before
        return made


_SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.MatMult: "@"}


def _pairs(target: ast.expr, value: ast.expr) -> list[tuple[ast.expr, ast.expr]]:
    """Return what is assigned to what where both sides are written out, otherwise nothing."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        if len(target.elts) == len(value.elts):
            return list(zip(target.elts, value.elts, strict=True))
    return []


def _is_plain_attribute(thing: Any, name: str) -> bool:
    """Whether reading an attribute of an object runs no code that could do anything."""
    if library(type(thing)) is not None or isinstance(thing, type | super):
        return True
    missing = object()
    found = inspect.getattr_static(thing, name, missing)
    if found is missing:
        return not any(hasattr(type(thing), special) for special in ("__getattr__",))
    simple = (FunctionType, staticmethod, classmethod)
    return (
        isinstance(found, simple)
        or not hasattr(type(found), "__get__")
        or (type(found).__name__ in ("member_descriptor", "_tuplegetter", "getset_descriptor"))
    )


def _merged(ends: Sequence[dict[str, Value]]) -> dict[str, Value]:
    """Return what is known after one of several ways."""
    names = {name for end in ends for name in end}
    return {name: joined([end[name] for end in ends if name in end]) for name in names}
