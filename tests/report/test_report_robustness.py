"""The report of a study: its numbers are those of the results, and what fails never looks well."""

import hashlib
import json
import unicodedata
import warnings
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from drawn import hidden
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.text import Text
from scipy import stats
from studies_example import LOOP

from nlctl.analysis import figures as figures
from nlctl.analysis.cli.study_report import report_study
from nlctl.analysis.cli.written_page import PageOptions
from nlctl.analysis.figures.labels import plain
from nlctl.analysis.pages.study.claims import claims, refusal, verdict
from nlctl.analysis.pages.study.histories import histories
from nlctl.analysis.pages.study.report import study_part, study_report, study_sections
from nlctl.analysis.pages.study.rows import margin_items, row_items
from nlctl.analysis.report import render_html, render_json
from nlctl.analysis.report.document import Figure, Paragraph, Section, Table
from nlctl.analysis.report.outline import claim_status, place_anchors
from nlctl.analysis.robustness import Space, Uncertain, confidence_sequence, independent, prepare
from nlctl.analysis.robustness.search.radius import size_of
from nlctl.analysis.robustness.stl.spec import FAILED
from nlctl.analysis.studies import load_result, read_study, run
from nlctl.analysis.studies.kind import headed, unanswered
from nlctl.analysis.studies.kinds import KINDS
from nlctl.analysis.studies.page import (
    deviations_table,
    margin_text,
    running,
    violate,
    without_assumptions,
)
from nlctl.errors import UsageError
from nlctl.plotting.bands import upper_envelope

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them

SPACE = """
loop = "loop.py:scaled"
[study]
title = "A lag that may run away"
question = "How often does y leave its band?"
seed = 7
[space]
"lag.rate" = { uniform = [0.5, 2.5] }
"lag.gain" = { uniform = [-0.2, 1.0] }
"lag.x(0)" = { uniform = [0.8, 1.2], unit = "1" }
[spec]
small = { formula = "always from 1 s on |y| <= 0.5", meaning = "y decays" }
bounded = "always |z| <= 4"
[time]
end = 2.0
step = 0.04
[metrics]
band = 0.2
error = "y"
control = "z"
actuated = ""
weights = ""
gain = ""
"""
EVERY = """
[faults]
"lag.y" = { bias = 0.1, gain = 2.0 }
[runs]
size = 128
[[analysis]]
kind = "probability"
limit = 0.5
[[analysis]]
kind = "sequential"
limit = 0.05
[[analysis]]
kind = "worst case"
runs = 60
limit = 0.0
[[analysis]]
kind = "radius"
quantities = ["lag.rate", "lag.gain"]
runs = 30
draws = 20
tolerance = 0.2
largest = 1.0
limit = 0.1
[[analysis]]
kind = "degradation"
factors = [0.0, 0.5, 1.0]
runs = 40
limit = 0.3
[[analysis]]
kind = "tornado"
[[analysis]]
kind = "morris"
trajectories = 6
[[analysis]]
kind = "sobol"
size = 16
of = "bounded"
[[analysis]]
kind = "regional"
[[analysis]]
kind = "failure map"
x = "lag.rate"
y = "lag.gain"
cells = 3
levels = 2
[[analysis]]
kind = "faults"
onset = 1.5
tolerates = ["lag.y bias"]
[[analysis]]
kind = "compare"
keyword = "scale"
options = { one = 1.0, more = 1.5, less = 0.8 }
runs = 40
metrics = { iae = "smaller", late_peak = "smaller" }
better = ["less", "one"]
[[analysis]]
kind = "tuning"
gains = { "lag.scale" = [0.2, 2.0] }
budget = 12
samples = 2
runs = 20
limit = 0.5
"""
HOSTILE = (
    "</script><img src=x onerror=alert(1)>",
    "{{7*7}} $\\frac{1}{$ \u202e\u0000 \U0001f600",
    "x" * 10_000,
)


