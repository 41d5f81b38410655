"""Mistakes in other people's functions that machine code would not notice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import control as ct
import numpy as np

from .._block import Block
from ._code import CompileError
from ._schedule import Node


def check_sizes(system: Any, nodes: Sequence[Node]) -> None:
    """Hold a diagram to the number of states that its blocks have.

    Raises
    ------
    CompileError
        If it was made with another one.
    """
    had = sum(node.system.nstates or 0 for node in nodes)
    if had != (system.nstates or 0):
        raise CompileError(
            f"diagram '{system.name}' was made with states={system.nstates or 0}, but its blocks "
            f"have {had}: leave the argument out"
        )


def check_functions(node: Node) -> None:
    """Call a foreign block's functions once: they must return as many values as there are signals.

    Machine code reads results by position and does not know where they end.

    Parameters
    ----------
    node : Node

    Raises
    ------
    CompileError
        If a number of values is wrong, or an index is out of range.
    """
    system: Any = node.system
    if isinstance(system, Block | ct.StateSpace) or not isinstance(system, ct.NonlinearIOSystem):
        return  # nlctl's blocks were checked when they were made
    calls = [("update", system._rhs, system.nstates, "states")] if system.nstates else []
    if system.outfcn is not None and system.noutputs:
        calls.append(("output", system._out, system.noutputs, "outputs"))
    x, u = np.zeros(system.nstates or 0), np.zeros(system.ninputs or 0)
    for what, function, wanted, kind in calls:
        try:
            with np.errstate(all="ignore"):
                got = np.size(function(0.0, x, u))
        except IndexError as error:
            raise CompileError(
                f"block '{node.path}' reads beyond an array in its {what} function: {error}"
            ) from error
        except Exception:  # what fails at this point alone may work at others
            continue
        if got != wanted:
            raise CompileError(
                f"block '{node.path}' returns {got} values from its {what} function, needs "
                f"{wanted}, one for each of its {kind}"
            )
