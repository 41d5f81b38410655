"""The page itself: policy, size, anchors, cells, statuses, what is shown of what was given."""

import base64
import dataclasses
import functools
import hashlib
import html.parser
import json
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jinja2 import Environment, UndefinedError, nodes
from matplotlib.figure import Figure as MatplotlibFigure
from places import SUPPORT
from rows import each_row

import nlctl.analysis.report
from nlctl.analysis.report import (
    Claim,
    Equation,
    Figure,
    Paragraph,
    Report,
    Section,
    Table,
    file_hashes,
    render_html,
    render_json,
    write_report,
)
from nlctl.analysis.report.outline import (
    LIGHTS,
    MEANINGS,
    claim_status,
    light,
    meanings,
    numeric,
    place_anchors,
    sort_key,
    summary,
)
from nlctl.analysis.report.outline import cells as cells_of
from nlctl.analysis.report.page import fill
from nlctl.analysis.report.svg import draw_ahead, shapes_svg, short_path, svg, svg_files
from nlctl.analysis.report.typography import pieces
from nlctl.errors import UsageError

HOSTILE = {
    "markup": "</script></style></title><img src=x onerror=\"window.__pwned='markup'\">",
    "attribute": "\"><svg onload=\"window.__pwned='attribute'\">' onclick='window.__pwned=1",
    "template": "{{ 7*7 }}{% raw %}{# #}${7*7}",
    "direction": "\u202eevil\u202c \u2067again\u2069 \u05e9\u05dc\u05d5\u05dd",
    "long": "x" * 10_000,
    "latex": r"\text{<script>window.__pwned='latex'</script>} \href{javascript:a=1}{y}",
    "link": "javascript:window.__pwned='link' doi 10.1000/x\"onclick=window.__pwned=1",
    "entity": "&lt;b&gt; &#x0003C;script> &amp;",
    "path": "../../etc/passwd",
}
LADDER = [0.5, -1e-12, 12, 3.0, float("inf"), float("nan"), -7, 1e300]


