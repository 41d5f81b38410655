"""What a traced function does that no run of it on expressions can follow, in other words.

* ``try``: its body runs to the end, or the function is called instead of traced.
* ``raise`` and ``assert``: what an error would say is not made.
* ``table[k]`` of an array of integers: which one `k` chooses follows from the values.
* ``while angle > pi: angle -= 2 * pi``: how often follows from the values.
"""

from __future__ import annotations

import ast
import contextlib
import copy
import dis
import functools
import sys
from collections.abc import Callable, Mapping, Set
from types import CodeType, FunctionType
from typing import Any

from .arrays import Tracer, traced
from .effects import Notices, has_effects, is_new, written_names
from .graph import CATCHABLE, Ambiguous, Graph, Namespace, Untraceable, catchable
from .indexing import item_at
from .iterated import NOT_RETURNED, Loop, PassWriter
from .library.creation import writable, written_into
from .library.ordered import sorted_list
from .library.table import unwrapped
from .merged import INSTEAD_NAME, Merger, call_instead, is_none, names_of_choices
from .operators import elementwise
from .passes import Passes
from .promoted import is_numpys
from .source import Definition, Unreadable, codes_in, definition
from .texts import filled_in, formatted, text_of

_STEPS = {ast.Sub: (ast.Gt, ast.GtE), ast.Add: (ast.Lt, ast.LtE)}
_LEAVING = ast.Return | ast.Break | ast.Continue
_PYTHONS = IndexError | KeyError | StopIteration | ZeroDivisionError | UnboundLocalError
_UNPACKING = ("UNPACK_SEQUENCE", "UNPACK_EX")  # where there are too few values or too many
_METHODS = ("index", "sort", "format")  # of lists and texts, of which others are called
_KEYS, _ASKED_OF = (int, float, bool), {"values": "values", "__class__": "type"}
_WORDS = (ast.Try, ast.Raise, ast.Assert, ast.While, ast.Dict, ast.Subscript,
          ast.Attribute, ast.With, ast.JoinedStr, ast.MatchSingleton, ast.MatchClass,
          ast.Is, ast.IsNot)  # fmt: skip


def followable_code(function: FunctionType, merging: bool) -> CodeType:
    """Return the code of a function as it is traced: its own, if there is nothing to rewrite."""
    # With `merging` both branches of a condition are followed at once where they only compute.
    code, names = function.__code__, function.__globals__
    try:
        tree = definition(function)
    except Unreadable:
        return code
    read = ((n, names.get(n)) for part in codes_in(code) for n in part.co_names)
    named = frozenset(r for r in read if r[1] is contextlib or r[1] is contextlib.suppress)
    return _rewritten(tree, code, code.co_filename, named, merging)


@functools.lru_cache(maxsize=2048)  # equal code may stand in several files
def _rewritten(tree: Any, code: CodeType, _: str, named: Set[Any], merging: bool) -> CodeType:
    kinds = {type(node) for node in ast.walk(tree)}.intersection(_WORDS)
    if "__class__" in code.co_freevars:  # only within a class is it what it is
        _check_as_it_is(tree, kinds, merging)
    elif kinds or merging:
        body = _as_statements(copy.deepcopy(tree))
        body = _Rewriter(dict(named), written_names(body)).visit(body)
        body = Notices().visit(Merger().visit(PassWriter().visit(body))) if merging else body
        return _compiled(body, code)
    return code


def _check_as_it_is(tree: Any, kinds: Set[type], merging: bool) -> None:
    """Check that a method that calls super() has nothing to rewrite."""
    where = "a method that calls super()"
    if ast.Try in kinds or (merging and has_effects(_as_statements(copy.deepcopy(tree)))):
        raise Untraceable(f"try, or what changes something, in {where}")
    compared = [n for n in ast.walk(tree) if isinstance(n, ast.Compare)]
    asked = [n for n in compared if {*map(type, n.ops)} & {ast.Is, ast.IsNot}]
    others = [part.value if isinstance(part, ast.Constant) else ...
              for n in asked for part in n.comparators]  # fmt: skip
    is_asked = bool(asked) and (merging or any(other is not None for other in others))
    if is_asked or kinds & {ast.MatchSingleton, ast.MatchClass}:
        raise Untraceable(f"identity or a class in a pattern in {where}")


