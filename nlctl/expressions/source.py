"""The syntax tree of a function, if it is certainly that of the code that runs.

A file may have been edited since it was imported, a function may have been made by ``exec`` or
rewritten by a tool.  So the text is compiled once more, and the function's code must be in what
comes out: the text as a whole, or, as notebooks and galleries do it, its statements cell by cell.
Nothing here depends on the names of bytecode instructions.
"""

from __future__ import annotations
import __future__

import ast
import functools
import linecache
import warnings
from collections.abc import Iterator
from types import CellType, CodeType, FunctionType
from typing import Any, cast

Definition = ast.FunctionDef | ast.Lambda
Places = dict[tuple[str, int], list[Definition]]
_ByCode = dict[CodeType, list[Definition]]
_NAMED = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)
_LOOPS = ("<listcomp>", "<setcomp>", "<dictcomp>", "<genexpr>")  # code of its own in some Pythons

_FUTURES = functools.reduce(
    int.__or__, (getattr(__future__, name).compiler_flag for name in __future__.all_feature_names)
)


def codes_in(code: CodeType) -> Iterator[CodeType]:
    """Yield a code object, and those nested in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from codes_in(constant)


def in_cell(cell: CellType, empty: object = None) -> Any:
    """Return what is in the cell of a closure, something else if it is not filled."""
    try:
        return cell.cell_contents
    except ValueError:
        return empty


def cells_of(function: FunctionType) -> dict[str, CellType]:
    """Return the cells of what a function closes over, by name."""
    return dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))


class Unreadable(Exception):  # noqa: N818 (it says what is the matter with a source)
    """The source of a function cannot be had."""

    def __init__(self, reason: str, advice: str) -> None:
        super().__init__(reason)
        self.advice = advice  # what to do; the message says why


def definition(function: FunctionType) -> Definition:
    """Return the syntax tree of a function."""
    code = function.__code__
    file, text = _file_and_text(function)
    if not text:
        raise Unreadable("its source cannot be found", "define it in a file or a notebook")
    try:
        module = text, file, code.co_flags & _FUTURES
        places, codes, by_code = _compiled(*module)
    except (SyntaxError, ValueError) as error:
        raise Unreadable(f"its source cannot be parsed ({error})", "mend its file") from error
    if code not in codes and code not in _by_cells(*module, code.co_firstlineno):
        advice = "import its module again: was the file edited since?"
        if code.co_filename == "<string>":
            advice = "define it in a file: it was made of a text, as by exec"
        raise Unreadable("its source is not what it was made of", advice)
    if code not in by_code:
        by_code[code] = [node for node in _candidates(places, code) if _contains(node, code)]
    nodes = by_code[code]
    if not nodes or (len(nodes) > 1 and len(set(map(ast.dump, nodes))) > 1):
        advice = "give each function a line of its own"
        raise Unreadable("its source cannot be distinguished from others on the same line", advice)
    return nodes[0]


def source_file(function: FunctionType) -> str:
    """Return the name of the file, or the cell of a notebook, that a function stands in."""
    return _file_and_text(function)[0]


def is_dispatcher(thing: object) -> bool:
    """Whether a function is one of `functools.singledispatch`."""
    return isinstance(thing, FunctionType) and thing.__code__ is _DISPATCHER


_DISPATCHER = cast(FunctionType, functools.singledispatch(abs)).__code__


def _file_and_text(function: FunctionType) -> tuple[str, str]:
    """Return where a function stands, and what stands there: "" where nothing is found."""
    # Functions that cloudpickle has made again do not know their file; their globals do.
    named = function.__code__.co_filename
    for file in (named, str(function.__globals__.get("__file__", named))):
        linecache.checkcache(file)
        if text := "".join(linecache.getlines(file, function.__globals__)):
            return file, text
    return named, ""


@functools.lru_cache(maxsize=128)
def _compiled(text: str, file: str, flags: int) -> tuple[Places, frozenset[CodeType], _ByCode]:
    """Return the functions of a module by their names and first lines, and all code inside it.

    With a place for the functions by their code.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python has said once what it thinks of this text
        tree = _Private().visit(ast.parse(text, file))
        module = compile(text, file, "exec", flags=flags, dont_inherit=True)
    places: Places = {}
    for node in ast.walk(tree):
        if isinstance(node, Definition):
            places.setdefault((_name(node), _first_line(node)), []).append(node)
    return places, frozenset(codes_in(module)), {}


