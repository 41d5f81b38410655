"""Notices of what a function changes that it has not made itself, for branches followed at once.

Where both branches of a condition are followed, each does all that it calls.  What that changes,
a list of somebody, an object, a variable of a function around it, it must change in one of them
alone: so whatever may, says so, and the branches are then followed one way after the other.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from .merged import INSTEAD_NAME, call_instead

# methods that change what they are of, functions that change what they are given
CHANGING = {"append", "extend", "insert", "pop", "remove", "clear", "sort", "reverse", "update",
            "setdefault", "popitem", "add", "discard", "fill", "put", "itemset", "resize",
            "partition", "setfield", "setflags", "at", "appendleft", "extendleft", "popleft",
            "rotate"}  # fmt: skip
WRITERS = {"copyto", "put", "place", "putmask", "fill_diagonal", "put_along_axis", "insort",
           "insort_left", "insort_right", "heappush", "heappop", "heapify", "heapreplace",
           "heappushpop"}  # fmt: skip
IN_PLACE = {"setitem", "delitem", "iadd", "isub", "imul", "itruediv", "ifloordiv", "imod",
            "ipow", "imatmul", "iand", "ior", "ixor", "iconcat", "ilshift", "irshift"}  # fmt: skip
_NOTICED = CHANGING | WRITERS | IN_PLACE | {
    "next", "send", "setattr", "delattr", "__setitem__", "__setattr__", "__delitem__", "__iadd__"
}  # fmt: skip
_MAKERS = {"zeros", "ones", "empty", "eye", "full", "identity", "array", "copy", "zeros_like",
           "ones_like", "empty_like", "full_like", "list", "dict", "set", "deque", "arange",
           "astype", INSTEAD_NAME.format("writable")}  # fmt: skip
_DISPLAYS = (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.SetComp, ast.BinOp,
             ast.Constant, ast.UnaryOp)  # fmt: skip
_BEGINNING = ("__init__", "__post_init__")


class Notices(ast.NodeTransformer):
    """Writes a notice before whatever may change what the call has not made."""

    def __init__(self) -> None:
        self.scopes: list[tuple[set[str], set[str], str]] = []
        self.count = 0

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        """Walk a function with the names of what it makes, and those of others that it binds."""
        inside = list(_of_scope(node))
        shared = {n for s in inside if isinstance(s, ast.Global | ast.Nonlocal) for n in s.names}
        first = node.args.args[0].arg if node.args.args and node.name in _BEGINNING else ""
        self.scopes.append((_made_in(inside) - shared, shared, first))
        self.generic_visit(node)
        self.scopes.pop()
        return node

    def visit_Lambda(self, node: ast.Lambda) -> ast.Lambda:
        """Walk a function of an expression: it makes nothing under a name."""
        self.scopes.append((set(), set(), ""))
        self.generic_visit(node)
        self.scopes.pop()
        return node

    def visit_Assign(self, node: ast.Assign | ast.Delete) -> list[ast.stmt]:
        """Notice where something else than a variable of the call is bound."""
        return self._noticed(node, any(map(self._changes, node.targets)))

    visit_Delete = visit_Assign

    def visit_AnnAssign(self, node: ast.AnnAssign) -> list[ast.stmt]:
        """Notice where something else than a variable of the call is bound."""
        return self._noticed(node, node.value is not None and self._changes(node.target))

    def visit_AugAssign(self, node: ast.AugAssign) -> list[ast.stmt]:
        """Notice where an array is changed under all its names."""
        name = node.target.id if isinstance(node.target, ast.Name) else ""
        built, shared, _ = self.scopes[-1]
        if not name or name in shared:
            return self._noticed(node, self._changes(node.target))
        return self._noticed(node, name not in built, ast.Name(name, ast.Load()))

    def visit_For(self, node: ast.For) -> list[ast.stmt]:
        """Notice where a loop binds something else than variables, or uses up an iterator."""
        whole = self._noticed(node, self._changes(node.target))
        if isinstance(node.iter, ast.Name):
            node.iter = ast.copy_location(call_instead("uses_up", node.iter), node.iter)
        return whole

    def visit_NamedExpr(self, node: ast.NamedExpr) -> ast.expr:
        """Notice where a variable of a function around is bound."""
        self.generic_visit(node)
        if self._changes(node.target):
            self.count += 1
            node.value = _after_notice(node.value)
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Notice calls that change what they are called with, by their names."""
        self.generic_visit(node)
        by_attribute = isinstance(node.func, ast.Attribute)
        name = node.func.attr if by_attribute else getattr(node.func, "id", "")  # type: ignore[attr-defined]
        base = node.func.value if isinstance(node.func, ast.Attribute) else None
        is_made = isinstance(base, ast.Name) and base.id in self.scopes[-1][0]
        writes = name in _NOTICED and not is_made
        if writes or any(k.arg == "out" for k in node.keywords):
            self.count += 1
            node.func = ast.copy_location(_after_notice(node.func), node.func)
        return node

    def _changes(self, target: ast.expr) -> bool:
        """Whether binding a target changes more than variables, and parts of what is made here."""
        built, shared, first = self.scopes[-1]
        if isinstance(target, ast.Tuple | ast.List):
            return any(map(self._changes, target.elts))
        if isinstance(target, ast.Starred):
            return self._changes(target.value)
        if isinstance(target, ast.Name):
            return target.id in shared
        base = target.value if isinstance(target, ast.Subscript | ast.Attribute) else None
        of_self = isinstance(target, ast.Attribute) and isinstance(base, ast.Name)
        return not (isinstance(base, ast.Name) and (
            (of_self and base.id == first) or (not of_self and base.id in built)))  # fmt: skip

    def _noticed(self, node: ast.stmt, changes: bool, *what: ast.expr) -> list[ast.stmt]:
        self.generic_visit(node)
        if not changes:
            return [node]
        self.count += 1
        notice = ast.copy_location(ast.Expr(call_instead("changes", *what)), node)
        return [ast.fix_missing_locations(notice), node]