def _as_statements(tree: Definition) -> ast.FunctionDef:
    """Return a definition in statements: of a lambda that of a function which returns the same."""
    if isinstance(tree, ast.FunctionDef):
        return tree
    whole = ast.parse(f"def {_FOLLOWED}(): pass").body[0]  # it has all fields, in any Python
    assert isinstance(whole, ast.FunctionDef)
    whole.args, whole.body = tree.args, [ast.copy_location(ast.Return(tree.body), tree.body)]
    return ast.copy_location(whole, tree)


_FOLLOWED = "followed_function"


def _compiled(node: Definition, code: CodeType) -> CodeType:
    """Return the code of a definition whose free variables are those of another code."""
    outer = ast.parse(f"def outer({', '.join(code.co_freevars)}): pass").body[0]
    assert isinstance(outer, ast.FunctionDef)
    assert isinstance(node, ast.FunctionDef)
    outer.body, node.name, node.decorator_list = [node], _FOLLOWED, []  # calls itself as a global
    module = ast.fix_missing_locations(ast.Module([outer], []))
    whole = compile(module, code.co_filename, "exec", dont_inherit=True)
    inside = _inside(_inside(whole, "outer"), _FOLLOWED)
    if inside.co_freevars != code.co_freevars:
        raise Untraceable("variables of the function around it that are not read")
    return inside.replace(co_name=code.co_name, co_qualname=code.co_qualname)


def _inside(code: CodeType, name: str) -> CodeType:
    return next(c for c in code.co_consts if isinstance(c, CodeType) and c.co_name == name)


