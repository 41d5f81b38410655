"""A page about a loop of one's own: what is given stands on it as text, of that loop alone."""

import html
import html.parser
import json
import re

import control as ct
import numpy as np
import pytest
import studies_example
from matplotlib.figure import Figure as Picture
from rows import each_row

import nlctl
from nlctl.analysis.loop_checks import checks_of
from nlctl.analysis.loop_report import loop_report
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.report import (
    Claim,
    Figure,
    Paragraph,
    Section,
    Table,
    framed,
    render_html,
    write_report,
)
from nlctl.analysis.studies import read_study, run

TIMES = np.linspace(0, 2, 41)
EVIL = '<script>alert("x")</script><b onload=y>&amp;'


def decay(rate=1.0, name="decay"):
    plant = ct.nlsys(
        lambda t, x, u, params: -params["rate"] * x,
        None,
        states=["x"],
        inputs=["u"],
        params={"rate": rate},
        name="plant",
    )
    scale = ct.ss([], [], [], [[2.0]], inputs=["x"], outputs=["y"], name="scale")
    return ct.interconnect(
        [plant, scale], connections=[["scale.x", "plant.x"]], inplist=["plant.u"],
        outlist=["plant.x", "scale.y"], outputs=["x", "y"], inputs=["u"], name=name,
    )  # fmt: skip


LOOP = decay()
RESPONSE = nlctl.input_output_response(LOOP, TIMES, 0, [1.0])


class Page(html.parser.HTMLParser):
    """Tags and text of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text, self.now = [], {}, ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.now = tag

    def handle_data(self, data):
        self.text.setdefault(self.now, []).append(data)


def test_what_was_computed_is_on_the_page_and_in_the_file(tmp_path):
    """x = exp(-t) from 1, y = 2 x: the table has the closed form's ends."""
    made = loop_report(LOOP, title="Decay", response=RESPONSE, author="A. B.", revision="C")
    page = write_report(made, tmp_path)
    kept = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert kept["numbers"]["run"]["y"]["last"] == pytest.approx(2 * np.exp(-2), rel=1e-5)
    assert kept["numbers"]["run"]["x"]["largest"] == 1.0
    text = page.read_text(encoding="utf-8")
    shown = Page(text)
    assert "".join(shown.text["h1"]).strip() == "Decay"
    assert re.search(r'<p class="byline">A. B., Revision C</p>', text)
    assert [part["title"] for part in kept["sections"].values()][:2] == [
        "The loop", "The equations of the loop",
    ]  # fmt: skip


@pytest.mark.slow
def test_a_certificate_stands_on_the_page_with_its_constants():
    """What is proved, each constant with its status; one of another loop is refused."""
    plant = nlctl.PureFeedback(order=1, f=lambda x, v: 2.0 * x[0] + v)
    weights = nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=5.0, sigma_1=0.2)
    blocks = {
        "reference": nlctl.SumOfSines(order=0),
        "plant": plant,
        "controller": nlctl.mrac(
            nlctl.controllers.ReferenceModel(a=(1.0,), b=1.0), weights=weights
        ),
        "actuator": nlctl.Gain(),
    }
    loop = nlctl.interconnect(blocks, outputs=["x1"], name="adaptive <loop>")
    found = certify(loop)
    made = loop_report(loop, title="Adaptive", certificate=found)
    text = re.sub(r"\s+", " ", html.unescape(re.sub("<[^>]*>", " ", render_html(made))))
    assert found.verdict in made.verdict
    for constant in found.constants:
        assert constant.symbol in text
        assert f"{constant.value:.6g}" in text.replace("−", "-")
    other = nlctl.interconnect(
        {**blocks, "actuator": nlctl.Gain(k=2.0)}, outputs=["x1"], name="adaptive <loop>"
    )
    with pytest.raises(nlctl.errors.DiagramError, match=r"actuator.k was 1.0, now 2.0"):
        loop_report(other, title="A namesake", certificate=found)
    with pytest.raises(nlctl.errors.DiagramError, match="is of another loop 'adaptive <loop>'"):
        loop_report(LOOP, title="Decay", certificate=found)


def test_nothing_that_is_given_is_markup():
    """Title, author, revision, sections, tables, claims, figures; also in a notebook's frame."""
    own = Section(
        key=EVIL,
        title=EVIL,
        items=[
            Paragraph(text=EVIL, code=EVIL),
            Table(caption=EVIL, columns=[EVIL], rows=[[EVIL]], status=EVIL),
            Figure(key=EVIL, caption=EVIL, description=EVIL, figure=Picture()),
        ],
    )
    claim = Claim(text=EVIL, measured=EVIL, limit=EVIL, holds=True, evidence=EVIL, status=EVIL)
    made = loop_report(
        decay(name="of <b>"), title=EVIL, sections=[own], claims=[claim], author=EVIL,
        revision=EVIL, date=EVIL, question=EVIL, verdict=EVIL, references=[EVIL], command=EVIL,
    )  # fmt: skip
    tags = Page(render_html(made)).tags
    assert [name for name, _ in tags].count("script") == 1
    assert not any(key.startswith("on") for _, attrs in tags for key in attrs)
    frame = Page(framed(made)._repr_html_()).tags
    assert [name for name, _ in frame] == ["iframe"]
    assert frame[0][1]["sandbox"] == "allow-scripts"
    assert frame[0][1]["srcdoc"] == render_html(made)


