"""Falsification next to what others published: ARCH-COMP's table, one setting for all rows.

    python benchmarks/arch/run.py [--rows AT1 CC3] [--attempts 50] [--entropy 0] [--simulations 300]
                                    [--workers 2]

A cell is attempts falsified of 50 and the mean number of simulations of these.  A run with
derivatives counts as one simulation, and one of a row that was run before as another one.  A row
that an earlier attempt ran counts, but is not run again.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import chain
from multiprocessing import get_context
from typing import Any

import numpy as np
import pandas as pd
from published import FALCAUN, ROWS, Row
from rich.console import Console
from rich.table import Table

from nlctl.analysis.robustness import (
    Experiment,
    FirstOrder,
    Prepared,
    Spec,
    evaluate,
    first_order,
    margin,
    prepare,
    worst_case,
)
from nlctl.analysis.robustness.runs.experiment import signals_of_rows
from nlctl.analysis.robustness.stl.spec import violates

SOURCES = """\
zlscheck: ARCH-COMP 2020, instance 1, by gradients
  (github.com/ismailbennani/zlscheck_arch20_counterexamples).
ARIsTEO: recomputed from its .mat files of ARCH-COMP 2020.
FalCAuN: ARCH-COMP 2023 / 2024, mean of 10 attempts with more simulations each.
suspect: 1.0 of a requirement that others needed many runs for."""


@dataclass(frozen=True)
class Outcome:
    """What the attempts of one row have come to."""

    simulations: tuple[int | None, ...]
    searchers: tuple[str, ...]
    seconds: float
    reasons: tuple[str, ...]

    @property
    def falsified(self) -> list[int]:
        """Simulations of the attempts that falsified."""
        return [count for count in self.simulations if count is not None]


SHARED = 4  # derivatives of the first descent
LOOPS: dict[Callable[[], Any], Prepared] = {}  # of this process


def prepared(row: Row, loops: dict[Callable[[], Any], Prepared]) -> Prepared:
    """Return the experiment of a row; rows of one plant share its machine code."""
    experiment = Experiment(
        space=row.space,
        build=row.build,
        spec=Spec(requirements=(row.requirement,)),
        timepts=row.timepts,
        method=row.method,
    )
    if row.build not in loops:
        loops[row.build] = prepare(experiment)
    return replace(loops[row.build], experiment=experiment)


def by_samples(ready: Prepared, table: pd.DataFrame) -> list[float]:
    """Return margins of rows by their samples; where these violate, by all events of a run."""
    # chasing cars switch 4,000 times a run: what lies between samples takes 50 times as long
    (requirement,), t = ready.experiment.spec.requirements, ready.experiment.timepts
    signals, _ = signals_of_rows(ready, table, requirement.signals)
    margins = [
        margin(requirement, t, {name: samples[k] for name, samples in signals.items()})
        for k in range(len(table))
    ]
    low = np.flatnonzero(violates(margins))
    if low.size:
        for k, value in zip(low, evaluate(ready, table.iloc[low])["spec"], strict=True):
            margins[k] = value
    return margins


@dataclass(frozen=True)
class Remembered:
    """Rows of an experiment: what was run in an earlier attempt is not run again, but counts."""

    ready: Prepared
    margins: dict[bytes, float] = field(default_factory=dict)
    derivatives: dict[bytes, FirstOrder] = field(default_factory=dict)

    def evaluate(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return the rows with their margins."""
        keys = [row.tobytes() for row in table.to_numpy()]
        new = [k for k, key in enumerate(keys) if key not in self.margins]
        if new:
            margins = by_samples(self.ready, table.iloc[new])
            self.margins.update(zip((keys[k] for k in new), margins, strict=True))
        return table.assign(spec=[self.margins[key] for key in keys])

    def first_order(self, row: Mapping[str, Any]) -> FirstOrder:
        """Return a row's derivatives; of the first descent, which all attempts share, once."""
        key = np.array(list(row.values())).tobytes()
        if key in self.derivatives:
            return self.derivatives[key]
        of_row = first_order(self.ready, row)
        if len(self.derivatives) < SHARED:
            self.derivatives[key] = of_row
        return of_row


