"""How far a sweep is, and when it has seen enough."""

import time
from bisect import insort
from collections.abc import Callable, Iterator

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import fraction
from nlctl.attributes import described_record

from ..statistics.guarantee import check_iid, checked_confidence
from ..statistics.sequential import SequentialTest, decision, sequence_bounds
from ..stl.spec import violates
from ..uncertainty.design import Design


@described_record
class Progress:
    """How far a sweep is.

    Examples
    --------
    What `sweep` calls its argument `progress` with, here after 300 of 1000 rows:

    >>> from nlctl.analysis.robustness import Progress
    >>> now = Progress(done=300, total=1000, runs=300, violations=0, rate=100.0, is_iid=True)
    >>> now.remaining  # 700 rows at 100 a second
    7.0
    >>> low, high = now.interval(confidence=0.99)
    >>> low, 0.015 < high < 0.05  # wider than 1 - 0.01^(1/300), which may be inspected once only
    (0.0, True)
    """

    done: int  # Rows that are finished, and all rows of the design.
    total: int
    # Rows from the first one on without a gap whose margins are known, and how many of them violate
    # the spec. (Which rows end first may depend on whether they violate, so that rows beyond a gap
    # do not count yet.)
    runs: int
    violations: int
    rate: float  # Rows per second since the sweep was started or resumed.
    is_iid: bool  # Whether the rows are independent draws.

    @property
    def remaining(self) -> float:
        """Time (s) that the rest takes at this rate."""
        return (self.total - self.done) / self.rate if self.rate > 0 else np.inf

    @as_annotated
    def interval(self, confidence: float = 0.99) -> tuple[float, float] | None:
        """Return bounds of the probability of a violation that may be inspected at any time.

        See `sequential.sequence_bounds`.

        Parameters
        ----------
        confidence : float, optional
            That they hold at every moment, between 0 and 1.

        Returns
        -------
        tuple of float or None
            Lower and upper; None without a run, and for rows that are not independent draws.
        """
        if not (self.is_iid and self.runs):
            return None
        return sequence_bounds(self.violations, self.runs, confidence)


class Tally:
    """Counts of the rows that are finished; chunks may come in any order."""

    def __init__(self, design: Design) -> None:
        self.design = design
        self.ranges: list[range] = []
        self.done = self.runs = self.violations = 0
        self._beyond: dict[int, tuple[int, int]] = {}  # first row: (rows, violations)
        self.restart()

    def restart(self) -> None:
        """Count the rate from here."""
        self._before, self._begin = self.done, time.perf_counter()

    def count(self, numbers: range, margins: np.ndarray) -> None:
        """Take a chunk's margins ``spec`` in."""
        insort(self.ranges, numbers, key=lambda done: done.start)
        self.done += len(numbers)
        self._beyond[numbers.start] = len(numbers), int(np.count_nonzero(violates(margins)))
        while self.runs in self._beyond:
            runs, violations = self._beyond.pop(self.runs)
            self.runs += runs
            self.violations += violations

    def missing(self, chunk: int) -> Iterator[range]:
        """Yield the rows that were not counted when this was called, at most `chunk` at a time."""
        place, gaps = 0, []
        for numbers in (*self.ranges, range(self.design.size, self.design.size)):
            gaps.append(range(place, numbers.start))
            place = numbers.stop
        return (gap[i : i + chunk] for gap in gaps for i in range(0, len(gap), chunk))

    def progress(self, unfinished: int = 0) -> Progress:
        """Return how far the sweep is, with rows that are done in a chunk that is not."""
        done, elapsed = self.done + unfinished, time.perf_counter() - self._begin
        return Progress(
            done=done,
            total=self.design.size,
            runs=self.runs,
            violations=self.violations,
            rate=(done - self._before) / elapsed if elapsed > 0 else 0.0,
            is_iid=self.design.is_iid,
        )


@as_annotated
def until_decided(
    design: Design, threshold: float, confidence: float = 0.99
) -> Callable[[Progress], SequentialTest | None]:
    """Return a condition that stops a sweep once it is decided on which side a probability lies.

    It looks after every chunk: the confidence sequence of `sequential.decide` holds at all numbers
    of runs at once, so also at these.  The decision is wrong with probability at most
    1 - confidence.

    Parameters
    ----------
    design : Design
        The independent draws that are swept.
    threshold : float
        Probability of a violation.
    confidence : float, optional
        That the decision is right, between 0 and 1.

    Returns
    -------
    callable
        For the argument `stop` of `sweep`.

    Raises
    ------
    NoGuaranteeError
        If the rows are no independent draws.
    ParameterError
        If the threshold is not between 0 and 1, or the confidence is none.

    Examples
    --------
    See `sweep`.
    """
    check_iid(design)
    checked_confidence(confidence)
    fraction("a test", "threshold", threshold)

    def condition(progress: Progress) -> SequentialTest | None:
        if not progress.runs:
            return None
        test = decision(design, progress.violations, progress.runs, threshold, confidence)
        return None if test.decision == "undecided" else test

    return condition
