"""A loop as a WebAssembly module that runs it: equations, integrators and memory in one file."""

import ctypes
import functools
import lzma
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control as ct
import llvmlite.binding as llvm
import numpy as np

from ... import native
from ...annotations import as_annotated
from ...attributes import described_record
from ...errors import CompileError, ParameterError
from ...expressions.functions import COUNTING
from ...expressions.graph import Expr, Graph
from ...native.codegen.ir.program import program_text
from ...native.codegen.plan import Store, split
from ...native.codegen.rewrite import rewritten
from ...native.diagram.parameters import length
from ...native.driver import Course, prepared
from ...native.equations.blocks import Equations
from ...native.floats import with_every_float
from ...native.integrate.log import Log
from ...native.integrate.memory import arrays_alike, with_fields
from ...native.integrate.methods.lu import WHOLE
from ...native.integrate.methods.stiff import DIFFERENCES, stiff_method
from ...native.integrate.state import LANE, RUNNING, Status
from ...native.lower import SAMPLE, planned
from ...native.machine.finish import finished
from ...native.run import Run
from ...native.settings import Settings
from ...responses.arguments import input_array, state_array
from ..words import check_written_out, digest, parameter_values, refuse_if_any
from .linking import PROVIDED, check_linker, integrators_text, linked
from .memory import memory_text, places_in_table
from .rounding import rounding_alike

_ROUNDS = 2000
_PLACE = ctypes.c_void_p
_NUMBER = ctypes.c_int64


def carried_out(run: Run, text: str, names: Sequence[str], p: np.ndarray) -> Run:
    """Return a run that has ended, by the functions of a page's program, which `text` is.

    `run` stays as it was laid out.
    """
    task, code = run.task, finished(text, names)  # to be kept as long as its addresses are used
    address = code.addresses
    samples = [address[f"sample{k}"] for k in range(len(run.machine.samples))]
    resets = [address["reset"]] if run.machine.resets else []
    sharp = [address["sharp"]] if run.machine.sharp else []
    c = np.zeros_like(task.p)
    ctypes.CFUNCTYPE(None, _PLACE, _PLACE)(address["prepare"])(p.ctypes.data, c.ctypes.data)
    task = with_fields(
        task,
        p=c,
        clocks=with_fields(task.clocks, functions=np.array(samples, dtype=np.int64)),
        resets=with_fields(task.resets, functions=np.array(resets, dtype=np.int64)),
        sharp=with_fields(task.sharp, functions=np.array(sharp, dtype=np.int64)),
    )
    table, work = task.table.ctypes.data, run.work.table.ctypes.data
    rhs, out, lane = address["rhs"], address["out"], run.work.lanes[0]
    call = _integrators()
    call("start", rhs, table, work)
    run.work.samples[0] = run.work.x
    tried = -1
    while lane["status"] == RUNNING and lane["accepted"] + lane["rejected"] != tried:
        tried = int(lane["accepted"] + lane["rejected"])
        call("advance", rhs, 0, 0, table, work, _ROUNDS)
    call("outputs", rhs, out, table, work)
    return Run(machine=run.machine, task=task, work=run.work)


@functools.cache
def _integrators() -> Callable[..., None]:
    """Return the integrators, called by their names and numbers."""
    module = llvm.parse_assembly(integrators_text())
    loaded = finished(lzma.compress(module.as_bitcode(), preset=1), ("start", "advance", "outputs"))
    nothing = (_PLACE * 4)()

    def call(name: str, *numbers: object) -> None:
        kinds = [_NUMBER] * len(numbers)
        function = ctypes.CFUNCTYPE(ctypes.c_int32, _PLACE, _PLACE, *kinds)
        function(loaded.addresses[name])(nothing, ctypes.byref(nothing, 8), *numbers)

    return call


HEAP = 1 << 20  # bytes; the integrators ask for a few arrays of flags at a time

