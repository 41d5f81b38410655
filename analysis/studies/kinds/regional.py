"""How far values in failing rows differ from those in passing ones."""

from collections.abc import Iterator

import numpy as np

from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, captioned
from ...robustness import regional
from .. import page as text
from ..file.schema import Asked
from ..kind import Ground, Kind, finding_of
from ..page import column_in_words, result_table
from ..result import Finding, Result
from .context import HOLM

_CAPTION = (
    "Distance between the distributions in failing and in passing runs; for choices Cramér's V. 0: "
    "alike, 1: apart. p: of the test that they are alike; Holm: adjusted for the number of lines."
)
SPEAR = (
    "R. Spear, G. Hornberger: Eutrophication in Peel Inlet, II: identification of critical "
    "uncertainties via generalized sensitivity analysis. Water Research 14 (1980) 43–49. "
    "doi 10.1016/0043-1354(80)90040-8."
)


FREEMAN = (
    "G. H. Freeman, J. H. Halton: Note on an exact treatment of contingency, goodness of fit and "
    "other problems of significance. Biometrika 38 (1951) 141–149. doi 10.1093/biomet/38.1-2.141."
)


class Regional(Asked):
    """How far values in failing rows differ from those in passing ones."""


def _run(asked: Regional, ground: Ground) -> Finding:
    design, margins = ground.main
    passed = int(np.count_nonzero(margins > 0))
    if passed in (0, margins.size):
        which = "passes" if passed else "fails"
        sentence = (
            f"Every one of {counted(margins.size, 'row')} {which}: nothing sets failures apart."
        )
        return finding_of(asked, sentence, runs=margins.size)
    table = regional(design, margins)
    largest = table.nlargest(3, "statistic")["statistic"].to_dict()
    largest_first = ", ".join(f"{name} ({value:.2g})" for name, value in largest.items())
    return finding_of(
        asked,
        f"What sets {counted(margins.size - passed, 'failing row')} most apart from "
        f"{counted(passed, 'passing one')} (distance of the two distributions, 0 to 1): "
        f"{largest_first}.",
        runs=margins.size,
        tables={"differences": table},
    )


def _items(finding: Finding, result: Result, asked: Regional, key: str) -> Iterator[Item]:
    """Yield what sets failing rows apart; nothing if all rows pass or all fail."""
    if "differences" not in finding.tables:
        return
    table = finding.tables["differences"]
    yield captioned(
        f"{key}-distances",
        _CAPTION,
        f"{column_in_words(table['statistic'])}.",
        figures.set_apart(table),
    )
    columns = {"statistic": "distance"}
    if np.isfinite(table["p"].to_numpy()).any():  # rows are independent draws
        columns |= {"p": "p", "p_holm": "p (Holm)"}
    ordered = table.sort_values("statistic", ascending=False, kind="stable")
    yield result_table(ordered, f"{text.SAME}.", columns)


REGIONAL = Kind(
    name="regional",
    schema=Regional,
    run=_run,
    title="Sensitivity: what sets failing runs apart",
    answers="how failing rows differ from passing ones",
    method=(
        "Regional sensitivity compares the values in failing and in passing runs (Spear and "
        "Hornberger 1980) by the test of Kolmogorov and Smirnov, choices by chi-square, exact over "
        "all tables with the same sums (Freeman and Halton 1951) or over draws of them where "
        "counts are small; p-values are adjusted for their number (Holm 1979)."
    ),
    sources=(SPEAR, FREEMAN, HOLM),
    needs_rows=True,
    items=_items,
)
