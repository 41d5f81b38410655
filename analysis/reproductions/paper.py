"""A paper as a record: what it prints, where that was read, how it is computed, its runs."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl.attributes import described_record
from nlctl.diagrams import state_names
from nlctl.response import input_output_response

from ..metrics import Metric, over
from ..report.document import Item


@described_record(eq=False)
class PaperCase:
    """One run of one example."""

    key: str
    make: Callable[[], Any]  # Returns the diagram.
    times: np.ndarray  # (m,): Output times (s).
    inputs: Any = 0.0  # Of an open diagram.
    # Initial states by qualified name; the others start as their blocks say.
    start: Mapping[str, float] = field(default_factory=dict)
    rtol: float = 1e-8
    atol: float = 1e-10
    metrics: tuple[Metric, ...] = ()  # Numbers that are taken of its run.


@dataclass(frozen=True, kw_only=True, eq=False)
class PaperRun:
    """A simulated case: times (s), outputs and states by name, events, metrics by key."""

    case: Any  # A `PaperCase`, or what a paper derives from it.
    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    events: pd.DataFrame = field(default_factory=pd.DataFrame)
    metrics: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a signal by name."""
        return self.signals[name]


def simulate_case(case: PaperCase) -> PaperRun:
    """Simulate a case."""
    loop = case.make()
    response = input_output_response(
        loop, case.times, case.inputs, dict(case.start), rtol=case.rtol, atol=case.atol
    )
    outputs = np.reshape(response.outputs, (len(loop.output_labels), -1))
    states = np.reshape(response.states, (len(state_names(loop)), -1))
    signals = dict(zip(loop.output_labels, outputs, strict=True))
    signals |= dict(zip(state_names(loop), states, strict=True))
    time = np.asarray(response.time)
    metrics = numbers_of(case, time, signals)
    return PaperRun(case=case, time=time, signals=signals, events=response.events, metrics=metrics)


def numbers_of(
    case: PaperCase, time: np.ndarray, signals: Mapping[str, np.ndarray]
) -> dict[str, float]:
    """Return the metrics of a case by key, whatever simulated it."""
    return {m.key: m.function(*over(time, signals[m.signal], m.start, m.end)) for m in case.metrics}


def simulate_cases(
    cases: Sequence[PaperCase], done: Callable[[float], object] = lambda amount: None
) -> dict[str, PaperRun]:
    """Simulate cases by key, one after the other."""
    runs = {}
    for case in cases:
        runs[case.key] = simulate_case(case)
        done(1)
    return runs


PaperRuns = Mapping[str, PaperRun]
"""Simulated cases of a paper by key."""


@described_record
class PaperSource:
    """Where numbers of a paper were read."""

    key: str  # As statements name it.
    text: str  # What it is, so that another reader finds it.


@described_record
class Statement:
    """A number that is printed, and how it is computed from the runs."""

    claim: str  # The question that it answers, on the page one line with others that have the same.
    part: str  # Key of the part of the page that has it.
    case: str  # What was run, and what is read off it.
    quantity: str
    printed: str  # As printed.
    value: Callable[[PaperRuns], float]  # ``value(runs) -> float``.
    relation: str = "="  # How the value relates to it.
    tolerance: float = 0.0  # For "=", how far it may be off; of what is printed exactly, rounding.
    read: str = ""  # Key of its source; empty for what was computed independently.
    by: str = ""  # Who is refuted where it does not hold; empty for statements of ours.

    @property
    def asked(self) -> str:
        """What is printed, with its relation where that is a bound."""
        return f"{self.relation.strip('=')} {self.printed}".strip()


@dataclass(frozen=True, kw_only=True)
class FoundNumber:
    """A statement, and what was found."""

    statement: Statement
    value: float

    @property
    def error(self) -> float:
        """How far the value is from what is printed; of a bound, how far beyond."""
        apart = self.value - float(self.statement.printed)
        if self.statement.relation == "=":
            return abs(apart)
        beyond = apart if self.statement.relation == "≤" else -apart
        return beyond if beyond > 0 or math.isnan(beyond) else 0.0

    @property
    def holds(self) -> bool:
        """Whether that is within the tolerance; false for NaN."""
        return self.error <= self.statement.tolerance


