"""Hashes of the numbers of machine code: the same bits before and after a change of the engine.

Run it in both checkouts and compare what it prints::

    python benchmarks/run_hashes.py > before.txt
    python benchmarks/run_hashes.py > after.txt
    diff before.txt after.txt

A line has the name of a run and a hash of its times, states and outputs.  The runs are those of the
gallery's scripts and the paper's loops with each actuator, method and tolerance.  Where conditions
of an equation are located that were stepped over before, numbers may change: such a line ends with
the number of conditions that the diagram has beyond those that its blocks declare.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import itertools
import runpy
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import actuators, paper

GALLERY = Path(__file__).resolve().parents[1] / "docs" / "gallery"
METHODS = ("tsit5", "rodas5p", "auto")
TOLERANCES = (1e-6, 1e-8)
TIMES = np.linspace(0.0, 2.0, 201)


def hashed(response: Any) -> str:
    """Return a hash of the numbers of a response or an ensemble."""
    digest = hashlib.sha256()
    for name in ("time", "states", "outputs", "final_state"):
        value = getattr(response, name, None)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            digest.update(np.ascontiguousarray(value).tobytes())
    return digest.hexdigest()[:16]


def conditions(system: Any) -> int:
    """Return how many conditions a diagram has that no block declares; 0 where none are read."""
    with contextlib.suppress(Exception):
        compiled = system if isinstance(system, nlctl.native.Compiled) else nlctl.compile(system)
        read = compiled.lowered.rows["g"] - compiled.program.events
        hidden = compiled.equations.conditions if hasattr(compiled, "equations") else None
        return read + (len(hidden.of_time) if hidden else 0)
    return 0


def noted(function: Callable[..., Any], lines: list[str], name: str) -> Callable[..., Any]:
    """Return a function that notes a line for each result of another one."""

    def called(system: Any, *args: Any, **kwargs: Any) -> Any:
        result = function(system, *args, **kwargs)
        beyond = conditions(system)
        lines.append(f"{name} {len(lines)} {hashed(result)}" + f" {beyond}" * (beyond > 0))
        return result

    return called


def gallery() -> Iterator[str]:
    """Yield lines for the runs of the gallery's scripts."""
    for script in sorted(GALLERY.rglob("*.py")):
        lines: list[str] = []
        right = {k: getattr(nlctl, k) for k in ("input_output_response", "ensemble_response")}
        for name, function in right.items():
            setattr(nlctl, name, noted(function, lines, script.stem))
        try:
            with contextlib.chdir(script.parent), contextlib.redirect_stdout(io.StringIO()):
                runpy.run_path(str(script))
        except Exception as error:
            lines.append(f"{script.stem} {type(error).__name__}: {error}".splitlines()[0])
        finally:
            for name, function in right.items():
                setattr(nlctl, name, function)
            plt.close("all")
        yield from lines


def loops() -> Iterator[str]:
    """Yield lines for the paper's loops with each actuator, method and tolerance."""
    kinds = [name for name in dir(actuators) if name[0].isupper()]
    for example, kind in itertools.product(("example_1", "example_2"), kinds):
        try:
            loop = getattr(paper, example)(actuator=getattr(actuators, kind)())
            compiled = nlctl.compile(loop)
        except Exception:  # of those that need more than their defaults
            continue
        for method, rtol in itertools.product(METHODS, TOLERANCES):
            name = f"{example} {kind} {method} {rtol:g}"
            try:
                options = {"method": method, "rtol": rtol, "max_steps": 20_000}
                run = nlctl.input_output_response(compiled, TIMES, engine="native", **options)
                yield f"{name} {hashed(run)}"
            except Exception as error:
                yield f"{name} {type(error).__name__}"


def main() -> int:
    """Print all lines."""
    warnings.simplefilter("ignore")
    for line in itertools.chain(loops(), gallery()):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
