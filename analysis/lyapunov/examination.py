"""Runs of a loop and the constants that the proof has for them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import control as ct
import numpy as np

from nlctl import native
from nlctl.annotations import as_annotated
from nlctl.arguments import integer, one_of
from nlctl.attributes import described_record

from ..intervals.box import Box, visited_box
from .bounds.decomposition import Decomposition, decompose
from .constants import Constants, constants_of
from .loop import simulation
from .loop.instrumented import sharpest
from .loop.roles import read_parts

U_MAX = 60.0  # a split that is proved and not computed holds for |u| <= 2 U_MAX


@dataclass(frozen=True, kw_only=True)
class _Runs:
    """Runs of the members; more than one are repeated at each iteration, one after the other."""

    loop: ct.InterconnectedSystem
    members: Sequence[simulation.Member] = field(repr=False)
    split: Decomposition  # of the actuator
    max_steps: int = 2_000_000  # steps after which a run counts as lost

    def __iter__(self) -> Iterator[simulation.MemberRun]:
        if len(self.members) == 1:
            return iter([self.first])
        return simulation.observe(self.loop, self.members, self.split, self.max_steps)

    @cached_property
    def first(self) -> simulation.MemberRun:
        """The first run."""
        return next(simulation.observe(self.loop, self.members[:1], self.split, self.max_steps))


@described_record(made_by="ledger")
class Examination:
    """What the ledger and the conservatism are made of."""

    loop: ct.InterconnectedSystem
    runs: _Runs
    constants: Constants


@as_annotated
def examine(
    loop: ct.InterconnectedSystem,
    run: object = 20.0,
    *,
    box: Box | None = None,
    W: object = "tightest",
    k: tuple[float, float] | None = None,
    start: Mapping[str, Any] | None = None,
    params: Mapping[str, Any] | None = None,
    step: float = simulation.SAMPLING_INTERVAL,
    max_steps: int = 2_000_000,
) -> Examination:
    """Run a loop, observed, and find the constants of the proof.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        Of the blocks that `nlctl.paper.example_1` connects, with a Nussbaum law.
    run : float, control.TimeResponseData or sequence of them, optional
        Horizon (s), or responses of the loop, which are run again with what the proof needs.
    box : Box, optional
        The compact set, sides x1, ..., xn and v; by default what the runs visit, and a tenth.
    W : array_like or "tightest", optional
        Ideal weights; by default those with the smallest C_0.
    k : (k_1, k_2), optional
        Bounds of the actuator's gain, see `decompose`.
    start, params : mapping, optional
        Initial states and parameters by qualified name: a number, or an array with one entry per
        member of an ensemble.  The constants are those of the loop with the numbers; members are
        measured by them, with their own gains and their own V(0).
    step : float, optional
        Sampling interval (s).
    max_steps : int, optional
        Steps after which a run counts as lost.

    Returns
    -------
    Examination
        The loop, its runs, and the constants of the proof on the set that is used.

    Raises
    ------
    DiagramError
        If the loop is not one that the proof is about.
    DecompositionError
        If the actuator has no split (2).
    ParameterError, UnknownNameError
        If a run, a box or a name is refused.

    Examples
    --------
    See `ledger`.
    """
    max_steps = integer("examine", "max_steps", max_steps, at_least=1)
    if isinstance(W, str):
        one_of("examine", "W", W, ["tightest"])
    members = simulation.members_of(loop, run, step, start, params)
    fixed = _numbers(start), _numbers(params)
    if len(members) == 1:
        fixed = dict(members[0].start), dict(members[0].params)
    parts = read_parts(loop, *fixed)
    split = decompose(parts.actuator, k=k, u_max=U_MAX)
    runs = _Runs(loop=loop, members=members, split=sharpest(split), max_steps=max_steps)
    box = _visited(runs) if box is None else box
    proved = constants_of(parts, split, box, None if isinstance(W, str) else W)
    return Examination(loop=loop, runs=runs, constants=proved)


def compile_examination_ahead(loop: ct.InterconnectedSystem) -> None:
    """Compile the diagram that `examine` runs, which otherwise happens with the first run."""
    split = sharpest(decompose(read_parts(loop).actuator, u_max=U_MAX))
    native.compile_ahead(simulation.observed_loop(loop, split))


def _numbers(values: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return what is the same for all members."""
    return {k: v for k, v in (values or {}).items() if np.ndim(v) == 0 or isinstance(v, tuple)}


def _visited(runs: _Runs) -> Box:
    reached = []
    for run in runs:
        names = [n for n in run.signals.values if n == "v" or (n[:1] == "x" and n[1:].isdigit())]
        y = [np.array([np.min(run.signals[n]), np.max(run.signals[n])]) for n in names]
        ends = run.signals.t[[0, -1]]  # whatever lies in between does not count
        reached.append(ct.TimeResponseData(ends, np.array(y), output_labels=names, issiso=False))
    return visited_box(*reached)