class _Rewriter(ast.NodeTransformer):
    def __init__(self, names: Mapping[str, Any], written: Set[str]) -> None:
        self.names, self.written = names, written
        self.classes: list[str] = []  # names of those in patterns

    def visit_With(self, node: ast.With) -> Any:
        """Write ``try`` for ``with suppress(...)``."""
        call = node.items[0].context_expr
        if len(node.items) > 1 or not isinstance(call, ast.Call) or not self._suppresses(call.func):
            self.generic_visit(node)
            return node
        caught = ast.ExceptHandler(ast.Tuple(call.args, ast.Load()), None, [ast.Pass()])
        return self.visit(ast.copy_location(ast.Try(node.body, [caught], [], []), node))

    def _suppresses(self, node: ast.expr) -> bool:
        """Whether a name is that of `contextlib.suppress`."""
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            of_module = self.names.get(node.value.id) is contextlib
            return of_module and node.attr == "suppress"
        return isinstance(node, ast.Name) and self.names.get(node.id) is contextlib.suppress

    def visit_JoinedStr(self, node: ast.JoinedStr) -> Any:
        """Write a text that may stay unwritten: of numbers that are only known when it runs."""
        parts = [part for part in node.values if isinstance(part, ast.FormattedValue)]
        formats = [part.format_spec or ast.Constant("") for part in parts]
        inside = [n for part in parts for n in ast.walk(part)]
        if not parts or any(isinstance(n, ast.NamedExpr | ast.Yield) for n in inside):
            return node
        pairs = [ast.Tuple([self.visit(copy.deepcopy(part.value)), form], ast.Load())
                 for part, form in zip(parts, formats, strict=True)]  # fmt: skip
        nothing = ast.arguments([], [], None, [], [], None, [])
        return call_instead("text", ast.Lambda(nothing, node), *pairs)

    def visit_Assign(self, node: ast.Assign) -> ast.stmt:
        """Make arrays that are written into take expressions, and integers what they take."""
        self.generic_visit(node)
        named = [t.id for t in node.targets if isinstance(t, ast.Name)]
        if self.written & {*named} and is_new(node.value):
            node.value = call_instead("writable", node.value)
        whole = node.targets[0].value if isinstance(node.targets[0], ast.Subscript) else None
        if isinstance(whole, ast.Name) and len(node.targets) == 1:
            node.value = call_instead("written", node.value, ast.Name(whole.id, ast.Load()))
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        """Fill numbers in a text that may stay unwritten."""
        self.generic_visit(node)
        form = node.left.value if isinstance(node.left, ast.Constant) else None
        is_text = isinstance(form, str) and isinstance(node.op, ast.Mod)
        return call_instead("filled", node.left, node.right) if is_text else node

    def visit_Try(self, node: ast.Try) -> Any:
        self.generic_visit(node)
        if any(isinstance(n, _LEAVING) for part in node.finalbody for n in ast.walk(part)):
            raise Untraceable("a way out of finally")
        for handler in node.handlers:  # none catches what ends a trace
            caught = {n.id for n in ast.walk(handler.type or handler) if isinstance(n, ast.Name)}
            if handler.type is None or "BaseException" in caught:
                handler.type = ast.Name("Exception", ast.Load())
            elif "FloatingPointError" in caught:
                raise Untraceable("NumPy's errors as errors of Python's")
        attempt = ast.With([ast.withitem(call_instead("attempt"))], node.body)
        node.body = [ast.copy_location(attempt, node)] if node.handlers else node.body
        return node

    def visit_Dict(self, node: ast.Dict) -> Any:
        self.generic_visit(node)
        numbers = [k for k in node.keys if isinstance(k, ast.Constant) and type(k.value) in _KEYS]
        return (
            call_instead("numbered", node) if node.keys and len(numbers) == len(node.keys) else node
        )

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        self.generic_visit(node)
        keys = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        names = not all(isinstance(k, ast.Constant | ast.Slice) for k in keys)
        if not (names and isinstance(node.ctx, ast.Load)):
            return node
        return call_instead("item", node.value, _key(node.slice))

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        name, _ = _ASKED_OF.get(node.attr), self.generic_visit(node)
        return call_instead(name, node.value) if name and type(node.ctx) is ast.Load else node

    def visit_Call(self, node: ast.Call) -> Any:
        if isinstance(node.func, ast.Attribute):  # a method: what it is asked of alone
            node.func.value = self.visit(node.func.value)
            func, node.func = node.func, ast.Name("method", ast.Load())
            self.generic_visit(node)
            node.func = func
        else:
            self.generic_visit(node)
        if not isinstance(node.func, ast.Attribute) or node.func.attr not in _METHODS:
            return node
        if node.func.attr == "index" and (len(node.args) != 1 or node.keywords):
            return node
        instead = call_instead(node.func.attr, node.func.value, *node.args)
        instead.keywords = node.keywords
        return instead

    def visit_MatchSingleton(self, node: ast.MatchSingleton) -> Any:
        """Write a class that True, or False, is the only object of."""
        if node.value is None:
            return node
        name = INSTEAD_NAME.format(str(node.value).lower())
        kind = ast.MatchClass(ast.Name(name, ast.Load()), [], [], [])
        return ast.copy_location(kind, node)

    def visit_Match(self, node: ast.Match) -> Any:
        """Give names to what asks as `isinstance` does, for the classes in patterns."""
        named = []
        for case in node.cases:
            for pattern in ast.walk(case.pattern):
                if isinstance(pattern, ast.MatchClass):
                    name = f"class@{len(self.classes)}"
                    asks = call_instead("class", pattern.cls)
                    self.classes.append(name)
                    named.append(ast.Assign([ast.Name(name, ast.Store())], asks))
                    pattern.cls = ast.Name(name, ast.Load())
        self.generic_visit(node)
        return [*(ast.copy_location(s, node) for s in named), node]

    def visit_Compare(self, node: ast.Compare) -> Any:
        """Ask by a function whether something is True, False, None, or another thing."""
        self.generic_visit(node)
        other = node.comparators[0]
        if not {*map(type, node.ops)} & {ast.Is, ast.IsNot}:
            return node
        if len(node.ops) > 1:
            raise Untraceable("identity among several comparisons")
        value = other.value if isinstance(other, ast.Constant) else ...
        if value is None:
            answer = call_instead("none", node.left)
        else:
            name = "truth" if type(value) is bool else "same"
            answer = call_instead(name, other, node.left)
        return answer if isinstance(node.ops[0], ast.Is) else ast.UnaryOp(ast.Not(), answer)

    def visit_Raise(self, node: ast.Raise) -> Any:
        if isinstance(node.exc, ast.Call):
            node.exc = node.exc.func
        return node

    def visit_Assert(self, node: ast.Assert) -> Any:
        node.msg = None
        return node

    def visit_While(self, node: ast.While) -> Any:
        self.generic_visit(node)
        steps = _steps(node)
        if steps is None:
            return node
        name, sign, test, step = steps
        strict = isinstance(test.ops[0], ast.Gt | ast.Lt)
        given = [ast.Name(name, ast.Load()), test.comparators[0], step,
                 ast.Constant(sign), ast.Constant(strict)]  # fmt: skip
        assigned = ast.Assign([ast.Name(name, ast.Store())], call_instead("moved", *given))
        return [ast.copy_location(assigned, node), *node.orelse]


