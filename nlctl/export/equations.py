"""A whole diagram in continuous time as code: its rates, its outputs, what it switches at."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import control as ct

from .. import native
from ..annotations import as_annotated
from ..diagrams import initial_state as state_of
from ..native.floats import with_every_float
from . import words
from .source import ExportedEquations


@as_annotated
def export_equations(
    diagram: ct.InterconnectedSystem,
    *,
    params: Mapping[str, Any] | None = None,
    initial_state: Mapping[str, float] | None = None,
    name: str | None = None,
) -> ExportedEquations:
    """Read a diagram in continuous time as functions in C: rates, outputs, switching functions.

    Parameters
    ----------
    diagram : control.InterconnectedSystem
        In continuous time.
    params : mapping, optional
        Parameters by qualified names, on top of those of the diagram.
    initial_state : mapping of str to float, optional
        Initial states by name; by default those that blocks declare.
    name : str, optional
        In front of all names in C; by default that of the diagram.

    Returns
    -------
    ExportedEquations
        For `c_files`.

    Raises
    ------
    ParameterError
        If the name is none in C.
    CompileError
        If functions in C cannot say it: sampled blocks, resets, transport delays, functions that
        are called, loops without a fixed number of passes, a search for signals of an algebraic
        loop, discrete time, other integers in `params` that steer equations.

    Examples
    --------
    >>> import nlctl
    >>> equations = export_equations(nlctl.paper.example_1(), name="example_1")
    >>> equations.states[:2]
    ('plant_x1', 'plant_x2')
    """
    compiled = with_every_float(native.compile(diagram))
    what = str(diagram.name)
    _check_continuous(compiled, what)
    p = compiled.parameter_vector(params)
    words.check_written_out(compiled, what, p)
    words.check_integers(compiled, p, what)
    values, start = words.parameter_values(compiled, p), state_of(diagram, initial_state)
    labels, lowered = tuple(compiled.state_labels or ()), compiled.lowered
    return ExportedEquations(
        name=words.c_name(name, what), inputs=tuple(diagram.input_labels or ()),
        outputs=tuple(diagram.output_labels or ()), states=labels,
        memory=tuple(labels[i] for i in compiled.program.memory), conditions=lowered.rows["g"],
        parameters=values, initial_state=start, lowered=lowered,
        digest=words.digest(lowered.text, values, start),
    )  # fmt: skip


def _check_continuous(compiled: native.Compiled, what: str) -> None:
    """Refuse what three functions cannot say."""
    words.refuse_if_any(what, {
        "is in discrete time": not ct.isctime(compiled),
        "has sampled blocks: export each with its block": bool(compiled.program.clocks),
        "has resets": bool(compiled.program.guards),
        "has transport delays": bool(compiled.schedule.lines),
    })  # fmt: skip
