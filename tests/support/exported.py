"""Exported controllers, compiled and run on recorded inputs: on this machine, on a chip."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import control as ct
import numpy as np
import pytest
from extras import needed_program

import nlctl
from nlctl.export import c_files

HERE = Path(__file__).parent.parent / "export"
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror"]
CHIP = ["-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-nostartfiles"]
EMULATOR = ["-M", "mps2-an500", "-nographic", "-semihosting", "-kernel", "program"]


def halved(t, x, u, params):
    """A function that is called unchanged: how often it goes round depends on its input."""
    y = u[0]
    while abs(y) > 1.0:
        y = 0.5 * y
        if y == 0.5:
            continue  # a pass with one is not written out
    return [y]


def recorded(parts, name, dt, steps, initial_state=None):
    """Return what a sampled block of a loop gets and gives at every sample: (steps, inputs), ...

    A sampled copy of each of its inputs records what the sample itself computes of it.
    """
    law = next(part for part in parts if part.name == name)
    copies = [
        nlctl.sampled(ct.ss([], [], [], 1, dt, inputs=u, outputs=f"copy{k}", name=f"probe{k}"))
        for k, u in enumerate(law.input_labels)
    ]
    outlist = [f"probe{k}.copy{k}" for k in range(len(copies))]
    outlist += [f"{name}.{y}" for y in law.output_labels]
    loop = nlctl.interconnect(
        [*parts, *copies], inputs=[], inplist=[], outlist=outlist,
        outputs=[place.replace(".", "_") for place in outlist], name="recorded",
    )  # fmt: skip
    times = dt * np.arange(steps)
    response = nlctl.input_output_response(loop, times, 0, initial_state or {})
    assert np.isfinite(response.outputs).all()
    return loop, times, *np.split(response.outputs.T, [len(copies)], axis=1)


def written(folder, controller):
    """Write a controller's files and those that run it; return the compiler's definitions."""
    name = controller.name
    for file, text in c_files(controller).items():
        (folder / file).write_text(text)
    for path in (HERE / "harness.c", *(HERE / "chip").iterdir()):
        shutil.copy(path, folder)
    time = "inputs[INPUTS], " if controller.takes_time else ""
    return [
        f'-DHEADER="{name}.h"', f"-DSTATE={name}_state",
        f"-DRESET={name}_reset", f"-DVALUES={name}_parameters",
        f"-DSTEP={name}_step(&self, {time}inputs, outputs)",
        f"-DINPUTS={len(controller.inputs)}", f"-DOUTPUTS={len(controller.outputs)}",
    ]  # fmt: skip


def run_here(folder, defined, code, inputs, times, optimised="-O2"):
    """Compile and run on this machine."""
    compiler = needed_program(("gcc", "clang"))
    command = [compiler, *STRICT, optimised, *defined, "harness.c", code, "-lm", "-o", "program"]
    return _run(folder, [*command, *(["-no-pie"] if code.endswith(".o") else [])], ["./program"],
                inputs, times)  # fmt: skip


def run_on_chip(folder, defined, code, inputs, times):
    """Compile for a Cortex-M7 and run in an emulator of one; skip where there is none."""
    programs = "arm-none-eabi-gcc", "qemu-system-arm"
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"needs {program}")
    command = [
        programs[0], "-std=c99", "-O2", *CHIP, "-Tchip.ld", "--specs=rdimon.specs", *defined,
        "startup.c", "harness.c", code, "-lm", "-o", "program",
    ]  # fmt: skip
    return _run(folder, command, [programs[1], *EMULATOR], inputs, times)


def _run(folder, build, run, inputs, times):
    """Compile, then run a program on inputs with times behind them; return its outputs."""
    np.column_stack([inputs, times]).tofile(folder / "in.bin")
    (folder / "out.bin").unlink(missing_ok=True)
    subprocess.run(build, cwd=folder, check=True, capture_output=True, text=True)
    subprocess.run(run, cwd=folder, check=True, stdin=subprocess.DEVNULL, timeout=300)
    return np.fromfile(folder / "out.bin").reshape(len(times), -1)


def shared(folder, equations):
    """Compile equations to a library that can be called."""
    for file, text in c_files(equations).items():
        (folder / file).write_text(text)
    command = [needed_program(("gcc", "clang")), *STRICT, "-O2", "-shared", "-fPIC",
               f"{equations.name}.c", "-lm", "-o", "library.so"]  # fmt: skip
    subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    return ctypes.CDLL(str(folder / "library.so"))


def evaluated(folder, equations, points):
    """Return rates and outputs at some points (t, x, u)."""
    library, name, low = shared(folder, equations), equations.name, equations.lowered
    parameters = np.array([*equations.parameters.values()])
    c, dx, y = np.zeros(low.size), np.zeros(low.rows["x"]), np.zeros(low.rows["y"] + 1)
    g, m = np.zeros(low.rows["g"] + 1), np.zeros(low.rows["m"] + 1)

    def pointer(array):
        return ctypes.c_void_p(array.ctypes.data)

    library[f"{name}_prepare"](pointer(parameters), pointer(c))
    found = []
    for t, x, u in points:
        now = ctypes.c_double(t)
        library[f"{name}_rates"](now, *map(pointer, (x, u, c, dx, g, m)))
        library[f"{name}_outputs"](now, *map(pointer, (x, u, c, y)))
        found.append((dx.copy(), y[: len(equations.outputs)].copy()))
    return found
