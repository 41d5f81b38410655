"""A page that runs its loop: in Chromium, from a file, without a network."""

import json
import re

import numpy as np
import pytest
from command_line import nlctl_here
from extras import needed, needed_program
from matplotlib.figure import Figure as MatplotlibFigure

import nlctl
from nlctl.analysis.loop_report import loop_report
from nlctl.analysis.pages.live import live_item, live_program
from nlctl.analysis.paper.page.record import LV_2017
from nlctl.analysis.report import Figure, Report, Section, render_html, write_report
from nlctl.analysis.report.browser import BROWSERS
from nlctl.analysis.reproductions.live import with_parts_live
from nlctl.analysis.robustness import Requirement
from nlctl.analysis.robustness.stl.spec import violation_time
from nlctl.analysis.robustness.stl.text import parse_formula
from nlctl.errors import ParameterError

pytestmark = pytest.mark.browser

MOST = 150_000  # bytes that a page may be longer
ONSET = "fault_actuator_v.onset"
NAMES = ("fault_actuator_v", "plant.x1(0)", "controller.law.beta", "reference.frequencies[0]=0.5:2")
ASKED = ("always from 5 s on |r| <= 0.3", "always |u| <= 15", "eventually |e| <= 0.01")
TIMES = np.linspace(0.0, 20.0, 2001)


def requirement(key, text):
    return Requirement(key=key, formula=parse_formula(text), until=20.0)


REQUIREMENTS = [requirement(f"R{k}", text) for k, text in enumerate(ASKED, start=1)]


def faulty():
    fault = nlctl.Fault("actuator.v", "gain", 0.1, at=nlctl.faults.NEVER)
    return nlctl.with_faults(nlctl.paper.example_1(), fault)


@pytest.fixture(scope="module")
def report():
    needed("ziglang", "export")
    loop = faulty()
    return loop_report(
        loop, title="A loop that can be moved", requirements=REQUIREMENTS, live=NAMES,
        response=nlctl.input_output_response(loop, TIMES, 0.0),
        repeat=["nlctl", "simulate", "my loop.py:make"],
    )  # fmt: skip


@pytest.fixture(scope="module")
def page(report, tmp_path_factory):
    return write_report(report, tmp_path_factory.mktemp("live") / "page")


@pytest.fixture(scope="module")
def browser():
    program = needed_program(BROWSERS)
    with needed("playwright.sync_api", "browser").sync_playwright() as playwright:
        running = playwright.chromium.launch(
            executable_path=program, args=["--disable-quic", "--no-sandbox"]
        )
        yield running
        running.close()


@pytest.fixture
def opened(browser, page):
    """Open the page; what it complains of fails the test."""
    contexts, complaints = [], []

    def show(width=1200, scheme="light"):
        context = browser.new_context(
            viewport={"width": width, "height": 900}, color_scheme=scheme, offline=True
        )
        contexts.append(context)
        shown = context.new_page()
        shown.on("console", lambda message: complaints.append(message.text))
        shown.on("pageerror", lambda error: complaints.append(str(error)))
        shown.goto(page.as_uri())
        settled(shown)
        return shown

    yield show
    for context in contexts:
        context.close()
    assert complaints == []


def settled(shown):
    """Wait for a run that has ended."""
    shown.locator("figure.live .said", has_text=" steps, ").wait_for()


def numbers(shown):
    """Return least, largest and last value of the outputs, as the page has them."""
    rows = shown.locator(".live-numbers tr:has(td)").evaluate_all(
        "rows => rows.map(row => [row.cells[0].textContent,"
        " [...row.cells].slice(1).map(cell => Number(cell.dataset.value))])"
    )
    return dict(rows)


def again(shown, act):
    """Act, and wait for the run that this begins."""
    shown.evaluate("document.querySelector('figure.live').loop.say('')")
    act()
    settled(shown)


