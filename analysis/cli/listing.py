"""What there is: blocks, examples, kinds of analysis, and those of one's own."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from nlctl.errors import ParameterError

from ..catalogue import block_summaries, named_block

if TYPE_CHECKING:
    from ..studies.kind import Kind

__all__ = ["show", "show_all"]

_KINDS = "kinds"
HELP = """
nlctl list NAME shows the parameters of a block, nlctl list kinds the
kinds of analysis of a study, nlctl list file.py:NAME one of your own."""


def show_all() -> None:
    """Print the blocks in groups, one line each, and the examples."""
    console = Console()
    groups = block_summaries()
    width = max(len(name) for group in groups.values() for name in group)
    for title, lines in groups.items():
        _show_group(title.capitalize(), lines, width)
    console.print("[bold]Examples[/bold]\n  example-1 (dead zone), example-2 (backlash)")
    console.print(HELP, highlight=False)


def show(name: str) -> None:
    """Print the parameters of a block, the keys of a kind of analysis, or the kinds."""
    if ":" in name:
        from ..studies.resolve import named

        return _show(name, named(name, Path.cwd()))
    blocks = [block for group in block_summaries().values() for block in group]
    if name in blocks:
        return _show_block(name, named_block(name))
    from ..studies.kinds import KINDS as STUDIED  # takes a second

    kinds = {kind.name: kind for kind in STUDIED}
    if name == _KINDS:
        lines = {name: _plain(kind.answers) for name, kind in kinds.items()}
        return _show_group("Kinds of analysis", lines, max(map(len, lines)))
    if name not in kinds:
        from nlctl.names import unknown

        raise unknown("block", name, [*blocks, *kinds, _KINDS])
    return _show_kind(name, kinds[name])


def _show(name: str, thing: Any) -> None:
    """Print one block or one kind."""
    from ..studies.kind import Kind

    if isinstance(thing, Kind):
        _show_kind(name, thing)
    elif isinstance(thing, type) and dataclasses.is_dataclass(thing):
        _show_block(name, thing)
    else:
        raise ParameterError(
            f"list shows a block's record or a kind of analysis, '{name}' is a "
            f"{type(thing).__name__}"
        )


def _show_group(title: str, lines: dict[str, str], width: int) -> None:
    console = Console()
    console.print(f"[bold]{title}[/bold]", highlight=False)
    for name, told in lines.items():
        console.print(Text(f"  {name:<{width}}  {told}"), no_wrap=True, overflow="ellipsis")


def _show_block(name: str, record: type) -> None:
    """Print the parameter table of a block."""
    import numpy as np

    from nlctl.params import declared_params

    table = Table("parameter", "default", "unit", "bounds", "meaning", title=None)
    defaults = {f.name: f.default for f in dataclasses.fields(record)}
    for field, rule in declared_params(record).items():
        default = np.asarray(defaults[field])
        text = str(defaults[field]) if default.size <= 4 else f"{default.shape} values"
        table.add_row(field, text, rule.unit, rule.bounds, rule.meaning)
    _show_table(name, _summary(record), table)


def _show_kind(name: str, kind: Kind) -> None:
    """Print the keys of a kind's table in a study file."""
    table = Table("key", "default", "meaning", title=None)
    for key, field in kind.schema.model_fields.items():
        if key != "kind":
            default = "needed" if field.is_required() else repr(field.default)
            table.add_row(key, default, field.description or "")
    told = f"{_plain(kind.answers)}; claim: {_plain(kind.claims)}" if kind.claims else kind.answers
    _show_table(name, told or kind.title, table)


def _show_table(name: str, told: str, table: Table) -> None:
    console = Console()
    console.print(Text.assemble((name, "bold"), f"  {told}"))
    if table.row_count:
        console.print(table)


def _plain(markdown: str) -> str:
    return markdown.replace("`", "")


def _summary(record: type) -> str:
    return (record.__doc__ or "").strip().splitlines()[0]
