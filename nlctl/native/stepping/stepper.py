"""A diagram whose inputs are chosen step by step: for reinforcement learning and MPC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from ...annotations import as_annotated
from ...arguments import ATOL, RTOL, number
from ...errors import DivergedError, ParameterError, UsageError
from ...params import as_numbers
from ...responses.arguments import checked_params, state_array
from ...upstream.systems import System
from ...wording import counted
from ..compiled import Compiled, as_compiled
from ..floats import with_every_float
from ..integrate.methods.tableau import Tableau
from ..own_errors import own_error
from ..response import failure
from ..settings import Settings, settings_of
from .held import HeldRun
from .sampled_run import SampledRun

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True, eq=False)
class StepperState:
    """All that a stepper knows at a time: states, memories, clocks, delays, steps of its method.

    Attributes
    ----------
    time : float
        Time (s).
    states : ndarray of shape (nstates,)
        The states of the diagram there.

    Notes
    -----
    ``stepper.snapshot()`` returns one and ``stepper.restore(state)`` goes back to it, any number
    of times, in the same stepper.

    Examples
    --------
    >>> lag = nlctl.stepper(nlctl.block(nlctl.Lag(T=1.0), "lag"), 0.1)
    >>> here = lag.snapshot()
    >>> print(lag.step(1.0).round(6), lag.time, here.time)
    [0.095163] 0.1 0.0
    >>> lag.restore(here)
    >>> print(lag.step(-1.0).round(6))
    [-0.095163]
    """

    time: float
    states: np.ndarray
    params: Mapping[str, Any] | None = field(repr=False)
    failed: DivergedError | None = field(repr=False)
    kept: Any = field(repr=False)
    owner: object = field(repr=False)


class Stepper:
    """A run that continues whenever it is given inputs for another step; made by `stepper`.

    Attributes
    ----------
    compiled : Compiled
        The diagram.
    dt : float
        Length of a step (s).
    success : bool
        False once a run has ended early: its outputs are NaN until `reset` or `restore`.
    message : str or None
        Why it has.

    Examples
    --------
    >>> tank = nlctl.stepper(nlctl.block(nlctl.Lag(T=1.0), "tank"), 0.1)
    >>> y = tank.reset({"tank.v": 0.5})
    >>> for _ in range(10):
    ...     y = tank.step(2.0 * (1.0 - y))
    >>> print(tank.time, y.round(4))
    1.0 [0.6609]
    """

    def __init__(self, compiled: Compiled, dt: float, settings: Settings, form: Any) -> None:
        self.compiled, self.dt = compiled, dt
        continuous = ct.isctime(compiled.system)
        self.run = HeldRun(compiled, dt, settings) if continuous else SampledRun(compiled, dt)
        self._audit, self._ignores = form
        self._failed: DivergedError | None = None
        self.reset()

    @property
    def time(self) -> float:
        """Time that is reached (s)."""
        return self.run.time

    @property
    def states(self) -> np.ndarray:
        """States at that time, shape (nstates,): before samples that are due there."""
        return self.run.states.copy()

    @property
    def success(self) -> bool:
        """Whether the run has not ended early."""
        return self._failed is None

    @property
    def message(self) -> str | None:
        """Why it has."""
        return None if self._failed is None else str(self._failed)

    @property
    def events(self) -> pd.DataFrame:
        """What has happened in the last step: time (s), block, which, direction."""
        return self.run.events().table()

    @as_annotated
    def reset(
        self,
        initial_state: Mapping[str, float] | Any = None,
        params: Mapping[str, Any] | None = None,
        *,
        inputs: ArrayLike = 0.0,
        time: float = 0.0,
    ) -> np.ndarray:
        """Begin again.

        Parameters
        ----------
        initial_state : mapping, array_like or float, optional
            As in `input_output_response`.
        params : mapping, optional
            Qualified parameters of the run that begins.
        inputs : array_like, optional
            With which the outputs that are returned are computed, where inputs act on outputs at
            once; the run itself begins with those of the first step.
        time : float, optional
            At which the run begins (s).

        Returns
        -------
        ndarray of shape (noutputs,)
            The outputs at the beginning, before samples that are due there.

        Raises
        ------
        ParameterError, UnknownNameError
            If an argument is refused.
        UsageError
            If a value that a function reads from around it has changed since.
        """
        u = self._inputs(inputs)
        checked_params(params)
        x0 = state_array(self.compiled.system, initial_state)
        return begun(self, (x0, self.compiled.parameter_vector(params)), params, time, u)

    @as_annotated
    def step(self, inputs: ArrayLike = 0.0) -> np.ndarray:
        """Hold inputs for a step.

        Parameters
        ----------
        inputs : array_like, optional
            One number for each input, or one for all; NaN ends the run.

        Returns
        -------
        ndarray of shape (noutputs,)
            The outputs at its end, while the inputs still hold: what is due there to sampled blocks
            happens with the next inputs.

        Raises
        ------
        DivergedError
            If the step does not reach its end: the state becomes infinite or NaN, the run chatters
            (`ChatteringError`), or jumps follow each other ever faster (`ZenoError`).  With
            ``ignore_errors`` the outputs are NaN instead, and `message` says why.
        UsageError
            If the run has ended before, and nobody has called `reset` or `restore`.
        ParameterError
            If the inputs are not numbers, or not as many as there are inputs.
        AuditError
            If machine code and python-control differ, in the first step behind a `reset`.
        """
        u = self._inputs(inputs)
        if self._failed is not None:
            return self._ended()
        before, start = self.run.states, self.run.k == 0
        outputs = self.run.advance(u)
        if start and not self._compared and outputs is not None:
            self._compared = True
            self.run.compared(before, self._params, self._audit)
        return failed(self) if outputs is None else outputs

    @as_annotated
    def rollout(self, inputs: ArrayLike) -> np.ndarray:
        """Return what would come of inputs, and stay where the run is.

        Parameters
        ----------
        inputs : array_like of shape (ninputs, m) or (m,)
            Inputs of m steps; (m,) for one input.

        Returns
        -------
        ndarray of shape (noutputs, m)
            Outputs at the ends of these steps; NaN from where on the run does not go.

        Raises
        ------
        ParameterError
            If the inputs have another shape.
        """
        count = self.compiled.system.ninputs or 0
        columns = as_numbers(inputs)
        columns = (
            columns[None, :]
            if columns is not None and columns.ndim == 1 and count == 1
            else columns
        )
        if columns is None or columns.ndim != 2 or columns.shape[0] != count:
            raise ParameterError(
                f"rollout needs inputs of shape ({count}, m), one column a step, got "
                f"{'no numbers' if columns is None else columns.shape}"
            )
        here = self.snapshot()
        rows = np.full((self.compiled.system.noutputs or 0, columns.shape[1]), np.nan)
        for k, u in enumerate(np.ascontiguousarray(columns.T, dtype=float)):
            outputs = None if self._failed is not None else self.run.advance(u)
            if outputs is None:
                break
            rows[:, k] = outputs
        self.restore(here)
        return rows

    def snapshot(self) -> StepperState:
        """Return all that the stepper knows, to come back to.

        Returns
        -------
        StepperState
            It does not change when the run continues.
        """
        run, states = self.run, self.run.states.copy()
        states.flags.writeable = False
        return StepperState(
            time=run.time, states=states, params=self._params, failed=self._failed,
            kept=run.keep(), owner=run,
        )  # fmt: skip

    @as_annotated
    def restore(self, state: StepperState) -> None:
        """Go back to where the stepper was.

        Parameters
        ----------
        state : StepperState
            Of `snapshot`, from before or behind.

        Raises
        ------
        ParameterError
            If it is that of another stepper.
        """
        if not isinstance(state, StepperState) or state.owner is not self.run:
            raise ParameterError(
                f"restore needs a state that snapshot() of this stepper has returned, got "
                f"{'one of another' if isinstance(state, StepperState) else repr(state)}"
            )
        self.run.go_back(state.kept)
        self._params, self._failed = state.params, state.failed

    def __repr__(self) -> str:
        system = self.compiled.system
        return (
            f"Stepper of '{system.name}': steps of {self.dt:g} s, "
            f"{counted(system.ninputs or 0, 'input')}, {counted(system.noutputs or 0, 'output')}, "
            f"{counted(system.nstates or 0, 'state')}, at t = {self.time:g} s"
            + ("" if self._failed is None else f"; {self._failed}")
        )

    def _inputs(self, inputs: object) -> np.ndarray:
        """Return the inputs of a step, shape (ninputs,)."""
        count = self.compiled.system.ninputs or 0
        given = as_numbers(inputs)
        if given is not None and given.ndim == 0:
            return np.full(count, float(given))
        if given is None or given.shape != (count,):
            names = ", ".join(self.compiled.system.input_labels)
            raise ParameterError(
                f"step needs {counted(count, 'number')} for the inputs ({names}), got {inputs!r}"
            )
        return given.astype(float)

    def _ended(self) -> np.ndarray:
        """Return the outputs of a run that has ended."""
        if not self._ignores:
            raise UsageError(f"{self.message}: call reset() or restore(state) to continue")
        return np.full(self.compiled.system.noutputs or 0, np.nan)


def begun(
    one: Stepper,
    start: tuple[np.ndarray, np.ndarray],
    params: Mapping[str, Any] | None,
    time: float,
    u: np.ndarray,
) -> np.ndarray:
    """Begin again with a state and a vector of parameters; return the outputs with inputs `u`."""
    one.run.begin(*start, number("reset", "time", time))
    one._params, one._failed, one._compared = params, None, False
    return one.run.shown(u)


def failed(one: Stepper) -> np.ndarray:
    """Note why a run has ended; raise it, or return NaN where errors are ignored."""
    result, t = one.run.ended(), one.run.time
    one._failed = failure(one.compiled, result, one.run.p, one._params) or DivergedError(
        f"'{one.compiled.system.name}' diverged: no finite outputs at t = {t:.6g} s", t
    )
    if one._ignores:
        return one._ended()
    raise own_error(one.compiled, result, one._params) or one._failed


@as_annotated
def stepper(
    system: System | Compiled,
    dt: float,
    *,
    method: str | Tableau | None = None,
    rtol: float = RTOL,
    atol: float = ATOL,
    max_steps: int | None = None,
    max_step: float | None = None,
    step: float | None = None,
    ignore_errors: bool = False,
    audit: object = True,
) -> Stepper:
    """Make of a diagram what can be simulated step by step, with inputs chosen on the way.

    Parameters
    ----------
    system : control.InputOutputSystem or Compiled
        A diagram, or what `compile` made of it.
    dt : float
        Length of a step (s), over which inputs are held; of a diagram in discrete time its own.
    method : str or Tableau, optional
        As in `input_output_response`.
    rtol, atol : float, optional
        Tolerances of the integrator.
    max_steps : int, optional
        Attempted steps of the integrator after which a run is given up.
    max_step : float, optional
        Longest step of the integrator (s).
    step : float, optional
        A fixed step of the integrator (s); 0 for error control.
    ignore_errors : bool, optional
        Return NaN where a step does not reach its end, instead of raising.
    audit : bool or "every run", optional
        As in `input_output_response`; what is compared is the first step of a run.

    Returns
    -------
    Stepper
        At t = 0, in the diagram's own initial state.

    Raises
    ------
    CompileError, AlgebraicLoopError
        If the diagram cannot be compiled.
    ParameterError, UnknownNameError
        If an argument is refused; if a diagram in discrete time has another `dt`.

    Notes
    -----
    n steps are one run over n `dt` with ``hold="zoh"``, with the same numbers: memories, clocks,
    delays, events and the steps of the integrator continue unchanged.  Where it matters
    to the integrator how long the whole run is, they are the same to the tolerances: with functions
    of t alone, with event functions in steps below 1e-7 of the run, and without any input.

    A stepper is for one thread; several of one `Compiled` share its machine code.

    Examples
    --------
    >>> lag = nlctl.stepper(ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="lag"), dt=0.5)
    >>> lag.reset()
    array([0.])
    >>> [lag.step(u).round(6).item() for u in (1.0, 0.0)]  # 1 - exp(-0.5), times exp(-0.5)
    [0.393469, 0.238651]
    """
    dt = number("stepper", "dt", dt, above=0)
    settings = settings_of(
        method, rtol=rtol, atol=atol, max_steps=max_steps, max_step=max_step, step=step
    )
    compiled = with_every_float(as_compiled(system))
    period = compiled.system.dt
    if not ct.isctime(compiled.system) and period is not True and not np.isclose(period, dt):
        raise ParameterError(
            f"stepper needs dt={period:g} for '{compiled.system.name}', which is in discrete time, "
            f"got {dt:g}"
        )
    return Stepper(compiled, dt, settings, (audit, ignore_errors))
