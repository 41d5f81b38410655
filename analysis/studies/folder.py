"""The folder of a run.

study.toml           the study as it was run, with the settings of the command line
run.json             where the files that it refers to are, and what all is computed from: `origin`
rows/                the main table, see `analysis.robustness.runs.store`
KEY/finding.json     what one analysis found, its tables beside it in Parquet
KEY/rows/            the rows that it ran itself, where their number is known in advance
results.json         everything but the tables, for other programs

Every file but study.toml carries a key of its content, and every part the key of its origin: what
was edited or belongs to another loop is refused, not shown.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.robustness import Design, Space
from analysis.robustness.runs.identity import differences_of
from analysis.robustness.runs.store import opened
from analysis.robustness.runs.sweep import Sweep, load
from nlctl.host.files import replace_file

from .build import labels, main_design
from .file.own_kinds import own_kinds, stand_ins
from .file.resolve import uncertain
from .file.schema import Study, keyed
from .file.toml import read_toml
from .file.written import from_toml
from .finding import Finding
from .kind import Kind
from .origin import loop_differences, plain_study, version_differences
from .result import Result
from .sealed import ANEW, RunFolderError, file_digest, origin_key, read_json, write_json

__all__ = [
    "METRIC_COLUMNS",
    "load_finding",
    "load_result",
    "load_rows",
    "load_run",
    "load_study",
    "origin_differences",
    "remove_run",
    "run_differences",
    "save_finding",
]

_OWN = ("study.toml", "run.json", "results.json", "rows", ".lock", ".owner")
_OWN += ("index.html", "report.json", "report.pdf")
METRIC_COLUMNS = ("key", "signal", "unit", "meaning")


def save_finding(folder: Path, finding: Finding, origin: str) -> None:
    """Write a finding into ``folder / key``, its tables first: with the file it is whole.

    `origin` is the key of what it was computed from.
    """
    here = folder / finding.key
    here.mkdir(parents=True, exist_ok=True)
    keys = {}
    for name, table in finding.tables.items():
        path = here / f"{name}.parquet"
        replace_file(path, lambda file, table=table: table.to_parquet(file))
        keys[name] = file_digest(path)
    write_json(here / "finding.json", finding.plain() | {"tables": keys, "origin": origin})


def load_finding(folder: Path, key: str, origin: str) -> Finding | None:
    """Return the finding in ``folder / key``; None if that analysis is not done.

    Raises
    ------
    RunFolderError
        If its files are damaged or edited, or it was computed from something else than `origin`.
    """
    path = folder / key / "finding.json"
    if not path.exists():
        return None
    remedy = f"delete '{path}' and continue with --resume"
    content = read_json(path, remedy)
    if content.pop("origin", None) != origin:
        raise RunFolderError(
            f"'{path.parent}' was computed from another loop than the rest of the run: {remedy}"
        )
    tables = {}
    for name, kept in content.pop("tables").items():
        file = path.with_name(f"{name}.parquet")
        try:
            if file_digest(file) != kept:
                raise RunFolderError(f"'{file}' is not as it was written: {remedy}")
            tables[name] = pd.read_parquet(file)
        except (OSError, ValueError) as error:
            if isinstance(error, RunFolderError):
                raise
            raise RunFolderError(f"'{file}' cannot be read: {remedy}") from error
    return Finding(**content, tables=tables)


def load_run(folder: Path) -> dict[str, Any]:
    """Return what ``run.json`` holds.

    Raises
    ------
    RunFolderError
        If the folder holds no run, or the file is damaged.
    """
    return read_json(folder / "run.json")


def remove_run(folder: Path, *, force: bool = False) -> None:
    """Remove the folder of a run, with its page.

    Raises
    ------
    RunFolderError
        If it holds something else, and `force` is False.
    """
    if not force:
        known = {*_OWN, *keyed(load_study(folder))} if (folder / "study.toml").exists() else set()
        others = sorted(p.name for p in folder.iterdir() if p.name not in known)
        if others:
            raise RunFolderError(
                f"'{folder}' would be replaced, and holds what no run has made ({others[0]}): take "
                "another folder with --out, or replace it with --force"
            )
    shutil.rmtree(folder)


def load_study(folder: Path, own: Mapping[str, Kind] | None = None) -> Study:
    """Return the study of a run, as it was begun.

    Parameters
    ----------
    folder : Path
    own : mapping of str to Kind, optional
        Kinds of analysis of one's own, as the study calls them; any others that it has take the
        tables as they stand, and cannot be run.

    Raises
    ------
    RunFolderError
        If its file is missing, damaged, or edited since.
    """
    path = folder / "study.toml"
    try:
        text = path.read_text(encoding="utf-8")
        known = dict(own or {})
        study = from_toml(text, known | stand_ins(read_toml(text), known))
    except FileNotFoundError:
        raise RunFolderError(f"'{folder}' holds no run of a study") from None
    except (OSError, ValueError, RecursionError) as error:
        raise RunFolderError(f"'{path}' is damaged, or cut off: {ANEW}") from error
    if (folder / "run.json").exists() and plain_study(study) != load_run(folder)["origin"]["study"]:
        raise RunFolderError(f"'{path}' is not the study that was run: {ANEW}")
    return study


def load_rows(folder: Path, origin: str, design: Design | None = None) -> Sweep | None:
    """Return the rows in ``folder / rows``; None if there are none.

    Raises
    ------
    StoreError
        If the folder is damaged.
    RunFolderError
        If they were computed from something else than `origin`.
    """
    here = folder / "rows"
    if not (here / "study.json").exists():
        return None
    if opened(here).identity["study"].get("origin") != origin:
        raise RunFolderError(
            f"'{here}' was computed from another loop than the rest of the run: delete it and "
            "continue with --resume"
        )
    return load(here, design)


def load_result(folder: Path, *, trust: bool = False) -> Result:
    """Return what is in the folder of a run, finished or not.

    Nothing is simulated.  Kinds of analysis of one's own are imported, to draw what they found; a
    note tells of those that have gone.

    Parameters
    ----------
    folder : Path
        Where `run` has kept its results.
    trust : bool, optional
        As in `read_study`.

    Returns
    -------
    Result
        Rows, and the analyses that are finished.

    Raises
    ------
    RunFolderError
        If it holds no results, or files are damaged.

    Examples
    --------
    See `run`.
    """
    own, gone = _own_kinds(folder, trust)
    study, run = load_study(folder, own), load_run(folder)
    content = read_json(folder / "results.json", "continue with --resume, which makes it anew")
    origin = origin_key(run["origin"])
    try:
        quantities = pd.DataFrame(content["quantities"]).set_index("name")
        requirements = pd.DataFrame(content["requirements"]).set_index("key")
        metrics = pd.DataFrame(content["metrics"], columns=METRIC_COLUMNS).set_index("key")
        keys = [finding["key"] for finding in content["findings"]]
    except KeyError as error:
        raise RunFolderError(f"'{folder}' holds no results of a study: {error}") from error
    if content["origin"] != origin:
        raise RunFolderError(f"the results in '{folder}' are those of another run: {ANEW}")
    findings = [load_finding(folder, key, origin) for key in keys]
    rows = None
    if study.runs is not None:
        design = main_design(study.runs, _space(study, quantities), study.study.seed)
        rows = load_rows(folder, origin, design)
    return Result(
        folder=folder,
        study=study,
        quantities=quantities,
        requirements=requirements,
        metrics=metrics,
        rows=rows,
        findings=tuple(finding for finding in findings if finding is not None),
        complete=content["complete"],
        notes=(*content["notes"], *gone),
        origin=run["origin"],
    )


def _own_kinds(folder: Path, trust: bool) -> tuple[dict[str, Kind], list[str]]:
    """Return the kinds of one's own that the study of a run names, and what is said of the others.

    Raises
    ------
    RunFolderError
        If the folder holds no run, or its study is damaged.
    """
    home = folder / load_run(folder)["study_folder"]
    found, problems = own_kinds(plain_study(load_study(folder)), home, trust=trust)
    return found, [f"what it found is told without its figures: {p}" for p in problems]


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
    one, other = (load_run(folder)["origin"] for folder in (first, second))
    told = [loop_differences(one, other), version_differences(one, other)]
    return "; ".join(filter(None, told))


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
    >>> from analysis.studies import origin_differences, read_study, run, run_differences
    >>> text = '''
    ... loop = "nlctl:block"
    ... options = { spec = { block = "Lag" }, name = "lag" }
    ... study = { title = "A lag", seed = 1 }
    ... space."lag.T" = { bounds = [0.05, 0.4] }
    ... inputs.u = 1.0
    ... spec.rises = "always from 1 s on v >= 0.9"
    ... time = { end = 1.2, step = 0.1 }
    ... runs.size = 20
    ... analysis = [{ kind = "probability" }]
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     one, other = Path(folder, "one"), Path(folder, "other")
    ...     _ = Path(folder, "lag.toml").write_text(text, encoding="utf-8")
    ...     _ = run(read_study(Path(folder, "lag.toml")), one)
    ...     _ = run(read_study(Path(folder, "lag.toml"), ["inputs.u=0.8"]), other)
    ...     found, reason = run_differences(one, other), origin_differences(one, other)
    >>> reason
    '[inputs] of the study'
    >>> print(found[1])
    findings.probability.numbers.violations was 0, now 20
    """
    found = []
    for folder in (first, second):
        load_result(folder)
        content = read_json(folder / "results.json")
        del content["origin"]
        for name, key in (("findings", "key"), ("quantities", "name"), ("requirements", "key")):
            content[name] = {part.pop(key): part for part in content[name]}
        found.append(content)
    return differences_of(*found)
