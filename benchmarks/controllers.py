"""How long a run of Example 1 takes with each controller: python benchmarks/controllers.py.

The loop of the paper with the controller's defaults, 20 s at the default tolerances, as machine
code on one core, as time of the processor; the shortest of many runs. The table has multiples of
the time with PID.
"""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console
from rich.table import Table

import nlctl
from nlctl.analysis.controller_guide import GUIDES

TIMES = np.linspace(0, 20, 2001)
ROUNDS = 40


def compiled(code: str) -> nlctl.native.Compiled:
    """Return Example 1 with a controller."""
    controller = eval(code, {"nlctl": nlctl})
    return nlctl.compile(nlctl.paper.example_1(controller=controller))


def seconds(loop: nlctl.native.Compiled) -> float:
    """Return the processor's time of one run (s)."""
    began = time.process_time()
    nlctl.input_output_response(loop, TIMES)
    return time.process_time() - began


def main() -> None:
    """Print the table, and what the records say."""
    loops = {g.name: compiled(g.code) for g in GUIDES if g.costs.time is not None}
    rounds = [{name: seconds(loop) for name, loop in loops.items()} for _ in range(ROUNDS)]
    spent = {name: min(timed[name] for timed in rounds) for name in loops}
    table = Table("controller", "ms a run", "with PID as 1", "recorded")
    for guide in GUIDES:
        if guide.name in spent:
            ratio = spent[guide.name] / spent["PID"]
            row = (f"{spent[guide.name] * 1e3:.1f}", f"{ratio:.2g}", f"{guide.costs.time:g}")
            table.add_row(guide.name, *row)
    Console().print(table)


if __name__ == "__main__":
    main()
