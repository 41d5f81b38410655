"""The report: complete, self-contained, the same bytes every time, honest about failures."""

import dataclasses
import html.parser
import json
import re
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl.analysis.paper import CASES, METRICS, TAIL, expectations
from nlctl.analysis.paper.page.report import paper_report
from nlctl.analysis.report import (
    Claim,
    Equation,
    Figure,
    Paragraph,
    Report,
    Section,
    Table,
    render_html,
    render_json,
    write_report,
)
from nlctl.analysis.reproductions.paper import PaperRun
from nlctl.host.files import replace_file


def made_up_runs():
    """Runs with smooth signals, and the expected figures as their metrics."""
    t = np.linspace(0, 20, 401)
    wanted = {(e.case, e.metric): e.value for e in expectations()}
    runs = {}
    for case in CASES:
        names = case.make().output_labels
        signals = {name: np.sin(t + i) for i, name in enumerate(names)} | {"zeta": 1 + t / 40}
        metrics = {m.key: wanted.get((case.key, m.key), 0.1) for m in METRICS}
        runs[case.key] = PaperRun(case=case, time=t, signals=signals, metrics=metrics)
    return runs


@pytest.fixture(scope="module")
def runs():
    return made_up_runs()


@pytest.fixture(scope="module")
def page(runs):
    return render_html(paper_report(runs))


class Outline(html.parser.HTMLParser):
    """Collects ids, links, tags, and checks that tags are balanced."""

    VOID = {"meta", "br", "img", "link", "path", "use", "rect", "circle"}

    def __init__(self):
        super().__init__()
        self.ids, self.links, self.tags, self.open = [], [], [], []

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.tags.append((tag, attributes))
        if "id" in attributes:
            self.ids.append(attributes["id"])
        if tag == "a":
            self.links.append(attributes["href"])
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


def outline(page):
    parsed = Outline()
    parsed.feed(page)
    parsed.close()
    assert parsed.open == []
    return parsed


def simple_report(text="plain", **changes):
    figure = MatplotlibFigure()
    figure.subplots().plot([0, 1], [0, 1])
    items = [
        Paragraph(text=text),
        Table(caption=text, columns=(text, "status"), rows=[(text, "pass")], status="status"),
        Figure(key="f", caption=text, description=text, figure=figure),
        Equation(latex=r"a + b", number="(1)"),
    ]
    report = Report(
        title=text,
        verdict=text,
        claims=[Claim(text=text, measured=text, limit=text, holds=True, evidence="s")],
        sections=[Section(key="s", title=text, items=items)],
        command=text,
        provenance={text: text},
    )
    return dataclasses.replace(report, **changes)


@pytest.mark.slow
def test_page_is_well_formed_with_unique_ids_and_links_that_lead_somewhere(page):
    """No id stands twice, every link but that of a DOI stays on the page."""
    parsed = outline(page)
    assert len(parsed.ids) == len(set(parsed.ids))
    assert parsed.links
    for link in parsed.links:
        assert link.removeprefix("#") in parsed.ids or link.startswith("https://doi.org/10.")


def test_page_needs_no_network_and_little_room(page):
    """Nothing is fetched, only DOIs lead out, and the file is under a megabyte."""
    for tag, attributes in outline(page).tags:
        assert tag not in ("link", "iframe", "object", "embed", "img")
        assert "src" not in attributes
    assert set(re.findall(r"https?://[^/]*", page)) == {"https://doi.org"}
    assert not re.search(r"@import|url\((?!#|\"data:font/woff2;base64,)", page)
    assert len(page.encode()) < 1e6


def test_page_shows_everything_that_was_asked_for(page):
    """Seven time histories and a diagram per example, exchange, choices, parameters, checks."""
    parsed = outline(page)
    for number in (1, 2):
        for name in (
            *("diagram", "tracking", "error", "states", "input"),
            *("actuator", "nussbaum", "adaptation"),
        ):
            assert f"example-{number}-{name}-title" in parsed.ids
        assert f"example-{number}-parameters" in parsed.ids
        assert f"example-{number}-figures" in parsed.ids
    for key in ("exchange", "choices", "limits", "numerics", "provenance", "model"):
        assert key in parsed.ids
    assert page.count('class="badge pass"') == len(expectations()) + 5
    assert page.count("<math") >= 9


