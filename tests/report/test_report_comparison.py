"""The page of two reports: claims, figures, numbers and signals that differ."""

import dataclasses
import json

import matplotlib.figure
import numpy as np
import pytest
from command_line import nlctl_here
from hypothesis import given
from hypothesis import strategies as st

from nlctl.analysis.pages.compared import Compared, comparison_page
from nlctl.analysis.report import Claim, Figure, History, Report, Section, Table, write_report
from nlctl.analysis.report.changes import Curves, claim_changes, curves_of, drawings
from nlctl.analysis.report.compare import read_report

T = np.linspace(0, 6, 301)


def claim(text, status, **more):
    holds = status in ("shown", "holds")
    words = {"text": text, "measured": status, "limit": "1", "evidence": "s", "status": status}
    return Claim(**(words | {"holds": holds} | more))


def drawn(slope):
    figure = matplotlib.figure.Figure(figsize=(5, 2))
    figure.add_subplot().plot([0, 1], [0, slope])
    return figure


def report(claims, slope=1.0, shift=0.0, caption="A line", band=0.0, **numbers):
    picture = Figure(key="line", caption=caption, description="d", figure=drawn(slope))
    signals = {"y": np.sin(T) + shift, "u": np.cos(T)}
    y = signals["y"]
    history = History(
        key="run-history", caption="c", description="d", time=T, signals=signals,
        bands={"y": (y - band, y + band)} if band else {},
    )  # fmt: skip
    return Report(
        title="Arm",
        verdict="v",
        claims=claims,
        sections=[Section(key="s", title="S", items=[picture, history])],
        command="",
        numbers=numbers,
    )


@pytest.fixture
def compared(tmp_path):
    """Compare two reports, written into folders of their own."""

    def go(first, second, **options):
        both = []
        for name, made in (("one", first), ("other", second)):
            folder = write_report(made, tmp_path / name).parent
            both.append(Compared(name=name, content=read_report(folder), folder=folder))
        return comparison_page(*both, **options)

    return go


def rows(made, key):
    (section,) = (section for section in made.sections if section.key == key)
    return [list(row) for item in section.items for row in getattr(item, "rows", [])]


def test_claims_that_became_worse_come_first(compared):
    """Shown and now refuted before all else; then what is open, what is new, what is better."""
    first = [claim("a", "refuted"), claim("b", "shown"), claim("c", "shown"), claim("d", "shown")]
    second = [
        claim("a", "shown"), claim("b", "not shown yet"), claim("d", "shown", measured="2"),
        claim("c", "refuted", ids=["REQ-3"]),
    ]  # fmt: skip
    made = compared(report(first), report(second))
    told = [(row[1], row[2], row[3]) for row in rows(made, "claim_changes")]
    assert told == [
        ("shown", "refuted", "c"),
        ("shown", "not shown yet", "b"),
        ("shown", "shown", "d"),
        ("refuted", "shown", "a"),
    ]
    assert made.headline.look == "fail"
    assert made.headline.text.startswith("1 claim: shown → refuted; 1 claim: shown → not shown yet")
    assert "Worse: REQ-3: c; b." in made.verdict


def test_a_claim_with_another_limit_is_the_same_claim(compared):
    """Its evidence stands at the same place; both texts are there."""
    old, new = claim("p <= 0.1", "shown", evidence="p"), claim("p <= 0.2", "shown", evidence="p")
    (change,) = claim_changes([vars(old)], [vars(new)])
    assert (change.text, change.worse) == ("p <= 0.1 → p <= 0.2", 0)
    (gone, there) = claim_changes([vars(old)], [vars(dataclasses.replace(new, evidence="q"))])
    assert {gone.statuses, there.statuses} == {("shown", "gone"), ("new", "shown")}


def test_reports_that_say_the_same_differ_in_nothing(compared):
    """Whatever claims they have; the same picture under another number is the same picture."""
    made = compared(report([claim("a", "shown")]), report([claim("a", "shown")]))
    assert (made.headline.look, made.headline.text) == (
        "pass",
        "The claim ends as before, and nothing differs.",
    )
    assert [s.key for s in made.sections if rows(made, s.key)] == [
        "claim_changes", "signal_changes", "compared",
    ]  # fmt: skip


def test_numbers_have_both_values_and_the_tolerance(compared):
    """And only those that are further apart than it are listed."""
    made = compared(report([], a=1.0, b=2.0), report([], a=1.05, b=4.0), rtol=0.1)
    assert rows(made, "number_changes") == [["b", 2.0, 4.0, 2.0, 0.5, 0.1]]
    assert made.numbers == {"differences": 1, "rtol": 0.1}
    both = compared(report([], a=1.0, b=2.0), report([], a=1.05, b=4.0))
    assert [row[0] for row in rows(both, "number_changes")] == ["b", "a"]


