"""What one step costs whose input is chosen on the way: a stepper against runs of a step each.

    python benchmarks/stepping.py

Each round makes the same steps of 10 ms in three ways, one after the other: by `nlctl.stepper`, by
`nlctl.input_output_response` of the compiled diagram over one step from the last state, and so by
python-control at the same tolerances.  The ratios are those of the shortest times.  The last two
forget delays, clocks and memories from step to step: these loops have none, but for the last one,
whose state says what its memory is.  A second table has the time of a step for each member of
`nlctl.vector_stepper`, next to as many steppers, as time of the processor.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import control as ct
import numpy as np
from rich.console import Console
from rich.table import Table
from tables import machine

import nlctl
from nlctl.arguments import ATOL, RTOL

DT, STEPS, ROUNDS = 0.01, 100, 7


def pendulum(t: float, x: Any, u: Any, params: Any) -> list[Any]:
    """A pendulum with a torque."""
    return [x[1], -np.sin(x[0]) - 0.1 * x[1] + u[0]]


def angle(t: float, x: Any, u: Any, params: Any) -> Any:
    """What is measured of it."""
    return x[0]


def plant(u: str = "u") -> Any:
    """Return a pendulum as a block."""
    return ct.nlsys(pendulum, angle, inputs=[u], outputs=["y"], states=2, name="plant")


def with_actuator() -> Any:
    """Return a pendulum behind a backlash."""
    backlash = nlctl.block(nlctl.Backlash(), "actuator")
    return nlctl.interconnect([backlash, plant("v")], inputs=["u"], outputs=["y"])


def by_runs(response: Callable[..., Any]) -> Callable[[Any], float]:
    """Return what makes the steps as runs of one step each."""

    def seconds(inputs: np.ndarray) -> float:
        x, start = None, time.perf_counter()
        for k, u in enumerate(inputs):
            run = response(np.array([k, k + 1]) * DT, u, x)
            x = run.states[:, -1]
        return (time.perf_counter() - start) / len(inputs)

    return seconds


def ways(system: Any) -> list[Callable[[np.ndarray], float]]:
    """Return the three ways, each as a function that returns the time of a step."""
    compiled = nlctl.compile(system)
    steps = nlctl.stepper(compiled, DT)

    def stepped(inputs: np.ndarray) -> float:
        steps.reset()
        start = time.perf_counter()
        for u in inputs:
            steps.step(u)
        return (time.perf_counter() - start) / len(inputs)

    def native(times: np.ndarray, u: float, x: Any) -> Any:
        return nlctl.input_output_response(compiled, times, u, x)

    def reference(times: np.ndarray, u: float, x: Any) -> Any:
        start = nlctl.initial_state(system) if x is None else x
        keywords = {"rtol": RTOL, "atol": ATOL}
        return ct.input_output_response(
            system, times, np.full(2, u), start, solve_ivp_method="LSODA", solve_ivp_kwargs=keywords
        )

    return [stepped, by_runs(native), by_runs(reference)]


def together(system: Any, size: int) -> tuple[float, float]:
    """Return the times of a step for each member: of a vector stepper, of as many steppers."""
    compiled = nlctl.compile(system)
    many = nlctl.vector_stepper(compiled, DT, size)
    alone = [nlctl.stepper(compiled, DT) for _ in range(size)]
    inputs = np.random.default_rng(0).normal(size=(STEPS + 1, size, 1))

    def each_alone(row: np.ndarray) -> None:
        for one, u in zip(alone, row, strict=True):
            one.step(u)

    best = []
    for step in (many.step, each_alone):
        times = []
        for _ in range(ROUNDS):
            step(inputs[0])
            start = time.process_time()
            for row in inputs[1:]:
                step(row)
            times.append((time.process_time() - start) / STEPS / size)
        best.append(min(times))
    return best[0], best[1]


def show_members(console: Console, systems: dict[str, Any]) -> None:
    """Print a table of members that are stepped together."""
    table = Table("system", "members", "together, us each", "steppers, us each", "ratio")
    for name, system in systems.items():
        for size in (1, 8, 64):
            many, alone = together(system, size)
            times = (f"{1e6 * many:.1f}", f"{1e6 * alone:.1f}")
            table.add_row(name, str(size), *times, f"{alone / many:.1f}")
    console.print(table)


def main() -> None:
    """Print both tables."""
    console = Console()
    table = Table("system", "stepper, ms", "nlctl's runs, ms", "python-control's, ms", "ratios")
    console.print(machine())
    inputs = np.random.default_rng(0).normal(size=STEPS)
    systems = {"pendulum": plant(), "with backlash": with_actuator()}
    for name, system in systems.items():
        functions = ways(system)
        rounds = [[way(inputs) for way in functions] for _ in range(ROUNDS)]
        stepper, *others = (min(times[i] for times in rounds) for i in range(3))
        ratios = " and ".join(f"{other / stepper:.0f}" for other in others)
        table.add_row(name, *(f"{1e3 * t:.3f}" for t in (stepper, *others)), ratios)
    console.print(table)
    show_members(console, systems)


if __name__ == "__main__":
    main()
