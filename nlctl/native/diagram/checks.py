"""What is checked of the functions of a diagram before any is traced or compiled."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from ...blocks import Block, supplied_of
from ...delays.transport import PAST
from ...errors import CompileError
from ...params import as_numbers
from ...probing import check_arguments
from ...upstream.control_internals import current_parameters, outputs_now, rates_now, set_parameters
from ...upstream.systems import System
from ...wording import counted
from ..purity.check import FunctionReading, check_pure
from ..purity.registers import check_apart
from ..purity.values import FRESH, VECTOR, Impure, captured
from .parameters import current_values


def check_sizes(system: System, blocks: Iterable[Any]) -> None:
    """Hold a diagram to the number of states that its blocks have."""
    had = sum(block.nstates or 0 for block in blocks)
    if had != (system.nstates or 0):
        raise CompileError(
            f"diagram '{system.name}' was made with states={system.nstates or 0}, but its blocks "
            f"have {had}: leave the argument out"
        )


def check_functions(path: str, system: System, *, may_write: bool = False) -> FunctionReading:
    """Check that a block's functions depend on their arguments alone, and return enough values."""
    # The functions are read, not called, until they are known to remember nothing.
    is_block, readings = isinstance(system, Block), []
    for what, function in _functions(system):
        values = current_parameters(system) if is_block else current_values(system)
        check_arguments(f"block '{path}'", what, function, ("t", "x", "u", "params"))
        try:
            given = [FRESH, VECTOR, VECTOR, captured(values)]
            reading = check_pure(function, given, may_write=may_write)
            readings.append(reading)
            for other in readings[:-1]:
                check_apart(reading.registers, other.captured, is_same=False)
                check_apart(other.registers, reading.captured, is_same=False)
        except Impure as error:
            raise refused_block(path, what, error) from None
    messages = [message for reading in readings for message in reading.messages]
    registers = {r.key: r for reading in readings for r in reading.registers}
    if not messages and not registers and not is_block and isinstance(system, ct.NonlinearIOSystem):
        _check_counts(path, system)  # nlctl's blocks were checked when they were made
    return FunctionReading(
        captured=tuple(note for reading in readings for note in reading.captured),
        numba_differs=tuple(name for reading in readings for name in reading.numba_differs),
        messages=tuple(messages),
        registers=tuple(registers.values()),
    )


def check_registers(readings: Mapping[str, FunctionReading]) -> None:
    """Check that no block reads what the functions of another one write into."""
    for path, one in readings.items():
        others = [r for p, r in readings.items() if p != path]
        try:
            check_apart(one.registers, (n for r in others for n in r.captured), is_same=False)
        except Impure as error:
            raise refused_block(path, "update or output", error) from None


def refused_block(path: str, what: str, error: Impure) -> CompileError:
    """Return the error that says why a block's function is neither compiled nor called."""
    place = f" ({error.place})" if error.place else ""
    return CompileError(
        f"block '{path}' cannot be compiled: its {what} function {error.reason}"
        f"{place}: {error.advice}; the diagram still runs in python-control"
    )


def _functions(system: System) -> Iterator[tuple[str, Any]]:
    """Yield what is called of a block, with its name."""
    if isinstance(system, ct.StateSpace) or not isinstance(system, ct.NonlinearIOSystem):
        return
    if system.nstates:
        yield "update", system.updfcn
    if system.noutputs != 0 and system.outfcn is not None and supplied_of(system) is not PAST:
        yield "output", system.outfcn
    if isinstance(system, Block):
        for name in ("switching", "commit"):
            if hasattr(system.spec, name):
                yield name, getattr(system.spec, name)


def _check_counts(path: str, system: ct.NonlinearIOSystem) -> None:
    """Call a block's functions once: as many values must come back as there are signals."""
    calls = [("update", rates_now, system.nstates, "states")] if system.nstates else []
    if system.outfcn is not None and system.noutputs:
        calls.append(("output", outputs_now, system.noutputs, "outputs"))
    x, u = np.zeros(system.nstates or 0), np.zeros(system.ninputs or 0)
    for what, function, size, kind in calls:
        try:
            with np.errstate(all="ignore"):
                got = np.size(function(system, 0.0, x, u))
        except IndexError as error:
            raise CompileError(
                f"block '{path}' reads beyond an array in its {what} function: {error}"
            ) from error
        except Exception:  # what fails at this point alone may work at others
            continue
        if got != size:
            raise CompileError(
                f"block '{path}' returns {counted(got, 'value')} from its {what} function, needs "
                f"{size}, one for each of its {kind}"
            )


# -- blocks that do not say how many signals they have ---------------------------------------------


def sized(system: System, times: ArrayLike, inputs: object, initial_state: object) -> Any:
    """Return a block with the numbers of states, inputs and outputs that a run gives it."""
    # python-control takes them from the run's arguments where a block does not declare them.
    counts = (system.nstates, system.ninputs, system.noutputs)
    diagram = isinstance(system, ct.InterconnectedSystem)
    if diagram or not isinstance(system, ct.NonlinearIOSystem) or None not in counts:
        return system
    given, x = _input_rows(inputs, np.size(times)), as_numbers(initial_state)
    if given is None or (x is None and initial_state is not None):
        return system  # names: what is missing is named when it is compiled
    states = counts[0] if counts[0] is not None else 0 if x is None else x.size
    rows = counts[1] if counts[1] is not None else given
    outputs = counts[2]
    if outputs is None:
        outputs = states if system.outfcn is None else _output_size(system, states, rows)
    return _with(system, states, rows, outputs)


def _input_rows(inputs: object, samples: int) -> int | None:
    """Return how many inputs are given: a list has an entry for each, unless these are samples."""
    if isinstance(inputs, list | tuple) and len(inputs) != samples:
        rows = [_input_rows(np.asarray(entry), samples) for entry in inputs]
        return None if None in rows else sum(row or 0 for row in rows)
    u = as_numbers(inputs)
    return None if u is None else u.shape[0] if u.ndim == 2 else 1


def _with(system: Any, states: int, inputs: int, outputs: int | None) -> Any:
    block = ct.NonlinearIOSystem(
        system.updfcn, system.outfcn, states=states, inputs=inputs, outputs=outputs,
        dt=system.dt, params=system.params, name=system.name,
    )  # fmt: skip
    set_parameters(block, None)
    return block


def _output_size(system: System, states: int, inputs: int) -> int:
    """Return how many outputs there are, of a function that is known to remember nothing."""
    asked = _with(system, states, inputs, None)
    check_functions(system.name, asked)
    return int(np.size(outputs_now(asked, 0.0, np.zeros(states), np.zeros(inputs))))
