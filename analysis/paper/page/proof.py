"""The report's part on the proof: what happens far beyond 20 s, and the ledger of each example."""

from collections.abc import Iterator, Mapping

import numpy as np

from ... import figures
from ...lyapunov.conservatism import Conservatism
from ...lyapunov.nussbaum.long_run import LOOKS, LongRun
from ...lyapunov.nussbaum.slow_drift import SlowDrift
from ...pages.proof import formulas, ledger_section
from ...report.document import Figure, Item, Paragraph, Section, Table, captioned
from ..burst import Burst
from ..evidence import FAR_HORIZONS, LOOK, NO_FAR_RUNS, Evidence, FarRuns
from ..figures import after_burst

_IMPORT = "import nlctl; from nlctl.analysis.lyapunov.nussbaum.long_run import long_run"
LONG_RUN = f'python -c "{_IMPORT}; print(long_run(nlctl.paper.example_2(), rtol=1e-8))"'
LONG_RUN_1 = (
    f"python -c \"{_IMPORT}; print(long_run(nlctl.paper.example_1(phase='integral'), 20_000))\""
)
COMMANDS = (  # what each one shows
    ("The burst at a tolerance of 1e-8, and likewise at others (some minutes):", LONG_RUN),
    ("Example 1 until 20 000 s instead of 1000 s:", LONG_RUN_1),
)
NO_LONG_RUN = "The runs far beyond 20 s are not part of this report."
BURST = (
    "Left: ζ, and the largest |e₁| in each period of the reference. Dots: what the prediction was "
    "made from; lines of the same colour: the burst that it predicted. At ζ = 3, dashed, N(ζ) "
    "changes its sign. Right: the end of the same run; time runs to the right and is what is left "
    "of the run, on a logarithmic axis. The filtered error r and the input u grow by orders of "
    "magnitude within milliseconds, before e₁ has time to move."
)
CALM = (
    "Example 1: the Nussbaum argument ζ far beyond 20 s, for both readings of cos(w t). Dashed: "
    "ζ = 3, where N(ζ) changes its sign. Dotted, in the colour of the run: where the drift was "
    "predicted to stop; the list below says whether it did."
)
AFTER = (
    "Example 2 beyond its burst, with the ripple of the gain averaged. Left: the filtered error r "
    "and the input u over ζ; between the dashed lines N(ζ) has the wrong sign. Right: the tracking "
    "error after the burst, with a large constant instead of |N|, which no longer matters."
)
FORECASTS = (
    "What was predicted from the beginning of each run, and what happened. Held: the burst lies "
    "in the range, or ζ settles within 0.01 of the prediction. Failed: there was no burst in the "
    "range, or ζ has passed the prediction. Open: the run does not show it."
)
FAR_CAPTION = (
    "Simulations far beyond 20 s. "
    "max |e₁|: from 200 s on, until a second before the burst. What comes "
    "after 1000 s of Example 2 is a record of the same computation, kept with the program and "
    "continued from where today's run ends, unless the command at the end of this page has "
    "--far: then all of it was computed again."
)
SLOW_DRIFT = (
    "While ζ crosses an interval between two zeros of N, a lobe, it uses up the lobe's budget, the "
    "integral of |N|. Drifts: by the fitted balance of the drift it continues until the budget is "
    "used up, and the gain changes its sign. Settles: by all fits the drift stops before. "
    "Undecided: the fits disagree, or the chirp of Example 1 has not shown enough."
)
LEMMA = (
    r"The paper bounds \(V\), \(\zeta\) and \(\int k\,G\,N\,d\zeta\) by its Lemma 1, for all time. "
    r"The lemma is false on [0, ∞): with \(\dot\zeta = c_1 c_2/(2 + e^{\zeta^2})\) and \(V = c_1 + "
    r"I\) its premise holds and \(\zeta\) grows without bound. The reason is the constant "
    r"\(\alpha_0\) of (31): it permits a slow drift of \(\zeta\) for ever. So the steps (33) to "
    r"(36), and that the loop is uniformly ultimately bounded, do not follow from the paper's "
    r"argument.",
    r"What remains valid: as long as a run stays in the box, every step up to "
    r"(32) holds, and \(|r| \le C_0\) with \(Q = \sup I(t)\) taken from the run. Without the "
    r"lemma, (31) gives line (c) of the lists below, \(V \le V(0) + \alpha_0 t + \zeta - \zeta(0) "
    r"+ l_+ E_+ - l_- E_-\), with \(l_-\) and \(l_+\) the bounds of \(k\,G\) and \(E_+\), \(E_-\) "
    r"the energy that the Nussbaum term has given and taken; it grows with \(t\). For a constant "
    r"gain or a \(\zeta\) that never falls, line (b) turns it into a time before which \(N\) "
    r"cannot change its sign. A bound for all time needs another law: with the sign of the gain "
    r"known, nlctl.analysis.lyapunov.certify proves one, shown with each example below.",
)
V_CAPTION = (
    r"\(V\) of (21) against its bounds: the level of (34), which is \(C_0^2/2\), the bound (32) "
    r"that depends on time, and the part \(r^2/2\) that the filtered error has in \(V\). \(I\) and "
    r"\(Q\) are those of this run. Logarithmic."
)
LADDER = (
    "Bounds of |r|, and what |r| reaches; logarithmic. Only what is proved for all time, from "
    "where the loop starts, is called so; the other bounds take Q or more from this run, and say "
    "nothing of times beyond it. By comparison: without V and without Lemma 1. Known sign: another "
    "controller, with the law that knows the sign of the gain and gains that suit it."
)
ASSUMPTIONS = (
    "Margins of what the proof supposes, over time: the larger side less the smaller one. Dot: the "
    "least. Omega: distance to the faces of the box over half its width."
)
MARGINS = (
    "Margins of the inequalities of the proof over time: the larger side less the smaller one. "
    "Dot: the least. The axes are linear near 0 and logarithmic beyond a thousandth of the largest "
    "margin. Where a margin starts at 0, both sides are equal there by construction."
)
EQUATIONS = (
    "Equations of the proof: distance between the two sides over the size of their terms. Grey: "
    "the tolerance; what stays below it is rounding. What is less than 1e-18, or 0, is drawn "
    "there."
)
CONSTANTS = "Every constant of the proof, with how it was obtained. They hold over the box"


