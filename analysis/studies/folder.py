"""The folder of a run.

study.toml           the study as it was run, with the settings of the command line
run.json             where the files that it refers to are, and what all is computed from: `origin`
rows/                the main table, see `nlctl.analysis.robustness.runs.store`
KEY/finding.json     what one analysis found, its tables next to it in Parquet
KEY/rows/            the rows that it ran itself, where their number is known in advance
results.json         everything but the tables, for other programs
contents.json        which files there are, with a key of each and of the page, see `intact`;
                     written last

Every file of JSON carries a key of its content, and every part the key of its origin: what is
missing, was edited or belongs to another loop is refused, not shown.
"""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import UsageError
from nlctl.host.files import replace_file
from nlctl.wording import counted

from ..robustness import Design, Space
from ..robustness.runs.store import opened, read_parquet
from ..robustness.runs.sweep import Sweep, load
from .build import labels, main_design
from .code.rule import Grant, Reach
from .file.schema import Study, keyed, study_data
from .file.toml import read_toml, study_text
from .intact import (
    CONTENTS,
    PAGE_FILES,
    FindingFile,
    ResultsFile,
    RunFile,
    check_intact,
    is_part,
    page_problems,
    problems_in,
    sealed_record,
    shaped,
)
from .kind import Kind
from .origin import plain_study
from .reading.own_kinds import STAND_IN, from_toml, own_kinds, stand_ins
from .resolve import uncertain
from .result import Finding, Result, described_tables
from .sealed import (
    ANEW,
    RunFolderError,
    as_written,
    digest_of,
    file_bytes,
    file_digest,
    origin_key,
    write_json,
)


@described_record(made_by="verify")
class Integrity:
    """What `verify` found of a run folder."""

    folder: Path
    files: int  # Number of files that are as they were written.
    rows: dict[str, int]  # Number of rows by part, ``"rows"`` for the main table.
    analyses: tuple[str, ...]  # Keys of the analyses that the study asks for.
    done: tuple[str, ...]  # Those that are done.
    # What is missing, edited or too much, one sentence each; empty if the folder is intact.
    problems: tuple[str, ...]
    others: tuple[str, ...]  # Files that the run has not written, its page aside.
    has_page: bool = False  # Whether the record has a page that was made of the run.

    @property
    def is_intact(self) -> bool:
        """Whether nothing is missing, edited or too much."""
        return not self.problems

    def __str__(self) -> str:
        if self.problems:
            count = counted(len(self.problems), "difference")
            return "\n  ".join([f"'{self.folder}' is not intact, {count}:", *self.problems])
        rows, page = sum(self.rows.values()), ", and its page" if self.has_page else ""
        return (
            f"'{self.folder}' is intact: {counted(self.files, 'file')}, {counted(rows, 'row')}, "
            f"{len(self.done)} of {counted(len(self.analyses), 'analysis', 'analyses')}{page}."
        )


@as_annotated
def verify(folder: str | Path) -> Integrity:
    """Hold every file of a run folder against the record that its run has sealed.

    Nothing is imported, run or drawn.

    Parameters
    ----------
    folder : str or Path
        Where `run` has kept its results.

    Raises
    ------
    RunFolderError
        If it holds no run, or none that has come to an end, or the record itself is damaged.

    Examples
    --------
    A lost analysis is named, and so is everything else that differs:

    >>> import shutil
    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.studies import read_study, run, shipped, verify
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = run(read_study(shipped("lag")), Path(folder, "run"))
    ...     before = verify(Path(folder, "run"))
    ...     shutil.rmtree(Path(folder, "run", "probability"))
    ...     after = verify(Path(folder, "run"))
    >>> before.is_intact, before.rows, before.done
    (True, {'rows': 20}, ('probability',))
    >>> after.is_intact, [text[-36:] for text in after.problems]
    (False, ["probability/finding.json' is missing"])
    """
    folder = Path(folder)
    content = sealed_record(folder)
    expected = {CONTENTS, *content["files"], *PAGE_FILES}
    every = (path for path in folder.rglob("*") if is_part(path))
    names = (path.relative_to(folder).as_posix() for path in every)
    in_files = [*problems_in(folder, content)] or [*_contradictions(folder)]
    problems = tuple(dict.fromkeys([*in_files, *page_problems(folder, content)]))
    listed = " ".join(problems)
    return Integrity(
        folder=folder,
        files=len(content["files"]),
        rows=content["rows"],
        analyses=tuple(content["analyses"]),
        done=tuple(content["done"]),
        problems=problems,
        has_page=bool(content["page"]),
        others=tuple(n for n in sorted(names) if n not in expected and f"/{n}'" not in listed),
    )


def _contradictions(folder: Path) -> Iterator[str]:
    """Yield why parts that are as the record says are not those of one run."""
    try:
        read_through(folder)
    except UsageError as error:
        yield str(error)