def attempted(key: str, numbers: Sequence[int], simulations: int) -> Outcome:
    """Search a row again and again, each time with other random numbers."""
    warnings.filterwarnings("ignore", category=RuntimeWarning)
    row = next(row for row in ROWS if row.key == key)
    counts, searchers, reasons, start = [], [], {}, time.process_time()
    rows = Remembered(prepared(row, LOOPS))
    for entropy in numbers:
        worst = worst_case(
            rows.evaluate,
            row.space,
            simulations,
            entropy=entropy,
            target=0.0,
            derivatives=rows.first_order,
        )
        first = worst.first_violation
        counts.append(None if first is None else first + 1)
        searchers += [] if first is None else [str(worst.searchers[first])]
        reasons |= dict.fromkeys(worst.without_derivative)
    seconds = time.process_time() - start
    return Outcome(tuple(counts), tuple(searchers), seconds, tuple(reasons))


def together(outcomes: Sequence[Outcome]) -> Outcome:
    """Return what several processes have come to as one."""
    return Outcome(
        simulations=tuple(chain.from_iterable(part.simulations for part in outcomes)),
        searchers=tuple(chain.from_iterable(part.searchers for part in outcomes)),
        seconds=sum(part.seconds for part in outcomes),
        reasons=tuple(chain.from_iterable(part.reasons for part in outcomes)),
    )


def searched(rows: Sequence[Row], pool: Executor, arguments: argparse.Namespace) -> Any:
    """Yield rows and their outcomes in order; every process has a part of the attempts."""
    numbers = range(arguments.entropy, arguments.entropy + arguments.attempts)
    parts = [numbers[k :: arguments.workers] for k in range(arguments.workers)]
    tasks = [
        (row, [pool.submit(attempted, row.key, part, arguments.simulations) for part in parts])
        for row in rows
    ]
    for row, futures in tasks:
        yield row, together([future.result() for future in futures])


def cell(result: tuple[int, float] | None) -> str:
    """Return a published result as text."""
    if result is None:
        return ""
    return f"{result[0]}" if np.isnan(result[1]) else f"{result[0]} / {result[1]:g}"


def best_published(row: Row) -> float:
    """Return the least mean of those who falsified all 50 attempts, or of all if none did."""
    published = [result for result in (row.zlscheck, row.aristeo) if result is not None]
    most = max((result[0] for result in published), default=0)
    means = [mean for count, mean in published if count == most and not np.isnan(mean)]
    return min(means, default=np.nan)


def line(row: Row, outcome: Outcome, attempts: int) -> tuple[list[str], bool, bool]:
    """Return the cells of a row, whether all attempts falsified, and if the mean is the best."""
    falsified = outcome.falsified
    mean = float(np.mean(falsified)) if falsified else np.nan
    every = len(falsified) == attempts
    best = every and mean <= best_published(row)
    names, counts = np.unique(outcome.searchers, return_counts=True)
    by = ", ".join(f"{name} {count}" for name, count in zip(names, counts, strict=True))
    cells = [
        row.key,
        f"{len(falsified)} / {mean:.1f}" + (" *" if best else ""),
        cell(row.zlscheck),
        cell(row.aristeo) + row.suspect * " (suspect)",
        FALCAUN.get(row.key, ""),
        by,
        f"{outcome.seconds:.0f}",
        row.note,
    ]
    return cells, every, best


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", nargs="+", choices=[row.key for row in ROWS], metavar="ROW")
    parser.add_argument("--attempts", type=int, default=50)
    parser.add_argument("--entropy", type=int, default=0, help="of the first attempt")
    parser.add_argument("--simulations", type=int, default=300)
    parser.add_argument("--workers", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    console = Console()
    heads = ["row", "nlctl", "zlscheck", "ARIsTEO", "FalCAuN", "found by", "CPU s", "note"]
    table, whole = Table(*heads), []
    start = time.perf_counter()
    rows = [row for row in ROWS if not arguments.rows or row.key in arguments.rows]
    with ProcessPoolExecutor(arguments.workers, mp_context=get_context("spawn")) as pool:
        for row, outcome in searched(rows, pool, arguments):
            cells, every, best = line(row, outcome, arguments.attempts)
            whole.append((every, best))
            table.add_row(*cells)
            console.print(" | ".join(cells), highlight=False)
            for reason in outcome.reasons[:1]:
                console.print(f"    no derivative everywhere: {reason[:150]}", highlight=False)
    console.print(table)
    every, best = np.sum(whole, axis=0)
    console.print(
        f"{len(whole)} rows: {every} falsified in every attempt, {best} with the best mean (*), "
        f"{time.perf_counter() - start:.0f} s"
    )
    console.print(SOURCES)


if __name__ == "__main__":
    main()
