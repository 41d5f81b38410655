"""What a study will take, before it runs: rows, time, disk."""

import time
from dataclasses import replace

import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record

from ..robustness import Prepared, evaluate, independent, prepare
from ..robustness.runs.experiment import columns_of
from .build import main_design
from .file.schema import keyed
from .reading.parse import StudyFile

_TIMED = 32
"""Rows that are run to see how long one takes."""
_NUMBER = 8
"""Bytes of one number on disk; compression makes it less."""


@described_record(made_by="plan")
class Plan:
    """What a study will take."""

    runs: dict[str, int]  # Number of simulations by analysis, ``"rows"`` for the main table.
    at_most: tuple[str, ...]  # Those that may end earlier.
    # Time of all of them on this machine, from the time of a few rows of the study's laws.
    seconds: float
    size: float  # Bytes on disk.

    @property
    def total(self) -> int:
        """Number of simulations."""
        return sum(self.runs.values())


@as_annotated
def plan(file: StudyFile, threads: int | None = None) -> Plan:
    """Count the runs of a study, and time a few of them.

    Parameters
    ----------
    file : StudyFile
        As `read_study` returns it.
    threads : int, optional
        On which it would run; all cores by default.

    Raises
    ------
    UsageError
        As in `nlctl.analysis.robustness.prepare`.

    Examples
    --------
    >>> from nlctl.analysis.studies import plan, read_study, shipped
    >>> asked = "analysis=[{ kind = 'probability' }, { kind = 'worst case', runs = 40 }]"
    >>> expected = plan(read_study(shipped("lag"), [asked]))
    >>> expected.runs, expected.total
    ({'rows': 20, 'worst-case': 40}, 60)
    >>> expected.at_most, expected.seconds < 60
    (('worst-case',), True)
    """
    prepared = prepare(file.experiment)
    study, space = file.study, prepared.experiment.space
    runs, kept = {}, 0
    if study.runs is not None:
        runs["rows"] = main_design(study.runs, space, study.study.seed).size
        kept += runs["rows"]
    setup = replace(file, experiment=prepared.experiment)
    for key, asked in keyed(study).items():
        count = asked.definition.planned(asked, setup)
        if count:
            runs[key] = count
            kept += count if asked.definition.keeps_rows else 0
    at_most = [key for key, asked in keyed(study).items() if asked.definition.ends_early]
    width = len(columns_of(prepared))
    return Plan(
        runs=runs,
        at_most=tuple(at_most),
        seconds=sum(runs.values()) * _seconds(prepared, study.study.seed, threads),
        size=float(_NUMBER * width * kept),
    )


def _seconds(prepared: Prepared, seed: int, threads: int | None) -> float:
    """Return the time of one row when many are run."""
    table: pd.DataFrame = independent(prepared.experiment.space, _TIMED, seed).table
    evaluate(prepared, table.iloc[:1], threads=threads)  # compiled once
    start = time.perf_counter()
    evaluate(prepared, table, threads=threads)
    return (time.perf_counter() - start) / _TIMED
