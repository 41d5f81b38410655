"""Whether python-control, which commits nothing, moves the memories of a diagram at all."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..blocks import Block, default_state, memory_states
from ..diagrams import leaves
from ..errors import UsageError
from ..upstream.control_internals import current_parameters

__all__ = ["check_relaxation"]

_INPUTS = [sign * 2.0**k for k in range(-3, 11) for sign in (1.0, -1.0)]
"""At which a memory is asked where it tends to."""


def check_relaxation(system: Any) -> None:
    """Refuse memories whose rate is 0 where `commit` would change them.

    Parameters
    ----------
    system : control.InputOutputSystem

    Raises
    ------
    UsageError
        With block and memory.
    """
    for place in leaves(system):
        made = place.system
        if isinstance(made, Block) and memory_states(made.spec):
            for name in _unmoved(made):
                raise UsageError(
                    f"{type(made.spec).__name__} (block '{place.path or made.name}') needs an "
                    f"update that brings the memory '{name}' to what commit says, such as "
                    f"rate * (commit - {name}), to run in python-control, which does not commit: "
                    "it is 0 where they differ; machine code needs none"
                )


def _unmoved(made: Block) -> list[str]:
    """Return memories that `commit` changes at one of the inputs, and `update` at none of these."""
    spec, p, names = made.spec, current_parameters(made), memory_states(made.spec)
    rows = [list(spec.states).index(name) for name in names]
    apart, moved = np.zeros(len(rows), dtype=bool), np.zeros(len(rows), dtype=bool)
    x = default_state(made)
    with np.errstate(all="ignore"):
        for value in _INPUTS:
            u = np.full(made.ninputs or 0, value)
            away = np.asarray(spec.commit(0.0, x, u, p), dtype=float) != x[rows]
            rates = np.asarray(spec.update(0.0, x, u, p), dtype=float)[rows]
            apart, moved = apart | away, moved | (away & (rates != 0.0))
    return [name for name, lost in zip(names, apart & ~moved, strict=True) if lost]