def drawn():
    """A figure with lines, a legend, a clipped picture and a formula."""
    figure = MatplotlibFigure(layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot([0, 1, 2], [0, 1, 0], label="a < b")
    left.legend()
    left.set(xlabel="time $t$ (s)", ylabel="$\\hat{\\delta}$")
    right.imshow(np.eye(3))
    right.annotate("away", (0, 0), url="javascript:window.__pwned=1")
    return figure


def every_kind(text="plain", key="key"):
    """A report with every kind of item, and `text` in every field that a user can name."""
    many = [(i, LADDER[i % 8], f"row {i}", "pass" if i % 3 else "fail") for i in range(40)]
    wide = Table(caption=f"Wide: {text}", columns=[f"{i}: {text}" for i in range(12)],
                 rows=[[text, *[0.1 * i for i in range(11)]], [text, *["short"] * 11]])  # fmt: skip
    long = Table(caption=f"Long: {text}", columns=["number", "value", text, "status"], rows=many,
                 status="status")  # fmt: skip
    statuses = [s for group in LIGHTS.values() for s in group] + [text]
    kinds = Table(caption="Statuses", columns=["status"], rows=[[s] for s in statuses],
                  status="status")  # fmt: skip
    formulas = [
        Equation(latex=r"\hat W^T = \begin{cases} a & b \\ c & d \end{cases}", number="(1)"),
        Equation(latex=text, number=text),
    ]
    figure = Figure(key=key, caption=text, description=text, figure=drawn())
    twin = dataclasses.replace(figure, figure=drawn())
    typed = Paragraph(text=text, code=text)
    return Report(
        title=text,
        verdict=text,
        claims=[
            Claim(text=text, measured=text, limit=text, holds=True, evidence=key, margin=text),
            Claim(text="b", measured="1", limit="2", holds=True, evidence="no", status="proved"),
            Claim(text="c", measured="1", limit="2", holds=False, evidence=key, status=text),
        ],
        sections=[
            Section(key=key, title=text, items=[typed, *formulas, figure]),
            Section(key=key, title=text, items=[wide, long, kinds, twin], level=3),
        ],
        command=text,
        provenance={text: text},
        inputs={text: text},
        numbers={text: {text: 1.0}},
        methods=[text],
        limits=[text],
        references=[text, "A. Author: Title. doi 10.1007/978-3-319-70136-3_22."],
        files={text: "0" * 64},
    )


@functools.cache
def page_of(text="plain"):
    """The page of that report."""
    return render_html(every_kind(text, "key" if text == "plain" else text))


class Reader(html.parser.HTMLParser):
    """Collects what a browser would take for elements, ids and text."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.text, self.scripts, self.styles, self.inside = [], "", [], [], ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.inside = tag
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        kept = {"script": self.scripts, "style": self.styles}.get(self.inside)
        if kept is not None:
            kept.append(data)
        else:
            self.text += data


def test_policy_allows_this_style_and_this_script_by_hash_and_nothing_else():
    """The hashes are those of the bytes between the tags."""
    page = page_of()
    (policy,) = (a["content"] for t, a in Reader(page).tags
                 if a.get("http-equiv") == "Content-Security-Policy")  # fmt: skip
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    for tag in ("style", "script"):
        (text,) = re.findall(rf"<{tag}>(.*?)</{tag}>", page, flags=re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert rules[f"{tag}-src"] == f"'sha256-{digest}'"
    assert rules["img-src"] == rules["font-src"] == "data:"


def test_no_inline_style_no_event_and_no_address_but_dois():
    """What the policy would block is not on the page at all."""
    page = page_of()
    for tag, attributes in Reader(page).tags:
        assert "style" not in attributes, tag
        assert not [name for name in attributes if name.startswith("on")]
        assert attributes.get("href", "#")[:1] == "#" or attributes["href"].startswith(
            ("https://doi.org/10.", "data:image/png;base64,")
        )
    assert set(re.findall(r"https?://[^/\s\"']*", page)) == {"https://doi.org"}


def test_the_shell_is_under_60_kilobytes():
    """Style, script, font and frame of a report that shows nothing."""
    empty = Report(title="t", verdict="v", claims=[], sections=[], command="c")
    assert len(render_html(empty).encode()) < 60_000


APART = ("latex", "long")  # a formula that can be read, and what would hide the others
TOGETHER = [text for name, text in HOSTILE.items() if name not in APART]


@pytest.mark.parametrize(
    "texts", [TOGETHER, *(pytest.param([HOSTILE[n]], marks=pytest.mark.ci) for n in APART)]
)
def test_whatever_a_user_names_is_shown_and_is_no_markup(texts):
    """In every field: same elements as with plain text, and the text in full."""
    text = " ".join(texts)
    plain, read = Reader(page_of()), Reader(page_of(text))
    assert read.scripts == plain.scripts
    assert read.styles == plain.styles
    extra = {tag for tag, _ in read.tags} - {tag for tag, _ in plain.tags}
    assert extra <= {"mtext", "mspace", "mo", "mn", "msub"}
    for _, attributes in read.tags:
        assert not [n for n in attributes if n.startswith("on") or n == "style"]
        assert "javascript:" not in attributes.get("href", "")
    assert read.text.count(text) >= 25
    assert json.loads(render_json(every_kind(text, text)))["title"] == text


def test_control_characters_and_broken_characters_cost_no_report(tmp_path):
    """They are shown as a replacement, or spelt out; the file is UTF-8."""
    page = write_report(every_kind("a\x00b\x07\ud800"), tmp_path).read_text(encoding="utf-8")
    assert "a\ufffdb\ufffd\\ud800" in page


@pytest.mark.ci
@given(st.lists(st.text(max_size=8), min_size=1, max_size=6))
def test_anchors_are_unique_and_harmless_whatever_the_keys(keys):
    """Letters, digits, dots, dashes; equal keys get a number."""
    figure = MatplotlibFigure()
    sections = [
        Section(key=k, title=k, items=[Figure(key=k, caption="", description="", figure=figure)])
        for k in [*keys, "provenance", "claims"]
    ]
    empty = Report(title="", verdict="", claims=[], sections=sections, command="")
    placed = place_anchors(empty)
    anchors = [p.anchor for p in placed] + [a for p in placed for a, _, _ in p.items]
    assert len(set(anchors)) == len(anchors)
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+", a) for a in anchors)
    assert not {"provenance", "claims", "contents"} & set(anchors)


@pytest.mark.slow
def test_every_id_is_unique_and_every_link_inside_leads_to_one():
    """Also with two sections and two figures of the same key."""
    for text in ("plain", HOSTILE["markup"]):
        tags = Reader(page_of(text)).tags
        ids = [a["id"] for _, a in tags if "id" in a]
        assert len(ids) == len(set(ids))
        named = {i for _, a in tags for i in a.get("aria-labelledby", "").split()}
        assert named <= set(ids)
        for _, attributes in tags:
            if attributes.get("href", "").startswith("#"):
                assert attributes["href"][1:] in ids
            for value in attributes.values():
                for target in re.findall(r"url\(#([^)]*)\)", value or ""):
                    assert target in ids


def test_frames_of_legends_follow_the_theme_and_white_text_stays_white():
    """A dark page has dark legends; a white number on a dark cell is white on every page."""
    figure = drawn()
    figure.axes[1].text(1, 0, "7", color="white")
    frame = Figure(key="k", caption="c", description="d", figure=figure)
    root = ElementTree.fromstring(svg(frame, *svg_files([frame.figure]), "k", {}))
    framed = [e for e in root.iter() if e.get("fill") == "var(--page)"]
    assert {e.tag for e in framed} == {"path"}
    assert [e.tag for e in root.iter() if e.get("fill") == "#ffffff"] == ["g"]
    assert not [e for e in root.iter() if e.get("style")]
    assert {e.tag for e in root.iter()}.isdisjoint({"style", "metadata", "script"})


@given(st.lists(st.tuples(st.floats(-900, 900), st.floats(-900, 900)), min_size=2, max_size=9))
def test_short_paths_go_through_the_same_points(points):
    """Lines in steps that add up to a tenth of a point, curves to a hundredth; both shorter."""
    pairs = [f"{x:.6f} {y:.6f}" for x, y in points]
    lines, curves = ("M " + joint.join(pairs) for joint in (" \nL ", " \nQ 0.125 0.125 "))
    short = short_path(lines + " z")
    steps = np.array([float(n) for n in re.findall(r"-?[\d.]+", short)]).reshape(-1, 2)
    np.testing.assert_allclose(np.cumsum(steps, axis=0), points, atol=0.0501)
    assert short[0] == "m"
    assert len(short) <= len(lines)
    read, written = (
        [float(n) for n in re.findall(r"-?[\d.]+", path)] for path in (short_path(curves), curves)
    )
    np.testing.assert_allclose(read, written, atol=0.00501)


def test_a_closed_path_goes_on_from_where_it_began():
    """Two squares in one path, the second written after the first has been closed."""
    squares = "M 1 1 L 2 1 L 2 2 z M 5 5 L 6 5 L 6 6 z"
    assert short_path(squares) == "m1 1 1 0 0 1zm4 4 1 0 0 1z"


def test_letters_are_drawn_once_for_all_figures_of_a_page():
    """A second figure adds no shapes, and every letter refers to one that there is."""
    shapes = {}
    once = Figure(key="k", caption="c", description="d", figure=drawn())
    files = svg_files([once.figure, drawn()])
    first = svg(once, files[0], "first", shapes)
    count = len(shapes)
    second = svg(once, files[1], "second", shapes)
    assert len(shapes) == count > 10
    ids = set(re.findall(r' id="([^"]*)"', shapes_svg(shapes)))
    for drawing in (first, second):
        assert set(re.findall(r'<use href="#([^"]*)"', drawing)) <= ids
    assert first.replace("first", "second") == second


@pytest.mark.weekly
def test_a_pool_that_helps_with_drawing_changes_no_byte():
    """Figures are the same files wherever they are drawn, and in the same order."""

    def figures():  # a layout that is computed again differs in the last digit
        for i in range(4):
            figure = drawn()
            figure.axes[0].set_title(f"number {i}")
            yield figure

    alone = svg_files([*figures()])
    assert len(set(alone)) == 4
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert svg_files([*figures()], pool) == alone
        early = [*figures()]
        done = dict(zip(early[1:3], alone[1:3], strict=True))
        assert svg_files(early, pool, done) == alone
    assert svg_files(early[1:3], drawn=done) == alone[1:3]


def test_templates_refuse_what_is_missing_and_let_no_markup_through():
    """A name that nobody gave is an error and no gap; no filter turns escaping off."""
    with pytest.raises(UndefinedError, match="is undefined"):
        fill("report.html")
    environment = Environment(autoescape=True)
    templates = Path(nlctl.analysis.report.__file__ or "").parent / "templates"
    found = sorted(templates.glob("*.html"))
    assert found
    for template in found:
        parsed = environment.parse(template.read_text(encoding="utf-8"))
        assert "safe" not in {node.name for node in parsed.find_all(nodes.Filter)}
        assert not [*parsed.find_all(nodes.EvalContextModifier)]


@pytest.mark.slow
def test_what_is_drawn_ahead_is_drawn_once_and_in_the_same_bytes():
    """Until something else is to be done; a figure that is drawn is not drawn again."""
    kept = [Figure(key=str(i), caption="c", description="d", figure=drawn()) for i in range(4)]
    text = Paragraph(text="No figure.")
    sections = [
        Section(key="a", title="A", items=[text, *kept[:2]]),
        Section(key="b", title="B", items=kept[2:]),
    ]
    asked = iter((False, False, False, True))
    early = draw_ahead(sections, until=lambda: next(asked))
    assert [*early] == [figure.figure for figure in kept[:3]]
    for figure in early:
        figure.clear()  # drawn again it would be empty
    *before, last = svg_files([figure.figure for figure in kept], drawn=early)
    assert before == [last] * 3
    assert draw_ahead(sections, until=lambda: True) == {}


def numbers_in(value):
    """All numbers of a JSON document, also those that stand as text."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return {n for v in value for n in numbers_in(v)}
    key = sort_key(value)
    return {key} if key else set()


def test_every_numeric_cell_of_the_page_is_in_the_json_file():
    """To the last digit, and the texts of claims and tables too."""
    report = every_kind()
    cells = [a["data-value"] for t, a in Reader(page_of()).tags if "data-value" in a]
    content = json.loads(render_json(report), parse_constant=lambda name: pytest.fail(name))
    assert len(cells) > 80
    assert set(cells) <= numbers_in(content["sections"]) | numbers_in(content["provenance"])


@given(st.floats() | st.integers(-(10**9), 10**9))
def test_sort_keys_are_the_numbers_themselves(number):
    """As a number and as text, with either minus; NaN stays NaN."""
    for value in (number, repr(number), repr(number).replace("-", "−"), np.float64(number)):
        key = sort_key(value).replace("Infinity", "inf")
        np.testing.assert_equal(float(key), float(number))


@each_row("value", ["", "abc", "1 s", True, np.True_, None, [1]])
def test_what_is_no_number_has_no_sort_key(value):
    """Units, words, truth values."""
    assert sort_key(value) == ""


def test_numbers_that_are_not_finite_are_shown_as_such():
    """Infinity is a sign and NaN a word, also as formatted text; they sort as numbers."""
    table = Table(caption="", columns=["a", "b"], rows=[(np.nan, "-inf"), (-np.inf, "nan")])
    shown = [[(cell.text, cell.value) for cell in row] for row in cells_of(table)]
    assert shown == [[("NaN", "NaN"), ("−∞", "-Infinity")], [("−∞", "-Infinity"), ("NaN", "NaN")]]


def test_shares_are_numbers_and_empty_cells_spoil_no_column():
    """A column of numbers is one, also in % and where something is missing."""
    rows = [("5 %", 1.0, None, "a"), ("−0.5 %", None, "", ""), ("12 %", 2, None, "1")]
    assert [float(sort_key(row[0])) for row in rows] == [5.0, -0.5, 12.0]
    table = Table(caption="", columns=["share", "some", "none", "words"], rows=rows)
    assert numeric(table) == [True, True, False, False]


def test_the_page_says_what_the_statuses_of_its_claims_mean():
    """Of those that it has, and of no others."""
    claim = Claim(text="", measured="", limit="", holds=True, evidence="", status="sampled")
    lost = dataclasses.replace(claim, holds=False)
    assert list(meanings([claim])) == ["sampled"]
    assert list(meanings([lost, claim])) == ["sampled", "fails"]
    assert meanings([dataclasses.replace(claim, status="wonderful")]) == {}
    usual = {status for look in ("proved", "checked") for status in LIGHTS[look]}
    assert usual <= set(MEANINGS)


def test_proved_and_checked_never_look_alike():
    """Nor does what failed, or what is open; unknown statuses are neutral."""
    assert len({light(s) for s in ("proved", "checked", "violated", "undecided", "pass")}) == 5
    assert light("wonderful") == "neutral"


@given(st.sampled_from([s for group in LIGHTS.values() for s in group] + ["", "fine"]))
def test_a_claim_that_does_not_hold_never_looks_well(status):
    """Whatever its status says, and neither does the report."""
    claim = Claim(text="", measured="", limit="", holds=False, evidence="", status=status)
    assert claim_status(claim)[1] in ("fail", "refuted", "caution")
    well = dataclasses.replace(claim, holds=True, status="proved")
    assert summary([well, claim])[0] in ("fail", "refuted", "caution")
    assert summary([well]) == ("pass", "The claim holds: 1 proved.")


def test_the_colour_says_whose_claim_fails():
    """A claim of the paper is refuted; one of the report's own fails, and outweighs it."""
    own = Claim(text="", measured="", limit="", holds=False, evidence="")
    paper = dataclasses.replace(own, by="the paper")
    good = dataclasses.replace(own, holds=True, status="proved")
    assert claim_status(paper) == ("refuted", "refuted")
    assert summary([paper, good]) == (
        "refuted",
        "1 claim of the paper is refuted; of ours 1 holds (1 proved).",
    )
    theirs = dataclasses.replace(paper, holds=True)
    assert summary([paper, theirs, theirs, good, good])[1] == (
        "1 claim of the paper is refuted, 2 hold; of ours all 2 hold (2 proved)."
    )
    assert summary([paper, own, good]) == ("fail", "1 of 3 claims fails.")
    assert summary([paper, dataclasses.replace(paper, by="a rumour")])[1] == (
        "2 claims are refuted."
    )
    assert claim_status(dataclasses.replace(paper, holds=True)) == ("holds", "pass")


def test_the_first_sentence_says_how_the_claims_are_known():
    """Sampled claims hold as sampled; without statuses nothing is said of it."""
    claim = Claim(text="", measured="", limit="", holds=True, evidence="")
    sampled, proved = (dataclasses.replace(claim, status=s) for s in ("sampled", "proved"))
    assert summary([sampled, proved, sampled])[1] == "All 3 claims hold: 2 sampled, 1 proved."
    assert summary([claim, claim])[1] == "All 2 claims hold."
    assert summary([])[0] == "neutral"


def test_a_claim_shows_its_margin_and_leads_to_its_evidence():
    """The margin has a column only where there is one; unknown evidence is told as text."""
    report = every_kind()
    page = Reader(page_of())
    assert "margin" in page.text
    links = [a["href"] for t, a in page.tags if a.get("aria-label", "").startswith("evidence")]
    assert links == ["#key", "#key"]
    bare = [dataclasses.replace(c, margin="") for c in report.claims]
    without = Reader(render_html(dataclasses.replace(report, claims=bare)))
    assert "margin" not in without.text


@each_row(
    ("text", "dois"),
    [
        ("see doi 10.1007/978-3-319-70136-3_22.", ["10.1007/978-3-319-70136-3_22"]),
        ("doi:10.1000/a, https://doi.org/10.1000/b)", ["10.1000/a", "10.1000/b"]),
        ("a 10.1000/x without its word, doi 10.1/short", []),
    ],
)
def test_dois_become_links_and_nothing_else_does(text, dois):
    """Full stops and brackets after them stay text."""
    assert [piece.doi for piece in pieces(text) if piece.doi] == dois


def test_ragged_rows_are_shown_in_full():
    """A row that is too short is filled up, one that is too long loses nothing."""
    table = Table(caption="c", columns=("a", "b"), rows=[(1.5,), (2.5, 3.5, 4.5)])
    section = Section(key="s", title="s", items=[table])
    report = Report(title="t", verdict="v", claims=[], sections=[section], command="c")
    cells = [a["data-value"] for _, a in Reader(render_html(report)).tags if "data-value" in a]
    assert cells == ["1.5", "2.5", "3.5", "4.5"]


@pytest.mark.slow
def test_hashes_are_those_of_the_files(tmp_path):
    """The page names each file with its SHA-256; two of one name are refused."""
    (tmp_path / "data.csv").write_bytes(b"1,2\n")
    hashes = file_hashes([tmp_path / "data.csv"])
    assert hashes == {"data.csv": hashlib.sha256(b"1,2\n").hexdigest()}
    with pytest.raises(UsageError, match="called 'data"):
        file_hashes([tmp_path / "data.csv", tmp_path / "data.csv"])
    page = write_report(dataclasses.replace(every_kind(), files=hashes), tmp_path)
    shown = page.read_text(encoding="utf-8")
    assert hashes["data.csv"] in shown
    assert hashlib.sha256((tmp_path / "report.json").read_bytes()).hexdigest() in shown


@pytest.mark.weekly
def test_every_kind_is_the_same_bytes_in_another_process(tmp_path):
    """Neither hash seeds nor time leave a trace, in claims, tables, formulas or figures."""
    code = (
        "import sys; sys.path[:0] = sys.argv[2:]; from test_report_page import *;"
        "write_report(every_kind('a <b> & c'), sys.argv[1])"
    )
    for seed in ("1", "2"):
        subprocess.run(
            [sys.executable, "-c", code, tmp_path / seed, Path(__file__).parent, SUPPORT],
            check=True,
            env={**__import__("os").environ, "PYTHONHASHSEED": seed},
        )
    for name in ("index.html", "report.json"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()
