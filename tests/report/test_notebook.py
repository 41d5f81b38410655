"""What notebooks show of results: their numbers, and whatever is named as text."""

import html.parser

import control as ct
import numpy as np
import pytest
import studies_example

import nlctl
from nlctl.analysis.lyapunov import certify, ledger
from nlctl.analysis.studies import read_study, run
from nlctl.host.notebook import table_html

EVIL = '<img src=x onerror="alert(1)">&amp;<script>'
TIMES = np.linspace(0, 2, 41)


class Shown(html.parser.HTMLParser):
    """Tags with attributes, and rows of cells."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.rows, self.told, self.now = set(), [], [], ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.add((tag, *attrs))
        self.now = tag
        self.rows += [[]] if tag == "tr" else []
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.now in ("td", "th"):
            self.rows[-1][-1] += data
        else:
            self.told.append(data)


def shown(thing):
    page = Shown(thing._repr_html_())
    assert page.tags <= {("p",), ("table",), ("tr",), ("th",), ("td",)}
    assert len({len(row) for row in page.rows}) == 1
    return page


def decay(name):
    return ct.nlsys(
        lambda t, x, u, params: -params["k"] * x, None, states=1, inputs=0, outputs=[name],
        params={"k": 1.0}, name="decay",
    )  # fmt: skip


def test_text_is_text():
    """Heading, titles and cells."""
    page = Shown(table_html(f"{EVIL}\n{EVIL}", [EVIL], [[EVIL]]))
    assert page.tags == {("p",), ("table",), ("tr",), ("th",), ("td",)}
    assert page.rows == [[EVIL], [EVIL]]
    assert page.told == [EVIL, EVIL]


def test_a_response_shows_the_range_of_each_output():
    """That of exp(-t), under a hostile name."""
    response = nlctl.input_output_response(decay(EVIL), TIMES, 0, [1.0], rtol=1e-9, atol=1e-12)
    (name, least, largest, last) = shown(response).rows[1]
    assert name == EVIL
    assert float(largest) == 1
    assert float(least) == float(last) == pytest.approx(np.exp(-2), rel=1e-5)


def test_traces_of_a_response_stand_side_by_side():
    """As python-control's own simulations of several inputs return them."""
    plant = ct.ss([[-1, 0], [0, -2]], np.eye(2), np.eye(2), 0, outputs=["a", EVIL])
    from nlctl.responses.time_response import as_response

    rows = shown(as_response(ct.step_response(plant, TIMES))).rows
    assert [row[0] for row in rows[1:]] == ["a", EVIL]
    assert all(row[1].count(",") == 1 for row in rows[1:])


def test_an_ensemble_shows_its_first_members():
    """As many as it prints, with what was varied."""
    many = nlctl.ensemble_response(
        nlctl.compile(nlctl.paper.example_1()), TIMES,
        params={"actuator.b_r": np.linspace(0.1, 1.0, 20)},
    )  # fmt: skip
    rows = shown(many).rows
    assert rows[0][1:] == [*many.table.columns]
    assert [float(row[1]) for row in rows[1:]] == pytest.approx(
        [*many.table["actuator.b_r"][:8]], rel=1e-5
    )


@pytest.mark.slow
def test_a_ledger_shows_each_line_with_its_status():
    """In its order."""
    found = ledger(nlctl.paper.example_1(), 1.0)
    rows = shown(found).rows[1:]
    assert [tuple(row[:2]) for row in rows] == [(line.key, line.status) for line in found.lines]


@pytest.mark.slow
def test_a_certificate_shows_each_constant_with_its_status():
    """Of every kind, and of one that proves nothing."""
    law, robust = (
        nlctl.controllers.KnownSignLaw(),
        nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5),
    )
    known = nlctl.adaptive_neural(2, law=law, robust=robust)
    sliding = nlctl.controllers.sliding_mode(law=nlctl.controllers.SlidingModeLaw(K=20.0))
    plant = nlctl.PureFeedback(order=1, f=lambda x, v: 2.0 * x[0] + v)
    blocks = {"reference": nlctl.SumOfSines(order=0), "plant": plant, "actuator": nlctl.Gain()}
    blocks["controller"] = nlctl.mrac(nlctl.controllers.ReferenceModel(a=(1.0,), b=1.0))
    for loop in (
        nlctl.paper.example_1(controller=known),
        nlctl.paper.example_1(controller=sliding),
        nlctl.paper.example_1(controller=sliding, actuator=nlctl.Gain()),
        nlctl.interconnect(blocks, outputs=["x1"]),
    ):
        found = certify(loop)
        page = shown(found)
        assert page.told == [found.verdict]
        assert [tuple(row[:1] + row[3:4]) for row in page.rows[1:]] == [
            (c.symbol, c.provenance) for c in found.constants
        ]
        assert str(found).splitlines()[0] == found.verdict


def test_a_study_shows_what_each_analysis_found(tmp_path):
    """Its title is text as well."""
    path = studies_example.write(tmp_path)
    title = 'title = "<b>A lag</b>"'
    text = path.read_text(encoding="utf-8").replace('title = "A lag"', title)
    path.write_text(text, encoding="utf-8")
    result = run(read_study(path), tmp_path / "run")
    page = shown(result)
    assert page.told[0] == "<b>A lag</b>"
    assert [row[3] for row in page.rows[1:]] == [f.sentence for f in result.findings]
