"""The report's part on the proof: what happens far beyond 20 s, and the ledger of each example."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ... import figures
from ...lyapunov.nussbaum.long_run import LongRun
from ...pages.notation import formulas
from ...pages.proof import ledger_section
from ...report.document import Figure, Item, Paragraph, Section, Table, captioned
from ..burst import Burst
from ..evidence import FAR_HORIZONS, LOOK, NO_FAR_RUNS, Evidence, FarRuns
from ..figures import after_burst
from . import proof_text as text


def lyapunov_sections(proofs: Mapping[int, Evidence], far: FarRuns = NO_FAR_RUNS) -> list[Section]:
    """Compose the part from what was found."""
    if not proofs:
        return []
    parts = [section for number, one in proofs.items() for section in _example(number, one)]
    return [_finding(proofs, far), _lemma(), *parts]


def _finding(proofs: Mapping[int, Evidence], far: FarRuns) -> Section:
    return Section(
        key="proof",
        title="The stability proof, and simulations far beyond 20 s",
        items=[
            *_burst(far.runs, far.burst),
            _slow_drift_table(proofs),
            *(Paragraph(text=words, code=command) for words, command in text.COMMANDS),
        ],
    )


def _burst(far: Mapping[str, LongRun], burst: Burst | None) -> Iterator[Item]:
    run = far.get("2")
    if run is not None and np.isfinite(run.burst):
        yield Paragraph(text=text.burst_text(run))
        yield Figure(
            key="proof-burst",
            caption=text.BURST,
            description=f"{text.burst_text(run)} {text.BURST}",
            figure=figures.burst(run),
        )
        if burst is not None:
            yield from _after(run, burst)
    else:
        yield Paragraph(text=text.NO_LONG_RUN if run is None else text.calm(run))
    calm = {FAR_HORIZONS[key][0]: r for key, r in far.items() if key != "2"}
    if calm:
        yield Figure(
            key="proof-calm",
            caption=text.CALM,
            description=" ".join(f"{name}: {text.calm(r)}" for name, r in calm.items()),
            figure=figures.long_zeta(calm),
        )
    if far:
        yield _far_table(far)
        yield _forecast_table(far)


def _after(run: LongRun, burst: Burst) -> Iterator[Item]:
    sentence = text.after_text(run, burst)
    yield Paragraph(text=sentence)
    yield Figure(
        key="proof-after",
        caption=text.AFTER,
        description=f"{sentence} {text.AFTER}",
        figure=after_burst(burst),
    )


def _far_table(far: Mapping[str, LongRun]) -> Table:
    return Table(
        caption=text.FAR_CAPTION,
        columns=("loop", "rtol", "simulated until (s)", "max |e₁| before", "outcome"),
        rows=[
            (
                FAR_HORIZONS[key][0],
                f"{r.rtol:g}",
                f"{r.time[-1]:.0f}",
                r.calm,
                text.what_happened(r),
            )
            for key, r in far.items()
        ],
    )


def _forecast_table(far: Mapping[str, LongRun]) -> Table:
    return Table(
        caption=text.FORECASTS,
        columns=("loop", "from the first (s)", "prediction", "range", "observed", "outcome"),
        rows=[
            (
                FAR_HORIZONS[key][0],
                f"{p.time:g}",
                *text.forecast_text(p),
                text.what_happened(r),
                became,
            )
            for key, r in far.items()
            for p, became in zip(r.predictions, r.outcomes, strict=True)
        ],
        status="outcome",
    )


def _slow_drift_table(proofs: Mapping[int, Evidence]) -> Table:
    rows = []
    for number, one in proofs.items():
        c = one.slow_drift
        burst = f"{c.burst:.4g} s" if np.isfinite(c.burst) else "none"
        rest = "none" if c.rest is None else f"{c.rest:.4g}"
        if c.rest_range is not None:
            rest = f"{rest}, by parts of the data {c.rest_range[0]:.4g} to {c.rest_range[1]:.4g}"
        spent = f"{100 * c.share:.3g} %"
        rows.append((f"Example {number}", f"{c.zeta:.5g}", spent, c.verdict, rest, burst))
    return Table(
        caption=f"The drift of ζ, judged after {LOOK:g} s. {text.SLOW_DRIFT}",
        columns=("loop", "ζ", "budget used", "verdict", "ζ settles at", "burst at"),
        rows=rows,
    )


def _lemma() -> Section:
    return Section(
        key="proof-lemma",
        title="Lemma 1: a counterexample, and what remains",
        level=3,
        items=[Paragraph(text=words) for words in text.LEMMA],
    )


def _example(number: int, one: Evidence) -> list[Section]:
    key, name = f"proof-{number}", f"Example {number}"
    folded = (
        ("bound", "V, its bounds, and their conservatism", _bound(key, one)),
        ("steps", "margins of all steps over time", _margins(key, one)),
        ("constants", "constants of the proof", [_constants(one)]),
    )
    return [
        ledger_section(one.ledger, key, f"{name}: the proof line by line", level=3),
        *(
            Section(
                key=f"{key}-{part}", title=f"{name}: {title}", level=3, folded=True, items=[*items]
            )
            for part, title, items in folded
        ),
    ]


def _bound(key: str, one: Evidence) -> Iterator[Item]:
    c = one.conservatism
    yield captioned(
        f"{key}-V",
        text.V_CAPTION,
        f"C₀ is {c.C_0:.4g}, max |r| is {c.max_r:.4g}.",
        figures.lyapunov_bound(one.t, one.curves),
    )
    for caption, group in (
        (text.shares_caption(c), c.shares),
        (text.delta_shares(c), c.delta_shares),
    ):
        yield Table(
            caption=caption,
            columns=("term", "formula", "value", "share"),
            rows=[
                (formulas(x.term), formulas(x.formula), f"{x.value:.4g}", f"{100 * x.share:.1f} %")
                for x in group
            ],
        )
    numbers = text.ladder(one)
    yield Figure(
        key=f"{key}-bounds",
        caption=text.LADDER,
        description="; ".join(f"{name}: {value:.4g}" for name, (value, _) in numbers.items()),
        figure=figures.bounds(numbers),
    )


def _margins(key: str, one: Evidence) -> Iterator[Item]:
    groups = (
        ("assumptions", text.ASSUMPTIONS, one.assumptions),
        ("margins", text.MARGINS, [m for m in one.margins if m.kind == "inequality"]),
    )
    for name, caption, margins in groups:
        yield Figure(
            key=f"{key}-{name}",
            caption=caption,
            description="; ".join(
                f"{m.equation}: least margin {m.least:.4g} at {m.at:.4g} s" for m in margins
            ),
            figure=figures.inequality_margins(margins),
        )
    equalities = [m for m in one.margins if m.kind == "equality"]
    worst = max(-m.least / m.scale for m in equalities)
    yield captioned(
        f"{key}-equations",
        text.EQUATIONS,
        f"The largest is {worst:.2g}.",
        figures.equality_residuals(equalities),
    )


def _constants(one: Evidence) -> Table:
    entries = one.ledger.constants.entries
    return Table(
        caption=f"{text.CONSTANTS} {formulas(str(one.ledger.constants.box))}.",
        columns=("constant", "value", "unit", "provenance", "how"),
        rows=[
            (formulas(c.symbol), f"{c.value:.6g}", c.unit, c.provenance, formulas(c.how))
            for c in entries
        ],
        status="provenance",
    )
