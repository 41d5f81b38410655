"""Proofs on a page: a ledger line by line, and a certificate with its constants."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from ..lyapunov.ledger import Ledger, Line
from ..lyapunov.proofs.result import Certificate
from ..report.document import Item, Paragraph, Section, Table
from .diagram import own_values
from .notation import formulas

PROVED = (
    "Proved: by interval arithmetic over the whole box of states, or for all arguments. Computed: "
    "in closed form."
)
CHECKED = (
    "Only checked: seen to hold at every sample of this run, up to rounding. That is not a proof "
    "for other runs, nor between samples. “Literal”: with q cos(w t) counted to g(x), as the paper "
    "has it, and with the d* and eps* of that g; the corrected line counts it to d."
)
VIOLATED = (
    "Violated: statements of the proof in their corrected form that do not hold along this run."
)
FAILING = "False as printed, or as the paper uses it."
LEFT_OPEN = "Left open: what this run cannot decide, and what does not apply to it."
_GROUPS = (  # of the ledger's lines, each a table of its own
    (("violated",), "corrected", VIOLATED),
    (("proved", "computed"), None, PROVED),
    (("checked",), None, CHECKED),
    (("violated",), "paper", FAILING),
    (("undecided", "not applicable"), None, LEFT_OPEN),
)


def ledger_section(ledger: Ledger, key: str, title: str, level: int = 2) -> Section:
    """Return a ledger: a sentence, then its lines, a table for each group of statuses."""
    items: list[Item] = [Paragraph(text=ledger_text(ledger)), *_ledger_tables(ledger)]
    return Section(key=key, title=title, items=items, level=level, folded=True)


def ledger_text(ledger: Ledger) -> str:
    """Return the ledger in a paragraph: what is violated, and how many lines are what."""
    corrected = ", ".join(line.key for line in ledger.violated)
    paper = ", ".join(line.key for line in ledger.failing)
    count = Counter(line.status for line in ledger.lines)
    counts = ", ".join(f"{number} {status}" for status, number in count.items())
    return (
        f"Corrected statements violated: {corrected or 'none'}. False as printed: "
        f"{paper or 'none'}. One run over {ledger.horizon:g} s; of {len(ledger.lines)} lines "
        f"{counts}. The constants hold on the box {formulas(str(ledger.constants.box))}."
    )


def _ledger_tables(ledger: Ledger) -> Iterator[Table]:
    """Yield the lines of a ledger as tables, one for each group of statuses."""
    for statuses, reading, caption in _GROUPS:
        group = [x for x in ledger.lines if x.status in statuses and reading in (None, x.reading)]
        rows = [_row(line) for line in group]
        if rows:
            columns = ("line", "status", "statement", "least margin", "at (s)", "evidence")
            yield Table(caption=caption, columns=columns, rows=rows, status="status")


def _row(line: Line) -> tuple[str, ...]:
    least, at = ("" if np.isnan(x) else f"{x + 0.0:.4g}" for x in (line.least, line.time))
    evidence = formulas(line.evidence)
    if not np.isnan(line.first):
        evidence = f"{evidence}, first at {line.first:.4g} s"
    if line.follows:
        evidence = f"{evidence}. What follows: {formulas(line.follows)}"
    status = line.status
    if status == "violated" and line.reading == "paper":
        status = "violated as printed"  # the paper's statement is wrong, nothing of ours
    return line.key, status, formulas(line.statement), least, at, evidence


def certificate_section(certificate: Certificate) -> Section:
    """Return a certificate: what is proved, then every constant with where it comes from."""
    table = Table(
        caption="The constants of the certificate, and the bounds that follow from them.",
        columns=("symbol", "value", "unit", "status", "how", "for"),
        rows=[
            (c.symbol, f"{c.value:.6g}", c.unit, c.provenance, c.how, c.over)
            for c in certificate.constants
        ],
        status="status",
    )
    values = own_values("The loop of the proof", certificate.params)
    items: list[Item] = [Paragraph(text=f"{certificate.verdict}."), *values, table]
    return Section(key="certificate", title="A bound for all time", items=items)
