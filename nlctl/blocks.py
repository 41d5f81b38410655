"""The block contract: a record of parameters and its equations, as a python-control system."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import control as ct
import numpy as np

from .annotations import as_annotated
from .errors import BlockError, ParameterError, UsageError
from .host.notebook import table_html
from .names import Parameters, base_name, renamed, unknown
from .params import (
    ParameterRow,
    declared_params,
    ensure_checked,
    equation_arguments,
    is_checked,
    record_rows,
    with_overrides,
)
from .probing import probed
from .supplied import Supplied, supplied_now
from .upstream.control_internals import Around, OwnParameters, current_parameters, set_parameters
from .upstream.systems import System

_Signals = str | Sequence[str] | Mapping[str, str] | None  # other names of inputs or outputs


class Spec(Protocol):
    """What a record offers to be made a block: names of signals, and equations.

    It is a contract, not a base class: any class with these attributes will do, and
    `nlctl.record` makes one whose parameters are checked.

    Attributes
    ----------
    inputs, outputs : sequence of str
        Names of the signals.
    states : sequence of str
        Names of the states; `nlctl.record` makes it () where there is no `update`.
    feedthrough : bool
        Whether an output depends on `u` at the same instant; `nlctl.record` makes it True.
    output : callable
        ``output(t, x, u, p)`` returns the outputs, as a tuple or a 1-D array: `t` is the time in
        s, `x` the states, `u` the inputs, and `p` holds the record's parameters (``p.b_r``).
    update : callable
        ``update(t, x, u, p)`` returns x'; only where there are states.
    discrete : bool, optional
        True where `update` returns x[k+1] instead: such a block needs a ``dt``.
    initial : mapping, optional
        Initial values of states, ``{"zeta": 1.0}``; the others start from 0.
    vector : bool, optional
        True where the equations want `x` and `u` as 1-D arrays and do not unpack them.
    switching : callable, optional
        ``switching(t, x, u, p)`` returns a tuple of switching functions: where one of them changes
        its sign, an equation has a break point or a jump, and a step of the native engine ends
        there.
    memory : sequence of str, optional
        States that are memory.  Within a step of the native engine they stand still.
    commit : callable, optional
        ``commit(t, x, u, p)`` returns what the states in `memory` become at the end of a step
        that was accepted.  A step in which a memory would reverse is divided where it does.
        It must be continuous except where a switching function changes its sign; one that may
        jump is refused where none is declared.
    guard : callable, optional
        ``guard(t, x, u, p)`` returns a tuple of numbers: where one of them falls through 0, the
        block jumps.  None falls at the first instant of a run.
    reset : callable, optional
        ``reset(t, x, u, p)`` returns all states after a jump; it comes with `guard`.
    derived : callable, optional
        ``derived(self) -> dict`` of numbers that follow from the parameters; `p` has them too.
    check : callable, optional
        ``check(self)`` raises `nlctl.errors.ParameterError` where several fields contradict each
        other.
    plant_order : int, optional
        Of a controller: the order of the plants that it is made for.
    supplied : Supplied, optional
        Of `nlctl.TransportDelay` and `nlctl.IdealRelay`, whose outputs follow from a run, and not
        from `output` alone: see `nlctl.supplied`.

    Notes
    -----
    Equations are pure, as `nlctl.equation` says.  Memory is a state, never an attribute.

    Examples
    --------
    A record that follows it is a block:

    >>> @nlctl.record
    ... class Square:
    ...     inputs, outputs = ("u",), ("v",)
    ...
    ...     @nlctl.equation
    ...     def output(t, x, u, p):
    ...         return (u[0] ** 2,)
    >>> print(nlctl.block(Square(), "square").output(0, [], [3.0]))
    [9.]
    """

    @property
    def inputs(self) -> Sequence[str]: ...
    @property
    def outputs(self) -> Sequence[str]: ...

    @property
    def output(self) -> Any:
        """The equation of the outputs, ``output(t, x, u, p)``."""
        ...


class Block(OwnParameters):
    """A python-control system made from a record; see `block`.

    Attributes
    ----------
    spec : record
        The record that the block was made from.
    current_spec : record
        The record with the overrides of the latest run.
    params : Parameters
        Qualified names and values, ``{"actuator.b_r": 0.5}``.

    Examples
    --------
    See `block`.
    """

    def __init__(self, spec: Any, name: str, **kwargs: object) -> None:
        self.spec, self.current_spec = spec, None
        super().__init__(
            spec.update if spec.states else None,
            spec.output,
            inputs=list(spec.inputs) or 0,
            outputs=list(spec.outputs) or 0,
            states=list(spec.states) or None,
            name=name,
            **kwargs,
        )
        set_parameters(self, None)

    @property
    def params(self) -> Parameters:
        """Parameters by qualified name.  Assign a dict to change the block's own values."""
        fields = declared_params(self.spec)
        return Parameters({f"{self.name}.{k}": getattr(self.spec, k) for k in fields}, block=self)

    @params.setter
    def params(self, values: Mapping[str, Any]) -> None:
        if values:
            self.spec = self._resolved(values)
            set_parameters(self, None)

    def __call__(self, u: Any, params: object = None, squeeze: object = None) -> Any:
        """Return what a block without states makes of its inputs; a number is its one input."""
        return super().__call__(np.atleast_1d(u), params=params, squeeze=squeeze)

    def describing_function(self, A: float) -> complex:
        """Return its describing function; ``ct.describing_function(block, A)`` asks for it.

        Parameters
        ----------
        A : float
            Amplitude of the input.

        Returns
        -------
        complex
            As `nlctl.describing_function` has it.

        Raises
        ------
        UsageError
            If the block has dynamics: it depends on the frequency then.
        """
        from . import describing_function  # of the package: blocks know no engine

        if set(self.spec.states) != set(memory_states(self.spec)):
            raise UsageError(
                f"the describing function of '{self.name}' depends on the frequency: "
                "nlctl.describing_function(block, A, omega) has it"
            )
        return complex(describing_function(self, A))

    def _answer(self, t: float, x: np.ndarray, u: np.ndarray) -> Any:
        """Return its outputs; if these are supplied, see `nlctl.supplied`, what is supplied now."""
        supplied = supplied_of(self)
        if supplied is None:
            return super()._answer(t, x, u)
        now = supplied_now(self)
        if now is None:
            raise UsageError(f"block '{self.name}' {supplied.why}")
        now.arriving = np.array(u, dtype=float).reshape(-1)
        return now.leaving(float(t))

    def _own(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Return the overrides among `params` that are this block's, by field name."""
        prefix, fields = f"{self.name}.", declared_params(self.spec)
        if isinstance(params, Parameters):  # the diagram has sorted the names
            return {k.removeprefix(prefix): v for k, v in params.items() if k.startswith(prefix)}
        overrides = {k.removeprefix(prefix): v for k, v in params.items()}
        for name in overrides:
            if base_name(name) not in fields:
                raise unknown("parameter", name, fields, f"of block '{self.name}'")
        return overrides

    def _taken(self, params: Mapping[str, Any]) -> Any:
        """Return what equations get as `p`; python-control asks for it before a run."""
        before, self.current_spec = self.current_spec, self._resolved(params)
        if self.current_spec is before:
            return current_parameters(self)
        return equation_arguments(self.current_spec)

    def _resolved(self, params: Mapping[str, Any]) -> Any:
        """Return the record with overrides; they must not change the number of signals."""
        # Without any it is the record itself, which was checked when it was made.
        spec, given = self.spec, self._own(params)
        if not is_checked(spec) or any(v is not getattr(spec, k, given) for k, v in given.items()):
            spec = with_overrides(spec, given, self.name)
        for kind in ("inputs", "outputs", "states"):
            had, has = getattr(self, f"n{kind}"), len(getattr(spec, kind))
            if had != has:
                raise ParameterError(
                    f"{type(spec).__name__} had {had} {kind} when the block was made and cannot "
                    f"have {has} now: make a new block (block '{self.name}')"
                )
        return spec

    def __repr__(self) -> str:
        spec = type(self.spec).__name__
        signals = f"{_names(self.input_labels)} -> {_names(self.output_labels)}"
        states = f", states {_names(self.state_labels)}" if self.nstates else ""
        lines = [f"{spec} block '{self.name}': {signals}{states}"]
        rows = [("parameter", "value", "unit", "bounds", "meaning")]
        rows += [(r.name, r.text, r.unit, r.bounds, r.meaning) for r in parameter_rows(self)]
        widths = [max(len(row[i]) for row in rows) for i in range(5)]
        if len(rows) > 1:
            lines += ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
        return "\n".join(lines)

    __str__ = __repr__

    def _repr_html_(self) -> str:
        rows = [(r.name, r.text, r.unit, r.bounds, r.meaning) for r in parameter_rows(self)]
        titles = ("parameter", "value", "unit", "bounds", "meaning")
        return table_html(repr(self).splitlines()[0], titles, rows)


def _names(labels: Sequence[str]) -> str:
    shown = list(labels) if len(labels) <= 6 else [*labels[:2], "...", labels[-1]]
    return "(" + ", ".join(shown) + ")"


def parameter_rows(block: Block, path: str = "") -> list[ParameterRow]:
    """Return the parameter table of a block, with names that begin with `path`."""
    return record_rows(block.current_spec, path)


@as_annotated
def block(
    spec: Any,
    name: str,
    *,
    inputs: _Signals = None,
    outputs: _Signals = None,
    dt: float | bool | None = None,
) -> Block:
    """Make a python-control system of a record.

    Parameters
    ----------
    spec : record
        Parameters and equations; see `Spec` for what is read.
    name : str
        Name of the block, and the first part of its parameters' names.
    inputs, outputs : str, sequence of str or mapping, optional
        Other names of its signals: of all of them in order, or of some, ``{"u": "torque"}``.
    dt : float, bool or None, optional
        Timebase as in python-control.  Records without states may have any, and with None have
        that of the diagram; one with states is in continuous time, dt = 0, unless it says
        ``discrete = True``.

    Returns
    -------
    Block
        A `control.NonlinearIOSystem` with qualified parameters: ``params={"actuator.b_r": 0.6}``
        works wherever python-control takes ``params``.

    Raises
    ------
    ParameterError
        If a parameter is out of bounds, the name is none, `dt` does not fit the record, or there
        are not as many other names as signals.
    UnknownNameError
        If a signal that is renamed does not exist.
    BlockError
        If `spec` lacks something that a block needs, or its equations return the wrong number
        of values, or ``feedthrough = False`` is not true.

    Examples
    --------
    >>> actuator = nlctl.block(nlctl.DeadZone(b_r=0.6), "actuator")
    >>> print(actuator.params["actuator.b_r"], actuator.output(0, [], [0.4]))
    0.6 [0.]

    Two of one kind in a diagram need signals of their own:

    >>> nlctl.block(nlctl.Lag(), "left", inputs="p", outputs={"v": "q"}).output_labels
    ['q']
    """
    _check_has_equations(spec)
    if not (name is None or (isinstance(name, str) and name)):
        raise ParameterError(f"a block needs a name, got {name!r} for {type(spec).__name__}")
    ensure_checked(spec)
    _check_timebase(spec, name, dt)
    if dt is None and spec.states:  # whatever python-control's default is
        dt = 0
    system = Block(spec, name, **({} if dt is None else {"dt": dt}))
    _probe(system)
    for kind, given in (("inputs", inputs), ("outputs", outputs)):
        if given is not None:
            names = renamed(f"block '{name}'", kind[:-1], list(getattr(spec, kind)), given)
            system.update_names(**{kind: names})
    return system


def _check_has_equations(spec: object) -> None:
    """Refuse what lacks signals or an equation; all that is missing is named."""
    if isinstance(spec, type):
        raise BlockError(f"{spec.__name__} is a class: make a record of it first")
    if isinstance(spec, str):
        raise BlockError(
            f"str is not a block: a record is needed here, got the text {spec!r}; block takes the "
            "record first, and then its name"
        )
    needed = ["inputs", "outputs", "states", "feedthrough", "output"]
    needed += ["update"] if getattr(spec, "states", ()) else []
    if hasattr(spec, "guard") != hasattr(spec, "reset"):
        needed += ["guard", "reset"]
    missing = [name for name in needed if not hasattr(spec, name)]
    if missing:
        raise BlockError(f"{type(spec).__name__} is not a block: it lacks {', '.join(missing)}")


def _check_timebase(spec: Any, name: str, dt: object) -> None:
    """Refuse x' for x[k+1], and the other way round."""
    who = f"{type(spec).__name__} (block '{name}')"
    is_number = isinstance(dt, int | float | np.number)
    if not (dt is None or dt is True or (is_number and 0 <= dt < np.inf and dt is not False)):
        raise ParameterError(f"{who} needs dt >= 0 in s, True or None, got {dt!r}")
    supplied = getattr(spec, "supplied", None)
    if supplied is not None and supplied.discrete and dt not in (None, 0):
        raise ParameterError(f"{who} is in continuous time, got dt={dt}: {supplied.discrete}")
    if not spec.states:
        return
    is_discrete, sampled = bool(getattr(spec, "discrete", False)), dt is True or bool(dt)
    if sampled and not is_discrete:
        raise ParameterError(
            f"{who} is in continuous time: its update returns x', which dt={dt} would take for "
            "x[k+1]. Leave dt out; a record whose update returns x[k+1] says discrete = True"
        )
    if is_discrete and not sampled:
        raise ParameterError(
            f"{who} is in discrete time, its update returns x[k+1]: give its sampling time, "
            f"dt=0.1 s for example, got {dt}"
        )


def default_state(system: ct.InputOutputSystem) -> np.ndarray:
    """Return the initial state of one block: what its record declares, otherwise 0."""
    x = np.zeros(system.nstates or 0)
    if within(system) is not system:
        return system.default_state()  # type: ignore[attr-defined]
    if isinstance(system, Block):
        states = list(system.spec.states)  # python-control may have renamed the block's own labels
        for name, value in getattr(system.spec, "initial", {}).items():
            if name not in states:
                raise unknown("state", name, states, f"in initial of '{system.name}'")
            x[states.index(name)] = value
    return x


def within(system: System) -> Any:
    """Return the block that has a block's equations: the one that it samples, or itself."""
    return system.inner if isinstance(system, Around) else system


def supplied_of(system: System) -> Supplied | None:
    """Return how a block's outputs are supplied, None if they are its own."""
    return getattr(system.spec, "supplied", None) if isinstance(system, Block) else None


def sampling_of(system: System) -> Any:
    """Return the block with the parameters of a sampled block's sampling; None of any other."""
    return system.sampling if isinstance(system, Around) else None


def memory_states(spec: object) -> tuple[str, ...]:
    """Return the names of a record's memory states."""
    return tuple(getattr(spec, "memory", ())) if hasattr(spec, "commit") else ()


def event_count(system: Block) -> int:
    """Return the number of switching functions that a block declares."""
    return _count(system, "switching")


def guard_count(system: Block) -> int:
    """Return the number of guards of a block."""
    return _count(system, "guard")


def equation_now(system: Block, what: str, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return what an equation of a block says, of shape (k,), with the parameters it has now."""
    values = getattr(system.spec, what)(t, x, u, current_parameters(system))
    return np.asarray(values, dtype=float).reshape(-1)


def _count(system: Block, what: str) -> int:
    """Return how many numbers an equation of a block returns, 0 if there is none."""
    if not hasattr(system.spec, what):
        return 0
    supplied = supplied_of(system)
    further = 0 if supplied is None else supplied.rates
    u = np.full((system.ninputs or 0) + further, 0.25)
    values = getattr(system.spec, what)(0.0, default_state(system), u, current_parameters(system))
    return int(np.size(values))


def _probe(system: Block) -> None:
    """Call the equations once: they must run, sizes match, and feedthrough be declared truly."""
    spec, who = system.spec, f"{type(system.spec).__name__} (block '{system.name}')"
    if supplied_of(system) is not None:
        return
    names: dict[str, Any] = {"output": system.output_labels}
    if system.nstates:
        names["update"] = system.state_labels
    if memory_states(spec):
        names["commit"] = memory_states(spec)
    if hasattr(spec, "reset"):
        names |= {"guard": None, "reset": system.state_labels if system.nstates else ()}
    if hasattr(spec, "switching"):
        names["switching"] = None
    u = np.full(system.ninputs or 0, 0.25)
    probed(who, spec, names, default_state(system), u, current_parameters(system))
