"""What a study and each of its analyses have found: what a report is made of."""

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

import pandas as pd

from nlctl.attributes import described_record
from nlctl.host.notebook import table_html
from nlctl.names import check_known
from nlctl.wording import counted, some_of

from ..json_values import as_json
from ..robustness.runs.sweep import Sweep
from .file.schema import Study, keyed
from .sealed import origin_key

LISTED = 400
"""Lines of a table that ``report.json`` holds as well; longer ones are files next to it."""


_COLUMNS = {  # of tables; None: those that their rows have
    "quantities": None,
    "requirements": None,
    "metrics": ("key", "signal", "unit", "meaning"),
}


def described_tables(rows: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a study varies, requires and measures as tables, from the rows of each."""
    tables = {name: pd.DataFrame(rows[name], columns=names) for name, names in _COLUMNS.items()}
    return {name: table.set_index(table.columns[0]) for name, table in tables.items()}


@described_record(eq=False, made_by="finding_of")
class Finding:
    """What one analysis found."""

    key: str  # Name of its folder, kind of analysis, heading.
    kind: str
    title: str
    sentence: str  # What was found, with what it rests on.
    claim: str = ""  # What the study claimed; empty without a claim.
    answer: str = ""  # What was found of the claim; empty without a claim.
    needs: str = ""  # What it takes to show the claim, where it is not shown yet.
    runs: int = 0  # Number of simulations that it rests on.
    # Bounds, margins, rows: what the sentence says, as numbers and texts.
    numbers: Mapping[str, Any] = field(default_factory=dict)
    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)  # DataFrames by name.
    # False where rows or loop did not admit the analysis: the sentence says why, and there are
    # neither numbers nor tables.
    is_answered: bool = True

    @property
    def holds(self) -> bool | None:
        """Whether the claim is shown; None without a claim."""
        return self.answer == "shown" if self.answer else None

    @property
    def outcome(self) -> str:
        """The answer in words, ``not shown yet (needs ...)``."""
        return f"{self.answer} (needs {self.needs})" if self.needs else self.answer

    def plain(self) -> dict[str, Any]:
        """Return everything but the tables, as JSON can hold it.

        Returns
        -------
        dict
            Tables by their names only.
        """
        content = {key: value for key, value in vars(self).items() if key != "tables"}
        return as_json(content) | {"tables": sorted(self.tables)}


@described_record(eq=False, made_by="run")
class Result:
    """A study and what it has found; nothing is run to read it."""

    folder: Path
    study: Study  # The study file, with the settings of the command line.
    # One row per uncertain quantity or choice: law, box (low, high), nominal, unit.
    quantities: pd.DataFrame
    requirements: pd.DataFrame  # One row per requirement: formula, until (s), meaning.
    metrics: pd.DataFrame  # One row per metric: signal, unit, meaning.
    # The main table; None if the study has none. ``rows.table`` reads it from the disk.
    rows: Sweep | None
    findings: tuple[Finding, ...]  # In the order of the file.
    complete: bool  # Whether all analyses are done.
    # Whether Ctrl-C was pressed in the run that returned this; not kept in the folder.
    interrupted: bool = False
    notes: tuple[str, ...] = ()  # What the user has to know, such as lost workers.
    # What all of it was computed from, see `origin.origin_of`.
    origin: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def made_with(self) -> dict[str, str]:
        """Versions that the numbers were computed with, and a key of all they follow from."""
        if not self.origin:
            return {}
        return {**self.origin["versions"], "computed from": origin_key(self.origin)}

    @property
    def asked(self) -> dict[str, Any]:
        """What the study file asks of each analysis that is done, by key of its finding."""
        every = keyed(self.study)
        return {finding.key: every[finding.key] for finding in self.findings}

    @property
    def claims(self) -> tuple[Finding, ...]:
        """The findings that the study makes a claim about."""
        return tuple(finding for finding in self.findings if finding.holds is not None)

    @property
    def holds(self) -> bool:
        """Whether every claim is shown; True without claims."""
        return all(finding.holds for finding in self.claims)

    @property
    def answer(self) -> str:
        """Of all claims together: refuted if one is, or else not shown yet if one is not."""
        given = {finding.answer for finding in self.claims}
        return next((a for a in ("refuted", "not shown yet", "shown") if a in given), "")

    @property
    def verdict(self) -> str:
        """The outcome in one sentence."""
        if not self.complete:
            planned = counted(len(self.study.analysis), "analysis", "analyses")
            return f"Incomplete: {len(self.findings)} of {planned} done."
        if not self.claims:
            return "The study makes no claims."
        count = len(self.claims)
        if self.holds:
            return f"All {count} claims are shown." if count > 1 else "The claim is shown."
        sentences = []
        for answer in ("refuted", "not shown yet"):
            these = [finding for finding in self.claims if finding.answer == answer]
            names = [f.key + (f" (needs {f.needs})" if f.needs else "") for f in these]
            if these:
                which = some_of(len(these), count, "claim", "is", "are")
                sentences.append(f"{which} {answer}: {', '.join(names)}.")
        return " ".join(sentences)

    def _repr_html_(self) -> str:
        """What a notebook shows: the verdict, and what each analysis found."""
        rows = [(f.key, f.claim, f.answer, f.sentence) for f in self.findings]
        heading = f"{self.study.study.title}\n{self.verdict}"
        return table_html(heading, ("analysis", "claim", "answer", "found"), rows)

    def __getitem__(self, key: str) -> Finding:
        """Return the finding with this key."""
        findings = {finding.key: finding for finding in self.findings}
        check_known("finding", key, findings)
        return findings[key]

    def plain(self) -> dict[str, Any]:
        """Return everything but the tables, as JSON can hold it.

        Returns
        -------
        dict
            Title, verdict, notes and findings.
        """
        tables = {name: getattr(self, name).reset_index().to_dict("records") for name in _COLUMNS}
        rows = None if self.rows is None else {"done": self.rows.done}
        return as_json(
            {
                "title": self.study.study.title,
                "question": self.study.study.question,
                "verdict": self.verdict,
                "holds": self.holds,
                "answer": self.answer,
                "complete": self.complete,
                "notes": self.notes,
                "rows": rows,
                **tables,
            }
        ) | {"findings": [finding.plain() for finding in self.findings]}