def test_the_page_begins_with_the_numbers_of_its_report(opened, page):
    told = json.loads((page.parent / "report.json").read_text(encoding="utf-8"))
    shown = numbers(opened())
    assert shown.keys() == told["numbers"]["run"].keys()
    for name, values in told["numbers"]["live"]["outputs"].items():
        np.testing.assert_allclose(shown[name], values, rtol=0, atol=1e-9)


def test_a_run_takes_no_time_that_is_noticed(opened):
    found = opened().evaluate("""() => {
        const { engine } = document.querySelector("figure.live").loop;
        return Array.from({ length: 40 }, () => {
            const from = performance.now();
            engine.begin({}, 1e-6);
            while (!engine.advance(2000));
            engine.finish();
            return performance.now() - from;
        });
    }""")
    print(f"Example 1, 20 s at 1e-6: {min(found):.1f} ms at best, {np.median(found):.1f} ms median")
    assert min(found) < 20.0


def test_a_fault_that_is_switched_on_says_which_requirement_falls_when(opened):
    shown = opened()
    assert shown.locator(".verdicts b.fail").count() == 0
    again(shown, shown.get_by_label("fault_actuator_v begins at").click)
    response = nlctl.input_output_response(faulty(), TIMES, 0.0, params={ONSET: 5.0})
    signals = dict(zip(response.output_labels, response.y, strict=True))
    expected = [violation_time(r, TIMES, signals) for r in REQUIREMENTS]
    found = shown.locator(".verdicts li").evaluate_all(
        "lines => lines.map(line => Number(line.dataset.at))"
    )
    assert np.isfinite(expected).tolist() == [True, True, False]
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert "falls at" in shown.locator(".verdicts li").first.inner_text()
    assert shown.locator("figure.live svg .falls").count() >= 1


def test_sliders_move_by_keys_and_the_command_repeats_the_run(opened):
    shown = opened()
    slider = shown.get_by_label("controller.law.beta", exact=True)
    slider.focus()
    again(shown, lambda: slider.press("ArrowRight"))
    beta = float(slider.input_value())
    field = shown.get_by_label("plant.x1(0), exact value")
    field.fill("0.81")
    again(shown, lambda: field.press("Enter"))
    command = shown.locator("figure.live code").text_content()
    assert command == (
        f"nlctl simulate 'my loop.py:make' --set controller.law.beta={beta:.12g} "
        "--set 'plant.x1(0)=0.81'"
    )
    response = nlctl.input_output_response(
        faulty(), TIMES, 0.0, {"plant.x1": 0.81}, params={"controller.law.beta": beta}
    )
    index = list(response.output_labels).index("y")
    assert numbers(shown)["y"][1] == pytest.approx(response.y[index].max(), abs=1e-5)
    again(shown, lambda: shown.get_by_role("button", name="As reported").click())
    assert "--set" not in shown.locator("figure.live code").text_content()


def test_a_field_shows_digits_that_fit_and_keeps_the_value(opened):
    """All digits are there for whoever writes in it, and in the command."""
    shown = opened(360)
    field = shown.get_by_label("plant.x1(0), exact value")
    for value, brief in (("0.8000000000000007", "0.8"), ("1.2345678901234567", "1.23457")):
        field.fill(value)
        again(shown, lambda: field.press("Enter"))
        field.blur()
        assert field.input_value() == brief
        fits = field.evaluate("field => field.scrollWidth <= field.clientWidth")
        assert fits
        field.focus()
        assert float(field.input_value()) == float(value)
        field.blur()
        command = shown.locator("figure.live code").text_content()
        assert float(command.split("plant.x1(0)=")[1].rstrip("'")) == float(value)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1200])
def test_nothing_is_in_the_way_of_any_reader(opened, width, scheme):
    axe = needed("axe_playwright_python.sync_playwright", "browser").Axe()
    shown = opened(width, scheme)
    shown.locator("figure.live details summary").click()
    shown.get_by_label("fault_actuator_v begins at").click()
    shown.locator(".verdicts b.fail").first.wait_for()
    found = axe.run(shown)
    assert found.violations_count == 0, found.generate_report()
    assert shown.evaluate("document.documentElement.scrollWidth") <= width


