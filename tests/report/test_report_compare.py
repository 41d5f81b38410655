"""Comparing two reports, the gallery over several, and what the command line does with pages."""

import dataclasses
import json
from pathlib import Path
from urllib.parse import unquote

import pytest
from command_line import nlctl
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from test_report_page import HOSTILE, Reader

from nlctl.analysis.cli.report import compare_reports, write_gallery_of
from nlctl.analysis.cli.written_page import PageOptions, check_report_options, finish_report
from nlctl.analysis.report import (
    Claim,
    Report,
    Section,
    Table,
    compare_contents,
    write_gallery,
    write_pdf,
    write_report,
)
from nlctl.analysis.report.compare import ABSENT, _row_names, _same
from nlctl.errors import UsageError


def small(**changes):
    """A report with two claims, numbers, and a table whose first cells come twice."""
    rows = [("A", "x", 1.0, "0.5"), ("A", "y", 2.0, "1e-3"), ("B", "x", float("nan"), "word")]
    table = Table(caption="c", columns=("case", "what", "value", "text"), rows=rows)
    report = Report(
        title="t",
        verdict="Good.",
        claims=[
            Claim(text="one", measured="1", limit="2", holds=True, evidence="s"),
            Claim(text="two", measured="3", limit="2", holds=False, evidence="s"),
        ],
        sections=[Section(key="s", title="S", items=[table])],
        command="nlctl report",
        provenance={"Python": "3.11"},
        numbers={"a": {"b": [1.0, 2.0]}, "c": 3},
    )
    return dataclasses.replace(report, **changes)


def with_cell(row, place, value):
    """The small report with one cell changed."""
    (section,) = small().sections
    (table,) = section.items
    rows = [list(r) for r in table.rows]
    rows[row][place] = value
    table = dataclasses.replace(table, rows=rows)
    return small(sections=[dataclasses.replace(section, items=[table])])


def differences(tmp_path, first, second, rtol=0.0):
    one, two = write_report(first, tmp_path / "1"), write_report(second, tmp_path / "2")
    return compare_contents(one.parent, two.with_name("report.json"), rtol=rtol)


def test_a_report_does_not_differ_from_itself_made_elsewhere(tmp_path):
    """Other versions, another command, other files: the findings are the same."""
    other = small(provenance={"Python": "3.12"}, command="x", files={"d": "0"}, methods=["m"])
    assert differences(tmp_path, small(), other) == []


@pytest.mark.parametrize(
    ("changed", "where", "first", "second"),
    [
        (small(verdict="Bad."), "verdict", "Good.", "Bad."),
        (small(numbers={"a": {"b": [1.0, 2.5]}, "c": 3}), "numbers.a.b[1]", 2.0, 2.5),
        (with_cell(1, 2, 7.0), "section 's', table 1, row 'A | y', column 'value'", 2.0, 7.0),
        (with_cell(2, 2, 0.0), "section 's', table 1, row 'B | x', column 'value'", "nan", 0.0),
        (small(claims=[small().claims[0], dataclasses.replace(small().claims[1], holds=True)]),
         "claim 'two', holds", False, True),
    ],
)  # fmt: skip
def test_each_change_is_found_where_it_is(tmp_path, changed, where, first, second):
    """One change, one difference, named by claim, number, or row and column; both ways."""
    (found,) = differences(tmp_path, small(), changed)
    assert (found.where, found.first, found.second) == (where, first, second)
    (back,) = differences(tmp_path, changed, small())
    assert (back.where, back.first, back.second) == (where, second, first)


def test_what_only_one_report_has_is_absent_in_the_other(tmp_path):
    """A number more, and a section less."""
    found = differences(tmp_path, small(numbers={}, sections=[]), small())
    assert {d.first for d in found} == {ABSENT}
    assert "numbers.c" in {d.where for d in found}


@given(st.floats(1e-3, 1e3), st.floats(1e-9, 1e-2))
def test_rtol_is_the_relative_distance_that_still_counts_as_equal(value, rtol):
    """A little less is equal, a little more is not; also for numbers that stand as text."""
    for convert in (float, repr):
        near, far = convert(value * (1 + 0.9 * rtol)), convert(value * (1 + 1.2 * rtol))
        assert _same(convert(value), near, rtol)
        assert not _same(convert(value), far, rtol)


@given(st.lists(st.lists(st.sampled_from("ab"), min_size=1, max_size=4), max_size=9))
def test_rows_get_names_of_their_own(rows):
    """Whatever they hold."""
    names = _row_names(rows)
    assert len(names) == len(set(names)) == len(rows)


@each_row("content", ["{", "[]", '{"title": "t"}', '"text"'])
def test_what_is_no_report_is_refused_by_name(tmp_path, content):
    """Damaged, or another file."""
    (tmp_path / "report.json").write_text(content)
    with pytest.raises(UsageError, match=r"report\.json' is not a report"):
        compare_contents(tmp_path, tmp_path)


