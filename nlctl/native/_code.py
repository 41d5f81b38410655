"""How one block is called: the lines of source that evaluate it."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import control as ct
import numpy as np

from .._block import Block, event_count, memory_states
from .._errors import CompileError
from . import _numpy  # noqa: F401 (numba learns what it lacks)
from ._parameters import Slot, current_values
from ._schedule import Combination, Node, Signal
from .thirdparty.dicts import callable_constant, params_dict, params_record, unpacked_arguments
from .thirdparty.objects import frozen

NOTHING: Mapping[Any, str] = MappingProxyType({})
LONG = 8  # states from which on a block's derivatives are written as one slice


def sum_of(combination: Combination, guesses: Mapping[Signal, str] = NOTHING) -> str:
    """Write a linear combination of signals; `guesses` says where those lie that are guessed."""
    terms = []
    for signal, gain in combination.items():
        name = f"u[{signal.index}]" if signal.block is None else f"y{signal.block}[{signal.index}]"
        name = guesses.get(signal, name)
        sign = {1.0: "", -1.0: "-"}.get(gain, f"{gain!r} * ")
        terms.append(sign + name)
    return " + ".join(terms).replace("+ -", "- ") if terms else "0.0"


@dataclass(frozen=True, kw_only=True)
class Code:
    """How one block is called."""

    index: int
    node: Node
    slots: Mapping[str, Slot]
    name: str  # what its names in the source begin with

    def signal(self, signal: Signal) -> str:
        """Name one of the block's outputs, for people."""
        return f"{self.node.path}.{self.node.system.output_labels[signal.index]}"

    def inputs(
        self, unknown: Collection[int] = (), guesses: Mapping[Signal, str] = NOTHING
    ) -> list[str]:
        """Expressions of the inputs; NaN where they are not known yet and must not matter."""
        return [
            "np.nan" if j in unknown else sum_of(c, guesses) for j, c in enumerate(self.node.inputs)
        ]

    @property
    def direct(self) -> bool:
        return bool(self.node.direct.any())

    @property
    def corners(self) -> int:
        """Number of switching functions that the block declares."""
        return 0

    @property
    def memory(self) -> list[int]:
        """Indices of its memory states in the diagram's state."""
        return []

    def event_lines(self, corner: int, memory: int) -> list[str]:
        return []

    def functions(self) -> dict[str, Callable[..., Any]]:
        return {}

    @property
    def fixed(self) -> dict[str, Any]:
        """Parameters that are no numbers."""
        return {}

    def constants(self) -> dict[str, Any]:
        return {}

    def records(self) -> dict[str, tuple[Callable[..., Any], type]]:
        return {}

    def parameter_lines(self) -> list[str]:
        return []

    def output_lines(
        self, unknown: Collection[int] = (), guesses: Mapping[Signal, str] = NOTHING
    ) -> list[str]:
        """Lines that make ``y{index}``, from inputs some of which may be unknown or guessed."""
        raise NotImplementedError

    def update_lines(self, ready: bool) -> list[str]:
        """Lines that make the derivatives; `ready` if the last output had the final inputs."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class _FunctionCode(Code):
    """A block with functions ``update(t, x, u, p)`` and ``output(t, x, u, p)``."""

    def functions(self) -> dict[str, Callable[..., Any]]:
        system = self.node.system
        found = {}
        if system.nstates:
            found[f"{self.name}_update"] = frozen(system.updfcn)
        if system.noutputs and system.outfcn is not None:
            found[f"{self.name}_output"] = frozen(system.outfcn)
        if self.corners:
            found[f"{self.name}_corners"] = system.spec.corners
        if self.memory:
            found[f"{self.name}_commit"] = system.spec.commit
        return found

    @property
    def corners(self) -> int:
        return event_count(self.node.system) if isinstance(self.node.system, Block) else 0

    @property
    def memory(self) -> list[int]:
        if not isinstance(self.node.system, Block):
            return []
        spec = self.node.system.spec
        return [self.node.state_offset + list(spec.states).index(m) for m in memory_states(spec)]

    def event_lines(self, corner: int, memory: int) -> list[str]:
        """The block's switching functions and what its memory would become, written into g."""
        if not (self.corners or self.memory):
            return []
        lines = [f"u{self.index} = {self._inputs('output', self.inputs())}"]
        for function, first, count in (
            ("corners", corner, self.corners),
            ("commit", memory, len(self.memory)),
        ):
            if count:
                targets = [f"g[{i}]" for i in range(first, first + count)]
                lines.append(f"{_tuple(targets)} = {self._call(function, count)}")
        return lines

    @property
    def _unpacks(self) -> bool:
        """Whether this is one of nlctl's small blocks: tuples in, tuples out."""
        system = self.node.system
        return isinstance(system, Block) and not getattr(system.spec, "vector", False)

    def _as_tuple(self, function: str, position: int) -> bool:
        """Whether a function wants its argument x (1) or u (2) as a tuple, to take it apart."""
        if isinstance(self.node.system, Block):
            return self._unpacks
        system = self.node.system
        return position in unpacked_arguments(
            system.updfcn if function == "update" else system.outfcn
        )

    def _inputs(self, function: str, inputs: list[str]) -> str:
        items = _tuple(inputs)
        if self._as_tuple(function, 2):
            return items
        return f"np.array({items})" if self.node.inputs else "np.empty(0)"

    def _states(self, function: str) -> str:
        n, start = self.node.system.nstates or 0, self.node.state_offset
        if self._as_tuple(function, 1):
            return _tuple([f"x[{i}]" for i in range(start, start + n)])
        return f"x[{start}:{start + n}]" if n else "np.empty(0)"

    def _call(self, function: str, count: int) -> str:
        """Write a call whose result has `count` values."""
        arguments = f"t, {self._states(function)}, u{self.index}, p{self.index}"
        return f"as_vector({self.name}_{function}({arguments}), {count})"

    @property
    def fixed(self) -> dict[str, Any]:
        return {k: v for k, v in self._values.items() if k not in self.slots}

    def constants(self) -> dict[str, Any]:
        return {f"{self.name}_p_{k}": callable_constant(v) for k, v in self.fixed.items()}

    def records(self) -> dict[str, tuple[Callable[..., Any], type]]:
        """What gathers the parameters: in plain Python, and in machine code."""
        if isinstance(self.node.system, Block):
            own = type(self.node.system._current_params)
            return {f"{self.name}_p": (own, own)}
        names = list(self._values)
        return {f"{self.name}_p": (params_dict(names), params_record(self.node.path, names))}

    @property
    def _values(self) -> Mapping[str, Any]:
        return current_values(self.node.system)

    def parameter_lines(self) -> list[str]:
        values = [
            self.slots[k].expression if k in self.slots else f"{self.name}_p_{k}"
            for k in self._values
        ]
        filler = [] if values or isinstance(self.node.system, Block) else ["0.0"]
        return [f"p{self.index} = {self.name}_p({', '.join(values or filler)})"]

    def output_lines(
        self, unknown: Collection[int] = (), guesses: Mapping[Signal, str] = NOTHING
    ) -> list[str]:
        system = self.node.system
        if not system.noutputs:
            return []
        if system.outfcn is None:
            start = self.node.state_offset
            return [f"y{self.index} = x[{start}:{start + system.noutputs}]"]
        # an output that does not depend on the inputs must not read them
        inputs = self.inputs(unknown if self.direct else range(len(self.node.inputs)), guesses)
        given = self._inputs("output", inputs)
        return [
            f"u{self.index} = {given}",
            f"y{self.index} = {self._call('output', system.noutputs)}",
        ]

    def update_lines(self, ready: bool) -> list[str]:
        n, start = self.node.system.nstates or 0, self.node.state_offset
        if not n:
            return []
        inputs = self._inputs("update", self.inputs())
        same = ready and self.direct and inputs == self._inputs("output", self.inputs())
        given = [] if same else [f"u{self.index} = {inputs}"]
        call = self._call("update", n)
        if self._unpacks:
            targets = [f"dx[{i}]" for i in range(start, start + n)]
            return [*given, f"{_tuple(targets)} = {call}"]
        if n > LONG:
            return [*given, f"dx[{start}:{start + n}] = {call}"]
        parts = [f"dx[{start + i}] = d{self.index}[{i}]" for i in range(n)]
        return [*given, f"d{self.index} = {call}", *parts]


