"""The blocks that come with nlctl: their records, or what their sources say of them.

To import the blocks takes seconds, to read their sources does not.
"""

from __future__ import annotations

import ast
import dataclasses
import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nlctl import errors

_GROUPS = ("plants", "actuators", "sliding", "delays", "references", "controllers")


def _modules() -> list[Any]:
    return [importlib.import_module(f"nlctl.{group}") for group in _GROUPS]


def block_records() -> dict[str, type]:
    """Return every block record of nlctl by name."""
    found = {}
    for module in _modules():
        for name in module.__all__:
            thing = getattr(module, name)
            if isinstance(thing, type) and dataclasses.is_dataclass(thing):
                found[name] = thing
    return found


def named_block(name: str) -> type:
    """Return the block record of that name."""
    from nlctl.names import unknown  # it imports python-control

    records = block_records()
    if name not in records:
        raise unknown("block", name, records)
    return records[name]


def block_summaries() -> dict[str, dict[str, str]]:
    """Return the first line of each block record's docstring: ``{group: {name: line}}``.

    The names are those of `block_records`, in the same order.
    """
    return {group: _records(group) for group in _GROUPS}


def _records(group: str) -> dict[str, str]:
    """Return the public records of a module, or of a package and the rooms in it."""
    folder = Path(errors.__file__).parent / group
    own = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    found = dict(
        line
        for path in (sorted(folder.rglob("*.py")) or [own])
        for line in _lines(ast.parse(path.read_bytes()))
    )
    return {name: found[name] for name in _public(ast.parse(own.read_bytes())) if name in found}


def _public(module: ast.Module) -> list[str]:
    """Return ``__all__``."""
    return next(
        ast.literal_eval(node.value)
        for node in module.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )


def _lines(module: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield name and summary of each class under ``@record``."""
    for node in module.body:
        if isinstance(node, ast.ClassDef) and "record" in map(ast.unparse, node.decorator_list):
            yield node.name, (ast.get_docstring(node) or "").partition("\n")[0]
