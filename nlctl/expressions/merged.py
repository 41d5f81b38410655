"""Branches that only compute numbers, followed both at once instead of one way after the other.

Eight saturations in a row are 256 ways through a function, and eight choices: a function that has
too many ways is traced once more in these words.  Where more happens in a branch than numbers and
elements that are assigned, it is followed one way after the other as before.
"""

from __future__ import annotations

import ast
import copy
import functools
from collections.abc import Callable, Sequence
from typing import Any, TypeGuard

import numpy as np

from .arrays import Tracer, mapped, python_number, scalar, traced
from .graph import Expr, Graph, Untraceable
from .operators import elementwise

INSTEAD_NAME = "{}@traced"  # of what stands for statements: no name that anybody has
QUESTIONS = ("truth", "none")  # what is asked by functions instead of ``is``
_BINDING = (ast.NamedExpr, ast.Yield, ast.YieldFrom, ast.Await)
_SHARING = (ast.Global, ast.Nonlocal, ast.Yield, ast.YieldFrom, ast.Await)
_MOST_PARTS = 400  # of a value that is written out of those before
_Values = dict[str, tuple[ast.expr, ast.expr]]  # of what is assigned: where, and what


class Merger(ast.NodeTransformer):
    """Writes choices instead of branches."""

    def __init__(self) -> None:
        self.count = 0

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        """Return a choice at the end of a function that returns early."""
        shared = any(isinstance(n, _SHARING) for n in ast.walk(node))
        for k in [] if shared else reversed(range(len(node.body))):
            first = node.body[k]
            if _leaves(first) and (value := _returned(node.body[k:])) is not None:
                node.body[k:] = [ast.copy_location(ast.Return(value), first)]
        self.generic_visit(node)
        return ast.fix_missing_locations(node)

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        """Write ``choice(c, lambda: a, lambda: b)`` for ``a if c else b``."""
        self.generic_visit(node)
        if _binds(node):
            return node
        return call_instead("choice", truth_test(node.test), later(node.body), later(node.orelse))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        """Ask comparisons without a decision; of other values one of them is the result."""
        self.generic_visit(node)
        asks = all(map(_is_question, node.values)) and not _binds(node)
        return truth_test(node) if asks else node

    def visit_If(self, node: ast.If) -> Any:
        """Assign what a choice returns; None says that the branches are followed as they are."""
        if not node.orelse and isinstance(node.body[0], ast.Raise) and not _binds(node.test):
            node.test = call_instead("fails", truth_test(node.test))
            return node
        if (appended := _appended([node])) is not None:
            return self.visit(ast.copy_location(ast.Expr(appended), node))
        values = _of_branches(copy.deepcopy(node))
        self.generic_visit(node)
        if values is None or _binds(node):
            return node
        self.count += 1
        test, result = (f"{name}@{self.count}" for name in ("test", "result"))
        question = ast.Assign([ast.Name(test, ast.Store())], truth_test(node.test))
        node.test = ast.Name(test, ast.Load())
        targets = [target for target, _, _ in values]
        branches = [ast.Tuple([v[k] for v in values], ast.Load()) for k in (1, 2)]
        branches = [self.visit(copy.deepcopy(b)) for b in branches]
        picked = call_instead("choices", node.test, *map(later, branches))
        is_missing = ast.Compare(ast.Name(result, ast.Load()), [ast.Is()], [ast.Constant(None)])
        stored = ast.Assign([ast.Tuple(targets, ast.Store())], ast.Name(result, ast.Load()))
        whole = [question, ast.Assign([ast.Name(result, ast.Store())], picked),
                 ast.If(is_missing, [node], [stored])]  # fmt: skip
        return [ast.copy_location(ast.fix_missing_locations(_placed(s, node)), node) for s in whole]


def _is_question(node: ast.expr) -> bool:
    """Whether the value of an expression is True or False."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return _is_question(node.operand)
    asked = [INSTEAD_NAME.format(name) for name in (*QUESTIONS, "logic")]
    by_name = isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    return isinstance(node, ast.Compare) or (by_name and node.func.id in asked)  # type: ignore[union-attr]


def _binds(node: ast.AST) -> bool:
    """Whether an expression gives somebody's variable a value, which others may read."""
    binding = (n for n in ast.walk(node) if isinstance(n, _BINDING))
    return not all(isinstance(n, ast.NamedExpr) and "@" in n.target.id for n in binding)


def _leaves(node: ast.stmt) -> TypeGuard[ast.If]:
    """Whether a branch may return."""
    return isinstance(node, ast.If) and any(isinstance(n, ast.Return) for n in ast.walk(node))


