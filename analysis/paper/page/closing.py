"""The end of the paper's report: on computers, rivals, what is open, numerics, limits."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ...report.document import Figure, Paragraph, Section, Table
from ...reproductions.paper import PaperRun
from .. import HORIZON, METRICS, TAIL
from ..figures import SAMPLED_CONTROLLERS, sampling_errors
from ..rivals import KNOWLEDGE, RIVAL_ACTUATORS, beaten_by, failed_text
from ..sampling_limits import BAND, PEAK, QUANTITIES, Quantity, spec_ends


def rivals_section(record: pd.DataFrame) -> Section:
    """Return the section on the paper's controller and its rivals."""
    return Section(
        key="rivals",
        title="Comparison with other controllers",
        items=[
            Paragraph(
                text="The plants of both examples with other controllers. The gains of each were "
                "found with the same budget on the same training samples of the example's own "
                "actuator; they are compared on fresh samples, the same for all. All others need "
                "to know the sign of the input gain, which the paper's controller finds; the last "
                "table lists what else each needs to know."
            ),
            *(Paragraph(text=_rivals_sentence(record, example)) for example in _TITLES),
            _winners(record),
            *(_rivals_table(record, example) for example in _TITLES),
            Table(
                caption="What each controller needs to know.",
                columns=("controller", "knowledge"),
                rows=list(KNOWLEDGE.items()),
                folded=True,
            ),
            Paragraph(
                text="These are medians of a recorded campaign. Its studies, with all pairs, "
                "differences and intervals, are run by nlctl run reports/rivals-1.toml and "
                "reports/rivals-2.toml; the command that makes the record again, in a checkout:",
                code="python campaign/rival_runs.py",
            ),
        ],
    )


def _rivals_sentence(record: pd.DataFrame, example: str) -> str:
    """Say what is better than the paper's controller with every actuator, and what is worse."""
    tallies, alone = beaten_by(record, example).values(), "no single controller"
    beaten, beats = (
        tuple(x for x in KNOWLEDGE if all(x in tally[key] for tally in tallies))
        for key in ("beaten by", "beats")
    )
    return (
        f"{_TITLES[example]}: with every one of the actuators, the paper's controller as printed "
        f"is worse than {_listed(beaten, alone)}, and better than {_listed(beats, alone)}."
    )


def _winners(record: pd.DataFrame) -> Table:
    return Table(
        caption="Controllers that are better than the paper's as printed, and those that are "
        f"worse: no more violations and a smaller RMS of e for t ≥ {TAIL:g} s, with the exact "
        "interval of the median difference on the same samples on one side of 0.",
        columns=("example", "actuator", "worse than", "better than"),
        rows=[
            (title, RIVAL_ACTUATORS[name], _listed(tally["beaten by"]), _listed(tally["beats"]))
            for example, title in _TITLES.items()
            for name, tally in beaten_by(record, example).items()
        ],
    )


def _listed(labels: tuple[str, ...], nobody: str = "none") -> str:
    return ", ".join("itself tuned" if x == "paper, tuned" else x for x in labels) or nobody


def _rivals_table(record: pd.DataFrame, example: str) -> Table:
    rows: Any = record[record["example"] == example]
    return Table(
        caption=f"{_TITLES[example]}: violations of |e| ≤ 0.15 for t ≥ {TAIL:g} s or |u| ≤ 15 in "
        f"{rows['samples'].iloc[0]} runs (in brackets those that did not reach their end), and "
        "medians of the RMS of e, of the largest |u|, and of the energy of u. Less than the "
        "paper: median difference in the RMS of e on the same samples, with its exact interval.",
        columns=(
            "actuator", "controller", "violations", "RMS of e", "largest |u|", "energy of u",
            "less than the paper", "from", "to",
        ),
        rows=[
            (
                RIVAL_ACTUATORS[row["actuator"]], row["controller"], failed_text(row),
                *(float(f"{row[key]:.3g}") for key in (
                    "late_rms", "peak_u", "energy", "less", "less_low", "less_high",
                )),
            )
            for row in rows.to_dict("records")
        ],
        folded=True,
    )  # fmt: skip


