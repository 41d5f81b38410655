"""From a schedule to readable Python source of one right-hand side.

The source calls the blocks' own functions and nothing else: an equation stays written once.  It
runs as plain Python and as machine code.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from .._block import Block
from .._errors import UsageError
from ._parameters import Slot, current_values, is_numeric, slots
from ._schedule import Combination, Node, Schedule
from ._values import as_vector


class CompileError(UsageError):
    """A block that cannot be compiled: the message names it and says why."""


@dataclass(frozen=True, kw_only=True)
class Program:
    """Emitted source, and what it refers to.

    Attributes
    ----------
    source : str
        Defines ``rhs(t, x, u, p, dx)`` and ``out(t, x, u, p, y)``, which fill their last argument.
    functions : mapping
        The blocks' own functions, by the names that the source uses.
    constants : mapping
        Types of parameter records and other fixed values, by name.
    layout : mapping
        For every block the places of its parameters in the flat vector `p`.
    """

    source: str
    functions: Mapping[str, Callable[..., Any]]
    constants: Mapping[str, Any]
    layout: Mapping[int, Mapping[str, Slot]]


def emit(schedule: Schedule) -> Program:
    """Write the program of a schedule.

    Parameters
    ----------
    schedule : Schedule

    Returns
    -------
    Program

    Raises
    ------
    CompileError
        If a block is of a kind that cannot be compiled.
    """
    layout = slots(schedule.nodes)
    blocks = [_code(i, node, layout[i]) for i, node in enumerate(schedule.nodes)]
    parameters = [line for block in blocks for line in block.parameter_lines()]
    outputs = [line for i in schedule.order for line in blocks[i].output_lines()]
    updates = [line for block in blocks for line in block.update_lines()]
    results = [f"y[{i}] = {_sum(c)}" for i, c in enumerate(schedule.outputs)]
    source = "\n".join(
        [
            "def rhs(t, x, u, p, dx):",
            *_indented([*parameters, *outputs, *(updates or ["pass"])]),
            "",
            "",
            "def out(t, x, u, p, y):",
            *_indented([*parameters, *outputs, *(results or ["pass"])]),
            "",
        ]
    )
    functions: dict[str, Callable[..., Any]] = {}
    constants: dict[str, Any] = {"np": np, "as_vector": as_vector}
    for block in blocks:
        functions |= block.functions()
        constants |= block.constants()
    return Program(source=source, functions=functions, constants=constants, layout=layout)


def _indented(lines: list[str]) -> Iterator[str]:
    return (f"    {line}" for line in lines)


def _sum(combination: Combination) -> str:
    """Write a linear combination of signals."""
    terms = []
    for signal, gain in combination.items():
        name = f"u[{signal.index}]" if signal.block is None else f"y{signal.block}[{signal.index}]"
        sign = {1.0: "", -1.0: "-"}.get(gain, f"{gain!r} * ")
        terms.append(sign + name)
    return " + ".join(terms).replace("+ -", "- ") if terms else "0.0"


@dataclass(frozen=True, kw_only=True)
class _Code:
    """How one block is called."""

    index: int
    node: Node
    slots: Mapping[str, Slot]

    @property
    def name(self) -> str:
        return re.sub(r"\W", "_", self.node.path)

    def inputs(self, known: bool) -> list[str]:
        """Expressions of the inputs; NaN where they are not known yet and must not matter."""
        return [_sum(c) if known else "np.nan" for c in self.node.inputs]

    @property
    def direct(self) -> bool:
        return bool(self.node.direct.any())

    def functions(self) -> dict[str, Callable[..., Any]]:
        return {}

    def constants(self) -> dict[str, Any]:
        return {}

    def parameter_lines(self) -> list[str]:
        return []

    def update_lines(self) -> list[str]:
        raise NotImplementedError

    def output_lines(self) -> list[str]:
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class _FunctionCode(_Code):
    """A block with functions ``update(t, x, u, p)`` and ``output(t, x, u, p)``."""

    def functions(self) -> dict[str, Callable[..., Any]]:
        system = self.node.system
        found = {}
        if system.nstates:
            found[f"{self.name}_update"] = system.updfcn
        if system.noutputs and system.outfcn is not None:
            found[f"{self.name}_output"] = system.outfcn
        return found

    @property
    def _vector(self) -> bool:
        """Whether the functions want arrays; nlctl's small blocks want tuples to unpack."""
        spec = getattr(self.node.system, "spec", None)
        return spec is None or getattr(spec, "vector", False)

    def _inputs(self, known: bool) -> str:
        items = _tuple(self.inputs(known))
        if not self._vector:
            return items
        return f"np.array({items})" if self.node.inputs else "np.empty(0)"

    def _states(self) -> str:
        n, start = self.node.system.nstates or 0, self.node.state_offset
        if self._vector:
            return f"x[{start}:{start + n}]" if n else "np.empty(0)"
        return _tuple([f"x[{i}]" for i in range(start, start + n)])

    def _call(self, function: str, inputs: str) -> str:
        return f"{self.name}_{function}(t, {self._states()}, {inputs}, p{self.index})"

    def constants(self) -> dict[str, Any]:
        found = {k: v for k, v in self._values.items() if not is_numeric(v)}
        named = {f"{self.name}_{k}": v for k, v in found.items() if not isinstance(v, str)}
        if isinstance(self.node.system, Block):
            named[f"{self.name}_p"] = type(self.node.system._current_params)
        return named

    @property
    def _values(self) -> Mapping[str, Any]:
        return current_values(self.node.system)

    def parameter_lines(self) -> list[str]:
        """Gather the parameters: a record for nlctl's blocks, a dict for foreign ones.

        A dict whose values are all of one type would become a hash map in machine code; an entry
        of another type keeps it a record with named fields.
        """
        if isinstance(self.node.system, Block):
            fields = ", ".join(slot.expression for slot in self.slots.values())
            return [f"p{self.index} = {self.name}_p({fields})"]
        entries = [f"{k!r}: {self._entry(k)}" for k in self._values]
        return [f"p{self.index} = {{{', '.join([*entries, repr('') + ': ' + repr('')])}}}"]

    def _entry(self, name: str) -> str:
        if name in self.slots:
            return self.slots[name].expression
        value = self._values[name]
        return repr(value) if isinstance(value, str) else f"{self.name}_{name}"

    def output_lines(self) -> list[str]:
        if not self.node.system.noutputs:
            return []
        if self.node.system.outfcn is None:
            return [f"y{self.index} = {self._states()}"]
        if not self.direct:  # evaluated before its inputs are known
            return [f"y{self.index} = as_vector({self._call('output', self._inputs(False))})"]
        return [
            f"u{self.index} = {self._inputs(True)}",
            f"y{self.index} = as_vector({self._call('output', f'u{self.index}')})",
        ]

    def update_lines(self) -> list[str]:
        n, start = self.node.system.nstates or 0, self.node.state_offset
        if not n:
            return []
        given = [] if self.direct else [f"u{self.index} = {self._inputs(True)}"]
        call = f"as_vector({self._call('update', f'u{self.index}')})"
        if self._vector:
            return [*given, f"dx[{start}:{start + n}] = {call}"]
        names = [f"dx[{i}]" for i in range(start, start + n)]
        return [*given, f"{_tuple(names)} = {call}"]


@dataclass(frozen=True, kw_only=True)
class _LinearCode(_Code):
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


def _code(index: int, node: Node, own: Mapping[str, Slot]) -> _Code:
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
