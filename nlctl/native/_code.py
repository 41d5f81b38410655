"""How one block is called: the lines of source that evaluate it."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from .._block import Block, event_count, memory_states
from .._errors import UsageError
from ._foreign import params_dict, params_record, unpacked_arguments
from ._parameters import Slot, current_values, is_numeric
from ._schedule import Combination, Node

LONG = 8  # states from which on a block's derivatives are written as one slice


class CompileError(UsageError):
    """A block that cannot be compiled: the message names it and says why."""


def sum_of(combination: Combination) -> str:
    """Write a linear combination of signals."""
    terms = []
    for signal, gain in combination.items():
        name = f"u[{signal.index}]" if signal.block is None else f"y{signal.block}[{signal.index}]"
        sign = {1.0: "", -1.0: "-"}.get(gain, f"{gain!r} * ")
        terms.append(sign + name)
    return " + ".join(terms).replace("+ -", "- ") if terms else "0.0"


@dataclass(frozen=True, kw_only=True)
class Code:
    """How one block is called."""

    index: int
    node: Node
    slots: Mapping[str, Slot]

    @property
    def name(self) -> str:
        return re.sub(r"\W", "_", self.node.path)

    def inputs(self, known: bool) -> list[str]:
        """Expressions of the inputs; NaN where they are not known yet and must not matter."""
        return [sum_of(c) if known else "np.nan" for c in self.node.inputs]

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

    def constants(self) -> dict[str, Any]:
        return {}

    def records(self) -> dict[str, tuple[Callable[..., Any], type]]:
        return {}

    def parameter_lines(self) -> list[str]:
        return []

    def update_lines(self) -> list[str]:
        raise NotImplementedError

    def output_lines(self) -> list[str]:
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class _FunctionCode(Code):
    """A block with functions ``update(t, x, u, p)`` and ``output(t, x, u, p)``."""

    def functions(self) -> dict[str, Callable[..., Any]]:
        system = self.node.system
        found = {}
        if system.nstates:
            found[f"{self.name}_update"] = system.updfcn
        if system.noutputs and system.outfcn is not None:
            found[f"{self.name}_output"] = system.outfcn
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
        lines = [f"u{self.index} = {self._inputs('output', known=True)}"]
        for function, first, count in (
            ("corners", corner, self.corners),
            ("commit", memory, len(self.memory)),
        ):
            if count:
                targets = [f"g[{i}]" for i in range(first, first + count)]
                lines.append(f"{_tuple(targets)} = {self._call(function)}")
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
        return position in unpacked_arguments(self.functions()[f"{self.name}_{function}"])

    def _inputs(self, function: str, known: bool) -> str:
        items = _tuple(self.inputs(known))
        if self._as_tuple(function, 2):
            return items
        return f"np.array({items})" if self.node.inputs else "np.empty(0)"

    def _states(self, function: str) -> str:
        n, start = self.node.system.nstates or 0, self.node.state_offset
        if self._as_tuple(function, 1):
            return _tuple([f"x[{i}]" for i in range(start, start + n)])
        return f"x[{start}:{start + n}]" if n else "np.empty(0)"

    def _call(self, function: str) -> str:
        arguments = f"t, {self._states(function)}, u{self.index}, p{self.index}"
        return f"as_vector({self.name}_{function}({arguments}))"

    def constants(self) -> dict[str, Any]:
        return {f"{self.name}_{k}": v for k, v in self._values.items() if not is_numeric(v)}

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
            self.slots[k].expression if k in self.slots else f"{self.name}_{k}"
            for k in self._values
        ]
        return [f"p{self.index} = {self.name}_p({', '.join(values)})"]

    def output_lines(self) -> list[str]:
        if not self.node.system.noutputs:
            return []
        if self.node.system.outfcn is None:
            start = self.node.state_offset
            return [f"y{self.index} = x[{start}:{start + (self.node.system.nstates or 0)}]"]
        inputs = self._inputs("output", known=self.direct)  # NaN where it must not read them
        return [f"u{self.index} = {inputs}", f"y{self.index} = {self._call('output')}"]

    def update_lines(self) -> list[str]:
        n, start = self.node.system.nstates or 0, self.node.state_offset
        if not n:
            return []
        inputs = self._inputs("update", known=True)
        same = self.direct and inputs == self._inputs("output", known=True)
        given = [] if same else [f"u{self.index} = {inputs}"]
        call = self._call("update")
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

    def output_lines(self) -> list[str]:
        matrices, inputs = self._matrices("C", "D"), self.inputs(known=True)
        rows = [self._row(matrices, i, inputs) for i in range(self.node.system.noutputs or 0)]
        return [f"y{self.index} = {_tuple(rows)}"] if rows else []

    def update_lines(self) -> list[str]:
        matrices, inputs = self._matrices("A", "B"), self.inputs(known=True)
        start = self.node.state_offset
        rows = range(self.node.system.nstates or 0)
        return [f"dx[{start + i}] = {self._row(matrices, i, inputs)}" for i in rows]


def code(index: int, node: Node, own: Mapping[str, Slot]) -> Code:
    if isinstance(node.system, ct.StateSpace):
        return _LinearCode(index=index, node=node, slots=own)
    if isinstance(node.system, ct.NonlinearIOSystem):
        return _FunctionCode(index=index, node=node, slots=own)
    raise CompileError(
        f"block '{node.path}' is a {type(node.system).__name__}; only nonlinear and state-space "
        "blocks can be compiled: convert it with ct.ss first"
    )


def _tuple(items: list[str]) -> str:
    return f"({', '.join(items)}{',' if len(items) == 1 else ''})"
