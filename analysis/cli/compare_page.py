"""The page of ``nlctl compare A B --out DIR``."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

from ..pages.compared import Compared, comparison_page
from ..pages.study.report import study_report
from ..report.compare import read_report
from ..report.document import Report
from ..report.render import render_json
from ..studies import load_result, origin_differences
from ..studies.differences import long_table_differences


def compose_comparison(first: Path, second: Path, out: Path, rtol: float) -> Report:
    """Compose the page of two reports or runs, which have been checked."""
    both = (first, second)
    are_runs = all((path / "results.json").exists() for path in both)
    others = []
    if are_runs:
        others = [*long_table_differences(first, second, rtol)]
        if origins := origin_differences(first, second):
            others.insert(0, f"The runs were not computed from the same: {origins}")
    command = ["nlctl", "compare", *(path.as_posix() for path in both)]
    command += ["--rtol", f"{rtol:g}"] * (rtol > 0) + ["--out", out.as_posix()]
    return comparison_page(
        *(_compared(path) for path in both),
        rtol=rtol,
        common=are_runs,
        others=others,
        command=shlex.join(command),
    )


def _compared(path: Path) -> Compared:
    """Return what is compared; a run without a page has what its page would say without figures."""
    if path.is_dir() and not (path / "report.json").exists():
        page = json.loads(render_json(study_report(load_result(path))))
        return Compared(name=path.as_posix(), content=page)
    folder = path if path.is_dir() else path.parent
    return Compared(name=path.as_posix(), content=read_report(path), folder=folder)
