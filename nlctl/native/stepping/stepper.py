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
from ...responses.event_log import NO_EVENTS
from ...upstream.systems import System
from ...wording import counted
from ..audit import Audit, Trial
from ..audit import audit as compare
from ..compiled import Compiled, as_compiled
from ..integrate.methods.tableau import Tableau
from ..integrate.state import Status
from ..machine.evaluations import prepared_parameters
from ..own_errors import own_error
from ..response import failure
from ..results import Statistics, Trajectory
from ..settings import Settings
from .held import HeldRun


@dataclass(frozen=True, kw_only=True, eq=False)
class KeptSample:
    """What a run in discrete time was before a step."""

    k: int
    states: np.ndarray


class SampledRun:
    """x[k+1] = f(t[k], x[k], u[k]), and y = h(t[k+1], x[k+1], u[k]) while u[k] still holds."""

    def __init__(self, compiled: Compiled, dt: float) -> None:
        self.compiled, self.dt = compiled, dt
        self.k, self.start = 0, 0.0
        self.states, self.inputs = np.zeros(0), np.zeros(0)
        self.p = np.zeros(0)

    @property
    def time(self) -> float:
        """Time that is reached (s)."""
        return float(self.start + self.dt * self.k)

    def begin(self, x0: np.ndarray, p: np.ndarray, start: float) -> None:
        """Stand at the initial state."""
        self.p, self.k, self.start, self.states = p, 0, start, x0.copy()
        self.inputs = np.zeros(self.compiled.system.ninputs or 0)
        self.code, self.c = prepared_parameters(self.compiled, p)
        rows = self.code.lowered.rows
        self._given = np.zeros(1), np.zeros((x0.size, 1)), np.zeros((self.inputs.size, 1))
        self._made = np.zeros((x0.size, 1)), *(np.zeros((rows[name], 1)) for name in "gm")
        self._y = np.zeros((self.compiled.system.noutputs or 0, 1))

    def shown(self, u: np.ndarray) -> np.ndarray:
        """Return the outputs where the run stands, with inputs `u`."""
        self._give(u)
        self.code.out(*self._given, self.c, self._y)
        self.code.check(self.c)
        return self._y[:, 0].copy()

    def advance(self, u: np.ndarray) -> np.ndarray | None:
        """Go on for a step; return the outputs at its end, None if they are not finite."""
        self._give(u)
        with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the result says
            self.code.rhs(*self._given, self.c, *self._made)
            self.code.check(self.c)
            states = self._made[0][:, 0].copy()
            if not np.isfinite(states).all():
                return None
            self.states, self.inputs, self.k = states, u, self.k + 1
            outputs = self.shown(u)
        return outputs if np.isfinite(outputs).all() else None

    def _give(self, u: np.ndarray) -> None:
        t, x, given = self._given
        t[0], x[:, 0], given[:, 0] = self.time, self.states, u

    def keep(self) -> KeptSample:
        """Return all that the run knows."""
        return KeptSample(k=self.k, states=self.states)

    def go_back(self, kept: KeptSample) -> None:
        """Stand where the run once stood."""
        self.k, self.states = kept.k, kept.states

    def compared(self, x0: np.ndarray, params: Any, audit: Audit) -> None:
        """Compare the program with python-control at both ends of the step that was made."""
        u = np.repeat(self.inputs[:, None], 2, axis=1)
        trial = Trial(
            time=np.array([self.time - self.dt, self.time]), p=self.p, params=params, width=1,
            states=np.column_stack([x0, self.states]), inputs=u,
        )  # fmt: skip
        compare(self.compiled, trial, audit)

    def ended(self) -> Trajectory:
        """Return the step in which the run has ended, as a run."""
        statistics = Statistics(status=Status.DIVERGED, time=self.time, accepted=0, rejected=0)
        return Trajectory(
            time=np.array([self.time]), outputs=np.zeros((0, 1)), states=self.states[:, None],
            statistics=statistics, inputs=self.inputs[:, None],
        )  # fmt: skip


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
    >>> import numpy as np
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
        self._run = HeldRun(compiled, dt, settings) if continuous else SampledRun(compiled, dt)
        self._audit, self._ignores = form
        self._failed: DivergedError | None = None
        self.reset()

    @property
    def time(self) -> float:
        """Time that is reached (s)."""
        return self._run.time

    @property
    def states(self) -> np.ndarray:
        """States at that time, shape (nstates,): before samples that are due there."""
        return self._run.states.copy()

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
        log = self._run.events() if isinstance(self._run, HeldRun) else NO_EVENTS
        return log.table()

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
        p = self.compiled.parameter_vector(params)
        self._run.begin(x0, p, number("reset", "time", time))
        self._params, self._failed, self._compared = params, None, False
        return self._run.shown(u)

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
        before, start = self._run.states, self._run.k == 0
        outputs = self._run.advance(u)
        if start and not self._compared and outputs is not None:
            self._compared = True
            self._run.compared(before, self._params, self._audit)
        return self._fail() if outputs is None else outputs

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
        given = as_numbers(inputs)
        given = given[None, :] if given is not None and given.ndim == 1 and count == 1 else given
        if given is None or given.ndim != 2 or given.shape[0] != count:
            raise ParameterError(
                f"rollout needs inputs of shape ({count}, m), one column a step, got "
                f"{'no numbers' if given is None else given.shape}"
            )
        here = self.snapshot()
        rows = np.full((self.compiled.system.noutputs or 0, given.shape[1]), np.nan)
        for k, u in enumerate(np.ascontiguousarray(given.T, dtype=float)):
            outputs = None if self._failed is not None else self._run.advance(u)
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
        run, states = self._run, self._run.states.copy()
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
        if not isinstance(state, StepperState) or state.owner is not self._run:
            raise ParameterError(
                f"restore needs a state that snapshot() of this stepper has returned, got "
                f"{'one of another' if isinstance(state, StepperState) else repr(state)}"
            )
        self._run.go_back(state.kept)
        self._params, self._failed = state.params, state.failed

    def __repr__(self) -> str:
        system = self.compiled.system
        return (
            f"Stepper of '{system.name}': steps of {self.dt:g} s, "
            f"{counted(system.ninputs or 0, 'input')}, {counted(system.noutputs or 0, 'output')}, "
            f"{counted(system.nstates or 0, 'state')}, at t = {self.time:g} s"
            + ("" if self._failed is None else f"; {self._failed}")
        )

    def _inputs(self, inputs: Any) -> np.ndarray:
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

    def _fail(self) -> np.ndarray:
        """Note why the run has ended; raise it, or return NaN."""
        result, p = self._run.ended(), self._run.p
        name, t = self.compiled.system.name, self._run.time
        self._failed = failure(self.compiled, result, p, self._params) or DivergedError(
            f"'{name}' diverged: no finite outputs at t = {t:.6g} s", t
        )
        if self._ignores:
            return self._ended()
        raise own_error(self.compiled, result, self._params) or self._failed

    def _ended(self) -> np.ndarray:
        """Return the outputs of a run that has ended."""
        if not self._ignores:
            raise UsageError(f"{self.message}: call reset() or restore(state) to continue")
        return np.full(self.compiled.system.noutputs or 0, np.nan)


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
    audit: Any = True,
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
    >>> import control as ct
    >>> lag = nlctl.stepper(ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="lag"), dt=0.5)
    >>> lag.reset()
    array([0.])
    >>> [lag.step(u).round(6).item() for u in (1.0, 0.0)]  # 1 - exp(-0.5), times exp(-0.5)
    [0.393469, 0.238651]
    """
    dt = number("stepper", "dt", dt, above=0)
    given = {"max_steps": max_steps, "max_step": max_step, "step": step}
    settings = Settings(
        rtol=rtol, atol=atol, method="auto" if method is None else method,
        **{name: value for name, value in given.items() if value is not None},
    )  # fmt: skip
    compiled = as_compiled(system)
    period = compiled.system.dt
    if not ct.isctime(compiled.system) and period is not True and not np.isclose(period, dt):
        raise ParameterError(
            f"stepper needs dt={period:g} for '{compiled.system.name}', which is in discrete time, "
            f"got {dt:g}"
        )
    return Stepper(compiled, dt, settings, (audit, ignore_errors))
