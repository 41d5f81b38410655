"""Statements in their order: what each leaves in the names of a call."""

from __future__ import annotations

import abc
import ast
import contextlib
import functools
import importlib
import sys
import warnings
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

import numpy as np

from ...expressions.source import Definition, Unreadable, definition
from . import made, operators
from .checked import MEMORY
from .expressions import CHANGES, Expressions, Frame
from .known_calls import CONTAINERS
from .local_classes import class_defined_in, constants_in_class
from .values import (
    FRESH,
    OUTSIDE,
    UNKNOWN_VALUE,
    Given,
    Impure,
    Instance,
    KnownValue,
    Local,
    Unknown,
    captured,
    element,
    forgotten,
    holder,
    is_one_of,
    least_upper_bound,
    library,
    was_there,
)
from .walk import Walk

_SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.MatMult: "@"}


class CallWalker(Expressions):
    """Walks the body of one call."""

    def __init__(self, walk: Walk, frame: Frame) -> None:
        super().__init__(walk, frame)
        self.returned: list[KnownValue] = []
        self.yielded: list[KnownValue] = []

    def result(self, node: Definition) -> KnownValue:
        if isinstance(node, ast.Lambda):
            return self.visit(node.body)
        self.statements(node.body)
        if self.yielded:
            return holder(self.yielded)
        return least_upper_bound(self.returned)

    def visit_Yield(self, node: ast.Yield) -> KnownValue:
        self.yielded.append(FRESH if node.value is None else self.visit(node.value))
        return FRESH

    def visit_YieldFrom(self, node: ast.YieldFrom) -> KnownValue:
        over = self.visit(node.value)
        self.iterated(over)
        self.yielded.append(element(over))
        return FRESH

    def statements(self, body: Sequence[ast.stmt]) -> None:
        for statement in body:
            self.visit(statement)
            answer = self.decided(statement.test) if isinstance(statement, ast.If) else None
            if answer is not None and _leaves(statement.body if answer else statement.orelse):  # type: ignore[attr-defined]
                break

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
            for (part, _), part_value in zip(pairs, values, strict=True):
                self.bind(part, part_value)
            if not pairs:
                self.bind(target, value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.bind(node.target, self.visit(node.value))

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        added = self.visit(node.value)
        if isinstance(node.target, ast.Name):
            value = self.lookup(node.target.id)
            if isinstance(value.known, Instance):
                self.assign(node.target.id, self.changed_object(node, value, added))
                return
            if not value.own:
                name, mark = node.target.id, _SIGNS.get(type(node.op), "+")
                raise Impure(
                    f"changes '{name}' in place with {mark}=, which it did not make",
                    f"write {name} = {name} {mark} ...",
                )
            self.assign(node.target.id, forgotten(value))
            self.kept(value, [added])
            return
        base = self.visit(node.target.value)
        if (
            isinstance(node.target, ast.Attribute)
            and isinstance(base.known, Instance)
            and not self.attribute(base, node.target.attr).own
        ):
            text = ast.unparse(node.target)
            raise Impure(f"changes '{text}' in place, which it did not make", CHANGES)
        if isinstance(node.target, ast.Attribute) and self.walk.writes(
            base, node.target, FRESH, self.frame.function
        ):
            added = least_upper_bound([self.attribute(base, node.target.attr), added])
        elif type(base.known) is dict and self.visit(node.target).own:
            pass  # a number, as those are that are written
        elif base.holds and not base.inside:
            text = ast.unparse(node.target.value)
            raise Impure(f"changes an element of '{text}'", f"{MEMORY}, or {CHANGES}")
        numbers = added.inside and isinstance(added.known, Unknown | np.ndarray)
        numbers = numbers and not isinstance(node.op, ast.Add)  # lists take in what is added
        self.write(node.target, FRESH if numbers else added)

    def changed_object(
        self, node: ast.AugAssign, value: KnownValue, added: KnownValue
    ) -> KnownValue:
        """Return what an object becomes by ``+=`` and its kind."""
        name = operators.OPERATORS.get(type(node.op), "")
        operator = made.operator_of(self.walk, value, f"__i{name}__")
        if operator is not None:
            return self.walk.function(operator, Given((value, added)))
        return operators.operated(self.walk, type(node.op), value, added)

    def visit_Delete(self, node: ast.Delete) -> None:
        for target in node.targets:
            if isinstance(target, ast.Name) and target.id not in self.frame.shared:
                self.assign(target.id, OUTSIDE)
            elif isinstance(target, ast.Name):
                raise Impure(f"deletes '{target.id}', a variable around it", MEMORY)
            else:
                self.bind(target, FRESH)

    def visit_Global(self, node: ast.Global) -> None:
        self.frame.shared |= dict.fromkeys(node.names, "global")

    def visit_Nonlocal(self, node: ast.Nonlocal) -> None:
        self.frame.shared |= dict.fromkeys(node.names, "nonlocal")

    def visit_If(self, node: ast.If) -> None:
        answer = self.decided(node.test)
        if answer is None:
            self.condition(node.test)
        if answer is not None:
            self.statements(node.body if answer else node.orelse)
        elif self.is_off(node.test):
            self.statements(node.orelse)
        else:
            self.either([node.body, node.orelse])

    def is_off(self, test: ast.expr) -> bool:
        """Whether a test is a global that is False: each run makes sure that it still is."""
        around: Frame | None = self.frame
        while around is not None and isinstance(test, ast.Name) and test.id not in around.names:
            around = around.parent
        return isinstance(test, ast.Name) and around is None and self.visit(test).known is False

    def either(self, bodies: Sequence[Sequence[ast.stmt]]) -> None:
        """Walk several ways of which one is taken."""
        before, ends = self.frame.names, []
        for body in bodies:
            self.frame.names = dict(before)
            self.statements(body)
            if not _leaves(body):
                ends.append(self.frame.names)
        self.frame.names = merged(ends or [before])
        everywhere = [name for name in self.frame.names if all(name in end for end in ends)]
        self.frame.unbound |= self.frame.names.keys() - set(everywhere)

    def visit_For(self, node: ast.For) -> None:
        over = self.visit(node.iter)
        self.iterated(over)
        for part in self.texts_in(node.iter, over.known) or [element(over)]:
            self.repeated(node, functools.partial(self.bind, node.target, part))

    def texts_in(self, node: ast.expr, known: object) -> list[KnownValue]:
        """Return each of the texts that a loop goes through: attributes and keys by names."""
        parts = [self.visit(p) for p in node.elts] if isinstance(node, ast.Tuple | ast.List) else []
        parts = list(map(captured, known)) if isinstance(known, tuple) else parts
        return parts if all(isinstance(part.known, str) for part in parts) else []

    def visit_Call(self, node: ast.Call) -> KnownValue:
        """Write as a statement does what setattr() names, of what was there before."""
        # What calls others does not name setattr, and is walked once, below.
        calls = any(isinstance(part, ast.Call) for part in ast.walk(node.func))
        is_setter = len(node.args) == 3 and not calls and self.visit(node.func).known is setattr
        name = self.visit(node.args[1]).known if is_setter else None
        if not isinstance(name, str) or not was_there(self.visit(node.args[0]).known):
            return super().visit_Call(node)
        target = ast.Attribute(node.args[0], name, ast.Store())
        self.write(ast.copy_location(target, node), self.visit(node.args[2]))
        return FRESH

    def visit_While(self, node: ast.While) -> None:
        self.repeated(node, lambda: self.condition(node.test))

    def repeated(self, node: ast.For | ast.While, begin: Callable[..., Any]) -> None:
        """Walk a loop until nothing new is learnt."""
        while True:
            before = dict(self.frame.names)
            begin()
            self.statements(node.body)
            self.frame.names = merged([before, self.frame.names])
            if self.frame.names == before:
                break
        self.statements(node.orelse)

    def visit_Match(self, node: ast.Match) -> None:
        subject = self.visit(node.subject)
        for case in node.cases:
            for part in ast.walk(case.pattern):
                name = getattr(part, "name", None) or getattr(part, "rest", None)
                if name:
                    is_own = subject.own and subject.inside
                    self.assign(name, KnownValue(is_own, subject.inside, rank=subject.rank))
                if isinstance(part, ast.MatchSingleton) and part.value is not None:
                    self.walk.numba_differs += ["identity"]  # one of NumPy's is not the True
                if isinstance(part, ast.MatchClass):
                    self.check_pattern(part)
            if case.guard is not None:
                self.visit(case.guard)
        self.either([case.body for case in node.cases] + [[]])

    def check_pattern(self, pattern: ast.MatchClass) -> None:
        """Check that a pattern asks for a class and reads its plain attributes alone."""
        cls = self.visit(pattern.cls).known
        if isinstance(cls, type) and issubclass(cls, CONTAINERS) and not pattern.kwd_attrs:
            return  # numbers, texts, lists
        plain = isinstance(cls, type) and library(cls) is None and type(cls) in (type, abc.ABCMeta)
        names = (*pattern.kwd_attrs, *getattr(cls, "__match_args__", ())) if plain else ()
        if not plain or any(isinstance(getattr(cls, name, None), property) for name in names):
            self.generic_visit(pattern)  # which says that it is not known

    def visit_Assert(self, node: ast.Assert) -> None:
        self.visit(node.test)

    def visit_Raise(self, node: ast.Raise) -> None:
        before = list(self.walk.numba_differs)
        if node.exc is not None:
            self.visit(node.exc)
        if "text" not in before:  # nobody computes with what an error says
            self.walk.numba_differs = [name for name in self.walk.numba_differs if name != "text"]

    def visit_Try(self, node: ast.Try) -> None:
        """Walk the ways through it; of errors in machine code nothing is caught."""
        caught = [handler.type for handler in node.handlers]
        if not all(isinstance(c, ast.Name) and c.id == "KeyError" for c in caught):
            self.walk.numba_differs += ["try"]  # numba knows other errors than Python
        before = dict(self.frame.names)
        self.statements(node.body)
        self.frame.names = merged([before, self.frame.names])
        for handler in node.handlers:
            if handler.name:
                self.assign(handler.name, FRESH)
        self.either([node.orelse, *(handler.body for handler in node.handlers)])
        self.statements(node.finalbody)

    def visit_TryStar(self, node: ast.AST) -> None:
        raise Impure("has try ... except*", "write an if for the case that fails")

    def visit_With(self, node: ast.With) -> None:
        ends_early, body, left = False, node.body, []
        for item in node.items:
            call = item.context_expr
            entered = self.visit(call.func).known if isinstance(call, ast.Call) else UNKNOWN_VALUE
            plain = is_one_of(entered, (np.errstate, contextlib.suppress, warnings.catch_warnings))
            if not plain or item.optional_vars is not None:
                left.append(self.entered(item))
            ends_early |= entered is contextlib.suppress
            if entered is warnings.catch_warnings:  # it takes back what is said about them
                self.walk.numba_differs += ["try"]
                body = [s for s in body if not self._is_about_warnings(s)]
        if ends_early:
            self.walk.numba_differs += ["try"]  # numba has no such word
            self.either([body, []])
        else:
            self.statements(body)
        for value, leave in reversed(left):
            self.walk.function(leave, Given((value, FRESH, FRESH, FRESH)))

    def entered(self, item: ast.withitem) -> tuple[KnownValue, FunctionType]:
        """Enter an object of somebody's class; return it with what is called at the end."""
        value = self.visit(item.context_expr)
        enter, leave = (made.operator_of(self.walk, value, f"__{w}__") for w in ("enter", "exit"))
        if enter is None or leave is None or _swallows(leave):
            raise Impure("has a with statement", "do without it")
        self.walk.numba_differs += ["try"]  # numba has no such word
        result = self.walk.function(enter, Given((value,)))
        if item.optional_vars is not None:
            self.bind(item.optional_vars, result)
        return value, leave

    def _is_about_warnings(self, node: ast.stmt) -> bool:
        """Return whether a statement says which warnings are shown."""
        call = node.value if isinstance(node, ast.Expr) else None
        if not isinstance(call, ast.Call):
            return False
        called = self.visit(call.func).known
        return is_one_of(called, (warnings.simplefilter, warnings.filterwarnings))

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            module = _imported(alias.name)
            top = _imported(alias.name.partition(".")[0])
            for imported in (module, top):  # a test may have put another in its place
                self.walk.captured(sys.modules, imported.__name__, imported)
            self.assign(alias.asname or top.__name__, captured(module if alias.asname else top))

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        package = self.frame.function.__globals__.get("__package__")
        module = _imported("." * node.level + (node.module or ""), package)
        self.walk.captured(sys.modules, module.__name__, module)
        for alias in node.names:
            value = getattr(module, alias.name)
            self.assign(alias.asname or alias.name, self.walk.captured(module, alias.name, value))

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        value = KnownValue(True, True, known=Local(node, self.frame))
        for decorator in reversed(node.decorator_list):
            value = self.walk.call(self.visit(decorator), Given((value,)))
        self.assign(node.name, value)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for value in constants_in_class(node):
            self.visit(value)
        if node not in self.walk.classes:
            calls = [d.func if isinstance(d, ast.Call) else d for d in node.decorator_list]
            decorators = [self.visit(call).known for call in calls]
            bases = [self.visit(base).known for base in node.bases]
            known = {k: v.known for k, v in self.frame.names.items()}
            made_here = set(map(id, self.walk.classes.values()))
            others = {k: v for k, v in known.items() if id(v) in made_here}
            self.walk.classes[node] = class_defined_in(
                node, self.frame.function, decorators, bases, others
            )
        self.assign(node.name, captured(self.walk.classes[node]))


def _swallows(leave: FunctionType) -> bool:
    """Whether the end of a ``with`` may keep errors to itself: it returns something."""
    try:
        nodes = ast.walk(definition(leave))
    except Unreadable:
        return True
    given = [n.value for n in nodes if isinstance(n, ast.Return | ast.Yield | ast.YieldFrom)]
    return any(not isinstance(v, ast.Constant | None) or (v and v.value) for v in given)


def _leaves(body: Sequence[ast.stmt]) -> bool:
    """Whether statements end with a way out of the function."""
    return bool(body) and isinstance(body[-1], ast.Return | ast.Raise)


def _imported(name: str, package: str | None = None) -> Any:
    try:
        return importlib.import_module(name, package)
    except ImportError:
        raise Impure(f"imports {name}, which is not installed", "import what there is") from None


def _pairs(target: ast.expr, value: ast.expr) -> list[tuple[ast.expr, ast.expr]]:
    """Return what is assigned to what where both sides are written out, otherwise nothing."""
    if not (isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)):
        return []
    is_open = any(isinstance(part, ast.Starred) for part in (*target.elts, *value.elts))
    fits = len(target.elts) == len(value.elts) and not is_open
    return list(zip(target.elts, value.elts, strict=True)) if fits else []


def merged(ends: Sequence[dict[str, KnownValue]]) -> dict[str, KnownValue]:
    """Return what is known after one of several ways."""
    names = dict.fromkeys(name for end in ends for name in end)  # in order: super() asks the first
    return {name: least_upper_bound([end[name] for end in ends if name in end]) for name in names}
