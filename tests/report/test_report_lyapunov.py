"""The report's part on the proof: what was computed is shown, nothing is made to look better."""

import dataclasses
import functools
import json
import re

import numpy as np
import pytest
from burst_record import agreed, thinned_run, write_record
from drawn import hidden
from rows import each_row
from test_report import made_up_runs, outline

import nlctl
from nlctl.analysis import figures
from nlctl.analysis.lyapunov.loop.roles import read_parts
from nlctl.analysis.lyapunov.loop.signals import equality, inequality
from nlctl.analysis.lyapunov.nussbaum.long_run import LongRun, long_run
from nlctl.analysis.lyapunov.nussbaum.property import antiderivative, lobe_around
from nlctl.analysis.pages import proof as ledger_text
from nlctl.analysis.pages.proof import formulas
from nlctl.analysis.paper import BOUND
from nlctl.analysis.paper.burst import through_the_burst
from nlctl.analysis.paper.evidence import (
    AGREE,
    FarRuns,
    continued,
    evidence,
    far_runs_in_background,
    read_record,
)
from nlctl.analysis.paper.figures import after_burst
from nlctl.analysis.paper.page import proof as text
from nlctl.analysis.paper.page.proof import LONG_RUN, lyapunov_sections
from nlctl.analysis.paper.page.report import paper_report
from nlctl.analysis.report import (
    Figure,
    Paragraph,
    Report,
    Section,
    Table,
    render_html,
    render_json,
)
from nlctl.analysis.report.outline import claim_status, light, summary

pytestmark = pytest.mark.ci


@functools.cache
def found():
    """Both examples; Example 2 over a shorter run."""
    return {1: evidence(nlctl.paper.example_1()), 2: evidence(nlctl.paper.example_2(), 5.0)}


@functools.cache
def part():
    """The part that is made of them."""
    return lyapunov_sections(found())


def tables(sections):
    return [item for section in sections for item in section.items if isinstance(item, Table)]


def rows_by_key(number):
    """Rows of an example's ledger, and the table that each stands in."""
    sections = {section.key: section for section in part()}
    shown = {}
    for place, table in enumerate(tables([sections[f"proof-{number}"]])):
        for row in table.rows:
            assert row[0] not in shown
            shown[row[0]] = (place, *row)
    return shown


@pytest.mark.parted
@pytest.mark.parametrize("number", [1, 2])
def test_every_line_of_the_ledger_is_shown_once_with_its_status(number):
    """Nothing is left out, and the status is that of the ledger."""
    shown = rows_by_key(number)
    wanted = {line.key: line.status for line in found()[number].ledger.lines}
    of_paper = {x.key for x in found()[number].ledger.lines if x.reading == "paper"}
    for key, row in shown.items():
        printed = " as printed" if key in of_paper and wanted[key] == "violated" else ""
        assert row[2] == wanted[key] + printed
        assert light(row[2]) == ("refuted" if printed else light(wanted[key]))
    assert shown.keys() == wanted.keys()


@pytest.mark.parametrize("number", [1, 2])
def test_proved_checked_and_violated_lines_stand_in_tables_of_their_own(number):
    """A reader cannot take a checked line for a proved one: the caption says what it is."""
    section = next(s for s in part() if s.key == f"proof-{number}")
    stands = {}
    for table in tables([section]):
        stands.setdefault(table.caption, set()).update(row[1] for row in table.rows)
        assert table.status == "status"
    assert stands[ledger_text.PROVED] == {"proved", "computed"}
    assert stands[ledger_text.CHECKED] == {"checked"}
    assert stands[ledger_text.FAILING] == {"violated as printed"}
    assert stands[ledger_text.LEFT_OPEN] <= {"undecided", "not applicable"}
    assert ledger_text.VIOLATED not in stands


def test_a_violated_line_comes_first_and_says_what_follows():
    """A fault planted in the ledger appears as violated, in the first table and in the text."""
    one = found()[2]
    broken = tuple(
        dataclasses.replace(x, status="violated", follows="THE END") if x.key == "(31)" else x
        for x in one.ledger.lines
    )
    bad = dataclasses.replace(one, ledger=dataclasses.replace(one.ledger, lines=broken))
    section = next(s for s in lyapunov_sections({2: bad}) if s.key == "proof-2")
    first = tables([section])[0]
    assert first.caption == ledger_text.VIOLATED
    (row,) = first.rows
    assert row[:2] == ("(31)", "violated")
    assert row[-1].endswith("THE END")
    assert "Corrected statements violated: (31)." in section.items[0].text


