"""Diagrams: connecting blocks by signal name, and addressing what is inside."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from .blocks import (
    Block,
    ParameterRow,
    block,
    default_state,
    parameter_rows,
    record_rows,
    sampling_of,
    within,
)
from .errors import DiagramError, ParameterError
from .names import Parameters, base_name, find_name, unknown
from .params import as_numbers, declared_params
from .upstream.control_internals import StandIn, is_system, set_parameters

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """Where a block or diagram stands: one system may stand in a diagram twice.

    Attributes
    ----------
    path : str
        Names of the diagrams around it and its own, separated by dots; empty for the outermost
        diagram.
    parameter_path : str
        The same without diagrams that do not put their name in front of their parameters'
        (those made with plain ``ct.interconnect``).
    system : control.InputOutputSystem
    state_offset : int
        Where its states begin in the outermost diagram's state vector.
    parent : Place or None
        The diagram around it, and ...
    position : int
        ... its position in that diagram's ``syslist``.
    """

    path: str
    parameter_path: str
    system: Any  # a diagram or a block; only diagrams have maps and offsets
    state_offset: int
    parent: Place | None
    position: int


def places(
    system: Any, parent: Place | None = None, position: int = 0, offset: int = 0
) -> Iterator[Place]:
    """Yield a system's place and then, in the order of the state vector, those of its parts."""
    nested = isinstance(system, ct.InterconnectedSystem)
    outer, outer_parameters = ("", "") if parent is None else (parent.path, parent.parameter_path)
    own = "" if nested and parent is None else system.name
    silent = nested and not _is_scoped(system)
    here = Place(
        path=f"{outer}.{own}" if outer else own,
        parameter_path=".".join(p for p in (outer_parameters, "" if silent else own) if p),
        system=system,
        state_offset=offset,
        parent=parent,
        position=position,
    )
    yield here
    for i, part in enumerate(system.syslist if nested else ()):
        yield from places(part, here, i, offset)
        offset += part.nstates or 0


def leaves(system: ct.InputOutputSystem) -> Iterator[Place]:
    """Yield the blocks of a diagram in the order of its state vector, nested ones flattened."""
    for place in places(system):
        if not isinstance(place.system, ct.InterconnectedSystem):
            yield place


def _is_scoped(diagram: ct.InterconnectedSystem) -> bool:
    """Whether a diagram puts its name in front of its parameters' names."""
    return isinstance(diagram.params, Parameters) and diagram.params.scope is not None


def as_system(thing: Any, name: str) -> ct.InputOutputSystem:
    """Return a record as a block called `name`; a python-control system under that name."""
    _check_not_compiled(thing, name)
    if is_system(thing):
        return thing if thing.name == name else thing.copy(name=name)
    return block(thing, name)


def _check_not_compiled(thing: Any, name: str) -> None:
    if isinstance(thing, StandIn):
        raise DiagramError(
            f"'{name}' is compiled already: connect its diagram, .system, and compile the whole"
        )