def test_svg_of_every_figure_is_valid_xml_with_a_description(page):
    """Readers who cannot see a figure get its title and what it shows, from the data."""
    drawings = re.findall(r"<svg role=.*?</svg>", page, flags=re.DOTALL)
    assert len(drawings) == 1 + 2 * 8 + 2  # the picture at the top, both examples, the exchange
    for drawing in drawings:
        root = ElementTree.fromstring(drawing)
        title, description = root[0], root[1]
        assert title.text
        assert description.text
        assert root.get("aria-labelledby") == f"{title.get('id')} {description.get('id')}"


@pytest.mark.weekly
def test_report_is_the_same_bytes_in_another_process(runs, tmp_path):
    """Neither hash seeds nor time leave a trace."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import test_report as t;"
        "from nlctl.analysis.report import write_report;"
        "from nlctl.analysis.paper.page.report import *;"
        "write_report(paper_report(t.made_up_runs()), sys.argv[2])"
    )
    here = str(__import__("pathlib").Path(__file__).parent)
    for seed in ("1", "2"):
        subprocess.run(
            [sys.executable, "-c", code, here, str(tmp_path / seed)],
            check=True,
            env={**__import__("os").environ, "PYTHONHASHSEED": seed},
        )
    for name in ("index.html", "report.json"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_every_number_is_in_the_json_file(runs):
    """report.json holds all metrics of all cases, and all tables."""
    content = json.loads(render_json(paper_report(runs)))
    assert content["numbers"] == {key: dict(run.metrics) for key, run in runs.items()}
    table = content["sections"]["example-1-figures"]["items"][0]
    assert table["columns"][-1] == "status"
    assert len(table["rows"]) == sum(e.case.startswith("1") for e in expectations())


@pytest.mark.slow
def test_a_missed_figure_is_the_first_sentence(runs):
    """The verdict names the figure, its value and what was to be reached."""
    spoiled = dict(runs)
    wrong = dict(runs["1"].metrics) | {"max_u": 13.0}
    spoiled["1"] = dataclasses.replace(runs["1"], metrics=wrong)
    report = paper_report(spoiled)
    assert report.verdict == (
        f"Not reproduced: 1 of {len(expectations())} numbers is off, most of all max |u| of "
        "Example 1, as published, diagonal centres (13 instead of 12.052217)."
    )
    assert [c.holds for c in report.claims] == [True, True, True, True, False]
    assert 'class="badge fail"' in render_html(report)


def test_nan_is_a_missed_figure(runs):
    """A figure that is NaN is missed, and its claim fails."""
    spoiled = dict(runs)
    wrong = dict(runs["2"].metrics) | {"tail_max_e": np.nan}
    spoiled["2"] = dataclasses.replace(runs["2"], metrics=wrong)
    report = paper_report(spoiled)
    assert report.verdict.startswith("Not reproduced")
    assert not report.claims[1].holds
    content = json.loads(render_json(report), parse_constant=lambda name: pytest.fail(name))
    assert content["numbers"]["2"]["tail_max_e"] == "nan"


def test_write_report_replaces_both_files_and_leaves_nothing_else(tmp_path):
    """The folder holds the page and its numbers."""
    for text in ("first", "second"):
        page = write_report(simple_report(text), tmp_path / "deep" / "folder")
    assert "second" in page.read_text(encoding="utf-8")
    assert sorted(p.name for p in page.parent.iterdir()) == ["index.html", "report.json"]


def test_a_failed_write_leaves_the_old_file(tmp_path):
    """Nothing is half written: the old content stays, no temporary file remains."""
    target = tmp_path / "file.txt"
    target.write_text("old")

    def fail(file):
        file.write(b"half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        replace_file(target, fail)
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["file.txt"]


def test_limits_state_how_far_zeta_moves(runs, page):
    """The drift of zeta over the last half is computed from the run."""
    t = runs["1"].time
    drift = 1 / 40 * (t[-1] - t[t >= TAIL][0])
    assert f"changes by {drift:+.3g} in Example\N{NO-BREAK SPACE}1" in page


@pytest.mark.slow
def test_curves_differ_in_more_than_their_colours(runs):
    """In every figure, each curve of the legend by its dashes, its markers or its width."""
    items = [item for section in paper_report(runs).sections for item in section.items]
    several = 0
    for figure in (item.figure for item in items if isinstance(item, Figure)):
        for axes in figure.axes:
            named = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
            looks = {(k.get_linestyle(), k.get_marker(), k.get_linewidth()) for k in named}
            assert len(looks) == len(named), axes.get_ylabel()
            several += len(named) > 1
    assert several >= 8
