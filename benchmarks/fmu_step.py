"""How long a step of Co-Simulation takes: FMUs of both examples, 2000 steps of 10 ms each.

The function of the library is called through ctypes, which takes a part of a microsecond itself.
The median is printed, and the shortest; the first steps, in which the loops are fast, take longer.
Needs the extra "export".
"""

from __future__ import annotations

import ctypes
import tempfile
import time
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi3 import FMU3Slave

from nlctl import paper
from nlctl.export import fmu

STEP, COUNT = 0.01, 2000


def step_times(path: Path, tolerance: float) -> np.ndarray:
    """Return how long each step took (s)."""
    said = fmpy.read_model_description(str(path))
    model = FMU3Slave(
        guid=said.guid, unzipDirectory=fmpy.extract(str(path)), instanceName="one",
        modelIdentifier="m",
    )  # fmt: skip
    model.instantiate()
    model.enterInitializationMode(startTime=0.0, tolerance=tolerance)
    model.exitInitializationMode()
    do_step, pointer = model.dll.fmi3DoStep, ctypes.c_void_p
    do_step.argtypes = [pointer, ctypes.c_double, ctypes.c_double, ctypes.c_bool, *[pointer] * 4]
    answers = (ctypes.c_bool * 3)(), ctypes.c_double()
    first = ctypes.addressof(answers[0])
    places = (first, first + 1, first + 2, ctypes.addressof(answers[1]))
    taken = np.zeros(COUNT)
    for k in range(COUNT):
        begin = time.perf_counter()
        if do_step(model.component, k * STEP, STEP, True, *places):
            raise RuntimeError(f"step {k} failed")
        taken[k] = time.perf_counter() - begin
    return taken


def main() -> None:
    """Print the times."""
    print("example    tolerance  median (us)  shortest (us)")
    with tempfile.TemporaryDirectory() as folder:
        for name, make in paper.EXAMPLES.items():
            path = fmu(make(), Path(folder) / "m.fmu", name="m", stop_time=20.0, platforms="linux")
            for tolerance in (1e-4, 1e-6, 1e-8):
                taken = 1e6 * step_times(path, tolerance)
                print(f"{name}  {tolerance:g}  {np.median(taken):11.1f}  {taken.min():13.1f}")


if __name__ == "__main__":
    main()
