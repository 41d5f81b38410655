"""What a study will take, before it runs: rows, time, disk."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import pandas as pd

from analysis.robustness import Prepared, evaluate, independent, prepare
from analysis.robustness.runs.experiment import columns_of

from .build import main_design, own_design
from .file.parse import StudyFile
from .file.schema import keyed
from .kinds.analyses import Compare, Degradation, Map, Morris, Radius, Sobol, WorstCase
from .kinds.comparison import alternatives

__all__ = ["Plan", "plan"]

TIMED = 32
"""Rows that are run to see how long one takes."""
NUMBER = 8
"""Bytes of one number on disk; compression makes it less."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a study will take.

    Attributes
    ----------
    runs : dict
        Number of simulations by analysis, ``"rows"`` for the main table.
    at_most : tuple of str
        Those that may end earlier.
    seconds : float
        Time of all of them on this machine, from the time of a few rows of the study's laws.
    size : float
        Bytes on disk.
    """

    runs: dict[str, int]
    at_most: tuple[str, ...]
    seconds: float
    size: float

    @property
    def total(self) -> int:
        """Number of simulations."""
        return sum(self.runs.values())


def plan(file: StudyFile, threads: int | None = None) -> Plan:
    """Count the runs of a study, and time a few of them.

    Raises
    ------
    UsageError
        As in `analysis.robustness.prepare`.
    """
    prepared = prepare(file.experiment)
    study, space = file.study, prepared.experiment.space
    runs, kept = {}, 0
    if study.runs is not None:
        runs["rows"] = main_design(study.runs, space, study.study.seed).size
        kept += runs["rows"]
    for key, asked in keyed(study).items():
        count = _runs(asked, file, prepared)
        if count:
            runs[key] = count
            kept += 0 if isinstance(asked, Degradation | Radius | Map) else count
    at_most = [k for k, a in keyed(study).items() if isinstance(a, WorstCase | Radius | Map)]
    width = len(columns_of(prepared))
    return Plan(
        runs=runs,
        at_most=tuple(at_most),
        seconds=sum(runs.values()) * _seconds(prepared, study.study.seed, threads),
        size=float(NUMBER * width * kept),
    )


def _runs(asked: Any, file: StudyFile, prepared: Prepared) -> int:
    """Return how many simulations an analysis makes itself, at most."""
    if isinstance(asked, Morris | Sobol):
        design = own_design(asked, prepared.experiment.space, 0)
        return 0 if design is None else design.size
    if isinstance(asked, Degradation):
        return len(asked.factors) * asked.runs
    if isinstance(asked, Compare):
        options = alternatives(asked, file.experiment.build, file.folder)
        return asked.runs * len(options.options)
    if isinstance(asked, Radius):
        return SIZES * asked.runs + asked.draws
    return asked.runs if isinstance(asked, WorstCase | Map) else 0


SIZES = 12
"""Sizes that the search for a radius looks at, roughly."""


def _seconds(prepared: Prepared, seed: int, threads: int | None) -> float:
    """Return the time of one row when many are run."""
    table: pd.DataFrame = independent(prepared.experiment.space, TIMED, seed).table
    evaluate(prepared, table.iloc[:1], threads=threads)  # compiled once
    start = time.perf_counter()
    evaluate(prepared, table, threads=threads)
    return (time.perf_counter() - start) / TIMED
