"""Which outputs of a block depend on which of its inputs at the same instant."""

from __future__ import annotations

import ast
from typing import Any

import control as ct
import numpy as np

from .._block import Block
from ._foreign import readable_source


def feedthrough(system: Any) -> np.ndarray:
    """Return which outputs depend directly on which inputs.

    nlctl's blocks declare it, linear systems have their D matrix.  The function of a foreign
    nonlinear block depends on the inputs unless its source never mentions them, or unless
    nothing changes at any of several points when the inputs are changed or made NaN.

    Parameters
    ----------
    system : control.InputOutputSystem
        A block, not a diagram.

    Returns
    -------
    ndarray of bool, shape (noutputs, ninputs)
    """
    shape = (system.noutputs or 0, system.ninputs or 0)
    if isinstance(system, Block):
        return np.full(shape, bool(system.spec.feedthrough))
    if isinstance(system, ct.StateSpace):
        return np.not_equal(system.D, 0.0)
    if 0 in shape or not _mentions_inputs(system.outfcn):
        return np.zeros(shape, dtype=bool)
    return np.full(shape, _responds(system, np.arange(shape[1])).any())


def probed_feedthrough(system: Any, direct: np.ndarray) -> np.ndarray:
    """Return which entries of `direct` respond when one input after the other is changed.

    What several points do not show may still be there.  Where that matters, the program runs
    into a NaN: an input that is not known yet is NaN.
    """
    if isinstance(system, ct.StateSpace) or not direct.any():
        return direct
    columns = [_responds(system, np.array([j])) for j in range(direct.shape[1])]
    return direct & np.stack(columns, axis=1)


def _mentions_inputs(function: Any) -> bool:
    """Whether the source of an output function uses its third argument (True if unreadable)."""
    if function is None:
        return False  # the outputs are the states
    found = readable_source(function)
    if found is None or len(found[1]) < 3:
        return True
    tree, names = found
    return any(isinstance(node, ast.Name) and node.id == names[2] for node in ast.walk(tree))


def _responds(system: ct.NonlinearIOSystem, changed: np.ndarray) -> np.ndarray:
    """Return which outputs change at any of several points with the inputs `changed`.

    A point at which the function raises says nothing, and then the answer is the safe one.
    """
    rng = np.random.default_rng(0)
    found = np.zeros(system.noutputs or 0, dtype=bool)
    for scale in (0.0, 1.0, 1.0, 10.0):
        x = scale * rng.standard_normal(system.nstates or 0)
        u = scale * rng.standard_normal(system.ninputs or 0)
        others = (rng.standard_normal(u.size), 100 * rng.standard_normal(u.size), u * np.nan)
        try:
            with np.errstate(all="ignore"):
                base = np.array(system._out(0.7, x, u), dtype=float)
                for values in others:
                    v = u.copy()
                    v[changed] = values[changed]
                    y = np.asarray(system._out(0.7, x, v), dtype=float)
                    found |= (y != base) & ~(np.isnan(y) & np.isnan(base))
        except Exception:
            return np.ones_like(found)
    return found
