"""Proofs in machine code and on balls, as ratios in one run: python benchmarks/enclosures.py.

Boxes a second for V' < 0 of a pendulum, and `certify` of both examples with a known sign: the same
claims, first on python-flint's balls alone, then with machine code.  What the code needs is made
before, as by an earlier proof.  A loop that was certified before is compared with python-control's
own at one point, one with other gains at all of them.  Then sets of solutions of ARCH-COMP's
nonlinear systems; with ``--long`` also the one that takes minutes.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import nlctl
from nlctl.analysis.intervals.machine import only_balls
from nlctl.analysis.lyapunov import Box, certify, prove_decrease, reachable_set
from nlctl.native.enclosures.boxes import enclosed, expressions_of
from nlctl.native.enclosures.divide import decide_claim

REPEATS = 5
FLOOR, LEVEL = 1e-3, 10.095  # of V, between which V' < 0 is claimed: 10.096 is too much


def form(x: Any) -> Any:
    """A quadratic form of a pendulum's state."""
    return 1.5 * x[0] ** 2 + x[0] * x[1] + x[1] ** 2


def pendulum(x: Any) -> Any:
    """Rates of a damped pendulum."""
    return x[1], -np.sin(x[0]) - x[1]


def conditions(x: Any) -> Any:
    """What is positive at once where V' is not negative between two levels."""
    x1, x2 = x
    rate = (3 * x1 + x2) * x2 + (x1 + 2 * x2) * (-np.sin(x1) - x2)
    return np.array([rate + 1e-9, LEVEL - form(x), form(x) - FLOOR])


def best(call: Callable[[], Any], repeats: int = REPEATS) -> tuple[float, Any]:
    """Return the least time of some calls (s), and what the last one returns."""
    result, least = None, np.inf
    for _ in range(repeats):
        start = time.perf_counter()
        result = call()
        least = min(least, time.perf_counter() - start)
    return least, result


def known_sign(order: int) -> Any:
    """Return an example of the paper with a law that knows the sign."""
    robust = nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5)
    controller = nlctl.adaptive_neural(
        order,
        law=nlctl.controllers.KnownSignLaw(),
        weights=nlctl.controllers.AdaptiveWeights(Gamma=10.0),
        robust=robust,
    )
    example = nlctl.paper.example_1 if order == 2 else nlctl.paper.example_2
    return example(controller=controller)


def decrease(table: Table) -> None:
    """Measure V' < 0 of a pendulum."""
    box = Box.of(x1=(-6.0, 6.0), x2=(-6.0, 6.0))
    call = lambda: prove_decrease(form, pendulum, box, level=LEVEL, floor=FLOOR)  # noqa: E731
    with only_balls():
        before, on_balls = best(call, 1)
    call()
    after, proof = best(call)
    rate = on_balls.boxes / on_balls.seconds
    name = "V' < 0 of a pendulum"
    table.add_row(f"{name}: balls", on_balls.status, f"{rate:,.0f} boxes/s", f"{before:.3f} s", "1")
    table.add_row(
        f"{name}: all of the proof", proof.status, "", f"{after:.3f} s", f"{before / after:.0f}"
    )
    code = enclosed(expressions_of(conditions, 2)[1], 2)
    ends = np.array(box.low), np.array(box.high)
    judge = lambda: decide_claim(code, *ends, 0.0, max_boxes=10_000_000)  # noqa: E731
    judge()
    seconds, verdict = best(judge)
    fast = verdict.boxes / seconds
    status = {True: "proved", False: "refuted"}.get(verdict.holds, "undecided")
    table.add_row(
        f"{name}: boxes divided on one core", status, f"{fast:,.0f} boxes/s", f"{seconds:.5f} s",
        f"{fast / rate:.0f} in boxes/s",
    )  # fmt: skip