def written(folder, text):
    (folder / "loop.py").write_text(LOOP, encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(SPACE + text)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("study")


@pytest.fixture(scope="module")
def result(folder):
    return run(read_study(written(folder, EVERY)), folder / "run")


@pytest.fixture(scope="module")
def prepared(folder, result):
    return prepare(read_study(folder / "study.toml").experiment)


@pytest.fixture(scope="module")
def kept(prepared, result):
    return histories(prepared, result.rows.table, most=50)


@pytest.fixture(scope="module")
def report(result, kept):
    return study_report(result, kept)


@pytest.fixture(scope="module")
def page(report):
    return render_html(report)


class Reader(HTMLParser):
    """Reads ids, text and element names of a page."""

    def __init__(self, page):
        super().__init__()
        self.ids, self.tags, self.text = [], Counter(), ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_data(self, data):
        self.text += data


def tables(report, key):
    (section,) = (s for s in report.sections if s.key == key)
    return [item for item in section.items if isinstance(item, Table)]


def tables_of(section):
    return [item for item in section.items if isinstance(item, Table)]


def column(table, title):
    return [row[table.columns.index(title)] for row in table.rows]


def numbers_in(values):
    return np.array([float(value) for value in values])


def test_every_analysis_has_a_section_that_is_not_empty(result, report, page):
    """A section for what was asked, the rows, the fans and each finding; all ids differ."""
    keys = [section.key for section in report.sections]
    assert keys[:3] == ["study_asked", "study_fans", "study_rows"]
    assert set(keys) == {
        "study_asked",
        "study_rows",
        "study_fans",
        "study_assumed",
        *(f.key for f in result.findings),
    }
    assert all(section.items for section in report.sections)
    read = Reader(page)
    assert len(read.ids) == len(set(read.ids))
    assert read.tags["figure"] == 1 + sum(  # and the picture at the top
        isinstance(i, Figure) for s in report.sections for i in s.items
    )
    told = [i.text for s in report.sections for i in s.items if isinstance(i, Paragraph)]
    brief = [without_assumptions(f.sentence) for f in result.findings]
    assert all(any(words in told_of for told_of in told) for words in brief)


def test_every_kind_of_analysis_has_title_and_methods(result):
    """The study of this module asks for all of them, and none has an empty text."""
    assert {asked.definition for asked in result.study.analysis} == set(KINDS)
    assert all(kind.title and kind.answers and kind.method for kind in KINDS)
    assert len({kind.title for kind in KINDS}) == len({kind.name for kind in KINDS}) == len(KINDS)


def test_the_rows_are_counted_as_they_are(result, report):
    """Statuses, violations by requirement and the worst rows, counted here in another way."""
    rows = result.rows.table
    status, spec, worst, values, metrics = tables(report, "study_rows")
    assert sum(column(status, "runs")) == len(rows)
    assert (
        dict(zip(column(status, "status"), column(status, "runs"), strict=True))["reached the end"]
        == (rows["status"] == "OK").sum()
    )
    for key, count in zip(column(spec, "requirement"), column(spec, "violations"), strict=True):
        assert count == len(rows) - (rows[key] > 0).sum()
    assert column(worst, "row") == list(rows["spec"].nsmallest(10).index)
    for row, command in zip(column(worst, "row"), column(worst, "again"), strict=True):
        assert command == f"nlctl replay {result.folder} {row}"
    for row, rate in zip(column(values, "row"), column(values, "lag.rate"), strict=True):
        assert rate == rows.loc[row, "lag.rate"]
    ended = rows[rows["status"] == "OK"]
    assert set(column(metrics, "missing")) == {len(rows) - len(ended)}
    largest = dict(zip(column(metrics, "metric"), column(metrics, "largest"), strict=True))
    assert largest["iae"] == ended["iae"].max()


def test_the_tables_show_the_numbers_of_the_findings(result, report):
    """To the digits that are printed."""
    (curve,) = tables(report, "degradation")
    found = result["degradation"].tables["curve"]
    assert column(curve, "violations") == list(found["violations"])
    np.testing.assert_allclose(numbers_in(column(curve, "to")), found["upper"], rtol=1e-3)
    (effects,) = tables(report, "morris")
    expected = result["morris"].tables["effects"]["mu_star"].sort_values(ascending=False)
    np.testing.assert_allclose(numbers_in(column(effects, "μ*")), expected, rtol=1e-3)
    (indices,) = tables(report, "sobol")
    table = result["sobol"].tables["indices"]
    assert set(column(indices, "quantity")) == set(table.index)
    np.testing.assert_allclose(
        numbers_in(column(indices, "S_T")), table.loc[column(indices, "quantity"), "ST"], rtol=1e-3
    )
    ranking, pairs, mcnemar, wins = tables(report, "compare")
    assert column(ranking, "option") == list(result["compare"].tables["ranking"].index)
    assert len(pairs.rows) == 2 * len(mcnemar.rows) == 6
    assert len(wins.rows) == 2 * 3


def test_json_holds_every_number(result, report):
    """Findings, short tables and the running estimate with all digits; every token is JSON."""
    content = json.loads(render_json(report), parse_constant=pytest.fail)["numbers"]
    for finding in result.findings:
        for name, table in finding.tables.items():
            shown = pd.DataFrame(content["tables"][finding.key][name]).set_index(
                [n or "index" for n in table.index.names]
            )
            for key, values in table.items():
                if pd.api.types.is_float_dtype(values):
                    np.testing.assert_array_equal(shown[key].astype(float), values)
    margins = result.rows.table["spec"].to_numpy()
    last = content["running estimate"]["probability"][-1]
    assert last["runs"] == margins.size
    assert last["violations"] == np.sum(~(margins > 0))
    assert last["violations"] == result["probability"].numbers["violations"]


def test_planted_violations_make_the_page_red(result, report, page):
    """Failing claims are named in the verdict; what holds is sampled, never proved."""
    looks = {c.evidence: claim_status(c) for c in report.claims}
    assert looks["worst-case"][1] == looks["sequential"][1] == "refuted"
    assert looks["probability"] == ("shown", "checked")
    assert not any(look == "proved" for _, look in looks.values())
    assert 'class="verdict refuted"' in page
    assert result["worst-case"].claim in report.verdict
    told, _, assumed = result["probability"].sentence.partition(" Assumed: ")
    assert f"{told} Assumptions: see “What is assumed”." in report.verdict
    (section,) = (s for s in report.sections if s.title == "What is assumed")
    words = [item.text.lower() for item in section.items]
    assert len(words) == len(set(words))
    assert all(f"{part}." in words for part in assumed.lower().removesuffix(".").split("; "))


def test_claims_point_to_sections(report):
    """Every claim links to its evidence."""
    anchors = {part.anchor for part in place_anchors(report)}
    assert {claim.evidence for claim in report.claims} <= anchors


def test_a_violation_that_is_not_confirmed_is_open(result):
    """It neither holds nor fails; undecided tests as well."""
    worst = result["worst-case"]
    doubted = replace(worst, answer="not shown yet")
    open_ = replace(result["sequential"], answer="not shown yet", needs="9 more runs")
    findings = [{"worst-case": doubted, "sequential": open_}.get(f.key, f) for f in result.findings]
    found = {c.evidence: claim_status(c) for c in claims(replace(result, findings=tuple(findings)))}
    assert found["worst-case"] == found["sequential"] == ("not shown yet", "caution")


@pytest.mark.parted
@pytest.mark.parametrize("kind", ["Sobol'", "Latin hypercube", "corners"])
def test_a_refused_guarantee_is_shown_with_its_reason(tmp_path, kind):
    """Rows that are no independent draws give no statement about a probability."""
    size = "" if kind == "corners" else "size = 8\n"
    file = read_study(written(tmp_path, f'[runs]\ndesign = "{kind}"\n{size}'))
    made = study_report(run(file, tmp_path / "run"))
    assert "no guarantee from a design of kind" in made.verdict
    assert "With confidence" not in made.verdict
    (section,) = (s for s in made.sections if s.key == "study_rows")
    assert kind in section.items[0].text
    assert "not an estimate of a probability" in section.items[0].text


@pytest.mark.weekly
@pytest.mark.ci
def test_an_analysis_without_an_answer_says_why(result):
    """Of whatever kind: its section and its claim have the reason, and the others are as ever.

    What the study claims of it is not refuted by that: it is not shown yet.
    """
    of = dict(zip((f.key for f in result.findings), result.study.analysis, strict=True))
    error = UsageError("the rows do not admit it")
    lost = {k: headed(k, asked, unanswered(asked, error)) for k, asked in of.items()}
    for gone in ({*lost}, {"sobol", "probability"}):
        findings = tuple(lost[f.key] if f.key in gone else f for f in result.findings)
        part = replace(result, findings=findings)
        made = study_report(part)
        assert render_html(made)
        sections = {section.key: section.items for section in made.sections}
        for key in gone:
            (words,) = sections[key]
            assert words.text == "Not answered: the rows do not admit it."
        told = {claim.evidence: claim for claim in made.claims if claim.evidence in gone}
        assert told.keys() == gone
        assert all(claim_status(c) == ("not shown yet", "caution") for c in told.values())
        own = {f.key: f.claim for f in result.findings if f.claim}
        assert {k: c.text for k, c in told.items() if k in own} == {
            k: claim for k, claim in own.items() if k in gone
        }
        lost_claims = [f for f in part.claims if f.key in gone]
        assert all(f.needs == "an answer: the rows do not admit it" for f in lost_claims)
        (found,) = tables_of(study_part([(part, None)])[1])
        said = dict(zip((f.key for f in findings), column(found, "found"), strict=True))
        assert all("do not admit it" in said[key] for key in gone)


def test_the_page_holds_the_study(result, report, page, tmp_path):
    """Saved beside its loop, what the page shows is read as the same study."""
    (tmp_path / "loop.py").write_text(LOOP, encoding="utf-8")
    (tmp_path / "study.toml").write_text(report.inputs["study.toml"], encoding="utf-8")
    assert read_study(tmp_path / "study.toml").study == result.study
    assert report.inputs["study.toml"] in Reader(page).text


@pytest.mark.weekly
def test_no_word_of_the_figures_is_hidden(report):
    """Labels and legends are whole, and lie on no curve, no bar and no other label."""
    made = {i.key: i.figure for s in report.sections for i in s.items if isinstance(i, Figure)}
    assert {key: hidden(figure) for key, figure in made.items() if hidden(figure)} == {}


def test_captions_name_what_is_drawn(result):
    """Nothing is said of violations and of an edge where there are none."""
    rows = result.rows.table
    for chosen, is_told in ((rows, True), (rows[rows["spec"] > 0], False)):
        (drawn,) = (i for i in margin_items(result, chosen, "k") if isinstance(i, Figure))
        assert ("Orange" in drawn.caption) is is_told
        assert ("did not reach their end" in drawn.caption) is is_told
    assert violate(1, 5) == "1 of 5 runs violates the spec"
    assert violate(0, 5) == "0 of 5 runs violate the spec"


def test_an_unfinished_study_says_so(result):
    """What is done is shown."""
    part = replace(result, findings=result.findings[:2], complete=False)
    made = study_report(part)
    assert made.verdict.startswith("Incomplete: 2 of 13 analyses done.")
    keys = [section.key for section in made.sections]
    assert keys == ["study_asked", "study_rows", "probability", "sequential", "study_assumed"]


def test_the_report_of_a_folder_is_that_of_the_run(folder, kept, report):
    """Loading loses nothing."""
    again = render_json(study_report(load_result(folder / "run"), kept))
    is_same = again == render_json(report)  # a diff of that length takes forever
    assert is_same


def test_data_files_have_their_hashes(result, report):
    """Everything that is named lies in the folder of the run."""
    assert "worst-case/rows.parquet" in report.files
    for name, digest in report.files.items():
        assert hashlib.sha256((result.folder / name).read_bytes()).hexdigest() == digest


def test_histories_are_the_solution(prepared, result, kept):
    """1 / x^2 = (1 / x0^2 - gain / rate) exp(2 rate t) + gain / rate, up to where it escapes."""
    rows = result.rows.table.iloc[:50]
    rate, gain, start = (rows[n].to_numpy()[:, None] for n in ("lag.rate", "lag.gain", "lag.x(0)"))
    with np.errstate(invalid="ignore"):
        inverse = (1 / start**2 - gain / rate) * np.exp(2 * rate * kept.time) + gain / rate
    exact = 1 / np.sqrt(np.where(inverse > 1e-4, inverse, np.nan))
    there = np.isfinite(exact)
    np.testing.assert_allclose(kept.signals["y"][there], exact[there], rtol=1e-3)
    assert kept.ended == (rows["status"] != "OK").sum() > 0
    assert np.isnan(kept.signals["y"][:, -1]).sum() == kept.ended
    assert kept.margin == result.rows.table["spec"].min()
    middle = np.sqrt(1 / ((1 - 0.05) * np.exp(4 * kept.time) + 0.05))
    np.testing.assert_allclose(kept.nominal["z"], 2 * middle, rtol=1e-4)


def test_a_witness_that_is_worse_is_the_worst_run(prepared, result):
    """A search may know a lower margin than the table."""
    row = {"lag.rate": 2.5, "lag.gain": -0.2}  # the rest is nominal
    for margin, taken in ((-1e9, True), (np.nan, True), (1.0, False)):
        made = histories(prepared, result.rows.table, (row, margin), most=2)
        assert bool(made.worst["y"][-1] < 0.01) is taken


@given(
    st.lists(st.one_of(st.just(np.nan), st.floats(-3, 3)), min_size=1, max_size=60),
    st.floats(0, 1),
)
def test_quantiles_hold_at_least_their_share(values, part):
    """At least that share of the runs lies below, where runs that ended count as lying above."""
    samples = np.array(values)[:, None]
    upper = figures.quantile(samples, part, np.inf)[0]
    inside = np.mean(np.where(np.isnan(samples), np.inf, samples) <= upper)
    assert inside >= part - 1e-12
    lower = figures.quantile(samples, part, -np.inf)[0]
    assert np.mean(np.where(np.isnan(samples), -np.inf, samples) >= lower) >= 1 - part - 1e-12


@given(st.lists(st.floats(-10, 10), min_size=2, max_size=80), st.integers(1, 20))
def test_bands_are_drawn_at_least_as_wide_as_they_are(values, stretches):
    """Lines between few samples lie nowhere below the curve."""
    y = np.array(values)
    nodes = np.unique(np.linspace(0, y.size - 1, stretches + 1).astype(int))
    drawn = upper_envelope(y, nodes)
    assert drawn.shape == nodes.shape
    assert np.all(np.interp(np.arange(y.size), nodes, drawn) >= y - 1e-12)


def test_running_estimate_is_the_confidence_sequence():
    """At every number of runs that is drawn, NaN being a violation."""
    space = Space(quantities=(Uncertain(name="a", law=stats.norm(0, 1)),))
    margins = np.random.default_rng(0).normal(1, 1, 300)
    margins[[3, 77]] = np.nan
    design = independent(space, 300, 0)
    curve = running(margins, 0.95)
    for n in (1, curve.index[40], 300):
        statement = confidence_sequence(design, margins[:n], 0.95)
        row = curve.loc[n]
        assert (row["violations"], row["low"], row["high"]) == (
            statement.violations,
            statement.lower,
            statement.upper,
        )


def test_the_figure_of_the_estimate_says_what_decides(report):
    """Exact bounds where the number of runs was fixed, the band in a sequential test."""
    figures = {i.key: i for s in report.sections for i in s.items if isinstance(i, Figure)}
    fixed, sequence = figures["probability-running"], figures["sequential-running"]
    assert "rests on the exact bounds at the end alone" in fixed.caption
    assert "rests on the band" in sequence.caption
    for shown, label in ((fixed, "exact bounds: decide"), (sequence, "bounds at all n: decide")):
        texts = [text.get_text() for text in shown.figure.findobj(Text)]
        assert [t for t in texts if t.endswith("decide")] == [label]


def test_nominal_values_that_violate_are_the_verdict(tmp_path):
    """Before anything else, as a refuted claim, without an empty chart."""
    asked = '[[analysis]]\nkind = "radius"\nruns = 20\nlimit = 0.5\n'
    path = written(tmp_path, asked)
    path.write_text(path.read_text().replace("|y| <= 0.5", "|y| <= 0.05"))
    made = run(read_study(path), tmp_path / "run")
    found = made["radius"]
    assert found.sentence.startswith("The nominal values violate the spec (margin -")
    assert (found.answer, found.numbers["upper"]) == ("refuted", 0.0)
    (section,) = (s for s in study_report(made).sections if s.key == "radius")
    assert not [item for item in section.items if isinstance(item, Figure)]


@given(st.lists(st.floats(-2, 2), min_size=2, max_size=2))
def test_the_largest_deviation_is_the_size_of_the_row(values):
    """Deviations in sides of the box against `size_of`."""
    space = Space(
        quantities=(
            Uncertain(name="a", bounds=(-1.0, 3.0), nominal=0.5),
            Uncertain(name="b", bounds=(0.0, 1.0), nominal=0.25),
        )
    )
    row = dict(zip("ab", values, strict=True))
    about = {
        q.name: {"nominal": q.nominal, "low": q.box[0], "high": q.box[1]} for q in space.quantities
    }
    found = deviations_table({"row": row}, pd.DataFrame.from_dict(about, orient="index"))["row"]
    assert np.max(np.abs(found)) == pytest.approx(size_of(space, row))
    assert np.all(np.sign(found) == np.sign([row[q.name] - q.nominal for q in space.quantities]))


def bars(figure, colour):
    """Return the total height of the bars of a colour."""
    from matplotlib.colors import to_rgb

    return sum(
        patch.get_height()
        for patch in figure.axes[0].patches
        if to_rgb(patch.get_facecolor()) == to_rgb(colour)
    )


def test_nan_and_failed_runs_are_drawn_as_violations():
    """Histogram, search, sizes and map: no NaN looks calm."""
    margins = np.array([np.nan, -1.5 * FAILED, -0.1, 0.0, 0.2, 0.4, 0.4])
    drawn = figures.margins_figure(margins)
    assert bars(drawn, "#D55E00") == 4
    assert bars(drawn, "#0072B2") == 3
    shown = figures.search(np.array([0.3, np.nan]), ["corners", "uniform"]).axes[0].lines[0]
    assert list(shown.get_ydata()) == [0.3, -figures.CLIP]
    steps = pd.DataFrame({"size": [0.5, 1.0], "margin": [0.3, np.nan]})
    assert list(figures.radius_steps(steps, np.inf).axes[0].lines[1].get_xdata()) == [1.0]
    points = pd.DataFrame({"a": [0.0, 1, 0, 1], "b": [0.0, 0, 1, 1], "spec": [1, 1, np.nan, 1]})
    made = figures.failure_map_figure(points, np.array([[0, 1, 2], [1, 3, 2]]), ("a", "b"))
    assert made.axes[0].images[0].get_array()[-1, 0] == pytest.approx(-1)


def test_nan_margins_are_violations_in_every_table(result):
    """Rows whose margins were lost count against the loop, and come first among the worst."""
    rows = result.rows.table
    rows.loc[[5, 9], ["small", "bounded", "spec"]] = np.nan
    before = len(rows) - int((rows["spec"] > 0).sum())
    items = list(row_items(result, rows, "rows"))
    assert items[0].text.startswith(f"{before} of {len(rows)} runs violate")
    made = [item for item in items if isinstance(item, Table)]
    assert column(made[1], "violations")[-1] == before
    assert column(made[1], "least margin") == ["NaN"] * 3
    assert column(made[2], "row")[:2] == [5, 9]
    assert column(made[2], "margin")[:2] == ["NaN", "NaN"]


def test_margins_of_runs_that_did_not_end_say_so():
    """Their grades are no margins."""
    assert margin_text(-1.2 * FAILED) == "did not end"
    assert margin_text(float("nan")) == "NaN"
    assert margin_text(-0.25) == "-0.25"


def test_no_sentence_has_the_grade_of_a_run_that_did_not_end(page):
    """The worst row of this study bursts: its grade lies between one and two times -FAILED."""
    text = Reader(page).text
    assert "the lowest margin is that of a run that did not reach its end" in text
    assert "integrations, none of which reaches its end." in text
    assert "the worst run that is known (the run did not end)" in text
    assert "·10⁶" not in text


def renamed(result, names):
    """Return the result with other names of the quantities."""

    def row(values):
        return {names.get(k, k): v for k, v in values.items()}

    findings = []
    for f in result.findings:
        numbers = dict(f.numbers)
        if numbers.get("witness"):
            numbers["witness"] = row(numbers["witness"])
        if "shrunk" in numbers:
            numbers["shrunk"] = numbers["shrunk"] | {"row": row(numbers["shrunk"]["row"])}
        numbers |= {k: names.get(numbers[k], numbers[k]) for k in "xy" if k in numbers}
        found = {k: t.rename(index=names, columns=names) for k, t in f.tables.items()}
        findings.append(replace(f, numbers=numbers, tables=found))
    held = result.rows.table.rename(columns=names)
    return replace(
        result,
        quantities=result.quantities.rename(index=names),
        rows=replace(result.rows, folder=None, held=held),
        findings=tuple(findings),
    )


def test_hostile_names_are_shown_and_do_nothing(result, kept):
    """In labels of figures, rows and columns of tables; glyphs that the font lacks do not warn."""
    quantities = dict(zip(result.quantities.index, HOSTILE, strict=True))
    options = dict(zip(("one", "more", "less"), HOSTILE, strict=True))
    bad = renamed(result, quantities | options)
    drawn = ("worst case", "morris", "failure map", "compare")  # every way of labelling
    analyses = [asked for asked in result.study.analysis if asked.kind in drawn]
    analyses[-1] = analyses[-1].model_copy(update={"better": (HOSTILE[2], HOSTILE[0])})
    study = result.study.model_copy(update={"analysis": tuple(analyses)})
    findings = tuple(finding for finding in bad.findings if finding.kind in drawn)
    bad = replace(bad, study=study, findings=findings)
    signals = {HOSTILE[1]: kept.signals["y"]}
    lines = {HOSTILE[1]: kept.nominal["y"]}
    odd = replace(kept, signals=signals, nominal=lines, worst=lines)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = render_html(study_report(bad, odd))
    read = Reader(made)
    assert read.tags["img"] == 0
    assert read.tags["script"] == 1
    assert HOSTILE[0] in read.text
    assert HOSTILE[2] in read.text
    assert len(read.ids) == len(set(read.ids))


@given(st.text(max_size=80))
def test_labels_of_figures_are_short_and_can_be_drawn(name):
    """Any text becomes at most 36 characters without control characters."""
    label = plain(name)
    assert len(label) <= 36
    assert not any(unicodedata.category(c).startswith("C") for c in label)


@pytest.mark.weekly
def test_commands_write_the_report(tmp_path, monkeypatch, capsys):
    """From a study file, which is run first and taken up again, or from a folder, loop or not."""
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, '[runs]\nsize = 20\n[[analysis]]\nkind = "probability"\n')
    page, found = report_study(path, PageOptions())
    assert page.parent == found.folder == (tmp_path / "reports" / "study").relative_to(tmp_path)
    first = page.read_text(encoding="utf-8")
    assert f"nlctl report {path}" in first
    page, again = report_study(found.folder, PageOptions(out=tmp_path / "page"))
    assert page == tmp_path / "page" / "index.html"
    listed = json.loads((tmp_path / "page" / "report.json").read_text(encoding="utf-8"))["files"]
    assert listed
    assert all((tmp_path / "page" / name).is_file() for name in listed)
    assert again.verdict == found.verdict
    after, shell = page.read_text(encoding="utf-8"), 'id="provenance"'
    is_same = first.partition(shell)[0] == after.partition(shell)[0]
    assert is_same
    assert "nlctl report reports/study" in after
    path.with_name("loop.py").unlink()
    page, _ = report_study(found.folder, PageOptions(out=tmp_path / "page"))
    assert "study_fans" not in page.read_text(encoding="utf-8")
    assert "the report has no fans" in capsys.readouterr().err


