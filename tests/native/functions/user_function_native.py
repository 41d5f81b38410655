"""The corpus in machine code, in a process of its own: a crash ends this one alone.

`run` starts it and reads what it writes, a line of JSON per entry: its name when it begins, and
the verdict when it is known.
"""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import control as ct
import numpy as np
import user_functions
from numba.core.errors import NumbaError
from places import SUPPORT
from user_function_checks import Points, agrees, called, expected, judged, points, quiet, shown

import nlctl
from nlctl.native.machine.evaluations import machine

JOB = Path(__file__)
WIDTH = 8  # members side by side in an ensemble
END = 0.01
TOGETHER = 240  # states in one run, or few more
MEMORY = 8 * 2**30
RUN_CLOSE = 1e-6
NAMED = {entry.name: entry for entry in user_functions.ENTRIES}


def run(job: str, n: int, names: list[str]) -> dict[str, tuple[str, str]]:
    """Return (kind, text) per entry; an entry that ends the process is "crash"."""
    found: dict[str, tuple[str, str]] = {}
    waiting = list(names)
    while waiting:
        done = _process(job, n, waiting)
        begun = ""
        for line in filter(lambda line: line.startswith('{"name"'), done.stdout.splitlines()):
            told = json.loads(line)
            begun = told["name"]
            if "kind" in told:
                found[begun] = told["kind"], told["text"]
        missing = [name for name in waiting if name not in found]
        if done.returncode == 0 or not missing:
            return found
        text = f"exit code {done.returncode}\n{done.stderr[-1500:]}"
        if job == "joint" and len(waiting) > 1:
            half = len(missing) // 2 or 1
            return found | run(job, n, missing[:half]) | run(job, n, missing[half:])
        found[begun or missing[0]] = "crash", text
        waiting = [name for name in waiting if name not in found]
    return found


def _process(job: str, n: int, names: list[str]) -> subprocess.CompletedProcess:
    environment = {**os.environ, "PYTHONPATH": str(SUPPORT), "PYTHONWARNINGS": "ignore"}
    command = [sys.executable, str(JOB), job, str(n), *names]
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=1500)


def tell(name: str, **found: str) -> None:
    print(json.dumps({"name": name, **found}), file=sys.__stdout__, flush=True)


def computed(compiled: nlctl.native.Compiled, at: Points) -> tuple[np.ndarray, np.ndarray]:
    """Return dx and y of the machine code for as many members as there are points."""
    system, lanes = compiled.system, at.t.size
    p = np.repeat(compiled.parameter_vector()[:, None], lanes, axis=1)
    code = machine(compiled, p, lanes)
    rows = code.lowered.rows
    sizes = (code.rows, system.nstates, rows["g"], rows["m"], system.noutputs)
    c, dx, g, m, y = (np.full((n or 0, lanes), np.nan) for n in sizes)
    code.prepare(p, c)
    given = [np.ascontiguousarray(a) for a in (at.t, at.x, at.u)]
    code.rhs(*given, c, dx, g, m)
    code.out(*given, c, y)
    return dx, y


def compared(found: tuple, wanted: tuple, where: str) -> str:
    """Return where results of machine code and python-control are apart, or nothing."""
    for name, one, want in zip(("dx", "y"), found, wanted, strict=True):
        if not agrees(one, want):
            return f"{where}: {shown(name, one, want)}"
    return ""


def single(name: str, n: int) -> tuple[str, str]:
    """Compile one entry by itself, and compare at some points one after the other."""
    made = NAMED[name].make(n)
    system = user_functions.system(made, name)
    at = points(made)
    try:
        compiled = nlctl.compile(system)
        for lane in (0, 1, 2, 3, 16, 17, 18, 19):
            wanted = expected(system, at.at(lane))
            try:
                dx, y = computed(compiled, at.only(lane))
            except NumbaError:
                nlctl.native.compile_ahead(compiled)  # says the same in the user's words
                raise
            except Exception:
                if any(one is None for one in wanted):  # both raise
                    continue
                raise
            apart = compared((dx[:, 0], y[:, 0]), wanted, f"point {lane}")
            if apart:
                return "different", apart
    except nlctl.errors.CompileError as error:
        return "refused", str(error)
    return "equal", ""


def diagram(blocks: list[Any]) -> Any:
    """Join blocks side by side: each keeps its own inputs, outputs and parameters."""
    inputs = [f"{block.name}.{label}" for block in blocks for label in block.input_labels]
    outputs = [f"{block.name}.{label}" for block in blocks for label in block.output_labels]
    return ct.interconnect(blocks, connections=False, inplist=inputs, outlist=outputs, params={},
                           inputs=len(inputs), outputs=len(outputs), name="joint")  # fmt: skip


def joint(names: list[str], n: int) -> dict[str, tuple[str, str]]:
    """Compile all entries as one diagram; compare alone, side by side, and in a short run."""
    made = {name: NAMED[name].make(n) for name in names}
    blocks = [user_functions.system(made[name], name) for name in names]
    own = [points(made[name]) for name in names]
    compiled = nlctl.compile(diagram(blocks))
    verdicts = dict.fromkeys(names, ("equal", ""))
    for lanes in ([0], [2], [17], list(range(1, 1 + WIDTH))):
        at = Points(
            own[0].t[lanes],
            *(np.vstack([getattr(one, part)[:, lanes] for one in own]) for part in ("x", "u")),
        )
        # the times of the first block serve all
        dx, y = computed(compiled, at)
        wheres = [f"point {lane} of {len(lanes)} side by side" for lane in lanes]
        _judge(verdicts, blocks, at, dx, y, wheres)
    _judge_runs(verdicts, names, n)
    return verdicts


