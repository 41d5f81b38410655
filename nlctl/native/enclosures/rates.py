"""The rates of a diagram as functions of its states alone."""

from collections.abc import Callable, Sequence

import control as ct

from ...expressions.graph import Expr, Graph, Untraceable, needed
from ..equations.relays import relay_places
from ..reading import Reading
from .scalars import UnroundedGraph, scalar_expressions


def state_rates(compiled: Reading, params: dict[str, object] | None = None) -> list[Expr]:
    """Return x' of a diagram, a number per state, made of the leaves ``x[0], x[1], ...``."""
    # Its external inputs are 0.
    _check(compiled)
    p = compiled.parameter_vector(params)
    arrays = [array for _, array in compiled.equations_with(p).results["dx"]]
    numbers = [array[i].only for array in arrays for i in range(array.size)]
    _, rates = scalar_expressions(numbers)

    def instead(graph: Graph, leaf: Expr) -> Expr:
        array, row, _ = leaf.data
        if array == "x":
            return graph.leaf("x", row, None)
        if array == "t":
            raise Untraceable("its rates depend on time")
        return graph.const(0.0 if array == "u" else float(p[row]))

    return with_leaves(rates, instead)[1]


def _check(compiled: Reading) -> None:
    """Refuse a diagram whose states do more than follow their rates."""
    program, schedule = compiled.program, compiled.schedule
    reasons = {
        "is in discrete time": not ct.isctime(compiled.system),
        "has memories, which jump": bool(len(program.memory)),
        "has sampled blocks": bool(len(program.sampled)),
        "has states that are reset": bool(program.resets),
        "delays signals": bool(len(schedule.lines)),
        "has ideal relays": bool(relay_places(schedule.nodes)),
        "has no states": not compiled.system.nstates,
    }
    for reason, holds in reasons.items():
        if holds:
            raise Untraceable(f"it {reason}")


def with_leaves(
    exprs: Sequence[Expr], instead: Callable[[Graph, Expr], Expr]
) -> tuple[Graph, list[Expr]]:
    """Return expressions of numbers with something else instead of what is read."""
    graph, new = UnroundedGraph(), {}
    for node in needed(exprs):
        if node.op == "leaf":
            new[node] = instead(graph, node)
        elif node.op == "const":
            new[node] = graph.const(bool(node.data) if node.kind == "b" else float(node.data))
        else:
            new[node] = graph.op(node.op, *(new[arg] for arg in node.args))
    return graph, [new[expr] for expr in exprs]
