"""Interactive time histories: asked for or not there, thinned honestly, harmless, documented."""

import base64
import dataclasses
import hashlib
import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure as MatplotlibFigure
from places import ROOT
from rows import each_row
from studies_example import write
from test_report import made_up_runs
from test_report_page import HOSTILE, LADDER, Reader
from typer.testing import CliRunner

from nlctl.analysis.cli.main import app
from nlctl.analysis.json_values import as_json
from nlctl.analysis.pages.study.histories import Histories
from nlctl.analysis.pages.study.rows import fan_items
from nlctl.analysis.paper.page.report import paper_report
from nlctl.analysis.report import Figure, History, Report, Section, render_html, write_report
from nlctl.analysis.report.history import SIGNALS_FILE, chart, thinned
from nlctl.errors import UsageError

VENDOR = ROOT / "analysis" / "report" / "vendor" / "uplot"


def charted(text="plain"):
    """A report with three histories and a figure beside them: waves, a ladder of odd numbers."""
    t = np.linspace(0, 10, 501)
    waves = {f"wave {i}: {text}": (i + 1) * np.sin(t + i) for i in range(3)}
    odd = {text: LADDER, "nothing": [np.nan] * 8, "constant": [2.0] * 8}
    figure = MatplotlibFigure()
    figure.subplots().plot(t, np.sin(t))
    words = {"caption": text, "description": text}
    items = [
        Figure(key="still", figure=figure, **words),
        History(key="waves", time=t, signals=waves, unit=text, shown=list(waves)[:2], **words),
        History(key="odd", time=np.arange(8.0), signals=odd, **words),
        History(key="odd", time=[0.0, 1.0], signals={}, **words),
    ]
    sections = [Section(key="charts", title=text, items=items)]
    return Report(title=text, verdict=text, claims=[], sections=sections, command="c")


def held(page):
    """What the page's charts are drawn from: strict JSON, as a browser reads it."""

    def refuse(name):
        raise AssertionError(name)

    found = re.findall(r'<script type="application/json">(.*?)</script>', page, flags=re.DOTALL)
    return [json.loads(text, parse_constant=refuse) for text in found]


def without_histories(report):
    sections = [
        dataclasses.replace(s, items=[i for i in s.items if not isinstance(i, History)])
        for s in report.sections
    ]
    return dataclasses.replace(report, sections=sections)


def without_file(page):
    """A page without what it says of signals.json."""
    told = ", signals over time in <code>signals.json</code>"
    assert told in page
    return re.sub(r"<tr><td[^>]*>signals\.json</td>.*\n", "", page.replace(told, ""))


def test_signals_lie_next_to_the_page_and_go_with_them(tmp_path):
    """As the charts would have them; a page without histories leaves none of an older one."""
    report = charted()
    write_report(report, tmp_path)
    kept = json.loads((tmp_path / SIGNALS_FILE).read_text(encoding="utf-8"))
    every = [i for s in report.sections for i in s.items if isinstance(i, History)]
    assert list(kept) == ["waves", "odd", "odd-2"]
    assert list(kept.values()) == [
        json.loads(json.dumps(as_json(chart(history)))) for history in every
    ]
    write_report(without_histories(report), tmp_path)
    assert not (tmp_path / SIGNALS_FILE).exists()


def test_a_page_has_charts_only_if_they_are_asked_for():
    """Else it is that of a report without any, but for hashes and the file of signals."""
    report = charted()
    still, bare = render_html(report), render_html(without_histories(report))
    assert without_file(re.sub(r"\b[0-9a-f]{64}\b", "", still)) == re.sub(
        r"\b[0-9a-f]{64}\b", "", bare
    )
    assert "uPlot" not in still
    assert render_html(without_histories(report), interactive=True) == bare
    assert len(held(render_html(report, interactive=True))) == 3


def test_the_json_beside_the_page_is_the_same_either_way(tmp_path):
    """It names the histories; curves are on the page only, as those of figures."""
    for interactive in (False, True):
        write_report(charted(), tmp_path / str(interactive), interactive=interactive)
    one, two = (tmp_path / str(i) / "report.json" for i in (False, True))
    assert one.read_bytes() == two.read_bytes()
    items = json.loads(one.read_text(encoding="utf-8"))["sections"]["charts"]["items"]
    assert [item["kind"] for item in items] == ["figure", "history", "history", "history"]
    assert "signals" not in items[1]


