"""What a proof finds: whether it holds, on which set, and every constant with where it is from.

A certificate as a file that others check: rationals, boxes, and the claim, as JSON.

`nlctl.analysis.recheck` reads it, and knows nothing of what found it.  Bounds are written a little
wider than they were proved, so that plain interval arithmetic follows them, and nothing is written
that the recheck does not answer with yes.
"""

import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import UsageError
from nlctl.host.files import replace_file
from nlctl.host.notebook import table_html
from nlctl.plants import coordinate_names

from ...intervals.box import Box
from ...intervals.normal_form import exact
from ...intervals.paths import Undecided
from ...intervals.written import operations
from ...recheck import FORMAT, Refuted, proved_bounds, recheck, seal_of
from ...recheck.integers import text_below
from ..bounds.decomposition import Decomposition
from ..bounds.starts import Starts
from ..loop.checked import Acceleration

Content = dict[str, Any]


def save_certificate(
    path: str | os.PathLike[str], kind: str, name: str, attempts: Callable[[], Iterator[Content]]
) -> Path:
    """Write the first of some attempts that the recheck answers with yes."""
    why = "there is nothing to be written"
    try:
        for attempt in attempts():
            content = {
                "format": FORMAT[0],
                "version": FORMAT[1],
                "kind": kind,
                "loop": name,
                **attempt,
            }
            try:
                bounds = proved_bounds(content)
                content["claim"] = {k: str(_rounded_up(b)) for k, b in bounds.items()}
                content["seal"] = seal_of(content)
                recheck(content)
            except Refuted as error:
                why = str(error)
                continue
            text = f"{json.dumps(content, indent=1)}\n".encode()
            return replace_file(path, lambda file, text=text: file.write(text))
    except Undecided as error:
        why = f"{error}; the file holds arithmetic and a few functions only"
    raise UsageError(
        f"the certificate of '{name}' cannot be saved so that others can check it: {why}"
    )


