"""What one analysis of a study found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

import pandas as pd

from nlctl.attributes import described_record

from .sealed import as_json


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
