"""From the id of a requirement to its formula, the claims that answer it, and their evidence."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...report.document import Section, Table
from ...studies.file.schema import keyed
from ...studies.result import Result

CAPTION = (
    "From requirement to evidence. No claim: no analysis answers the requirement; without an id: "
    "the claim names no requirement."
)


def has_ids(result: Result) -> bool:
    """Whether a study gives any requirement an id."""
    return any(rule.id for rule in result.study.spec.values())


def traceability(result: Result, prefix: str = "") -> Iterator[Section]:
    """Yield the table of requirements with their claims; nothing where there are no ids."""
    if has_ids(result):
        table = Table(
            caption=CAPTION,
            columns=("id", "requirement", "formula", "claim", "verdict", "evidence"),
            rows=[*_requirement_rows(result, prefix), *_other_rows(result, prefix)],
            status="verdict",
            links="evidence",
        )
        yield Section(key="study_traceability", title="Requirements and evidence", items=[table])


def _requirement_rows(result: Result, prefix: str) -> Iterator[tuple[str, ...]]:
    """Yield the rows of each requirement, one for each claim that answers it."""
    every = keyed(result.study)
    for name, rule in result.study.spec.items():
        answering = {key: asked for key, asked in every.items() if rule.id and rule.id in asked.id}
        for key, asked in answering.items():
            yield (rule.id, name, rule.formula, *_claim_cells(result, key, asked, prefix))
        if not answering:
            yield rule.id, name, rule.formula, "", "no claim", ""


def _other_rows(result: Result, prefix: str) -> Iterator[tuple[str, ...]]:
    """Yield the claims that name no requirement."""
    for key, asked in keyed(result.study).items():
        if asked.claim and not asked.id:
            yield "", "", "", *_claim_cells(result, key, asked, prefix)


def _claim_cells(result: Result, key: str, asked: Any, prefix: str) -> tuple[str, str, str]:
    """Return the claim of an analysis, its verdict, and the key of its evidence."""
    answered = {finding.key: finding for finding in result.findings}.get(key)
    if answered is None:
        return asked.claim, "not run yet", ""
    return answered.claim, answered.answer, f"{prefix}{key}"
