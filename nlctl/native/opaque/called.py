"""Functions that are called unchanged: what they are given, and what they return.

In Python they get what python-control gives them.  numba, where it takes them, gets the same
through a few lines of source: parameters as a record that is read as a dict is, and a tuple for an
argument that the function takes apart.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from types import FunctionType
from typing import Any

import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from ...blocks import Block
from ...equations import equation
from ...errors import BlockError, CompileError
from ...upstream.control_internals import current_parameters
from ...upstream.numba_internals import CPUDispatcher
from ...upstream.systems import System
from ...wording import counted
from ..diagram.nodes import Node
from ..diagram.parameters import Slot, current_values
from ..purity.dicts import (
    as_vector,
    callable_constant,
    callable_now,
    params_record,
    read_by_keys,
    unpacked_arguments,
)
from ..purity.objects import frozen
from .remedies import remedy_of

NO_NUMBERS = (str, bytes, complex, type(None))  # though NumPy would make floats of some


@dataclass(frozen=True, kw_only=True)
class Source:
    """Source for numba, and what it refers to by name."""

    source: str
    names: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Call:
    """Functions of a block that are called for one member at a time."""

    name: str
    # whose functions they are, and which ones
    block: str
    kind: str
    functions: tuple[Any, ...]
    lengths: tuple[int, ...]  # sizes of t, x, u, p and y
    reason: str  # why they could not be traced
    # the block's parameters, where those that are numbers lie, and the record that has them
    template: Mapping[str, Any]
    slots: Mapping[str, Slot]
    record: type | None
    # what numba takes arguments for; None where it would understand the functions in another way
    system: System | None

    @property
    def why(self) -> str:
        """Why they could not be traced, and what to do about that."""
        return f"{self.reason}; {remedy_of(self.reason)}"

    @property
    def given(self) -> int:
        """Number of arguments."""
        return sum(self.lengths[:-1])

    @property
    def failed(self) -> int:
        """Row in which it says that it has failed, counted from its first."""
        return sum(self.lengths)

    @property
    def rows(self) -> int:
        """Rows that it takes: arguments, results, whether it has failed, and with what."""
        return self.failed + 1 + self.given

    @cached_property
    def start(self) -> int:
        """Where the parameters begin in the program's vector."""
        return min((s.offset for s in self.slots.values()), default=0)

    def of_column(self, column: np.ndarray) -> None:
        """Read its arguments from its rows for one member, and write its results there."""
        column[self.given : self.failed] = self.function(column[: self.given].copy())

    def function(self, given: np.ndarray) -> np.ndarray:
        """Return the results in Python, of t, x, u and parameters one after the other."""
        _, x, u, p, count = self.lengths
        places = np.cumsum((1, x, u, p))
        parts = [given[a:b].copy() for a, b in pairwise(places)]
        results = [
            self._numbers(f(float(given[0]), parts[0], parts[1], self._params(parts[2])))
            for f in self.functions
        ]
        values = np.concatenate([np.empty(0), *results])
        if values.size != count:
            raise BlockError(
                f"block '{self.block}' returns {counted(values.size, 'value')} from its "
                f"{self.kind} function, needs {count}"
            )
        return values

    def _numbers(self, values: object) -> np.ndarray:
        """Return what a function returns as a vector; what is not a number is refused."""
        array = np.asarray(values).reshape(-1)
        if array.dtype.kind == "O" and not any(isinstance(v, NO_NUMBERS) for v in array):
            with suppress(TypeError, ValueError):  # python-control converts them as well
                return array.astype(float)
        if array.dtype.kind not in "biufc":
            raise BlockError(
                f"block '{self.block}' returns {str(values)[:60]!r} from its {self.kind} function, "
                "needs numbers"
            )
        return array

    def _params(self, p: np.ndarray) -> Any:
        """Return the parameters as the block's functions take them."""
        values = {
            name: _like(value, p[slot.offset - self.start :][: slot.size])
            if (slot := self.slots.get(name))
            else value
            for name, value in self.template.items()
        }
        return values if self.record is None else self.record(**values)


