"""Derivatives of a run: what is asked, and what is returned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import control as ct
from numpy.typing import ArrayLike

from ..annotations import as_annotated
from ..arguments import one_of, tolerances
from ..native import Compiled, Tableau, compile  # noqa: A004 (what it does)
from ..native.diagram.checks import sized
from ..native.settings import solver_settings
from ..params import checked_times
from ..responses.arguments import HOLDS, checked_params, with_aliases
from .record import SensitivityResponse
from .run import RunWithDerivatives, differentiated_run


@as_annotated
def sensitivity_response(
    diagram: ct.NonlinearIOSystem | Compiled,
    timepts: ArrayLike | None = None,
    inputs: Any = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    with_respect_to: Sequence[str] | str,
    of: Sequence[str] | str | None = None,
    hold: str = "foh",
    params: Mapping[str, Any] | None = None,
    method: str | Tableau | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    max_steps: int | None = None,
    max_step: float | None = None,
    audit: object = True,
    **aliases: object,
) -> SensitivityResponse:
    """Simulate a diagram together with its derivatives by parameters and initial states.

    Forward sensitivities: the derivative of the whole program is integrated with it, under one
    error control.  At conditions of the equations, guards, switching memories and ideal relays
    that begin to slide the derivatives jump (saltation); memories, samples and delays have those
    of what they keep.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem or Compiled
        A diagram, or what `nlctl.compile` made of it; compile once for many runs.
    timepts : array_like of shape (m,), optional
        Times in s at which inputs are given, and signals and derivatives are computed; they are
        needed, under this name or as ``T``.
    inputs : array_like, list or float, optional
        Inputs over `timepts`, as in `nlctl.input_output_response`; also ``U``.
    initial_state : mapping, array_like or float, optional
        As there; also ``X0``.
    with_respect_to : sequence of str or str
        Parameters, ``"law.beta"`` or ``"law.K[1]"``, and initial states, ``"plant.x1(0)"``.
    of : sequence of str or str, optional
        Outputs of the diagram, outputs of its blocks, ``"plant.y"``, and states; by default the
        outputs of the diagram.
    hold : {"foh", "zoh"}, optional
        What inputs are between `timepts`, as in `nlctl.input_output_response`: linear, or held.
    params : mapping, optional
        Overrides by qualified name.
    method : str or Tableau, optional
        Of machine code, as in `nlctl.input_output_response`.
    rtol, atol : float, optional
        Tolerances, for states and for derivatives times the size of what they are taken by.
    max_steps : int, optional
        Attempted steps after which a run is given up.
    max_step : float, optional
        Longest step (s).
    audit : bool or "every run", optional
        As in `nlctl.input_output_response`.
    **aliases : object
        python-control's short names: ``T``, ``U``, ``X0``.

    Returns
    -------
    SensitivityResponse
        ``response["plant.y", "law.beta"]`` over ``response.time``.  Where there is no derivative
        it is NaN from there on, and ``response.missing`` says when, where and why: a condition
        that is met at a rate of 0 (grazing), two at one instant, a start on a condition, a memory
        that is touched at its end by a corner, switches without end, a jump that comes back through
        a delay that varies.  An output with a corner of its own, as a norm at 0, has none there,
        and has one again behind it.

    Raises
    ------
    UnknownNameError, AmbiguousNameError
        If a name is not that of exactly one signal, parameter or state.
    CompileError, AlgebraicLoopError
        If the diagram cannot be compiled, is in discrete time, or something in it has no
        derivative: a parameter that numbers follow from outside of the equations, one that says
        when samples are taken, a delay where one varies or has a history or where blocks are
        sampled, an algebraic loop that jumps, a condition or a memory behind a delay that varies or
        has samples in it, a memory that another one moves through a delay.
    ParameterError
        If a value is refused.
    DivergedError
        If the state becomes infinite or NaN.
    AuditError
        If machine code and python-control differ.

    Warns
    -----
    InexactWarning
        If a function is called unchanged: its derivatives are differences.

    Examples
    --------
    x' = 1 + (x > p) from 0: behind t = p it is 2 t - p, and its derivative by p is -1.

    >>> import control as ct
    >>> import numpy as np
    >>> plant = ct.nlsys(
    ...     lambda t, x, u, params: [1 + np.where(x[0] > params["p"], 1.0, 0.0)],
    ...     states=["x"], inputs=0, params={"p": 0.5}, name="plant",
    ... )
    >>> made = nlctl.sensitivity_response(
    ...     plant, [0, 0.25, 1], of=["plant.x"], with_respect_to=["plant.p", "plant.x(0)"]
    ... )
    >>> print(made["plant.x", "plant.p"].round(6), made["plant.x", "plant.x(0)"].round(6))
    [ 0.  0. -1.] [1. 1. 2.]
    """
    named = {"timepts": timepts, "inputs": inputs, "initial_state": initial_state}
    named = with_aliases(named, aliases, sensitivity_response)
    checked_params(params)
    tolerances("sensitivity_response", rtol, atol)
    one_of("sensitivity_response", "hold", hold, HOLDS)
    settings = solver_settings(
        method=method, solve_ivp_method=None, solve_ivp_kwargs=None, rtol=rtol, atol=atol,
        max_steps=max_steps, max_step=max_step,
    )  # fmt: skip
    run = RunWithDerivatives(
        times=checked_times(named["timepts"]), inputs=named["inputs"],
        initial_state=named["initial_state"], params=params, of=of,
        with_respect_to=with_respect_to, hold=hold, settings=settings, audit=audit,
    )  # fmt: skip
    if not isinstance(diagram, Compiled):
        diagram = compile(sized(diagram, run.times, run.inputs, run.initial_state), params=params)
    return differentiated_run(diagram, run)