def test_signals_of_both_are_overlaid_with_their_largest_difference(compared):
    """y is shifted by 0.25 everywhere, u is the same."""
    made = compared(report([]), report([], shift=0.25))
    (figure, table) = next(s for s in made.sections if s.key == "signal_changes").items
    assert figure.key == "overlaid-run-history"
    upper = figure.figure.axes[0].get_lines()
    assert [line.get_label() for line in upper] == ["before", "after"]
    np.testing.assert_allclose(upper[1].get_ydata() - upper[0].get_ydata(), 0.25, atol=2e-5)
    (y, u) = table.rows
    assert (y[0], u[0], u[1]) == ("y", "u", 0.0)
    assert y[1] == pytest.approx(0.25, abs=2e-5)


def test_bands_of_both_are_drawn_around_their_signals(compared):
    """Bands of a half around y on both pages; where only one page has one there is none."""
    one, two, bare = (report([], shift=s, band=b) for s, b in ((0, 0.5), (0.25, 0.5), (0.25, 0.0)))
    (figure, _) = next(s for s in compared(one, two).sections if s.key == "signal_changes").items
    ax = figure.figure.axes[0]
    for band, line in zip(ax.collections, ax.get_lines(), strict=True):
        low, high = band.get_paths()[0].get_extents().intervaly
        assert (low, high) == pytest.approx(
            (line.get_ydata().min() - 0.5, line.get_ydata().max() + 0.5), abs=2e-5
        )
    assert "Bands" in figure.caption
    (figure, _) = next(s for s in compared(one, bare).sections if s.key == "signal_changes").items
    assert len(figure.figure.axes[0].collections) == 0


@given(st.floats(-3, 3), st.floats(0.1, 2.0), st.integers(3, 40), st.integers(3, 40))
def test_lines_are_as_far_apart_as_at_one_of_their_ends(offset, slope, n, m):
    """Between two straight lines, sampled anyhow: the largest difference is at 0 or at 1."""
    one, two = np.linspace(0, 1, n), np.linspace(0, 1, m)
    first = Curves(time=one, signals={"y": 0 * one})
    apart, at = first.largest_difference(Curves(time=two, signals={"y": offset + slope * two}), "y")
    assert apart == pytest.approx(max(abs(offset), abs(offset + slope)), abs=1e-12)
    assert at in (0.0, 1.0)


def test_figures_are_compared_as_they_are_drawn(compared, tmp_path):
    """Another line is another picture; another caption, or another place on a page, is not."""
    made = compared(report([]), report([], slope=2.0))
    assert rows(made, "figure_changes") == [["line", "A line", "drawn differently"]]
    same = compared(report([]), report([], caption="Another"))
    assert rows(same, "figure_changes") == []
    other = report([])
    before = Figure(key="first", caption="c", description="d", figure=drawn(-3.0))
    moved = dataclasses.replace(
        other, sections=[Section(key="t", title="T", items=[before]), *other.sections]
    )
    page, again = (write_report(r, tmp_path / n) for r, n in ((moved, "m"), (other, "o")))
    assert drawings(page)["line"] == drawings(again)["line"] != drawings(page)["first"]
    assert rows(compared(other, moved), "figure_changes") == [["first", "c", "new"]]


@pytest.mark.slow
def test_the_page_leaves_output_and_exit_codes_as_they_are(tmp_path):
    """With --out stdout is what it is without; the page is whole, and names its command."""
    one = write_report(report([claim("a", "shown")], a=1.0), tmp_path / "one").parent
    two = write_report(report([claim("a", "refuted")], a=2.0), tmp_path / "two").parent
    plain = nlctl_here("compare", one, two)
    made = nlctl_here("compare", one, two, "--out", tmp_path / "page")
    assert (made.returncode, made.stdout) == (plain.returncode, plain.stdout)
    assert plain.returncode == 1
    text = (tmp_path / "page/index.html").read_text(encoding="utf-8")
    assert "1 claim: shown → refuted." in text
    assert "overlaid-run-history" in text
    content = json.loads((tmp_path / "page/report.json").read_text(encoding="utf-8"))
    assert content["headline"] == {"look": "fail", "text": "1 claim: shown → refuted."}
    assert nlctl_here("compare", one, one, "--out", tmp_path / "same").returncode == 0
    assert nlctl_here("compare", one, two, "--pdf").returncode == 2
    (one / "signals.json").write_text("[", encoding="utf-8")
    assert curves_of(one) == {}


def test_a_number_that_a_table_shows_as_well_is_named_once(compared):
    """Numbers of their own stay, whatever their values."""

    def with_table(peak, cost):
        table = Table(columns=["signal", "peak"], rows=[["y", peak]], caption="c")
        whole = report([], peak=peak, cost=cost)
        section = dataclasses.replace(whole.sections[0], items=[table])
        return dataclasses.replace(whole, sections=[section])

    page = compared(with_table(1.0, 5.0), with_table(2.0, 6.0))
    assert sorted(row[1:3] for row in rows(page, "number_changes")) == [[1.0, 2.0], [5.0, 6.0]]
    assert page.numbers["differences"] == 2