def call_of(
    name: str, node: Node, kind: str, functions: Sequence[Any], slots: Mapping[str, Slot],
    count: int, reason: str,
) -> Call:  # fmt: skip
    """Return a call of a block's functions."""
    size, system = sum(s.size for s in slots.values()), node.system
    # a name without a value is an error in Python, and 0 in numba's machine code
    # and a message of Python's is written by Python
    in_python = node.numba_differs or node.messages
    return Call(
        name=name, block=node.path, kind=kind, functions=tuple(functions),
        lengths=(1, system.nstates or 0, len(node.inputs), size, count),
        reason="; ".join([reason, *(f"it {m.reason} ({m.place})" for m in node.messages)]),
        template=dict(current_values(system)), slots=slots,
        record=type(current_parameters(system)) if isinstance(system, Block) else None,
        system=None if in_python else system,
    )  # fmt: skip


def _like(template: Any, values: np.ndarray) -> Any:
    """Return numbers in the type and shape that a parameter has."""
    if isinstance(template, np.ndarray):
        return values.reshape(template.shape).astype(template.dtype).view(type(template))
    if isinstance(template, list | tuple):
        parts, at = [], 0
        for item in template:
            size = np.size(item)
            parts.append(_like(item, values[at : at + size]))
            at += size
        fields = hasattr(template, "_fields")
        return type(template)(*parts) if fields else type(template)(parts)
    return type(template)(values[0])


# -- numba -----------------------------------------------------------------------------------------


def source_of(call: Call) -> Source | None:
    """Return the source of ``name(given, y)`` for numba; None where it is for Python alone."""
    if (system := call.system) is None:
        return None
    _, x, u, p, count = call.lengths
    first, second, third = 1, 1 + x, 1 + x + u
    fixed = [k for k in call.template if k not in call.slots]
    values = [
        call.slots[k].moved(-call.start).expression if k in call.slots else
        f"fixed{fixed.index(k)}" for k in call.template
    ]  # fmt: skip
    is_block = isinstance(system, Block)
    record = call.record or params_record(call.block, list(call.template))
    filler = [] if values or is_block else ["0.0"]
    of_parameters = f"record({', '.join(values or filler)})"
    lines = [
        f"def {call.name}(given, y):",
        f"    t, p = given[0], given[{third}:{third + p}]",
        f"    params = {of_parameters if is_block else f'read_by_keys({of_parameters})'}",
    ]
    counts = _counts(call, count)
    at = 0
    for k, function in enumerate(call.functions):
        tuples = _as_tuples(system, function)
        given = [_given(first, x, 1 in tuples), _given(second, u, 2 in tuples)]
        result = f"function{k}(t, {', '.join(given)}, params)"
        lines += [f"    values = as_vector({result}, {counts[k]})"]
        lines += [f"    y[{at + j}] = values[{j}]" for j in range(counts[k])]
        at += counts[k]
    names = {"np": np, "carray": carray, "equation": equation, "record": record}
    names |= {"as_vector": as_vector, "read_by_keys": read_by_keys}
    names |= {f"fixed{i}": callable_constant(call.template[k]) for i, k in enumerate(fixed)}
    names |= {f"function{k}": _jitted(frozen(f)) for k, f in enumerate(call.functions)}
    return Source(source="\n".join([*lines, ""]), names=names)


def _counts(call: Call, count: int) -> list[int]:
    """Return how many results each function has; of several it is found by calling them."""
    if len(call.functions) == 1:
        return [count]
    x, u = np.zeros(call.lengths[1]), np.full(call.lengths[2], 0.25)
    params = call.record(**call.template) if call.record else dict(call.template)
    return [int(np.size(f(0.0, x, u, params))) for f in call.functions]


def _as_tuples(system: System, function: object) -> set[int]:
    """Return which arguments a function wants as tuples: x (1) and u (2)."""
    if isinstance(system, Block):
        return set() if getattr(system.spec, "vector", False) else {1, 2}
    return unpacked_arguments(function)


def _given(first: int, size: int, as_tuple: bool) -> str:
    if not as_tuple:
        return f"given[{first}:{first + size}]"
    items = [f"given[{first + k}]" for k in range(size)]
    return f"({', '.join(items)}{',' if size == 1 else ''})"


def _jitted(function: object) -> Any:
    """Make a function callable from machine code; equations already are."""
    if isinstance(function, CPUDispatcher):
        return function
    if not isinstance(function, FunctionType):
        raise CompileError(f"{function!r} is not a plain function")
    return callable_now(function, error_model="numpy", nogil=True, boundscheck=True)
