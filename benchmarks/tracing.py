"""How many functions, as engineers write them, become expressions: python benchmarks/tracing.py.

Of each one of the corpus in ``tests/support/engineers``: whether it is traced, called as it
stands, or refused; whether its values are python-control's to 1e-12; how long its first run takes.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

from engineers import ENTRIES
from engineers.measured import Fate, fate, first_run


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the fractions."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", action="store_true", help="time first runs, too")
    parser.add_argument("--why", action="store_true", help="list what is not traced, and why")
    parser.add_argument("--theme", help="one module of the corpus alone")
    options = parser.parse_args(arguments)
    chosen = [e for e in ENTRIES if options.theme in (None, e.theme)]
    fates = {entry.name: fate(entry) for entry in chosen}
    console = Console()
    console.print(_table([e.theme for e in chosen], list(fates.values())))
    for name, outcome in fates.items():
        if outcome.apart or (options.why and outcome.why):
            text = f"{name}: {outcome.kind}: {outcome.apart or outcome.why}"
            console.print(text, markup=False, highlight=False)
    if options.runs:
        traced = [e for e in chosen if fates[e.name].kind == "traced"]
        first_run(traced[0])  # the integrators are loaded
        times = {e.name: first_run(e) for e in traced}
        slowest = max(times, key=times.__getitem__)
        console.print(
            f"first run of a traced function: median {np.median(list(times.values())):.2f} s, "
            f"{sum(s <= 0.3 for s in times.values())} of {len(times)} within 0.3 s, "
            f"slowest {times[slowest]:.2f} s ({slowest})"
        )


def _table(themes: Sequence[str], fates: Sequence[Fate]) -> Table:
    table = Table("theme", "functions", "traced", "called", "refused", "equal to 1e-12")
    for theme in (*dict.fromkeys(themes), "all"):
        of_theme = [f for f, of in zip(fates, themes, strict=True) if theme in (of, "all")]
        count = Counter(f.kind for f in of_theme)
        equal = sum(f.kind == "traced" and not f.apart for f in of_theme)
        share = f"{count['traced']} ({count['traced'] / len(of_theme):.0%})"
        table.add_row(theme, str(len(of_theme)), share, str(count["called"]), str(count["refused"]),
                      f"{equal} of {count['traced']}")  # fmt: skip
    return table


if __name__ == "__main__":
    main()
