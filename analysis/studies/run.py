"""Study -> folder of results: the rows, then one analysis after the other, each kept when done."""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.errors import UsageError
from nlctl.host.files import replace_file

from ..robustness import Design, Experiment, Prepared, evaluate, nominal, prepare
from ..robustness.runs.progress import Progress
from ..robustness.runs.store import StoreError, locked, parquet
from ..robustness.runs.sweep import Sweep, load, sweep
from .build import main_design
from .code.rule import remember_code
from .file.schema import keyed, study_data, to_toml
from .folder import checked, load_finding, load_run, load_study, save_finding
from .intact import seal, unseal
from .kind import Ground, Setup, headed, unanswered
from .origin import (
    compared_differences,
    loop_differences,
    origin_of,
    unseen_notes,
    version_differences,
)
from .reading.parse import StudyFile, read_study
from .result import Finding, Result, described_tables
from .sealed import RunFolderError, digest_of, origin_key, write_json

# what `locked` makes, and a killed run leaves
_OWN = (".lock", ".owner", "..owner.", ".study.toml.")

Watch = Callable[[str], AbstractContextManager[Callable[[Progress], object] | None]]
"""``watch(title)`` is entered around every sweep and gives its `progress`."""


def _unwatched(title: str) -> AbstractContextManager[None]:
    return nullcontext()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Run:
    """A study that is run in a folder: what, how, and from what its results follow."""

    file: Setup
    folder: Path
    prepared: Prepared
    origin: Mapping[str, Any]
    executor: Executor | None
    threads: int | None
    watch: Watch

    @property
    def key(self) -> str:
        return origin_key(self.origin)


@as_annotated
def run(
    file: StudyFile,
    folder: str | Path,
    *,
    resume: bool = False,
    force: bool = False,
    executor: Executor | None = None,
    threads: int | None = None,
    watch: Watch = _unwatched,
) -> Result:
    """Run a study and keep everything in a folder.

    What is done is kept: after Ctrl-C, a kill or a full disk, ``resume=True`` resumes from there
    and ends with the same results, bit for bit (the column ``wall_time`` aside).

    Parameters
    ----------
    file : StudyFile
        What `read_study` returns.
    folder : str or Path
        See `folder` for what is in it.
    resume : bool, optional
        Whether to take up what the folder holds.  It must be of the same study, loop and versions.
    force : bool, optional
        Whether a folder may be used that holds other files.
    executor : concurrent.futures.Executor, optional
        Where rows are run whose number is known in advance; searches run here.
    threads : int, optional
        As in `nlctl.analysis.robustness.runs.sweep`.
    watch : callable, optional
        See `Watch`.

    Returns
    -------
    Result
        Not ``complete`` after Ctrl-C (then ``interrupted``) before the last analysis is done, or
        if workers were lost.

    Raises
    ------
    RunFolderError
        If the folder holds a run and `resume` is False, or one that was computed from something
        else, or files that no run has made; or another process works in it.
    StoreError
        If a file cannot be written.
    KeyboardInterrupt
        If Ctrl-C comes before the first row, while diagrams are compiled.

    Examples
    --------
    The lag T v' = u - v is above 0.9 one second after a step, whatever T up to 0.4 s: none of 20
    runs violates that, and the bound of the probability is 1 - 0.01^(1/20) with a confidence of
    99 %.

    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.studies import load_result, read_study, run, shipped
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     result = run(read_study(shipped("lag")), Path(folder, "run"))
    ...     again = load_result(Path(folder, "run"))
    >>> found = result["probability"].numbers
    >>> found["violations"], round(found["upper"], 4), round(1 - 0.01 ** (1 / 20), 4)
    (0, 0.2057, 0.2057)
    >>> result.verdict, again.verdict
    ('The claim is shown.', 'The claim is shown.')
    """
    folder = Path(folder)
    parquet()  # before hours of runs
    with locked(folder, RunFolderError):
        _claim(file, folder, resume, force)
        prepared = prepare(file.experiment)
        origin = _stamped(file, prepared, folder)
        remember_code(file.study, digest_of(study_data(file.study)), file.folder)
        going = _Run(
            file=file,
            folder=folder,
            prepared=prepared,
            origin=origin,
            executor=executor,
            threads=threads,
            watch=watch,
        )
        before = unseal(folder)
        result = _through(going)
        seal(result, going.key, before)
    return result