_OWN = ("study.toml", "run.json", "results.json", CONTENTS, "rows", ".lock", ".owner")
_OWN += ("index.html", "report.json", "signals.json", "report.pdf")


def save_finding(folder: Path, finding: Finding, origin: str) -> None:
    """Write a finding into ``folder / key``, its tables first: the file completes it."""
    # `origin` is the key of what it was computed from.
    here = folder / finding.key
    here.mkdir(parents=True, exist_ok=True)
    keys = {}
    for name, table in finding.tables.items():
        path = here / f"{name}.parquet"
        replace_file(path, lambda file, table=table: table.to_parquet(file))
        keys[name] = file_digest(path)
    write_json(here / "finding.json", finding.plain() | {"tables": keys, "origin": origin})


def load_finding(folder: Path, key: str, origin: str) -> Finding | None:
    """Return the finding in ``folder / key``; None if that analysis is not done."""
    path = folder / key / "finding.json"
    if not path.exists():
        return None
    remedy = f"delete '{path}' and continue with --resume"
    content = shaped(path, FindingFile, remedy)
    if content["key"] != key:
        raise RunFolderError(f"'{path}' is of another analysis, '{content['key']}': {remedy}")
    if content.pop("origin") != origin:
        raise RunFolderError(
            f"'{path.parent}' was computed from another loop than the rest of the run: {remedy}"
        )
    tables = {}
    for name, kept in content.pop("tables").items():
        file = path.with_name(f"{name}.parquet")
        try:
            if file_digest(file) != kept:
                raise RunFolderError(f"'{file}' is not as it was written: {remedy}")
            tables[name] = read_parquet(file)
        except (OSError, ValueError) as error:
            if isinstance(error, RunFolderError):
                raise
            raise RunFolderError(f"'{file}' cannot be read: {remedy}") from error
    return Finding(**content, tables=tables)


def load_run(folder: Path) -> dict[str, Any]:
    """Return what ``run.json`` holds."""
    return shaped(folder / "run.json", RunFile)


def remove_run(folder: Path, *, force: bool = False) -> None:
    """Remove the folder of a run, with its page."""
    if not force:
        names = {*_OWN, *keyed(load_study(folder))} if (folder / "study.toml").exists() else set()
        others = sorted(p.name for p in folder.iterdir() if p.name not in names)
        if others:
            raise RunFolderError(
                f"'{folder}' would be replaced, and holds what no run has made ({others[0]}): take "
                "another folder with --out, or replace it with --force"
            )
    shutil.rmtree(folder)


def load_study(folder: Path, given: Mapping[str, Kind] | None = None) -> Study:
    """Return the study of a run, as it was begun."""
    path = folder / "study.toml"
    try:
        text = study_text(file_bytes(path))
        kinds = dict(given or {})
        study = from_toml(text, kinds | stand_ins(read_toml(text), kinds))
    except FileNotFoundError:
        raise RunFolderError(f"'{folder}' holds no run of a study") from None
    except (OSError, ValueError, RecursionError) as error:
        raise RunFolderError(f"'{path}' is damaged, or cut off: {ANEW}") from error
    if (folder / "run.json").exists() and plain_study(study) != load_run(folder)["origin"]["study"]:
        raise RunFolderError(f"'{path}' is not the study that was run: {ANEW}")
    return study


def load_rows(folder: Path, origin: str, design: Design | None = None) -> Sweep | None:
    """Return the rows in ``folder / rows``; None if there are none."""
    here = folder / "rows"
    if not (here / "study.json").exists():
        return None
    if opened(here).identity["study"].get("origin") != origin:
        raise RunFolderError(
            f"'{here}' was computed from another loop than the rest of the run: delete it and "
            "continue with --resume"
        )
    return load(here, design)


def checked(folder: Path) -> None:
    """Refuse a folder that is not intact, before anything of it is believed."""
    try:
        check_intact(folder)
    except RunFolderError:
        read_through(folder)
        raise


def read_through(folder: Path) -> None:
    """Read every part and every table, for what their readers say of them; nothing is imported."""
    result = _result_in(folder, {}, ())
    with as_written(f"'{folder}'"):
        if result.rows is not None:
            len(result.rows.table)
        for finding in result.findings:
            if (rows := load_rows(folder / finding.key, origin_key(result.origin))) is not None:
                len(rows.table)


@as_annotated
def load_result(folder: str | Path, *, trust: bool = False) -> Result:
    """Return what is in the folder of a run, finished or not.

    Nothing is simulated.  Kinds of analysis of one's own are imported, to draw what they found; a
    note names those that have gone.

    Parameters
    ----------
    folder : str or Path
        Where `run` has kept its results.
    trust : bool, optional
        As in `read_study`.

    Raises
    ------
    RunFolderError
        If it holds no results, or files are damaged.

    Examples
    --------
    See `run`.
    """
    folder = Path(folder)
    checked(folder)
    return _result_in(folder, *_own_kinds(folder, trust))


