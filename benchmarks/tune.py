"""Runs that `nlctl.tune` needs for gains, against CMA-ES: both examples of the paper, and a PID.

    python benchmarks/tune.py

Both raise the least margin of the same requirements within the same bounds (those that the paper's
rivals are tuned in) from the same gains, in one search; CMA-ES is the package cma with its own
defaults but for the resolution of margins, 5e-4 as that of tune, over logarithms of the gains,
with seven seeds.  Counted are the runs until each search ends by itself, and until 90, 95 and 99 %
of what CMA-ES gains in the median by its end are there; never counts as all of its runs.  Of tune
that is the time that its runs with k derivatives take, measured in the same process, over that of
a plain run; its budget counts them as 1 + 0.7 k.
"""

from __future__ import annotations

from dataclasses import dataclass

import cma
import numpy as np
from rich.console import Console
from rich.table import Table
from sensitivities import shortest
from tables import machine

import nlctl
from nlctl.analysis.robustness import Requirement, Spec, always, in_band
from nlctl.sensitivities.worth import LOST_MARGIN

SEEDS = range(7)
GENERATIONS = 200
RESOLUTION = 5e-4
SHARES = (0.9, 0.95, 0.99)
TIMES = np.linspace(0, 20, 1001)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A loop, its gains and what is asked of it."""

    name: str
    diagram: object
    space: dict[str, tuple[float, ...]]
    spec: Spec


def spec(band: float, most: float, start: float = 10.0) -> Spec:
    """Return |e| <= band from some time on, and |u| <= most."""
    small = always(in_band("e", lower=-band, upper=band), start=start)
    moderate = always(in_band("u", lower=-most, upper=most))
    return Spec(
        requirements=(
            Requirement(key="tracks", formula=small, until=20.0),
            Requirement(key="moderate", formula=moderate, until=20.0),
        )
    )


LAW = {f"controller.{k}": (0.1, 50.0) for k in ("law.beta", "weights.Gamma", "robust.gamma")}
PID_GAINS = {f"controller.{k}": (0.01, 1000.0) for k in ("k_p", "k_i", "k_d")}
PID_GAINS |= {"controller.T_f": (0.005, 0.5)}
PID = nlctl.PID(k_p=5.0, k_i=5.0, k_d=5.0, T_f=0.05, u_max=100.0)
PROBLEMS = (
    Problem(name="Example 1", diagram=nlctl.paper.example_1(), space=LAW, spec=spec(0.15, 15.0)),
    Problem(name="Example 2", diagram=nlctl.paper.example_2(), space=LAW, spec=spec(0.15, 15.0)),
    Problem(
        name="PID", diagram=nlctl.paper.example_1(controller=PID), space=PID_GAINS,
        spec=spec(0.15, 30.0),
    ),
)  # fmt: skip


def own_search(
    problem: Problem, compiled: object
) -> tuple[np.ndarray, np.ndarray, nlctl.sensitivities.Tuned]:
    """Return runs so far and the best margin so far of `nlctl.tune`."""
    tuned = nlctl.tune(compiled, problem.space, problem.spec, 400, TIMES, starts=1)
    history = tuned.history[tuned.history["by"] == "search"]
    return history["runs"].to_numpy(), np.maximum.accumulate(history["margin"].to_numpy()), tuned


def evolution(
    problem: Problem, compiled: object, tuned: nlctl.sensitivities.Tuned, seed: int
) -> np.ndarray:
    """Return the best margin so far after each run of CMA-ES, over logarithms of the gains."""
    names, (low, high) = tuned.names, np.log([tuned.low, tuned.high])
    strategy = cma.CMAEvolutionStrategy(
        (np.log(tuned.start) - low) / (high - low), 0.25,
        {
            "bounds": [0, 1], "seed": seed + 1, "verbose": -9, "tolfun": RESOLUTION,
            "tolfunhist": RESOLUTION,
        },
    )  # fmt: skip
    best: list[float] = []
    while not strategy.stop() and strategy.countiter < GENERATIONS:
        proposed = strategy.ask()
        gains = np.exp(low + np.clip(proposed, 0, 1) * (high - low))
        table = nlctl.ensemble_response(
            compiled, TIMES, params=dict(zip(names, gains.T, strict=True)), max_steps=100_000,
            metrics=problem.spec.requirements, rtol=1e-6, atol=1e-8,
        ).table  # fmt: skip
        margins = table[[r.key for r in problem.spec.requirements]].min(axis=1).fillna(LOST_MARGIN)
        strategy.tell(proposed, list(-margins))
        best += list(margins)
    return np.maximum.accumulate(best)


def cost_of_derivatives(compiled: object, tuned: nlctl.sensitivities.Tuned) -> float:
    """Return how many runs one with derivatives takes, at the gains that were found."""
    same = {"params": tuned.params, "audit": False, "rtol": 1e-6, "atol": 1e-8}

    def plain() -> object:
        return nlctl.input_output_response(compiled, TIMES, **same)

    def differentiated() -> object:
        return nlctl.sensitivity_response(
            compiled, TIMES, of=["e", "u"], with_respect_to=tuned.names, **same
        )

    took = shortest({"plain": plain, "differentiated": differentiated})
    return took["differentiated"] / took["plain"]


def rows(problem: Problem) -> list[tuple[str, ...]]:
    """Return the figures of one problem."""
    compiled = nlctl.compile(problem.diagram)
    runs, searched, tuned = own_search(problem, compiled)
    others = [evolution(problem, compiled, tuned, seed) for seed in SEEDS]
    before, end = tuned.margin_before, float(np.median([other[-1] for other in others]))
    cost, k = cost_of_derivatives(compiled, tuned), len(tuned.names)
    about = (
        problem.name,
        f"{k}",
        f"{before:.3f}",
        f"{searched[-1]:.3f}",
        f"{end:.3f}",
        f"{cost:.1f}",
    )
    table = []
    for share in (*SHARES, None):
        target = before + (share or 0.0) * (end - before)
        met = [np.append(np.flatnonzero(o >= target) + 1, o.size)[0] for o in others]
        if share is None:
            met = [other.size for other in others]
        median = float(np.median(met))
        there = np.flatnonzero(searched >= target)
        counted = runs[-1] if share is None else runs[there[0]] if there.size else np.inf
        measured = counted * cost / (1 + 0.7 * k)
        figures = (f"{share:.0%}" if share else "end", f"{median:.0f}", f"{measured:.0f}")
        figures += (f"{counted:.0f}", f"{median / measured:.1f}", f"{median / counted:.1f}")
        table.append((*about, *figures))
        about = ("",) * len(about)
    return table


def main() -> None:
    """Print the table."""
    table = Table(title="Runs until so much of the gain of CMA-ES is there")
    columns = ("loop", "gains", "margin before", "tune", "CMA-ES", "run with derivatives")
    columns += ("share", "CMA-ES", "tune, measured", "1 + 0.7 k", "ratio", "1 + 0.7 k")
    for column in columns:
        table.add_column(column, justify="left" if column == "loop" else "right")
    for problem in PROBLEMS:
        for row in rows(problem):
            table.add_row(*row)
    console = Console(width=140)
    console.print(table)
    console.print(machine())


if __name__ == "__main__":
    main()
