"""Many runs of one diagram, step by step, as vector environments of reinforcement learning do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...annotations import as_annotated
from ...arguments import ATOL, RTOL
from ...attributes import with_parameters_of
from ...errors import ParameterError
from ...params import as_numbers, integer
from ...responses.arguments import checked_params
from ...upstream.systems import System
from ...wording import counted
from ..compiled import Compiled, as_compiled
from ..floats import with_every_float
from ..integrate.methods.tableau import Tableau
from ..members import members
from .held import HeldRun
from .pool import Pool
from .stepper import begun, failed, stepper
from .window import HELD_STEPS

if TYPE_CHECKING:
    import pandas as pd


class VectorStepper:
    """Runs of one diagram that continue together, each as a `Stepper` of its own.

    Attributes
    ----------
    compiled : Compiled
        The diagram.
    dt : float
        Length of a step (s).
    size : int
        Number of members.

    Examples
    --------
    >>> lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    >>> many = nlctl.vector_stepper(lag, 0.1, 3)
    >>> y = many.reset({"lag.v": np.array([0.0, 1.0, 2.0])}, {"lag.T": np.array([1.0, 1.0, 0.5])})
    >>> print(many.step(1.0).round(4).ravel(), many.reset(members=[2]).ravel())
    [0.0952 1.     1.8187] [0.09516258 1.         0.        ]
    """

    def __init__(self, compiled: Compiled, dt: float, size: int, **settings: Any) -> None:
        self.compiled, self.dt, self.size = compiled, dt, size
        self._members = [stepper(compiled, dt, ignore_errors=True, **settings) for _ in range(size)]
        runs = [one.run for one in self._members]
        held = [run for run in runs if isinstance(run, HeldRun)]
        self._pool = Pool(held) if held else None  # of one diagram, hence all or none
        self._y = np.zeros((size, compiled.system.noutputs or 0))
        self.reset()

    @property
    def time(self) -> np.ndarray:
        """Times that are reached (s), of shape (size,)."""
        return np.array([one.time for one in self._members])

    @property
    def states(self) -> np.ndarray:
        """States at these times, of shape (size, nstates): before samples that are due there."""
        return np.array([one.run.states for one in self._members])

    @property
    def success(self) -> np.ndarray:
        """Which runs have not ended early, of shape (size,)."""
        return np.array([one.success for one in self._members])

    @property
    def messages(self) -> tuple[str | None, ...]:
        """Why runs have ended early, None of those that have not."""
        return tuple(one.message for one in self._members)

    @property
    def events(self) -> pd.DataFrame:
        """What has happened in the last step: member, time (s), block, which, direction."""
        import pandas as pd

        tables = [one.events for one in self._members]
        for i, table in enumerate(tables):
            table.insert(0, "member", i)
        filled = [table for table in tables if len(table)] or tables[:1]
        return pd.concat(filled, ignore_index=True)

    @as_annotated
    def reset(
        self,
        initial_state: Mapping[str, Any] | Any = None,
        params: Mapping[str, Any] | None = None,
        *,
        members: ArrayLike | None = None,
        inputs: ArrayLike = 0.0,
        time: float = 0.0,
    ) -> np.ndarray:
        """Begin again, all runs or some.

        Parameters
        ----------
        initial_state : mapping or array_like, optional
            As in `ensemble_response`: ``{"plant.x1": array of shape (size,)}``, one state for all,
            or an array of shape (size, nstates).
        params : mapping, optional
            Parameters of the runs that begin: a number, or an array of shape (size,), by name.
        members : array_like, optional
            Which runs begin again: their numbers, or an array of shape (size,) of True and False;
            all by default.
        inputs : array_like, optional
            With which the outputs that are returned are computed, as `Stepper.reset` has it.
        time : float, optional
            At which these runs begin (s).

        Returns
        -------
        ndarray of shape (size, noutputs)
            The outputs at the beginning, of runs that continue those of their last step.

        Raises
        ------
        ParameterError, UnknownNameError
            If an argument is refused.
        UsageError
            If a value that a function reads from around it has changed since.
        """
        chosen, u = self._chosen(members), self._inputs("reset", inputs)
        x0, p, given = self._begins(initial_state, params)
        for i in chosen:
            self._y[i] = begun(self._members[i], (x0[:, i], p[:, i]), given(i), time, u[i])
        return self._y.copy()

    @as_annotated
    def step(self, inputs: ArrayLike = 0.0) -> np.ndarray:
        """Hold inputs for a step.

        Parameters
        ----------
        inputs : array_like, optional
            Of shape (size, ninputs); (size,) for one input; (ninputs,) or a number for all runs.

        Returns
        -------
        ndarray of shape (size, noutputs)
            The outputs at its end, as `Stepper.step` has them; NaN of runs that have ended early.

        Raises
        ------
        ParameterError
            If the inputs are not numbers of such a shape.
        AuditError
            If machine code and python-control differ, in the first step of a run.
        """
        u = self._inputs("step", inputs)
        together = self._together()
        if together.size and self._pool is not None:
            self._y[together] = self._pool.advance(together, u[together])
            for i in together[~np.isfinite(self._y[together]).all(axis=1)]:
                self._y[i] = failed(self._members[i])
        alone = np.ones(self.size, dtype=bool)
        alone[together] = False
        for i in np.flatnonzero(alone):
            self._y[i] = self._members[i].step(u[i])
        return self._y.copy()

    def __repr__(self) -> str:
        system = self.compiled.system
        return (
            f"VectorStepper of '{system.name}': {counted(self.size, 'member')}, steps of "
            f"{self.dt:g} s, {counted(system.ninputs or 0, 'input')}, "
            f"{counted(system.noutputs or 0, 'output')}, {counted(system.nstates or 0, 'state')}"
        )

    def _together(self) -> np.ndarray:
        """Return which runs are in the middle of a window, in the arrays that they share."""
        if self._pool is None:
            return np.zeros(0, dtype=int)
        pool = self._pool
        numbers = [
            i for i, run in enumerate(pool.runs)
            if self._members[i].success and run.k
            and run.k < run.window.first + HELD_STEPS and pool.adopt(i)
        ]  # fmt: skip
        return np.array(numbers, dtype=int)

    def _begins(self, initial_state: object, params: object) -> tuple[np.ndarray, np.ndarray, Any]:
        """Return states and parameter vectors by columns, and what gives the parameters of one."""
        every = members(self.compiled, checked_params(params) or {}, initial_state)
        if every.size not in (1, self.size):
            raise ParameterError(
                f"reset needs arrays with a value for each of {counted(self.size, 'member')}, got "
                f"{every.size}"
            )
        x0, p = every.batch(range(every.size), self.size)
        return x0, p, lambda i: every.given(min(i, every.size - 1)) or None

    def _chosen(self, members: object) -> np.ndarray:
        """Return the numbers of the runs that begin again."""
        if members is None:
            return np.arange(self.size)
        numbers = np.atleast_1d(np.asarray(members))
        if numbers.dtype == bool and numbers.shape == (self.size,):
            return np.flatnonzero(numbers)
        if not numbers.size:
            return np.zeros(0, dtype=int)
        whole = numbers.dtype.kind in "iu" and numbers.ndim == 1
        if whole and numbers.min() >= 0 and numbers.max() < self.size:
            return np.unique(numbers)
        raise ParameterError(
            f"reset needs members to be numbers from 0 to {self.size - 1}, or {self.size} of True "
            f"and False, got {members!r}"
        )

    def _inputs(self, who: str, inputs: object) -> np.ndarray:
        """Return inputs of shape (size, ninputs)."""
        count = self.compiled.system.ninputs or 0
        rows = as_numbers(inputs)
        if rows is not None and count == 1 and rows.shape == (self.size,):
            rows = rows[:, None]
        if rows is None or rows.shape not in ((), (count,), (self.size, count)):
            shape = "no numbers" if rows is None else f"shape {rows.shape}"
            names = ", ".join(self.compiled.system.input_labels)
            raise ParameterError(
                f"{who} needs inputs of shape ({self.size}, {count}), members by inputs ({names}), "
                f"or one row for all, got {shape}"
            )
        return np.array(np.broadcast_to(rows, (self.size, count)))


@as_annotated
@with_parameters_of(stepper)
def vector_stepper(
    system: System | Compiled,
    dt: float,
    size: int,
    *,
    method: str | Tableau | None = None,
    rtol: float = RTOL,
    atol: float = ATOL,
    max_steps: int | None = None,
    max_step: float | None = None,
    step: float | None = None,
    audit: object = True,
) -> VectorStepper:
    """Make of a diagram many runs that are simulated together, step by step.

    Parameters
    ----------
    dt : float
        Length of a step (s), as in `stepper`.
    size : int
        Number of members.
    audit : bool or "every run", optional
        As in `stepper`, for each member.

    Returns
    -------
    VectorStepper
        At t = 0, all members in the diagram's own initial state.

    Raises
    ------
    CompileError, AlgebraicLoopError
        If the diagram cannot be compiled.
    ParameterError, UnknownNameError
        If an argument is refused, as by `stepper`.

    Notes
    -----
    Each member is what a `Stepper` of it alone is, bit for bit, however the others end.
    A member that has ended early has outputs of NaN until it is `reset`.  Where the diagram has
    neither delays, functions of t alone nor functions that are called in Python, members are kept
    in arrays that they share, and a step costs several times less than one of as many steppers;
    ``benchmarks/stepping.py`` says how much.

    Examples
    --------
    >>> lag = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="lag")
    >>> many = nlctl.vector_stepper(lag, 0.5, 2)
    >>> print(many.step([[1.0], [-1.0]]).round(6).ravel())  # 1 - exp(-0.5), and its negative
    [ 0.393469 -0.393469]
    """
    size = integer("vector_stepper", "size", size, at_least=1)
    return VectorStepper(
        with_every_float(as_compiled(system)), dt, size, method=method, rtol=rtol, atol=atol,
        max_steps=max_steps, max_step=max_step, step=step, audit=audit,
    )  # fmt: skip
