"""What a kind of analysis is: one record, from its table in a study file to its part of the page.

nlctl's own kinds are the modules of `nlctl.analysis.studies.kinds`.  A kind of one's own is a
`Kind` in a file next to the study, or in an installed package; a study names it as it names its
loop::

    [[analysis]]
    kind = "spread.py:spread"     # or "module:spread"
    of = "late_rms"

Everything that a study does with an analysis (reading its table, checking it against the loop,
planning, running, claiming, drawing) it asks of this record and of nothing else.
"""

import functools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
import pandas as pd
from pydantic import create_model

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import ParameterError, UsageError

from ..report.document import Item
from ..robustness import Design, Experiment, Prepared, Space
from ..robustness.runs.progress import Progress
from ..robustness.runs.sweep import Sweep
from .file.schema import Asked, Study
from .result import Finding, Result

_NAME = re.compile(r"[a-z][a-z0-9]*([ -][a-z0-9]+)*")


class RunDesign(Protocol):
    """Runs a design, of the study's own loops by default, into the folder of the analysis."""

    def __call__(self, design: Design, of: Prepared | None = None) -> Sweep: ...


@described_record(eq=False)
class Setup:
    """What is known before anything runs.

    Examples
    --------
    What Morris' screening takes is known before anything runs: with r trajectories of k quantities
    r (k + 1) simulations.

    >>> from nlctl.analysis.studies import read_study, shipped
    >>> setup = read_study(shipped("example-1-quick"))
    >>> (asked,) = [asked for asked in setup.study.analysis if asked.kind == "morris"]
    >>> asked.trajectories, len(setup.experiment.space.names)
    (4, 5)
    >>> asked.definition.planned(asked, setup)
    24
    """

    study: Study
    folder: Path  # What paths in the study are relative to.
    experiment: Experiment  # What is simulated for each row.


@described_record(eq=False, made_by="Kind")
class Ground(Setup):
    """What an analysis uses while it runs."""

    prepared: Prepared  # The study's experiment.
    rows: Sweep | None  # The main table, with its design.
    # Runs rows here, see `nlctl.analysis.robustness.search.evaluation.Evaluate`; what a table
    # leaves out is nominal.
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
        """Return the space, or the part of it with these quantities, named as in the file.

        Parameters
        ----------
        names : sequence of str, optional
            Quantities; by default the whole space.

        Returns
        -------
        Space
            Without choices where names are given.
        """
        whole = self.prepared.experiment.space
        if not names:
            return whole
        by_name = dict(zip(self.study.space, whole.quantities, strict=True))
        return replace(whole, quantities=tuple(by_name[name] for name in names), choices=())


def _nothing(asked: object, setup: Setup) -> int:
    return 0


def _no_items(finding: Finding, result: Result, asked: object, key: str) -> Iterator[Item]:
    yield from ()


