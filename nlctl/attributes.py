"""Records of results: what a field is stands next to it, and docstrings have it from there.

A comment behind a field, or above it, is its entry in the section Attributes; ``# (m,): times``
begins with a shape.  Fields without one that have the type of the field before share its entry.
A function that returns such a record, and has no section Returns, has the record's first sentence.
"""

import ast
import dataclasses
import functools
import inspect
import io
import re
import sys
import textwrap
import tokenize
from collections.abc import Callable, Mapping
from typing import Any, Literal, TypeVar, dataclass_transform, get_args, get_origin, overload

_T = TypeVar("_T", bound=type)
_F = TypeVar("_F", bound=Callable[..., Any])
_PARAMETERS = "Parameters\n----------\n"
_MODULES = {"np": "", "pd": "pandas.", "ct": "control.", "Any": "object"}
_SHAPE = re.compile(r"(\([\w, ()+.*-]*\))(?:: |$)(.*)", re.DOTALL)
_SECTION = re.compile(r"^\w+\n-+$", re.M)


@overload
def described_record(cls: _T, /) -> _T: ...
@overload
def described_record(
    *, made_by: str = "", eq: bool = True, repr: bool = True
) -> Callable[[_T], _T]: ...
@dataclass_transform(
    frozen_default=True, kw_only_default=True, field_specifiers=(dataclasses.field,)
)
def described_record(cls: Any = None, /, *, made_by: str = "", **options: bool) -> Any:
    """Return a frozen dataclass of a class, made by name, whose docstring describes its fields.

    For an example it refers to the function that makes such a record, if that is named.
    """
    if cls is None:
        return functools.partial(described_record, made_by=made_by, **options)
    cls = dataclasses.dataclass(frozen=True, kw_only=True, **options)(cls)
    example = f"\n\nExamples\n--------\nSee `{made_by}`." if made_by else ""
    cls.__doc__ = _Docstring(inspect.cleandoc(cls.__doc__ or "") + example)
    return cls


def with_returned(function: Any) -> str | None:
    """Return the docstring of a function, with the section Returns for a described record."""
    text, name = inspect.cleandoc(function.__doc__ or ""), function.__annotations__.get("return")
    name = getattr(name, "__name__", name)  # of a class, or its name
    docstring = vars(function.__globals__.get(name, object)).get("__doc__")
    if not text or not isinstance(docstring, _Docstring) or "Returns\n---" in text:
        return function.__doc__
    summary = docstring.text.partition("\n\n")[0]
    section = f"Returns\n-------\n{name}\n    {summary}"
    return _with_section(text, section, after_parameters=True)


def with_parameters_of(other: object) -> Callable[[_F], _F]:
    """Return a decorator: parameters that a docstring does not describe are as another one has."""
    # `other` is a function, or a docstring.

    def completed(function: _F) -> _F:
        described = other if isinstance(other, str) else other.__doc__
        text, others = (inspect.cleandoc(one or "") for one in (function.__doc__, described))
        if text:
            known = _parameters(others) | _parameters(text)
            names = inspect.signature(function).parameters
            entries = dict.fromkeys(known[name] for name in names if name in known)
            head, _, rest = text.partition(_PARAMETERS)
            behind = _SECTION.search(rest)
            others = head + (rest[behind.start() :] if behind else "")
            function.__doc__ = _with_section(others, _PARAMETERS + "\n".join(entries))
        return function

    return completed


def _parameters(text: str) -> dict[str, str]:
    """Return the entries of a section Parameters, by the names that they describe."""
    section = _SECTION.split(text.partition(_PARAMETERS)[2])[0].strip()
    entries = re.split(r"\n(?=\S)", section)
    return {name.strip(" *"): e for e in entries for name in e.partition(" : ")[0].split(",")}


class _Docstring:
    """A docstring that is completed when somebody reads it."""

    def __init__(self, text: str) -> None:
        self.text, self.whole = text, ""

    def __get__(self, instance: object, owner: type) -> str:
        if not self.whole:
            entries = "\n".join(_entry(*row) for row in _rows(owner))
            section = f"Attributes\n----------\n{entries}" if entries else ""
            self.whole = _with_section(self.text, section)
        return self.whole


def _with_section(text: str, section: str, *, after_parameters: bool = False) -> str:
    """Return a docstring with one more section in front of the others, but for Parameters."""
    starts = [heading.start() for heading in _SECTION.finditer(text)]
    has_parameters = text[starts[0] :].startswith("Parameters") if starts else False
    at = [*starts, len(text)][int(after_parameters and has_parameters)]
    parts = text[:at], section, text[at:]
    return "\n\n".join(part.strip() for part in parts if part)


