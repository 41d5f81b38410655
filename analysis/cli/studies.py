"""The commands about study files.  Like `nlctl.analysis.cli.main` it only reads arguments and
prints.

Exit codes: 0 all claims are shown, 1 a claim is refuted, 2 usage or an invalid study, 3 an
internal error or one of the user's own functions, 4 incomplete and resumable, 5 no claim is
refuted, but not all are shown yet, 130 interrupted.
"""

from __future__ import annotations

import errno
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from nlctl.errors import DivergedError, ParameterError, UsageError
from nlctl.wording import counted

from .memory import TO_BEGIN, TOO_LITTLE, check_memory, is_short_of_memory
from .printing import error_line, error_text, in_json, printable, say

if TYPE_CHECKING:
    from ..report.document import Claim
    from ..studies.result import Result

FAILS, INVALID, INTERNAL, INCOMPLETE, OPEN, INTERRUPTED = 1, 2, 3, 4, 5, 130
T = TypeVar("T")
CONNECT = "5s"  # how long a scheduler may take to answer

StudyPath = Annotated[Path, typer.Argument(metavar="STUDY", help="The study file, .toml.")]
SetKeys = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace what stands in the file: runs.size=100, "
        'space."actuator.b_r".uniform=[0.3,0.6], analysis.0.confidence=0.9.',
    ),
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust", help="Run whatever code is named, and record that this user trusts it as it is."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")]
Jobs = Annotated[int, typer.Option(min=0, help="Threads or processes; 0: one per core.")]
Junit = Annotated[
    Path | None,
    typer.Option(help="File to write: the claims as JUnit XML, a test case each."),
]


