"""What differs between two reports: verdict, claims, numbers, tables."""

import json
import math
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nlctl.annotations import as_annotated
from nlctl.arguments import number
from nlctl.errors import UsageError

from .outline import sort_key
from .page import PARTS

ABSENT = "absent"
FOLDER = re.compile(r"\b(nlctl (?:replay|report|run)) (?:'[^']*'|\"[^\"]*\"|[^\s'\"])+")


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One thing that two reports say differently; ``"absent"`` where only one says it."""

    where: str
    first: Any
    second: object

    def __str__(self) -> str:
        return f"{self.where}: {self.first} -> {self.second}"


@as_annotated
def compare_contents(
    first: str | os.PathLike[str],
    second: str | os.PathLike[str],
    rtol: float = 0.0,
    *,
    common: bool = False,
) -> list[Difference]:
    """Compare what two reports claim, measure and list.

    Provenance, command, prose, hashes of files, and the folders in commands are left out: they
    may differ between two machines that find the same.

    Parameters
    ----------
    first, second : path
        Files ``report.json``, or the folders that hold them.
    rtol : float, optional
        Numbers closer than this, relative to the larger, count as equal.
    common : bool, optional
        Whether only sections count that both have, as of two runs of which one page was made of
        its data alone.

    Returns
    -------
    list of Difference
        Empty if the reports agree.

    Raises
    ------
    OSError
        If a file cannot be read.
    UsageError
        If a file is not a report, or `rtol` is negative.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.report import Report, compare_contents, write_report
    >>> def arm(e):
    ...     return Report(
    ...         title="Arm", verdict="", claims=[], sections=[], command="", numbers={"e": e}
    ...     )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     one, other = Path(folder, "one"), Path(folder, "other")
    ...     _ = write_report(arm(0.14), one), write_report(arm(0.15), other)
    ...     print(*compare_contents(one, other))
    ...     print(compare_contents(one, other, rtol=0.1))
    numbers.e: 0.14 -> 0.15
    []
    """
    number("compare", "rtol", rtol, at_least=0)
    return differing_numbers(read_report(first), read_report(second), rtol, common=common)


def differing_numbers(
    first: Mapping[str, Any], second: Mapping[str, Any], rtol: float = 0.0, *, common: bool = False
) -> list[Difference]:
    """Compare two reports as `compare_contents` does, given what is in their files."""
    number("compare", "rtol", rtol, at_least=0)
    both = set(first["sections"]) & set(second["sections"])
    one, two = (_flat(r, both if common else set(r["sections"])) for r in (first, second))
    return [
        Difference(where=where, first=one.get(where, ABSENT), second=two.get(where, ABSENT))
        for where in dict.fromkeys([*one, *two])
        if where not in one or where not in two or not _same(one[where], two[where], rtol)
    ]


def read_report(path: str | os.PathLike[str]) -> Mapping[str, Any]:
    """Return the content of a ``report.json``, given as file or as its folder."""
    path = Path(path)
    path = path / "report.json" if path.is_dir() else path
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UsageError(f"'{path}' is not a report: {error}") from None
    missing = [part for part in PARTS if not isinstance(content, dict) or part not in content]
    if missing:
        raise UsageError(f"'{path}' is not a report: it has no '{missing[0]}'")
    return content


def _flat(report: Mapping[str, Any], sections: set[str]) -> dict[str, Any]:
    """Return all that is compared, by the name of the place where it stands."""
    values = {"title": report["title"], "verdict": report["verdict"]}
    claims = report["claims"]
    for name, claim in zip(_names([c["text"] for c in claims]), claims, strict=True):
        values |= {f"claim '{name}', {k}": v for k, v in claim.items() if k != "text"}
    values |= placed_values("numbers", report["numbers"])
    for key, section in report["sections"].items():
        if key not in sections:
            continue
        tables = [item for item in section["items"] if item["kind"] == "table"]
        for place, table in enumerate(tables, 1):
            values |= _cells(f"section '{key}', table {place}", table)
    return values


def placed_values(where: str, value: object) -> dict[str, Any]:
    """Return what nested records hold, by its place; in a list by its key where it has one."""
    if isinstance(value, Mapping):
        parts = [(f"{where}.{name}", part) for name, part in value.items()]
    elif isinstance(value, list):
        keys = (x.get("key", i) if isinstance(x, Mapping) else i for i, x in enumerate(value))
        parts = [(f"{where}[{key}]", part) for key, part in zip(keys, value, strict=True)]
    else:
        return {where: value}
    return {place: leaf for at, part in parts for place, leaf in placed_values(at, part).items()}


def _placeless(value: object) -> Any:
    """Return a cell without the folder that a command in it names: where a run is kept."""
    return FOLDER.sub(r"\1 RUN", value) if isinstance(value, str) else value


def _cells(where: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the cells of a table by row and column; rows are named by their first cells."""
    cells = {f"{where}, columns": list(table["columns"])}
    columns = _names(table["columns"])
    rows = [[_placeless(value) for value in row] for row in table["rows"]]
    for name, row in zip(_row_names(rows), rows, strict=True):
        for place, value in enumerate(row):
            column = columns[place] if place < len(columns) else str(place + 1)
            cells[f"{where}, row '{name}', column '{column}'"] = value
    return cells


def _row_names(rows: Sequence[Sequence[Any]]) -> list[str]:
    """Return a name for each row: as few of its first cells as make names unique."""
    for width in (1, 2, 3):
        names = [" | ".join(map(str, row[:width])) for row in rows]
        if len(set(names)) == len(names):
            return names
    return _names([str(row[0]) if row else "" for row in rows])


def _names(texts: Sequence[str]) -> list[str]:
    """Return the texts, with a number behind those that come again."""
    seen: Counter[str] = Counter()
    names = []
    for text in texts:
        seen[text] += 1
        names.append(text if seen[text] == 1 else f"{text} ({seen[text]})")
    return names


def _same(a: object, b: object, rtol: float) -> bool:
    """Whether two values say the same; numbers in text count as numbers."""
    if a == b and type(a) is type(b):
        return True
    if rtol and (x := sort_key(a)) and (y := sort_key(b)):
        return math.isclose(float(x), float(y), rel_tol=rtol)
    return not isinstance(a, bool | str) and not isinstance(b, bool | str) and a == b