def interconnect(
    blocks: Mapping[str, Any] | Sequence[ct.InputOutputSystem],
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
    name: str | None = None,
) -> ct.InterconnectedSystem:
    """Join blocks by the names of their signals: `control.interconnect` that refuses mistakes.

    An input is fed by the output of the same name.  The result is an ordinary
    `control.InterconnectedSystem`; what is added are checks (a misspelt signal is an error, not
    a warning) and, when the diagram is nested in another one, its name in front of the names of
    its parameters.

    Parameters
    ----------
    blocks : mapping or sequence
        ``{"plant": record or python-control system, ...}``, or a list of systems.  List them in
        the order of the signal flow: python-control then needs the fewest passes.
    inputs : sequence of str, optional
        Signals that come from outside.
    outputs : sequence of str, optional
        Outputs of the diagram; by default every output of every block.
    name : str, optional
        Name of the diagram.

    Returns
    -------
    control.InterconnectedSystem

    Raises
    ------
    DiagramError
        If two blocks share a name, have the same output, or an input is fed by nothing or
        twice, if one block stands in the diagram twice, or if a controller is for plants of a
        lower order than the one that it is connected to.
    UnknownNameError
        If `outputs` names a signal that is the output of no block, or `inputs` one that none takes.

    Examples
    --------
    >>> import nlctl
    >>> loop = nlctl.interconnect({"limit": nlctl.Saturation(limit=2)}, inputs=["u"], outputs=["v"])
    >>> print(loop.output(0, [], [3.0]))
    [2.]
    """
    if not isinstance(blocks, Mapping | Sequence) or isinstance(blocks, str) or not len(blocks):
        raise DiagramError(
            "interconnect needs blocks with their names, {'plant': ...}, got "
            f"{'none' if isinstance(blocks, Mapping | Sequence) else type(blocks).__name__}"
        )
    if isinstance(blocks, Mapping):
        systems = [as_system(thing, key) for key, thing in blocks.items()]
    else:
        systems = list(blocks)
    inputs = [inputs] if isinstance(inputs, str) else list(inputs)
    outputs = [outputs] if isinstance(outputs, str) else outputs
    _check_blocks(systems)
    sources = _signal_sources(systems)
    _check_inputs(systems, sources, inputs)
    _check_orders(systems, sources)
    outputs = list(sources) if outputs is None else list(outputs)
    for signal in outputs:
        if signal not in sources:
            raise unknown("output signal", signal, sources)
    diagram = ct.interconnect(
        systems,
        inputs=inputs,
        inplist=[[f"{s.name}.{i}" for s in systems if i in s.input_labels] for i in inputs],
        outputs=outputs,
        outlist=[f"{sources[signal]}.{signal}" for signal in outputs],
        name=name,
        check_unused=False,  # our own checks above raise where python-control warns
    )
    if isinstance(diagram.params, Parameters):
        diagram.params.scope = diagram
    return diagram


def _check_blocks(systems: Sequence[Any]) -> None:
    """Every block has its own name, and stands in its own place only."""
    names: set[str] = set()
    places: dict[int, str] = {}
    for system in systems:
        _check_not_compiled(system, getattr(system, "name", ""))
        if not is_system(system):
            raise DiagramError(
                f"interconnect needs systems in a list, got a {type(system).__name__}; give "
                "records with their names: {'plant': ...}"
            )
        if system.name in names:
            raise DiagramError(f"two blocks are called '{system.name}'; give each its own name")
        names.add(system.name)
        for leaf in leaves(system):
            nested = isinstance(system, ct.InterconnectedSystem)
            path = f"{system.name}.{leaf.path}" if nested else leaf.path
            if id(leaf.system) in places:
                raise DiagramError(
                    f"one block stands in two places, '{places[id(leaf.system)]}' and '{path}', "
                    "and would share its parameters: use a copy, block.copy(name=...)"
                )
            places[id(leaf.system)] = path


def _signal_sources(systems: Sequence[ct.InputOutputSystem]) -> dict[str, str]:
    """Return ``{signal: name of the block whose output it is}``."""
    sources: dict[str, str] = {}
    for system in systems:
        for signal in system.output_labels:
            if signal in sources:
                raise DiagramError(
                    f"signal '{signal}' is an output of '{sources[signal]}' and of "
                    f"'{system.name}'; rename one, or add them in a ct.summing_junction"
                )
            sources[signal] = system.name
    return sources


def _check_inputs(
    systems: Sequence[ct.InputOutputSystem], sources: Mapping[str, str], inputs: Sequence[str]
) -> None:
    taken = {signal for system in systems for signal in system.input_labels}
    for i, signal in enumerate(inputs):
        if signal in sources:
            raise DiagramError(
                f"signal '{signal}' is an external input and an output of "
                f"'{sources[signal]}'; rename one"
            )
        if signal in inputs[:i]:
            raise DiagramError(f"external input '{signal}' is listed twice")
        if signal not in taken:
            raise unknown("input signal", signal, taken)
    for system in systems:
        for signal in system.input_labels:
            if signal not in sources and signal not in inputs:
                error = unknown("signal", signal, [*sources, *inputs])
                raise DiagramError(
                    f"block '{system.name}' takes a signal that no block outputs: {error}"
                )


