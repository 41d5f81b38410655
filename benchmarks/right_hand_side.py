"""What a diagram costs before it runs, and one evaluation of it: for one member and for eight.

    python benchmarks/right_hand_side.py

Processor time from the diagram to machine code with an empty cache, and of a right-hand side (each
evaluation depends on the one before), per member: medians.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

import nlctl
from nlctl.native.machine.address import call_rhs
from nlctl.native.machine.evaluations import ENSEMBLE_WIDTH, Machine, prepared_parameters

ROUNDS, EVALUATIONS = 15, 5000


@numba.njit(error_model="numpy")
def _again_and_again(rhs, count, t, x, u, c, dx, g, m):
    for _ in range(count):
        call_rhs(rhs, t, x, u, c, dx, g, m)
        for k in range(t.size):
            x[0, k] += 1e-14 * dx[1, k]
            t[k] += 1e-6


def compile_time(make: Callable[[], Any], width: int) -> float:
    """Return the time from a diagram to its machine code (ms)."""
    diagram, begin = make(), time.process_time()
    compiled = nlctl.compile(diagram)
    prepared_parameters(compiled, compiled.parameter_vector(), width)
    return 1e3 * (time.process_time() - begin)


def evaluation_time(compiled: Any, width: int) -> float:
    """Return the time of a right-hand side per member (ns)."""
    code, c = prepared_parameters(compiled, compiled.parameter_vector(), width)
    assert isinstance(code, Machine)
    dx, g, m = (np.zeros((code.lowered.rows[name], width)) for name in ("dx", "g", "m"))
    x = np.full(dx.shape, 0.1)
    arguments = np.ones(width), x, np.zeros((0, width)), c, dx, g, m
    times = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        _again_and_again(code.entries[0], EVALUATIONS, *arguments)
        times.append((time.process_time() - begin) / EVALUATIONS / width)
    return 1e9 * float(np.median(times[1:]))


def main() -> None:
    """Print a line for each example and number of members."""
    nlctl.native.compile_ahead(nlctl.compile(nlctl.paper.example_1()))  # what is imported late
    with tempfile.TemporaryDirectory() as folder:
        for make in (nlctl.paper.example_1, nlctl.paper.example_2):
            compiled = nlctl.compile(make())
            for width in (1, ENSEMBLE_WIDTH):
                times = []
                for k in range(5):
                    os.environ["NLCTL_CACHE_DIR"] = f"{folder}/{make.__name__}-{width}-{k}"
                    times.append(compile_time(make, width))
                print(
                    f"{make.__name__}, {width} at a time: machine code in "
                    f"{np.median(times):.0f} ms, right-hand side "
                    f"{evaluation_time(compiled, width):.0f} ns per member"
                )


if __name__ == "__main__":
    main()