def _through(run: _Run) -> Result:
    """Run the main table, then every analysis that is not done yet."""
    study, folder, every = run.file.study, run.folder, keyed(run.file.study)
    rows, notes, findings = None, unseen_notes(run.origin), []
    complete, interrupted = True, False
    if study.runs is not None:
        rows = _main_rows(run, every)
        notes += rows.notes
        complete, interrupted = rows.complete or bool(rows.decided), rows.interrupted
    for key, asked in every.items() if complete else ():
        finding, sweeps = load_finding(folder, key, run.key), []
        if finding is None and not interrupted:
            ground = _ground(run, rows, key, sweeps)
            try:
                finding = _answered(key, asked, ground, sweeps)
            except KeyboardInterrupt:
                interrupted = True
            notes += [note for done in sweeps for note in done.notes]
            interrupted = interrupted or any(done.interrupted for done in sweeps)
            if finding is not None:
                save_finding(folder, finding, run.key)
        if finding is None:
            complete = False
            break
        findings.append(finding)
    return Result(
        folder=folder,
        study=study,
        **described_tables(_rows_of(run.prepared.experiment)),
        rows=rows,
        findings=tuple(findings),
        complete=complete,
        interrupted=interrupted,
        notes=tuple(notes),
        origin=run.origin,
    )


def _answered(key: str, asked: Any, ground: Ground, sweeps: Sequence[Sweep]) -> Finding | None:
    """Run one analysis; what it may not be made of costs it alone, not what others have found."""
    try:
        finding = asked.definition.run(asked, ground)
    except (StoreError, RunFolderError):
        raise
    except UsageError as error:
        finding = unanswered(asked, error, sum(done.done for done in sweeps))
    return None if finding is None else headed(key, asked, finding)


def _main_rows(run: _Run, every: Mapping[str, Any]) -> Sweep:
    """Run the main table, or as much of it as the analyses need."""
    study = run.file.study
    assert study.runs is not None
    design = main_design(study.runs, run.prepared.experiment.space, study.study.seed)
    users = [(key, a) for key, a in every.items() if a.definition.needs_rows]
    key, only = users[0] if len(users) == 1 else ("", None)
    stop = None
    if only is not None and only.definition.stop is not None:
        if load_finding(run.folder, key, run.key) is not None:
            return replace(load(run.folder / "rows", design), decided=True)
        stop = only.definition.stop(only, design)
    return _swept(run, run.prepared, design, stop=stop)


def _ground(run: _Run, rows: Sweep | None, part: str, sweeps: list[Sweep]) -> Ground:
    middle = nominal(run.prepared.experiment.space)

    def simulate(table: pd.DataFrame) -> pd.DataFrame:
        fixed = {name: value for name, value in middle.items() if name not in table.columns}
        return evaluate(run.prepared, table.assign(**fixed), threads=run.threads)

    def run_design(design: Design, of: Prepared | None = None) -> Sweep:
        if of is not None and (change := compared_differences(run.origin, part, of)):
            raise RunFolderError(
                f"the loops of '{part}' have changed since the run began ({change}): put "
                "them back as they were and continue with --resume"
            )
        sweeps.append(_swept(run, of or run.prepared, design, part))
        return sweeps[-1]

    return Ground(
        study=run.file.study,
        folder=run.file.folder,
        experiment=run.prepared.experiment,
        prepared=run.prepared,
        rows=rows,
        simulate=simulate,
        run_design=run_design,
    )


def _swept(
    run: _Run,
    prepared: Prepared,
    design: Design,
    part: str = "",
    stop: Callable[[Progress], Any] | None = None,
) -> Sweep:
    """Run rows into the folder of a part; of none: into that of the main table."""
    with run.watch(part or "rows") as progress:
        return sweep(
            prepared,
            design,
            run.folder / part / "rows",
            executor=run.executor,
            threads=run.threads,
            progress=progress,
            resume=True,
            stop=stop,
            identity={"origin": run.key},
        )