def burst_text(run: LongRun) -> str:
    """Return how a long run ended, in one paragraph."""
    early, *_ = run.predictions
    late = run.predictions[-1]
    sure = "The command below prints the time at another tolerance."
    if run.again is not None:
        sure = f"At a relative tolerance of {run.again[0]:g} it is {run.again[1]:.1f} s."
    r, u = (abs(float(run.signals[name][-1])) for name in ("r", "u"))
    return (
        "Example 2 as published loses the sign of its gain. It tracks for "
        f"{run.burst / 3600:.1f} hours, max |e₁| = {run.calm:.3f} from {min(LOOKS):g} s on; "
        f"meanwhile the Nussbaum argument ζ drifts upwards, and at t = {run.burst:.1f} s (relative "
        f"tolerance {run.rtol:g}) it reaches {run.lobe.high:g}, where the gain N(ζ) changes to "
        "the wrong sign: r and the input grow by orders of magnitude within milliseconds, to "
        f"{r:.2g} and {u:.2g}, and the integrator's steps shrink to 0. {sure} This does not show "
        "that the signals are unbounded. The drift predicts the burst long before: from the "
        f"first {early.time:g} s it was predicted for {early.burst:.0f} s, from the first "
        f"{late.time:g} s for {late.burst:.0f} s."
    )


