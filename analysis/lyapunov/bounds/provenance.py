"""What the proof's constants are: values with unit, provenance and the set that they hold over."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.errors import UsageError
from nlctl.host.notebook import table_html
from nlctl.names import unknown

from ...intervals.arithmetic import as_ball
from ...intervals.box import Box
from ...intervals.branch_and_bound import upper
from ..loop.roles import Parts
from .decomposition import Decomposition
from .final_bound import final_bound
from .sector import Sector
from .starts import Starts

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "FROM_STARTS",
    "Constant",
    "Constants",
    "Provenance",
    "Shown",
    "bound",
    "per_second",
]

FROM_STARTS = "all t, from the starts"
Provenance = Literal["proved", "computed", "sampled", "given", "undecided"]


@dataclass(frozen=True, kw_only=True)
class Constant:
    """A constant of the proof.

    Attributes
    ----------
    symbol : str
        As in the paper, ``"delta*"``.
    value : float
    unit : str
    provenance : {"proved", "computed", "sampled", "given", "undecided"}
        "proved": by interval branch and bound.  "computed": in closed form, from constants that
        are themselves in the table.  "sampled": from trajectories or a grid.  "given": a choice.
        "undecided": branch and bound found no bound, and the value is infinite.
    how : str
        Method, or formula.
    over : str
        Set for which it holds.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import Constant
    >>> given = Constant(symbol="tau", value=0.2, unit="1", provenance="given", how="", over="")
    >>> print(given.symbol, given.value, given.provenance)
    tau 0.2 given
    """

    symbol: str
    value: float
    unit: str
    provenance: Provenance
    how: str
    over: str


@dataclass(frozen=True, kw_only=True)
class Constants:
    """All constants of the proof for one loop and one box.

    ``constants["delta*"]`` is a value.  The bounds hold while the trajectory stays in the box.

    Attributes
    ----------
    entries : tuple of Constant
    parts : Parts
        The records that they belong to; ``parts.gains`` are the controller's gains.
    box : Box
    sector : Sector
    split : Decomposition
        Of the actuator.
    W : ndarray of shape (l,)
        The ideal weights that were chosen; empty without a network.

    Examples
    --------
    See `literal`.
    """

    entries: tuple[Constant, ...]
    parts: Parts
    box: Box
    sector: Sector
    split: Decomposition
    W: np.ndarray

    def __getitem__(self, symbol: str) -> float:
        for entry in self.entries:
            if entry.symbol == symbol:
                return entry.value
        raise unknown("constant", symbol, [entry.symbol for entry in self.entries])

    def C_0(self, Q: float = 0.0) -> float:  # noqa: N802
        """Return C_0 of (36) for Q = sup I(t), (33); infinite where alpha_1 = 0.

        Parameters
        ----------
        Q : float, optional
            Supremum of I(t), from 0 on.

        Returns
        -------
        float
            In the unit of V.
        """
        return bound(self["alpha_0"], self["alpha_1"], self["V(0)"], Q)

    def ultimate(self, limsup_I: float = 0.0) -> float:
        """Return the bound of limsup |r| that (34) gives for limsup I(t).

        Parameters
        ----------
        limsup_I : float, optional
            Limit superior of I(t).

        Returns
        -------
        float
            In the unit of r.
        """
        return bound(self["alpha_0"], self["alpha_1"], 0.0, limsup_I)

    def table(self) -> pd.DataFrame:
        """Return the constants as a table with one row each, indexed by symbol.

        Returns
        -------
        DataFrame
            Values with where they come from.
        """
        import pandas as pd

        return pd.DataFrame([vars(entry) for entry in self.entries]).set_index("symbol")

    def __str__(self) -> str:
        width = max(len(entry.symbol) for entry in self.entries)
        lines = [f"Constants over {self.box}"]
        lines += [
            f"  {e.symbol:<{width}}  {e.value:<10.6g} {e.unit:<7}  {e.provenance:<8}  {e.how}"
            for e in self.entries
        ]
        return "\n".join(lines)


def bound(alpha_0: float, alpha_1: float, V_0: float, Q: float) -> float:
    """C_0 rounded up; without decay there is no bound."""
    return upper(final_bound(as_ball(alpha_0), alpha_1, V_0, Q)) if alpha_1 > 0 else np.inf


def per_second(power: int) -> str:
    """The unit 1/s^power; x1, u and v count as pure numbers."""
    return "1" if power == 0 else "1/s" if power == 1 else f"1/s^{power}"


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What every certificate has and shows: what is proved in a sentence, and its constants.

    Attributes
    ----------
    name : str
        Of the loop.
    holds : bool
        Whether the bounds hold for all t >= 0 from the starts, proved.
    reason : str
        Why they hold, or what is missing.
    params : mapping
        Parameters of the proof that are not those of the loop as it stands.
    loop_facts : mapping
        What the loop consists of, see `nlctl.analysis.loop_record`.
    """

    name: str
    holds: bool
    reason: str
    params: Mapping[str, Any] = field(default_factory=dict, repr=False)
    loop_facts: Mapping[str, Mapping[str, str]] = field(default_factory=dict, repr=False)

    @property
    def bound(self) -> str:
        """The bound in words, of a certificate that holds."""
        raise NotImplementedError

    @property
    def examined(self) -> Any:
        """The loop as the proof has read it, with its starts and disturbance."""
        raise NotImplementedError

    @property
    def starts(self) -> Starts:
        """The initial states that the bounds hold for."""
        return self.examined.starts

    @property
    def disturbance(self) -> float:
        """Bound of what external inputs add to the plant's v."""
        return self.examined.disturbance

    @property
    def status(self) -> Literal["proved", "undecided"]:
        """Whether the bound is proved; a bound that is not is not refuted by that."""
        return "proved" if self.holds else "undecided"

    @property
    def missing(self) -> str:
        """What a proof would need; nothing if there is one."""
        return "" if self.holds else self.reason

    @property
    def claim(self) -> str:
        """What is proved, with the starts and inputs that it is about; or that nothing is."""
        added = f", whatever external inputs add up to {self.disturbance:.6g} to v"
        about = f"from {self.starts}{added if self.disturbance else ''}"
        lost = f"no bound is proved {about}, and none is refuted; undecided"
        return f"{self.bound} {about}" if self.holds else lost

    @property
    def constants(self) -> tuple[Constant, ...]:
        """Every constant of the proof; without the bounds if nothing is proved."""
        raise NotImplementedError

    @property
    def verdict(self) -> str:
        """What is proved, in a sentence."""
        return f"{self.claim}: {self.reason}"

    @as_annotated
    def save(self, file: str | os.PathLike[str]) -> Path:
        """Write the proof so that others can check it: rationals, boxes and the claim, as JSON.

        ``python -m nlctl.analysis.recheck FILE`` answers yes or no, with integer arithmetic of its
        own.  Bounds are rounded up, as a rule by less than a thousandth.
        """
        if not self.holds:
            raise UsageError(
                f"nothing is proved of '{self.name}' that could be saved: {self.reason}"
            )
        return self._saved(Path(file))

    def _saved(self, file: Path) -> Path:
        raise NotImplementedError

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