def test_the_policy_allows_the_charts_by_hash_and_nothing_else():
    """One style and one script that runs; uPlot and its licence are in them, whole."""
    page = render_html(charted(), interactive=True)
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    policy = policy.replace("&#39;", "'")
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    for tag in ("style", "script"):
        (text,) = re.findall(rf"<{tag}>(.*?)</{tag}>", page, flags=re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert rules[f"{tag}-src"] == f"'sha256-{digest}'"
    (script,) = re.findall(r"<script>(.*?)</script>", page, flags=re.DOTALL)
    for name in ("uPlot.iife.min.js", "LICENSE"):
        assert (VENDOR / name).read_text(encoding="utf-8") in script
    assert (VENDOR / "uPlot.min.css").read_text(encoding="utf-8") in page
    assert not [a for _, a in Reader(page).tags if "style" in a]


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_are_data_and_no_markup(name):
    """The elements are those of plain names, and the script reads the names as they are."""
    text = HOSTILE[name]
    plain, page = (render_html(charted(t), interactive=True) for t in ("plain", text))
    assert [tag for tag, _ in Reader(page).tags] == [tag for tag, _ in Reader(plain).tags]
    waves, odd, empty = held(page)
    assert waves["names"] == [f"wave {i}: {text}" for i in range(3)]
    assert waves["unit"] == odd["names"][0] == text
    assert empty["data"] == [[0.0, 1.0]]


def test_numbers_have_six_digits_and_gaps_are_null():
    """Short histories are there in full; infinities and NaN are gaps, never zero."""
    ladder, nothing, constant = chart(charted().sections[0].items[2])["data"][1:]
    assert ladder == [0.5, -1e-12, 12, 3.0, None, None, -7, 1e300]
    assert nothing == [None] * 8
    assert constant == [2.0] * 8
    words = {"key": "k", "caption": "", "description": ""}
    made = chart(History(time=[0, 1], signals={"y": [np.pi, -1e9 / 7]}, **words))
    assert made["data"][1] == [3.14159, -142857000.0]


@given(
    st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 5000), st.integers(100, 800),
    st.floats(0, 1),
)  # fmt: skip
def test_thinning_loses_no_extreme_and_no_gap(seed, number, length, count, gaps):
    """At most `count` samples in order, with both ends, and of each signal what matters."""
    random = np.random.default_rng(seed)
    signals = random.standard_cauchy((number, length))
    start = random.integers(length)
    signals[0, start : start + int(gaps * length)] = np.nan
    kept = thinned(signals, count)
    assert len(kept) <= max(count, 6 * number)
    assert np.all(np.diff(kept) > 0)
    assert (kept[0], kept[-1]) == (0, length - 1)
    if length <= count:
        assert len(kept) == length
    for y in signals:
        assert np.isnan(y[kept]).any() == np.isnan(y).any()
        if not np.isnan(y).all():
            assert np.nanmin(y[kept]) == np.nanmin(y)
            assert np.nanmax(y[kept]) == np.nanmax(y)


def test_a_spike_in_a_long_run_is_drawn_at_its_time():
    """One sample among a hundred thousand; the others stay close together everywhere."""
    t = np.linspace(0, 100, 100_001)
    y, e = np.sin(t), np.zeros_like(t)
    e[31_416] = 5.0
    words = {"key": "k", "caption": "", "description": ""}
    time, _, kept = chart(History(time=t, signals={"y": y, "e": e}, **words))["data"]
    assert len(time) <= 2000
    assert time[kept.index(5.0)] == 31.416
    assert np.max(np.diff(time)) <= 0.11


@each_row(
    ("wrong", "said"),
    [
        ({"signals": {"y": [1.0]}}, r"signal 'y' of history 'k' has shape \(1,\), its time \(2,\)"),
        ({"time": [1, 0]}, "increasing"),
        ({"shown": ["z"]}, "unknown signal 'z'; known: 'y'"),
    ],
)
def test_a_history_that_cannot_be_drawn_is_refused(wrong, said):
    """Where it is made, by the signal's name."""
    right = {"key": "k", "caption": "", "description": "", "time": [0, 1], "signals": {"y": [1, 2]}}
    with pytest.raises(UsageError, match=said):
        History(**right | wrong)


@pytest.mark.slow
def test_the_paper_has_a_history_of_each_example():
    """Its signals are those of the run, beside figures of the same."""
    runs = made_up_runs()
    sections = {s.key: s.items for s in paper_report(runs).sections}
    for number in (1, 2):
        *still, history = sections[f"example-{number}"]
        assert isinstance(still[-1], Figure)
        assert list(history.signals) == ["y", "yd", "e", "u", "v", "zeta"]
        for name, samples in history.signals.items():
            np.testing.assert_array_equal(samples, runs[str(number)].signals[name])


def test_a_study_has_a_history_of_its_nominal_and_its_worst_run():
    """Beside the fans, which show them as well; a run that ended has gaps."""
    t = np.linspace(0, 1, 5)
    nominal, worst = np.exp(-t), np.array([1, 9, np.nan, np.nan, np.nan])
    fans, history = fan_items(
        Histories(
            time=t, signals={"y": np.array([nominal, worst])}, nominal={"y": nominal},
            worst={"y": worst}, margin=-3.0, ended=1,
        ),
        "study",
    )  # fmt: skip
    assert isinstance(fans, Figure)
    assert (history.key, list(history.signals)) == ("study-history", ["y, nominal", "y, worst"])
    assert chart(history)["data"][2] == [1.0, 9.0, None, None, None]


@pytest.mark.weekly
@pytest.mark.ci
def test_the_command_writes_an_interactive_page_of_a_study(tmp_path, monkeypatch):
    """With ``--interactive`` only; the page says what makes it again."""
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path)
    for more in ((), ("--interactive",)):
        result = CliRunner().invoke(app, ["report", path.name, "--jobs", "1", *more])
        assert result.exit_code == 0, result.output
        page = (tmp_path / "reports" / "study" / "index.html").read_text(encoding="utf-8")
        assert len(held(page)) == len(more)
        assert ("<code>nlctl report study.toml --interactive</code>" in page) is bool(more)
    assert held(page)[0]["names"] == ["y, nominal", "y, worst", "z, nominal", "z, worst"]
    assert held(page)[0]["shown"] == [True, True, False, False]
