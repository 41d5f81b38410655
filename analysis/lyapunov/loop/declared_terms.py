"""Whether a plant's update is, as expressions, the chain (1) of the f and d that it declares.

What is proved of f and d over a box is about the plant only if its runs integrate them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from nlctl.diagrams import Place
from nlctl.expressions.graph import Ambiguous, Graph, Untraceable
from nlctl.expressions.trace import trace
from nlctl.native.diagram.parameters import slots_of
from nlctl.native.diagram.trace import traced_arguments
from nlctl.plants import PureFeedback, integrator_chain


def terms_with_parameters(plant: Any) -> tuple[Callable, Callable]:
    """Return ``f(x, v, p)`` and ``d(x, t, p)`` as equations that machine code can call."""
    return plant.terms if isinstance(plant, PureFeedback) else (plant.f, plant.d)


@functools.lru_cache(maxsize=32)
def update_is_declared(plant: Place) -> bool:
    """Whether the update function and the chain of f and d are the same expressions.

    False where they differ, and where that is unknown: expressions that are equal but written
    in another way count as different.
    """
    system, graph = plant.system, Graph()
    declared = integrator_chain(*terms_with_parameters(system.current_spec))

    given = functools.partial(traced_arguments, graph, system, slots_of(system))
    try:
        with np.errstate(all="ignore"):
            one, other = (trace(graph, f, given) for f in (system.updfcn, declared))
    except (Untraceable, Ambiguous):
        return False
    pairs = zip(one.cells.flat, other.cells.flat, strict=False)
    return one.shape == other.shape and all(a is b for a, b in pairs)
