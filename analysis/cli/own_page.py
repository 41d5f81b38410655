"""The body of ``nlctl report file.py:make``: the page of a loop that a function returns."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .loops import AskedRun, simulated

if TYPE_CHECKING:
    from ..report.document import Report
    from ..robustness.stl.spec import Requirement


def is_loop_name(text: str) -> bool:
    """Whether a text is ``file.py:function`` or ``package.module:function``, and no path."""
    place, colon, function = text.rpartition(":")
    return bool(colon and place) and function.isidentifier() and not Path(text).exists()


def is_paper_name(text: str) -> bool:
    """Whether a text is a bare word, as names of papers are, and no file or folder."""
    return text.replace("-", "_").isidentifier() and not Path(text).exists()


def page_folder(name: str) -> Path:
    """Return where the page of a loop is kept by default."""
    place, _, function = name.rpartition(":")
    stem = Path(place).stem if place.endswith(".py") else place.rpartition(".")[2]
    return Path("reports") / (stem if function == "make" else f"{stem}-{function}")


def compose_page(asked: AskedRun, live: bool | Sequence[str], required: Sequence[str]) -> Report:
    """Run a loop, check what can be checked of any, and compose its page."""
    requirements = _requirements(required, asked.until)
    if live:
        from nlctl.export.web import check_linker

        check_linker()
    run = simulated(asked)
    from ..loop_checks import (
        LoopCheck,
        checks_of,
        checks_section,
        headline,
        in_sentences,
        proof_check,
        proof_of,
    )
    from ..loop_report import loop_report
    from .progress import progress_bar

    with progress_bar("checking the loop", 2) as advance:
        checks = checks_of(run.loop, run.response, run.params)
        advance(1)
        proof = proof_of(run.loop, asked.until, run.start, run.params)
        advance(1)
    applies = not isinstance(proof, LoopCheck)
    every = [*checks, proof_check(proof) if applies else proof]
    page = loop_report(
        run.loop,
        title=run.loop.name,
        response=run.response,
        params=run.params,
        ledger=proof if applies else None,
        sections=[checks_section(every)],
        command=shlex.join(asked.command("report")) + live_words(live, required),
        live=live,
        requirements=requirements,
        repeat=asked.command("simulate"),
    )
    return replace(page, verdict=f"{page.verdict} {in_sentences(every)}", headline=headline(every))


def _requirements(texts: Sequence[str], until: float) -> list[Requirement]:
    """Return requirements from texts as study files have them."""
    from ..robustness.stl.spec import Requirement
    from ..robustness.stl.text import parse_formula

    return [
        Requirement(key=f"R{k}", formula=parse_formula(text), until=until)
        for k, text in enumerate(texts, start=1)
    ]


def live_words(live: bool | Sequence[str], required: Sequence[str] = ()) -> str:
    """Return the options of a page that runs."""
    words = [] if isinstance(live, bool) else [w for name in live for w in ("--move", name)]
    words = ["--live"] * (live is True) + words + [w for r in required for w in ("--require", r)]
    return "".join(f" {shlex.quote(word)}" for word in words)