@described_record(eq=False)
class Kind:
    """A kind of analysis.

    The first argument ``asked`` of its functions is an instance of `schema`.  What they refuse they
    refuse with a `nlctl.errors.UsageError`, which costs this analysis and no other one.

    Raises
    ------
    ParameterError
        If a name is not a name, or the schema no schema.

    Examples
    --------
    A file ``failures.py`` next to the study has the kind, and the study names it.  A lag with
    T = 0.5 s is at 1 - exp(-2) = 0.86 after 1 s, so that one corner of the box fails:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.studies import read_study, run
    >>> code = '''
    ... from nlctl.analysis.studies import Asked, Kind, finding_of
    ...
    ... class Failures(Asked):
    ...     pass
    ...
    ... def count(asked, ground):
    ...     design, margins = ground.main
    ...     found = int((margins <= 0).sum())
    ...     sentence = f"{found} of {design.size} rows fail."
    ...     return finding_of(asked, sentence, numbers={"failing": found})
    ...
    ... failures = Kind(
    ...     name="failures", schema=Failures, run=count, title="Failing rows", needs_rows=True
    ... )
    ... '''
    >>> text = '''
    ... loop = "nlctl:block"
    ... options = { spec = { block = "Lag" }, name = "lag" }
    ... study = { title = "A lag", seed = 1 }
    ... space."lag.T" = { bounds = [0.05, 0.5] }
    ... inputs.u = 1.0
    ... spec.rises = "always from 1 s on v >= 0.9"
    ... time = { end = 1.2, step = 0.1 }
    ... runs.design = "corners"
    ... analysis = [{ kind = "failures.py:failures" }]
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "failures.py").write_text(code, encoding="utf-8")
    ...     _ = Path(folder, "lag.toml").write_text(text, encoding="utf-8")
    ...     result = run(read_study(Path(folder, "lag.toml")), Path(folder, "run"))
    >>> result["failures"].sentence, result["failures"].numbers
    ('1 of 2 rows fail.', {'failing': 1})
    """

    name: str  # As in a study file: lower-case words.
    # The keys of its table, each with a description, as a pydantic model; its property ``claim`` is
    # what the study claims with them.
    schema: type[Asked]
    # ``run(asked, ground)`` returns a `Finding` (`finding_of`); None if its rows are incomplete.
    run: Callable[[Any, Ground], Finding | None]
    title: str  # Its heading in the report.
    # What it answers, and what it claims under which keys, in Markdown, for the guide.
    answers: str = ""
    claims: str = ""
    method: str = ""  # How it is done, for the report; with sources by author and year.
    sources: tuple[str, ...] = ()  # These sources in full.
    needs_rows: bool = False  # Whether it looks at the main table.
    # Whether it bounds a probability from the main table, which needs independent draws; its
    # numbers have ``runs`` and ``confidence``.
    is_statement: bool = False
    # ``stop(asked, design)`` returns what ends the main table early, where no other analysis needs
    # it; see `nlctl.analysis.robustness.runs.sweep`.
    stop: Callable[[Any, Design], Callable[[Progress], Any]] | None = None
    # Keys of its table that name a column of its rows, quantities of the space, a keyword of the
    # loop: they are checked before anything runs.
    columns: tuple[str, ...] = ()
    quantities: tuple[str, ...] = ()
    keywords: tuple[str, ...] = ()
    # ``check(asked, setup)`` raises what else does not fit the loop.
    check: Callable[[Any, Setup], object] | None = None
    # ``design(asked, space, seed)`` returns the rows that it runs itself, where they are known.
    design: Callable[[Any, Space, int], Design] | None = None
    # ``runs(asked, setup)`` returns how many simulations it makes itself, at most; with `design`
    # that is the number of its rows.
    runs: Callable[[Any, Setup], int] = _nothing
    ends_early: bool = False  # Whether it may make fewer.
    keeps_rows: bool = True  # Whether they stay on the disk.
    # ``largest(asked, quantities)`` returns the largest number that it asks for, from the table
    # alone: what no machine can do is refused.
    largest: Callable[[Any, int], int] | None = None
    # ``experiment(asked, setup)`` returns what its rows are run with, where that is not the study's
    # own experiment.
    experiment: Callable[[Any, Setup], Experiment] | None = None
    # ``measured(finding, asked)`` returns ``measured``, ``limit`` and ``margin`` of the table of
    # claims as texts; by default what was found, in a sentence.
    measured: Callable[[Finding, Any], Mapping[str, str]] | None = None
    # ``items(finding, result, asked, key)`` yields figures and tables; keys of figures begin with
    # `key`.
    items: Callable[[Finding, Result, Any, str], Iterator[Item]] = _no_items
    in_brief: bool = False  # Whether these are also shown where a study is only a part of a report.
    # ``witness(finding)`` returns the row with the lowest margin that it found, and that margin.
    witness: Callable[[Finding], tuple[Mapping[str, Any], float]] | None = None

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ParameterError(
                f"Kind needs a name of lower-case words and digits, got {self.name!r}"
            )
        if not (isinstance(self.schema, type) and issubclass(self.schema, Asked)):
            raise ParameterError(
                f"Kind needs a schema that is a subclass of Asked, got {self.schema!r} "
                f"(kind '{self.name}')"
            )
        for key in (*self.columns, *self.quantities, *self.keywords):
            if key not in self.schema.model_fields:
                raise ParameterError(
                    f"Kind needs columns, quantities and keywords that are keys of its schema, got "
                    f"'{key}' (kind '{self.name}')"
                )

    def planned(self, asked: object, setup: Setup) -> int:
        """Return how many simulations an analysis makes itself, at most.

        Parameters
        ----------
        asked : object
            The analysis as the study file asks for it.
        setup : Setup
            What it will run on.

        Returns
        -------
        int
            0 where it only reads what was run.
        """
        if self.design is not None:
            return self.design(asked, setup.experiment.space, 0).size
        return self.runs(asked, setup)


@functools.cache
def tagged(kind: Kind, tag: str) -> type[Asked]:
    """Return the schema of a kind under the name that a study file calls it by."""
    name: Any = Literal[tag]  # type: ignore[valid-type]
    model: Any = create_model(
        kind.schema.__name__,
        __base__=kind.schema,
        __doc__=kind.schema.__doc__,
        __module__=kind.schema.__module__,
        kind=(name, ...),
    )
    model.definition = kind
    return model


def column(rows: Sweep, name: str) -> np.ndarray:
    """Return one column of a sweep."""
    return rows.columns(name)[name].to_numpy()


@as_annotated
def finding_of(asked: Asked, sentence: str, **parts: Any) -> Finding:
    """Return a finding, whose key and title are filled in when it is kept.

    Parameters
    ----------
    asked : Asked
        What the study file asks of the analysis.
    sentence : str
        What was found.
    **parts : object
        Other fields of `Finding`: ``runs``, ``numbers``, ``tables``, and ``answer`` and ``needs``
        where `asked` claims something.

    Returns
    -------
    Finding
        To be returned by the kind's `run`.

    Examples
    --------
    >>> from nlctl.analysis.studies import Asked, finding_of
    >>> asked = Asked(kind="spread")
    >>> found = finding_of(asked, "The spread is 0.5.", runs=100, numbers={"spread": 0.5})
    >>> found.kind, found.numbers["spread"], found.holds
    ('spread', 0.5, None)
    >>> claimed = finding_of(asked, "The spread is 0.5.", claim="at most 1", answer="shown")
    >>> claimed.holds, claimed.outcome
    (True, 'shown')
    """
    parts = {"claim": asked.claim} | parts
    return Finding(key="", kind=asked.kind, title="", sentence=sentence, **parts)


def unanswered(asked: Asked, error: UsageError, runs: int = 0) -> Finding:
    """Return what replaces an analysis that its `runs` or the loop do not admit."""
    # What the study claims of it is neither shown nor refuted.
    return finding_of(
        asked,
        f"Not answered: {error}.",
        claim=asked.claim or "the analysis has an answer",
        answer="not shown yet",
        needs=f"an answer: {error}",
        runs=runs,
        is_answered=False,
    )


def headed(key: str, asked: Asked, finding: Finding) -> Finding:
    """Return a finding with its key, and with the heading that the study or the key gives it."""
    return replace(finding, key=key, title=asked.title or key.replace("-", " ").capitalize())