def _claim(file: StudyFile, folder: Path, resume: bool, force: bool) -> None:
    """Write which study a folder belongs to, or compare."""
    path = folder / "study.toml"
    if path.exists():
        if not resume:
            raise RunFolderError(
                f"'{folder}' holds a run already: continue it with --resume, or take another "
                "folder with --out"
            )
        kinds = {asked.kind: asked.definition for asked in file.study.analysis if ":" in asked.kind}
        before, now = dict(load_study(folder, kinds)), dict(file.study)
        changed = [name for name in now if before[name] != now[name]]
        if changed:
            raise RunFolderError(
                f"'{folder}' holds a run of another study ({', '.join(changed)} differ): take "
                "another folder with --out"
            )
        return
    others = sorted(p.name for p in folder.iterdir() if not p.name.startswith(_OWN))
    if others and not force:
        listed = ", ".join(others[:3]) + (", ..." if len(others) > 3 else "")
        raise RunFolderError(
            f"'{folder}' holds files that no run has made ({listed}): take another folder with "
            "--out, or this one with --force"
        )
    (folder / "run.json").unlink(missing_ok=True)  # of a run whose study is gone
    replace_file(path, lambda out: out.write(to_toml(file.study).encode()))


def _stamped(setup: Setup, prepared: Prepared, folder: Path) -> dict[str, Any]:
    """Write what a run is computed from, or compare; return it."""
    origin = origin_of(setup, prepared)
    if (folder / "run.json").exists():
        before = load_run(folder)["origin"]
        _refuse_another_loop(folder, before, origin)
        if change := version_differences(before, origin):
            raise RunFolderError(
                f"'{folder}' was computed with other versions ({change}): continue it with those, "
                "or run the study in another folder with --out"
            )
        return before
    place = os.path.relpath(setup.folder.resolve(), folder.resolve())
    content = {"study_folder": Path(place).as_posix(), "origin": origin}
    write_json(folder / "run.json", content)
    return origin


def _refuse_another_loop(folder: Path, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    if change := loop_differences(before, now):
        raise RunFolderError(
            f"'{folder}' was computed from another loop than today's ({change}): put the loop back "
            "as it was, or run the study in another folder with --out"
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Reopened:
    """A run whose loop is the one that its results were computed from."""

    file: StudyFile
    prepared: Prepared  # its experiment
    versions: str  # which versions differ from those of the run, in words; empty if none does


def reopened(folder: Path, *, trust: bool = False) -> Reopened:
    """Return the study of a run with its loop, to draw from it."""
    checked(folder)
    before = load_run(folder)
    load_study(folder)
    home = folder / before["study_folder"]
    file = read_study(folder / "study.toml", folder=home, trust=trust, received=True)
    prepared = prepare(file.experiment)
    now = origin_of(file, prepared)
    _refuse_another_loop(folder, before["origin"], now)
    versions = version_differences(before["origin"], now)
    return Reopened(file=file, prepared=prepared, versions=versions)


def _rows_of(experiment: Experiment) -> dict[str, list[dict[str, Any]]]:
    """Return what an experiment varies, requires and measures, a row each, as files have it."""
    space = experiment.space
    numbers = [
        {"name": q.name, "law": q.law_text, "low": q.box[0], "high": q.box[1], "unit": q.unit}
        | {"nominal": q.nominal}
        for q in space.quantities
    ]
    choices = [
        {"name": c.name, "law": space.laws[c.name], "nominal": c.nominal} for c in space.choices
    ]
    requirements = [
        {"key": r.key, "formula": str(r.formula), "until": r.until, "meaning": r.meaning}
        for r in experiment.spec.requirements
    ]
    metrics = [
        {"key": m.key, "signal": ", ".join(m.signals), "unit": m.unit, "meaning": m.meaning}
        for m in experiment.metrics
    ]
    return {"quantities": numbers + choices, "requirements": requirements, "metrics": metrics}
