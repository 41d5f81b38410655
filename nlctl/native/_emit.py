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
from ._foreign import params_dict, params_record, unpacked_arguments
from ._parameters import Slot, current_values, is_numeric, slots
from ._schedule import Combination, Node, Schedule
from ._values import as_vector

LONG = 8  # states from which on a block's derivatives are written as one slice


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
        Fixed values that are no numbers, by name.
    records : mapping
        What gathers a block's parameters, by name: in plain Python, and in machine code.
    layout : mapping
        For every block the places of its parameters in the flat vector `p`.
    """

    source: str
    functions: Mapping[str, Callable[..., Any]]
    constants: Mapping[str, Any]
    records: Mapping[str, tuple[Callable[..., Any], type]]
    layout: Mapping[int, Mapping[str, Slot]]

    def namespace(self, *, native: bool) -> dict[str, Any]:
        """Return everything that the source refers to, by name."""
        records = {name: pair[native] for name, pair in self.records.items()}
        return {**self.constants, **self.functions, **records}


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
    records: dict[str, tuple[Callable[..., Any], type]] = {}
    for block in blocks:
        functions |= block.functions()
        constants |= block.constants()
        records |= block.records()
    return Program(
        source=source, functions=functions, constants=constants, records=records, layout=layout
    )


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

    def records(self) -> dict[str, tuple[Callable[..., Any], type]]:
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