def _returned(body: Sequence[ast.stmt]) -> ast.expr | None:
    """Return what statements return, a choice where they do so early; None if they do more."""
    first = body[0] if body else None
    if first is None or isinstance(first, ast.Return):
        return first and first.value
    if _leaves(first):
        yes, no = _returned(first.body), _returned([*first.orelse, *body[1:]])
        if yes is None or no is None:
            return None
        return ast.copy_location(ast.IfExp(first.test, yes, no), first)
    values, rest = _one(first), _returned(body[1:])
    if rest is None or not values or any(isinstance(t, ast.Subscript) for t, _ in values.values()):
        return None
    return _after(values, rest, first)


def _after(values: _Values, rest: ast.expr, like: ast.stmt) -> ast.expr | None:
    """Return ``(y@2 := a, b)[-1]`` for what follows y = a: b reads y by that name."""
    rest = copy.deepcopy(rest)
    inside = list(ast.walk(rest))
    bound = {n.arg for n in inside if isinstance(n, ast.arg)}
    bound |= {n.id for n in inside if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    if bound & values.keys():
        return None
    names = {name: f"{name}@of{len(inside)}" for name in values}
    for node in inside:
        if isinstance(node, ast.Name):
            node.id = names.get(node.id, node.id)
    parts: list[ast.expr] = [
        ast.NamedExpr(ast.Name(names[name], ast.Store()), value)
        for name, (_, value) in values.items()
    ]
    last = ast.UnaryOp(ast.USub(), ast.Constant(1))
    whole = ast.Subscript(ast.Tuple([*parts, rest], ast.Load()), last, ast.Load())
    return ast.copy_location(whole, like)


def _appended(body: Sequence[ast.stmt]) -> ast.Call | None:
    """Return what appends to one list, whichever branch is taken; None if there is more."""
    only = body[0] if len(body) == 1 else None
    if isinstance(only, ast.Expr) and isinstance(only.value, ast.Call):
        call = only.value
        plain = len(call.args) == 1 and not call.keywords
        adds = isinstance(call.func, ast.Attribute) and call.func.attr == "append"
        return call if plain and adds else None
    if not isinstance(only, ast.If):
        return None
    yes, no = _appended(only.body), _appended(only.orelse)
    if yes is None or no is None or ast.dump(yes.func) != ast.dump(no.func):
        return None
    return ast.Call(yes.func, [ast.IfExp(only.test, yes.args[0], no.args[0])], [])


def _placed(statement: ast.stmt, like: ast.AST) -> ast.stmt:
    for part in ast.walk(statement):
        if "lineno" in part._attributes and not hasattr(part, "lineno"):
            ast.copy_location(part, like)
    return statement


def _of_branches(node: ast.If) -> list[tuple[ast.expr, ast.expr, ast.expr]] | None:
    """Return what is assigned, and what in either branch; None if there is more than that."""
    yes, no = _assigned(node.body), _assigned(node.orelse)
    if yes is None or no is None or not (yes or no):
        return None
    result = []
    for name in dict.fromkeys([*yes, *no]):
        target = (yes.get(name) or no[name])[0]
        same = _as_read(target)
        result.append((target, yes.get(name, (None, same))[1], no.get(name, (None, same))[1]))
    return result


def _assigned(body: Sequence[ast.stmt]) -> _Values | None:
    values: _Values = {}
    for statement in body:
        if isinstance(statement, ast.Pass):
            continue
        more = _one(statement)
        read = {n.id for _, v in (more or {}).values() for n in ast.walk(v)
                if isinstance(n, ast.Name)}  # fmt: skip
        written = {n.id for t, _ in values.values() for n in ast.walk(t) if isinstance(n, ast.Name)}
        elements = any(isinstance(t, ast.Subscript) for t, _ in values.values())
        if more is not None and read & written:
            more = _of_values_before(more, values)
        if more is None or elements:
            return None
        values |= more
    return values


def _of_values_before(more: _Values, values: _Values) -> _Values | None:
    """Return what is assigned later in a branch, of what names have had before; None if unsure."""
    scopes = ast.Lambda | ast.ListComp | ast.GeneratorExp | ast.SetComp | ast.DictComp
    later_on: _Values = {}
    for name, (target, value) in more.items():
        inlined = _Inlined(values)
        whole = inlined.visit(copy.deepcopy(value))
        parts = list(ast.walk(whole))
        scoped = any(isinstance(n, scopes) for n in ast.walk(value))
        if not inlined.is_sure or scoped or len(parts) > _MOST_PARTS:
            return None
        later_on[name] = target, whole
    return later_on


class _Inlined(ast.NodeTransformer):
    """Writes for names the values that they have, where these may be computed again."""

    def __init__(self, values: _Values) -> None:
        self.values, self.is_sure = values, True

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id not in self.values:
            return node
        value = copy.deepcopy(self.values[node.id][1])
        calls = [n.func for n in ast.walk(value) if isinstance(n, ast.Call)]
        self.is_sure &= all(map(_only_computes, calls))
        return value


def _only_computes(function: ast.expr) -> bool:
    """Whether calling a function again changes nothing, by its name."""
    if isinstance(function, ast.Attribute):
        return isinstance(function.value, ast.Name) and function.value.id in ("np", "math")
    names = ("abs", "min", "max", "float", "int")
    names += tuple(map(INSTEAD_NAME.format, ("number", "item", "written")))
    return isinstance(function, ast.Name) and function.id in names


def _one(statement: ast.stmt) -> _Values | None:
    if isinstance(statement, ast.If):
        parts = _of_branches(statement)
        if parts is None:
            return None
        return {ast.unparse(t): (t, ast.IfExp(statement.test, a, b)) for t, a, b in parts}
    if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
        target, value = statement.targets[0], statement.value
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):  # a, b = c, d
            return _at_once(target.elts, value.elts)
    elif isinstance(statement, ast.AugAssign):
        target = statement.target
        before = _as_read(target)
        if isinstance(target, ast.Name):
            before = call_instead("number", before)
        value = ast.BinOp(before, statement.op, statement.value)
    else:
        return None
    plain = isinstance(target, ast.Name | ast.Subscript)
    return {ast.unparse(target): (target, value)} if plain else None


