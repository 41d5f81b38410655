"""Machine code from a diagram."""

import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import cloudpickle
import control as ct
import numpy as np
from numpy.typing import ArrayLike

from ..annotations import as_annotated
from ..attributes import with_parameters_of
from ..diagrams import apart, not_a_system, override
from ..errors import CompileError, ParameterError, UnknownKeywordError, UsageError
from ..names import in_one_spelling, unknown
from ..responses.arguments import checked_params
from ..responses.watched import Watched
from ..upstream.control_internals import StandIn, is_system, state_space
from ..upstream.systems import System
from ..wording import counted
from . import floats, jacobians
from .collected import collected_rarely
from .derivative_audit import audited_by_parameters, audited_jacobian
from .describe import called, described
from .diagram.checks import check_sizes
from .diagram.parameters import length
from .diagram.program import program
from .diagram.schedule import schedule
from .jacobians import Tangent
from .machine.evaluations import evaluations
from .reading import Reading

LOOPS = ("error", "solve")  # what may be done with algebraic loops
_NAMED = ("name", "inputs", "outputs", "states")  # of ct.ss
Rhs = Callable[..., None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Compiled(Reading, StandIn):
    """A diagram as machine code; made by `compile`.

    Attributes
    ----------
    schedule : Schedule
        What was read from the diagram.
    program : Program
        The arrays that machine code takes and fills.
    original : control.InputOutputSystem or None
        The diagram itself; none in another process.
    apart : Apart or None
        The copy of it that was read, in which runs write their parameters.
    cache : Cache
        What has been made of it, such as machine code.

    Notes
    -----
    `nlctl.input_output_response` and `nlctl.ensemble_response` run it; ``compiled.linearize(x0)``
    linearizes it with exact derivatives, and so do `nlctl.linearize` and ``ct.linearize``.  Every
    other function of python-control takes ``compiled.system``.

    The stiff method's Jacobian is exact too.  An opaque function has differences in it, and all
    else is exact; the printed form says so, and why.

    Examples
    --------
    >>> compiled = nlctl.compile(nlctl.block(nlctl.Lag(T=0.05), "lag"))
    >>> print(compiled.dynamics(0, [1.0], [3.0]), compiled.linearize([0.0], [0.0]).A)
    [40.] [[-20.]]
    """

    def __reduce__(self) -> tuple[Any, ...]:
        # functions made at run time are pickled by value; machine code is found on disk again
        read = replace(self.schedule, captured=())  # modules' names stay where they are
        try:
            return _restored, (cloudpickle.dumps((read, self.program)),)
        except Exception as error:  # pickle passes on whatever objects raise
            raise UsageError(
                f"'{self.system.name}' cannot be sent to another process, since a function of it "
                f"reads what cannot be pickled ({error}): let it read numbers and arrays"
            ) from error

    @property
    def system(self) -> Any:
        """The diagram that was compiled; runs write their parameters into a copy of it."""
        return super().system

    def _refused(self, *_: object, **__: object) -> Any:
        raise UsageError(
            f"'{self.system.name}' is compiled already: copy or rename its diagram, .system, and "
            "compile that"
        )

    # what would give it other names or sizes
    copy = update_names = set_inputs = set_outputs = set_states = _refused

    @property
    def source(self) -> str:
        """What runs for one member: LLVM IR, in which comments say what each value is.

        Comments at its end name the functions that it calls unchanged, and why: in machine
        code of numba, or back in Python.  Names of loops that are solved have their signals.
        """
        return "\n".join([self.lowered.text, *(f"; {line}" for line in called(self)), ""])

    @cached_property
    def native(self) -> tuple[Rhs, Rhs]:
        """``(rhs, out)`` as machine code, made when it is first needed or found in the cache.

        With NUMBA_DISABLE_JIT=1 the plan that it is made from is carried out in plain Python.
        """
        return evaluations(self)

    @as_annotated
    def parameter_vector(self, params: Mapping[str, Any] | None = None) -> np.ndarray:
        """Return the flat vector `p` that the program takes.

        Overrides are resolved by python-control itself.

        Parameters
        ----------
        params : mapping, optional
            Overrides by qualified name.

        Returns
        -------
        ndarray of shape (k,)
            The values of all k parameters, those of arrays one after the other.

        Raises
        ------
        UnknownNameError, ParameterError
            If a name or a value is refused.
        UsageError
            If a value that a function reads from around it has changed since.
        """
        return super().parameter_vector(params)

    @as_annotated
    def dynamics(
        self, t: float, x: ArrayLike, u: ArrayLike = (), params: Mapping[str, Any] | None = None
    ) -> np.ndarray:
        """Return the right-hand side, as ``system.dynamics`` does.

        Parameters
        ----------
        t : float
            Time (s).
        x : array_like of shape (nstates,)
            State.
        u : array_like of shape (ninputs,), optional
            Inputs; by default there are none.
        params : mapping, optional
            Overrides by qualified name.

        Returns
        -------
        ndarray of shape (nstates,)
            x' in the states' units per second, or the next x in discrete time.

        Raises
        ------
        UsageError
            If the diagram has a transport delay: its past is known in a run only.
        ParameterError, UnknownNameError
            If x or u has another length, or an override is refused.
        """
        g, m = (np.empty(self.lowered.rows[name]) for name in "gm")
        return self._call(0, self.system.nstates, t, x, u, params, g, m)

    @as_annotated
    def output(
        self, t: float, x: ArrayLike, u: ArrayLike = (), params: Mapping[str, Any] | None = None
    ) -> np.ndarray:
        """Return the outputs, as ``system.output`` does.

        Shapes: `x` (nstates,), `u` (ninputs,); returns (noutputs,).
        """
        return self._call(1, self.system.noutputs, t, x, u, params)

    @property
    def tangent(self) -> Tangent:
        """The derivatives of the equations along a direction of states, inputs and parameters."""
        return jacobians.tangent(self)

    @as_annotated
    def linearize(
        self,
        x0: object,
        u0: object = None,
        t: float = 0.0,
        params: Mapping[str, Any] | None = None,
        *,
        copy_names: bool = True,
        **names: object,
    ) -> ct.StateSpace:
        """Return the linearization at a point, with exact derivatives by forward mode.

        Parameters
        ----------
        x0 : mapping, array_like or control.OperatingPoint
            State, as `initial_state` of `nlctl.input_output_response`.
        u0 : array_like, optional
            Inputs, of shape (ninputs,); a number for all of them; 0 if left out.
        t : float, optional
            Time in s.
        params : mapping, optional
            Parameters that are overridden.
        copy_names : bool, optional
            Whether it gets the diagram's names of states, inputs and outputs, or python-control's
            generic ones.
        **names : object
            Other names: `name`, `inputs`, `outputs` and `states` of ``ct.ss``.

        Returns
        -------
        control.StateSpace
            At a kink it has the slopes of the side that the point belongs to.

        Raises
        ------
        CompileError
            If there are transport delays, or the rates of inputs enter.
        ParameterError, UnknownKeywordError, UsageError
            If an argument is refused.
        AuditError
            If differences of python-control's own values contradict a derivative.

        Warns
        -----
        InexactWarning
            If derivatives are differences: of a function that is called unchanged, and where the
            expressions at a point have no derivative of what they compute around it.
        """
        for name in [name for name in names if name not in _NAMED]:
            known = ("copy_names", *_NAMED)
            raise unknown("argument", name, known, "of linearize", UnknownKeywordError)
        if isinstance(x0, ct.OperatingPoint):
            x0, u0 = x0.states, x0.inputs if u0 is None else u0
        system = self.system
        n = system.nstates or 0
        derivatives = audited_jacobian(self, x0, u0, t, params)
        rates, outputs, dt = derivatives["dx"], derivatives["y"], system.dt
        if self.program.sampled:
            rates, outputs, dt = jacobians.over_a_period(self, derivatives)
        names_of_diagram = {
            "name": f"{system.name}$linearized",
            "inputs": system.input_labels,
            "outputs": system.output_labels,
            "states": system.state_labels,
        }
        matrices = rates[:, :n], rates[:, n:], outputs[:, :n], outputs[:, n:]
        return state_space(matrices, dt, (names_of_diagram if copy_names else {}) | names)

    @as_annotated
    @with_parameters_of(linearize)
    def parameter_jacobian(
        self,
        parameters: Sequence[str],
        x0: object,
        u0: object = None,
        t: float = 0.0,
        params: Mapping[str, Any] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return how the right-hand side and the outputs change with parameters.

        Parameters
        ----------
        parameters : sequence of str
            Qualified names, such as ``"actuator.b_r"``; with an index for entries of arrays.

        Returns
        -------
        tuple of ndarray
            Their derivatives, of shapes (nstates, k) and (noutputs, k) for k parameters.

        Raises
        ------
        CompileError, UnknownNameError, ParameterError
            As `linearize`, if there is no such parameter, or if others follow by `derived`.
        """
        reading = floats.with_floats(self, parameters)
        places = floats.float_parameters(reading)
        start = (self.system.nstates or 0) + self.schedule.ninputs
        directions = np.zeros((start + length(self.program.layout), len(parameters)))
        for k, name in enumerate(map(in_one_spelling, parameters)):
            if name not in places:
                raise unknown("parameter", name, places, f"of '{self.system.name}' that is a float")
            jacobians.check_enters_alone(places[name][1], name)
            directions[start + places[name][0], k] = 1.0
        found = audited_by_parameters(reading, parameters, directions, (t, x0, u0), params)
        return found["dx"], found["y"]

    def _call(
        self,
        which: int,
        size: int | None,
        t: float,
        x: object,
        u: object,
        params: Mapping[str, Any] | None,
        *more: object,
    ):
        if self.schedule.lines:
            raise UsageError(
                f"'{self.system.name}' has transport delays: what it does depends on the past, "
                "which only a run knows"
            )
        x, u = (np.array(v, dtype=float).reshape(-1) for v in (x, u))
        for what, given, wanted in (("x", x, self.system.nstates), ("u", u, self.system.ninputs)):
            if given.size != (wanted or 0):
                raise ParameterError(
                    f"{what} needs {counted(wanted or 0, 'value')}, got {given.size}"
                )
        result = np.empty(size or 0)
        u = np.append(u, np.zeros(self.schedule.ninputs - u.size))  # inputs stand still
        p = self.parameter_vector(params)
        self.native[which](float(t), x, u, p, result, *more)
        cut, u = self.equations_with(p).cut, u[: self.system.ninputs or 0]
        if cut and np.isnan(result).any():  # a loop takes more passes than are written out
            return self.calling(cut)._call(which, size, t, x, u, params, *more)
        return result

    def __repr__(self) -> str:
        return described(self)

    __str__ = __repr__


def as_compiled(system: System | Compiled, params: Mapping[str, Any] | None = None) -> Compiled:
    """Return a diagram, compiled unless it is already."""
    made = system if isinstance(system, Compiled) else compile(system, params=params)
    return floats.as_given(made, params)


@as_annotated
@collected_rarely()
def compile(  # noqa: A001 (what it does)
    system: System,
    *,
    params: Mapping[str, Any] | None = None,
    algebraic_loops: Literal["error", "solve"] = "error",
) -> Compiled:
    """Turn a python-control system into machine code.

    Parameters
    ----------
    system : control.InputOutputSystem
        nlctl's blocks, ``ct.nlsys``, ``ct.ss``, ``ct.tf``, and diagrams of them.
    params : mapping, optional
        Parameters that will be overridden although no block declares them, such as those that a
        third-party function reads with ``params.get``; the values given here are not kept.
    algebraic_loops : {"error", "solve"}, optional
        What is done with signals that depend on each other at the same instant: refuse the
        diagram, or solve for them by Newton's method in every evaluation.  A linear loop is then
        exact to rounding.  Of several solutions the one is found that the search from 0 (then
        from 1 and -1) reaches first.  Where there is none, or the loop's matrix is singular to
        1e-7, the results are NaN, and a run ends as diverged.  The derivatives are exact, so a
        function in a loop must be one that is made of expressions; at most 16 signals of a
        loop can be solved for together.

    Returns
    -------
    Compiled
        For `nlctl.input_output_response` and `nlctl.ensemble_response`, in place of `system`.

    Raises
    ------
    AlgebraicLoopError
        If signals depend on each other without a state in between.
    CompileError
        If a block is of a wrong kind or size, a function depends on more than its arguments, or
        an algebraic loop goes through a function that has no expressions.
    UnknownNameError
        If there is no such choice for `algebraic_loops`, or no such parameter.

    Notes
    -----
    What a function reads from around it (``self.gain``, a global, a linear system that it closes
    over) and parameters that are no numbers are constants of the program: compile again to change
    them.  A run whose functions would read something else now is an error.

    Functions are read before they are called.  One that remembers something outside of states,
    changes what it was given, draws random numbers, or has ``try ... except`` is refused.

    A function that cannot be written out as expressions (it integrates an equation, say) is called
    unchanged: as machine code that numba makes of it, otherwise back in Python, as slow as
    python-control.  ``print(compiled)`` says which, and what to do about it.  So is one with a loop
    that takes more passes in a run than are written out; its statistics say so.

    Examples
    --------
    >>> backlash = nlctl.compile(nlctl.block(nlctl.Backlash(), "actuator"))
    >>> backlash.system.name
    'actuator'
    """
    if isinstance(system, ct.TransferFunction):
        system = ct.ss(system)
    if isinstance(system, Compiled):
        raise CompileError(
            f"'{system.name}' is compiled already: give its diagram, .system, to compile it anew"
        )
    if not is_system(system):
        raise CompileError(not_a_system("compile", system))
    own = apart(system)  # nothing is written into what the user may run in another thread
    override(own.system, checked_params(params))
    if algebraic_loops not in LOOPS:
        raise unknown("choice", str(algebraic_loops), LOOPS, "for algebraic_loops")
    read = schedule(own.system, solve_loops=algebraic_loops == "solve")
    arrays = program(read)
    check_sizes(system, [node.sampled or node.system for node in read.nodes])
    made = Compiled(schedule=read, program=arrays, original=system, apart=own)
    _ = made.equations  # what expressions would understand otherwise is refused now
    return made


@as_annotated
@with_parameters_of(Compiled.linearize)
def linearize(
    system: System,
    x0: object,
    u0: object = None,
    t: float = 0.0,
    params: Mapping[str, Any] | None = None,
    *,
    copy_names: bool = True,
    **names: object,
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
    AuditError
        If differences of python-control's own values contradict a derivative.

    Warns
    -----
    InexactWarning
        If derivatives are differences, as `Compiled.linearize` says; all others are exact.

    Examples
    --------
    A lag behind a zero-order hold is what ``ct.sample_system`` makes of it:

    >>> lag = ct.ss(-1, 1, 1, 0, inputs="v", outputs="y", name="lag")
    >>> hold = nlctl.sampled(ct.ss([], [], [], 1.0, 0.1, inputs="u", outputs="v", name="hold"))
    >>> held = nlctl.interconnect([lag, hold], inputs=["u"], outputs=["y"])
    >>> linear = nlctl.linearize(held, 0)
    >>> print(linear.dt, linear.A[0, 0].round(6), linear.B[0, 0].round(6))  # exp(-0.1), 1 - it
    0.1 0.904837 0.095163
    """
    made = as_compiled(system, params)
    return made.linearize(x0, u0, t, params, copy_names=copy_names, **names)


def _restored(content: bytes) -> Compiled:
    """Make a compiled diagram of what `Compiled.__reduce__` has written."""
    read, arrays = pickle.loads(content)
    return Compiled(schedule=read, program=arrays)


def with_watched(
    compiled: Compiled, watched: tuple[Watched, ...], params: Mapping[str, Any] | None
) -> Compiled:
    """Return a diagram that is compiled with functions of a run."""
    if not watched:
        return compiled
    if not ct.isctime(compiled.system):
        raise ParameterError(
            f"'{compiled.system.name}' is in discrete time, where nothing is between two samples: "
            "stop_when and events are for diagrams in continuous time"
        )
    read = replace(compiled.schedule, watched=watched, overrides=dict(params or {}))
    return replace(compiled, schedule=read)
