"""A gallery shows what became of one study over its revisions."""

import matplotlib.figure
import numpy as np
import pytest
from command_line import nlctl_here

from nlctl.analysis import figures
from nlctl.analysis.pages.compared import trend_figure
from nlctl.analysis.report import Claim, Headline, Report, write_gallery, write_report
from nlctl.analysis.report.changes import Revision, trends


def claim(text, status, margin="", ids=()):
    return Claim(
        text=text, measured="m", limit="l", holds=status == "shown", evidence="", status=status,
        margin=margin, ids=ids,
    )  # fmt: skip


def report(claims, title="Arm", revision="", date="", **numbers):
    return Report(
        title=title, verdict="v", claims=claims, sections=[], command="", numbers=numbers,
        revision=revision, date=date,
    )  # fmt: skip


def contents(*reports):
    """As they stand in report.json, in folders f1, f2, ..."""
    return [
        Revision(
            folder=f"f{i}",
            label=r.revision or f"f{i}",
            content=vars(r) | {"claims": [vars(c) for c in r.claims]},
        )
        for i, r in enumerate(reports, 1)
    ]  # fmt: skip


def test_revisions_are_ordered_by_date_then_by_number():
    """2026-2 before 2026-10, r9 before r10, whatever the folders are called."""
    made = contents(
        report([], revision="r10", date="2026-02-01"),
        report([], revision="r9", date="2026-02-01"),
        report([], revision="r11", date="2026-01-01"),
        report([], title="Another"),
    )
    (one,) = trends(made)
    assert (one.title, one.labels) == ("Arm", ["r11", "r9", "r10"])
    folders = [
        Revision(folder=f"run-{n}", label=f"run-{n}", content=made[0].content) for n in (10, 9)
    ]
    (two,) = trends(folders)
    assert two.labels == ["run-9", "run-10"]


def test_claims_and_margins_are_followed():
    """A claim that comes later has a gap before, one that goes has one behind; the id stays."""
    made = contents(
        report([claim("a", "shown", "0.3", ["REQ-1"]), claim("b", "shown")], late=1.0, same=3),
        report([claim("a", "not shown yet", "0.1", ["REQ-1"])], late=2.0, same=3),
        report([claim("a", "refuted", "-0.2", ["REQ-1"]), claim("c", "shown")], late=4.0, same=3),
    )
    (one,) = trends(made)
    ended = {name: [c.status if c else "" for c in row] for name, row in one.claims.items()}
    assert ended == {
        "REQ-1: a": ["shown", "not shown yet", "refuted"],
        "b": ["shown", "", ""],
        "c": ["", "", "shown"],
    }
    assert one.numbers == {"margin: a": [0.3, 0.1, -0.2], "late": [1.0, 2.0, 4.0]}
    axes = trend_figure(one).figure.axes
    lines = [line.get_ydata().tolist() for ax in axes[1:] for line in ax.get_lines()]
    assert lines == [[0.3, 0.1, -0.2], [1.0, 2.0, 4.0]]
    assert len(axes[0].get_lines()) == 5  # a mark for each claim that was made
    assert [t.get_text() for t in axes[-1].get_xticklabels()] == ["f1", "f2", "f3"]


def test_marks_of_claims_differ_in_shape_as_well():
    """Colour alone says nothing: each end has its own marker."""
    drawn = figures.trend(["1", "2", "3"], {"a": ["holds", "open", "fails"]}, {"x": [1, np.nan, 2]})
    assert isinstance(drawn, matplotlib.figure.Figure)
    marks = {line.get_marker() for line in drawn.axes[0].get_lines()}
    assert len(marks) == 3


@pytest.mark.slow
def test_the_gallery_has_the_trend_ids_and_headlines(tmp_path):
    """Requirements with their worst claim; studies with one report have no trend."""
    claims = [claim("a", "shown", ids=["REQ-1"]), claim("b", "refuted", ids=["REQ-1"])]
    write_report(report(claims, revision="A"), tmp_path / "a")
    write_report(report([claim("a", "shown", ids=["REQ-1"])], revision="B"), tmp_path / "b")
    lone = report([], title="Lone")
    checked = Headline(look="pass", text="All 3 checks of the loop hold.")
    write_report(Report(**{**vars(lone), "headline": checked}), tmp_path / "lone")
    assert nlctl_here("gallery", tmp_path).returncode == 0
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count('<figure id="trend-') == 1
    assert "Arm, over 2 revisions" in page
    assert "REQ-1 refuted" in page
    assert "All 3 checks of the loop hold." in page
    assert '<figure id="trend-' not in write_gallery(tmp_path).read_text(encoding="utf-8")
