"""The proof as a ledger: what holds of a loop, how that is known, and what does not follow."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import UnknownKeywordError
from nlctl.host.notebook import table_html
from nlctl.names import unknown
from nlctl.wording import counted

from ..json_values import as_json
from ..loop_record import loop_facts
from .conclusions import conclusions, slow_drift_of
from .constants import Constants, premises
from .examination import U_MAX, Examination, examine
from .inequalities import terms
from .lines import Line, assumption_lines, decay_line, inequality_lines, run_line
from .loop.signals import peak_by_rates
from .nussbaum.slow_drift import SlowDrift

if TYPE_CHECKING:
    import pandas as pd

# what `examine` takes by name
_SETTINGS = ("box", "W", "k", "start", "params", "step", "max_steps")


@described_record(made_by="ledger")
class Ledger:
    """Assumptions and inequalities of the proof for one loop, one line each."""

    loop: str  # Name of the diagram.
    # What the diagram consists of, see `nlctl.analysis.loop_record`.
    loop_facts: Mapping[str, Mapping[str, str]] = field(repr=False)
    lines: tuple[Line, ...]
    constants: Constants
    horizon: float  # Length of the longest run (s).
    members: int  # Number of runs.
    Q: float  # sup I(t) of (33) and max |r|, over all runs.
    max_r: float
    slow_drift: SlowDrift | None  # Of the first run, if it is long enough.

    @property
    def violated(self) -> tuple[Line, ...]:
        """Corrected statements that do not hold."""
        return tuple(x for x in self.lines if x.status == "violated" and x.reading == "corrected")

    @property
    def failing(self) -> tuple[Line, ...]:
        """Statements of the paper, as they are printed or used there, that do not hold."""
        return tuple(x for x in self.lines if x.status == "violated" and x.reading == "paper")

    @property
    def undecided(self) -> tuple[Line, ...]:
        """Corrected statements that are neither found to hold nor violated."""
        return tuple(x for x in self.lines if x.status == "undecided" and x.reading == "corrected")

    @property
    def holds(self) -> bool | None:
        """Whether all corrected statements hold; None if one is undecided and none violated."""
        return {"holds": True, "violated": False}.get(self.answer)

    @property
    def answer(self) -> str:
        """Of all corrected statements: "violated" if one is, else "undecided" if one is, else
        "holds"."""
        return "violated" if self.violated else "undecided" if self.undecided else "holds"

    @property
    def tally(self) -> str:
        """How many corrected statements hold, of how many, and how many are undecided."""
        corrected = [x for x in self.lines if x.reading == "corrected"]
        kept = len(corrected) - len(self.violated) - len(self.undecided)
        open_ones = f", {len(self.undecided)} undecided" if self.undecided else ""
        return f"{kept} of {len(corrected)}{open_ones}"

    def __getitem__(self, key: str) -> Line:
        for line in self.lines:
            if line.key == key:
                return line
        raise unknown("line", key, [line.key for line in self.lines], "of the ledger")

    def table(self) -> pd.DataFrame:
        """Return the lines as a table, indexed by key.

        Returns
        -------
        DataFrame
            One row each, the fields of `Line` as columns.
        """
        import pandas as pd

        return pd.DataFrame([dataclasses.asdict(line) for line in self.lines]).set_index("key")

    def to_json(self) -> str:
        """Return the ledger as JSON; numbers that are not finite become null.

        Returns
        -------
        str
            With the verdict, the constants and all lines.
        """
        return json.dumps(
            as_json(
                {
                    "loop": self.loop,
                    "holds": self.holds,
                    "answer": self.answer,
                    "horizon": self.horizon,
                    "members": self.members,
                    "Q": self.Q,
                    "C_0": self.constants.C_0(self.Q),
                    "max_r": self.max_r,
                    "constants": [dataclasses.asdict(c) for c in self.constants.entries],
                    "lines": [dataclasses.asdict(line) for line in self.lines],
                },
                null=True,
            ),
            allow_nan=False,
            indent=1,
        )

    def _repr_html_(self) -> str:
        """What a notebook shows: each line with its status."""
        columns = ("line", "status", "statement", "least margin", "at (s)", "evidence")
        rows = [(x.key, x.status, x.statement, x.least, x.time, x.evidence) for x in self.lines]
        return table_html(str(self).splitlines()[0], columns, rows)

    def __str__(self) -> str:
        runs = counted(self.members, "run")
        head = f"Ledger of '{self.loop}', {runs} over {self.horizon:g} s, {self.constants.box}"
        width = max(len(line.key) for line in self.lines)
        rows = [head, *(line.text(width) for line in self.lines)]
        meaning: dict[str, list[str]] = {}
        for line in self.lines:
            if line.follows:
                meaning.setdefault(line.follows, []).append(line.key)
        rows += [f"  {', '.join(keys)}: {follows}" for follows, keys in meaning.items()]
        return "\n".join(rows)


@as_annotated
def ledger(
    loop: ct.InterconnectedSystem | Examination, run: object = 20.0, **settings: Any
) -> Ledger:
    """Check the proof's assumptions and inequalities for a loop, line by line.

    Parameters
    ----------
    loop : control.InterconnectedSystem or Examination
        A loop, or what `examine` found.
    run : float, control.TimeResponseData or sequence of them, optional
        Horizon (s), or responses of the loop.
    **settings : object
        box, W, k, start, params, step, max_steps: as for `examine`.

    Raises
    ------
    DiagramError, DecompositionError, ParameterError, UnknownNameError
        As `examine` does.

    Examples
    --------
    Without the network, which leaves little to be bounded, over a fifth of a second:

    >>> from nlctl.analysis.lyapunov import examine, ledger
    >>> controller = nlctl.controllers.ablations(nlctl.adaptive_neural(2))["no network"]
    >>> found = examine(nlctl.paper.example_1(controller=controller), 0.2)
    >>> book = ledger(found)
    >>> status = {line.key: line.status for line in book.lines}
    >>> status["A2"], status["(31)"], status["Lemma 1"]
    ('proved', 'checked', 'violated')
    >>> found.constants["d*"] < 5.3  # of q cos(w t) and 0.1 |x|^2 sin t
    True
    """
    for name in settings:
        if name not in _SETTINGS:
            raise unknown("setting", name, _SETTINGS, "of ledger", UnknownKeywordError)
    study = loop if isinstance(loop, Examination) else examine(loop, run, **settings)
    return _assembled(study)


def _assembled(study: Examination) -> Ledger:
    """Merge the lines of all runs: of each the worst."""
    merged: dict[str, Line] = {}
    loop, constants = study.loop, study.constants
    Q, max_r, horizon, count = -np.inf, 0.0, 0.0, 0
    for number, run in enumerate(study.runs):
        limit = 2 * U_MAX if constants.split.provenance == "proved" else np.inf
        lines = [
            run_line(run),
            decay_line(run),
            *assumption_lines(run, constants, limit),
            *inequality_lines(run, constants),
            *conclusions(loop, run, constants),
        ]
        for line in lines:
            replayed = dataclasses.replace(line, member=number, replay=run.member.options)
            merged[line.key] = replayed.worse_of(merged.get(line.key))
        Q = float(np.maximum(Q, np.max(run.signals["I"])))
        x = terms(run.signals, premises(constants, run.gains))
        max_r = float(np.maximum(max_r, peak_by_rates(run.signals.t, x.r, x.r_rate)))
        horizon, count = max(horizon, float(run.signals.t[-1])), count + 1
    lines = tuple(dataclasses.replace(line, runs=count) for line in merged.values())
    return Ledger(
        loop=str(loop.name),
        loop_facts=loop_facts(loop),
        lines=lines,
        constants=constants,
        horizon=horizon,
        members=count,
        Q=Q,
        max_r=max_r,
        slow_drift=slow_drift_of(study.runs.first)[0],
    )
