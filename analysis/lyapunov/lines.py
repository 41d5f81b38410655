"""Lines of the ledger: how a statement was judged, how that is known, and what follows."""

import dataclasses
from typing import Literal

import numpy as np

from nlctl.attributes import described_record
from nlctl.wording import counted

from ..intervals.box import Box
from .bounds.error_bounds import alpha_1
from .constants import Constants, Premises, forcing_bound, kappa, literal, premises
from .inequalities import inequalities
from .loop.instrumented import update_is_declared
from .loop.signals import Margin, Signals, inequality
from .loop.simulation import MemberRun
from .proofs.result import Provenance

LineStatus = Literal["proved", "computed", "checked", "violated", "not applicable", "undecided"]
RANK = {"violated": 0, "undecided": 1, "checked": 2, "computed": 3, "proved": 4}
KNOWN: dict[Provenance, LineStatus] = {
    "proved": "proved",
    "computed": "computed",
    "given": "checked",
    "sampled": "checked",
    "undecided": "undecided",
}
FOLLOWS = {
    "run": "the run ends there: no statement of the paper holds beyond.",
    "Omega": "the constants were proved on the box: beyond it none of them need hold.",
    "A1": "(2), (3) fail: delta* of (20) does not bound the actuator's error.",
    "A1 range": "the actuator's split is not proved there, and eps_u* need not hold.",
    "A2": "the disturbance is larger than declared: delta* of (20), C_0 of (36) are too small.",
    "A3": "the gain leaves its sector: (8) fails, G_max and the sign of k G are not as assumed.",
    "(10)": "eps* does not bound the network's error: delta* of (20) is too small.",
    "(1)": "the plant is not a chain of integrators with measured states: another plant.",
    "(yd)": "the reference's derivatives are not those of yd: (14), (15), (18) use others.",
    "(9)": "the plant is not x_n' = f(x, v) + d(x, t): the proof is about another plant.",
    "(14)": "r is not the filtered error of (14): (36) says nothing about e.",
    "(15)": "r' is not what (18) starts from: Y_d or the plant differs from the paper's.",
    "(26)": "the control law or zeta' is not that of (23), (24).",
    "(27)": "zeta' is not that of (24).",
    "(28)": "an adaptation law is not that of (25): W_hat or delta_hat need not stay bounded.",
    "(31)": "V need not decay: (32), (34), (36) do not follow.",
}
NEXT = "the steps that build on it do not follow along this run."
LITERAL = "A2", "(10)", "(18)", "(20)", "(22)", "(30)", "(31)", "(32)", "(36)"


@described_record(made_by="ledger")
class Line:
    """One line of the ledger."""

    key: str  # Number in the paper, or name of the assumption.
    statement: str  # What is claimed.
    # "proved" by interval arithmetic over the box; "computed" in closed form; "checked" at the
    # samples of the runs; "undecided" where a premise is infinite or cannot be decided.
    status: LineStatus
    least: float = np.nan  # Least margin along the runs; NaN where there is none.
    time: float = np.nan  # Its time (s).
    first: float = np.nan  # Time (s) of the first sample that violates it; NaN if none does.
    # x, r, u, v, zeta, delta_hat there.
    state: dict[str, float] = dataclasses.field(default_factory=dict)
    evidence: str = ""  # How it is known, and what a violation means for the paper's conclusion.
    follows: str = ""
    # "paper": as printed, or as the paper uses it.
    reading: Literal["corrected", "paper"] = "corrected"
    member: int = 0  # Number of the run.
    replay: str = ""  # Options of the command line that repeat that run.
    runs: int = 1  # Number of runs behind the line.

    def worse_of(self, other: "Line | None") -> "Line":
        """Return the line with the worse status, or the smaller least margin.

        Parameters
        ----------
        other : Line or None
            The same line of another member, if there is one.

        Returns
        -------
        Line
            One of the two.
        """
        if other is None or self._order < other._order:
            return self
        return other

    @property
    def _order(self) -> tuple[int, float]:
        return RANK.get(self.status, 5), self.least if not np.isnan(self.least) else np.inf

    def text(self, width: int) -> str:
        """Return the line for a plain table.

        Parameters
        ----------
        width : int
            Width of the column of keys.

        Returns
        -------
        str
            One line without its end.
        """
        least = "" if np.isnan(self.least) else f"{self.least:.5g}"
        where = "" if np.isnan(self.time) else f"at {self.time:.5g} s"
        since = "" if np.isnan(self.first) else f" (first at {self.first:.5g} s)"
        who = f", run {self.member}" if self.runs > 1 else ""
        note = "" if self.reading == "corrected" else " [as in the paper]"
        return (
            f"  {self.key:<{width}}  {self.status:<14}  {least:>11}  {where:<13}{who}  "
            f"{self.statement}{note}; {self.evidence}{since}"
        ).rstrip()


