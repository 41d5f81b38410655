"""The option ``--junit``: claims in a file that continuous integration reads."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .printing import printable

if TYPE_CHECKING:
    from ..report.document import Claim

Junit = Annotated[
    Path | None,
    typer.Option(help="File to write: the claims as JUnit XML, a test case each."),
]


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