def test_a_report_without_author_has_no_byline():
    """No line of nothing below its title; and without a command it says so."""
    plain = render_html(loop_report(LOOP, title="Decay"))
    assert 'class="byline"' not in plain
    assert "no command was given" in plain


@pytest.mark.slow
def test_the_same_report_is_the_same_to_the_byte():
    """No time and no place is in it."""
    once, again = (
        render_html(loop_report(LOOP, title="Decay", response=RESPONSE, revision="1"))
        for _ in range(2)
    )
    assert once == again


@pytest.mark.slow
@each_row(
    ("given", "words"),
    [
        (
            {"response": nlctl.input_output_response(nlctl.paper.example_1(), TIMES)},
            "has 2 st|1 st",
        ),
        ({"response": RESPONSE, "signals": ["z"]}, "unknown output 'z'"),
        ({"study": "study"}, "another loop than 'decay'"),
        ({"ledger": "ledger"}, "the ledger is of another loop 'example_1' than 'decay'"),
    ],
)
def test_what_is_of_another_loop_is_refused(given, words, tmp_path_factory):
    """By name, with what differs."""
    if "study" in given:
        given = {"study": studied(tmp_path_factory.mktemp("study"))}
    if "ledger" in given:
        from nlctl.analysis.lyapunov import ledger

        given = {"ledger": ledger(nlctl.paper.example_1(), 1.0)}
    with pytest.raises(
        nlctl.errors.DiagramError if "signals" not in given else nlctl.errors.UnknownNameError
    ) as e:
        loop_report(LOOP, title="Decay", **given)
    assert re.search(words, str(e.value))


def test_values_of_a_run_that_are_not_the_loops_are_told():
    """A run says its own parameters; where it is said to have had others it is refused."""
    loop = nlctl.paper.example_1()
    response = nlctl.input_output_response(loop, TIMES, params={"law.beta": 3.0})
    made = loop_report(loop, title="Decay", response=response)
    assert set(made.numbers["run"]) == set(loop.output_labels)
    told = render_html(made).replace("\N{NO-BREAK SPACE}", " ")
    assert "This run has values of its own: law.beta = 3.0." in told
    with pytest.raises(nlctl.errors.DiagramError, match=r"params=\{...\}"):
        loop_report(loop, title="Decay", response=response, params={"law.beta": 4.0})


@pytest.mark.slow
def test_the_ledger_of_a_namesake_is_refused():
    """Of the same name, blocks and wires, with one other value: the sentence names it."""
    from nlctl.analysis.lyapunov import ledger

    one = nlctl.paper.example_1()
    other = nlctl.paper.example_1(actuator=nlctl.DeadZone(b_r=0.6))
    found = ledger(other, 0.2)
    assert loop_report(other, title="Its own", ledger=found).verdict
    with pytest.raises(nlctl.errors.DiagramError, match=r"actuator.b_r was 0.6, now 0.5"):
        loop_report(one, title="A namesake", ledger=found)


def studied(folder):
    return run(read_study(studies_example.write(folder)), folder / "run")


@pytest.mark.slow
def test_a_study_of_the_loop_is_a_part_of_its_page(tmp_path):
    """Its claims have their evidence on the page."""
    result = studied(tmp_path)
    loop = read_study(tmp_path / "study.toml").experiment.build()
    made = loop_report(loop, title="Decay", study=result)
    page = render_html(made)
    links = re.findall(r'<a href="#([^"]+)" aria-label="evidence', page)
    assert links
    assert all(f'id="{link}"' in page for link in links)
    assert [claim.text for claim in made.claims] == [f.claim for f in result.claims]


@pytest.mark.parametrize(
    ("blocks", "found"),
    [
        ({"lag": nlctl.Lag()}, "nothing switches"),
        ({"zone": nlctl.DeadZone(), "lag": nlctl.Lag()}, "2 conditions of blocks located"),
    ],
    ids=["smooth", "dead zone"],
)
def test_what_switches_is_said_whoever_declares_it(blocks, found):
    """A dead zone has a kink at either end; a lag has none."""
    loop = nlctl.actuators.cascade(blocks)
    checks = checks_of(loop, nlctl.input_output_response(loop, TIMES, 1.0), {})
    (check,) = [check for check in checks if check.what == "Steps end where equations switch"]
    assert (check.found, check.status) == (found, "pass")


def test_a_run_that_slides_says_so_and_nothing_of_either_side_alone():
    """x' = 1/2 - sign(x) rests at 0: neither side has an equilibrium there."""
    friction = ct.nlsys(
        lambda t, x, u, p: 0.5 - np.sign(x), None, states=1, inputs=0, outputs=1, name="friction"
    )
    checks = checks_of(
        friction, nlctl.input_output_response(friction, np.linspace(0, 4, 41), 0, 1.0), {}
    )
    by_name = {check.what: check for check in checks}
    switches = by_name["Steps end where equations switch"]
    assert switches.status == "pass"
    assert "slides along sign of block 'friction'" in switches.found
    assert by_name["The run does not depend on its tolerances"].status == "pass"
    assert by_name["The state at the end is a stable equilibrium"].status == "not applicable"