@described_record(eq=False)
class PaperFigure:
    """A figure of the page, and how it is drawn from the runs."""

    key: str  # Its anchor.
    caption: str
    draw: Callable[[PaperRuns], MatplotlibFigure]
    # For those who cannot see it; ``description(runs) -> str`` for one with numbers.  The caption
    # where it is empty.
    description: str | Callable[[PaperRuns], str] = ""
    folded: bool = False  # Whether it stands behind a heading that is opened.


@described_record(eq=False)
class MovedLoop:
    """What the reader of a page that runs may move of an example."""

    make: Callable[[], Any]  # Returns the diagram, with faults that may be switched on.
    call: str  # The Python that makes it.
    until: float  # End of the run (s).
    step: float = 0.01  # Of its samples (s).
    # Sliders, see `nlctl.analysis.loop_report`; a sensible few where it is empty.
    names: tuple[str, ...] = ()
    signals: tuple[str | list[str], ...] = ()  # What is drawn, a row each; else all outputs.
    # What the page watches, as study files have it, and what it means.
    requirements: tuple[tuple[str, str], ...] = ()


@described_record(eq=False)
class Part:
    """One example of a paper on its page."""

    key: str  # Its anchor.
    title: str  # Its heading.
    make: Callable[[], Any]  # Returns the diagram.
    blocks: tuple[str, ...]  # Blocks whose equations stand on the page.
    number: str = ""  # In front of each equation; empty for none.
    picture: str = "The loop as simulated."  # Caption of the diagram.
    figures: tuple[PaperFigure, ...] = ()
    more: str = "More figures"  # Heading of the figures that are folded.
    # Name, as printed, as used, remark; the third is filled in from the blocks by name.
    parameters: tuple[tuple[str, str, str, str], ...] = ()
    # ``items(runs)``, what else stands behind its figures.
    items: Callable[[PaperRuns], Sequence[Item]] | None = None
    moved: MovedLoop | None = None  # What a page that runs moves.


@described_record(eq=False)
class Paper:
    """A paper whose examples are reproduced."""

    key: str  # ``author_year``, the name of its module in `nlctl.papers`.
    title: str  # Of the page.
    question: str  # What the page answers.
    citation: str  # Where the paper appeared.
    parts: tuple[Part, ...]
    cases: tuple[PaperCase, ...]  # What is simulated.
    statements: tuple[Statement, ...]
    reproduced: str  # In a few words each, for the table of papers and the verdict.
    not_reproduced: str
    heading: str = "What the paper has"  # Of the section that says what the paper has.
    model: tuple[Item, ...] = ()  # Its equations, as printed or as quoted.
    sources: tuple[PaperSource, ...] = ()  # What was read, next to the references.
    # What does not reproduce, what could not be read, and what is a choice of ours.
    open_points: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()  # Paragraphs, as those of a `Report`.
    limits: tuple[str, ...] = ()
    others_cited: tuple[str, ...] = ()  # Behind the paper itself, in the list of references.
    lead: PaperFigure | None = None  # The picture at the top.
    # Heading and caption of the tables of numbers.
    numbers_title: str = "{count} numbers, as printed or required, and as found"
    numbers_caption: str = (
        "What was read has the key of its source; what has none is required by us, or follows."
    )
    numbers_key: str = "numbers"  # Anchor of these tables, behind that of their part.
    asked: str = "printed or required"  # Column title of these tables.
    digits: str = ".6g"  # Format of the numbers found.
    command: str = ""  # What makes the page again; ``nlctl report KEY`` where it is empty.
    # Packages whose versions stand on the page next to those of every report.
    packages: tuple[str, ...] = ()
    # ``compose(folder, whole=, threads=, beside=, watch=, notify=)`` returns the page of a paper
    # that has more than its examples, as `nlctl.analysis.reproductions.page.Composed`.
    compose: Callable[..., Any] | None = None
    # ``clear(folder, force=)`` removes what an earlier page has left in its folder.
    clear: Callable[..., object] | None = None

    @property
    def references(self) -> tuple[str, ...]:
        """The paper, and what else its page cites."""
        return (self.citation, *self.others_cited)