def _steps(node: ast.While) -> tuple[str, float, ast.Compare, ast.expr] | None:
    """Return what a loop moves by equal steps, in which direction, until when, and the step."""
    test, body = node.test, node.body
    if not isinstance(test, ast.Compare) or len(test.ops) != 1 or len(body) != 1:
        return None
    if not isinstance(test.left, ast.Name):
        return None
    name, statement = test.left.id, body[0]
    if isinstance(statement, ast.AugAssign):
        target, operation, step = statement.target, statement.op, statement.value
    elif isinstance(statement, ast.Assign) and isinstance(statement.value, ast.BinOp):
        target, operation, step = statement.targets[0], statement.value.op, statement.value.right
        if len(statement.targets) != 1 or not _is(name, statement.value.left):
            return None
    else:
        return None
    moving = [n.id for part in (test.comparators[0], step) for n in ast.walk(part)
              if isinstance(n, ast.Name)]  # fmt: skip
    fits = isinstance(test.ops[0], _STEPS.get(type(operation), ()))
    if not fits or not _is(name, target) or name in moving:
        return None
    return name, 1.0 if isinstance(operation, ast.Sub) else -1.0, test, step


def _key(index: ast.expr) -> ast.expr:
    """Return an index as an expression: ``a:b`` is ``slice(a, b, None)``."""
    if isinstance(index, ast.Tuple):
        return ast.Tuple(list(map(_key, index.elts)), ast.Load())
    if not isinstance(index, ast.Slice):
        return index
    ends = (part or ast.Constant(None) for part in (index.lower, index.upper, index.step))
    return call_instead("slice", *ends)


