"""Measurements as tables."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from competitors.problem import Problem
from measure import Row
from rich.table import Table

PACKAGES = ("nlctl", "control", "numpy", "scipy", "numba", "heyoka", "numbalsoda", "diffrax", "jax")


def machine() -> str:
    """Return the processor and the versions in one line."""
    processor = platform.processor() or platform.machine()
    described = Path("/proc/cpuinfo")
    if described.exists():
        lines = described.read_text().splitlines()
        named = (line.split(":")[1].strip() for line in lines if line.startswith("model name"))
        processor = next(named, processor)
    versions = [f"Python {platform.python_version()}", *filter(None, map(_version, PACKAGES))]
    compiler = shutil.which("c++") or shutil.which("g++")
    if compiler:
        first = subprocess.run([compiler, "--version"], capture_output=True, text=True).stdout
        versions.append(first.splitlines()[0])
    return f"{processor}, {os.cpu_count()} cores; {', '.join(versions)}"


def _version(package: str) -> str | None:
    try:
        return f"{package} {importlib.metadata.version(package)}"
    except importlib.metadata.PackageNotFoundError:
        return None


def comparison(problem: Problem, title: str, rows: Sequence[Row]) -> Table:
    """Return one table of competitors, the slowest first, and before them who missed the target.

    Ratios are to one core of python-control and of the tuned C++; who missed has none.
    """
    ensemble = any(row.members > 1 for row in rows)
    table = Table(title=title, title_justify="left")
    sizes = ("members", "threads") if ensemble else ()
    errors = ("error x", *(() if ensemble else ("all states",)), "actuator")
    truth = ("x to exact play",) if problem.example == 2 else ()
    table.add_column("", no_wrap=True)
    for heading in (*sizes, "rtol", "ms", "x python-control", "of tuned C++", *errors, *truth):
        table.add_column(heading, justify="right")
    slow, fast = _seconds(rows, "python-control"), _seconds(rows, "C++ tuned")
    for row in sorted(
        rows, key=lambda row: (row.threads, _reached(row, problem.target), -row.seconds)
    ):
        reached, counts = row.accuracy, _reached(row, problem.target)
        table.add_row(
            row.name,
            *((str(row.members), str(row.threads)) if ensemble else ()),
            f"{row.rtol:.0e}",
            f"{1e3 * row.seconds:.3g}",
            f"{slow / row.seconds:.0f}" if slow and counts else "",
            f"{row.seconds / fast:.2g}" if fast and counts else "",
            f"{reached.plant:.0e}{'' if counts else ' missed'}",
            *(() if ensemble else (f"{reached.states:.0e}",)),
            reached.model if counts else "",
            *((f"{reached.truth:.0e}",) if truth else ()),
            style="bold" if row.name == "nlctl" else None,
        )
    return table


def _reached(row: Row, target: float) -> bool:
    """Whether a row is as accurate as asked for; members differ, which the factor allows for."""
    return row.accuracy.plant <= 2 * target  # false for NaN


def _seconds(rows: Sequence[Row], start: str) -> float | None:
    """Time of the first row, on one core, whose name begins so."""
    times = [row.seconds for row in rows if row.name.startswith(start) and row.threads == 1]
    return times[0] if times else None
