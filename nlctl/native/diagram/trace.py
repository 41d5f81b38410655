"""A block's functions on symbols: its time, states, inputs and parameters as arrays."""

from collections.abc import Callable, Mapping
from typing import Any

import control as ct
import numpy as np

from ...blocks import Block
from ...expressions.arrays import Tracer, leaf_vector, scalar
from ...expressions.dependence import structure
from ...expressions.graph import Ambiguous, Graph, Untraceable
from ...expressions.operators import elementwise
from ...expressions.trace import trace
from ...upstream.control_internals import current_parameters
from ...upstream.systems import System
from .parameters import Slot, current_values, slots_of


def time(graph: Graph) -> Tracer:
    """Return the time."""
    return scalar(graph, graph.leaf("t", 0, None))


def traced_parameters(
    graph: Graph, system: System, slots: Mapping[str, Slot], p: np.ndarray | None = None
) -> Any:
    """Return the record or dict that a block's functions take, with arrays for the numbers."""
    # Integers have the values that they have in the parameter vector `p`, or in the block now.
    values = {
        name: _parameter(graph, slots[name], value, p) if name in slots else value
        for name, value in current_values(system).items()
    }
    return type(current_parameters(system))(**values) if isinstance(system, Block) else values


def traced_arguments(graph: Graph, system: System, slots: Mapping[str, Slot]) -> tuple[Any, ...]:
    """Return what a block's functions take: its time, states, inputs and parameters."""
    x = leaf_vector(graph, "x", 0, (system.nstates or 0,))
    u = leaf_vector(graph, "u", 0, (system.ninputs or 0,))
    return time(graph), x, u, traced_parameters(graph, system, slots)


def _parameter(graph: Graph, slot: Slot, value: Any, p: np.ndarray | None) -> Any:
    if slot.kind in "ib" and not slot.shape:  # Python's True is an integer, too
        now = int(value if p is None else p[slot.offset])
        leaf = graph.leaf("p", slot.offset, None, kind="i", value=now)
        return scalar(graph, leaf)
    whole = leaf_vector(graph, "p", slot.offset, slot.shape)
    now = np.ravel(value) if p is None else p[slot.offset : slot.offset + slot.size]
    graph.nominal.update(enumerate(now, slot.offset))
    if slot.kind == "b":
        return elementwise(graph, "ne", whole, 0.0)
    named = isinstance(value, tuple) and hasattr(value, "_fields") and len(slot.shape) == 1
    return type(value)(*whole) if named else whole


def dependence(
    system: System, function: Callable[..., Any], slots: Mapping[str, Slot]
) -> np.ndarray:
    """Return which results of a block's function depend on which of its inputs."""
    # What cannot be traced, or holds for some values of a parameter only, depends on all of them.
    # returns (noutputs, ninputs).
    passes = np.ones((system.noutputs or 0, system.ninputs or 0), dtype=bool)
    graph = Graph()

    try:
        with np.errstate(all="ignore"):
            result = trace(graph, function, lambda: traced_arguments(graph, system, slots))
    except Untraceable:
        return passes
    if result.size != system.noutputs or graph.assumptions:
        return passes
    return structure(list(result.pieces()), "u", system.ninputs or 0)


def feedthrough(system: ct.NonlinearIOSystem) -> np.ndarray:
    """Return which outputs depend directly on which inputs."""
    # nlctl's blocks declare it, linear systems have their D matrix, and the output functions of
    # others are traced: what reaches an output in their expressions is depended on, whatever the
    # values are.
    # returns (noutputs, ninputs).
    shape = (system.noutputs or 0, system.ninputs or 0)
    if isinstance(system, Block):
        return np.full(shape, bool(system.spec.feedthrough))
    if isinstance(system, ct.StateSpace):
        return np.not_equal(system.D, 0.0)
    if 0 in shape or getattr(system, "outfcn", None) is None:
        return np.zeros(shape, dtype=bool)
    return _traced(system)


def closer_feedthrough(system: object, direct: np.ndarray) -> np.ndarray:
    """Return which entries of `direct` are there in the expressions of a block of nlctl."""
    return direct & _traced(system) if isinstance(system, Block) and direct.any() else direct


def _traced(system: Any) -> np.ndarray:
    try:
        return dependence(system, system.outfcn, slots_of(system))
    except Ambiguous:  # the block is refused when it is read
        return np.ones((system.noutputs or 0, system.ninputs or 0), dtype=bool)
