"""Reading a diagram: which blocks there are, what feeds them, in which order they are evaluated.

python-control evaluates every output function up to n + 1 times per right-hand side, until no
signal changes.  A schedule orders the outputs once, so that each is evaluated once.  What counts
is which output depends on which input: a block that feeds itself through separate channels is
evaluated more than once and is not an algebraic loop.
"""

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any, TypeVar

import control as ct
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...blocks import supplied_of, within
from ...delays.transport import PAST
from ...diagrams import places, samplings, supplied_blocks
from ...errors import AlgebraicLoopError
from ...expressions.graph import SMALL
from ...responses.watched import Watched
from ...sampling.system import Happening
from ...sliding.relay import SLIDING
from ...upstream.systems import System
from ..purity.captured import Captured, noted
from .checks import check_functions, check_registers
from .nodes import Node
from .trace import closer_feedthrough, feedthrough
from .wiring import Combination, Signal, Wiring


@dataclass(frozen=True, kw_only=True)
class AlgebraicLoop:
    """Signals that depend on each other at the same instant and are solved for together."""

    # the part of the order that is repeated until the signals fit
    start: int
    stop: int
    torn: tuple[Signal, ...]  # signals that are guessed: with these, all others of the loop follow


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """A flattened diagram."""

    system: Any  # the diagram that was read
    nodes: tuple[Node, ...]  # blocks in the order of the state vector
    # indices of the blocks in the order of their evaluation.  A block comes more than once if some
    # of its outputs are needed before all of its inputs are known
    order: tuple[int, ...]
    # for every entry of `order` the inputs of the block that are not known yet
    unknown: tuple[frozenset[int], ...]
    # linear combination of signals that makes each output of the diagram, and then of what arrives
    # at each line
    outputs: tuple[Combination, ...]
    # parts of the order that are solved for; empty unless that was asked for
    loops: tuple[AlgebraicLoop, ...]
    captured: tuple[Captured, ...]  # what the blocks' functions read from around them
    # what says how blocks are sampled: without signals, but with parameters
    samplings: tuple[Node, ...] = ()
    watched: tuple[Watched, ...] = ()  # functions of the run whose changes of sign are events
    overrides: Mapping[str, Any] = field(default_factory=dict)  # parameters that they get
    # outputs of transport delays.  A run gives them as further inputs
    lines: tuple[Signal, ...] = ()
    small: int = SMALL  # arrays up to this size are read as numbers, longer ones as loops

    @property
    def holders(self) -> tuple[Node, ...]:
        """All that has parameters, in their order."""
        return (*self.nodes, *self.samplings)

    @property
    def ninputs(self) -> int:
        """Number of inputs: those of the diagram, a line for each delayed signal, then `rates`."""
        return (self.system.ninputs or 0) + len(self.lines) + self.rates

    @property
    def rates(self) -> int:
        """Number of the diagram's inputs whose rates a run gives as further inputs."""
        # Ideal relays ask for them.
        has_relays = any(supplied_of(node.system) is SLIDING for node in self.nodes)
        return (self.system.ninputs or 0) if has_relays else 0


def schedule(system: ct.InputOutputSystem, *, solve_loops: bool = False) -> Schedule:
    """Flatten a diagram and order its blocks."""
    wiring = Wiring(system)
    blocks = [within(place.system) for place in wiring.blocks]
    read = [note for place in places(system) for note in _equations_of(place.system)]
    read += [note for one in blocks for note in _equations_of(one)]
    readings = [  # before any is called
        check_functions(place.path, one, may_write=True)
        for place, one in zip(wiring.blocks, blocks, strict=True)
    ]
    check_registers({p.path: r for p, r in zip(wiring.blocks, readings, strict=True)})
    read += [note for reading in readings for note in reading.captured]
    nodes = tuple(
        Node(
            path=place.path,
            system=one,
            state_offset=place.state_offset,
            inputs=tuple(wiring.inputs(place)),
            direct=feedthrough(one) & (one is place.system),
            numba_differs=reading.numba_differs,
            messages=reading.messages,
            registers=reading.registers,
            sampled=None if one is place.system else place.system,
        )
        for place, one, reading in zip(wiring.blocks, blocks, readings, strict=True)
    )
    supplied_blocks(system)  # whether each can be
    lines = tuple(
        Signal(i, k)
        for i, node in enumerate(nodes)
        if supplied_of(node.system) is PAST
        for k in range(node.system.noutputs or 0)
    )
    outputs = [wiring.output(wiring.top, i) for i in range(system.noutputs or 0)]
    outputs += [nodes[line.block or 0].inputs[line.index] for line in lines]
    return _ordered(
        Schedule(
            system=system, nodes=nodes, order=(), unknown=(), outputs=tuple(outputs), loops=(),
            captured=tuple(read), samplings=tuple(_samplings(system)), lines=lines,
        ),
        solve_loops,
    )  # fmt: skip