def certificates(table: Table) -> None:
    """Measure `certify`: of a loop with other gains than before, and of the same loop again."""
    for example, order in ((1, 2), (2, 3)):
        loop, others = known_sign(order), (2.0 + 1e-9 * k for k in itertools.count(1))
        another = lambda: certify(loop, params={"law.beta": next(others)})  # noqa: B023, E731
        again = lambda: certify(loop)  # noqa: B023, E731
        ways = (
            ("balls, other gains", only_balls, another), ("other gains", nullcontext, another),
            ("balls, again", only_balls, again), ("again", nullcontext, again),
        )  # fmt: skip
        times, bounds = [], []
        for how, only, call in ways:
            with only():
                call()
                seconds, certificate = best(call)
            times.append(seconds)
            bounds.append(certificate.C_0)
            share = "" if len(bounds) % 2 else f"C_0 {(bounds[-1] - bounds[-2]) / bounds[-2]:+.1e}"
            table.add_row(
                f"certify, Example {example}: {how}", share, "", f"{seconds:.3f} s",
                f"{times[0] / seconds:.1f}",
            )  # fmt: skip


def laub_loomis(x: Any) -> Any:
    """Rates of the benchmark LALO20 of ARCH-COMP."""
    x1, x2, x3, x4, x5, x6, x7 = x
    return (
        1.4 * x3 - 0.9 * x1, 2.5 * x5 - 1.5 * x2, 0.6 * x7 - 0.8 * x2 * x3, 2 - 1.3 * x3 * x4,
        0.7 * x1 - x4 * x5, 0.3 * x1 - 3.1 * x6, 1.8 * x6 - 1.6 * x2 * x7,
    )  # fmt: skip


def coupled(x: Any) -> Any:
    """Rates of the benchmark CVDP23: two of Van der Pol's oscillators, and what couples them."""
    x1, y1, x2, y2, b = x
    return (
        y1, (1 - x1**2) * y1 + b * (x2 - x1) - x1, y2, (1 - x2**2) * y2 - b * (x2 - x1) - x2,
        0.0 * b,
    )  # fmt: skip


def tubes(table: Table, *, long: bool) -> None:
    """Prove the sets of solutions of ARCH-COMP's nonlinear systems; one takes minutes."""
    centre = (1.2, 1.05, 1.5, 2.4, 1.0, 0.1, 0.45)
    reachable_set(laub_loomis, Box.of(**{f"x{i + 1}": (v, v) for i, v in enumerate(centre)}), 0.1)
    for width, limit in ((0.01, 4.5), (0.05, 4.5), (0.1, 5.0)):
        box = Box.of(**{f"x{i + 1}": (v - width, v + width) for i, v in enumerate(centre)})
        tube = reachable_set(laub_loomis, box, 20.0, within=Box.of(x4=(-np.inf, limit)))
        name = f"LALO20, W = {width:g}: x4 < {limit:g}"
        _tube_row(table, name, tube, f"width {tube.end_high[3] - tube.end_low[3]:.3g}")
    if long:
        x, y = (1.25, 1.55), (2.35, 2.45)
        tube = reachable_set(
            coupled, Box.of(x1=x, y1=y, x2=x, y2=y, b=(1.0, 3.0)), 7.0, max_pieces=10_000,
            within=Box.of(y1=(-np.inf, 2.75), y2=(-np.inf, 2.75)),
        )  # fmt: skip
        slack = max(tube.bounds("y1")[1], tube.bounds("y2")[1]) - 2.75
        _tube_row(table, "CVDP23: y1, y2 < 2.75", tube, f"slack {slack:.2g}")


def _tube_row(table: Table, name: str, tube: Any, what: str) -> None:
    table.add_row(name, f"{tube.status}, {what}", f"{tube.pieces} pieces",
                  f"{tube.seconds:.2f} s", "")  # fmt: skip


def main() -> None:
    """Print the table."""
    table = Table("what", "result", "speed", "time", "ratio")
    decrease(table)
    certificates(table)
    tubes(table, long="--long" in sys.argv)
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