def test_without_script_nothing_of_it_is_seen(browser, page):
    context = browser.new_context(java_script_enabled=False)
    shown = context.new_page()
    shown.goto(page.as_uri())
    assert not shown.locator("figure.live").is_visible()
    assert shown.locator("#run-signals").is_visible()
    context.close()


def test_it_is_short_and_its_policy_lets_in_webassembly_alone(report, page):
    loop = faulty()
    plain = loop_report(
        loop, title=report.title, response=nlctl.input_output_response(loop, TIMES, 0.0)
    )
    live, still = page.read_text(encoding="utf-8"), render_html(plain)
    assert len(live.encode()) - len(still.encode()) <= MOST
    policies = [re.search(r'Policy" content="([^"]*)"', each)[1] for each in (still, live)]
    without = re.sub(r"sha256-[\w+/=]+", "", policies[1]).replace(" &#39;wasm-unsafe-eval&#39;", "")
    assert without == re.sub(r"sha256-[\w+/=]+", "", policies[0])


def test_a_page_that_runs_needs_a_run():
    with pytest.raises(ParameterError, match="begins with a run: give response="):
        loop_report(nlctl.paper.example_1(), title="Nothing", live=True)


LOOP = """
import nlctl
import control as ct

def make():
    source = nlctl.sources.Sine(outputs=("u",))
    return nlctl.interconnect({"ball": nlctl.Lag(T=0.5), "source": source})

def halved(t, x, u, params):
    return [float(str(-0.5 * u[0]))]

def called():
    law = ct.nlsys(None, halved, inputs="v", outputs="u", name="law")
    return nlctl.interconnect({"lag": nlctl.Lag(T=0.5), "law": law})
"""


def reported(folder, *words):
    """Run ``nlctl report`` on one of the loops."""
    (folder / "loop.py").write_text(LOOP, encoding="utf-8")
    return nlctl_here("report", *words, cwd=folder)


def test_the_command_line_writes_a_page_that_runs(tmp_path):
    needed("ziglang", "export")
    words = ("loop.py:make", "--until", "2", "--move", "ball.T=0.1:1", "--require", "always v <= 1")
    told = reported(tmp_path, *words)
    assert told.returncode == 0, told.stderr
    text = (tmp_path / "reports" / "loop" / "index.html").read_text(encoding="utf-8")
    assert "nlctl report loop.py:make --until 2 --move ball.T=0.1:1" in text
    content = json.loads(re.search(r'<figure class="live".*?json">(.*?)</script>', text)[1])
    (handle,) = content["handles"]
    assert (handle["name"], handle["value"], handle["high"]) == ("ball.T", 0.5, 1.0)
    assert content["command"] == {"shell": "nlctl simulate loop.py:make --until 2"}
    assert content["limits"] == {"v": [[1.0, 0.0, 2.0]]}


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("loop.py:called", "--live"), "a function of it is called"),
        (
            ("loop.py:make", "--move", "ball.tau"),
            "unknown parameter, initial state",
        ),
        (("loop.py:make", "--live", "--require", "v < 1"), "needs '<=' or '>='"),
        (("lv_2017", "--move", "plant.x1(0)"), "--move is of a loop or a study"),
        (("tabuada_2007", "--live"), "the page of tabuada_2007 has no loop to be moved"),
    ],
)
def test_what_a_page_cannot_do_is_refused_before_a_file_is_written(tmp_path, words, why):
    needed("ziglang", "export")
    told = (
        reported(tmp_path, *words, "--until", "2")
        if ":" in words[0]
        else reported(tmp_path, *words)
    )
    assert told.returncode == 2
    assert why in told.stderr
    assert not (tmp_path / "reports").exists()