def _judge(verdicts, blocks, at, dx, y, wheres) -> None:
    """Compare each block's part with python-control's block."""
    x0 = u0 = y0 = 0
    for block in blocks:
        n, m, k = block.nstates or 0, block.ninputs or 0, block.noutputs or 0
        for lane, where in enumerate(wheres):
            point = (float(at.t[lane]), at.x[x0 : x0 + n, lane], at.u[u0 : u0 + m, lane])
            found = dx[x0 : x0 + n, lane], y[y0 : y0 + k, lane]
            apart = compared(found, expected(block, point), where)
            if apart and verdicts[block.name][0] == "equal":
                verdicts[block.name] = "different", apart
        x0, u0, y0 = x0 + n, u0 + m, y0 + k


def _judge_runs(verdicts: dict, names: list[str], n: int) -> None:
    """Run for a moment what is smooth there, and compare with runs in python-control."""
    rng, smooth = np.random.default_rng(7), []
    for name in names:
        block = user_functions.system(NAMED[name].make(n), name)
        x, u = (0.4 * rng.normal(size=size or 0) for size in (block.nstates, block.ninputs))
        end = moved(block, x, u)
        if x.size and np.isfinite(end).all():
            smooth.append((name, x, u, end))
    many = max(4, TOGETHER // n)
    for first in range(0, len(smooth), many):
        chosen, xs, us, ends = zip(*smooth[first : first + many], strict=True)
        blocks = [user_functions.system(NAMED[name].make(n), name) for name in chosen]
        compiled = nlctl.compile(diagram(blocks))
        held = np.outer(np.concatenate(us), [1, 1])
        run = nlctl.input_output_response(compiled, [0.0, END], held, np.concatenate(xs))
        places = np.cumsum([0, *(x.size for x in xs)])
        for name, at, end in zip(chosen, places, ends, strict=False):
            found = run.states[at : at + end.size, -1]
            if not np.allclose(found, end, rtol=RUN_CLOSE, atol=RUN_CLOSE):
                i = int(np.argmax(np.abs(found - end)))
                text = f"run: x[{i}]({END}) = {found[i]!r}, python-control {end[i]!r}"
                verdicts[name] = "different", text


def moved(block: Any, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the state after a moment; NaN where another step still makes a difference."""

    def rate(t, x):
        found = called(block.dynamics, x.size, t, x.copy(), u.copy())
        return np.full(x.size, np.nan) if found is None else found

    def stepped(steps):
        v, h = x, END / steps
        for i in range(steps):
            k1 = rate(i * h, v)
            k2 = rate((i + 0.5) * h, v + h / 2 * k1)
            k3 = rate((i + 0.5) * h, v + h / 2 * k2)
            v = v + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate((i + 1) * h, v + h * k3))
        return v

    fine, coarser = stepped(20), (stepped(10), stepped(13))  # a jump may look alike after halving
    same = all(np.allclose(other, fine, rtol=1e-8, atol=1e-8) for other in coarser)
    return fine if same else fine * np.nan


def stepped(name: str, n: int) -> tuple[str, str]:
    """Run one entry for some steps in discrete time, in machine code and in python-control."""
    made = NAMED[name].make(n)
    system = user_functions.system(made, name, 0.1)
    rng = np.random.default_rng(3)
    x, times = 0.3 * rng.normal(size=made.states), 0.1 * np.arange(6)
    u = rng.normal(size=(made.inputs, 6))
    wanted = ct.input_output_response(system, times, u, x)
    try:
        compiled = nlctl.compile(user_functions.system(NAMED[name].make(n), name, 0.1))
        found = nlctl.input_output_response(compiled, times, u, x)
    except nlctl.errors.CompileError as error:
        return "refused", str(error)
    for part in ("x", "y"):
        apart = np.abs(getattr(found, part) - getattr(wanted, part))
        scale = np.max(np.abs(getattr(wanted, part)), initial=0.0)
        if not np.all(apart <= 1e-11 * scale):
            return "different", f"{part} by {apart.max()}"
    return "equal", ""


def main(job: str, n: int, names: list[str]) -> None:
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))  # a fault must not stop the machine
    with quiet():
        if job == "joint":
            for name, (kind, text) in joint(names, n).items():
                tell(name, kind=kind, text=text)
            return
        for name in names:
            tell(name)
            try:
                kind, text = {"single": single, "stepped": stepped}[job](name, n)
            except Exception as error:
                kind, text = "error", f"{type(error).__name__}: {error}"
            tell(name, kind=kind, text=text)


def accepted(pure: Iterable[user_functions.Entry], n: int, *, opaque: bool) -> list[str]:
    """Return those of the pure entries that are equal so far: those traced, or those called."""
    return [
        entry.name
        for entry in pure
        if judged(entry, n).kind == "equal"
        and bool(judged(entry, n).text) == opaque
        and (opaque or not entry.alone)
    ]


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3:])