@each_row("rtol", [-1.0, float("nan"), float("inf")])
def test_a_tolerance_is_finite_and_not_negative(rtol):
    """Otherwise everything would be equal, or nothing."""
    with pytest.raises(UsageError, match="rtol"):
        compare_contents("a", "b", rtol=rtol)


def test_compare_prints_text_or_json(tmp_path, capsys):
    """And says whether the reports agree."""
    one = write_report(small(), tmp_path / "1").parent
    two = write_report(small(verdict="Bad."), tmp_path / "2").parent
    assert compare_reports(one, one, rtol=0.0, as_json=False)
    assert capsys.readouterr().out == "no difference\n"
    assert not compare_reports(one, two, rtol=0.0, as_json=False)
    assert capsys.readouterr().out == "verdict: Good. -> Bad.\n1 difference\n"
    assert not compare_reports(one, two, rtol=0.0, as_json=True)
    (found,) = json.loads(capsys.readouterr().out)
    assert found == {"where": "verdict", "first": "Good.", "second": "Bad."}


def test_gallery_lists_every_report_with_its_light_and_a_link_that_leads_to_it(tmp_path):
    """Whatever the folders are called; what cannot be read is listed, without a link."""
    names = ["plain", "100% <b> #1?", "deep/er", "'\"&"]
    for name in names:
        write_report(small(title=f"title of {name}"), tmp_path / name)
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "report.json").write_text("{")
    read = Reader(write_gallery(tmp_path).read_text(encoding="utf-8"))
    links = [Path(tmp_path, unquote(a["href"])) for t, a in read.tags if t == "a"]
    assert sorted(links) == sorted(tmp_path / name / "index.html" for name in names)
    assert all(link.is_file() for link in links)
    assert read.text.count("1 of 2 claims fails.") == len(names)
    assert read.text.count("Cannot be read.") == 1
    again = (tmp_path / "index.html").read_bytes()
    assert write_gallery(tmp_path).read_bytes() == again


def test_gallery_of_nothing_is_refused(tmp_path):
    """The folder is named."""
    with pytest.raises(UsageError, match="no report"):
        write_gallery_of(tmp_path, open_=False)


@pytest.mark.parted
@pytest.mark.parametrize("name", [n for n in HOSTILE if n != "path"])
def test_gallery_shows_hostile_titles_as_text(tmp_path, name):
    """No element more than with plain ones."""
    plain, hostile = tmp_path / "1", tmp_path / "2"
    write_report(small(), plain / "r")
    write_report(small(title=HOSTILE[name], verdict=HOSTILE[name]), hostile / "r")
    one, two = (Reader(write_gallery(f).read_text(encoding="utf-8")) for f in (plain, hostile))
    assert [tag for tag, _ in one.tags] == [tag for tag, _ in two.tags]
    assert two.text.count(HOSTILE[name]) == 2


@pytest.mark.weekly
def test_a_page_is_opened_in_the_browser_of_the_user(tmp_path, monkeypatch):
    """Here a program that writes down what it was given; without any, a sentence says so."""
    folder, seen = write_report(small(), tmp_path / "reports" / "one").parents[1], tmp_path / "seen"
    opener = tmp_path / "opener"
    opener.write_text(f'#!/bin/sh\nprintf %s "$1" > "{seen}"\n', encoding="utf-8")
    opener.chmod(0o755)
    index = folder / "index.html"
    monkeypatch.setenv("BROWSER", f"{opener} %s")
    assert nlctl("gallery", folder, "--open").stdout == f"{index}\n"
    assert seen.read_text(encoding="utf-8") == index.as_uri()
    monkeypatch.delenv("BROWSER")
    monkeypatch.setenv("PATH", str(tmp_path))
    without = nlctl("gallery", folder, "--open").stdout
    assert without == f"{index}\nno browser was found to show it\n"


def test_without_a_browser_a_pdf_is_refused_before_anything_is_computed(
    tmp_path, monkeypatch, capsys
):
    """The message says what to install; without --pdf nothing is asked for; the page stays."""
    monkeypatch.setenv("PATH", str(tmp_path))
    check_report_options(tmp_path / "out", PageOptions())
    with pytest.raises(UsageError, match="apt-get install chromium"):
        check_report_options(tmp_path / "out", PageOptions(pdf=True))
    page = write_report(small(), tmp_path / "out")
    with pytest.raises(UsageError, match="none is installed"):
        finish_report(page, pdf=True, open_=False)
    assert capsys.readouterr().out == f"{page}\n"
    with pytest.raises(UsageError):
        write_pdf(page, tmp_path / "report.pdf")
    assert page.is_file()
