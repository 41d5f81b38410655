"""The equations of blocks as they were run, with their values: nothing is typed by hand."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from nlctl import native

from .document import Equation

__all__ = ["equations_of"]


def equations_of(diagram: Any, blocks: Collection[str], number: str = "") -> list[Equation]:
    """Return the equations of some blocks of a diagram.

    Parameters
    ----------
    diagram : control.InputOutputSystem
    blocks : collection of str
        Names of the blocks, with the diagrams around them.
    number : str, optional
        Printed beside the first equation of each block.

    Returns
    -------
    list of Equation
        Of each block its states, its outputs, and what their symbols stand for.

    Raises
    ------
    CompileError
        If a block has no formula.
    """
    found: list[Equation] = []
    for block in native.typeset(diagram, values=True):
        if block.block in blocks:
            lines = [*block.equations, *block.where]
            found += [
                Equation(latex=line, number="" if i else number) for i, line in enumerate(lines)
            ]
    return found
