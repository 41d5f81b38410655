"""What every analysis of a study stands on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd

from analysis.robustness import Design, Prepared, Space, Violation
from analysis.robustness.runs.sweep import Sweep

from ..file.schema import Study
from ..result import Finding

__all__ = ["Ground", "RunDesign", "column", "made", "statement_numbers"]


class RunDesign(Protocol):
    """Runs a design, of the study's own loops by default, into the folder of the analysis."""

    def __call__(self, design: Design, of: Prepared | None = None) -> Sweep: ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Ground:
    """What an analysis stands on.

    Attributes
    ----------
    study : Study
    folder : Path
        What paths in the study are relative to.
    prepared : Prepared
        The study's experiment.
    rows : Sweep or None
        The main table, with its design.
    simulate : callable
        Runs rows here, see `analysis.robustness.search.evaluation.Evaluate`; what a table leaves
        out is nominal.
    run_design : RunDesign
    """

    study: Study
    folder: Path
    prepared: Prepared
    rows: Sweep | None
    simulate: Callable[[pd.DataFrame], pd.DataFrame]
    run_design: RunDesign

    @property
    def seed(self) -> int:
        """What all random numbers of the study follow from."""
        return self.study.study.seed

    @property
    def main(self) -> tuple[Design, np.ndarray]:
        """Design and margins of the main table."""
        assert self.rows is not None
        assert self.rows.design is not None
        return self.rows.design, column(self.rows, "spec")

    def space(self, names: Sequence[str] = ()) -> Space:
        """Return the space, or the part of it with these quantities, named as in the file."""
        whole = self.prepared.experiment.space
        if not names:
            return whole
        own = dict(zip(self.study.space, whole.quantities, strict=True))
        return replace(whole, quantities=tuple(own[name] for name in names), choices=())


def column(rows: Sweep, name: str) -> np.ndarray:
    """Return one column of a sweep."""
    return rows.columns(name)[name].to_numpy()


def made(asked: Any, sentence: str, **parts: Any) -> Finding:
    """Return a finding that `answer` gives its key and title."""
    return Finding(
        key="", kind=asked.kind, title="", sentence=sentence, **{"claim": asked.claim} | parts
    )


def statement_numbers(statement: Violation) -> dict[str, Any]:
    """Return a statement about a probability as numbers and texts."""
    return vars(statement) | {"assumptions": list(statement.assumptions)}
