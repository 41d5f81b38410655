"""C++ programs, built as shared libraries with one set of entry points."""

from __future__ import annotations

import ctypes
import hashlib
import shutil
import subprocess
from pathlib import Path

import numpy as np

from .problem import Problem, Solver, UnavailableError
from .threads import in_threads

CPP = Path(__file__).parent.parent / "cpp"
BUILD = Path(__file__).parent.parent / "build"  # ignored by git
VECTOR = np.ctypeslib.ndpointer(np.float64, flags="C")
INT, REAL = ctypes.c_int, ctypes.c_double


def built(source: str, flags: tuple[str, ...]) -> ctypes.CDLL:
    """Compile ``cpp/<source>.cpp``, unless this source was compiled before, and load it.

    Raises
    ------
    UnavailableError
        If there is no compiler, or it refuses.
    """
    compiler = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        raise UnavailableError("no C++ compiler was found (c++, g++, clang++)")
    command = [compiler, "-std=c++17", "-shared", "-fPIC", *flags, f"{CPP / source}.cpp"]
    texts = [path.read_bytes() for path in sorted(CPP.iterdir())]
    key = hashlib.sha256(b"".join([*texts, " ".join(command).encode()])).hexdigest()[:16]
    library = BUILD / f"{source}-{key}.so"
    if not library.exists():
        BUILD.mkdir(exist_ok=True)
        done = subprocess.run([*command, "-o", library], capture_output=True, text=True)
        if done.returncode:
            reason = next((s for s in done.stderr.splitlines() if "error" in s), "no reason given")
            raise UnavailableError(f"{compiler} refuses {source}.cpp: {reason}")
    loaded = ctypes.CDLL(str(library))
    loaded.right_hand_side.argtypes = [INT, REAL, VECTOR, VECTOR, VECTOR]
    loaded.right_hand_side.restype = None
    loaded.run.argtypes = [INT, INT, VECTOR, VECTOR, VECTOR, INT, REAL, VECTOR]
    loaded.ensemble.argtypes = [*[INT, INT, VECTOR, VECTOR, VECTOR, INT, VECTOR, INT, REAL, VECTOR]]
    return loaded


def solver(problem: Problem, library: ctypes.CDLL, name: str, variant: int, **options) -> Solver:
    """Return a solver that calls a library; `variant` is the method, or the number of lanes."""
    centres = np.ascontiguousarray(problem.centres.T)
    example, x0 = problem.example, problem.x0

    def rhs(t, x):
        dx = np.empty(x.size)
        library.right_hand_side(example, t, x, centres, dx)
        return dx

    def run(rtol):
        states, times = np.empty((problem.states(), problem.times.size)), problem.times
        library.run(example, variant, centres, x0, times, times.size, rtol, states)
        return states

    def ensemble(rtol, x1, threads):
        times = problem.coarse
        x = np.empty((x1.size, problem.order, times.size))

        def part(s):
            some = x1[s]
            sizes = (some, some.size, times, times.size)
            library.ensemble(example, variant, centres, x0, *sizes, rtol, x[s])

        in_threads(part, x1.size, threads)
        return x

    return Solver(name=name, rhs=rhs, run=run, ensemble=ensemble, **options)