def entries_by_field(cls: type) -> dict[str, list[str]]:
    """Return the lines that describe fields with a comment, by the first field of each entry.

    The names in front of the first colon are those of all fields of the entry.
    """
    rows = [(names.split(", ")[0], names, kind, text) for names, kind, text in _rows(cls)]
    return {first: _entry(*row).splitlines() for first, *row in rows if row[2]}


def _entry(names: str, kind: str, text: str) -> str:
    return f"{names} : {kind}\n{textwrap.indent(textwrap.fill(text, 90), '    ')}".rstrip()


def _rows(cls: type) -> list[list[str]]:
    """Return names, type and text of each entry of a class's own fields."""
    comments, classes = _read(cls.__module__)
    names = vars(sys.modules.get(cls.__module__, object))
    entries: list[list[str]] = []
    for node in classes.get(cls.__qualname__, ()):
        lines, above = [comments.get(node.end_lineno, "")], node.lineno - 1
        while not lines[0] and above in comments and comments[above].startswith("\n"):
            lines[1:1] = [comments[above][1:]]
            above -= 1
        name, text = node.target.id, " ".join(filter(None, lines))
        shape = _SHAPE.match(text)
        kind = _kind(node.annotation, names) + (f" of shape {shape[1]}" if shape else "")
        kind += ", optional" if _has_default(node) else ""
        if entries and not text and entries[-1][1].partition(" of shape")[0] == kind:
            entries[-1][0] += f", {name}"
        else:
            entries.append([name, kind, shape[2] if shape else text])
    return entries


@functools.cache
def _read(module: str) -> tuple[dict[int, str], dict[str, list[Any]]]:
    """Return a module's comments by line, those alone in one after "\\n", and fields by class."""
    try:
        source = inspect.getsource(sys.modules[module])
    except (OSError, TypeError, KeyError):  # installed without it, or typed in
        return {}, {}
    comments = {}
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not token.string.startswith(("# type:", "# noqa")):
            alone = "\n" * token.line.lstrip().startswith("#")
            comments[token.start[0]] = alone + token.string.lstrip("# ")
    fields = {
        node.name: [
            field
            for field in node.body
            if isinstance(field, ast.AnnAssign)
            and not ast.unparse(field.target).startswith("_")
            and not _is_parameter(field)
        ]
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ClassDef)
    }
    return comments, fields


def _is_parameter(node: ast.AnnAssign) -> bool:
    """Whether `nlctl.param` says what a field is."""
    return isinstance(node.value, ast.Call) and ast.unparse(node.value.func).endswith("param")


def _has_default(node: ast.AnnAssign) -> bool:
    """Whether a field has one; ``field(...)`` alone is none."""
    words = {word.arg for word in getattr(node.value, "keywords", ())}
    is_field = isinstance(node.value, ast.Call) and ast.unparse(node.value.func) == "field"
    return node.value is not None and (not is_field or bool(words & {"default", "default_factory"}))


def _kind(node: Any, names: Mapping[str, Any]) -> str:
    """Return an annotation in numpydoc's words."""
    match node:
        case ast.BinOp(left=left, right=right):
            return f"{_kind(left, names)} or {_kind(right, names)}"
        case ast.Subscript(value=ast.Name(id="Literal"), slice=ast.Tuple(elts=values)):
            return f"{{{', '.join(map(ast.unparse, values))}}}".replace("'", '"')
        case ast.Subscript(value=ast.Name(id="tuple"), slice=ast.Tuple(elts=[of, last])) if (
            isinstance(last, ast.Constant)
        ):
            return f"tuple of {_kind(of, names)}"
        case ast.Subscript(value=ast.Name(id="tuple"), slice=ast.Tuple(elts=parts)):
            return f"({', '.join(_kind(part, names) for part in parts)})"
        case ast.Subscript(value=ast.Name(id="Sequence" | "list" as many), slice=of):
            return f"{many.lower()} of {_kind(of, names)}"
        case ast.Subscript(value=value):
            return _kind(value, names)
        case ast.Attribute(value=ast.Name(id=module), attr=name):
            return f"{_MODULES.get(module, f'{module}.')}{name}"
        case ast.Name(id="Mapping" | "Callable" as name):
            return name.lower()
        case ast.Name(id=name) if get_origin(names.get(name)) is Literal:
            return f"{{{', '.join(map(repr, get_args(names[name])))}}}".replace("'", '"')
    text = ast.unparse(node)
    return _MODULES.get(text, text)