def _check_orders(systems: Sequence[ct.InputOutputSystem], sources: Mapping[str, str]) -> None:
    """A controller that is made for plants of one order must not drive one of a higher order."""
    for system in systems:
        for leaf in leaves(system):
            order = getattr(getattr(within(leaf.system), "spec", None), "plant_order", None)
            if not isinstance(order, int):
                continue
            above = f"x{order + 1}"
            taken = f"x{order}" in system.input_labels
            if taken and above in sources and sources[above] == sources[f"x{order}"]:
                raise DiagramError(
                    f"'{system.name}' is a controller for plants of order {order}, and "
                    f"'{sources[above]}' has a state {above} that it would not see: make a "
                    f"controller of its order, such as nlctl.adaptive_neural(order={order + 1})"
                )


def known_system(who: str, system: Any) -> Any:
    """Return a block or diagram; of a compiled diagram that which was compiled.

    Raises
    ------
    ParameterError
        If it is neither.
    """
    inner = getattr(system, "system", system)
    if not isinstance(inner, ct.InputOutputSystem):
        raise ParameterError(not_a_system(who, system))
    return inner


def not_a_system(who: str, thing: Any) -> str:
    """Return the sentence that refuses what is neither a block nor a diagram."""
    return (
        f"{who} needs a block or diagram, got {type(thing).__name__}: nlctl.block makes a block of "
        "a record"
    )


def state_names(system: ct.InputOutputSystem) -> list[str]:
    """Return the qualified names of all states, ``"controller.law.zeta"``, in vector order.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.

    Returns
    -------
    list of str
        One for each state.

    Examples
    --------
    >>> import nlctl
    >>> state_names(nlctl.block(nlctl.Backlash(), "actuator"))
    ['actuator.memory']
    """
    system = known_system("state_names", system)
    return [f"{leaf.path}.{s}" for leaf in leaves(system) for s in leaf.system.state_labels]


def initial_state(
    system: ct.InputOutputSystem, values: Mapping[str, float] | None = None
) -> np.ndarray:
    """Return the initial state of a block or diagram.

    Every block starts from what its record declares (the paper's values), states of third-party
    blocks start from 0; `values` replaces some of them.

    Parameters
    ----------
    system : control.InputOutputSystem
        Block or diagram.
    values : mapping, optional
        ``{"plant.x1": 0.8}``.  A name is the path of blocks to the state, or the end of one.

    Returns
    -------
    ndarray of shape (nstates,)
        For ``ct.input_output_response(system, timepts, 0, initial_state(system))``.

    Raises
    ------
    UnknownNameError, AmbiguousNameError
        If a name is not that of exactly one state.
    ParameterError
        If a value is not a finite number.

    Examples
    --------
    >>> import nlctl
    >>> print(initial_state(nlctl.block(nlctl.Backlash(v0=0.2), "actuator")))
    [0.2]
    """
    system = known_system("initial_state", system)
    if not isinstance(values, Mapping | None):
        raise ParameterError(
            f"initial_state needs values by name, {{'plant.x1': 0.8}}, got {type(values).__name__}"
        )
    x = np.concatenate([default_state(leaf.system) for leaf in leaves(system)])
    index = {name: i for i, name in enumerate(state_names(system))}
    for name, value in (values or {}).items():
        full = find_name("state", name, index)
        number = as_numbers(value)
        if number is None or number.ndim or not np.isfinite(number):
            raise ParameterError(f"state '{full}' needs a finite initial value, got {value!r}")
        x[index[full]] = number
    return x


def check_read(system: Any, params: Mapping[str, Any] | None) -> None:
    """Refuse parameters without a block's name that nothing in a diagram of nlctl's can read.

    A third-party function reads what it likes; blocks of nlctl and linear systems do not.  Where
    none is nlctl's, python-control's own rule holds: what nothing reads is ignored.

    Raises
    ------
    UnknownNameError
        The nearest name is given.
    """
    bare = [key for key in params or {} if isinstance(key, str) and "." not in key]
    bare = [key for key in bare if base_name(key) not in system.params]
    if not bare:
        return
    parts = [within(leaf.system) for leaf in leaves(system)]
    others = [part for part in parts if not isinstance(part, Block)]
    linear = ct.StateSpace, ct.TransferFunction
    if len(others) < len(parts) and all(isinstance(part, linear) for part in others):
        raise unknown("parameter", bare[0], parameter_names(system))