def _samplings(system: System) -> Iterator[Node]:
    for path, sampling in samplings(system):
        none = np.zeros((0, 0), dtype=bool)
        yield Node(path=path, system=sampling, state_offset=0, inputs=(), direct=none)


def _ordered(read: Schedule, solve_loops: bool) -> Schedule:
    """Return a schedule with the order of evaluation that its nodes need."""
    nodes = read.nodes
    try:
        order = tuple(TopologicalSorter(_blocks_before(nodes)).static_order())
        return replace(read, order=order, unknown=_not_yet_known(nodes, order), loops=())
    except CycleError:  # look closer: which output depends on which input
        nodes = tuple(replace(n, direct=closer_feedthrough(n.system, n.direct)) for n in nodes)
        ordering = _Ordering(nodes=nodes)
        ordering.run(solve_loops)
        order, unknown = tuple(ordering.order), tuple(ordering.unknown)
        loops = tuple(ordering.loops)
        return replace(read, nodes=nodes, order=order, unknown=unknown, loops=loops)


def during(read: Schedule, what: Happening) -> Schedule:
    """Return the schedule at an instant: outputs of what samples then depend on its inputs."""
    nodes = tuple(
        replace(node, direct=feedthrough(node.system))
        if node.sampled and node.sampled.answers(what)
        else node
        for node in read.nodes
    )
    try:
        return _ordered(replace(read, nodes=nodes), bool(read.loops))
    except AlgebraicLoopError as error:
        raise AlgebraicLoopError(
            f"{error} (all these sample at one instant: a delay or an offset of one of them would "
            "also do)"
        ) from None


def stand_in(system: ct.NonlinearIOSystem, states: int, outputs: int) -> Any:
    """Return a system that says how many states and outputs a program has."""
    return ct.NonlinearIOSystem(
        _nothing,
        _nothing,
        name=system.name,
        states=states,
        inputs=system.ninputs or 0,
        outputs=outputs,
        dt=system.dt,
    )


def _nothing(t: float, x: object, u: object, params: object) -> Any:
    """What a system computes that only says how large it is."""
    return np.zeros(0)


def _equations_of(system: System) -> Iterator[Captured]:
    """Yield notes of what a block or diagram consists of: it may be changed later."""
    for name in ("connect_map", "input_map", "output_map", "updfcn", "outfcn", *"ABCD"):
        if hasattr(system, name):
            yield noted(system, name, getattr(system, name))


def _blocks_before(nodes: tuple[Node, ...]) -> dict[int, set[int]]:
    """Return for every block the blocks that its outputs depend on."""
    before: dict[int, set[int]] = {i: set() for i in range(len(nodes))}
    for i, node in enumerate(nodes):
        for j, combination in enumerate(node.inputs):
            if node.direct[:, j].any():
                before[i] |= {s.block for s in combination if s.block is not None}
    return before


def _not_yet_known(nodes: tuple[Node, ...], order: Iterable[int]) -> tuple[frozenset[int], ...]:
    """Return which inputs of each block come later in an order: no output of it needs these."""
    done: set[int | None] = {None}
    unknown = []
    for i in order:
        inputs = enumerate(nodes[i].inputs)
        unknown.append(frozenset(j for j, c in inputs if any(s.block not in done for s in c)))
        done.add(i)
    return tuple(unknown)


