"""Make the integrators' bitcode that is shipped: ``python -m nlctl.native.ship``.

To be run after every change of the integrators' sources, before it is committed; it takes some
twenty seconds.  Until then the new sources are compiled by numba on each machine, and a test of
the everyday suite fails.
"""

import ast
import hashlib
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import llvmlite.binding as llvm
import numba

from ..host.files import replace_file
from .integrators import HERE, SHIPPED, WANTED, sources_key
from .machine.export import exported

# files, and what counts of them: "" for everything
_ROOTS = [(f"integrate/{name}.py", "") for name in ("advance", "start", "workspace")]
_ROOTS += [("machine/export.py", "exported")]


def ship(path: Path = SHIPPED) -> None:
    """Write the bitcode, with what it was made of, to a file."""
    files, code = source_files(), exported(WANTED)
    header = {
        "sources": sources_key(files),
        "files": files,
        "code": hashlib.sha256(code).hexdigest(),
        "llvm": list(llvm.llvm_version_info),
        "numba": numba.__version__,
    }
    replace_file(path, lambda file: file.write(json.dumps(header).encode() + b"\n" + code))


def source_files() -> list[str]:
    """Return the files of nlctl that the integrators' bitcode is made of, and by."""
    # Of files elsewhere only what is imported counts, and what that is made of.
    read, parts = cache(_read), [*_ROOTS]
    for name, part in parts:  # which grows meanwhile
        whole = name.startswith("integrate/")
        parts += [
            other
            for other in dict.fromkeys(_made_of(read(HERE / name), "" if whole else part))
            if other not in parts
        ]
    return sorted({name for name, _ in parts})


@dataclass(frozen=True, kw_only=True)
class _File:
    """What a file of nlctl imports, and what each of its statements gives a value and reads."""

    place: str
    imported: Mapping[str, tuple[str, str]]  # by its name here, the file and its name there
    statements: Sequence[tuple[set[str], set[str]]]


def _read(path: Path) -> _File:
    """Return what stands in a file."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    return _File(
        place=Path(os.path.relpath(path, HERE)).as_posix(),
        imported=dict(_imports(path, body)),
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
    every = list(ast.walk(node))
    notes = [getattr(n, field, None) for n in every for field in ("annotation", "returns")]
    aside = {id(part) for note in notes if note is not None for part in ast.walk(note)}
    named = (n for n in every if isinstance(n, ast.Name) and id(n) not in aside)
    names = {n.id for n in named if isinstance(n.ctx, kind)}
    return names | ({getattr(node, "name", "")} if kind is ast.Store else set())


def _imports(path: Path, body: list[ast.stmt]) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield what a file imports from files of nlctl: its name here, the file and its name there."""
    for node in (n for statement in body for n in ast.walk(statement)):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.parents[node.level - 1]
            inner = folder / (node.module or "").replace(".", "/")
            for each in node.names:
                module, file = inner / f"{each.name}.py", inner.with_suffix(".py")
                place = module if module.exists() else file
                if place.exists() and place.is_relative_to(HERE.parent):
                    there = Path(os.path.relpath(place, HERE)).as_posix()
                    yield each.asname or each.name, (there, "" if place is module else each.name)


if __name__ == "__main__":
    ship(*map(Path, sys.argv[1:]))