def parameter_names(system: ct.InputOutputSystem) -> list[str]:
    """Return the qualified names of all parameters of nlctl blocks in `system`."""
    return [row.name for row in all_parameter_rows(system)]


def all_parameter_rows(system: ct.InputOutputSystem) -> list[ParameterRow]:
    """Return the parameter table of a diagram, with the values of a run without overrides."""
    if isinstance(system, ct.NonlinearIOSystem):
        set_parameters(system, None)
    rows: list[ParameterRow] = []
    for leaf in leaves(system):
        if isinstance(within(leaf.system), Block):
            rows += parameter_rows(within(leaf.system), f"{leaf.parameter_path}.")
    for path, owner in samplings(system):
        rows += parameter_rows(owner, f"{path}.")
    return rows


def samplings(system: Any) -> list[tuple[Any, Any]]:
    """Return what says how blocks are sampled, each once, behind the path of its parameters."""
    every = [sampling_of(leaf.system) for leaf in leaves(system)]
    found: dict[int, Any] = {id(made): made for made in every if made is not None}
    owners = system.params.owners if isinstance(system.params, Parameters) else {}
    paths = {id(owner): name.rpartition(".")[0] for name, owner in owners.items()}
    return [(paths.get(key, made.name), made) for key, made in found.items()]


def parameters(system: Any) -> pd.DataFrame:
    """Return all parameters of a diagram, block or record as a table.

    Parameters
    ----------
    system : control.InputOutputSystem, record or Compiled

    Returns
    -------
    pandas.DataFrame
        One row per parameter, indexed by qualified name, or by the name of the field for a
        record; columns value, unit, bounds, meaning.

    Raises
    ------
    ParameterError
        If it is none of these.

    Examples
    --------
    >>> import nlctl
    >>> float(parameters(nlctl.DeadZone())["value"]["b_r"])
    0.5
    """
    import pandas as pd

    is_record = dataclasses.is_dataclass(system) and not isinstance(system, type)
    if is_record and declared_params(system):
        rows = record_rows(system)
    else:
        rows = all_parameter_rows(known_system("parameters", system))
    return pd.DataFrame(
        {
            "value": [row.value for row in rows],
            "unit": [row.unit for row in rows],
            "bounds": [row.bounds for row in rows],
            "meaning": [row.meaning for row in rows],
        },
        index=pd.Index([row.name for row in rows], name="parameter"),
    )


def reconnected(before: Any, parts: Sequence[Any], maps: Any, dt: Any) -> ct.InterconnectedSystem:
    """Return parts connected by maps in the place of a diagram: with its signals and parameters.

    Parameters
    ----------
    before : control.InterconnectedSystem
        It stays as it is.
    parts : sequence of control.InputOutputSystem
        In the places of its own, others behind them.
    maps : tuple of ndarray
        ``connect_map``, ``input_map`` and ``output_map``.
    dt : float, bool or None
        Timebase.
    """
    made = ct.InterconnectedSystem(
        parts,
        inputs=list(before.input_labels) or 0,
        outputs=list(before.output_labels) or 0,
        states=_state_labels(before, parts),
        name=before.name,
        dt=dt,
        connection_type=before.connection_type,
        warn_duplicate=False,
    )
    made.connect_map, made.input_map, made.output_map = maps
    for name, value in before.params.items():
        dict.__setitem__(made.params, name, value)
    if isinstance(made.params, Parameters) and isinstance(before.params, Parameters):
        made.params.scope = None if before.params.scope is None else made
    return made


def _state_labels(before: Any, parts: Sequence[Any]) -> list[str]:
    """Return the labels that states had, and those of parts that have more states now."""
    labels: list[str] = []
    for i, part in enumerate(parts):
        had = before.syslist[i].nstates if i < len(before.syslist) else -1
        if part.nstates == had:
            offset = before.state_offset[i]
            labels += before.state_labels[offset : offset + had]
        else:
            labels += [f"{part.name}_{label}" for label in part.state_labels]
    return labels
