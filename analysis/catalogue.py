"""The blocks that come with nlctl, and the functions that make some: what their sources say.

To import the blocks takes seconds, to read their sources does not.
"""

import ast
import dataclasses
import functools
import importlib
from pathlib import Path
from typing import Any

from nlctl.host.checkout import NLCTL_FOLDER
from nlctl.host.rooms import face, public_names

_GROUPS = (
    "plants",
    "actuators",
    "sliding",
    "delays",
    "references",
    "sources",
    "controllers",
    "observers",
)
_OF_FUNCTIONS = (*_GROUPS, "sampling", "faults")


def block_records() -> dict[str, type]:
    """Return every block record of nlctl by name."""
    records = {}
    for module in (importlib.import_module(f"nlctl.{group}") for group in _GROUPS):
        for name in module.__all__:
            thing = getattr(module, name)
            if isinstance(thing, type) and dataclasses.is_dataclass(thing):
                records[name] = thing
    return records


def named_block(name: str) -> type:
    """Return the block record of that name."""
    from nlctl.names import check_known  # it imports python-control

    records = block_records()
    check_known("block", name, records)
    return records[name]


def block_summaries() -> dict[str, dict[str, str]]:
    """Return the first line of each block record's docstring: ``{group: {name: line}}``."""
    # The names are those of `block_records`, in the same order.
    return {group: _summaries(group, ast.ClassDef) for group in _GROUPS}


def function_summaries() -> dict[str, dict[str, str]]:
    """Return the first line of each function that makes blocks: ``{group: {name: line}}``."""
    summaries = {group: _summaries(group, ast.FunctionDef) for group in _OF_FUNCTIONS}
    return {group: lines for group, lines in summaries.items() if lines}


def paper_summaries() -> dict[str, str]:
    """Return the first line of each paper's module: ``{name: line}``."""
    summaries = {}
    for name in public_names("papers"):
        module = Path(NLCTL_FOLDER, "papers", f"{name}.py")
        said = ast.get_docstring(ast.parse(module.read_bytes())) or ""
        summaries[name] = said.partition("\n")[0]
    return summaries


def making_function(name: str) -> Any:
    """Return the function of that name, which `function_summaries` has."""
    (group,) = (group for group, lines in function_summaries().items() if name in lines)
    return getattr(importlib.import_module(f"nlctl.{group}"), name)


@functools.cache
def _summaries(group: str, kind: type[ast.ClassDef | ast.FunctionDef]) -> dict[str, str]:
    """Return the functions or the records of the public names of a module, or a package."""
    summaries = {
        node.name: (ast.get_docstring(node) or "").partition("\n")[0]
        for path in (sorted(Path(NLCTL_FOLDER, group).rglob("*.py")) or [Path(face(group))])
        for node in ast.parse(path.read_bytes()).body
        if isinstance(node, kind)
        if kind is ast.FunctionDef or "record" in map(ast.unparse, node.decorator_list)
    }
    return {name: summaries[name] for name in public_names(group) if name in summaries}
