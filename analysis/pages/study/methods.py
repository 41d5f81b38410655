"""How a study was done, what it does not show, and the sources."""

from nlctl.wording import counted

from ...studies.result import Result
from .loop import Published

DONZE = (
    "A. Donzé, O. Maler: Robust satisfaction of temporal logic over real-valued signals. FORMATS "
    "2010, LNCS 6246, 92–106. doi 10.1007/978-3-642-15297-9_9."
)


def methods(result: Result, published: Published | None = None) -> tuple[list[str], list[str]]:
    """Return how a study was done, as paragraphs, and the sources that they name."""
    study = result.study
    first = (
        f"Each run is a simulation of {study.time.end:g} s by nlctl's compiled code of the "
        f"python-control diagram (rtol {study.solver.rtol:g}, atol {study.solver.atol:g}), sampled "
        f"every {study.time.step:g} s. Margins follow the quantitative semantics of signal "
        "temporal logic (Donzé and Maler 2010), with the peaks between samples taken from "
        "curves where the samples show that the signal is smooth."
    )
    if result.rows is not None and study.runs is not None:
        first += (
            f" The main table has {counted(result.rows.done, 'row')} (design: {study.runs.design})."
        )
    answered = [f.key for f in result.findings if f.is_answered]
    kinds = dict.fromkeys(result.asked[key].definition for key in answered)
    texts = [kind.method for kind in kinds if kind.method]
    sources = [text for kind in kinds for text in kind.sources]
    loop = [published.citation] if published else []
    return [first, *texts], list(dict.fromkeys([*loop, DONZE, *sources]))


def limits(result: Result) -> list[str]:
    """Return what a study does not show, as paragraphs."""
    study = result.study
    count = len(result.quantities)
    varied, law = "one quantity was", "law given there, which is assumed"
    if count > 1:
        varied = f"the {count} quantities listed above were"
        law = "laws given there, which are assumed, and taken to be independent of each other"
    texts = [
        f"Only {varied} varied, within the box given there unless an analysis says otherwise, and "
        f"by the {law}. Other laws were not examined.",
        f"Runs end at {study.time.end:g} s. Nothing follows for later times.",
        "All this was sampled, nothing is proved: a search that finds no violation does not show "
        "that there is none, and a bound of a probability is not a bound of a single run.",
        f"Signals were sampled every {study.time.step:g} s, so that what is faster is not seen, "
        f"and integrated to rtol {study.solver.rtol:g}. The model is taken to be the real loop.",
    ]
    if len(result.claims) > 1:
        texts.append(
            "Each bound and interval holds with its own confidence, unless it says otherwise; that "
            "all of them hold together is less likely."
        )
    return texts
