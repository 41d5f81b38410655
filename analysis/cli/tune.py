"""The command ``nlctl tune study.toml``: its page, and the gains that were found."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nlctl.errors import UsageError

from .memory import TO_BEGIN, check_memory
from .printing import say
from .report import Force, Interactive, Open, Pdf
from .studies import Trust, check_study_path, exit_code, exit_codes, run_folder
from .written_page import PageOptions, check_report_options, finish_report

if TYPE_CHECKING:
    from ..studies.result import Finding

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
    pdf: Pdf = False,
    interactive: Interactive = False,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Find gains with which a loop meets its spec by the largest margin, and write a page.

    The study has an analysis of kind 'tuning', which says what is tuned within which bounds; what
    is found is validated on fresh samples.  Its code is run.  Exit 1 if a claim of it fails.
    """
    options = PageOptions(
        out=out, threads=jobs or None, pdf=pdf, interactive=interactive, force=force, trust=trust
    )
    with exit_codes(json=False):
        if code := _tuned(study, options, open_=open_):
            raise typer.Exit(code)


def _tuned(study: Path, options: PageOptions, *, open_: bool) -> int:
    """Tune the gains of a study, write its page, print both; return the exit code."""
    check_memory(TO_BEGIN)
    check_study_path(study)
    _check_asks(study)
    from .study_report import report_study

    check_report_options(options.out or run_folder(study), options)
    page, result = report_study(study, options)
    say(result.verdict)
    for finding in result.findings:
        if finding.kind == _KIND:
            _tell(finding)
    finish_report(page, pdf=options.pdf, open_=open_)
    return exit_code(result)


def _check_asks(study: Path) -> None:
    """Refuse a study in which nothing is tuned."""
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
