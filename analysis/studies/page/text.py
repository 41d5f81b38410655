"""What the report of a study says of its results: captions, headings, words for numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

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
METRICS = (
    "Metrics of the runs. Missing: runs that did not reach their end; they are not in the other "
    "columns."
)
MARGINS = "Left: number of runs by margin. Right: share of the runs with at most that margin."
VIOLATIONS = " Orange: violations."
CLIPPED = (
    f" Margins below −{CLIP:g}, and runs that did not reach their end, are drawn at −{CLIP:g}."
)
RUNNING = (
    "Line: share of violations after n runs, in their order. Band: bounds that hold at all n at "
    "once with confidence {confidence:g} % (a confidence sequence)."
)
DECIDES_FIXED = (
    " The verdict rests on the exact bounds at the end alone, drawn as a bar: their number of runs "
    "was fixed in advance. The band shows how the estimate settled; it is wider because it allows "
    "for looking after every run, and decides nothing."
)
DECIDES_SEQUENCE = " The verdict rests on the band: it is reached where the limit leaves it."
SEARCH = "Lowest margin after each run of the search; the background tells what chose the run."
DEVIATIONS = "How far each quantity lies from nominal: ±1 is the end of its box on that side."
RADIUS = "Sizes that were looked at, as factors of the box, with the lowest margin found there."
SMALLEST = " Dashed: the smallest size with a violation."
DEGRADATION = (
    "Share of violations with all deviations from nominal scaled by a factor; bars: intervals with "
    "confidence {confidence:g} %, {together}."
)
MORRIS = (
    "Elementary effects on '{of}': μ* is the mean magnitude, with its bootstrap interval; a σ far "
    "from 0 tells that a quantity does not act linearly, or not on its own."
)
SOBOL = (
    "Shares of the variance of '{of}' with bootstrap intervals, confidence {confidence:g} % each. "
    "S₁: a quantity by itself; S_T: with all its interactions."
)
REGIONAL = (
    "Distance between the distributions in failing and in passing runs; for choices Cramér's V. 0: "
    "alike, 1: apart. p: of the test that they are alike; Holm: adjusted for the number of lines."
)
MAP = (
    "Margin over the plane, the other quantities nominal; between the points that were run, the "
    "dots, it is interpolated."
)
VIOLATED = " Orange: violated."
BOUNDARY = " Line: margin 0."
STAR = " Star: nominal."
BOX = " Dashed: the box of the study."
RANKING = (
    "Options on the same samples, best first: by violations, then by the mean rank in the first "
    "metric. Did not end: such runs violate the spec, lose in every metric, and are not in the "
    "medians."
)
RATES = "Share of violations, with exact intervals, confidence {confidence:g} % each."
MCNEMAR = (
    "McNemar's test by pair: runs in which only one of the two violates the spec. Holm: p adjusted "
    "for the number of pairs."
)
DIFFERENCES = (
    "Paired differences a − b with intervals, confidence {confidence:g} % each: of the median, "
    "exact, and of the mean, by bootstrap (NaN where a run did not end). p: sign test; Holm: "
    "adjusted for the pairs of a metric."
)
FIRST = " Shown are the pairs with {first}; {file} in the run's folder has all."
MEDIANS = (
    "Median of {first} minus the option named at the left, in {metric}, on the same samples; "
    "lines: exact intervals. Right of 0 {first} has the larger value."
)
INFINITE = " Arrows: infinite, because one of the two did not reach its end."
WINS = "In how many samples the option of the line beats that of the column; ties count for none."
PART = (
    "Short studies of what happens when parameters, initial states and disturbances differ from "
    "the paper's. nlctl report STUDY.toml makes a whole report on one, and on longer studies; the "
    "files reports/*.toml of nlctl are such studies."
)
SAME = "The same in numbers"
DIAGRAM = "The loop as simulated, with nominal values, and the inside of its nested diagrams."
PARAMETERS = (
    "All parameters of the loop, with their values; varied: by which law the study changed them."
)
EQUATIONS = (
    "Read from the functions that are run, block by block; letters are the names of signals, "
    "parameters and local variables."
)
SOURCE = "As it was when this page was made:"
ASSUMED = "What is assumed"
WITH_ASSUMPTIONS = f" Assumptions: see “{ASSUMED}”."
FOUND = "What was asked of the loop, and what was found."
TITLES = {  # kind of analysis: heading
    "probability": "Probability of a violation",
    "sequential": "Sequential test",
    "worst case": "Worst case",
    "radius": "Robustness radius",
    "degradation": "Degradation with the size of the uncertainty",
    "morris": "Sensitivity: screening",
    "sobol": "Sensitivity: shares of the variance",
    "regional": "Sensitivity: what sets failing runs apart",
    "failure map": "Failure map",
    "compare": "Comparison on the same samples",
}

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
    return f"{count} of {total} runs {'violates' if count == 1 else 'violate'} the spec"


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
