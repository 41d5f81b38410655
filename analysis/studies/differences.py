"""What differs between two runs: what they were computed from, what they found, their tables."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.wording import counted

from ..robustness.runs.store import differences_of
from .folder import checked, load_result, load_run
from .origin import loop_differences, version_differences
from .result import LISTED, Result
from .sealed import read_json

_CLOCK = "wall_time"  # differs between any two runs


@as_annotated
def origin_differences(first: Path, second: Path) -> str:
    """Return in words what two runs were computed from that differs; nothing if nothing does.

    Parameters
    ----------
    first, second : pathlib.Path
        Run folders.

    Returns
    -------
    str
        Sentences, or nothing.

    Raises
    ------
    RunFolderError
        If a folder holds no run.

    Examples
    --------
    See `run_differences`.
    """
    for folder in (first, second):
        checked(folder)
    one, other = (load_run(folder)["origin"] for folder in (first, second))
    parts = [loop_differences(one, other), version_differences(one, other)]
    return "; ".join(filter(None, parts))


@as_annotated
def run_differences(first: Path, second: Path) -> list[str]:
    """Return what differs between what two runs have found, one text for each number.

    Parameters
    ----------
    first, second : pathlib.Path
        Run folders.

    Returns
    -------
    list of str
        Empty if nothing differs.

    Raises
    ------
    RunFolderError
        If a folder holds no results, or what does not belong together.

    Examples
    --------
    What two runs have found that differs, and why it may:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.studies import origin_differences, read_study, run
    >>> from nlctl.analysis.studies import run_differences, shipped
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     one, other = Path(folder, "one"), Path(folder, "other")
    ...     _ = run(read_study(shipped("lag")), one)
    ...     _ = run(read_study(shipped("lag"), ["inputs.u=0.8"]), other)
    ...     found, reason = run_differences(one, other), origin_differences(one, other)
    >>> reason
    '[inputs] of the study'
    >>> print(found[1])
    holds was True, now False
    """
    contents, one, other = [], load_result(first), load_result(second)
    for folder in (first, second):
        content = read_json(folder / "results.json")
        del content["origin"]
        for name, key in (("findings", "key"), ("quantities", "name"), ("requirements", "key")):
            content[name] = {part.pop(key): part for part in content[name]}
        contents.append(content)
    return [*differences_of(*contents), *_table_differences(one, other)]


def long_table_differences(first: Path, second: Path, rtol: float = 0.0) -> list[str]:
    """Return what differs between tables of two runs that are too long for their pages."""
    one, other = (load_result(folder) for folder in (first, second))
    return _table_differences(one, other, rtol, longer_than=LISTED)


def _table_differences(
    first: Result, second: Result, rtol: float = 0.0, longer_than: int = -1
) -> list[str]:
    """Return what differs between the tables of two results, one text for each table or column."""
    # Of tables of findings only those count that have more lines than `longer_than`.
    differences: list[str] = []
    if (first.rows is None) != (second.rows is None):
        differences.append(f"the main table is {'new' if first.rows is None else 'gone'}")
    elif first.rows is not None and second.rows is not None:
        differences += _differences("rows", first.rows.table, second.rows.table, rtol)
    others = {finding.key: finding for finding in second.findings}
    for finding in first.findings:
        if finding.key not in others:
            continue  # reported with the findings
        old, new = finding.tables, others[finding.key].tables
        for name in dict.fromkeys([*old, *new]):
            place = f"{finding.key}.{name}"
            if max(len(t[name]) for t in (old, new) if name in t) <= longer_than:
                continue
            if name in old and name in new:
                differences += _differences(place, old[name], new[name], rtol)
            else:
                differences.append(f"the table {place} is {'new' if name in new else 'gone'}")
    return differences


def _differences(place: str, old: pd.DataFrame, new: pd.DataFrame, rtol: float) -> Iterator[str]:
    """Yield what differs between two tables, one text for each column."""
    if len(old) != len(new):
        yield f"the table {place} had {counted(len(old), 'row')}, now {len(new)}"
        return
    one, other = ({str(c): t[c] for c in t} for t in (old.reset_index(), new.reset_index()))
    for name in dict.fromkeys([*one, *other]):
        if name == _CLOCK:
            continue
        if name not in one or name not in other:
            change = "new" if name in other else "gone"
            yield f"the column '{name}' of the table {place} is {change}"
            continue
        a, b = one[name].to_numpy(), other[name].to_numpy()
        changed = np.flatnonzero(~_same(a, b, rtol))
        if changed.size:
            line = int(changed[0])
            yield (
                f"{counted(changed.size, 'value')} of '{name}' in the table {place}, the first in "
                f"line {line}: was {a[line]}, now {b[line]}"
            )


def _same(one: np.ndarray, other: np.ndarray, rtol: float) -> np.ndarray:
    """Return which values are equal, numbers up to `rtol` of the larger; NaN equals NaN."""
    return np.array(
        [
            a == b or (a != a and b != b) or (rtol > 0 and _is_close(a, b, rtol))
            for a, b in zip(one.tolist(), other.tolist(), strict=True)
        ],
        dtype=bool,
    )


def _is_close(a: Any, b: Any, rtol: float) -> bool:
    numbers = isinstance(a, int | float) and isinstance(b, int | float)
    return numbers and math.isclose(a, b, rel_tol=rtol)
