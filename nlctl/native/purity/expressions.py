"""What is known of the values of expressions, and of the names in one call."""

from __future__ import annotations

import ast
import enum
import functools
import inspect
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import Any

from ...expressions.source import cells_of, source_file
from . import handed_on, known_calls, made, operators, texts
from .captured import GONE, Captured
from .checked import MEMORY, check_object
from .parts import is_plain_attribute, names_read, part_at, part_of_one, part_of_row
from .values import (
    FRESH,
    OUTSIDE,
    PLAIN,
    SLICE,
    UNKNOWN_VALUE,
    Attributes,
    Given,
    Impure,
    Instance,
    KnownValue,
    ListOf,
    Local,
    Message,
    OneOf,
    Parent,
    Pure,
    RowOf,
    Unknown,
    captured,
    element,
    holder,
    is_itself_alone,
    least_upper_bound,
    library,
    maybe_shared,
    one_among,
    row,
)
from .views import attribute_of_array, indexed, is_array
from .walk import Walk

CHANGES = "work on a copy, as in x.copy()"
_SAME = (ast.Eq, ast.NotEq, ast.Is, ast.IsNot)
_SIGNS = {ast.USub: "__neg__", ast.UAdd: "__pos__", ast.Invert: "__invert__", ast.Not: "__bool__"}


@dataclass(eq=False)
class Frame:
    """The names of one call."""

    names: dict[str, KnownValue]
    function: Callable[..., Any]  # the plain function that is called, or around it
    parent: Frame | None = None
    shared: dict[str, str] = field(default_factory=dict)  # declared global or nonlocal
    unbound: set[str] = field(default_factory=set)  # without a value on one of the ways so far