def run_line(run: MemberRun) -> Line:
    """Return the line on whether a run reached its horizon."""
    horizon, reached = float(run.member.times[-1]), float(run.signals.t[-1])
    lost = run.lost is not None
    return Line(
        key="run",
        statement=f"all signals stay finite over {horizon:g} s",
        status="violated" if lost else "checked",
        least=(reached if run.lost is None else run.lost) - horizon,
        time=run.lost if run.lost is not None else np.nan,
        state=run.signals.at(reached),
        evidence=run.message or "native run",
        follows=FOLLOWS["run"] if lost else "",
    )


def decay_line(run: MemberRun) -> Line:
    """Return the line on whether V decays: every rate of (31) is positive."""
    gains = run.gains
    rates = {"2 beta": 2 * gains.beta, "sigma_2 gamma": gains.sigma_2 * gains.gamma}
    if gains.W_hat_0:
        rates["sigma_1 Gamma"] = gains.sigma_1 * gains.Gamma
    least = min(rates, key=lambda name: rates[name])
    decays = alpha_1(gains) > 0
    return Line(
        key="decay",
        statement="alpha_1 = min{2 beta, sigma_1 Gamma, sigma_2 gamma} > 0",
        status="computed" if decays else "violated",
        least=alpha_1(gains),
        evidence=f"{least} = {rates[least]:.5g}",
        follows="" if decays else "alpha_0/alpha_1 is infinite: (32)-(36) bound nothing.",
    )


def assumption_lines(run: MemberRun, constants: Constants, u_max: float) -> list[Line]:
    """Return the lines of Assumptions 1 to 3, (10) and the compact set."""
    given = premises(constants, run.gains)
    how = constants.table()
    declared = update_is_declared(run.parts.roles.places["plant"])
    sources = {"A1": "eps_u*", "A2": "d*", "A3": "G_max", "(10)": "eps*"}
    lines = []
    for margin in assumptions(run.signals, given, constants.box, u_max):
        line = _line(margin, run.signals, "checked", "samples of the run")
        if margin.equation == "A1 range" and not np.isfinite(u_max):
            continue  # a split in closed form holds for all u
        if margin.equation in sources and line.status == "checked":
            row = how.loc[sources[margin.equation]]
            over = "the box" if row["over"].startswith("x1") else row["over"]
            line = dataclasses.replace(
                line, status=KNOWN[row["provenance"]], evidence=f"{row['how']}; over {over}"
            )
            if line.status == "proved" and margin.equation != "A1" and not declared:
                evidence = f"{line.evidence}; of f and d, which the update follows at the samples"
                line = dataclasses.replace(line, status="checked", evidence=evidence)
        if margin.equation == "Omega":
            line = dataclasses.replace(line, evidence=f"box {constants.box.how}")
        lines.append(line)
    return lines


def inequality_lines(run: MemberRun, constants: Constants) -> list[Line]:
    """Return the lines of the numbered inequalities, corrected and, where it fails, as printed."""
    given = premises(constants, run.gains)
    margins = [*inequalities(run.signals, given), *([run.reference] if run.reference else [])]
    lines = [
        _line(margin, run.signals, "checked", counted(margin.t.size, "sample"))
        for margin in margins
    ]
    lines = [_beyond_samples(line) for line in lines]
    return [*lines, *_literal_lines(run, constants, given)]


