"""A page's program in this process: the same operations in the same order, rounded alike."""

from __future__ import annotations

import ctypes
import functools
import lzma
from collections.abc import Callable, Sequence

import llvmlite.binding as llvm
import numpy as np

from ...native.integrate.memory import with_fields
from ...native.integrate.state import RUNNING
from ...native.machine.finish import finished
from ...native.run import Run
from .linking import integrators_text

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
