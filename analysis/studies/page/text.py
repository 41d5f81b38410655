"""What the report of a study says of its results: captions, headings, words for numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from nlctl.wording import some_of

from ...figures import CLIP
from ...report.typography import in_print
from ...robustness.stl.spec import FAILED

SPEC = (
    "What is required of every run. A margin tells by how much a requirement holds, in multiples "
    "of its bound: 0.2 means that 20 % of the bound are left; a run violates the spec unless the "
    "least of its margins is above 0."
)
SPACE = (
    "What is uncertain: nominal value, law, and the box that corners and searches stay in. "
    "Everything else keeps its nominal value."
)
STATUS = "How the runs ended. A run that did not reach its end violates the spec."
REQUIREMENTS = "Margins by requirement; the spec is the least of them."
METRICS_CAPTION = (
    "Metrics of the runs. Missing: runs that did not reach their end; they are not in the other "
    "columns."
)
MARGINS_CAPTION = (
    "Left: number of runs by margin. Right: share of the runs with at most that margin."
)
VIOLATIONS = " Orange: violations."
CLIPPED = (
    f" Margins below −{CLIP:g}, and runs that did not reach their end, are drawn at −{CLIP:g}."
)
PART = (
    "Short studies of what happens when parameters, initial states and disturbances differ from "
    "the paper's. nlctl report STUDY.toml makes a whole report on one, and on longer studies; the "
    "files reports/*.toml of nlctl are such studies."
)
SAME = "The same in numbers"
DIAGRAM = "The loop as simulated, with nominal values, and the inside of its nested diagrams."
ALL_PARAMETERS = "All parameters of the loop, with their values."
PARAMETERS = (
    "All parameters of the loop, with their values; varied: by which law the study changed them."
)
EQUATIONS_CAPTION = (
    "Read from the functions that are run, block by block; letters are the names of signals, "
    "parameters and local variables."
)
SOURCE = "As it was when this page was made:"
ASSUMED = "What is assumed"
WITH_ASSUMPTIONS = f" Assumptions: see “{ASSUMED}”."
FOUND = "What was asked of the loop, and what was found."


DID_NOT_END = "did not end"


_ASSUMED = re.compile(r" Assumed: (?:at each size )?(.*?)\.(?=\s|$)", re.DOTALL)


def without_assumptions(sentence: str) -> str:
    """Return a statement that refers to its assumptions instead of spelling them out."""
    return _ASSUMED.sub(WITH_ASSUMPTIONS, sentence)


def assumptions_in(sentences: Iterable[str]) -> list[str]:
    """Return what statements assume, each assumption once."""
    clauses = (clause for words in sentences for clause in _ASSUMED.findall(words))
    return list(dict.fromkeys(part for told in clauses for part in told.split("; ")))


def violate(count: int, total: int) -> str:
    """Return how many runs violate the spec."""
    return f"{some_of(count, total, 'run', 'violates', 'violate')} the spec"


def clipped(margins: Iterable[float]) -> str:
    """Return what a caption says of margins beyond the picture; nothing where there are none."""
    return CLIPPED if np.any(~(np.asarray(list(margins), dtype=float) >= -CLIP)) else ""


def unit_text(unit: Any) -> str:
    """Return a unit with its powers raised."""
    return "" if unit is None else in_print(str(unit))


def margin_text(value: float) -> str:
    """Return a margin as text; that of a run that did not reach its end says so.

    Where NaN counts as the lowest margin it has become -inf.
    """
    if np.isnan(value) or value == -np.inf:
        return "NaN"
    return f"{value:.4g}" if value > -FAILED else DID_NOT_END
