"""Runs that `nlctl.tune` needs for gains, against CMA-ES.

Both examples of the paper, a PID, a lead compensator of a double integrator with a saturation, and
state feedback of a pole on a cart.

    python benchmarks/tune.py

Both raise the least margin of the same requirements within the same bounds (those that the paper's
rivals are tuned in) from the same gains, in one search; CMA-ES is the package cma with its own
defaults but for the resolution of margins, 5e-4 as that of tune, over logarithms of the gains,
with seven seeds.  Counted are the runs until each search ends by itself, and until 90, 95 and 99 %
of what CMA-ES gains in the median by its end are there, until both first have what tune ends with,
to that resolution ("there"), and until CMA-ES has it and tune has ended ("equal"); never counts as
all of its runs.  Of tune
that is the time that its runs with k derivatives take, measured in the same process, over that of
a plain run; its budget counts them as 1 + 0.7 k.
"""

from __future__ import annotations

from dataclasses import dataclass

import cma
import control as ct
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
SAMPLES = 4001  # with fewer, peaks of u lie between them


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A loop, its gains and what is asked of it."""

    name: str
    diagram: object
    space: dict[str, tuple[float, ...]]
    spec: Spec
    until: float = 20.0
    inputs: float = 0.0
    initial_state: dict[str, float] | None = None

    @property
    def times(self) -> np.ndarray:
        """When signals are sampled (s)."""
        return np.linspace(0, self.until, SAMPLES)

    @property
    def run(self) -> dict[str, object]:
        """What each run is given, but its times and gains."""
        return {"inputs": self.inputs, "initial_state": self.initial_state}


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


def lead(t, x, u, p):
    """One state of K (s + z) / (s + p), from e = r - y."""
    return [-p["p"] * x[0] + (p["z"] - p["p"]) * (u[0] - u[1])]


def lead_outputs(t, x, u, p):
    """Return u, and e."""
    e = u[0] - u[1]
    return [p["K"] * (x[0] + e), e]


def double_integrator() -> object:
    """Return a double integrator behind a saturation, with a lead compensator."""
    plant = ct.nlsys(
        lambda t, x, u, p: [x[1], np.clip(u[0], -2.0, 2.0)], lambda t, x, u, p: [x[0]],
        inputs=["u"], outputs=["y"], states=2, name="plant",
    )  # fmt: skip
    law = ct.nlsys(
        lead, lead_outputs, inputs=["r", "y"], outputs=["u", "e"], states=1,
        params={"K": 3.0, "z": 1.0, "p": 10.0}, name="law",
    )  # fmt: skip
    return nlctl.interconnect([plant, law], inputs=["r"], outputs=["y", "e", "u"])


def force(x, p):
    """Return the force of state feedback (N)."""
    return p["k1"] * x[0] + p["k2"] * x[1] + p["k3"] * x[2] + p["k4"] * x[3]


def pole_on_a_cart(t, x, u, p):
    """Rates of place, speed, angle from upright and its rate."""
    s, c, drive = np.sin(x[2]), np.cos(x[2]), force(x, p)
    mass = 1.0 + 0.2 * s * s
    cart = (drive + 0.2 * s * (0.5 * x[3] ** 2 - 9.81 * c)) / mass
    pole = (9.81 * 1.2 * s - c * (drive + 0.1 * x[3] ** 2 * s)) / (0.5 * mass)
    return [x[1], cart, x[3], pole]


CART = ct.nlsys(
    pole_on_a_cart, lambda t, x, u, p: [x[0], x[2], force(x, p)], inputs=0,
    outputs=["place", "angle", "force"], states=["s", "v", "theta", "w"],
    params={"k1": 2.0, "k2": 4.0, "k3": 40.0, "k4": 8.0}, name="cart",
)  # fmt: skip


def within(signal: str, low: float, high: float, start: float, until: float) -> Requirement:
    """Return low <= signal <= high from some time on."""
    formula = always(in_band(signal, lower=low, upper=high), start=start)
    return Requirement(key=f"{signal} from {start:g} s", formula=formula, until=until)


SETTLED = Spec(
    requirements=(
        within("e", -0.05, 0.05, 3.0, 10.0),
        within("y", -0.1, 1.1, 0.0, 10.0),
        within("u", -10.0, 10.0, 0.0, 10.0),
    )
)
UPRIGHT = Spec(
    requirements=(
        within("angle", -0.05, 0.05, 1.5, 8.0),
        within("place", -0.05, 0.05, 4.0, 8.0),
        within("place", -0.6, 0.6, 0.0, 8.0),
        within("force", -25.0, 25.0, 0.0, 8.0),
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
    Problem(
        name="lead", diagram=double_integrator(), spec=SETTLED, until=10.0, inputs=1.0,
        space={"law.K": (0.1, 200.0), "law.z": (0.05, 20.0), "law.p": (1.0, 200.0)},
    ),
    Problem(
        name="cart-pole", diagram=CART, spec=UPRIGHT, until=8.0,
        initial_state={"cart.theta": 0.3},
        space={"cart.k1": (0.2, 50.0), "cart.k2": (0.5, 80.0), "cart.k3": (15.0, 300.0),
               "cart.k4": (1.0, 80.0)},
    ),
)  # fmt: skip


def own_search(
    problem: Problem, compiled: object
) -> tuple[np.ndarray, np.ndarray, nlctl.sensitivities.Tuned]:
    """Return runs so far and the best margin so far of `nlctl.tune`."""
    tuned = nlctl.tune(
        compiled, problem.space, problem.spec, 400, problem.times, starts=1, **problem.run
    )
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
            compiled, problem.times, params=dict(zip(names, gains.T, strict=True)),
            max_steps=100_000, metrics=problem.spec.requirements, rtol=1e-6, atol=1e-8,
            **problem.run,
        ).table  # fmt: skip
        margins = table[[r.key for r in problem.spec.requirements]].min(axis=1).fillna(LOST_MARGIN)
        strategy.tell(proposed, list(-margins))
        best += list(margins)
    return np.maximum.accumulate(best)


def cost_of_derivatives(
    problem: Problem, compiled: object, tuned: nlctl.sensitivities.Tuned
) -> float:
    """Return how many runs one with derivatives takes, at the gains that were found."""
    same = {"params": tuned.params, "audit": False, "rtol": 1e-6, "atol": 1e-8, **problem.run}
    signals = sorted({s for r in problem.spec.requirements for s in r.signals})

    def plain() -> object:
        return nlctl.input_output_response(compiled, problem.times, **same)

    def differentiated() -> object:
        return nlctl.sensitivity_response(
            compiled, problem.times, of=signals, with_respect_to=tuned.names, **same
        )

    took = shortest({"plain": plain, "differentiated": differentiated})
    return took["differentiated"] / took["plain"]


def rows(problem: Problem) -> list[tuple[str, ...]]:
    """Return the figures of one problem."""
    compiled = nlctl.compile(problem.diagram)
    runs, searched, tuned = own_search(problem, compiled)
    others = [evolution(problem, compiled, tuned, seed) for seed in SEEDS]
    before, end = tuned.margin_before, float(np.median([other[-1] for other in others]))
    cost, k = cost_of_derivatives(problem, compiled, tuned), len(tuned.names)
    about = (
        problem.name,
        f"{k}",
        f"{before:.3f}",
        f"{searched[-1]:.3f}",
        f"{end:.3f}",
        f"{cost:.1f}",
    )
    table = []
    targets = {f"{share:.0%}": before + share * (end - before) for share in SHARES}
    targets["there"] = searched[-1] - RESOLUTION * (1 + abs(searched[-1]))
    for until, target in {**targets, "equal": searched[-1], "end": np.inf}.items():
        met = [np.append(np.flatnonzero(o >= target) + 1, o.size)[0] for o in others]
        median = float(np.median(met))
        there = np.flatnonzero(searched >= target)
        by_end = until not in targets  # of tune it is known when it has ended
        counted = runs[-1] if by_end else runs[there[0]] if there.size else np.inf
        measured = counted * cost / (1 + 0.7 * k)
        figures = (until, f"{median:.0f}", f"{measured:.0f}")
        figures += (f"{counted:.0f}", f"{median / measured:.1f}", f"{median / counted:.1f}")
        table.append((*about, *figures))
        about = ("",) * len(about)
    return table


def main() -> None:
    """Print the table."""
    table = Table(title="Runs until so much of the gain of CMA-ES is there")
    columns = ("loop", "gains", "margin before", "tune", "CMA-ES", "run with derivatives")
    columns += ("until", "CMA-ES", "tune, measured", "1 + 0.7 k", "ratio", "1 + 0.7 k")
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