@dataclass(frozen=True, kw_only=True)
class _LinearCode(Code):
    """A state-space block: its equations are written out, zeros left away."""

    def _row(self, matrices: tuple[np.ndarray, np.ndarray], i: int, inputs: list[str]) -> str:
        on_state, on_input = matrices
        start = self.node.state_offset
        terms = [f"{on_state[i, j]!r} * x[{start + j}]" for j in np.flatnonzero(on_state[i])]
        terms += [f"{on_input[i, j]!r} * ({inputs[j]})" for j in np.flatnonzero(on_input[i])]
        return " + ".join(terms) if terms else "0.0"

    def _matrices(self, *names: str) -> tuple[np.ndarray, np.ndarray]:
        first, second = (getattr(self.node.system, n).astype(float).astype(object) for n in names)
        return first, second

    def output_lines(
        self, unknown: Collection[int] = (), guesses: Mapping[Signal, str] = NOTHING
    ) -> list[str]:
        matrices, inputs = self._matrices("C", "D"), self.inputs(unknown, guesses)
        rows = [self._row(matrices, i, inputs) for i in range(self.node.system.noutputs or 0)]
        return [f"y{self.index} = {_tuple(rows)}"] if rows else []

    def update_lines(self, ready: bool) -> list[str]:
        matrices, inputs = self._matrices("A", "B"), self.inputs()
        start = self.node.state_offset
        rows = range(self.node.system.nstates or 0)
        return [f"dx[{start + i}] = {self._row(matrices, i, inputs)}" for i in rows]


def code(index: int, node: Node, own: Mapping[str, Slot], name: str | None = None) -> Code:
    """Return how a block is called.

    Raises
    ------
    CompileError
        If it is of a kind that cannot be compiled, or has no fixed size.
    """
    system = node.system
    for kind in ("inputs", "outputs", "states"):
        if getattr(system, f"n{kind}") is None:
            raise CompileError(
                f"block '{node.path}' does not say how many {kind} it has: give {kind}=... to "
                "ct.nlsys"
            )
    label = re.sub(r"\W", "_", node.path) if name is None else name
    if isinstance(system, ct.StateSpace):
        return _LinearCode(index=index, node=node, slots=own, name=label)
    if isinstance(system, ct.NonlinearIOSystem):
        return _FunctionCode(index=index, node=node, slots=own, name=label)
    raise CompileError(
        f"block '{node.path}' is a {type(system).__name__}; only nonlinear and state-space "
        "blocks can be compiled: convert it with ct.ss first"
    )


def _tuple(items: list[str]) -> str:
    return f"({', '.join(items)}{',' if len(items) == 1 else ''})"