HOST = f"""
@host.heap = internal global [{HEAP} x i8] zeroinitializer, align 64
@host.top = internal global i64 0
@host.held = internal global i64 0
@host.nothing = internal global [4 x i64] zeroinitializer, align 16

; memory is taken from the heap one behind the other, and all of it is free again when none is held
define ptr @malloc(i64 %size) nounwind {{
  %begin = load i64, ptr @host.top
  %behind = add i64 %begin, %size
  %more = add i64 %behind, 63
  %end = and i64 %more, -64
  %fits = icmp ule i64 %end, {HEAP}
  br i1 %fits, label %there, label %none
there:
  store i64 %end, ptr @host.top
  %before = load i64, ptr @host.held
  %now = add i64 %before, 1
  store i64 %now, ptr @host.held
  %place = getelementptr i8, ptr @host.heap, i64 %begin
  ret ptr %place
none:
  ret ptr null
}}

define void @free(ptr %place) nounwind {{
  %before = load i64, ptr @host.held
  %now = sub i64 %before, 1
  store i64 %now, ptr @host.held
  %last = icmp eq i64 %now, 0
  br i1 %last, label %empty, label %done
empty:
  store i64 0, ptr @host.top
  br label %done
done:
  ret void
}}

declare void @prepare(ptr, ptr)
declare void @timed.prepare(ptr, ptr)
declare void @timed(ptr, ptr, ptr, ptr, ptr)
declare i32 @start(ptr, ptr, i64, ptr, ptr)
declare i32 @advance(ptr, ptr, i64, i64, i64, ptr, ptr, i64)
declare i32 @outputs(ptr, ptr, i64, i64, ptr, ptr)

define void @live_prepare() nounwind {{
  call void @prepare(ptr @live.p, ptr @task.p)
  ret void
}}

define i32 @live_start() nounwind {{
  %rhs = ptrtoint ptr @rhs to i64
  %status = call i32 @start(ptr @host.nothing, ptr @host.nothing, i64 %rhs, ptr @task, ptr @work)
  ret i32 %status
}}

define i32 @live_advance(i32 %rounds) nounwind {{
  %rhs = ptrtoint ptr @rhs to i64
  %many = zext i32 %rounds to i64
  %status = call i32 @advance(ptr @host.nothing, ptr @host.nothing, i64 %rhs, i64 0, i64 0,
                              ptr @task, ptr @work, i64 %many)
  ret i32 %status
}}

define i32 @live_outputs() nounwind {{
  %rhs = ptrtoint ptr @rhs to i64
  %out = ptrtoint ptr @out to i64
  %status = call i32 @outputs(ptr @host.nothing, ptr @host.nothing, i64 %rhs, i64 %out,
                              ptr @task, ptr @work)
  ret i32 %status
}}

define void @live_timed() nounwind {{
  call void @timed(ptr @live.t, ptr @live.t, ptr @live.t, ptr @live.c, ptr @live.s)
  ret void
}}

define void @live_timed_prepare() nounwind {{
  call void @timed.prepare(ptr @live.p, ptr @live.c)
  ret void
}}
"""
HOST_FUNCTIONS = (
    "live_prepare", "live_start", "live_advance", "live_outputs", "live_timed",
    "live_timed_prepare",
)  # fmt: skip


_STEADY = (*COUNTING, "sign", "heaviside")  # they are their own levels


@dataclass(frozen=True, kw_only=True)
class TimedProgram:
    """Functions of time alone as ``timed(t, x, u, c, s)`` and ``timed.prepare(p, c)``."""

    text: str  # LLVM's IR
    rows: int  # of `c`
    # so many first entries of `s` are constant between the times at which conditions switch
    levels: int
    # of products of sines where the angular frequencies of the factors are, begin and end
    waves: tuple[tuple[tuple[int, int], ...], ...]
    # where functions are that drive the equations, begin and end
    pulses: tuple[tuple[int, int], ...]
    size: int  # of `s`


def timed_program(equations: Equations, layout: Any) -> TimedProgram:
    """Return what a diagram has of functions of time alone."""
    conditions, graph = equations.conditions, equations.graph
    stores: list[Store] = []

    def stored(expr: Expr) -> tuple[int, int]:
        begin = sum(store.size for store in stores)
        size = expr.size or 1
        stores.extend(split(Store(array="s", row=begin, expr=graph.number(expr), size=size)))
        return begin, begin + size

    levels = [_level(graph, condition) for condition in conditions.of_time]
    zero = graph.const(0.0)
    for line in conditions.declared_of_time.values():  # at 0 a block may be on either side
        levels += [graph.op(order, line, zero) for order in ("lt", "le")]
    ends = [stored(level)[1] for level in levels]
    waves = tuple(tuple(stored(slope) for slope in wave) for wave in conditions.waves)
    pulses = tuple(stored(term) for term in conditions.pulses)
    values, exact, _ = rewritten(graph, {"timed": stores})
    functions, rows = planned(values, {"timed": SAMPLE}, length(layout))
    named = {"timed.prepare": functions["prepare"], "timed": functions["timed"]}
    return TimedProgram(
        text=program_text(named, 1, exact), rows=max(rows, 1), levels=max(ends, default=0),
        waves=waves, pulses=pulses, size=max(sum(store.size for store in stores), 1),
    )  # fmt: skip


def _level(graph: Graph, condition: Expr) -> Expr:
    """Return a number that is constant between the switches of a condition."""
    op, args = condition.op, condition.args
    if condition.kind == "b" or op in _STEADY:
        return condition
    if op in ("remainder", "fmod"):
        half = graph.op("mul", graph.const(0.5), graph.op("absolute", args[1]))
        return graph.op("gt", graph.op("absolute", condition), half)
    if op in ("minimum", "maximum"):
        return graph.op("lt", *args)
    return graph.op("lt", args[1] if op == "copysign" else args[0], graph.const(0.0))


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
