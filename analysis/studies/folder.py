"""The folder of a run.

study.toml           the study as it was run, with the settings of the command line
run.json             where the files that it refers to are
rows/                the main table, see `analysis.robustness.store`
KEY/finding.json     what one analysis found, its tables beside it in Parquet
KEY/rows/            the rows that it ran itself, where their number is known in advance
results.json         everything but the tables, for other programs
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd

from analysis.robustness import Space
from analysis.robustness.identity import differences_of
from analysis.robustness.sweep import load
from nlctl._files import replace_file

from .build import labels, main_design
from .parts import uncertain
from .plain import RunFolderError, read_json, write_json
from .result import Finding, Result
from .schema import Study
from .written import from_toml

__all__ = [
    "METRIC_COLUMNS",
    "load_finding",
    "load_result",
    "run_differences",
    "save_finding",
]

METRIC_COLUMNS = ("key", "signal", "unit", "meaning")


def save_finding(folder: Path, finding: Finding) -> None:
    """Write a finding into ``folder / key``, its tables first: with the file it is whole."""
    here = folder / finding.key
    here.mkdir(parents=True, exist_ok=True)
    for name, table in finding.tables.items():
        replace_file(here / f"{name}.parquet", lambda file, table=table: table.to_parquet(file))
    write_json(here / "finding.json", finding.plain())


def load_finding(folder: Path, key: str) -> Finding | None:
    """Return the finding in ``folder / key``; None if that analysis is not done.

    Raises
    ------
    RunFolderError
        If its files are damaged.
    """
    path = folder / key / "finding.json"
    if not path.exists():
        return None
    content = read_json(path)
    try:
        names = content.pop("tables")
        tables = {name: pd.read_parquet(path.with_name(f"{name}.parquet")) for name in names}
        return Finding(**content, tables=tables)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunFolderError(
            f"'{path.parent}' is damaged ({error}): delete it and continue with --resume"
        ) from error


def load_result(folder: Path) -> Result:
    """Return what is in the folder of a run, finished or not.

    Raises
    ------
    RunFolderError
        If it holds no results, or files are damaged.
    """
    content = read_json(folder / "results.json")
    try:
        study = from_toml((folder / "study.toml").read_text(encoding="utf-8"))
        quantities = pd.DataFrame(content["quantities"]).set_index("name")
        requirements = pd.DataFrame(content["requirements"]).set_index("key")
        metrics = pd.DataFrame(content["metrics"], columns=METRIC_COLUMNS).set_index("key")
        keys = [finding["key"] for finding in content["findings"]]
    except (OSError, ValueError, KeyError) as error:
        raise RunFolderError(f"'{folder}' holds no results of a study: {error}") from error
    findings = [load_finding(folder, key) for key in keys]
    rows = None
    if study.runs is not None and (folder / "rows" / "study.json").exists():
        design = main_design(study.runs, _space(study, quantities), study.study.seed)
        rows = load(folder / "rows", design)
    return Result(
        folder=folder,
        study=study,
        quantities=quantities,
        requirements=requirements,
        metrics=metrics,
        rows=rows,
        findings=tuple(finding for finding in findings if finding is not None),
        complete=content["complete"],
        notes=tuple(content["notes"]),
    )


def _space(study: Study, quantities: pd.DataFrame) -> Space:
    """Return the space of a study with the names, nominal values and units of its run.

    The options of choices are not made: their labels are enough for the rows.
    """
    full = quantities.to_dict("index")
    names = zip(quantities.index, study.space.items(), strict=False)
    return Space(
        quantities=tuple(
            replace(
                uncertain(own, law),
                name=name,
                nominal=full[name]["nominal"],
                unit=full[name]["unit"],
            )
            for name, (own, law) in names
        ),
        choices=tuple(labels(name, choices) for name, choices in study.choices.items()),
    )


def run_differences(first: Path, second: Path) -> list[str]:
    """Return what differs between what two runs have found, one text for each number.

    Raises
    ------
    RunFolderError
        If a folder holds no results.
    """
    found = []
    for folder in (first, second):
        content = read_json(folder / "results.json")
        for name, key in (("findings", "key"), ("quantities", "name"), ("requirements", "key")):
            content[name] = {part.pop(key): part for part in content[name]}
        found.append(content)
    return differences_of(*found)