def run_command(
    study: StudyPath,
    set_: SetKeys = None,
    resume: Annotated[bool, typer.Option(help="Go on with what the folder holds.")] = False,
    jobs: Jobs = 0,
    executor: Annotated[
        str, typer.Option(help="threads, processes, or dask:ADDRESS of a scheduler.")
    ] = "threads",
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results; reports/NAME by default.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Use a folder with other files.")] = False,
    junit: Junit = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Run a study, print what it found, and keep everything in a folder.

    A study file names code, which is run: run the studies of those whose programs you would run.

    Exit codes: 0 all claims are shown, 1 a claim is refuted, 5 none is refuted but not all are
    shown yet, 2 an invalid study, 3 an error in a function of yours, 4 incomplete: continue with
    --resume.
    """
    options = [part for text in set_ or [] for part in ("--set", text)]
    options += [] if out is None else ["--out", str(out)]
    options += [] if executor == "threads" else ["--executor", executor]
    options += ["--jobs", str(jobs)] if jobs else []
    options += [] if junit is None else ["--junit", str(junit)]
    options += ["--force"] * force + ["--trust"] * trust
    folder = run_folder(study) if out is None else out
    with exit_codes(json), _saying_how_to_resume(study, options, folder, resume, json):
        check_memory(TO_BEGIN)
        from ..studies import read_study
        from ..studies import run as run_study
        from .progress import sweep_bar

        check_memory()
        check_study_path(study)
        check_junit(junit)
        file = asking(lambda trust: read_study(study, set_ or [], trust=trust), trust)
        with _executor(executor, jobs) as pool:
            result = run_study(
                file,
                folder,
                resume=resume,
                force=force,
                executor=pool,
                threads=jobs or None if pool is None else None,
                watch=sweep_bar,
            )
        _show(result, json)
        if junit is not None:
            from ..pages.study.claims import claims

            write_claims(junit, result.study.study.title, claims(result))
        if code := exit_code(result):
            raise typer.Exit(code)


def validate(
    study: StudyPath,
    set_: SetKeys = None,
    jobs: Jobs = 0,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Check a study file, and say how many runs, how much time and disk it will take.

    To know, it makes the loop and runs a few rows: the code that the file names is run.
    """
    with exit_codes(json):
        check_memory(TO_BEGIN)
        from ..studies import plan, read_study

        check_memory()
        check_study_path(study)
        file = asking(lambda trust: read_study(study, set_ or [], trust=trust), trust)
        runs = plan(file, jobs or None)
        if json:
            content = {"valid": True, **vars(runs), "total": runs.total}
            print(in_json(content))
            return
        say(f"{study} is a valid study.")
        for key, count in runs.runs.items():
            say(f"  {key}: {'at most ' if key in runs.at_most else ''}{counted(count, 'run')}")
        say(
            f"In all {counted(runs.total, 'run')}, about {_duration(runs.seconds)} on this "
            f"machine, and at most about {runs.size / 1e6:.2g} MB on disk."
        )


def replay_command(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    row: Annotated[int, typer.Argument(min=0, help="Number of the row.")],
    part: Annotated[
        str, typer.Option(help="An analysis that keeps rows of its own, such as worst-case.")
    ] = "",
    plot: Annotated[Path | None, typer.Option(help="Figure to write: .svg, .png, .pdf.")] = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Run one row again, compare it with the stored one bit for bit, and plot its signals.

    The loop is built again: the code that the study names is run.
    """
    with exit_codes(json):
        check_memory(TO_BEGIN)
        from ..studies import replay as replay_row
        from ..studies import replay_figure
        from .terminal import check_figure, write_figure

        if plot is not None:
            check_figure(plot)
        check_run_path(folder)
        check_memory()
        replayed = asking(lambda trust: replay_row(folder, row, part, trust=trust), trust)
        if plot is not None:
            write_figure(plot, replay_figure(replayed))
        if json:
            print(in_json(replayed.plain()))
        else:
            say(replayed)
        if replayed.differences:
            raise typer.Exit(FAILS)


def verify_command(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    json: Json = False,
) -> None:
    """Say whether the folder of a run is intact: every file as the run has written it.

    Nothing is run or imported.  Exit codes: 0 it is intact, 1 something is missing, edited or too
    much, 2 it is not the folder of a run that has come to an end.
    """
    with exit_codes(json):
        from ..studies import verify

        check_run_path(folder)
        verified = verify(folder)
        if json:
            content = {key: getattr(verified, key) for key in ("is_intact", "files", "rows")}
            lists = {
                k: list(getattr(verified, k)) for k in ("analyses", "done", "problems", "others")
            }
            print(in_json(content | lists))
        else:
            say(verified)
            for name in verified.others:
                say(f"  '{name}' is not a part of the run")
        if not verified.is_intact:
            raise typer.Exit(FAILS)


def asking(action: Callable[[bool], T], trust: bool) -> T:
    """Return what `action` returns; where it needs trust, and somebody is there, ask for it."""
    from ..studies import StudyError

    try:
        return action(trust)
    except StudyError as error:
        others = [p for p in error.problems if not p.needs_trust]
        if trust or others or not (sys.stdin.isatty() and sys.stderr.isatty()):
            raise
        error_line(f"nlctl: {error}")
        if not typer.confirm("Run this code?", err=True):
            raise
    return action(True)


def schema() -> None:
    """Print the JSON schema of study files, for editors."""
    from ..studies.reading.own_kinds import model_of

    print(in_json(model_of({}).model_json_schema()))


def check_study_path(study: Path) -> None:
    """Refuse a folder where a study file is wanted."""
    from ..studies.intact import is_run

    if study.is_dir():
        run = shlex.quote(str(study))
        advice = f": look at that run with 'nlctl report {run}'" if is_run(study) else ""
        raise UsageError(f"'{study}' is a folder, and a study is a file (.toml){advice}")


def check_run_path(run: Path) -> None:
    """Refuse a file where the folder of a run is wanted."""
    if run.exists() and not run.is_dir():
        loop = f"a loop of it is {run.as_posix()}:NAME" if run.suffix == ".py" else ""
        advice = loop or f"name '{run.parent}'"
        raise UsageError(f"'{run}' is a file, and a run is a folder: {advice}")


def run_folder(study: Path) -> Path:
    """Return where the run of a study file is kept by default."""
    return Path("reports") / study.stem


@contextmanager
def _saying_how_to_resume(
    study: Path, options: list[str], folder: Path, resume: bool, json: bool
) -> Iterator[None]:
    """Print the command that resumes, where a run ends early and may be continued."""
    # It resumes from the moment on at which the folder holds the study; before, it begins.
    kept = folder / "study.toml"
    is_taken = kept.exists() and not resume  # by a run that is there already: it is refused
    try:
        yield
        return
    except KeyboardInterrupt:
        error_line("nlctl: interrupted")
        code = INTERRUPTED
    except typer.Exit as error:
        if error.exit_code not in (INCOMPLETE, INTERRUPTED):
            raise
        code = error.exit_code
    except Exception as error:
        if not (_is_full(error) or is_short_of_memory(error)):
            raise
        _fail(error, json)
        code = INCOMPLETE
    verb, flag = ("continue", ["--resume"]) if resume or kept.exists() else ("begin", [])
    if not is_taken:
        command = shlex.join(["nlctl", "run", str(study), *flag, *options])
        error_line(f"{verb} with: {command}")
    raise typer.Exit(code) from None


@contextmanager
def exit_codes(json: bool) -> Iterator[None]:
    """Turn what goes wrong into one message and an exit code."""
    try:
        yield
    except KeyboardInterrupt:
        error_line("nlctl: interrupted")
        raise typer.Exit(INTERRUPTED) from None
    except (UsageError, DivergedError, OSError, MemoryError) as error:
        _fail(error, json)
        raise typer.Exit(INVALID) from None
    except (typer.Exit, typer.Abort):
        raise
    except Exception as error:
        if is_short_of_memory(error):
            _fail(error, json)
            raise typer.Exit(INVALID) from None
        from .terminal import trace_of

        error_line(trace_of(error))
        if json:
            print(in_json({"error": f"{type(error).__name__}: {error}"}))
        raise typer.Exit(INTERNAL) from None


def _fail(error: Exception, json: bool) -> None:
    """Print one message: as JSON where that was asked for."""
    message = (
        f"{TOO_LITTLE} ({error or type(error).__name__})"
        if is_short_of_memory(error)
        else error_text(error)
    )
    if not json:
        error_line(f"nlctl: {message}")
        return
    content: dict[str, Any] = {"error": message}
    problems = getattr(error, "problems", None)
    if problems is not None:
        content |= {"valid": False, "problems": [problem.plain() for problem in problems]}
    print(in_json(content))


def _is_full(error: BaseException | None) -> bool:
    """Whether a disk or a quota is full: what is kept can be continued."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
            return True
        error = error.__cause__
    return False


@contextmanager
def _executor(text: str, jobs: int) -> Iterator[Any]:
    """Yield the executor that an option names; None for the engine's own threads."""
    if text == "threads":
        yield None
    elif text == "processes":
        from nlctl.host.workers import process_pool
        from nlctl.native.ensemble import cores

        with process_pool(jobs or cores()) as pool:
            yield pool
    elif text.startswith("dask:"):
        with _dask_client(text.removeprefix("dask:")) as client:
            yield client.get_executor()
    else:
        raise ParameterError(f"--executor needs threads, processes or dask:ADDRESS, got '{text}'")


def _dask_client(address: str) -> Any:
    """Return a client of the scheduler at an address; it is to be closed."""
    try:
        from distributed import Client
    except ImportError:
        raise ParameterError(
            '--executor dask:ADDRESS needs the extra: pip install "nlctl[cluster]"'
        ) from None
    try:
        return Client(address, timeout=CONNECT)
    except (OSError, ValueError) as error:
        raise ParameterError(
            f"cannot reach a Dask scheduler at '{address}' ({error}): give the address that it "
            "prints when it starts, such as --executor dask:tcp://127.0.0.1:8786"
        ) from None


def exit_code(result: Result) -> int:
    """Return the exit code by which a command says what a study has found."""
    if not result.complete:
        return INTERRUPTED if result.interrupted else INCOMPLETE
    return {"refuted": FAILS, "not shown yet": OPEN}.get(result.answer, 0)


def _show(result: Result, json: bool) -> None:
    """Print the verdict, then every finding in its own words."""
    for note in result.notes:
        error_line(f"nlctl: {note}")
    if json:
        print(in_json(result.plain()))
        return
    say(f"{result.study.study.title}\n{result.verdict}")
    for finding in result.findings:
        say(f"\n{finding.title}\n  {finding.sentence}")
        if finding.claim:
            say(f"  Claim: {finding.claim}: {finding.outcome}.")
    say(f"\n{result.folder}")


def check_junit(path: Path | None) -> None:
    """Refuse, before anything is computed, a file of claims that could not be written."""
    if path is not None:
        from .terminal import check_file

        check_file(path)


def write_claims(path: Path | None, title: str, claims: Sequence[Claim]) -> None:
    """Write claims as JUnit XML where that is wanted, and say on stderr where."""
    if path is not None:
        from nlctl.host.files import replace_file

        from ..report.junit import junit

        content = junit(title, claims)
        replace_file(path, lambda file: file.write(content))
        print(printable(path), file=sys.stderr)


def _duration(seconds: float) -> str:
    """Return a time in words."""
    if seconds < 120:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