def _literal_lines(run: MemberRun, constants: Constants, given: Premises) -> list[Line]:
    """Return the lines that q cos(w t) enters, with it in g as the paper has it."""
    printed = literal(given, constants, run.parts.plant)
    if printed is None:
        return []
    premised = assumptions(run.signals, printed, constants.box, np.inf)
    lines = []
    for margin in (*premised, *inequalities(run.signals, printed)):
        if margin.equation not in LITERAL:
            continue
        samples = counted(margin.t.size, "sample")
        evidence = f"{100 * margin.share_violated:.3g} % of {samples} violate it"
        if margin.equation == "(10)":
            evidence += (
                f"; no network of x has an eps* below {forcing_bound(constants.parts.plant):.4g}"
            )
        line = _line(margin, run.signals, "checked", evidence)
        premise = f"d* = {printed.d:.4g}, eps* = {printed.eps:.4g}"
        lines.append(
            dataclasses.replace(
                line,
                key=f"{line.key} literal",
                statement=f"{line.statement}, q cos(w t) in g, {premise}",
                reading="paper",
            )
        )
    return lines


def _beyond_samples(line: Line) -> Line:
    """Return the line with what is known of it for all states, not at the samples only."""
    if line.key == "(29)" and line.status == "checked":
        proof = kappa()
        how = f"all r, {counted(proof.boxes, 'box', 'boxes')}"
        return dataclasses.replace(line, status="proved", evidence=how) if proof.holds else line
    if line.key == "Young" and line.status == "checked":
        return dataclasses.replace(line, status="computed", evidence="completing the square")
    return line


def _line(margin: Margin, signals: Signals, otherwise: LineStatus, evidence: str) -> Line:
    status: LineStatus = otherwise if margin.holds else "violated"
    if margin.kind == "inequality" and not np.isfinite(margin.margin).all():
        finite = np.isfinite(np.stack([signals["r"], signals["u"], signals["I"]])).all()
        status = "undecided" if finite else status
    return Line(
        key=margin.equation,
        statement=margin.statement,
        status=status,
        least=margin.least,
        time=margin.at,
        first=margin.first_violated,
        state=signals.at(margin.at),
        evidence=evidence,
        follows=FOLLOWS.get(margin.equation, NEXT) if status == "violated" else "",
    )


def assumptions(signals: Signals, given: Premises, box: Box, u_max: float) -> tuple[Margin, ...]:
    """Evaluate what the proof supposes, along a response of an observed loop."""
    t, split, u = signals.t, given.split, np.abs(signals["u"])
    eps_u = np.abs(split.eps_u(signals["u"], signals["v"]))
    psi = signals.vector("psi")[:, : given.W.size]
    error = np.abs(signals["g"] + given.forcing(t) - psi @ given.W)
    d, G = np.abs(signals["d"] - given.forcing(t)), signals["G"]
    sector = np.minimum(G - given.G_min, given.G_max - G)
    return (
        inequality("Omega", "x and v stay in the box", t, 0.0, _room(signals, box), 1.0),
        inequality("A1", "v = k u + eps_u, k_1 <= k <= k_2, |eps_u| <= eps_u*", t, eps_u,
                   split.eps_star),
        inequality("A1 range", "|u| stays where the split is proved", t, u, u_max),
        inequality("A2", "|d| <= d*", t, d, given.d),
        inequality("A3", "G_min <= F/v <= G_max, G_min > 0", t, 0.0,
                   np.minimum(sector, given.G_min), given.G_max),
        inequality("(10)", "|g - W^T psi| <= eps*", t, error, given.eps),
    )  # fmt: skip


def _room(signals: Signals, box: Box) -> np.ndarray:
    """Least distance to a face of the box, over half the side's length."""
    room = np.full(signals.t.size, np.inf)
    for name, (low, high) in zip(box.names, box.cell, strict=True):
        y, half = signals[name], 0.5 * (high - low) if np.isfinite(high - low) else 1.0
        distance = np.minimum(y - low, high - y) / (half if half > 0 else 1.0)
        room = np.minimum(room, distance)  # keeps NaN
    return room