def test_the_bound_of_34_is_half_the_square_of_C_0():  # noqa: N802
    """Two ways to one number: the figure's level, and C_0 of the conservatism."""
    for one in found().values():
        level = one.curves["level (34), $C_0^2/2$"]
        np.testing.assert_allclose(level, one.conservatism.C_0**2 / 2, rtol=1e-6)
        np.testing.assert_allclose(
            np.max(one.curves["$r^2/2$"]), one.ledger.max_r**2 / 2, rtol=5e-3
        )
        assert np.all(one.curves["$V$"] >= one.curves["$r^2/2$"])
        shares = sum(s.value for s in one.conservatism.shares)
        assert shares == pytest.approx(one.conservatism.C_0**2 / 2, rel=1e-6)


def test_the_slow_drift_is_that_of_200_seconds_and_of_what_it_says():
    """The table says what was computed; the text names the commands for what was not."""
    first = part()[0]
    assert LONG_RUN in [i.code for i in first.items if isinstance(i, Paragraph)]
    (table,) = tables([first])
    assert "after 200 s" in table.caption
    for row, one in zip(table.rows, found().values(), strict=True):
        assert one.slow_drift.time == 200.0
        assert row[3] == one.slow_drift.verdict
    assert found()[2].slow_drift.verdict == "drifts"
    assert 7e3 < found()[2].slow_drift.burst < 1.1e4  # within a quarter, a fiftieth of the way


def test_commands_in_the_text_are_python():
    """They can be pasted into a shell: two quotes, and code that compiles."""
    words = " ".join(i.code for i in part()[0].items if isinstance(i, Paragraph))
    commands = re.findall(r'python -c "([^"]*)"', words)
    assert len(commands) == 2
    for command in commands:
        compile(command, "command", "exec")


@pytest.mark.weekly
def test_the_part_is_in_the_papers_report_when_there_is_evidence():
    """With it: sections, figures, valid page, the same numbers in JSON.  Without: as before."""
    report = paper_report(made_up_runs(), proofs=found())
    parsed = outline(render_html(report))
    assert len(parsed.ids) == len(set(parsed.ids))
    for key in (
        "proof",
        "proof-1",
        "proof-2-constants",
        "proof-1-V-title",
        "proof-2-margins-title",
    ):
        assert key in parsed.ids
    content = json.loads(render_json(report), parse_constant=lambda name: pytest.fail(name))
    assert "proof-2-bound" in content["sections"]
    assert "proof" not in {section.key for section in paper_report(made_up_runs()).sections}
    assert lyapunov_sections({}) == []


def test_all_constants_are_shown_with_their_provenance():
    """As in the record, and without the box in every row."""
    section = next(s for s in part() if s.key == "proof-1-constants")
    (table,) = tables([section])
    entries = found()[1].ledger.constants.entries
    assert [row[0] for row in table.rows] == [formulas(c.symbol) for c in entries]
    assert [row[3] for row in table.rows] == [c.provenance for c in entries]
    assert {"proved", "computed"} <= {row[3] for row in table.rows}


def test_a_short_dip_of_a_margin_is_in_its_figure():
    """One violating sample among thousands, and a NaN, survive the thinning."""
    t = np.linspace(0, 20, 5001)
    for value in (-3.0, np.nan):
        high = np.ones_like(t)
        high[3333] = value
        margin = inequality("(0)", "0 <= 1", t, 0.0, high, scale=1.0)
        drawn = figures.inequality_margins([margin]).axes[0].lines[-1].get_ydata()
        assert np.min(drawn) == value or np.isnan(np.min(drawn))
        assert np.isnan(np.min(drawn)) == np.isnan(value)


def test_residuals_are_relative_and_a_nan_is_a_gap():
    """An equation off by 2 of 4 shows one half; rounding is not below the axis."""
    t = np.linspace(0, 1, 11)
    figure = figures.equality_residuals([equality("(0)", "4 = 2", t, 4.0, 2.0)])
    np.testing.assert_array_equal(figure.axes[0].lines[0].get_ydata(), np.full(11, 0.5))
    drawn = figures.equality_residuals([equality("(0)", "1 = nan", t, 1.0, np.nan, scale=1.0)])
    assert np.all(np.isnan(drawn.axes[0].lines[0].get_ydata()))


