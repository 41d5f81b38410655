"""What there is: blocks, examples, kinds of analysis, and those of one's own."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from nlctl.errors import ParameterError, UsageError

from ..catalogue import (
    block_summaries,
    function_summaries,
    making_function,
    named_block,
    paper_summaries,
)

if TYPE_CHECKING:
    from ..studies.kind import Kind

_KINDS, _CONTROLLERS = "kinds", "controllers"
_WIDEST = 120  # characters of a table that no terminal shows
HELP = """
nlctl list NAME shows signals and parameters of a block, or the arguments of a
function, nlctl list controllers which controller is for which plant, nlctl list
kinds the kinds of analysis of a study, nlctl list file.py:NAME one of your own."""


def show_all() -> None:
    """Print the blocks and the functions that make some in groups, and the examples."""
    console = _console()
    groups = {title: dict(lines) for title, lines in block_summaries().items()}
    for title, lines in function_summaries().items():
        groups.setdefault(title, {}).update({f"{name}()": line for name, line in lines.items()})
    width = max(len(name) for group in groups.values() for name in group)
    for title, lines in groups.items():
        _show_group(title.capitalize(), lines, width)
    console.print("[bold]Examples[/bold]\n  example-1 (dead zone), example-2 (backlash)")
    _show_group("Papers", paper_summaries(), width)
    console.print(HELP, highlight=False)


def show(name: str) -> None:
    """Print a block, a function that makes some, a kind of analysis, the kinds or controllers."""
    if ":" in name:
        from ..studies.resolve import named

        return _show(name, named(name, Path.cwd()))
    if name == _CONTROLLERS:
        return _show_controllers()
    blocks = [block for group in block_summaries().values() for block in group]
    functions = [function for group in function_summaries().values() for function in group]
    known = {entry.lower(): entry for entry in (*functions, *blocks)}
    name = known.get(name.removesuffix("()").lower(), name)
    if name in blocks:
        return _show_block(name, named_block(name))
    if name in functions:
        return _show_function(name, making_function(name))
    if (key := name.replace("-", "_")) in paper_summaries():
        return _show_paper(key)
    from ..studies.kinds import KINDS as STUDIED  # takes a second

    kinds = {kind.name: kind for kind in STUDIED}
    if name == _KINDS:
        lines = {name: _plain(kind.answers) for name, kind in kinds.items()}
        return _show_group("Kinds of analysis", lines, max(map(len, lines)))
    if name not in kinds:
        from nlctl.names import unknown

        papers = paper_summaries()
        names = [*blocks, *functions, *kinds, *papers, _KINDS, _CONTROLLERS]
        raise unknown("block", name, names)
    return _show_kind(name, kinds[name])


def _console() -> Console:
    """Return the terminal; where lines are read by something else, they are not cut."""
    console = Console()
    return console if console.is_terminal else Console(width=_WIDEST)


def _show(name: str, thing: object) -> None:
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
    console = _console()
    console.print(f"[bold]{title}[/bold]", highlight=False)
    for name, summary in lines.items():
        line = Text(f"  {name:<{width}}  {summary}")
        cut = {"no_wrap": True, "overflow": "ellipsis"} if console.is_terminal else {}
        console.print(line, soft_wrap=not console.is_terminal, **cut)


def _show_controllers() -> None:
    """Print which controller is for which plant."""
    from ..controller_guide import GUIDES, rows_of

    console = _console()
    for guide in GUIDES:
        console.print(f"[bold]{guide.name}[/bold]", highlight=False)
        for key, text in rows_of(guide).items():
            console.print(Text(f"  {key:<9} {text}"), soft_wrap=True)


def _show_block(name: str, record: type) -> None:
    """Print the parameter table of a block."""
    import numpy as np

    from nlctl.params import declared_params

    table = Table("parameter", "default", "unit", "bounds", "meaning", title=None)
    defaults = {f.name: f.default for f in dataclasses.fields(record)}
    for field, rule in declared_params(record).items():
        default = np.asarray(defaults[field])
        text = str(defaults[field]) if default.size <= 4 else f"{default.shape} values"
        table.add_row(field, *map(Text, (text, rule.unit, rule.bounds, rule.meaning)))
    _show_table(name, _summary(record), table, _signals(record))


def _signals(record: type) -> str:
    """Return what a block takes and outputs with its own parameters, if it has such."""
    try:
        spec = record()
        states = f"; states {', '.join(spec.states)}" if spec.states else ""
        return f"({', '.join(spec.inputs)}) -> ({', '.join(spec.outputs)}){states}"
    except (UsageError, TypeError):
        return ""


def _show_paper(key: str) -> None:
    """Print the examples of a paper, and what makes its page."""
    module = import_module(f"nlctl.papers.{key}")
    table = Table("example", "what it is", title=None)
    for name in module.__all__:
        if name.startswith("example_"):
            call = f"nlctl.papers.{key}.{name}()"
            table.add_row(Text(call), Text(_summary(getattr(module, name))))
    _show_table(key, f"{_summary(module)}  Its page: nlctl report {key}", table)


def _show_function(name: str, function: Callable[..., Any]) -> None:
    """Print the arguments of a function that makes blocks, and what signals these have."""
    table = Table("argument", "default", "meaning", title=None)
    meanings = _documented_arguments(inspect.getdoc(function) or "")
    rows: dict[tuple[str, str], list[str]] = {}
    for key, argument in inspect.signature(function).parameters.items():
        default = "needed" if argument.default is argument.empty else repr(argument.default)
        rows.setdefault((default, meanings.get(key) or key), []).append(key)
    for (default, meaning), keys in rows.items():
        table.add_row(
            ", ".join(keys), Text(default), Text("" if meaning in keys else _plain(meaning))
        )
    _show_table(f"{name}()", _summary(function), table, _signals_of_system(function))


def _documented_arguments(docstring: str) -> dict[str, str]:
    """Return the description of each argument in the section Parameters of a docstring."""
    section = docstring.partition("Parameters\n----------\n")[2].partition("\n\n")[0]
    meanings: dict[str, str] = {}
    names: list[str] = []
    for line in section.splitlines():
        if not line.startswith(" "):
            names = [name.strip(" *") for name in line.partition(" : ")[0].split(",")]
        else:
            meanings |= {name: f"{meanings.get(name, '')} {line.strip()}".strip() for name in names}
    return meanings


def _signals_of_system(function: Callable[..., Any]) -> str:
    """Return the signals of what a function makes of its defaults, if it makes anything of them."""
    try:
        system = function()
        return f"({', '.join(system.input_labels)}) -> ({', '.join(system.output_labels)})"
    except (UsageError, TypeError, AttributeError):
        return ""


def _show_kind(name: str, kind: Kind) -> None:
    """Print the keys of a kind's table in a study file."""
    table = Table("key", "default", "meaning", title=None)
    for key, field in kind.schema.model_fields.items():
        if key != "kind":
            default = "needed" if field.is_required() else repr(field.default)
            table.add_row(key, Text(default), Text(field.description or ""))
    about = f"{_plain(kind.answers)}; claim: {_plain(kind.claims)}" if kind.claims else kind.answers
    _show_table(name, about or kind.title, table)


def _show_table(name: str, summary: str, table: Table, signals: str = "") -> None:
    console = _console()
    console.print(Text.assemble((name, "bold"), f"  {summary}"))
    if signals:
        console.print(Text(f"  {signals}"))
    if table.row_count:
        console.print(table)


def _plain(markdown: str) -> str:
    return markdown.replace("`", "")


def _summary(documented: object) -> str:
    return (documented.__doc__ or "").strip().splitlines()[0]