def after_text(run: LongRun, burst: Burst) -> str:
    """Return how Example 2 continues after its burst, in one paragraph."""
    peak, largest_input = burst.peaks
    bounds, late = burst.bounds, burst.late_time[-1]
    years = bounds.right.budget / (run.lobe.budget / run.burst) / (365.25 * 86_400)
    gains = " and ".join(f"−{K:g}" for K in burst.late)
    return (
        "Continued through the burst, with the ripple sin² v averaged and without the gap of the "
        f"backlash, |r| reaches {peak:.2g} and |u| {largest_input:.2g} within "
        f"{1e6 * burst.lasted:.0f} µs, and ζ settles at {burst.rest:.3f}, where N(ζ) has "
        "the right sign again. By the integral of N alone, for any gain within its "
        f"bounds, max |r| is at most {bounds.peak[1]:.3g}, and ζ settles between "
        f"{bounds.rest[0]:.3f} and {bounds.rest[1]:.3f}. Then the loop tracks again: |e₁| ≤ "
        f"{burst.calm:.4f} over {late:.0f} s, found with constants {gains} instead of N, "
        f"which agree to {100 * burst.apart:.1g} %. At the rate of the drift so far the budget of "
        f"the next lobe lasts for {years:.0e} years. So by this computation the signals stay "
        "finite; that they stay bounded for all time is neither proved nor refuted."
    )


def calm(run: LongRun) -> str:
    """Return how a long run ended that did not burst."""
    return f"No burst within {run.time[-1]:.0f} s: ζ ends at {run.signals['zeta'][-1]:.3f}."


def what_happened(run: LongRun) -> str:
    """Return what happened in a long run."""
    if np.isfinite(run.burst):
        return f"burst at {run.burst:.1f} s"
    return f"ζ = {run.signals['zeta'][-1]:.3f} at the end, no burst"


def forecast_text(forecast: SlowDrift) -> tuple[str, str]:
    """Return a forecast of the slow drift, and its range."""
    if forecast.rest is not None:
        low, high = forecast.rest_range or (np.nan, np.nan)
        return (
            f"at rest at ζ = {forecast.rest:.3f}",
            f"by parts of the data {low:.3f} to {high:.3f}",
        )
    if np.isfinite(forecast.burst):
        first, last = forecast.burst_range
        return f"burst at {forecast.burst:.0f} s", f"{first:.0f} to {last:.0f} s"
    return forecast.verdict, ""


def shares_caption(c: Conservatism) -> str:
    """Return the caption of the terms of C_0, which says what makes it large."""
    most = max(c.shares, key=lambda share: share.share)
    return (
        f"What the bound is made of: C₀ = {c.C_0:.4g}, {c.ratio:.3g} times max |r| = "
        f"{c.max_r:.4g}. The terms of C₀²/2; the largest is {formulas(most.term)}."
    )


def delta_shares(c: Conservatism) -> str:
    """Return the caption of the terms of delta*."""
    most = max(c.delta_shares, key=lambda share: share.share)
    return f"The terms of δ*; the largest is {formulas(most.term)}."


def ladder(one: Evidence) -> dict[str, tuple[float, str]]:
    """Return bounds of |r| and what happens by name, each with its kind, see `figures.bounds`."""
    c, run, seen = one.conservatism, "along this run", "what happens"
    late = {f"t ≥ {x.start:g} s, by comparison": (x.bound, run) for x in c.comparisons[-1:]}
    return {
        "C₀ of (36)": (c.C_0, run),
        "C₀, δ* along the run": (c.C_0_along, run),
        "C₀, W fitted to the run as well": (c.C_0_fitted, run),
        "√(2 max V)": (c.sqrt_2V, run),
        "max |r|": (c.max_r, seen),
        "in the end, by (34)": (c.ultimate, run),
        **late,
        "max |r|, second half": (c.tail_max_r, seen),
        "known sign, for all t": (one.certificate.C_0, "proved"),
        "known sign, max |r|": (one.certified_max_r, seen),
    }


def lyapunov_sections(proofs: Mapping[int, Evidence], far: FarRuns = NO_FAR_RUNS) -> list[Section]:
    """Compose the part from what was found."""
    if not proofs:
        return []
    parts = [section for number, one in proofs.items() for section in _example(number, one)]
    lemma = Section(
        key="proof-lemma",
        title="Lemma 1: a counterexample, and what remains",
        level=3,
        items=[Paragraph(text=words) for words in LEMMA],
    )
    return [_finding(proofs, far), lemma, *parts]


