"""Connecting blocks by the names of their signals."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import control as ct

from ..annotations import as_annotated
from ..blocks import Block, block, within
from ..errors import DiagramError
from ..names import Parameters, unknown
from ..upstream.control_internals import StandIn, is_system
from .parameters import overridden
from .places import leaves
from .third_party import with_own_values


def as_system(thing: Any, name: str) -> ct.InputOutputSystem:
    """Return a record as a block called `name`; a python-control system under that name.

    Parameters
    ----------
    thing : record or control.InputOutputSystem
        What becomes a part of a diagram.
    name : str
        Its name in the diagram.

    Returns
    -------
    control.InputOutputSystem
        The same object where it has that name already.

    Raises
    ------
    DiagramError
        If it is compiled already.
    """
    _check_not_compiled(thing, name)
    if is_system(thing):
        return thing if thing.name == name else thing.copy(name=name)
    return block(thing, name)


def _check_not_compiled(thing: object, name: str) -> None:
    if isinstance(thing, StandIn):
        raise DiagramError(
            f"'{name}' is compiled already: connect its diagram, .system, and compile the whole"
        )


@as_annotated
def interconnect(
    blocks: Mapping[str, Any] | Sequence[ct.InputOutputSystem],
    connections: Sequence[Any] | None = None,
    inplist: object = None,
    outlist: object = None,
    params: Mapping[str, Any] | None = None,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
    name: str | None = None,
) -> ct.InterconnectedSystem:
    """Connect blocks by the names of their signals: `control.interconnect` that refuses mistakes.

    An input is fed by the output of the same name, or, with `connections`, by what these say, as in
    python-control.  The result is an ordinary `control.InterconnectedSystem`; what is added are
    checks (a misspelt signal is an error, not a warning), parameters of third-party blocks that go
    by their block's name as those of nlctl's do (python-control has one value for all blocks whose
    parameters have one name), and, when the diagram is nested in another one, its name in front of
    the names of its parameters.

    Parameters
    ----------
    blocks : mapping or sequence
        ``{"plant": record or python-control system, ...}``, or a list of systems.  List them in
        the order of the signal flow: python-control then needs the fewest passes.
    connections : sequence of list, optional
        python-control's ``[["plant.u", "law.u"], ["law.e", "r.y", "-plant.y"]]``: an input, then
        what is added to feed it.  Nothing else is connected then.
    inplist, outlist : sequence, optional
        python-control's: which inputs of blocks an input of the diagram feeds, and which signals
        its outputs are.  By default they are those that `inputs` and `outputs` name.
    params : mapping, optional
        Values that parameters have in this diagram, ``{"actuator.b_r": 0.6}``.
    inputs : sequence of str, optional
        Signals that come from outside.
    outputs : sequence of str, optional
        Outputs of the diagram; by default every output of every block, ``"block_signal"`` where
        two have one name.
    name : str, optional
        Name of the diagram.

    Returns
    -------
    control.InterconnectedSystem
        To be simulated, compiled, drawn, or connected further.

    Raises
    ------
    DiagramError
        If two blocks share a name, have the same output, or an input is fed by nothing or
        twice, if one block stands in the diagram twice, if timebases differ, or if a controller is
        for plants of a lower order than the one that it is connected to.
    UnknownNameError
        If `outputs` names a signal that is the output of no block, `inputs` one that none takes,
        `connections`, `inplist` or `outlist` a block or a signal that does not exist, or `params`
        a parameter that nothing reads.
    ParameterError
        If a value of `params` is refused.

    Examples
    --------
    >>> loop = nlctl.interconnect({"limit": nlctl.Saturation(limit=2)}, inputs=["u"], outputs=["v"])
    >>> print(loop.output(0, [], [3.0]))
    [2.]

    One kind twice, connected as in python-control:

    >>> two = nlctl.interconnect(
    ...     {"a": nlctl.Gain(k=2), "b": nlctl.Gain(k=3)},
    ...     connections=[["b.u", "-a.v"]], inplist="a.u", outlist="b.v", params={"a.k": 5},
    ... )
    >>> print(two.output(0, [], [1.0]))
    [-15.]
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
    _check_timebases(systems)
    by_name = connections is inplist is outlist is None
    make = (
        _by_name(systems, inputs)
        if by_name
        else connected_by_lists(systems, connections, inplist, outlist)
    )
    systems = [with_own_values(system) for system in systems]
    diagram = make(systems, inputs, outputs, name)
    if isinstance(diagram.params, Parameters):
        diagram.params.scope = diagram
    return _with_values(diagram, params)