# of the plant: e₁ is what the controller sees, in steps of the measurement
_ERROR = r"\(|y - y_d|\)"
_TITLES = {"example_1": "Example 1", "example_2": "Example 2"}


def sampling_section(record: pd.DataFrame) -> Section:
    """Return the section on sampling time, delay and steps of converters."""
    limits = spec_ends(record)
    return Section(
        key="sampling",
        title="Sampled implementation",
        items=[
            *(Paragraph(text=_sentence(limits, example, _ERROR)) for example in _TITLES),
            Figure(
                key="sampling-errors",
                caption=f"Largest {_ERROR} for t ≥ {TAIL:g} s against the sampling time, by "
                "Euler's method. Cross: the last run that meets the spec; line: the spec.",
                description=" ".join(_sentence(limits, example, "|y − yd|") for example in _TITLES),
                figure=sampling_errors(record, _TITLES, BAND),
            ),
            _table(limits),
            Paragraph(
                text="These are recorded runs, 13 to 21 for each entry of the table; two of them "
                "were repeated for this page and agree to 1e-3. The command that repeats all of "
                "them, in a checkout: python campaign/sampling_runs.py"
            ),
        ],
    )


def _sentence(limits: pd.DataFrame, example: str, error: str) -> str:
    """Say where the spec holds with the paper's controller, and with the others of the figure."""
    papers: Any = limits.loc[(example, "paper")]
    dt_text, delay, measured, given = (_text(papers, quantity) for quantity in QUANTITIES)
    rivals = [
        f"{r} {_text(limits.loc[(example, r)], QUANTITIES[0])}" for r in SAMPLED_CONTROLLERS[1:]
    ]
    return (
        f"{_TITLES[example]} with the paper's controller: {error} ≤ {BAND:g} for t ≥ {TAIL:g} s "
        f"and |u| ≤ {PEAK:g} hold up to a sampling time of {dt_text}. Sampled every 2 ms, they "
        f"hold with a delay of {delay}, or with measurements in steps of {measured}, or with u in "
        f"steps of {given}. Longest sampling times of other controllers: {', '.join(rivals)}."
    )


def _text(row: Any, quantity: Quantity) -> str:
    """Return how far a quantity may go, with its unit."""
    good, bad = row[(quantity.key, "good")], row[(quantity.key, "bad")]
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    if not np.isfinite(good):
        return f"less than {quantity.factor * bad:.3g}{unit}"
    more = "" if np.isfinite(bad) else " or more"
    return f"{quantity.factor * good:.3g}{unit}{more}"


def _table(limits: pd.DataFrame) -> Table:
    return Table(
        caption="Largest values with which each controller meets the spec, to 4 to 7 %. Less "
        "than: the least value that was tried violates it already, as continuous time may; or "
        "more: none did. Delay and converters: sampled every 2 ms. A run that diverges, or takes "
        "more than 60,000 steps, violates the spec.",
        columns=("example", "controller", *(q.title for q in QUANTITIES)),
        rows=[
            (_TITLES[example], label, *(_text(row, q) for q in QUANTITIES))
            for (example, label), row in zip(limits.index, limits.to_dict("records"), strict=True)
        ],
        folded=True,
    )


_Runs = Mapping[str, PaperRun]


def closing_sections(runs: _Runs, numerics: pd.DataFrame | None = None) -> list[Section]:
    """Return the last sections."""
    return [_choices(runs), _numerics(runs, numerics), _limits(runs)]


