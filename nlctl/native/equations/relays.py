"""Ideal relays of a diagram that is being read as expressions."""

from collections.abc import Sequence
from dataclasses import fields, replace

from ...blocks import supplied_of
from ...expressions.arrays import Tracer, concatenated, leaf_vector
from ...expressions.graph import Expr, Graph
from ...expressions.stage import Stage
from ...sliding.relay import SLIDING, kept_mode
from ..diagram.nodes import Node
from ..diagram.program import memory
from ..diagram.schedule import Schedule
from ..diagram.trace import traced_parameters
from ..sliding.rates import OUTPUTS, Motion, SlidingInput, sliding_rates
from ..sliding.second import Limits
from .reader import Reader, vector_of


def relay_places(blocks: Sequence[Node]) -> list[int]:
    """Return the numbers of the blocks that are ideal relays, and stand for no condition."""
    relays = (i for i, node in enumerate(blocks) if supplied_of(node.system) is SLIDING)
    return [i for i in relays if blocks[i].slide is None]


def with_sliding(reader: Reader, schedule: Schedule) -> Reader:
    """Return a reader that knows outputs and rates of ideal relays, if there are any."""
    # The diagram is read once more for that, with their outputs as if they came from outside.
    graph, blocks = reader.graph, reader.blocks
    places = relay_places(blocks)
    if not places:
        return reader
    leaves = [graph.leaf(OUTPUTS, k, None) for k in range(len(places))]
    relay_outputs = {i: array_of(graph, [leaf]) for i, leaf in zip(places, leaves, strict=True)}
    first = replace(
        reader,
        supplied={**reader.supplied, **relay_outputs},
        signals={},
        solved=[],
        solvers={},
        fixed_points={},
        calls={},
    )
    first.read(schedule)
    relays = [
        SlidingInput(
            name=blocks[i].path,
            leaf=leaf,
            given=first.wired(blocks[i].inputs)[0].only,
            kept=kept_of(first, i),
            limits=limits_of(first, i),
        )
        for i, leaf in zip(places, leaves, strict=True)
    ]

    def output(k: int, known: Sequence[Expr]) -> Expr:
        return first.relay_output(places[k], array_of(graph, known))[0].only

    motion = Motion(
        rates=_rates(first), solutions=first.fixed_points, inputs=schedule.system.ninputs or 0,
        behind=schedule.ninputs - schedule.rates,
    )  # fmt: skip
    derived = dict(zip(places, sliding_rates(graph, relays, motion, output), strict=True))
    outputs = {i: array_of(graph, [f.output]) for i, f in derived.items()}
    moving = {i: array_of(graph, [f.drift, f.gain]) for i, f in derived.items()}
    return replace(
        reader,
        supplied={**reader.supplied, **outputs},
        moving=moving,
    )


def slide_places(blocks: Sequence[Node]) -> list[int]:
    """Return the numbers of the blocks that are ideal relays for conditions."""
    return [i for i, node in enumerate(blocks) if node.slide is not None]


def array_of(graph: Graph, parts: Sequence[Expr]) -> Tracer:
    """Return expressions, one after the other."""
    return concatenated(graph, [vector_of(graph, part) for part in parts])


def limits_of(reader: Reader, i: int) -> Limits:
    """Return the parameters of a relay, as expressions."""
    given = traced_parameters(reader.graph, reader.blocks[i].system, reader.layout[i], reader.p)
    names = (f.name for f in fields(Limits))
    return Limits(**{name: reader.graph.number(getattr(given, name).only) for name in names})


def kept_of(reader: Reader, i: int) -> Expr:
    """Return what the memory of a relay stands for: 1 or -1 on a side, 0 where it slides."""
    mode = leaf_vector(reader.graph, "x", reader.blocks[i].state_offset, (1,))
    return Stage(reader.graph).copied(kept_mode)(mode[0]).only


def _rates(reader: Reader) -> list[Expr]:
    """Return the derivatives of all states within a step, in which memories stand still."""
    arrays = [reader.derivatives(i) for i in range(len(reader.blocks))]
    numbers = [array[k].only for array in arrays for k in range(array.size)]
    for node in reader.blocks:
        for m in memory(node):
            numbers[m] = reader.graph.const(0.0)
    return numbers
