"""Where every parameter lies in the one flat vector that a program takes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np

from ...blocks import Block
from ...errors import UsageError
from ...upstream.control_internals import current_parameters
from ...upstream.systems import System
from ..purity.captured import same
from .nodes import Node


@dataclass(frozen=True, kw_only=True)
class Slot:
    """One number, vector or matrix in the parameter vector."""

    name: str  # qualified name for nlctl's blocks; path and key for third-party ones
    offset: int  # where it begins
    shape: tuple[int, ...]
    kind: str  # ``"f"`` float, ``"i"`` integer, ``"b"`` Boolean

    @property
    def size(self) -> int:
        """How many entries of the vector it takes."""
        return math.prod(self.shape)

    def moved(self, by: int) -> "Slot":
        """Return the same, `by` places later."""
        return replace(self, offset=self.offset + by)

    @property
    def expression(self) -> str:
        """Source that reads it from the vector `p`."""
        if self.shape:
            whole = f"p[{self.offset}:{self.offset + self.size}]"
            return whole if len(self.shape) == 1 else f"{whole}.reshape({self.shape})"
        return {"f": "p[{}]", "i": "int(p[{}])", "b": "(p[{}] != 0.0)"}[self.kind].format(
            self.offset
        )


def current_values(system: Any) -> Mapping[str, Any]:
    """Return a block's parameters as python-control has resolved them."""
    # A third-party block in a diagram with nlctl's blocks is handed their qualified names as well;
    # they are none of its business.
    if isinstance(system, Block):
        return current_parameters(system)._asdict()
    if isinstance(system, ct.StateSpace):
        return {}
    params = current_parameters(system)
    return {k: params[k] for k in params if k in system.params or "." not in str(k)}


def is_numeric(value: object) -> bool:
    """Whether a parameter can vary between runs: a finite-shaped number or array of numbers."""
    return not isinstance(value, str | dict) and np.asarray(value).dtype.kind in "fib"


def slots(nodes: Sequence[Node]) -> dict[int, dict[str, Slot]]:
    """Lay out the numeric parameters of all blocks."""
    places: dict[int, dict[str, Slot]] = {}
    offset = 0
    for i, node in enumerate(nodes):
        places[i] = slots_of(node.system, node.path, offset)
        offset += sum(slot.size for slot in places[i].values())
    return places


def slots_of(system: System, path: str = "", offset: int = 0) -> dict[str, Slot]:
    """Lay out the numeric parameters of one block from `offset` on, as `slots` does."""
    by_name: dict[str, Slot] = {}
    path = path or system.name
    for name, value in current_values(system).items():
        if not isinstance(name, str):
            raise UsageError(
                f"block '{path}' has a parameter called {name!r}; names must be strings"
            )
        if is_numeric(value):
            array = np.asarray(value)
            by_name[name] = Slot(
                name=f"{path}.{name}", offset=offset, shape=array.shape, kind=array.dtype.kind
            )
            offset += by_name[name].size
    return by_name


def length(layout: Mapping[int, Mapping[str, Slot]]) -> int:
    """Return how many numbers the parameter vector has."""
    return sum(slot.size for block in layout.values() for slot in block.values())


def packed(
    nodes: Sequence[Node],
    layout: Mapping[int, Mapping[str, Slot]],
    fixed: Mapping[int, Mapping[str, Any]],
) -> np.ndarray:
    """Return the parameter vector with the values that the blocks have now."""
    p = np.empty(length(layout))
    for i, block in layout.items():
        path, values, constants = nodes[i].path, current_values(nodes[i].system), fixed.get(i, {})
        for name, value in values.items():
            if name in block:
                filled(p, block[name], value)
            elif name not in constants:
                raise UsageError(
                    f"parameter '{name}' of block '{path}' was not known when the diagram "
                    f"was compiled: declare it in the block's params, or compile with "
                    f"params={{'{name}': ...}}"
                )
            elif not (same(value, constants[name]) or _equal(value, constants[name])):
                raise UsageError(
                    f"parameter '{path}.{name}' is not a number and was {constants[name]!r} when "
                    f"the diagram was compiled; it cannot be {value!r} now: compile again"
                )
    return p


def filled(p: np.ndarray, slot: Slot, value: object) -> None:
    """Put a parameter into its place in the vector."""
    array = np.asarray(value) if is_numeric(value) else None
    if array is None or array.shape != slot.shape:
        now = f"be {value!r}" if array is None else f"have shape {array.shape}"
        raise UsageError(
            f"parameter '{slot.name}' had shape {slot.shape} when the diagram was "
            f"compiled and cannot {now} now: compile again"
        )
    whole = {"i": "an integer", "b": "True or False"}.get(slot.kind)
    if whole and not slot.shape and array.dtype.kind == "f" and array != np.trunc(array):
        raise UsageError(
            f"parameter '{slot.name}' was {whole} when the diagram was compiled and cannot be "
            f"{value!r} now: declare it as a float, with a decimal point, or compile with "
            f"params={{'{slot.name.rpartition('.')[2]}': {value!r}}}"
        )
    p[slot.offset : slot.offset + slot.size] = array.ravel()


def _equal(one: object, other: object) -> bool:
    """Whether two values that are no numbers are equal."""
    try:
        return type(one) is type(other) and bool(np.all(one == other))
    except (TypeError, ValueError):
        return False