def test_a_bound_that_is_infinite_is_drawn_and_not_an_error():
    """Without decay the level of (34) is infinite; the finite curves are still seen."""
    t = np.linspace(0, 1, 11)
    figure = figures.lyapunov_bound(t, {"V": 1 + t, "bound": np.full_like(t, np.inf)})
    report = Report(
        title="t", verdict="v", claims=[], command="c",
        sections=[Section(key="s", title="s", items=[])],
    )  # fmt: skip
    assert figure.axes[0].get_yscale() == "log"
    assert render_html(report)


@functools.cache
def burst():
    """Example 2, started just below the end of its lobe, where it bursts within a minute."""
    return long_run(nlctl.paper.example_2(), 60.0, start={"law.zeta": 2.9917})


def test_a_burst_feeds_on_the_integral_of_the_nussbaum_function():
    """Beyond 3, r^2/2 grows by k G times the integral of N, k G within its global bounds."""
    run = burst()
    assert run.lobe.high == pytest.approx(3.0)
    assert 0 < run.burst < run.lost < 60.0
    zeta, r = run.signals["zeta"], np.abs(run.signals["r"])
    before, after = run.time < run.burst, run.time > run.burst
    assert np.all(zeta[before] < 3.0)
    assert np.all(zeta[after] > 3.0 - 1e-9)
    assert r[-1] > 10 * np.max(r[before][-1000:])
    parts = read_parts(nlctl.paper.example_2())
    lower, upper = antiderivative(parts.law.N)(np.array([3.0, zeta[-1]]))
    slope, G = 1.2, (1.0, 3.0 * 1.2)  # of the backlash; (2 + cos x1)(1 + 0.2 sin(v)^2)
    assert slope * G[0] < r[-1] ** 2 / 2 / (upper - lower) < 1.01 * slope * G[1]


@pytest.mark.weekly
def test_no_word_of_the_figures_is_hidden():
    """With the run of Example 2 that the page shows; nothing is cut off or lies on a curve."""
    record = read_record(dataclasses.replace(burst(), predictions=(found()[2].slow_drift,) * 2))
    made = [i.figure for s in part() for i in s.items if isinstance(i, Figure)]
    made += [figures.burst(record), figures.story(*np.zeros((3, 9)), record)]
    made += [figures.long_zeta({"Example 2 with the phase": record}), after_burst(carried())]
    assert len(made) > 8
    for figure in made:
        assert hidden(figure) == []


def test_ctrl_c_ends_a_long_run():
    """It is no run that stands still: what was reached is not taken for an answer."""

    def progress(t):
        if t > 1.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="was stopped at"):
        long_run(nlctl.paper.example_2(), 60.0, progress=progress)


def test_a_run_that_does_not_burst_has_no_time_of_it():
    """Twenty seconds as published: nothing is lost, and there is nothing to predict it from."""
    run = long_run(nlctl.paper.example_2(), 20.0)
    assert np.isnan(run.burst)
    assert run.lost is None
    assert run.time[-1] == 20.0
    assert run.predictions == ()


def test_a_long_run_predicts_from_its_beginning_alone():
    """From 200 s of a run of 210 s at one tolerance: the same as from 200 s at another."""
    run = long_run(nlctl.paper.example_2(), 210.0, rtol=1e-6)
    (told,) = run.predictions
    wanted = found()[2].slow_drift
    assert told.time == 200.0
    assert told.verdict == "drifts"
    assert told.burst == pytest.approx(wanted.burst, rel=1e-3)
    assert run.calm < 0.06


def test_the_burst_is_at_the_top_of_the_part():
    """First the sentence with its time, then the figure with the time and what was predicted."""
    run = dataclasses.replace(burst(), predictions=(found()[2].slow_drift,) * 2)
    first = lyapunov_sections(found(), FarRuns(runs={"2": run}))[0]
    words, figure, *_ = first.items
    assert isinstance(words, Paragraph)
    assert f"t = {run.burst:.1f} s" in words.text
    assert f"predicted for {run.predictions[0].burst:.0f} s" in words.text
    assert isinstance(figure, Figure)
    lines = [line.get_xdata() for line in figure.figure.axes[0].lines]
    marks = {float(x[0]) for x in lines if len(x) == 2 and x[0] == x[1]}
    assert marks == {run.burst, run.predictions[0].burst}


