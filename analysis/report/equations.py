"""The equations of blocks as they were run, read from their functions: nothing is typed by hand."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from nlctl import native
from nlctl.upstream.systems import System

from .document import Equation, Item, Paragraph


def equations_of(diagram: System, blocks: Collection[str], number: str = "") -> list[Item]:
    """Return the equations of some blocks of a diagram, with values in the places of parameters."""
    return [
        item
        for block in native.typeset(diagram, values=True)
        if block.block in blocks
        for item in block_items(block, number)
    ]


def block_items(block: native.BlockEquations, number: str = "") -> Iterator[Item]:
    """Yield a block's equations, and what their symbols stand for."""
    for i, line in enumerate((*block.inputs, *block.equations)):
        yield Equation(latex=line, number="" if i else number)
    if block.where:
        yield Paragraph(text="where")
        yield from (Equation(latex=line) for line in block.where)
