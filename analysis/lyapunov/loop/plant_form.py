"""The plant's own equations on balls: that it is a chain of integrators, and what drives its end.

A record's f and d say what the plant should be; what a run integrates is `update`.  The
certificate encloses the latter, so that nothing rests on the two being the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from flint import arb

from nlctl.diagrams import Place
from nlctl.errors import CompileError, DiagramError
from nlctl.expressions.arrays import Tracer, concatenated, traced
from nlctl.expressions.graph import Expr, Graph, Untraceable
from nlctl.native.diagram.checks import check_functions
from nlctl.native.enclosures.boxes import traced_numbers
from nlctl.native.machine.fingerprint import content_of
from nlctl.plants import coordinate_names
from nlctl.upstream.control_internals import current_parameters

from ...intervals.agreement import on_balls
from ...intervals.arithmetic import Ball, as_ball
from ...intervals.paths import Undecided, every_way


@dataclass(frozen=True, kw_only=True)
class Acceleration:
    """x_n', the last rate of a plant's own update; two of the same content are equal."""

    plant: Place = field(compare=False)
    update: Callable[..., Any] = field(compare=False)
    p: Any = field(compare=False)
    content: object

    def __call__(self, t: object, x: object, v: object) -> Any:
        """Return it of balls or numbers."""
        return self.update(t, _objects(x), _objects((v,)), self.p)[-1]

    def expression(self, graph: Graph, t: Tracer, x: Sequence[Tracer], v: object) -> Expr:
        """Return it of symbols, as an expression of the graph; Untraceable if there is none."""
        system = self.plant.system
        try:
            check_functions(self.plant.path, system)
        except CompileError as error:
            raise Untraceable(str(error)) from None
        states = concatenated(graph, [one.reshape(1) for one in x])
        inputs = traced(graph, v).reshape(1)
        given = lambda: (t, states.copy(), inputs.copy(), self.p)  # noqa: E731
        return traced_numbers(graph, system.updfcn, given)[-1]


def on_intervals(path: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a block's function; that intervals cannot go through it is said with its name."""

    def refusal(why: str) -> DiagramError:
        return DiagramError(
            f"the equations of block '{path}' cannot be evaluated on intervals, which the "
            f"proof needs ({why}): write them with arithmetic and NumPy functions of numbers"
        )

    return on_balls(function, refusal)


def acceleration(plant: Place) -> Acceleration:
    """Return x_n', from what a run integrates, with its parameters."""
    p = current_parameters(plant.system)
    update = on_intervals(plant.path, plant.system.updfcn)  # with arrays of floats, as a run
    key, unseen = content_of(plant.system.updfcn, p)
    return Acceleration(plant=plant, update=update, p=p, content=object() if unseen else key)


def check_chain(plant: Place) -> None:
    """Prove x_i' = x_{i+1} for i < n, and that the outputs are y = x_1 and x_1, ..., x_n."""
    # For all x and v and all t >= 0: on every path through the function each is the coordinate
    # itself, or, where there is one path only, it has the coordinate's gradient everywhere and its
    # value at 0.
    system, n = plant.system, plant.system.nstates
    states, outputs = coordinate_names(n), list(system.current_spec.outputs)
    update = [(i, f"{states[i]}'", i + 1) for i in range(n - 1)]
    output = [(outputs.index(s), s, states.index(s)) for s in states if s in outputs]
    output += [(outputs.index("y"), "y", 0)]
    for what, function, coordinates in (
        ("update", system.updfcn, update), ("output", system.outfcn, output)
    ):  # fmt: skip
        for i, name, k in coordinates:
            if not _is_coordinate(plant, function, i, k):
                raise DiagramError(
                    f"the proof is about plants (1), with {name} = {states[k]}; the {what} "
                    f"function of block '{plant.path}' makes {name} something else, or it cannot "
                    "be decided"
                )


def _is_coordinate(plant: Place, function: Any, i: int, k: int) -> bool:
    """Whether result i of a plant's function is x_{k+1}, for all states, inputs and times."""
    n, p = plant.system.nstates, current_parameters(plant.system)
    called = on_intervals(plant.path, function)

    def result(z: list[Ball]) -> Any:
        return called(z[n + 1], _objects(z[:n]), _objects(z[n : n + 1]), p)[i]

    unit = [tuple(arb(int(a == b)) for a in range(n + 2)) for b in range(n + 2)]
    wide = [Ball(arb(0, "inf"), gradient) for gradient in unit]
    try:
        ways = list(every_way(lambda: result(wide)))
        if all(way is wide[k] for way in ways):
            return True
        ball, start = as_ball(ways[0]), as_ball(result([Ball(arb(0))] * (n + 2)))
    except Undecided:
        return False
    if len(ways) > 1 or ball is NotImplemented or start is NotImplemented:
        return False
    slopes = [bool(g == int(j == k)) for j, g in enumerate(ball.gradient)]
    return bool(slopes) and all(slopes) and bool(start.value == 0)


def _objects(values: Any) -> np.ndarray:
    """Return balls as an array, which equations may unpack, slice or compute with."""
    array = np.empty(len(values), dtype=object)
    array[:] = list(values)
    return array