@dataclass(kw_only=True)
class _Ordering:
    """Blocks are evaluated as soon as outputs can be had, whole ones first."""

    nodes: tuple[Node, ...]
    known: set[Signal] = field(default_factory=set)
    order: list[int] = field(default_factory=list)
    unknown: list[frozenset[int]] = field(default_factory=list)
    loops: list[AlgebraicLoop] = field(default_factory=list)

    def run(self, solve_loops: bool) -> None:
        every = {Signal(i, k) for i, node in enumerate(self.nodes) for k in range(len(node.direct))}
        self._evaluate(every, ())
        while every - self.known:
            before = _signals_before(self.nodes, every - self.known)
            if not solve_loops:
                raise AlgebraicLoopError(
                    f"algebraic loop: {_loop_text(self.nodes, before)} has no state in it; put one "
                    "in, or compile with algebraic_loops='solve'"
                )
            loop = first_loop(before)
            torn, start = tear({s: before[s] & loop for s in before if s in loop}), len(self.order)
            self._evaluate(loop, torn)
            self.loops.append(AlgebraicLoop(start=start, stop=len(self.order), torn=torn))
            self._evaluate(every, ())

    def _evaluate(self, needed_signals: set[Signal], guessed: Iterable[Signal]) -> None:
        """Order blocks until no more of the wanted signals can be had."""
        while True:
            given, offers = self.known.union(guessed), []
            for i in sorted({s.block for s in needed_signals - self.known if s.block is not None}):
                unknown, ready = _available(i, self.nodes[i], given)
                if needed_signals & ready - self.known:
                    offers.append((len(ready) < len(self.nodes[i].direct), i, unknown, ready))
            if not offers:
                return
            _, chosen, unknown, ready = min(offers, key=lambda offer: offer[:2])
            self.order.append(chosen)
            self.unknown.append(unknown)
            self.known |= ready


def _available(i: int, node: Node, given: set[Signal]) -> tuple[frozenset[int], set[Signal]]:
    """Return which inputs of a block are not given, and which outputs do not need these."""
    unknown = frozenset(
        j
        for j, combination in enumerate(node.inputs)
        if any(s.block is not None and s not in given for s in combination)
    )
    blocked = node.direct[:, sorted(unknown)].any(axis=1)
    return unknown, {Signal(i, int(k)) for k in np.flatnonzero(~blocked)}


def _signals_before(nodes: tuple[Node, ...], signals: set[Signal]) -> dict[Signal, set[Signal]]:
    """Return for every signal those among `signals` that it depends on at the same instant."""
    before: dict[Signal, set[Signal]] = {}
    for s in sorted(signals, key=lambda s: (s.block or 0, s.index)):
        assert s.block is not None
        node = nodes[s.block]
        sources = (node.inputs[int(j)] for j in np.flatnonzero(node.direct[s.index]))
        before[s] = {source for combination in sources for source in combination} & signals
    return before


def signal_name(nodes: Sequence[Node], signal: Signal) -> str:
    """Return the qualified name of a block's output."""
    node = nodes[signal.block or 0]
    return f"{node.path}.{node.system.output_labels[signal.index]}"


def _loop_text(nodes: tuple[Node, ...], before: Mapping[Signal, set[Signal]]) -> str:
    """Print an algebraic loop in the order in which its signals act on each other."""
    try:
        TopologicalSorter(before).prepare()
    except CycleError as error:
        loop = error.args[1]
        return " -> ".join(signal_name(nodes, s) for s in loop)
    raise AssertionError("signals that cannot be ordered form a loop")


_Item = TypeVar("_Item", bound=Hashable)


def first_loop(before: Mapping[_Item, set[_Item]]) -> set[_Item]:
    """Return the items of one loop that depends on no other loop."""
    items = list(before)
    number = {item: i for i, item in enumerate(items)}
    edges = [(number[item], number[other]) for item in items for other in before[item]]
    rows, columns = np.array(edges).T
    graph = coo_array((np.ones(len(edges)), (rows, columns)), shape=(len(items),) * 2)
    _, labels = connected_components(graph, connection="strong")
    leaving = {labels[i] for i, j in edges if labels[i] != labels[j]}
    inside = {labels[i] for i, j in edges if labels[i] == labels[j]}
    chosen = min(inside - leaving)
    return {item for item, label in zip(items, labels, strict=True) if label == chosen}


def tear(before: Mapping[_Item, set[_Item]]) -> tuple[_Item, ...]:
    """Choose few items of a loop without which there is no loop."""
    # The item with the most connections first; then what is in no loop any more drops out. The
    # result is small, not always the smallest.
    left = {item: set(others) for item, others in before.items()}
    torn = []
    while True:
        ends = {i for i in left if not left[i] or not any(i in others for others in left.values())}
        if not ends and not left:
            return tuple(torn)
        if not ends:
            ends = {max(left, key=lambda i: len(left[i]) * sum(i in o for o in left.values()))}
            torn += ends
        left = {i: others - ends for i, others in left.items() if i not in ends}