def metric_table(caption: str, cases: Sequence[PaperRun]) -> Table:
    """Return the headline metrics of some runs, one row each."""
    keys = ("tail_max_e", "tail_rms_e", "max_u", "max_r", "zeta_end", "max_W", "max_delta_hat")
    by_key = {m.key: m for m in METRICS}
    return Table(
        caption=caption,
        columns=("example", "variant", *(by_key[k].meaning for k in keys)),
        rows=[
            (str(run.case.example), run.case.title, *(float(run.metrics[k]) for k in keys))
            for run in cases
        ],
    )


def _choices(runs: _Runs) -> Section:
    shown = [r for r in runs.values() if r.case.group in ("published", "choice")]
    return Section(
        key="choices",
        title="Choices that the paper does not specify",
        folded=True,
        items=[
            Paragraph(
                text="Each row changes one reading of the paper and leaves the rest as it is. "
                f"{'None' if _same_verdict(shown) else 'At least one'} raises max |e₁| "
                f"(t ≥ {TAIL:g} s) by more than a quarter."
            ),
            metric_table(
                "One row per reading; the first row of each example is the default.",
                sorted(shown, key=lambda r: (r.case.example, r.case.group != "published")),
            ),
        ],
    )


def _same_verdict(shown: Sequence[PaperRun]) -> bool:
    """Whether every reading tracks as well as the default, to a quarter of its error."""
    base = {r.case.example: r.metrics["tail_max_e"] for r in shown if r.case.group == "published"}
    return all(r.metrics["tail_max_e"] <= 1.25 * base[r.case.example] for r in shown)


def _numerics(runs: _Runs, residuals: pd.DataFrame | None) -> Section:
    return Section(
        key="numerics",
        title="Numerics",
        folded=True,
        items=[
            Paragraph(
                text=f"The runs over {HORIZON:g} s were made by machine code that nlctl compiles "
                "from the python-control diagrams: an explicit Runge-Kutta pair of orders 5(4) at "
                f"relative tolerance {runs['1'].case.rtol:g}; steps end at the break points of the "
                "dead zone. Peaks between samples are those of a curve where they are smooth. The "
                "tests of nlctl repeat published cases in plain python-control."
            ),
            Paragraph(
                text="The backlash is the play operator itself: within a step its memory stands "
                "still or is driven, and a step ends where it reverses or touches, in both "
                "engines. (In plain python-control, which has no hook for accepted steps, its "
                "memory relaxes onto the play at 1000 1/s; the figures then hold to 5e-5.)"
            ),
            *([] if residuals is None else [_apart(residuals)]),
        ],
    )


def _apart(residuals: pd.DataFrame) -> Table:
    return Table(
        caption="The published cases with other tolerances, and with a stiff method instead of "
        "the explicit pair: largest difference over 20 s from tsit5 at 1e-10. The "
        "absolute tolerance is a hundredth of the relative one.",
        columns=("example", "method", "relative tolerance", "difference in e₁", "difference in ζ"),
        rows=[tuple(row) for row in residuals.itertuples(index=False)],
    )


def _limits(runs: _Runs) -> Section:
    late = {n: runs[str(n)].signals["zeta"][runs[str(n)].time >= TAIL] for n in (1, 2)}
    drift = {n: float(zeta[-1] - zeta[0]) for n, zeta in late.items()}
    return Section(
        key="limits",
        title="Limitations",
        items=[
            Paragraph(
                text=f"The runs end at {HORIZON:g} s, as the paper's do. They show that all "
                "signals stay bounded up to then; they do not show boundedness for all time. ζ "
                f"still moves: from t = {TAIL:g} s to the end it changes by {drift[1]:+.3g} in "
                f"Example 1 and by {drift[2]:+.3g} in Example 2, and N(ζ) changes its sign at 3."
            ),
            Paragraph(
                text="The tracking error does not tend to zero in these runs: it stays at about "
                f"{runs['1'].metrics['tail_max_e']:.2g} and {runs['2'].metrics['tail_max_e']:.2g} "
                f"for a reference that reaches {np.max(np.abs(runs['1'].signals['yd'])):.2g}."
            ),
        ],
    )