def _by_name(systems: Sequence[Any], inputs: Sequence[str]) -> Callable[..., Any]:
    """Check signals that are connected by their names; return what connects them."""
    sources = _signal_sources(systems)
    _check_inputs(systems, sources, inputs)
    _check_orders(systems, sources)

    def connected(
        systems: Any, inputs: Sequence[str], outputs: Sequence[str], name: str | None
    ) -> Any:
        outputs = list(sources) if outputs is None else list(outputs)
        for signal in outputs:
            if signal not in sources:
                raise unknown("output signal", signal, sources)
        return _connected(
            systems,
            inputs=inputs,
            inplist=[[f"{s.name}.{i}" for s in systems if i in s.input_labels] for i in inputs],
            outputs=outputs,
            outlist=[f"{sources[signal]}.{signal}" for signal in outputs],
            name=name,
            check_unused=False,  # our own checks above raise where python-control warns
        )

    return connected


def _connected(systems: Sequence[Any], *lists: Any, **more: object) -> Any:
    """Return what `control.interconnect` makes, of linear blocks alone without inputs, too."""
    # Of these python-control makes a linear system, but takes a matrix with one row and no column
    # for one without rows.  What it makes where one block is not linear is right.
    are_linear = all(isinstance(s, ct.StateSpace | ct.TransferFunction) for s in systems)
    if not are_linear or more["inputs"] or any(lists[1:2]):
        return ct.interconnect(systems, *lists, **more)
    first, *rest = systems
    linear = first if isinstance(first, ct.StateSpace) else ct.ss(first, name=first.name)
    stand_in = ct.nlsys(
        lambda t, x, u, p: x, lambda t, x, u, p: u, inputs=first.input_labels,
        outputs=first.output_labels, states=linear.state_labels, dt=first.dt, name=first.name,
    )  # fmt: skip
    diagram = ct.interconnect([stand_in, *rest], *lists, **more)
    diagram.syslist[0] = linear
    is_right = 1 not in (diagram.nstates, diagram.noutputs)
    return ct.LinearICSystem(diagram, None) if is_right else diagram


def _with_values(diagram: ct.InterconnectedSystem, params: Mapping[str, Any] | None) -> Any:
    """Let a diagram's parameters have values of its own."""
    if params:
        overridden(diagram, params)  # refuses names and values
        for name, value in params.items():
            diagram.params[name] = value
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


def _check_timebases(systems: Sequence[Any]) -> None:
    """One timebase for all: what samples among others says so."""
    for one, other in combinations(systems, 2):
        try:
            ct.common_timebase(one.dt, other.dt)
        except ValueError:
            slow = other if other.dt else one
            raise DiagramError(
                f"'{one.name}' {_timebase(one.dt)} and '{other.name}' {_timebase(other.dt)}: "
                f"nlctl.sampled({slow.name}, dt) is connected with others, continuous or of "
                "another rate"
            ) from None


def _timebase(dt: object) -> str:
    return f"is in discrete time (dt = {dt})" if dt else "is in continuous time"


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
                    f"block '{system.name}' takes a signal that no block outputs: {error}; "
                    f"what comes from outside is an input of the diagram: inputs=['{signal}']"
                )


def _check_orders(systems: Sequence[ct.InputOutputSystem], sources: Mapping[str, str]) -> None:
    """A controller that is made for plants of one order must not drive one of a higher order."""
    for system in systems:
        for leaf in leaves(system):
            part = within(leaf.system)
            order = getattr(part.spec, "plant_order", None) if isinstance(part, Block) else None
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