def has_effects(node: ast.FunctionDef) -> bool:
    """Whether a function may change what it has not made; its tree is changed."""
    notices = Notices()
    notices.visit(node)
    return notices.count > 0


def _after_notice(value: ast.expr) -> ast.expr:
    """Return a value behind a notice."""
    pair = ast.Tuple([call_instead("changes"), value], ast.Load())
    last = ast.Subscript(pair, ast.Constant(1), ast.Load())
    return ast.fix_missing_locations(ast.copy_location(last, value))


def _of_scope(node: ast.FunctionDef) -> Iterator[ast.AST]:
    """Yield all nodes of a function, not those of functions and classes inside."""
    waiting: list[ast.AST] = list(node.body)
    while waiting:
        part = waiting.pop()
        yield part
        if not isinstance(part, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            waiting.extend(ast.iter_child_nodes(part))


def _made_in(nodes: list[ast.AST]) -> set[str]:
    """Return names that are bound to nothing but what a function makes itself."""
    built, others = set(), set()
    places = set[int]()
    for node in nodes:
        for target, value in _pairs(node):
            if isinstance(target, ast.Name) and is_new(value):
                built.add(target.id)
                places.add(id(target))
        if isinstance(node, ast.AugAssign):
            places.add(id(node.target))
    for node in nodes:
        if (
            isinstance(node, ast.Name)
            and isinstance(node.ctx, ast.Store)
            and id(node) not in places
        ):
            others.add(node.id)
    return built - others


def _pairs(node: ast.AST) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield what an assignment binds, each with its value; nothing of other statements."""
    for target in node.targets if isinstance(node, ast.Assign) else ():
        value = node.value  # type: ignore[attr-defined]
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            yield from zip(target.elts, value.elts, strict=False)
        else:
            yield target, value


def written_names(tree: ast.AST) -> set[str]:
    """Return the names of what a function writes items into."""
    items = [n.value for n in ast.walk(tree) if isinstance(n, ast.Subscript)
             and isinstance(n.ctx, ast.Store)]  # fmt: skip
    return {whole.id for whole in items if isinstance(whole, ast.Name)}


def is_new(value: ast.expr) -> bool:
    """Whether a value is one that nobody else has a name of."""
    if isinstance(value, ast.Call):
        function = value.func
        name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
        return name in _MAKERS and not any(k.arg == "copy" for k in value.keywords)
    return isinstance(value, _DISPLAYS)