def test_studies_stand_side_by_side_in_another_report(result, kept):
    """Two studies have different anchors; each says what it found and what it does not show."""
    made = study_part([(result, kept), (result, None)])
    assert [section.level for section in made if section.level < 4] == [2, 3, 3, 3]
    keys = [i.key for s in made for i in s.items if isinstance(i, Figure)]
    assert len(keys) == len(set(keys)) == 5  # margins and map of both, fans of one
    (overview,) = (item for item in made[0].items if isinstance(item, Table))
    assert column(overview, "outcome") == ["refuted", "refuted"]
    found = column(tables_of(made[1])[0], "found")
    for finding, words in zip(result.findings, found, strict=True):
        assert words.startswith(without_assumptions(finding.sentence))
    limits = [item.text for item in made[-1].items]
    assert "nothing is proved" in " ".join(limits)
    assert len(limits) == len(set(limits))  # what both do not show is said once


def test_levels_and_prefix_reach_every_section(result):
    """Figures included."""
    for section in study_sections(result, prefix="p-", level=4):
        assert isinstance(section, Section)
        assert section.key.startswith("p-")
        assert section.level == 4
        assert all(i.key.startswith("p-") for i in section.items if isinstance(i, Figure))


def test_a_study_without_rows_has_a_verdict(result):
    """Nothing is said about a probability."""
    bare = replace(result, rows=None, findings=(), complete=True)
    assert refusal(bare) == ""
    assert verdict(bare) == "The study asks for no statement about a probability."
    assert [s.key for s in study_sections(bare, limits=False)] == ["study_asked"]
