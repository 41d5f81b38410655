"""Words of the report of a study: captions, headings, numbers in words."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from nlctl.native import Status
from nlctl.wording import some_of

from ...figures import CLIP
from ...report.typography import in_print
from ...robustness.stl.spec import FAILED

CLIPPED = (
    f" Margins below −{CLIP:g}, and runs that did not reach their end, are drawn at −{CLIP:g}."
)
SAME = "The same in numbers"
ASSUMED = "What is assumed"
WITH_ASSUMPTIONS = f" Assumptions: see “{ASSUMED}”."


DID_NOT_END = "did not end"


_ASSUMED = re.compile(r" Assumed: (?:at each size )?(.*?)\.(?=\s|$)", re.DOTALL)


def without_assumptions(sentence: str) -> str:
    """Return a statement that refers to its assumptions instead of spelling them out."""
    return _ASSUMED.sub(WITH_ASSUMPTIONS, sentence)


def assumptions_in(sentences: Iterable[str]) -> list[str]:
    """Return what statements assume, each assumption once."""
    clauses = (clause for words in sentences for clause in _ASSUMED.findall(words))
    return list(dict.fromkeys(part for assumption in clauses for part in assumption.split("; ")))


def violate(count: int, total: int) -> str:
    """Return how many runs violate the spec."""
    return f"{some_of(count, total, 'run', 'violates', 'violate')} the spec"


def clipped(margins: Iterable[float]) -> str:
    """Return the note of a caption on margins beyond the picture; nothing where there are none."""
    return CLIPPED if np.any(~(np.asarray(list(margins), dtype=float) >= -CLIP)) else ""


def unit_text(unit: object) -> str:
    """Return a unit with its powers raised."""
    return "" if unit is None else in_print(str(unit))


def margin_text(value: float) -> str:
    """Return a margin as text; that of a run that did not reach its end says so."""
    # Where NaN counts as the lowest margin it has become -inf.
    if np.isnan(value) or value == -np.inf:
        return "NaN"
    return f"{value:.4g}" if value > -FAILED else DID_NOT_END


def margin_in_words(value: float) -> str:
    """Return a margin as part of a sentence, or that its run did not reach its end."""
    text = margin_text(value)
    return "the run did not end" if text == DID_NOT_END else f"margin {text}"


def status_text(name: object) -> str:
    """Return how a run ended, in words."""
    return "reached the end" if name == Status.OK.name else str(name).lower().replace("_", " ")
