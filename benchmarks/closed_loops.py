"""Speed of nlctl's engine against other ways to simulate the same closed loops.

Both examples of the paper run for 20 s, once and as an ensemble that varies x1(0).  Each solver
takes the loosest tolerance with which its largest error in the plant's states is at most 1e-6,
or what --error says, against a reference solution, and the error is printed next to its time.
Before anything is timed, the right-hand side of each solver is compared with nlctl's.  Times are
the shortest of several rounds: processor time on one core, wall time on two.  They depend on the
machine and on what else it does, so compare ratios within one output only.

Example 2 has backlash.  "play" is the exact operator; "relaxed" is a memory state that follows it
at 1000 1/s, which is what solvers without events can do: its errors are then taken against the
accurate solution of the relaxed loop, and the distance to the exact play is printed next to them.

The C++ programs need a compiler (and Boost's headers); heyoka, numbalsoda and diffrax are used if
they are installed (extra "benchmark").  What is missing is skipped.
"""

from __future__ import annotations

import argparse
import os

import growth
import measure
import tables
from competitors.problem import Problem
from rich.console import Console

THREADS = min(2, os.cpu_count() or 1)


def arguments(given: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        *["--example", "-e"],
        type=int,
        choices=(1, 2),
        action="append",
        help="the paper's example; may be repeated (default: both)",
    )
    parser.add_argument(
        "--nodes",
        type=int,
        choices=(27, 125, 1000),
        default=27,
        help="of the network of Example 1 (default: %(default)s)",
    )
    parser.add_argument(
        "--only",
        nargs="+",
        choices=list(measure.COMPETITORS),
        default=list(measure.COMPETITORS),
        help="solvers to compare (default: all)",
    )
    parser.add_argument(
        "--members",
        type=int,
        default=10_000,
        help="largest ensemble in the table of growth; a tenth of it, at most, is compared "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--rounds", type=int, default=7, help="times each run is timed (default: 7)"
    )
    parser.add_argument(
        "--error", type=float, default=1e-6, help="that solvers may have (default: %(default)s)"
    )
    parser.add_argument("--no-growth", action="store_true", help="leave the tables of growth out")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="Example 1 without python-control, 1000 members, 3 rounds, small growth",
    )
    chosen = parser.parse_args(given)
    if chosen.quick:
        chosen.example, chosen.members, chosen.rounds = [1], min(chosen.members, 1000), 3
        chosen.only = [name for name in chosen.only if name != "python-control"]
    if chosen.nodes != 27:
        chosen.example = [1]
    return chosen


def compare(problem: Problem, chosen: argparse.Namespace, console: Console) -> None:
    """Print both tables of one example."""
    sizes = f"{problem.nodes} nodes, {problem.x0.size} states"
    console.print(f"\n[bold]Example {problem.example}[/bold], {sizes}, 20 s")
    solvers = measure.available(problem, chosen.only, console.print)
    single = measure.single_runs(problem, solvers, chosen.rounds)
    console.print(tables.comparison(problem, "One run", single))
    limit = max(16, chosen.members // 10)
    many = measure.ensembles(problem, solvers, single, limit, THREADS)
    console.print(tables.comparison(problem, "Ensemble, per member", many))


def main() -> None:
    """Print the machine, two tables per example, and three tables of growth."""
    chosen, console = arguments(), Console(width=140)
    console.print(tables.machine(), soft_wrap=True)
    for example in chosen.example or (1, 2):
        compare(Problem(example, chosen.nodes, chosen.error), chosen, console)
    if not chosen.no_growth:
        largest = chosen.members
        console.print(growth.members((largest // 100, largest // 10, largest), THREADS))
        console.print(growth.nodes((27, 125) if chosen.quick else (27, 125, 1000)))
        console.print(growth.blocks((4, 16) if chosen.quick else (4, 16, 64)))


if __name__ == "__main__":
    main()