def test_the_page_of_a_study_moves_within_its_box(tmp_path):
    needed("ziglang", "export")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    told = reported(tmp_path, "study.toml", "--live", "--out", "page")
    assert told.returncode in (0, 1), told.stderr
    text = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    content = json.loads(re.search(r'<figure class="live".*?json">(.*?)</script>', text)[1])
    (handle,) = content["handles"]
    assert (handle["name"], handle["low"], handle["high"]) == ("ball.T", 0.2, 0.8)
    assert content["bands"].keys() == content["limits"].keys() == {"v"}
    assert content["requirements"][0]["key"] == "low"
    assert content["command"]["shell"].startswith("nlctl simulate loop.py:make --until 2")


@pytest.fixture(scope="module")
def of_paper(tmp_path_factory):
    """Pages with both examples, without and with what runs, and the latter's report."""
    needed("ziglang", "export")
    figures = [
        Figure(key=f"{part.key}-figure", caption="A", description="A", figure=plain_figure())
        for part in LV_2017.parts
    ]
    sections = [
        Section(key=part.key, title=part.title, items=[figure])
        for part, figure in zip(LV_2017.parts, figures, strict=True)
    ]
    still = Report(title="Both", verdict="", claims=[], sections=sections, command="")
    live = with_parts_live(LV_2017, still)
    folder = tmp_path_factory.mktemp("paper")
    return write_report(still, folder / "still"), write_report(live, folder / "live"), live


def plain_figure():
    figure = MatplotlibFigure()
    figure.add_subplot()
    return figure


def test_the_page_of_the_paper_runs_both_examples(browser, of_paper):
    """It begins with the numbers of report.json; a fault ends one of two requirements."""
    still, page, report = of_paper
    assert page.stat().st_size - still.stat().st_size <= MOST
    shown = browser.new_page(offline=True)
    shown.goto(page.as_uri())
    for key in ("example-1-live", "example-2-live"):
        part = shown.locator(f"#{key}")
        part.locator(".said", has_text=" steps, ").wait_for()
        found = numbers(part)
        for name, values in report.numbers[key]["outputs"].items():
            np.testing.assert_allclose(found[name], values, rtol=0, atol=1e-9)
        assert part.locator(".verdicts b.fail").count() == 0
        part.get_by_label("fault_actuator_v begins at").check()
        part.locator(".verdicts li:nth-child(2) b.fail").wait_for()
        assert part.locator(".verdicts b.pass").count() == 1
    run = eval(part.locator("code").text_content(), {"np": np, "nlctl": nlctl})
    r = dict(zip(run.output_labels, run.outputs, strict=True))
    assert numbers(part)["u"][0] == pytest.approx(r["u"].min(), abs=1e-4)
    shown.close()


def test_a_single_block_runs_and_its_command_repeats_the_run():
    """With its input, its initial state and its parameters."""
    needed("ziglang", "export")
    lag, t = nlctl.block(nlctl.Lag(T=0.5), "lag"), np.linspace(0.0, np.pi, 11)
    run = nlctl.input_output_response(lag, t, 2.0, {"lag.v": 0.5}, params={"lag.T": 0.3})
    program = live_program(lag, run, {"lag.T": 0.3})
    np.testing.assert_allclose(program.signals["v"], run.outputs, atol=1e-6)
    command = live_item(program, run, (), base={"lag.T": 0.3}).program["command"]
    times = eval(command["times"], {"np": np})
    again = nlctl.input_output_response(
        lag, times, command["inputs"][0], command["states"], params=command["params"]
    )
    np.testing.assert_array_equal(again.outputs, run.outputs)


STUDY = """
loop = "loop.py:make"
[study]
title = "A lag"
seed = 1
[space]
"ball.T" = { uniform = [0.2, 0.8] }
[spec]
low = "always v <= 2"
[time]
end = 2.0
step = 0.01
[runs]
size = 16
[[analysis]]
kind = "probability"
limit = 0.5
"""