def _result_in(folder: Path, kinds: Mapping[str, Kind], gone: Sequence[str]) -> Result:
    """Return what is in a folder that is intact, or say why its parts do not go together."""
    study, run = load_study(folder, kinds), load_run(folder)
    content = shaped(folder / "results.json", ResultsFile, "continue with --resume")
    origin = origin_key(run["origin"])
    if content.pop("origin") != origin:
        raise RunFolderError(f"the results in '{folder}' are those of another run: {ANEW}")
    with as_written(f"'{folder}'"):
        result = _put_together(folder, study, content, run["origin"])
        _check_contradictions(result, content)
    return replace(result, notes=(*content["notes"], *gone))


def _put_together(
    folder: Path, study: Study, content: Mapping[str, Any], origin: Mapping[str, Any]
) -> Result:
    """Return the result that the files of a folder make."""
    tables, key, rows, findings = described_tables(content), origin_key(origin), None, []
    if study.runs is not None:
        design = main_design(study.runs, _space(study, tables["quantities"]), study.study.seed)
        rows = load_rows(folder, key, design)
    for asked in content["findings"]:
        finding = load_finding(folder, asked["key"], key)
        if finding is None:
            raise RunFolderError(
                f"'{folder / asked['key']}' is missing, which '{folder / 'results.json'}' names: "
                "continue with --resume"
            )
        findings.append(finding)
    return Result(
        folder=folder,
        study=study,
        **tables,
        rows=rows,
        findings=tuple(findings),
        complete=content["complete"],
        notes=tuple(content["notes"]),
        origin=origin,
    )


def _check_contradictions(result: Result, content: Mapping[str, Any]) -> None:
    """Refuse parts that are each as they were written, and do not go together."""
    folder, rows = result.folder, result.rows
    expected, done = list(keyed(result.study)), [finding.key for finding in result.findings]
    if expected[: len(done)] != done or (result.complete and done != expected):
        raise RunFolderError(
            f"'{folder}' has the analyses {', '.join(done) or 'none'}, and its study asks for "
            f"{', '.join(expected) or 'none'}: continue with --resume"
        )
    if result.complete and result.study.runs is not None:
        stops = [a for a in result.study.analysis if a.definition.needs_rows]
        early = len(stops) == 1 and stops[0].definition.stop is not None
        if rows is None or not (rows.complete or early):
            there = 0 if rows is None else rows.done
            raise RunFolderError(
                f"'{folder / 'rows'}' has {counted(there, 'row')}, less than its study asks for: "
                "continue with --resume"
            )
    for finding in result.findings:
        asked = result.asked[finding.key]
        claim = asked.claim if asked.definition.name != STAND_IN else finding.claim
        same = finding.claim == claim or not (claim or finding.is_answered)
        if finding.kind != asked.kind or not same or bool(finding.claim) != bool(finding.answer):
            raise RunFolderError(
                f"'{folder / finding.key}' does not answer what its study asks ({asked.kind}"
                f"{': ' * bool(claim)}{claim}): delete it and continue with --resume"
            )
    if digest_of(result.plain()) != digest_of(content):
        raise RunFolderError(
            f"'{folder / 'results.json'}' does not say what the parts of the run say: continue "
            "with --resume, which makes it again"
        )


def _own_kinds(folder: Path, trust: bool) -> tuple[dict[str, Kind], list[str]]:
    """Return the own kinds that the study of a run names, and notes on the others."""
    # Their code may run if this user has run or trusted it, or it is nlctl's own: the folder says
    # where the code was, and nothing of who trusts it.
    data, home = study_data(load_study(folder)), folder / load_run(folder)["study_folder"]
    reach: Reach = "all" if trust else "nlctl"
    kinds, problems = own_kinds(data, Grant(reach=reach, folder=home, study=digest_of(data)))
    return kinds, [f"what it found is reported without its figures: {p}" for p in problems]


def _space(study: Study, quantities: pd.DataFrame) -> Space:
    """Return the space of a study with the names, nominal values and units of its run."""
    # The options of choices are not made: their labels are enough for the rows.
    full = quantities.to_dict("index")
    names = zip(quantities.index, study.space.items(), strict=False)
    return Space(
        quantities=tuple(
            replace(
                uncertain(given_name, law),
                name=name,
                nominal=full[name]["nominal"],
                unit=full[name]["unit"],
            )
            for name, (given_name, law) in names
        ),
        choices=tuple(labels(name, choices) for name, choices in study.choices.items()),
    )
