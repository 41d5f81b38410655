"""The command ``nlctl tune study.toml``: its page, and the gains that were found."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .memory import TO_BEGIN, check_memory
from .printing import say
from .report import Force, Open, check_report_options, finish_report
from .studies import (
    EXIT_CODES,
    INCOMPLETE,
    INTERRUPTED,
    Trust,
    check_study_path,
    exit_codes,
    run_folder,
)
from .study_report import report_study

if TYPE_CHECKING:
    from ..studies.finding import Finding

_KIND = "tuning"
_EXAMPLE = """
  [[analysis]]
  kind = "tuning"
  gains = { "law.beta" = [0.1, 50.0] }"""


def tune_command(
    study: Annotated[
        Path, typer.Argument(metavar="STUDY", help="A study file (.toml) that tunes gains.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the page; that of the run by default.")
    ] = None,
    jobs: Annotated[int, typer.Option(min=0, help="Threads; 0: one per core.")] = 0,
    open_: Open = False,
    pdf: Annotated[bool, typer.Option("--pdf", help="Also print it to report.pdf.")] = False,
    interactive: Annotated[
        bool, typer.Option("--interactive", help="Add charts to zoom in and to read values from.")
    ] = False,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Find gains with which a loop meets its spec by the largest margin, and write a page.

    The study has an analysis of kind 'tuning', which says what is tuned within which bounds; what
    is found is validated on fresh samples.  Its code is run.  Exit 1 if a claim of it fails.
    """
    with exit_codes(json=False):
        code = _tuned(
            study, out, jobs, open_=open_, pdf=pdf, interactive=interactive, force=force,
            trust=trust,
        )  # fmt: skip
        if code:
            raise typer.Exit(code)


def _tuned(study: Path, out: Path | None, jobs: int, *, open_: bool, **how: Any) -> int:
    """Tune the gains of a study, write its page, print both; return the exit code."""
    check_memory(TO_BEGIN)
    check_study_path(study)
    _check_asks(study)
    from .progress import sweep_bar

    pdf = how.pop("pdf")
    check_report_options(out or run_folder(study), pdf=pdf, force=how["force"])
    page, result = report_study(study, out, threads=jobs or None, watch=sweep_bar, **how)
    say(result.verdict)
    for finding in result.findings:
        if finding.kind == _KIND:
            _tell(finding)
    finish_report(page, pdf=pdf, open_=open_)
    if result.complete:
        return EXIT_CODES.get(result.answer, 0)
    return INTERRUPTED if result.interrupted else INCOMPLETE


def _check_asks(study: Path) -> None:
    """Refuse a study in which nothing is tuned."""
    from nlctl.errors import UsageError

    from ..studies.file.toml import read_toml

    try:
        content = read_toml(study.read_text(encoding="utf-8"))
    except (OSError, ValueError):  # reading the study says why, with the line
        return
    asked = content.get("analysis", ())
    kinds = [a.get("kind") for a in asked if isinstance(a, dict)] if asked else []
    if _KIND not in kinds:
        raise UsageError(f"'{study}' tunes nothing: add the gains and their bounds,\n{_EXAMPLE}")


def _tell(finding: Finding) -> None:
    """Print what was found, and the gains line by line."""
    say(f"\n{finding.title}\n  {finding.sentence}")
    if not finding.is_answered:
        return
    for name, row in finding.tables["gains"].iterrows():
        say(f"  {name} = {row['after']:.6g} (was {row['before']:.6g})")