def _at_once(targets: Sequence[ast.expr], values: Sequence[ast.expr]) -> _Values | None:
    """Return what is assigned to several names at once; None if there is more than that."""
    names = [ast.unparse(t) for t in targets if isinstance(t, ast.Name)]
    if len(set(names)) != len(targets) or len(values) != len(targets):
        return None
    return dict(zip(names, zip(targets, values, strict=True), strict=True))


def _as_read(target: Any) -> ast.expr:
    """Return the expression that reads what is assigned to."""
    same = copy.deepcopy(target)
    same.ctx = ast.Load()
    return same


def truth_test(test: ast.expr) -> ast.expr:
    """Return a test whose parts are asked without a decision, where that is possible."""
    if isinstance(test, ast.BoolOp):
        kind = ast.Constant("and" if isinstance(test.op, ast.And) else "or")
        return call_instead("logic", kind, *(later(truth_test(v)) for v in test.values))
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return call_instead("opposite", truth_test(test.operand))
    if isinstance(test, ast.Compare) and len(test.ops) > 1:
        sides = [test.left, *test.comparators]
        pairs: list[ast.expr] = [
            ast.Compare(sides[i], [op], [sides[i + 1]]) for i, op in enumerate(test.ops)
        ]
        return truth_test(ast.BoolOp(ast.And(), pairs))
    return test


def later(value: ast.expr) -> ast.Lambda:
    """Return a function of an expression."""
    nothing = ast.arguments([], [], None, [], [], None, [])
    return ast.Lambda(nothing, value)


def call_instead(name: str, *given: ast.expr) -> ast.Call:
    """Return the call of what stands for statements."""
    return ast.Call(ast.Name(INSTEAD_NAME.format(name), ast.Load()), list(given), [])


# -- what is written instead of branches -----------------------------------------------------------


def names_of_choices(graph: Graph) -> dict[str, Callable[..., Any]]:
    """Return what the names stand for that `Merger` writes."""
    functions = {"choice": _choice, "choices": _choices, "logic": _logic, "opposite": _opposite,
                 "fails": _fails, "number": _number, "changes": _changes,
                 "uses_up": _uses_up}  # fmt: skip
    return {INSTEAD_NAME.format(k): functools.partial(f, graph) for k, f in functions.items()}


