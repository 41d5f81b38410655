"""A whole diagram in continuous time as code: its rates, its outputs, what it switches at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from .. import native
from ..annotations import as_annotated
from ..diagrams import initial_state as state_of
from ..errors import CompileError
from ..native.lower import Lowered
from .source import equations_header, equations_source
from .words import c_name, check_written_out, digest, parameter_values


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportedEquations:
    """The equations of a diagram as code, for an integrator of one's own.

    Attributes
    ----------
    name : str
        In front of all its names in C.
    inputs, outputs, states : tuple of str
        Labels, in the order of their arrays.
    memory : tuple of str
        States that jump after each accepted step, to what ``rates`` writes to `m`.
    conditions : int
        Numbers in `g`: where one changes its sign, steps should end.
    parameters : mapping of str to float
        Every number of them by its name, in the order of their array.
    initial_state : ndarray of shape (states,)
    lowered : Lowered
        The plan that the code is written from.
    digest : str
        A key of all this: the same for the same program and numbers.

    Examples
    --------
    See `export_equations`.
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    memory: tuple[str, ...]
    conditions: int
    parameters: Mapping[str, float]
    initial_state: np.ndarray
    lowered: Lowered
    digest: str

    @property
    def header(self) -> str:
        """Its header file, C99."""
        return equations_header(self)

    @property
    def source(self) -> str:
        """Its source file, C99."""
        return equations_source(self)


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
    params : mapping, optional
        Parameters by qualified names, on top of those of the diagram.
    initial_state : mapping of str to float, optional
        Initial states by name; by default those that blocks declare.
    name : str, optional
        In front of all names in C; by default that of the diagram.

    Returns
    -------
    ExportedEquations
        With ``header`` and ``source``.

    Raises
    ------
    ParameterError
        If the name is none in C.
    CompileError
        If functions in C cannot say it: sampled blocks, resets, transport delays, functions that
        are called, a search for signals of an algebraic loop, discrete time.

    Examples
    --------
    >>> import nlctl
    >>> equations = export_equations(nlctl.paper.example_1(), name="example_1")
    >>> "void example_1_rates(" in equations.source
    True
    """
    compiled = native.compile(diagram)
    what = str(diagram.name)
    check_written_out(compiled, what)
    _check_continuous(compiled, what)
    p = compiled.parameter_vector(params)
    values, start = parameter_values(compiled, p), state_of(diagram, initial_state)
    labels, lowered = tuple(compiled.state_labels or ()), compiled.lowered
    return ExportedEquations(
        name=c_name(what if name is None else name), inputs=tuple(diagram.input_labels or ()),
        outputs=tuple(diagram.output_labels or ()), states=labels,
        memory=tuple(labels[i] for i in compiled.program.memory), conditions=lowered.rows["g"],
        parameters=values, initial_state=start, lowered=lowered,
        digest=digest(lowered.text, values, start),
    )  # fmt: skip


def _check_continuous(compiled: native.Compiled, what: str) -> None:
    """Refuse what three functions cannot say."""
    reasons = {
        "is in discrete time": not ct.isctime(compiled),
        "has sampled blocks: export each with its block": bool(compiled.program.clocks),
        "has resets": bool(compiled.program.guards),
        "has transport delays": bool(compiled.schedule.lines),
    }
    for reason, holds in reasons.items():
        if holds:
            raise CompileError(f"'{what}' cannot be exported: it {reason}")
