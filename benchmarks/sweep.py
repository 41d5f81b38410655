"""What a robustness study costs beyond the simulations, and whether its memory stays flat.

Example 1 with 8 uncertain parameters runs for 20 s, first as a bare ensemble without metrics, then
as a sweep with the usual metrics, 3 requirements, chunks in Parquet and a progress bar.  Both take
turns on the same rows, block after block, and the processor time of the whole process counts, so
that what else the machine does matters little.

Peak memory is that of fresh processes that sweep a cheap loop, once with some rows and once with a
hundred times as many.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import control as ct
import numpy as np
from rich.console import Console

import nlctl
from nlctl.analysis.cli.progress import sweep_bar
from nlctl.analysis.robustness import (
    Design,
    Experiment,
    Prepared,
    Requirement,
    Space,
    Spec,
    Uncertain,
    always,
    arguments,
    in_band,
    independent,
    prepare,
    rows,
    tracking_metrics,
)
from nlctl.analysis.robustness.runs.sweep import sweep

BOX = {
    "actuator.b_r": (0.3, 0.7),
    "actuator.b_l": (-0.5, -0.1),
    "actuator.slope_r": (0.8, 1.2),
    "actuator.slope_l": (0.6, 1.0),
    "plant.p1": (-0.3, -0.1),
    "plant.q_mean": (4.0, 6.0),
    "plant.d_amplitude": (0.0, 0.2),
    "plant.x1(0)": (0.3, 0.7),
}
BLOCK = 1024  # rows that are timed in turn
CHUNK = 512  # rows: what a sweep of 10,000 takes by itself


def tracking() -> Prepared:
    """Example 1 with 8 uncertain quantities, 14 metrics and 3 requirements."""
    formulas = {
        "settles": always(in_band("e", lower=-0.15, upper=0.15), start=10),
        "input": always(in_band("u", lower=-15, upper=15)),
        "gain": always(in_band("zeta", upper=2.5)),
    }
    experiment = Experiment(
        space=Space(quantities=tuple(Uncertain(name=k, bounds=b) for k, b in BOX.items())),
        build=nlctl.paper.example_1,
        spec=Spec(
            requirements=tuple(Requirement(key=k, formula=f, until=20) for k, f in formulas.items())
        ),
        timepts=np.linspace(0, 20, 2001),
        metrics=tracking_metrics(start=10, band=0.05),
    )
    return prepare(experiment)


def decay() -> Prepared:
    """x' = -k x with an uncertain k: next to nothing to simulate."""
    plant = ct.nlsys(
        lambda t, x, u, params: [-params["k"] * x[0]],
        lambda t, x, u, params: [x[0]],
        inputs=0,
        outputs=["y"],
        states=1,
        name="plant",
        params={"k": 1.0},
    )
    experiment = Experiment(
        space=Space(quantities=(Uncertain(name="k", bounds=(0.5, 1.5)),)),
        build=lambda: plant,
        spec=Spec(requirements=(Requirement(key="low", formula=in_band("y", upper=2), until=1),)),
        timepts=np.linspace(0, 1, 5),
    )
    return prepare(experiment)


def spent(work: Callable[[], object]) -> float:
    """Return the processor time (s) of the whole process."""
    start = time.process_time()
    work()
    return time.process_time() - start


def overhead(count: int, threads: int, console: Console) -> None:
    """Print what a sweep takes beyond a bare ensemble."""
    prepared = tracking()
    space, times = prepared.experiment.space, prepared.experiment.timepts
    (_, loop), seconds = prepared.loops[0], np.zeros(2)
    terminal = Console(file=open(os.devnull, "w"), force_terminal=True)  # noqa: SIM115

    def bare(design: Design) -> None:
        given = arguments(space, rows(design, range(design.size)))
        nlctl.ensemble_response(loop, times, threads=threads, **given)

    def whole(design: Design) -> None:
        with tempfile.TemporaryDirectory() as folder, sweep_bar("example 1", terminal) as show:
            sweep(prepared, design, folder, threads=threads, chunk=CHUNK, progress=show)

    for work in (bare, whole):
        work(independent(space, 8, entropy=0))  # compiled before anything is timed
    begin = time.perf_counter()
    for block in range(0, count, BLOCK):
        design = independent(space, min(BLOCK, count - block), entropy=block)
        seconds += [spent(lambda d=design: bare(d)), spent(lambda d=design: whole(d))]
    console.print(f"{count} closed loops of example 1, {threads} threads, processor time")
    console.print(f"  bare ensemble  {1e3 * seconds[0] / count:8.3f} ms per row")
    console.print(f"  whole sweep    {1e3 * seconds[1] / count:8.3f} ms per row")
    console.print(f"  ratio          {seconds[1] / seconds[0]:8.3f}")
    console.print(f"  wall time of both together {time.perf_counter() - begin:.0f} s")


def memory(count: int, console: Console) -> None:
    """Print the peak memory of fresh processes."""
    peaks = []
    for size in (count, 100 * count):
        command = [sys.executable, __file__, "--child", str(size)]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        peaks.append(float(printed))
        console.print(f"peak memory of {size} rows: {peaks[-1]:.0f} MB")
    console.print(f"  ratio          {peaks[1] / peaks[0]:8.3f}")


def child(count: int) -> None:
    """Sweep a cheap loop, and print this process's peak memory in MB."""
    prepared = decay()
    design = independent(prepared.experiment.space, count, entropy=1)
    with tempfile.TemporaryDirectory() as folder:
        swept = sweep(prepared, design, folder)
        assert swept.complete
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", type=int, default=10_000, help="rows of example 1")
    parser.add_argument("--threads", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument(
        "--memory", type=int, default=10_000, help="rows of the smaller cheap sweep (0: none)"
    )
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.child:
        child(chosen.child)
        return
    console = Console()
    overhead(chosen.rows, chosen.threads, console)
    if chosen.memory:
        memory(chosen.memory, console)


if __name__ == "__main__":
    main()
