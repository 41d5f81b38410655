"""How nlctl's times and memory grow with members, nodes and blocks."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import control as ct
import numpy as np
from isolated import call, peak_memory
from rich.table import Table

import nlctl

LAYOUTS = {27: "3x9", 125: "5x25", 1000: "25x40"}
TIMES = np.linspace(0, 20, 201)
LIMIT = 60.0  # s: what takes longer is given up


def members(sizes: Sequence[int], threads: int) -> Table:
    """Time ensembles of Example 1, each in a process of its own for its peak memory."""
    headings = ("members", "s", "ms each", "peak memory, MB")
    return _table(f"Members of Example 1, {threads} threads", headings, _members, sizes, threads)


def nodes(sizes: Sequence[int]) -> Table:
    """Time Example 1 with networks of several sizes."""
    return _table("Nodes of the network of Example 1", ("nodes", *GROWN), _nodes, sizes)


def blocks(sizes: Sequence[int]) -> Table:
    """Time rings of simple blocks, each an unmodified function of python-control."""
    title = "Ring of first-order blocks x' = tanh(u) - x"
    return _table(title, ("blocks", *GROWN), _blocks, sizes)


def chain(size: int) -> ct.InterconnectedSystem:
    """Return `size` blocks one behind the other, the last fed back to the first with a minus."""

    def update(t, x, u, params):
        return np.tanh(u) - x

    def output(t, x, u, params):
        return x

    links = [
        ct.nlsys(update, output, inputs=["u"], outputs=["y"], states=["x"], name=f"b{i}")
        for i in range(size)
    ]
    wires = [[f"b{i}.u", f"{'' if i else '-'}b{(i - 1) % size}.y"] for i in range(size)]
    return ct.interconnect(links, connections=wires, inplist=[], outlist=["b0.y"], name="ring")


GROWN = ("states", "first run, s", "run, ms", "steps", "us per step", "x python-control")


def _members(size: int, threads: int) -> tuple[str, ...]:
    compiled = nlctl.compile(nlctl.paper.example_1())
    _ensemble(compiled, 2, threads)  # compiled code is loaded
    seconds = _ensemble(compiled, size, threads)
    return f"{seconds:.2f}", f"{1e3 * seconds / size:.3g}", f"{peak_memory() / 2**20:.0f}"


def _ensemble(compiled: nlctl.native.Compiled, size: int, threads: int) -> float:
    start = time.perf_counter()
    x1 = 0.5 + np.linspace(-0.1, 0.1, size)
    nlctl.ensemble_response(compiled, TIMES, initial_state={"plant.x1": x1}, threads=threads)
    return time.perf_counter() - start


def _nodes(size: int) -> tuple[str, ...]:
    loop = nlctl.paper.example_1(centres=LAYOUTS[size])
    return _grown(loop, nlctl.initial_state(loop))


def _blocks(size: int) -> tuple[str, ...]:
    return _grown(chain(size), np.full(size, 0.5))


def _grown(loop: ct.InterconnectedSystem, x0: np.ndarray) -> tuple[str, ...]:
    """Return what `GROWN` names.

    The first run compiles, or finds its code in the cache.  The ratio is that of a right-hand
    side in python-control to one sixth of an explicit step, which has six.
    """

    def run() -> Any:
        return nlctl.input_output_response(compiled, TIMES, 0, x0)

    start = time.perf_counter()
    compiled = nlctl.compile(loop)
    run()
    first = time.perf_counter() - start
    seconds, statistics = _shortest(run), run().statistics
    steps = statistics.accepted + statistics.rejected
    interpreted = _shortest(lambda: loop.dynamics(0.0, x0, ()))
    return (
        f"{loop.nstates}",
        f"{first:.2g}",
        f"{1e3 * seconds:.3g}",
        f"{steps}",
        f"{1e6 * seconds / steps:.3g}",
        f"{6 * interpreted * steps / seconds:.0f}",
    )


def _shortest(function: Callable[[], object]) -> float:
    """Return the shortest processor time of seven calls (s)."""
    best = np.inf
    for _ in range(7):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def _table(
    title: str, headings: Sequence[str], row: Callable, sizes: Sequence[int], *arguments: int
) -> Table:
    """Return the table of ``row(size, *arguments)``, each from a process of its own."""
    table = Table(title=title, title_justify="left")
    for heading in headings:
        table.add_column(heading, justify="right")
    table.caption_justify = "left"
    for size in sizes:
        try:
            table.add_row(f"{size}", *call(row, size, *arguments, limit=LIMIT))
        except (nlctl.errors.CompileError, TimeoutError) as error:
            table.caption = f"{size}: {str(error)[:300]}"
    return table