def test_without_a_burst_none_is_claimed():
    """A run that ends calmly is told as such."""
    run = dataclasses.replace(
        long_run(nlctl.paper.example_2(), 20.0), predictions=(found()[2].slow_drift,)
    )
    first = lyapunov_sections(found(), FarRuns(runs={"2": run}))[0]
    assert first.items[0].text.startswith("No burst within 20 s")
    assert "proof-burst" not in {i.key for i in first.items if isinstance(i, Figure)}


def test_whoever_leaves_early_does_not_wait_for_the_long_runs():
    """An error, or Ctrl-C, in the body ends the runs in the background."""
    with pytest.raises(ZeroDivisionError), far_runs_in_background() as far:
        raise ZeroDivisionError
    assert isinstance(far.exception(), InterruptedError)


def test_the_envelope_is_the_largest_value_of_each_whole_window():
    """A spike counts in its own window only, and a part of a window is left out."""
    t = np.linspace(0, 10, 101)
    y = np.where(t == 4.5, 7.0, 1.0)
    at, largest = figures.windowed_maximum(t, y, 3.0)
    np.testing.assert_allclose(at, [1.5, 4.5, 7.5])
    np.testing.assert_array_equal(largest, [1, 7, 1])


def test_a_thinned_run_has_the_same_burst_and_the_same_largest_error(tmp_path):
    """Found again from a hundredth of the samples, also after a trip through the file."""
    t = np.append(np.arange(0, 1900, 0.01), 1901 - np.geomspace(1, 1e-5, 900))
    zeta = 2 + np.where(t < 1900.5, t / 2000, 0.95 + 2 * (t - 1900.5))
    signals = {"zeta": zeta, "e": 0.05 * np.sin(0.5 * t + 0.1), "r": np.cos(t), "u": np.sin(t)}
    run = LongRun(
        loop="example_2", horizon=2000.0, rtol=1e-6, time=t, signals=signals, predictions=(),
        lobe=lobe_around(2.0), lost=1901.0,
    )  # fmt: skip
    thin = thinned_run(run)
    assert thin.time.size < run.time.size / 100
    assert thin.burst == run.burst
    assert thin.calm == run.calm
    write_record(thin, tmp_path / "run.csv")
    again = read_record(run, tmp_path / "run.csv")
    assert (again.loop, again.rtol, again.lost) == ("example_2", 1e-6, 1901.0)
    assert again.burst == pytest.approx(run.burst, abs=1e-5)
    np.testing.assert_allclose(again.signals["r"], thin.signals["r"], rtol=1e-6)


def test_the_kept_record_goes_on_where_a_run_of_today_ends():
    """1000 s of Example 2 end where the record is, and a record of another loop is refused."""
    today = long_run(nlctl.paper.example_2(), 1000.0)
    record = read_record(today)
    whole = continued(today, record)
    assert np.all(np.diff(whole.time) > 0)
    assert 9.1e3 < whole.burst < 9.5e3
    assert whole.rtol < whole.again[0] <= today.rtol
    assert abs(whole.again[1] - whole.burst) < AGREE
    assert whole.calm < 0.06
    early, late = (p.burst for p in whole.predictions)
    assert early == pytest.approx(whole.burst, rel=0.07)  # from a fiftieth of the way
    assert late == pytest.approx(whole.burst, rel=0.02)
    other = dataclasses.replace(today, signals={k: v + 0.01 for k, v in today.signals.items()})
    with pytest.raises(ValueError, match="make it again"):
        continued(other, record)


@pytest.mark.weekly
def test_a_record_is_of_two_tolerances_that_agree():
    """To 5 s; the report then says both times."""
    late = burst()
    shifted = dataclasses.replace(late, rtol=1e-8, time=late.time + 0.9 * AGREE)
    made = agreed(late, shifted)
    assert made.again == (1e-8, pytest.approx(late.burst + 0.9 * AGREE))
    assert f"it is {made.again[1]:.1f} s" in text.burst_text(
        dataclasses.replace(made, predictions=(found()[2].slow_drift,) * 2)
    )
    with pytest.raises(ValueError, match="at which these agree to 5 s"):
        agreed(late, dataclasses.replace(shifted, time=late.time + 1.1 * AGREE))


@functools.cache
def carried():
    """Example 2 beyond its run."""
    return through_the_burst(burst())


