"""What `nlctl check` prints, and the initial states of its ensembles."""

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import control as ct
import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from nlctl.arguments import number
from nlctl.diagrams import initial_state, state_names
from nlctl.names import find_name
from nlctl.response import input_output_response

from ..lyapunov.ledger import Ledger, Line
from ..lyapunov.loop.simulation import SAMPLING_INTERVAL, members_of

STATUSES = ("proved", "computed", "checked", "undecided", "not applicable", "violated")
_STYLES = {"proved": "bold green", "computed": "green", "violated": "bold red"}


def random_start(
    diagram: ct.InterconnectedSystem,
    start: Mapping[str, float],
    count: int,
    spread: float,
    seed: int,
) -> dict[str, Any]:
    """Draw the plant's initial states, uniformly within `spread` of where it would start."""
    number("check", "spread", spread, above=0)
    rng = np.random.default_rng(seed)
    nominal = dict(zip(state_names(diagram), initial_state(diagram, start), strict=True))
    full = {find_name("state", name, nominal): value for name, value in start.items()}
    drawn = {
        name: value + spread * rng.uniform(-1, 1, count)
        for name, value in nominal.items()
        if name.startswith("plant.")
    }
    return {**full, **drawn}


def interpreted_runs(
    diagram: ct.InterconnectedSystem,
    horizon: float,
    start: Mapping[str, Any],
    params: Mapping[str, Any],
) -> list[Any]:
    """Return runs of python-control, one for each member of an ensemble."""
    return [
        input_output_response(
            diagram,
            member.times,
            0,
            member.start,
            params=member.params,
            engine="python-control",
            rtol=1e-8,
            atol=1e-10,
        )
        for member in members_of(diagram, horizon, SAMPLING_INTERVAL, start, params)
    ]


def repeat_command(
    example: str,
    horizon: float,
    settings: Sequence[str],
    start: Mapping[str, Any],
    member: int,
    engine: str = "auto",
    k: tuple[float, float] | None = None,
) -> str:
    """Return the command that repeats one run of an ensemble, to the last digit."""
    params = [text for text in settings if not text.partition("=")[0].strip().endswith("(0)")]
    states = [
        f"{name}(0)={float(value if np.ndim(value) == 0 else value[member])!r}"
        for name, value in start.items()
    ]
    options = [part for text in (*params, *states) for part in ("--set", text)]
    options += [] if engine == "auto" else ["--engine", engine]
    options += ["--k", *map(repr, k)] if k else []
    return shlex.join(["nlctl", "check", example, "--until", f"{horizon:.17g}", *options])


def worst_lines(ledger: Ledger) -> list[Line]:
    """Return one line for each run that violates one; if none does, |r| <= C_0 of (36)."""
    # Margins of different lines have different units; that of (36) says which run is nearest to its
    # bound.
    first: dict[int, Line] = {}
    for line in ledger.violated:
        first.setdefault(line.member, line)
    return list(first.values()) or [ledger["(36)"]]


def show_ledger(ledger: Ledger, console: Console) -> None:
    """Print a ledger: a table on a terminal, elsewhere one line of text per statement."""
    if not console.is_terminal:
        print(ledger)
        return
    title, *_ = str(ledger).splitlines()
    rows = Table("line", "status", "least margin", "at (s)", "statement", title=Text(title))
    if ledger.members > 1:
        rows.add_column("run")
    for line in ledger.lines:
        what = Text.assemble(line.statement, "\n", (line.evidence, "dim"))
        if line.reading == "paper":
            what.append("\nas in the paper", "italic")
        if line.follows:
            what.append(f"\n{line.follows}", "red" if line.reading == "corrected" else "yellow")
        cells = (line.key, Text(line.status, _STYLES.get(line.status, "")), _number(line.least))
        who = (str(line.member),) if ledger.members > 1 else ()
        rows.add_row(*cells, _number(line.time), what, *who)
    console.print(rows)


def ledger_summary(ledger: Ledger) -> str:
    """Return the ledger in a few lines: bound, number of lines by status, what is violated."""
    count = {status: sum(x.status == status for x in ledger.lines) for status in STATUSES}
    counts = ", ".join(f"{number} {status}" for status, number in count.items() if number)
    paper = ", ".join(line.key for line in ledger.failing)
    corrected = ", ".join(line.key for line in ledger.violated)
    open_ = "; ".join(f"{line.key} ({line.evidence})" for line in ledger.undecided)
    lost = ledger["run"]
    until = f" until it is lost at {lost.time:.5g} s" if lost.status == "violated" else ""
    lines = [
        f"max |r| = {abs(ledger.max_r):.5g}{until}, least margin of |r| <= C_0: "
        f"{ledger['(36)'].least:.5g}",
        f"{len(ledger.lines)} lines: {counts}",
        f"violated: {corrected or 'none of the corrected statements'}",
    ]
    lines += [f"undecided: {open_}"] if open_ else []
    lines += [f"false as printed: {paper}"] if paper else []
    return "\n".join(lines)


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.5g}"
