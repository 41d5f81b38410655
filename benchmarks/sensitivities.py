"""What derivatives of a run cost, in runs: both examples of the paper, by k gains of the law.

    python benchmarks/sensitivities.py

Everything is timed in turn in one process; of each the shortest time counts.  Central differences
take 2 k runs, and are wrong by what a step width costs.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table
from tables import machine

import nlctl

GAINS = (
    *("controller.law.beta", "controller.weights.Gamma", "controller.robust.gamma"),
    *("controller.filtered_error.lambdas[0]", "controller.robust.tau"),
    "controller.weights.sigma_1",
)
TIMES = np.linspace(0, 20, 201)
ROUNDS = 15


def shortest(functions: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the shortest time of each function (s), all of them in turn."""
    least = dict.fromkeys(functions, np.inf)
    for function in functions.values():
        function()  # compiled
    for _ in range(ROUNDS):
        for name, function in functions.items():
            begin = time.perf_counter()
            function()
            least[name] = min(least[name], time.perf_counter() - begin)
    return least


def rows(name: str, diagram: object) -> list[tuple[str, ...]]:
    """Return the figures of one diagram."""
    compiled = nlctl.compile(diagram)

    def run() -> object:
        return nlctl.input_output_response(compiled, TIMES, audit=False)

    def derivatives(k: int) -> nlctl.sensitivities.SensitivityResponse:
        return nlctl.sensitivity_response(
            compiled, TIMES, of=["y"], with_respect_to=GAINS[:k], audit=False
        )

    counts = range(1, len(GAINS) + 1)
    functions = {f"{k}": lambda k=k: derivatives(k) for k in counts}
    took = shortest({"run": run, **functions})
    plain = run().statistics.accepted
    return [
        (
            name, f"{k}", f"{took[f'{k}'] / took['run']:.2f}", f"{1 + 0.7 * k:.1f}", f"{2 * k}",
            f"{derivatives(k).statistics.accepted / plain:.2f}",
        ) for k in counts
    ]  # fmt: skip


def main() -> None:
    """Print the table."""
    table = Table(title="Derivatives of a run by k gains, in runs")
    for column in ("diagram", "k", "cost", "goal 1 + 0.7 k", "differences 2 k", "steps"):
        table.add_column(column, justify="left" if column == "diagram" else "right")
    for name in ("example_1", "example_2"):
        for row in rows(name, getattr(nlctl.paper, name)()):
            table.add_row(*row)
    console = Console()
    console.print(table)
    console.print(machine())


if __name__ == "__main__":
    main()
