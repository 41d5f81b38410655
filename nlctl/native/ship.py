"""Make the integrators' bitcode that is shipped: ``python -m nlctl.native.ship``.

To be run after every change of the integrators' sources, before it is committed; it takes some
twenty seconds.  Until then the new sources are compiled by numba on each machine, and a test of
the everyday suite fails.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import llvmlite.binding as llvm
import numba

from ..host.files import replace_file
from .integrators import HERE, SHIPPED, WANTED, sources_key
from .machine.export import exported


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


def source_files(*modules: str) -> list[str]:
    """Return the files of the engine that modules are made of: themselves and what they import."""
    # By default those of the integrators.
    found = [*(modules or ("integrate/advance.py", "integrate/start.py", "integrate/workspace.py"))]
    for name in found:  # which grows meanwhile; what others import from elsewhere is not compiled
        imported = () if name.startswith("..") else _imported(HERE / name)
        found += [other for other in dict.fromkeys(imported) if other not in found]
    return sorted(found)


def _imported(path: Path) -> Iterator[str]:
    """Yield the files of nlctl that a file of the engine imports, by their paths from there."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.parents[node.level - 1]
            inner = folder / (node.module or "").replace(".", "/")
            files = [inner / f"{each.name}.py" for each in node.names]
            files += [inner.with_suffix(".py")] if node.module else []
            yield from (
                Path(os.path.relpath(file, HERE)).as_posix()
                for file in files
                if file.exists() and file.is_relative_to(HERE.parent)
            )


if __name__ == "__main__":
    ship(*map(Path, sys.argv[1:]))
