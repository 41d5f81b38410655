"""Linearization of a diagram, compiled or not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import control as ct

from ..annotations import as_annotated
from ..attributes import with_parameters_of
from ..upstream.systems import System
from .compiled import Compiled, as_compiled


@as_annotated
@with_parameters_of(Compiled.linearize)
def linearize(
    system: System,
    x0: Any,
    u0: Any = None,
    t: float = 0.0,
    params: Mapping[str, Any] | None = None,
    *,
    copy_names: bool = True,
    **names: Any,
) -> ct.StateSpace:
    """Linearize a diagram at a point, with exact derivatives of its equations.

    Parameters
    ----------
    system : control.InputOutputSystem or Compiled
        A diagram, or what `compile` made of it.

    Returns
    -------
    control.StateSpace
        In continuous time; of a diagram with sampled blocks in discrete time, the map over the
        common period of their clocks, whose delays are states of it.  At a kink it has the slopes
        of the side that the point belongs to.

    Raises
    ------
    AlgebraicLoopError
        If signals depend on each other without a state in between.
    CompileError
        If the diagram cannot be compiled.
    ParameterError
        If an argument is refused, or the clocks have no common period.
    UnknownKeywordError, UsageError
        If there is no such keyword; if signals are delayed, whose past is not a state.

    Warns
    -----
    InexactWarning
        If a function is called as it stands: its derivatives are differences, all others exact.

    Examples
    --------
    A lag behind a zero-order hold is what ``ct.sample_system`` makes of it:

    >>> import control as ct
    >>> lag = ct.ss(-1, 1, 1, 0, inputs="v", outputs="y", name="lag")
    >>> hold = nlctl.sampled(ct.ss([], [], [], 1.0, 0.1, inputs="u", outputs="v", name="hold"))
    >>> held = nlctl.interconnect([lag, hold], inputs=["u"], outputs=["y"])
    >>> linear = nlctl.linearize(held, 0)
    >>> print(linear.dt, linear.A[0, 0].round(6), linear.B[0, 0].round(6))  # exp(-0.1), 1 - it
    0.1 0.904837 0.095163
    """
    made = as_compiled(system, params)
    return made.linearize(x0, u0, t, params, copy_names=copy_names, **names)