def _choices(graph: Graph, test: object, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """Return what either branch assigns, by a condition that is not known; None if it is."""
    condition = _open(graph, test)
    if condition is None:
        return None
    guards = len(graph.guards)
    try:
        one = _under(graph, condition, True, yes)
        other = _under(graph, condition, False, no)
        return tuple(chosen(graph, condition, a, b) for a, b in zip(one, other, strict=True))
    except Exception:  # of the branch that is not taken, or no numbers
        del graph.guards[guards:]
        return None


def _choice(graph: Graph, test: object, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """Return ``yes() if test else no()``."""
    both = _choices(graph, test, lambda: (yes(),), lambda: (no(),))
    if both is None:
        return yes() if test else no()
    return both[0]


def _number(_: Graph, value: Any) -> Any:
    """Return a number, which another replaces; an array would change under all its names."""
    there = value.where_there() if isinstance(value, Tracer) else np.asarray(value)
    if there.shape or (isinstance(there, Tracer) and there.is_array):
        raise Untraceable("an array that is changed where a condition holds")
    return value


def _fails(graph: Graph, test: object) -> Any:
    """Return whether an error is raised, False where that is only known when it runs."""
    condition = _open(graph, test)
    if condition is None or graph.attempts:
        return test
    graph.guard(graph.op("not", condition), RuntimeError)
    return False


def _logic(graph: Graph, kind: str, *parts: Callable[[], Any]) -> Any:
    """Return whether all or any of several hold, asked one after the other."""
    value = parts[0]()
    for part in parts[1:]:
        value = _with(graph, kind, value, part)
    return value


def _with(graph: Graph, kind: str, value: object, part: Callable[[], Any]) -> Any:
    ask = lambda: (truth_value(graph, part()),)  # noqa: E731
    if kind == "and":
        both = _choices(graph, value, ask, lambda: (False,))
        return both[0] if both else value and part()
    either = _choices(graph, value, lambda: (True,), ask)
    return either[0] if either else value or part()


def _changes(graph: Graph, what: object = None) -> None:
    """Refuse what changes more than a branch where both are followed."""
    is_number = isinstance(what, bool | int | float | np.generic | str) or (
        isinstance(what, Tracer) and not what.shape and not what.is_array
    )
    if (graph.branches or graph.passing) and not is_number:
        raise Untraceable("a branch that changes what others see")


def _uses_up(graph: Graph, values: Any) -> Any:
    """Return what a loop goes through, unless it is used up in a branch."""
    if hasattr(values, "__next__"):
        _changes(graph)
    return values


def _opposite(graph: Graph, value: object) -> Any:
    """Return ``not value``."""
    condition = _open(graph, value)
    return not value if condition is None else elementwise(graph, "not", truth_value(graph, value))


def truth_value(graph: Graph, value: object) -> Any:
    """Return the truth of a number."""
    number, nowhere = _whether_missing(graph, value)
    assert number is not None
    if nowhere.op != "const":
        there = scalar(graph, graph.op("not", nowhere))
        return elementwise(graph, "and", there, truth_value(graph, number))
    return number if number.only.kind == "b" else elementwise(graph, "ne", number, 0.0)


def _open(graph: Graph, test: object) -> Expr | None:
    """Return a condition that is not known, and not decided on this path."""
    if not isinstance(test, Tracer) or test.shape:
        return None
    condition = truth_value(graph, test).only
    known = condition.op == "const" or condition in graph.implied or condition in graph.decisions
    return None if known or condition.value is not None else condition


def _under(graph: Graph, condition: Expr, holds: bool, branch: Callable[[], Any]) -> Any:
    """Return what a branch computes; errors that it may raise matter only where it is taken."""
    before = len(graph.guards)
    graph.branches += 1
    try:
        values = branch()
    finally:
        graph.branches -= 1
    for k in range(before, len(graph.guards)):
        elsewhere = graph.op("not", condition) if holds else condition
        graph.guards[k] = graph.op("or", elsewhere, graph.guards[k])
    return values


def chosen(graph: Graph, condition: Expr, one: object, other: object) -> Any:
    """Return one number or array where a condition holds, another elsewhere."""
    if one is other:
        return one
    (a, a_missing), (b, b_missing) = (_whether_missing(graph, v) for v in (one, other))
    a, b = _nothing_like(b) if a is None else a, _nothing_like(a) if b is None else b
    if a is None or b is None or a.shape != b.shape:
        raise Untraceable("branches with something else than numbers")
    kinds = {e.kind for v in (a, b) for e in v.values.flat}
    is_part = any(v.axis is not None or v.origin is not None for v in (a, b))
    if is_part or (len(kinds) > 1 and ("b" in kinds or a.shape)):
        raise Untraceable("branches with something else than numbers")
    result = elementwise(graph, "select", scalar(graph, condition), a, b)
    if a.shape:  # another array: what is assigned to any of them is not followed
        result.watched = (*a.watched, *b.watched, a.watch(), b.watch())
    elif len(kinds) > 1:
        graph.mixed.add(result.only)
    if a.is_box is not False or b.is_box is not False:
        result.is_box = None
    missing = graph.op("select", condition, a_missing, b_missing)
    result.missing = None if missing.op == "const" and not missing.data else missing
    return result


def _whether_missing(graph: Graph, value: object) -> tuple[Tracer | None, Expr]:
    """Return what is chosen, None if it is nothing yet, and where it is None."""
    if value is None:
        return None, graph.const(True)
    array = traced(graph, value)
    return array.where_there(), array.missing or graph.const(False)


def _nothing_like(array: Tracer | None) -> Any:
    """Return NaN in the shape of an array, in place of None."""
    if array is None or any(e.kind == "b" for e in array.values.flat):
        return None
    number = array.graph.const(0 if all(e.kind == "i" for e in array.values.flat) else np.nan)
    return Tracer(array.graph, mapped(lambda _: number, array.values), array.axis, array.length)


def is_none(graph: Graph, value: object) -> Any:
    """Return whether something is None, which a choice may be in some places."""
    if isinstance(value, Tracer) and value.missing is not None:
        return python_number(graph, value.missing)
    return value is None