def reconnected(
    before: Any, parts: Sequence[Any], maps: Any, dt: object
) -> ct.InterconnectedSystem:
    """Return parts connected by maps, to replace a diagram: with its signals and parameters."""
    diagram = ct.InterconnectedSystem(
        parts,
        inputs=list(before.input_labels) or 0,
        outputs=list(before.output_labels) or 0,
        states=_state_labels(before, parts),
        name=before.name,
        dt=dt,
        connection_type=before.connection_type,
        warn_duplicate=False,
    )
    diagram.connect_map, diagram.input_map, diagram.output_map = maps
    for name, value in before.params.items():
        dict.__setitem__(diagram.params, name, value)
    if isinstance(diagram.params, Parameters) and isinstance(before.params, Parameters):
        diagram.params.scope = None if before.params.scope is None else diagram
    return diagram


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


def connected_by_lists(
    systems: Sequence[Any], connections: object, inplist: object, outlist: object
) -> Callable[..., Any]:
    """Check the names in lists of python-control; return what connects blocks by them."""
    # That takes ``(systems, inputs, outputs, name)`` and returns the diagram; it refuses what
    # python-control refuses, and an input that nothing feeds.
    for what in (connections, inplist, outlist):
        for text in _texts(what):
            _check_name(systems, text)

    def connected(systems: Any, inputs: object, outputs: object, name: str | None) -> Any:
        given = outlist
        if outlist is None and outputs is None:
            every = [(s, label) for s in systems for label in s.output_labels]
            count = Counter(label for _, label in every)
            names = [label if count[label] == 1 else f"{s.name}_{label}" for s, label in every]
            given, outputs = [(s.name, label) for s, label in every], names
        try:
            diagram = _connected(
                systems, connections, inplist, given, inputs=inputs or None, outputs=outputs,
                name=name, check_unused=False,
            )  # fmt: skip
        except (ValueError, TypeError, IndexError) as error:
            raise DiagramError(f"interconnect cannot connect these lists: {error}") from error
        _check_fed(diagram)
        return diagram

    return connected


def _texts(thing: object) -> Iterator[str]:
    """Yield all texts in nested lists; python-control checks tuples of numbers and gains."""
    if isinstance(thing, str):
        yield thing
    elif isinstance(thing, list):
        for part in thing:
            yield from _texts(part)


def _check_name(systems: Sequence[Any], text: str) -> None:
    """Refuse ``"block.signal"`` that does not exist; a name alone is a block, or a signal."""
    name, dot, signal = text.removeprefix("-").partition(".")
    blocks = {system.name: system for system in systems}
    labels = {label for s in systems for label in (*s.input_labels, *s.output_labels)}
    if not dot:
        if name not in blocks and not _is_there(name, labels):
            raise unknown("signal", name, [*labels, *blocks], "in a list of connections")
        return
    if name not in blocks:
        raise unknown("block", name, blocks, f"in '{text}'")
    signals = [*blocks[name].input_labels, *blocks[name].output_labels]
    if not _is_there(signal, signals):
        raise unknown("signal", signal, signals, f"of block '{name}'")


def _is_there(signal: str, labels: Any) -> bool:
    """Whether there is a signal of that name, or several by ``"y[0:2]"`` or ``"y"``."""
    base = signal.partition("[")[0]
    return signal in labels or any(label.partition("[")[0] == base for label in labels)


def _check_fed(diagram: ct.InterconnectedSystem) -> None:
    """Refuse an input of a block that nothing feeds: python-control takes it for 0."""
    dropped, _ = diagram.check_unused_signals(print_warning=False)
    for number, signal in sorted(dropped):
        block = diagram.syslist[number]
        raise DiagramError(
            f"input '{block.input_labels[signal]}' of block '{block.name}' is fed by nothing: "
            "connect it, or name it in inplist"
        )
