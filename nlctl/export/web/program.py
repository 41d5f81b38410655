"""A loop as a WebAssembly module that runs it: equations, integrators and memory in one file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import control as ct
import numpy as np

from ... import native
from ...annotations import as_annotated
from ...attributes import described_record
from ...errors import CompileError, ParameterError
from ...native.driver import Course, prepared
from ...native.floats import with_every_float
from ...native.integrate.log import Log
from ...native.integrate.memory import arrays_alike, with_fields
from ...native.integrate.methods.lu import WHOLE
from ...native.integrate.methods.stiff import DIFFERENCES, stiff_method
from ...native.integrate.state import LANE, Status
from ...native.run import Run
from ...native.settings import Settings
from ...responses.arguments import input_array, state_array
from ..words import check_written_out, digest, parameter_values, refuse_if_any
from .here import carried_out
from .host import HOST, HOST_FUNCTIONS
from .linking import PROVIDED, check_linker, linked
from .memory import memory_text, places_in_table
from .rounding import rounding_alike
from .timed import TimedProgram, timed_program

NOTED = 8192  # events of one run, for which there is room on a page
_BREAKS = 4096  # switches of functions of time alone
_MOST = 64 * 2**20  # bytes of a run's memory
_FILLED = ("task.p", "task.timed.jumps", "task.timed.until", "task.timed.reach",
           "work.samples", "work.y")  # fmt: skip
_READ = (
    "live.p", "live.t", "live.s", "task", "task.p", "task.times", "task.inputs",
    "task.timed.jumps", "task.timed.until", "task.timed.longest", "task.timed.reach",
    "work.lanes", "work.x", "work.samples", "work.y", "work.log.t", "work.log.row",
)  # fmt: skip
_OF_LANE = ("t", "status", "accepted", "rejected", "noted")


@described_record(made_by="web_program", eq=False)
class WebProgram:
    """A loop that runs in WebAssembly."""

    # Its imports are functions of one and two numbers, those of `Math` in JavaScript.
    module: bytes
    facts: dict[str, Any]  # What its host needs to know: sizes, and where numbers lie in records.
    states: tuple[str, ...]  # Labels, in the order of their arrays.
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    # Every number of them by its name, in the order of their array.
    parameters: Mapping[str, float]
    compiled: native.Compiled  # The diagram.
    run: Run  # The same run in this process, from the same memory; it has ended.
    p: np.ndarray  # Parameters, initial states, and the inputs' samples of the reported run.
    x0: np.ndarray
    u: np.ndarray
    digest: str  # A key of the program and its numbers.

    @property
    def signals(self) -> dict[str, np.ndarray]:
        """Samples of the outputs in the run of this process, by name."""
        return dict(zip(self.outputs, self.run.work.y[:, :, 0].T, strict=False))


@as_annotated
def web_program(
    diagram: ct.InterconnectedSystem,
    times: object,
    inputs: object = 0.0,
    *,
    params: Mapping[str, Any] | None = None,
    initial_state: object = None,
    rtol: float | None = None,
    atol: float | None = None,
) -> WebProgram:
    """Link a loop and the integrators that run it here as a WebAssembly module.

    Parameters
    ----------
    diagram : control.InterconnectedSystem
        In continuous time.
    times : array_like of shape (m,)
        Of the samples (s), increasing.
    inputs : array_like, optional
        As in `nlctl.input_output_response`.
    params : mapping, optional
        Parameters by qualified names, on top of those of the diagram.
    initial_state : mapping or array_like, optional
        As in `nlctl.input_output_response`.
    rtol, atol : float, optional
        Tolerances; by default those of `nlctl.input_output_response`.

    Returns
    -------
    WebProgram
        The module, what its host needs to know, and the same run in this process.

    Raises
    ------
    UsageError
        If Zig is not installed.
    CompileError
        If the module cannot hold it: functions that are called, loops without a fixed number of
        passes, a search for signals of an algebraic loop, transport delays, discrete time,
        functions that JavaScript lacks, or more memory than 64 MiB.
    ParameterError
        If the run with these parameters does not reach its last time, or a value is refused.

    Examples
    --------
    >>> import nlctl
    >>> from nlctl.export.web import web_program
    >>> program = web_program(nlctl.paper.example_1(), [0.0, 0.5, 1.0])  # doctest: +SKIP
    >>> program.module[:4], program.states[:2]  # doctest: +SKIP
    (b'\\x00asm', ('plant_x1', 'plant_x2'))
    """
    check_linker()
    compiled, what = with_every_float(native.compile(diagram)), str(diagram.name)
    p = compiled.parameter_vector(params)
    _check(compiled, what, p)
    grid = np.asarray(times, dtype=float)
    given: dict[str, Any] = {k: v for k, v in (("rtol", rtol), ("atol", atol)) if v is not None}
    start = state_array(compiled.system, initial_state)
    u = np.ascontiguousarray(input_array(compiled.system, inputs, grid))
    settings = Settings(**given, max_steps=1_000_000_000)
    run = _laid_out(compiled, grid, u, start, p, settings)
    lowered = run.machine.lowered
    timed = timed_program(compiled.equations_with(p), compiled.program.layout)
    texts = {
        "program": rounding_alike(lowered.text),
        "timed": rounding_alike(timed.text),
        "host": _host(run, p, timed),
    }
    _check_library("\n".join(texts.values()), what)
    module = linked(texts, (*HOST_FUNCTIONS, *_read_of(texts["host"])), what)
    run = carried_out(run, texts["program"], tuple(lowered.functions), p)
    _check_end(run, what)
    values = parameter_values(compiled, p)
    return WebProgram(
        module=module, facts=_facts(run, timed, p, grid, settings),
        states=tuple(compiled.state_labels or ()), outputs=tuple(diagram.output_labels or ()),
        inputs=tuple(diagram.input_labels or ()), parameters=values, compiled=compiled, run=run,
        p=p, x0=start, u=u,
        digest=digest(lowered.text, values, start),
    )  # fmt: skip


def _check(compiled: native.Compiled, what: str, p: np.ndarray) -> None:
    """Refuse what a module cannot hold."""
    check_written_out(compiled, what, p)
    reasons = {
        "is in discrete time": not ct.isctime(compiled),
        "has transport delays, whose past has no bound on a page": bool(compiled.schedule.lines),
        "has no states": not compiled.nstates,
    }
    refuse_if_any(what, reasons, "run on a page")


def _check_library(text: str, what: str) -> None:
    """Refuse functions of the C library that JavaScript has not."""
    called = set(re.findall(r"^declare double @(\w+)\(double", text, re.MULTILINE))
    lacking = sorted(called - PROVIDED)
    reasons = {f"calls '{name}', which JavaScript has not": True for name in lacking}
    refuse_if_any(what, reasons, "run on a page")


def _laid_out(
    compiled: native.Compiled, times: Any, u: Any, start: Any, p: Any, settings: Settings
) -> Run:
    """Return a run before it begins, with room for what another one of a page may need."""
    course = Course(compiled=compiled, times=times, inputs=u, settings=settings)
    run = prepared(course, start[:, None], p[:, None])
    task, work = run.task, run.work
    conditions = run.machine.lowered.conditions
    timed = task.timed
    if conditions.switches_of_time:
        room = np.full((2, 1, _BREAKS), np.inf)
        count = min(timed.jumps.shape[1], _BREAKS)
        room[:, :, :count] = timed.until[:, :count], timed.jumps[:, :count]
        timed = with_fields(timed, until=room[0], jumps=room[1])
    n = compiled.nstates or 0
    stiff = stiff_method(n, DIFFERENCES, task.stiff.c, WHOLE)
    task = with_fields(task, timed=timed, stiff=stiff)
    if work.log.t.size:
        work = with_fields(work, log=arrays_alike(Log, (NOTED + work.log.t.size, 1)))
    size = sum(a.nbytes for a in (work.samples, work.y, task.p, task.inputs))
    if size > _MOST:
        raise CompileError(
            f"'{compiled.system.name}' cannot run on a page: a run takes {size / 2**20:.0f} MiB of "
            f"memory, {_MOST / 2**20:.0f} MiB at most: take fewer samples"
        )
    return Run(machine=run.machine, task=task, work=work)


def _host(run: Run, p: np.ndarray, timed: TimedProgram) -> str:
    """Return what surrounds the program: functions for a page, and the memory of the run."""
    samples = tuple(f"sample{k}" for k in range(len(run.machine.samples)))
    functions = {
        "task.clocks.functions": samples,
        "task.resets.functions": ("reset",),
        "task.sharp.functions": ("sharp",),
        "task.lines.signals": ("out",),
    }
    filled = [*_FILLED, *(["task.times"] if _is_even(run.task.times) else [])]
    others = [name for name in ("reset", "sharp") if name in run.machine.lowered.functions]
    declared = [
        f"declare void @{name}(ptr, ptr, ptr, ptr, ptr{', ptr, ptr' if name == 'rhs' else ''})"
        for name in ("rhs", "out", *samples, *others)
    ]
    rooms = {"live.t": 1, "live.c": timed.rows, "live.s": timed.size}
    defined = [
        f"@{name} = global [{rows} x double] zeroinitializer, align 64"
        for name, rows in rooms.items()
    ]
    values = ", ".join(f"i64 {v}" for v in p.view(np.int64).tolist()) or "i64 0"
    defined.append(f"@live.p = global [{max(p.size, 1)} x i64] [{values}], align 64")
    memory = memory_text({"task": run.task, "work": run.work}, functions, filled)
    return "\n".join([HOST, *declared, *defined, memory])


def _read_of(text: str) -> list[str]:
    """Return the names of arrays that the host reads or writes and that there are."""
    return [name for name in _READ if re.search(rf"^@{re.escape(name)} = ", text, re.MULTILINE)]


def _is_even(times: np.ndarray) -> bool:
    return np.array_equal(times, np.linspace(times[0], times[-1], times.size))


def _facts(
    run: Run, timed: TimedProgram, p: np.ndarray, times: np.ndarray, settings: Settings
) -> dict[str, Any]:
    """Return what a host needs to know."""
    task, work = run.task, run.work
    fields: Any = LANE.fields
    offsets = {name: fields[name][1] for name in _OF_LANE}
    return {
        "begin": float(times[0]), "end": float(times[-1]), "times": int(times.size),
        "even": _is_even(times), "states": int(work.x.shape[0]), "rows": int(work.y.shape[1]),
        "parameters": int(p.size), "lane": offsets, "log": int(work.log.t.size),
        "inputs": int(task.inputs.shape[0]),
        "table": places_in_table(task, ("rtol", "atol")),
        "rtol": settings.rtol, "atol": settings.atol,
        "levels": timed.levels, "waves": timed.waves, "pulses": timed.pulses,
        "jumps": int(task.timed.jumps.shape[1]), "cells": int(task.timed.reach.shape[1]),
        "values": timed.size,
    }  # fmt: skip


def _check_end(run: Run, what: str) -> None:
    """Refuse a loop whose run does not reach its last time."""
    status = int(run.lanes["status"][0])
    if status != Status.OK:
        reason = Status(status).name.lower() if status >= 0 else "too many events"
        raise ParameterError(
            f"'{what}' cannot be shown on a page: its run ends at t = {run.lanes['t'][0]:.6g} s "
            f"({reason})"
        )