def _rounded_up(bound: Fraction) -> Fraction:
    """Return a bound with ten digits or so."""
    digits = 10 ** max(10 - len(str(int(bound))), 0)
    return Fraction(-((-bound.numerator * digits) // bound.denominator), digits)


def texts(values: Iterable[Any]) -> list[str]:
    """Return finite numbers as exact texts."""
    return [str(exact(value)) for value in values]


def equation_content(acceleration: Acceleration, order: int) -> list[list[Any]]:
    """Return x_n' of a plant, in t, x1, ..., xn and v."""
    names = coordinate_names(order)
    return operations(
        ("t", *names, "v"), lambda s: acceleration(s["t"], [s[x] for x in names], s["v"])
    )


def split_content(split: Decomposition) -> Content:
    """Return the split of an actuator as a file has it."""
    endless = split.largest_u == float("inf")
    return {
        "k_1": str(exact(split.k_1)),
        "k_2": str(exact(split.k_2)),
        "eps": str(exact(split.eps_star)),
        "range": None if endless else str(exact(split.largest_u)),
    }


def starts_content(starts: Starts) -> Content:
    """Return the ends of all initial states that a proof depends on; not those that V bounds."""
    every = zip(starts.names, starts.low, starts.high, strict=True)
    bounded = ((name, ends) for name, *ends in every if all(map(math.isfinite, ends)))
    return {name: texts(ends) for name, ends in bounded if name not in starts.kept}


FROM_STARTS = "all t, from the starts"
Provenance = Literal["proved", "computed", "sampled", "given", "undecided"]
Row = tuple[str, Any, str, Any, str, str]  # the fields of a Constant in their order


@described_record
class Constant:
    """A constant of the proof.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import Constant
    >>> given = Constant(symbol="tau", value=0.2, unit="1", provenance="given", how="", over="")
    >>> print(given.symbol, given.value, given.provenance)
    tau 0.2 given
    """

    symbol: str  # As in the paper, ``"delta*"``.
    value: float
    unit: str
    # "proved": by interval branch and bound. "computed": in closed form, from constants that are
    # themselves in the table. "sampled": from trajectories or a grid. "given": a choice.
    # "undecided": branch and bound found no bound, and the value is infinite.
    provenance: Provenance
    how: str  # Method, or formula.
    over: str  # Set for which it holds.


def constants_of_rows(rows: Iterable[Row]) -> tuple[Constant, ...]:
    """Return the constants of a table."""
    return tuple(
        Constant(symbol=s, value=float(v), unit=per, provenance=p, how=how, over=where)
        for s, v, per, p, how, where in rows
    )


def rows_of_split(split: Decomposition) -> Iterator[Row]:
    """Yield the constants of an actuator's split."""
    for symbol, value in (("k_1", split.k_1), ("k_2", split.k_2), ("eps_u*", split.eps_star)):
        yield symbol, value, "1", split.provenance, split.how, split.over


def per_second(power: int) -> str:
    """The unit 1/s^power; x1, u and v count as pure numbers."""
    return "1" if power == 0 else "1/s" if power == 1 else f"1/s^{power}"


@described_record(made_by="certify")
class ProofResult:
    """What every proof finds."""

    holds: bool  # Whether it is proved; a statement that is not is not refuted by that.
    reason: str  # Why it holds, or what is missing.
    boxes: int  # Boxes that were examined.
    arithmetic: str  # What proved it.
    seconds: float = field(repr=False, compare=False)

    @property
    def claim(self) -> str:
        """What is proved, of which set, in words; or that nothing is."""
        raise NotImplementedError

    @property
    def status(self) -> Literal["proved", "undecided"]:
        """Whether it is proved."""
        return "proved" if self.holds else "undecided"

    @property
    def missing(self) -> str:
        """What a proof would need; nothing if there is one."""
        return "" if self.holds else self.reason

    @property
    def verdict(self) -> str:
        """What is proved, and why, in a sentence."""
        return f"{self.claim}: {self.reason}"


@described_record(made_by="certify")
class Certificate(ProofResult):
    """What `certify` proved: bounds of a loop for all time, from a set of starts.

    Each kind of proof adds its own constants and bounds; these are infinite if nothing is proved.
    """

    kind: str  # The kind of proof, as its file and the recheck call it.
    name: str  # Of the loop.
    starts: Starts = field(repr=False)  # The initial states that the bounds hold for.
    disturbance: float  # Bound of what external inputs add to the plant's v.
    split: Decomposition = field(repr=False)  # Of the actuator.
    region: Any = field(repr=False)  # The box of the last step, and what was proved on it.
    # Bounds, each of what the box of the one before implies: the iteration that closed or was given
    # up.
    iterations: tuple[float, ...]
    # Parameters of the proof that differ from those of the loop.
    params: Mapping[str, Any] = field(repr=False)
    # What the loop consists of, see `nlctl.analysis.loop_record`.
    loop_facts: Mapping[str, Mapping[str, str]] = field(repr=False)

    def _bound(self) -> str:
        """Return the bound in words, of a certificate that holds."""
        raise NotImplementedError

    def _rows(self) -> Iterator[Row]:
        """Yield every constant of the proof, and the bounds if there are some."""
        raise NotImplementedError

    def _attempts(self) -> Iterator[Content]:
        """Yield premises and proof for a file, with more and more room."""
        raise NotImplementedError

    @property
    def box(self) -> Box:
        """What the signals of the proof stay in."""
        return self.region.box

    @property
    def C(self) -> float:  # noqa: N802
        """The bound that is not reached: it gives the box."""
        return self.region.C

    @property
    def assumptions(self) -> str:
        """From where, and with which external inputs, the bounds hold."""
        added = f", whatever external inputs add up to {text_below(self.disturbance)} to v"
        return f"from {self.starts}{added if self.disturbance else ''}"

    @property
    def claim(self) -> str:
        """What is proved, with the starts and inputs that it is about; or that nothing is."""
        if self.holds:
            return f"{self._bound()} {self.assumptions}"
        return f"no bound is proved {self.assumptions}, and none is refuted; undecided"

    @property
    def constants(self) -> tuple[Constant, ...]:
        """Every constant of the proof; without the bounds if nothing is proved."""
        return constants_of_rows(self._rows())

    @property
    def _sure(self) -> Provenance:
        """What is known of a constant that the actuator's split enters."""
        return "given" if self.split.provenance == "given" else "proved"

    @as_annotated
    def save(self, file: str | os.PathLike[str]) -> Path:
        """Write the proof so that others can check it: rationals, boxes and the claim, as JSON.

        ``python -m nlctl.analysis.recheck FILE`` answers yes or no, with integer arithmetic of its
        own.  Bounds are rounded up, as a rule by less than a thousandth.

        Parameters
        ----------
        file : str or Path
            A file of that name is replaced.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        UsageError
            If nothing is proved, or the recheck would not follow it: equations with tables or
            comparisons are not written.
        """
        if not self.holds:
            raise UsageError(
                f"nothing is proved of '{self.name}' that could be saved: {self.reason}"
            )
        return save_certificate(Path(file), self.kind, self.name, self._attempts)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        columns = ("symbol", "value", "unit", "status", "how", "for")
        rows = [(c.symbol, c.value, c.unit, c.provenance, c.how, c.over) for c in self.constants]
        return table_html(self.verdict, columns, rows)

    def __str__(self) -> str:
        width = max(len(c.symbol) for c in self.constants)
        rows = [
            f"  {c.symbol:{width}} {c.value:<11.6g} {c.provenance:9} {c.how}; {c.over}"
            for c in self.constants
        ]
        return "\n".join([self.verdict, *rows])