@pytest.mark.weekly
def test_the_verdict_and_the_claims_say_what_becomes_of_the_loop():
    """The proof is refuted; that signals stay bounded is open, whatever the burst looks like."""
    run = read_record(long_run(nlctl.paper.example_2(), 210.0))
    report = paper_report(
        made_up_runs(), proofs=found(), far=FarRuns(runs={"2": run}, burst=carried())
    )
    assert f"keeps |e₁| ≤ {BOUND:g} from 10 s on" in report.verdict
    assert "Whether all signals stay bounded for all time is open" in report.verdict
    assert f"loses the sign of its gain at {run.burst:.0f} s" in report.verdict
    claims = {claim.text: claim for claim in report.claims}
    theorem = next(c for text, c in claims.items() if "theorem's proof shows" in text)
    assert claim_status(theorem) == ("refuted", "refuted")  # the paper is wrong, not the report
    bounded = claims["Example 2: all signals stay bounded for all time"]
    assert claim_status(bounded) == ("undecided", "caution")
    assert f"ζ = {carried().rest:.2f}" in bounded.measured
    look, told = summary(report.claims)
    assert look == "refuted"
    assert told.startswith("1 claim of the paper is refuted, 1 is open, 4 hold; of ours all 5 hold")
    proved = [c for c in report.claims if c.status == "proved"]
    assert len(proved) == 2
    assert all(c.holds for c in proved)
    anchors = {section.key for section in report.sections}
    assert {c.evidence for c in report.claims if c.evidence.startswith("proof")} <= anchors


def test_the_theorem_is_a_claim_without_long_runs_too():
    """Lemma 1 is false whatever a loop does; nothing is said of a burst that nobody ran."""
    report = paper_report(made_up_runs(), proofs=found())
    assert any("theorem's proof shows" in claim.text for claim in report.claims)
    assert not any("stay bounded for all time" in c.text and "Example" in c.text
                   for c in report.claims)  # fmt: skip
    assert "Far beyond" not in report.verdict


@pytest.mark.weekly
@each_row("key", ["1", "2", "1-backlash", "2-dead-zone"])
def test_following_is_a_bound_of_the_error(key):
    """Not agreement with numbers of others: a case just beyond the bound fails, and is named."""
    for factor in (0.999, 1.001):
        runs = made_up_runs()
        metrics = {**runs[key].metrics, "tail_max_e": factor * BOUND}
        runs[key] = dataclasses.replace(runs[key], metrics=metrics)
        report = paper_report(runs)
        claims = [c for c in report.claims if c.limit == f"|e₁| ≤ {BOUND:g}"]
        assert len(claims) == 4
        assert sum(not c.holds for c in claims) == (factor > 1)


def test_nothing_is_called_unbounded():
    """What a run shows is that it was given up: every sentence of the part is worded so."""
    run = dataclasses.replace(burst(), predictions=(found()[2].slow_drift,) * 2)
    first = lyapunov_sections(found(), FarRuns(runs={"2": run}, burst=carried()))[0]
    words = [i.text for i in first.items if isinstance(i, Paragraph)]
    words += [i.caption for i in first.items if isinstance(i, Figure | Table)]
    told = " ".join(words)
    assert "does not stay bounded" not in told
    assert "beyond bounds" not in told
    assert "This does not show that the signals are unbounded" in told
    assert "neither proved nor refuted" in told
    assert "proof-after" in {i.key for i in first.items if isinstance(i, Figure)}


def test_every_forecast_is_marked():
    """With what became of it, those that failed as well."""
    run = dataclasses.replace(burst(), predictions=(found()[2].slow_drift,))
    still = long_run(nlctl.paper.example_2(), 210.0)
    failed = dataclasses.replace(still.predictions[0], rest=1.5, rest_range=(1.4, 1.6))
    far = {"2": run, "1": dataclasses.replace(still, predictions=(failed, *still.predictions))}
    first = lyapunov_sections(found(), FarRuns(runs=far))[0]
    (table,) = (t for t in tables([first]) if t.caption == text.FORECASTS)
    assert table.status == "outcome"
    outcomes = [row[-1] for row in table.rows]
    assert len(outcomes) == 3
    assert outcomes[0] == "failed"  # it was told of a run from another start
    assert outcomes[2] == "open"
    assert all(light(one) for one in ("held", "failed", "open"))