class Expressions(ast.NodeVisitor):
    """Walks expressions to what is known of their values; `visit` does so for any node."""

    def __init__(self, walk: Walk, frame: Frame) -> None:
        self.walk, self.frame, self.line = walk, frame, 0

    def visit(self, node: ast.AST) -> Any:
        self.line = getattr(node, "lineno", self.line)
        try:
            return super().visit(node)
        except Impure as error:
            if not error.place and hasattr(node, "lineno"):
                file = source_file(self.frame.function)
                error.place = f"{file}, line {node.lineno}"  # type: ignore[attr-defined]
            raise

    def generic_visit(self, node: ast.AST) -> Any:
        what = type(node).__name__
        raise Impure(f"has a {what} statement or expression", f"write it without {what}")

    # names

    def lookup(self, name: str) -> KnownValue:
        frame: Frame | None = self.frame
        while frame is not None:
            if name in frame.names:
                self.walk.numba_differs += [name] if name in frame.unbound else []
                return frame.names[name]
            frame = frame.parent
        function, cells = self.frame.function, cells_of(self.frame.function)
        try:
            if name in cells:
                return self.walk.captured(cells[name], name, cells[name].cell_contents)
        except ValueError:  # an empty cell: the name has no value yet
            return OUTSIDE
        builtin = function.__globals__.get("__builtins__", {})
        builtin = builtin if isinstance(builtin, dict) else vars(builtin)
        if name in function.__globals__:
            return self.walk.captured(function.__globals__, name, function.__globals__[name])
        self.walk.note([Captured(function.__globals__, name, GONE)])  # a global would come first
        return self.walk.captured(builtin, name, builtin[name]) if name in builtin else OUTSIDE

    def assign(self, name: str, value: KnownValue) -> None:
        kind = self.frame.shared.get(name)
        if kind is None:
            self.frame.names[name] = value
            self.frame.unbound.discard(name)
            return
        frame = self.frame.parent if kind == "nonlocal" else None
        while frame is not None and name not in frame.names:
            frame = frame.parent
        if frame is not None:
            frame.names[name] = least_upper_bound([frame.names[name], value])
            return
        function: Any = self.frame.function
        around = function.__globals__ if kind == "global" else cells_of(function).get(name)
        if not self.walk.binds(around, name, value, function, self.line):
            whose = "the global " if kind == "global" else "of a function around it "
            raise Impure(f"writes {whose}'{name}'", MEMORY)

    def bind(self, target: ast.expr, value: KnownValue) -> None:
        """Assign to a name, an item, an attribute, or several of these."""
        if isinstance(target, ast.Name):
            self.assign(target.id, value)
        elif isinstance(target, ast.Tuple | ast.List):
            self.iterated(value)
            is_open = any(isinstance(part, ast.Starred) for part in target.elts)
            for i, part in enumerate(target.elts):
                single = element(value) if is_open else part_at(value, i, len(target.elts))
                self.bind(part, value if isinstance(part, ast.Starred) else single)
        elif isinstance(target, ast.Starred):
            self.bind(target.value, holder([element(value)]))
        elif isinstance(target, ast.Subscript | ast.Attribute):
            self.write(target, value)
        else:
            self.generic_visit(target)

    def write(self, target: ast.Subscript | ast.Attribute, value: KnownValue) -> None:
        base, key = self.visit(target.value), FRESH
        if isinstance(target, ast.Subscript):
            key = self.visit(target.slice)
        several = base.known.choices if isinstance(base.known, OneOf) else (base,)
        objects = [thing for thing in several if thing.known is not None]
        if all(isinstance(thing.known, Instance) for thing in objects):
            for thing in objects:
                self.write_object(target, thing, value)
            return
        if isinstance(base.known, OneOf) and all(
            self.walk.writes(thing, target, value, self.frame.function) for thing in objects
        ):
            return
        if isinstance(base.known, ListOf | OneOf | RowOf | enum.Enum):
            raise Impure(f"changes '{ast.unparse(target.value)}', which holds functions", CHANGES)
        function = self.frame.function
        if not base.own and not self.walk.writes(base, target, value, function, key.known):
            text = ast.unparse(target.value)
            raise Impure(f"writes into '{text}', which it did not make", f"{MEMORY}, or {CHANGES}")
        self.kept(base, [value])

    def write_object(
        self, target: ast.Subscript | ast.Attribute, base: KnownValue, value: KnownValue
    ) -> None:
        """Note what is written into an object that the call has made."""
        if isinstance(target, ast.Subscript):
            setter = made.operator_of(self.walk, base, "__setitem__")
            if setter is None:
                raise Impure(f"writes into an object of {base.known.cls.__name__}", CHANGES)
            self.walk.function(setter, Given((base, OUTSIDE, value)))
            return
        made.set_attribute(self.walk, base, captured(target.attr), value)
        self.kept(base, [value])

    def kept(self, base: KnownValue, values: Sequence[KnownValue]) -> None:
        """Note that a list or dict keeps what the call has not made: any other may be the same."""
        if isinstance(base.known, Attributes):
            base.known.of.known.learn(made.OF_DICT, OUTSIDE)
        if base.holds and not all(v.own and v.inside for v in values):
            self.walk.keeps += 1
            self.lists_may_hold_others()

    def lists_may_hold_others(self) -> None:
        """Note that lists of the call, and of objects that it made, hold what it has not made."""
        names = self.frame.names
        names.update({k: maybe_shared(v) for k, v in names.items() if v.holds})
        self.walk.lists_may_hold_others()
        for thing in self.walk.objects:
            for name, value in list(thing.attributes.items()):
                if value.holds and value.inside and not isinstance(value.known, Instance):
                    thing.learn(name, maybe_shared(value))

    # expressions

    def visit_Lambda(self, node: ast.Lambda) -> KnownValue:
        return KnownValue(True, True, known=Local(node, self.frame))

    def visit_Constant(self, node: ast.Constant) -> KnownValue:
        self.walk.numba_differs += ["float32"] if node.value in ("float32", "f4") else []
        return captured(node.value) if node.value is not ... else SLICE

    def visit_Name(self, node: ast.Name) -> KnownValue:
        return self.lookup(node.id)

    def visit_NamedExpr(self, node: ast.NamedExpr) -> KnownValue:
        value = self.visit(node.value)
        self.assign(node.target.id, value)
        return value

    def visit_BinOp(self, node: ast.BinOp) -> KnownValue:
        values = [self.visit(part) for part in (node.left, node.right)]
        return operators.operated(self.walk, type(node.op), *values)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> KnownValue:
        value, name = self.visit(node.operand), _SIGNS.get(type(node.op), "")
        if isinstance(node.op, ast.Not):
            operators.tested(self.walk, value)
            return FRESH
        return operators.signed(self.walk, name, value)

    def condition(self, node: ast.expr) -> None:
        operators.tested(self.walk, self.visit(node))

    def visit_Compare(self, node: ast.Compare) -> KnownValue:
        values = [self.visit(part) for part in (node.left, *node.comparators)]
        for test, left, right in zip(node.ops, values, values[1:], strict=False):
            if isinstance(test, _SAME) and all(map(is_itself_alone, (left, right))):
                self.walk.numba_differs += ["identity"]
                return FRESH
            if isinstance(test, ast.In | ast.NotIn):
                operators.contains(self.walk, right, left)
            elif not isinstance(test, ast.Is | ast.IsNot):
                operators.operated(self.walk, type(test), left, right)
        for test, part, value in zip(node.ops, node.comparators, values[1:], strict=True):
            is_constant = isinstance(part, ast.Constant) and part.value in (None, True, False)
            is_one = is_constant or isinstance(value.known, enum.Enum | type)
            is_one |= value.known is NotImplemented
            if is_one and isinstance(part, ast.Constant) and part.value is not None:
                self.walk.numba_differs += ["identity"]  # one of NumPy's is not the True
            if isinstance(test, ast.Is | ast.IsNot) and not is_one:
                raise Impure("tests identity with 'is'", "write == or !=")
        return FRESH

    def visit_BoolOp(self, node: ast.BoolOp) -> KnownValue:
        values = [self.visit(part) for part in node.values]
        for value in values:
            operators.tested(self.walk, value)
        return least_upper_bound(values)

    def decided(self, test: ast.expr) -> bool | None:
        """Return what ``isinstance`` says of what is known to be of one class, None of others."""
        if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
            answer = self.decided(test.operand)
            return None if answer is None else not answer
        if not isinstance(test, ast.Call) or self.visit(test.func).known is not isinstance:
            return None
        thing, kinds = (self.visit(part).known for part in test.args)
        cls = thing.cls if isinstance(thing, Instance) else type(thing)
        if not isinstance(thing, (Instance, *PLAIN)) or not isinstance(kinds, type):
            return None
        return issubclass(cls, kinds)

    def visit_IfExp(self, node: ast.IfExp) -> KnownValue:
        answer = self.decided(node.test)
        if answer is not None:
            return self.visit(node.body if answer else node.orelse)
        self.condition(node.test)
        return least_upper_bound([self.visit(node.body), self.visit(node.orelse)])

    def visit_Tuple(self, node: ast.Tuple | ast.List | ast.Set) -> KnownValue:
        is_open = any(isinstance(part, ast.Starred) for part in node.elts)
        made_by = row if isinstance(node, ast.Tuple) and not is_open else holder
        return made_by([self.visit(part) for part in node.elts])

    visit_List = visit_Set = visit_Tuple

    def visit_Dict(self, node: ast.Dict) -> KnownValue:
        for part in filter(None, node.keys):
            self.visit(part)
        parts = zip(node.keys, map(self.visit, node.values), strict=True)
        return holder([element(value) if key is None else value for key, value in parts])

    def visit_Starred(self, node: ast.Starred) -> KnownValue:
        value = self.visit(node.value)
        self.iterated(value)
        return element(value)

    def visit_Slice(self, node: ast.Slice) -> KnownValue:
        for part in filter(None, (node.lower, node.upper, node.step)):
            self.visit(part)
        return SLICE

    def visit_JoinedStr(self, node: ast.JoinedStr) -> KnownValue:
        self.walk.numba_differs += ["text"]  # numba writes numbers in other digits than Python
        return texts.joined([self.visit(part) for part in node.values])

    def visit_FormattedValue(self, node: ast.FormattedValue) -> KnownValue:
        value = self.visit(node.value)
        if node.format_spec is not None:
            self.visit(node.format_spec)
        return value if node.format_spec is None and node.conversion == -1 else FRESH

    def visit_Subscript(self, node: ast.Subscript) -> KnownValue:
        base = self.visit(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        values = [self.visit(index) for index in indices]
        keys = [v.known for v in values]
        if isinstance(base.known, ListOf):
            slices = any(isinstance(key, slice) for key in keys)
            return base if slices else element(base)
        if isinstance(base.known, RowOf):
            return part_of_row(base, keys[0])
        if isinstance(base.known, OneOf):
            return part_of_one(base, keys)
        getter = made.operator_of(self.walk, base, "__getitem__")
        if getter is not None:
            return self.walk.function(getter, Given((base, *values[:1])))
        if isinstance(base.known, dict | list | tuple) and isinstance(keys[0], Unknown | OneOf):
            parts = base.known.values() if isinstance(base.known, dict) else base.known
            return one_among(element(base), parts)
        if isinstance(base.known, dict | list | tuple):
            try:
                key: Any = keys[0] if len(keys) == 1 else tuple(keys)
                if (id(base.known), key) in self.walk.registers:
                    return self.walk.registers[id(base.known), key][1]
                missing = getattr(type(base.known), "__missing__", None)
                if isinstance(missing, FunctionType) and key not in base.known:
                    return self.walk.function(missing, Given((base, captured(key))))
                return captured(base.known[key])
            except (LookupError, TypeError):
                return OUTSIDE  # it raises where it runs
        operators.operands([base])
        return indexed(base, indices, values)

    def visit_Attribute(self, node: ast.Attribute) -> KnownValue:
        return self.attribute(self.visit(node.value), node.attr)

    def attribute(self, base: KnownValue, name: str) -> KnownValue:
        """Return what is known of an attribute; a property is walked."""
        thing = base.known
        if is_array(base):
            return attribute_of_array(base, name)
        if isinstance(thing, Unknown | Pure):
            is_new = base.own and (base.inside or not base.holds)
            return replace(base, own=base.inside if isinstance(thing, Pure) else is_new)
        if isinstance(thing, Instance):
            return made.attribute(self.walk, base, name)
        if isinstance(thing, ListOf | RowOf):
            raise Impure(f"reads '.{name}' of a list of functions or objects", "take one of them")
        if isinstance(thing, Parent):
            return made.of_parent(self.walk, thing, name)
        if isinstance(thing, OneOf):
            choices = [choice for choice in thing.choices if choice.known is not None]
            return least_upper_bound([self.attribute(choice, name) for choice in choices])
        entry = inspect.getattr_static(type(thing), name, None)
        if isinstance(entry, property | functools.cached_property) and library(type(thing)) is None:
            return self.computed(base, name, entry)
        if isinstance(entry, functools._lru_cache_wrapper):
            self.walk.captured(type(thing), name, entry)
            return made.of_class(self.walk, base, entry)
        if isinstance(thing, enum.Enum) and entry is inspect.getattr_static(enum.Enum, name, None):
            return self.walk.captured(thing, name, getattr(thing, name))  # its name or its value
        if isinstance(thing, ModuleType) or is_plain_attribute(thing, name):
            if isinstance(value := getattr(thing, name, UNKNOWN_VALUE), Unknown):  # it raises
                return KnownValue(False, False, True, known=Pure())
            if isinstance(value, BuiltinFunctionType) and (
                isinstance(thing, known_calls.WITH_METHODS)
                or (isinstance(thing, type) and value.__self__ is thing)
            ):
                return captured(value)  # a method, a new one each time it is read
            if (library(type(thing)) or "").startswith(("pandas", "scipy.sparse")):
                return captured(value)  # a part of a table that is noted
            return self.walk.captured(thing, name, value)
        return self.searched_for(base, name)

    def searched_for(self, base: KnownValue, name: str) -> KnownValue:
        """Return what is known of an attribute that an object's ``__getattr__`` finds."""
        cls = type(base.known)
        finder = inspect.getattr_static(cls, "__getattr__", None)
        is_missing = inspect.getattr_static(base.known, name, GONE) is GONE
        if not isinstance(finder, FunctionType) or not is_missing or library(cls) is not None:
            raise Impure(f"reads '.{name}' of an object that computes it", "use a plain attribute")
        holders = [cls, *([vars(base.known)] if hasattr(base.known, "__dict__") else [])]
        self.walk.note([Captured(holder, name, GONE) for holder in holders])
        self.walk.captured(cls, "__getattr__", finder)
        return self.walk.function(finder, Given((base, captured(name))))

    def computed(
        self, base: KnownValue, name: str, entry: property | functools.cached_property[Any]
    ) -> KnownValue:
        """Return what is known of what a property of an object that was there before returns."""
        self.walk.captured(type(base.known), name, entry)
        if isinstance(entry, functools.cached_property):
            self.walk.captured(vars(base.known), name, getattr(base.known, name, None))
            return self.walk.first_call(captured(entry.func), Given((base,)))
        result = self.walk.call(captured(entry.fget), Given((base,)))
        return result if not result.own else FRESH

    def visit_Call(self, node: ast.Call) -> KnownValue:
        places = tuple(self.visit(part) for part in node.args)
        given = Given(places, {k.arg or "**": self.visit(k.value) for k in node.keywords})
        out = given.names.get("out", FRESH)
        if not out.own or handed_on.holds_others(out):
            raise Impure("writes into an array with out=, which it did not make", CHANGES)
        if isinstance(node.func, ast.Attribute):
            base = self.visit(node.func.value)
            bound = known_calls.method(self.walk, base, node.func.attr, given)
            if bound is not None:
                if node.func.attr not in known_calls.named.READING:
                    parts = map(element, places) if node.func.attr == "update" else places
                    self.kept(base, (*parts, *given.names.values()))
                return bound
        function = self.visit(node.func)
        given = made.with_field_names(node, function.known, given)
        if function.known is super and not places:
            return self.parent_class()
        if function.known is operator.attrgetter:
            return self.reader_of(places)
        if function.known is getattr or made.asks_what_is_there(function.known, places):
            names, others = names_read(*places)
            read = least_upper_bound([*(self.attribute(places[0], n) for n in names), *others])
            return read if function.known is getattr else FRESH
        before = self.walk.keeps
        try:
            result = self.walk.made_once((node, self.frame), self.walk.call(function, given))
        except Message as message:
            message.place = f"{source_file(self.frame.function)}, line {node.lineno}"
            self.walk.messages.append(message)
            result = FRESH
        called = function.known.choices if isinstance(function.known, OneOf) else (function,)
        plain = [isinstance(f.known, FunctionType) and not library(f.known) for f in called]
        reaches = any(v.holds for v in given.every) or not all(plain)
        if self.walk.keeps > before and reaches:
            self.lists_may_hold_others()
        takes = [isinstance(f.known, Local) or known_calls.takes_alone(f.known) for f in called]
        if not all(p or t for p, t in zip(plain, takes, strict=True)):
            for value in given.every:  # a list may have been given something else to keep
                self.kept(value, [v for v in given.every if v is not value])
        return result

    def reader_of(self, names: Sequence[KnownValue]) -> KnownValue:
        """Return the function that `operator.attrgetter` makes: it reads attributes by names."""
        if not all(isinstance(name.known, str) for name in names):
            raise Impure("calls attrgetter() by a name that is only known when it runs", "write it")
        read = [f"one.{name.known}" for name in names]
        text = f"lambda one: ({', '.join(read)})" if len(read) > 1 else f"lambda one: {read[0]}"
        tree = ast.parse(text, mode="eval").body
        return self.visit(ast.increment_lineno(tree, self.line - 1))

    def parent_class(self) -> KnownValue:
        """Return what ``super()`` stands for."""
        owner, cls = next(iter(self.frame.names.values()), OUTSIDE), self.lookup("__class__")
        if isinstance(owner.known, Instance) and isinstance(cls.known, type):
            return KnownValue(True, True, known=Parent(owner, cls.known))
        if isinstance(owner.known, Unknown) or not isinstance(cls.known, type):
            raise Impure("calls super() of what is only known when it runs", "name the class")
        return captured(super(cls.known, owner.known))

    def visit_ListComp(self, node: ast.ListComp | ast.SetComp | ast.GeneratorExp) -> KnownValue:
        return self.comprehended(node.generators, [node.elt])

    visit_SetComp = visit_GeneratorExp = visit_ListComp

    def visit_DictComp(self, node: ast.DictComp) -> KnownValue:
        return self.comprehended(node.generators, [node.value], [node.key])

    def comprehended(
        self, loops: Sequence[ast.comprehension], parts: Sequence[ast.expr],
        keys: Sequence[ast.expr] = (),
    ) -> KnownValue:  # fmt: skip
        """Return what is known of a list or dict of parts; keys never change."""
        before = dict(self.frame.names)
        for loop in loops:
            over = self.visit(loop.iter)
            self.iterated(over)
            self.bind(loop.target, element(over))
            for condition in loop.ifs:
                self.condition(condition)
        for key in keys:
            self.visit(key)
        held = holder([self.visit(part) for part in parts])
        self.frame.names = before
        return held

    def iterated(self, value: KnownValue) -> None:
        # whatever is in a list is only handed on
        if not isinstance(value.known, ListOf) and not made.iterates(self.walk, value):
            check_object(value, "goes through")