def _is(name: str, node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == name


def names_for(graph: Graph, type_of: Any) -> dict[str, Callable[..., Any]]:
    """Return what the names stand for that a rewritten function has."""
    return names_of_choices(graph) | {
        INSTEAD_NAME.format("numbered"): NumberKeys,
        INSTEAD_NAME.format("type"): type_of,
        INSTEAD_NAME.format("attempt"): functools.partial(_Attempt, graph),
        INSTEAD_NAME.format("moved"): functools.partial(_moved, graph),
        INSTEAD_NAME.format("item"): functools.partial(item_at, graph),
        INSTEAD_NAME.format("slice"): slice,
        INSTEAD_NAME.format("writable"): functools.partial(writable, graph),
        INSTEAD_NAME.format("written"): functools.partial(written_into, graph),
        INSTEAD_NAME.format("loop"): lambda: Loop(graph, is_raised),
        INSTEAD_NAME.format("same"): lambda a, b: _behind(a) is _behind(b),
        INSTEAD_NAME.format("class"): _pattern_type,
        INSTEAD_NAME.format("passes"): lambda: Passes(graph),
        INSTEAD_NAME.format("text"): text_of,
        INSTEAD_NAME.format("format"): formatted,
        INSTEAD_NAME.format("filled"): filled_in,
        INSTEAD_NAME.format("index"): _index,
        INSTEAD_NAME.format("truth"): functools.partial(_is_truth, graph),
        INSTEAD_NAME.format("nothing"): lambda: NOT_RETURNED,
        INSTEAD_NAME.format("none"): functools.partial(is_none, graph),
        INSTEAD_NAME.format("true"): _TruthType(graph, True),
        INSTEAD_NAME.format("false"): _TruthType(graph, False),
        INSTEAD_NAME.format("sort"): functools.partial(sorted_list, graph),
        INSTEAD_NAME.format("values"): lambda v: v if isinstance(v, Tracer) else v.values,
    }


class _Attempt:
    """The body of a ``try``: an error of Python's is raised and caught, on a way of its own."""

    def __init__(self, graph: Graph) -> None:
        self.graph, self.guards = graph, len(graph.guards)

    def __enter__(self) -> None:
        self.graph.attempts += 1

    def __exit__(self, kind: object, error: BaseException | None, *_: object) -> None:
        self.graph.attempts -= 1
        if isinstance(error, Exception) and not is_raised(error):
            raise Unfollowed from error
        if len(self.graph.guards) > self.guards:
            raise Unfollowed from Untraceable("try around what may raise an error")


class Unfollowed(BaseException):
    """What ends a trace, whatever a traced function catches."""


def is_raised(error: BaseException) -> bool:
    """Whether an error is one that a traced function raises itself, or that Python raises in it."""
    if isinstance(error, Untraceable | Ambiguous):
        return False
    if CATCHABLE in vars(error):
        return True
    place = error.__traceback__
    while place is not None and place.tb_next is not None:
        place = place.tb_next
    if place is None or place.tb_frame.f_globals.get("__builtins__") is None:
        return False
    code = place.tb_frame.f_code
    is_staged = isinstance(place.tb_frame.f_globals["__builtins__"], Namespace)
    is_staged |= code in (item_at.__code__, NumberKeys.__getitem__.__code__)
    raises = dis.opname[code.co_code[place.tb_lasti]] in ("RAISE_VARARGS", *_UNPACKING)
    return is_staged and (raises or isinstance(error, _PYTHONS) or "NoneType" in str(error))


def _index(whole: Any, value: Any) -> Any:
    """Return where a list has a value: each place is asked in turn."""
    if type(whole) not in (list, tuple) or not any(isinstance(v, Tracer) for v in (*whole, value)):
        return whole.index(value)
    for k, v in enumerate(whole):
        if v is value or v == value:
            return k
    raise catchable(ValueError)


def _is_truth(graph: Graph, value: bool, thing: Any) -> bool:
    """Return whether a thing is True, or is False: a truth value of NumPy's is neither."""
    if not isinstance(thing, Tracer):
        return thing is value
    is_parameter = not thing.shape and thing.only.op == "leaf" and thing.only.data[0] == "p"
    if not is_parameter and (thing.shape or thing.only.kind != "b" or is_numpys(graph, thing)):
        return False
    if not thing.is_pythons:
        raise Untraceable("identity of what may be Python's True or NumPy's")
    return bool(thing) is value


class _TruthType(type):
    """A class for patterns, of which True or False is the only object."""

    def __new__(cls, graph: Graph, value: bool) -> Any:
        return super().__new__(cls, str(value), (), {"of": (graph, value)})

    def __init__(cls, *_: object) -> None:
        super().__init__(cls)

    def __instancecheck__(cls, thing: Any) -> bool:
        return _is_truth(*cls.of, thing)  # type: ignore[attr-defined]


class _PatternType(type):
    """A class for patterns, of which is what a traced function's `isinstance` says."""

    def __new__(cls, kind: Any, is_one: Callable[..., bool]) -> Any:
        real = unwrapped(kind)
        plain = real if real in _OF_THEMSELVES else int if real is bool else object
        given: dict[str, Any] = {"asked": (is_one, kind)}
        if plain is object:
            given["__match_args__"] = getattr(real, "__match_args__", ())
        return super().__new__(cls, "Pattern", (plain,), given)

    def __init__(cls, *_: object) -> None:
        super().__init__(cls)

    def __instancecheck__(cls, thing: Any) -> bool:
        is_one, kind = cls.asked  # type: ignore[attr-defined]
        return is_one(thing, kind)


def _behind(value: Any) -> Any:
    """Return the class or object that something stands for."""
    return getattr(unwrapped(value), "__dict__", {}).get("_real", unwrapped(value))


def _pattern_type(kind: Any) -> Any:
    """Return what stands for a class in a pattern, with what is `isinstance` where it is asked."""
    return _PatternType(kind, sys._getframe(1).f_builtins["isinstance"])


# whose patterns have the object itself in brackets: ``case float(value)``
_OF_THEMSELVES = (float, int, str, list, tuple, dict, set, frozenset, bytes)


class NumberKeys(dict[Any, Any]):
    """A dict of numbers: what it has for a key that is only known when it runs."""

    def __getitem__(self, key: object) -> Any:
        if not isinstance(key, Tracer):
            return super().__getitem__(key)
        known = functools.reduce(lambda a, b: a | b, (_is_key(key, k) for k in self))
        key.graph.guard(known.only, KeyError)
        return self._chosen(key, next(reversed(self.values())))

    def get(self, key: object, default: object = None) -> Any:
        """Return what it has for a key, or a default."""
        return self._chosen(key, default) if isinstance(key, Tracer) else super().get(key, default)

    def _chosen(self, key: Tracer, choice: object) -> Any:
        numbers = all(isinstance(v, int | float | Tracer) for v in (*self.values(), choice))
        if key.shape or not all(isinstance(k, _KEYS) for k in self):
            raise Untraceable("a key that is only known when it runs")
        if not numbers:
            return next((value for k, value in self.items() if _is_key(key, k)), choice)
        for k, value in reversed(self.items()):
            choice = elementwise(key.graph, "select", _is_key(key, k), value, choice)
        return choice


def _is_key(key: Tracer, k: object) -> Tracer:
    return elementwise(key.graph, "eq", key, k)


def _moved(graph: Graph, value: Any, limit: Any, step: Any, sign: float, strict: bool) -> Any:
    """Return what is left of a value from which steps are taken as long as it is beyond a limit."""
    if not any(isinstance(v, Tracer) for v in (value, limit, step)):
        while sign * value > sign * limit or (not strict and value == limit):
            value = value - sign * step
        return value
    given = [traced(graph, v) for v in (value, limit, step)]
    if any(v.is_array for v in given) or given[0].only.kind != "f":
        raise Untraceable("a loop whose end depends on what is computed")
    op = functools.partial(elementwise, graph)
    beyond = "gt" if sign > 0 else "lt"
    beyond = beyond if strict else {"gt": "ge", "lt": "le"}[beyond]
    distance = op("mul", sign, op("sub", value, limit))
    count = op("ceil", op("div", distance, step))
    rest = op("sub", value, op("mul", sign, op("mul", count, step)))
    more, less = op("sub", rest, op("mul", sign, step)), op("add", rest, op("mul", sign, step))
    rest = op("select", op(beyond, rest, limit), more, op("select", op(beyond, less, limit), rest,
                                                          less))  # fmt: skip
    endless = op("select", op("gt", step, 0.0), rest, float("nan"))
    return op("select", op(beyond, value, limit), endless, value)
