"""Make the bitcode that is shipped: ``python -m nlctl.native.ship``.

To be run after every change of what it is made of, before that is committed; what still fits is not
made again.  Until then the new sources are compiled by numba on each machine, and a test of the
everyday suite fails.
"""

import ast
import hashlib
import inspect
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path, PurePosixPath

import llvmlite.binding as llvm
import numba

from ..host.checkout import file_of_nlctl
from ..host.files import replace_file
from .machine.export import exported
from .machine.machine_code import Wanted
from .machine.shipped import Shipped, bitcode, sources_key

SHIPPED = (
    "nlctl.native.integrators:INTEGRATORS",
    "nlctl.native.enclosures.search:BOX_SEARCH",
    "nlctl.native.tubes.tube:TUBES",
    "nlctl.analysis.metrics.compiled:SAMPLE_FUNCTIONS",
)
_MADE_BY = ("native/machine/export.py", "exported")  # a file, and what counts of it


def group_by_name(name: str) -> Shipped:
    """Return one of `SHIPPED`."""
    module, _, place = name.partition(":")
    return getattr(import_module(module), place)


def ship(group: Shipped, path: Path) -> None:
    """Write the bitcode, with what it was made of."""
    files, code = source_files(group), exported(group.wanted)
    header = {
        "sources": sources_key(files),
        "files": files,
        "code": hashlib.sha256(code).hexdigest(),
        "llvm": list(llvm.llvm_version_info),
        "numba": numba.__version__,
    }
    content = json.dumps(header).encode() + b"\n" + code
    replace_file(path, lambda file: file.write(content))


def source_files(group: Shipped) -> list[str]:
    """Return the files of nlctl that bitcode is made of, and by."""
    # Of a file only what is named counts, and what that is made of, but for those that count whole
    # and their neighbours.
    whole = tuple(str(PurePosixPath(name).parent) for name in group.whole)
    parts = [*((name, "") for name in group.whole), *map(_place, group.wanted), _MADE_BY]
    read = cache(_read)
    for name, part in parts:  # which grows meanwhile
        named = "" if name.startswith(whole) else part
        parts += [o for o in dict.fromkeys(_made_of(read(name), named)) if o not in parts]
    return sorted({name for name, _ in parts})


def _place(wanted: Wanted) -> tuple[str, str]:
    """Return in which file a function is, and its name there."""
    function = inspect.unwrap(wanted.function)
    _, _, module = function.__module__.partition(".")
    return f"{module.replace('.', '/')}.py", function.__name__


@dataclass(frozen=True, kw_only=True)
class _File:
    """What a file of nlctl imports, and what each of its statements gives a value and reads."""

    place: str
    imported: Mapping[str, tuple[str, str]]  # by its name here, the file and its name there
    statements: Sequence[tuple[set[str], set[str]]]


def _read(place: str) -> _File:
    """Return what stands in a file."""
    body = ast.parse(file_of_nlctl(place).read_text(encoding="utf-8")).body
    return _File(
        place=place,
        imported=dict(_imports(PurePosixPath(place), body)),
        statements=[(_names_in(node, ast.Store), _names_in(node, ast.Load)) for node in body],
    )


def _made_of(file: _File, part: str) -> Iterator[tuple[str, str]]:
    """Yield by file and name what a file of nlctl imports, or what one name in it is made of."""
    if not part:
        yield from file.imported.values()
        return
    for name in {part}.union(*(reads for gives, reads in file.statements if part in gives)):
        if name in file.imported:
            yield file.imported[name]
        elif any(name in gives for gives, _ in file.statements):
            yield file.place, name


def _names_in(node: ast.AST, kind: type[ast.expr_context]) -> set[str]:
    """Return the names that a statement reads, annotations aside, or that it gives a value."""
    if kind is ast.Store and isinstance(node, ast.FunctionDef | ast.ClassDef):
        return {node.name}  # not what is inside of it
    every = list(ast.walk(node))
    notes = [getattr(n, field, None) for n in every for field in ("annotation", "returns")]
    # a decorator without arguments is taken off before a function is compiled
    notes += [d for d in getattr(node, "decorator_list", ()) if isinstance(d, ast.Name)]
    aside = {id(part) for note in notes if note is not None for part in ast.walk(note)}
    named = (n for n in every if isinstance(n, ast.Name) and id(n) not in aside)
    return {n.id for n in named if isinstance(n.ctx, kind)}


def _imports(place: PurePosixPath, body: list[ast.stmt]) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield what a file imports from files of nlctl: its name here, the file and its name there."""
    for node in (n for statement in body for n in ast.walk(statement)):
        if not isinstance(node, ast.ImportFrom):
            continue
        names = (node.module or "").split(".") if node.module else []
        if node.level:
            inner = place.parents[node.level - 1].joinpath(*names)
        elif names[0] == "nlctl":
            inner = PurePosixPath(*names[1:])
        else:
            continue
        for each in node.names:
            module, file = inner / f"{each.name}.py", inner.with_suffix(".py")
            there = module if file_of_nlctl(str(module)).exists() else file
            if file_of_nlctl(str(there)).exists():
                yield each.asname or each.name, (str(there), "" if there is module else each.name)


def _main(names: Sequence[str]) -> None:
    """Make what no longer fits, or one of `SHIPPED`, in its place or as another file."""
    # Each in a process of its own: of what one has compiled, also of numba's own functions, numba
    # has no more than the optimised code for the next.
    if names:
        group = group_by_name(names[0])
        ship(group, Path(*names[1:]) if names[1:] else group.path)
        return
    for name in SHIPPED:
        if bitcode(group_by_name(name)) is None:
            subprocess.run([sys.executable, "-m", "nlctl.native.ship", name], check=True)


if __name__ == "__main__":
    _main(sys.argv[1:])