class _Private(ast.NodeTransformer):
    """Gives private names within a class, as self.__gain, those that Python knows them by."""

    owner = ""

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        before, self.owner = self.owner, node.name.lstrip("_")
        self.generic_visit(node)
        self.owner = before
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        node.id = self._whole(node.id)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        node.attr = self._whole(node.attr)
        return self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.arg = self._whole(node.arg)
        return self.generic_visit(node)

    def _whole(self, name: str) -> str:
        is_private = self.owner and name.startswith("__") and not name.endswith("__")
        return f"_{self.owner}{name}" if is_private else name


@functools.lru_cache(maxsize=128)
def _by_cells(text: str, file: str, flags: int, line: int) -> frozenset[CodeType]:
    """Return all code of the statements on a line, however the text was divided into cells."""
    # The code of a statement depends on its neighbours in one thing: attributes of names that the
    # same cell imports are read by another instruction. So it is compiled with each run of imports
    # that could stand in its cell.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        body = ast.parse(text, file).body
        codes: set[CodeType] = set()
        for place, statement in enumerate(body):
            if isinstance(statement, ast.ImportFrom) and statement.module == "__future__":
                continue
            if _first_line(statement) <= line <= (statement.end_lineno or line):
                for neighbours in _runs(body[:place], body[place + 1 :]):
                    cell = ast.Module([*neighbours, statement], type_ignores=[])
                    code = compile(cell, file, "exec", flags=flags, dont_inherit=True)
                    codes |= set(codes_in(code))
    return frozenset(codes)


def _runs(before: list[ast.stmt], after: list[ast.stmt]) -> Iterator[list[ast.stmt]]:
    """Yield the statements with imports that share a cell: the last before, the first after."""
    before, after = ([s for s in part if _imports(s)] for part in (before, after))
    for first in range(len(before) + 1):
        for last in range(len(after) + 1):
            yield [*before[first:], *after[:last]]


def _imports(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.ImportFrom) and statement.module == "__future__":
        return False  # it is among the flags, and must stand first
    return any(isinstance(node, ast.Import | ast.ImportFrom) for node in ast.walk(statement))


def _first_line(node: ast.stmt | ast.expr) -> int:
    """Return the line on which a statement or function begins, with its decorators."""
    return min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])


def _candidates(places: Places, code: CodeType) -> Iterator[Definition]:
    """Yield the functions that begin on this line, with this name and these functions inside."""
    inside = sorted(c.co_name for c in list(codes_in(code))[1:] if c.co_name not in _LOOPS)
    arguments = code.co_varnames[: code.co_argcount]
    for node in places.get((code.co_name, code.co_firstlineno), ()):
        if tuple(a.arg for a in node.args.posonlyargs + node.args.args) == arguments:
            body = node.body if isinstance(node.body, list) else [node.body]
            nested = (n for part in body for n in ast.walk(part))
            if sorted(_name(n) for n in nested if isinstance(n, _NAMED)) == inside:
                yield node


def _name(node: ast.AST) -> str:
    return getattr(node, "name", "<lambda>")


def _contains(node: Definition, code: CodeType) -> bool:
    """Whether all instructions of a code lie within a node, as far as they say where they lie."""
    first = (node.lineno, node.col_offset)
    if isinstance(node, ast.FunctionDef):
        first = (code.co_firstlineno, 0)  # with its decorators
    last = (node.end_lineno or node.lineno, node.end_col_offset or 0)
    for line, end_line, column, end_column in code.co_positions():
        if line is None or end_line is None or column is None or end_column is None:
            continue
        if column == end_column:  # bookkeeping at the beginning, of no place
            continue
        if (line, column) < first or (end_line, end_column) > last:
            return False
    return True
