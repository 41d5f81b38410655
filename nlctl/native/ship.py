"""Make the integrators' bitcode that is shipped: ``python -m nlctl.native.ship``.

To be run after every change of the integrators' sources, before it is committed; it takes some
fifteen seconds.  Until then the new sources are compiled by numba on each machine, and a test of
the everyday suite fails.
"""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

import llvmlite.binding as llvm
import numba

from ..host.files import replace_file
from ._integrators import HERE, SHIPPED, WANTED, sources_key
from .codegen.export import exported


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


def source_files(first: str = "_integrate.py") -> list[str]:
    """Return the files of this folder that a module is made of: itself and all that it imports."""
    found = [first]
    for name in found:  # which grows meanwhile
        found += [other for other in dict.fromkeys(_imported(HERE / name)) if other not in found]
    return sorted(found)


def _imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            modules = [node.module] if node.module else [each.name for each in node.names]
            yield from (f"{module.replace('.', '/')}.py" for module in modules)


if __name__ == "__main__":
    ship()
