"""The report of the paper, from Python: what ``nlctl report`` writes.

In a notebook::

    made = compose(Path("reports/paper"))
    write_report(made.report, Path("reports/paper"))          # of nlctl.analysis.report
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nlctl import native, paper

from ..pages.study.histories import loop_again, rows_again
from ..pages.study.report import study_part
from ..report.document import Section
from ..report.svg import draw_ahead
from ..reproductions.page import Composed, ProgressWatch, unwatched
from ..reproductions.paper import PaperRun, simulate_cases
from ..robustness import prepare
from ..robustness.runs.experiment import compile_experiment_ahead as compile_experiment
from ..robustness.runs.store import parquet
from ..studies import load_result, read_study, run, shipped
from ..studies.folder import remove_run
from . import evidence as proofs
from .page.report import paper_report, paper_sections
from .page.text import PUBLISHED
from .reproduction import CASES, HORIZON, checks, numerics
from .rivals import checked_rivals
from .sampling_limits import checked_record

QUICK = ("example-1-quick", "example-2-quick")
"""The studies of the report, of those that come with nlctl."""


def _unnotified(words: str) -> None:
    return None


class _Here(Executor):
    """Runs what is submitted at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: object, **kwargs: object) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def robustness(
    folders: Sequence[Path],
    *,
    threads: int | None = None,
    notify: Callable[[str], object] = _unnotified,
) -> list[Section]:
    """Return runs of studies as the report's third part."""
    results = [load_result(folder) for folder in folders]
    studies = [(r, rows_again(r, loop_again(r, notify=notify), threads)) for r in results]
    return study_part(studies, published=PUBLISHED)


def compose(
    folder: Path,
    *,
    studies: Sequence[str] = QUICK,
    horizon: float = HORIZON,
    far: bool = True,
    whole: bool = False,
    threads: int | None = None,
    beside: Executor | None = None,
    watch: ProgressWatch = unwatched,
    notify: Callable[[str], object] = _unnotified,
) -> Composed:
    """Reproduce the paper, check its proof, run the studies, and compose the report of it all."""
    if studies:
        parquet()  # before minutes of runs
    other = _Here() if beside is None else beside
    ahead = [] if beside is None else [beside.submit(_compile_ahead, studies)]
    with _far_away(far, whole) as long_runs:
        runs, waiting = _runs(other, folder, studies, threads, watch)
        proved = _proved(horizon, watch)
        with watch("running far beyond 20 s, and the studies", 2) as advance:
            shown: Any = {"proofs": proved, "far": long_runs.result()}
            advance(1)
            sections = paper_sections(runs, **shown)
            drawn = draw_ahead(sections, until=waiting[-1].done)
            *_, record, numbers = (task.result() for task in (*ahead, *waiting))
            advance(1)
    folders = [folder / name for name in studies]
    report = paper_report(
        runs,
        **shown,
        sections=sections,
        studies=robustness(folders, threads=threads, notify=notify) if folders else (),
        numerics=numbers,
        sampling=record,
        rivals=checked_rivals(),
    )
    return Composed(report=report, drawn=drawn, passed=all(c.holds for c in checks(runs)))


def clear(folder: Path, studies: Sequence[str] = QUICK, *, force: bool = False) -> None:
    """Remove the runs of studies in a folder, to make them again: runs and nothing else."""
    for name in studies:
        if (folder / name).exists():
            remove_run(folder / name, force=force)


def _proved(horizon: float, watch: ProgressWatch) -> dict[int, proofs.Evidence]:
    proved = {}
    with watch("checking the proof", 2) as advance:
        for number, loop in ((1, paper.example_1()), (2, paper.example_2())):
            proved[number] = proofs.evidence(loop, horizon)
            advance(1)
    return proved


@contextmanager
def _far_away(far: bool, whole: bool) -> Iterator[Future[proofs.FarRuns]]:
    """Run the loops far beyond 20 s while the body continues, or nothing."""
    if far:
        with proofs.far_runs_in_background(whole=whole) as long_runs:
            yield long_runs
    else:
        yield _Here().submit(lambda: proofs.NO_FAR_RUNS)


def _runs(
    beside: Executor,
    folder: Path,
    studies: Sequence[str],
    threads: int | None,
    watch: ProgressWatch,
) -> tuple[dict[str, PaperRun], list[Future[Any]]]:
    """Run the paper's cases; return them, and what runs in the other process meanwhile."""
    # That is the studies, lines of the record on sampling, and last the numerics. Both processes
    # need the integrators: where nothing is compiled yet only this one compiles them, while the
    # other does what needs none.
    with watch("simulating", len(CASES)) as advance:
        runs = simulate_cases(CASES[:1], advance)
        waiting = [
            beside.submit(_run_shipped, studies, folder, threads),
            beside.submit(checked_record),
            beside.submit(numerics),
        ]
        runs |= simulate_cases(CASES[1:], advance)  # machine code: in this process
    return runs, waiting


def _run_shipped(names: Sequence[str], folder: Path, threads: int | None) -> None:
    """Run studies that come with nlctl, each in ``folder/name``: what they find is on the disk."""
    for name in names:
        if run(read_study(shipped(name)), folder / name, threads=threads).interrupted:
            raise KeyboardInterrupt


def _compile_ahead(studies: Sequence[str]) -> None:
    """Compile what is needed besides the integrators, first what the other process needs late."""
    proofs.compile_evidence_ahead(paper.example_1())
    proofs.compile_evidence_ahead(paper.example_2())
    for case in CASES:  # by now the other process has the first two
        native.compile_ahead(native.compile(case.make()))
    for name in studies:
        compile_experiment(prepare(read_study(shipped(name)).experiment))
