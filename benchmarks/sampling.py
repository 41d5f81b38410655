"""What sampling costs: a loop with its controller on a computer against the continuous loop.

    python benchmarks/sampling.py

Both take the same number of steps: a fixed one of the sampling time.  The controller is made
discrete by Euler's method.  Each round runs both, one after the other; the ratio is that of the
shortest times.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from tables import machine

import nlctl
from nlctl import paper
from nlctl.analysis.paper.controllers import part_of

DT, END, ROUNDS = 1e-3, 20.0, 25


def seconds(compiled: Any) -> tuple[float, int]:
    """Return the time that one run takes, and its steps."""
    start = time.perf_counter()
    response = nlctl.input_output_response(compiled, np.array([0.0, END]), step=DT, audit=False)
    return time.perf_counter() - start, response.statistics.accepted


def main() -> None:
    """Print a table."""
    console, table = Console(), Table("loop", "steps", "continuous, ms", "sampled, ms", "ratio")
    console.print(machine())
    for name, make in paper.EXAMPLES.items():
        continuous = make()
        law = nlctl.discretise(part_of(continuous, "controller"), DT)
        sampled = make(controller=nlctl.sampled(law, DT))
        both = [nlctl.compile(loop) for loop in (continuous, sampled)]
        rounds = [[seconds(compiled) for compiled in both] for _ in range(ROUNDS)]
        one, other = (min(timed[i][0] for timed in rounds) for i in range(2))
        steps = " and ".join(str(timed[1]) for timed in rounds[0])
        table.add_row(name, steps, f"{1e3 * one:.1f}", f"{1e3 * other:.1f}", f"{other / one:.2f}")
    console.print(table)


if __name__ == "__main__":
    main()