def _finding(proofs: Mapping[int, Evidence], far: FarRuns) -> Section:
    return Section(
        key="proof",
        title="The stability proof, and simulations far beyond 20 s",
        items=[
            *_burst(far.runs, far.burst),
            _slow_drift_table(proofs),
            *(Paragraph(text=words, code=command) for words, command in COMMANDS),
        ],
    )


def _burst(far: Mapping[str, LongRun], burst: Burst | None) -> Iterator[Item]:
    run = far.get("2")
    if run is not None and np.isfinite(run.burst):
        yield Paragraph(text=burst_text(run))
        yield Figure(
            key="proof-burst",
            caption=BURST,
            description=f"{burst_text(run)} {BURST}",
            figure=figures.burst(run),
        )
        if burst is not None:
            yield from _after(run, burst)
    else:
        yield Paragraph(text=NO_LONG_RUN if run is None else calm(run))
    others = {FAR_HORIZONS[key][0]: r for key, r in far.items() if key != "2"}
    if others:
        yield Figure(
            key="proof-calm",
            caption=CALM,
            description=" ".join(f"{name}: {calm(r)}" for name, r in others.items()),
            figure=figures.long_zeta(others),
        )
    if far:
        yield _far_table(far)
        yield _forecast_table(far)


def _after(run: LongRun, burst: Burst) -> Iterator[Item]:
    sentence = after_text(run, burst)
    yield Paragraph(text=sentence)
    yield Figure(
        key="proof-after",
        caption=AFTER,
        description=f"{sentence} {AFTER}",
        figure=after_burst(burst),
    )


def _far_table(far: Mapping[str, LongRun]) -> Table:
    return Table(
        caption=FAR_CAPTION,
        columns=("loop", "rtol", "simulated until (s)", "max |e₁| before", "outcome"),
        rows=[
            (
                FAR_HORIZONS[key][0],
                f"{r.rtol:g}",
                f"{r.time[-1]:.0f}",
                r.calm,
                what_happened(r),
            )
            for key, r in far.items()
        ],
    )


def _forecast_table(far: Mapping[str, LongRun]) -> Table:
    return Table(
        caption=FORECASTS,
        columns=("loop", "from the first (s)", "prediction", "range", "observed", "outcome"),
        rows=[
            (
                FAR_HORIZONS[key][0],
                f"{p.time:g}",
                *forecast_text(p),
                what_happened(r),
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
        caption=f"The drift of ζ, judged after {LOOK:g} s. {SLOW_DRIFT}",
        columns=("loop", "ζ", "budget used", "verdict", "ζ settles at", "burst at"),
        rows=rows,
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
        V_CAPTION,
        f"C₀ is {c.C_0:.4g}, max |r| is {c.max_r:.4g}.",
        figures.lyapunov_bound(one.t, one.curves),
    )
    for caption, group in (
        (shares_caption(c), c.shares),
        (delta_shares(c), c.delta_shares),
    ):
        yield Table(
            caption=caption,
            columns=("term", "formula", "value", "share"),
            rows=[
                (formulas(x.term), formulas(x.formula), f"{x.value:.4g}", f"{100 * x.share:.1f} %")
                for x in group
            ],
        )
    numbers = ladder(one)
    yield Figure(
        key=f"{key}-bounds",
        caption=LADDER,
        description="; ".join(f"{name}: {value:.4g}" for name, (value, _) in numbers.items()),
        figure=figures.bounds(numbers),
    )


def _margins(key: str, one: Evidence) -> Iterator[Item]:
    groups = (
        ("assumptions", ASSUMPTIONS, one.assumptions),
        ("margins", MARGINS, [m for m in one.margins if m.kind == "inequality"]),
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
        EQUATIONS,
        f"The largest is {worst:.2g}.",
        figures.equality_residuals(equalities),
    )


def _constants(one: Evidence) -> Table:
    entries = one.ledger.constants.entries
    return Table(
        caption=f"{CONSTANTS} {formulas(str(one.ledger.constants.box))}.",
        columns=("constant", "value", "unit", "provenance", "how"),
        rows=[
            (formulas(c.symbol), f"{c.value:.6g}", c.unit, c.provenance, formulas(c.how))
            for c in entries
        ],
        status="provenance",
    )
