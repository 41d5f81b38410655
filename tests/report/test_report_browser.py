"""The page in a real browser: nothing fetched, nothing executed, sorting, filtering, reading."""

import math
import re
import subprocess

import numpy as np
import pytest
from extras import needed, needed_program
from test_report import made_up_runs
from test_report_history import charted
from test_report_page import HOSTILE, every_kind

from nlctl.analysis.pages.compared import Compared, comparison_page, trend_figure
from nlctl.analysis.paper.page.report import paper_report
from nlctl.analysis.report import (
    Claim,
    History,
    Report,
    Section,
    Table,
    write_gallery,
    write_pdf,
    write_report,
)
from nlctl.analysis.report.browser import BROWSERS
from nlctl.analysis.report.compare import read_report
from nlctl.analysis.report.svg import LEAST_LETTERS

pytestmark = pytest.mark.browser

PAGES = ("plain", "hostile", "long", "paper", "compared", "gallery", "charts", "hostile charts")
PHONE = 390
SMALLEST_OF_DIAGRAMS = 8.0  # points


@pytest.fixture(scope="module")
def chromium():
    return needed_program(BROWSERS)


@pytest.fixture(scope="module")
def browser(chromium):
    with needed("playwright.sync_api", "browser").sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=["--disable-quic"])
        yield running
        running.close()


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Reports with plain names, with all hostile ones, a very long one; the paper's; a gallery."""
    folder = tmp_path_factory.mktemp("reports")
    hostile = " ".join(text for name, text in HOSTILE.items() if name != "long")
    made = {
        "plain": write_report(every_kind(), folder / "plain"),
        "hostile": write_report(every_kind(hostile, hostile), folder / "<b>hostile & #1"),
        "long": write_report(every_kind(HOSTILE["long"], HOSTILE["long"]), folder / "long"),
        "paper": write_report(paper_report(made_up_runs()), folder / "paper"),
        "charts": write_report(charted(), folder / "charts", interactive=True),
        "hostile charts": write_report(charted(hostile), folder / "odd", interactive=True),
    }
    (folder / "revisions").mkdir()
    for name, shift in (("first", 0.0), ("second", 0.3)):
        write_report(revised(name, shift), folder / "revisions" / name)
    both = [folder / "revisions" / name for name in ("first", "second")]
    of_both = comparison_page(
        *(Compared(name=p.name, content=read_report(p), folder=p) for p in both)
    )
    made["compared"] = write_report(of_both, folder / "compared")
    return made | {"gallery": write_gallery(folder, draw=trend_figure)}


def revised(name, shift):
    """One revision of a report: its claims have ids, one of them is lost with a shift."""
    t = np.linspace(0, 10, 101)
    history = History(
        key="run-history",
        caption="A run",
        description="y",
        time=t,
        signals={"y": np.sin(t) + shift},
    )
    claims = [
        Claim(
            text=f"|y| <= {limit}", measured=f"{1 + shift:g}", limit=f"{limit}", evidence="run",
            holds=1 + shift <= limit, margin=f"{limit - 1 - shift:.1f}", ids=[f"REQ-{number}"],
        )
        for number, limit in ((1, 1.2), (2, 2.0))
    ]  # fmt: skip
    links = Table(
        caption="From requirement to evidence.", columns=("id", "verdict", "evidence"),
        rows=[("REQ-1", "shown", "run")], status="verdict", links="evidence",
    )  # fmt: skip
    run = Section(key="run", title="A run", items=[history, links])
    return Report(
        title="A wave", verdict="v", claims=claims, sections=[run], command="", revision=name,
        numbers={"peak": 1 + shift, "same": 2.0},
    )  # fmt: skip


@pytest.fixture
def visit(browser, pages):
    """Open a page; console errors and requests are collected in the lists ``seen`` of it."""
    contexts = []

    def go(name, *, width=1200, scheme="light", scripts=True):
        context = browser.new_context(
            viewport={"width": width, "height": 900},
            color_scheme=scheme,
            java_script_enabled=scripts,
        )
        contexts.append(context)
        page = context.new_page()
        page.seen = []
        page.on("console", lambda m: page.seen.append(m.text) if m.type != "log" else None)
        page.on("pageerror", lambda error: page.seen.append(str(error)))
        page.on("dialog", lambda dialog: page.seen.append(dialog.message))
        own = pages[name].as_uri()
        page.on("request", lambda r: None if r.url == own else page.seen.append(r.url))
        page.goto(own)
        return page

    yield go
    for context in contexts:
        context.close()


@pytest.mark.parted
@pytest.mark.parametrize("name", PAGES)
def test_nothing_is_fetched_and_the_console_is_silent(visit, name):
    """Fonts and pictures are data inside the page, and the policy blocks nothing that is ours."""
    page = visit(name)
    page.evaluate("document.fonts.ready")
    assert [url for url in page.seen if not url.startswith("data:")] == []


SCHEMES = [
    pytest.param(name, scheme, marks=[pytest.mark.weekly] * (scheme == "dark" and name != "paper"))
    for name in PAGES
    for scheme in ("light", "dark")
    if name != "long"
]


@pytest.mark.parted
@pytest.mark.parametrize(("name", "scheme"), SCHEMES)
def test_axe_finds_no_violation(visit, name, scheme):
    """Contrast, names, roles, headings, keyboard, in both colour schemes."""
    axe = needed("axe_playwright_python.sync_playwright", "browser")
    inside = {"exclude": [["svg > g"]]}  # an image by its role: what it is drawn of has none
    found = axe.Axe().run(visit(name, scheme=scheme), context=inside, options=None).response
    assert "color-contrast" in {rule["id"] for rule in found["passes"]}
    assert [(v["id"], [n["html"][:300] for n in v["nodes"]][:3]) for v in found["violations"]] == []


@pytest.mark.parametrize("name", PAGES)
def test_a_phone_does_not_scroll_sideways(visit, name):
    """Wide tables, formulas and figures scroll in boxes of their own."""
    page = visit(name, width=PHONE)
    assert page.evaluate("document.scrollingElement.scrollWidth") <= PHONE


def test_the_table_of_contents_stays_in_view(visit):
    """At the end of a long page it is where it was at its beginning."""
    page = visit("paper", width=1300)
    top = "document.querySelector('nav').getBoundingClientRect().top"
    end = "{top: document.body.scrollHeight, behavior: 'instant'}"
    page.evaluate(f"window.scrollTo({end})")
    assert page.evaluate("window.scrollY") > 2000
    assert page.evaluate(top) == 0


@pytest.mark.parametrize("name", ["hostile", "long"])
def test_hostile_names_do_nothing_and_are_shown(visit, name):
    """Not on loading, not on sorting, filtering and enlarging."""
    page = visit(name)
    page.evaluate("document.querySelectorAll('main button').forEach(b => b.click())")
    page.evaluate("document.querySelectorAll('dialog').forEach(d => d.close())")
    assert page.evaluate("window.__pwned") is None
    text = page.evaluate("document.body.textContent")
    for key, part in HOSTILE.items():
        if (key == "long") == (name == "long"):
            assert part in text
    assert page.evaluate("document.querySelectorAll('img, main script').length") == 0


def column(page, place):
    """Visible texts of one column of the long table; numbers as a browser reads them."""
    texts = page.evaluate(
        "i => [...document.querySelector('table.many').tBodies[0].rows].filter(r => !r.hidden)"
        ".map(r => r.cells[i].dataset.value ?? r.cells[i].textContent)",
        place,
    )
    return [text.replace("\N{NO-BREAK SPACE}", " ") for text in texts]


def test_a_click_or_a_key_sorts_by_number_and_again_downwards(visit):
    """Ten comes after nine; NaN stays last both ways; the header says what was done."""
    page = visit("plain")
    before = column(page, 1)
    heads = page.locator("table.many").first.locator("th")
    head = heads.nth(1)
    head.locator("button").click()
    assert head.get_attribute("aria-sort") == "ascending"
    upwards = [float(text) for text in column(page, 1)]
    numbers = [x for x in upwards if not math.isnan(x)]
    assert numbers == sorted(numbers)
    assert all(map(math.isnan, upwards[len(numbers) :]))
    head.locator("button").focus()
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "descending"
    downwards = [float(text) for text in column(page, 1)]
    assert downwards[: len(numbers)] == sorted(numbers, reverse=True)
    assert all(map(math.isnan, downwards[len(numbers) :]))
    heads.nth(0).locator("button").click()
    assert head.get_attribute("aria-sort") is None
    assert column(page, 1) == before


def test_the_filter_leaves_rows_with_all_its_words(visit):
    """And says how many; an empty filter shows all again.  Short tables have none."""
    page = visit("plain")
    rows = column(page, 2)
    box = page.get_by_label("Filter rows").first
    box.fill("ROW 3 fail")
    shown = column(page, 2)
    assert 0 < len(shown) < 14
    assert {f"row {i}" for i in range(40) if i % 3 == 0 and "3" in str(i)} <= set(shown)
    assert all("3" in column(page, 0)[i] + column(page, 1)[i] for i in range(len(shown)))
    assert set(column(page, 3)) == {"fail"}
    assert f"{len(shown)} of 40 rows" in page.locator(".filter").first.text_content()
    box.fill("")
    assert column(page, 2) == rows
    assert page.locator(".filter").count() == page.locator("table.many").count()


def test_everything_is_readable_without_scripts(visit):
    """The same text, all rows, all figures, and no button that does nothing."""
    with_scripts, without = visit("plain"), visit("plain", scripts=False)
    assert without.locator("button, input").count() == 0
    assert without.locator("tbody tr").count() == with_scripts.locator("tbody tr").count()
    for summary in without.locator("summary").all():
        summary.click()  # what is folded needs no script
    for place in range(without.locator("figure svg").count()):
        assert without.locator("figure svg").nth(place).bounding_box()["height"] > 100
    parts = without.locator("td, th, p, li, h1, h2, h3, caption, figcaption, pre")
    written, seen = parts.all_text_contents(), parts.all_inner_texts()
    assert ["".join(text.split()) for text in seen] == ["".join(text.split()) for text in written]


@pytest.mark.parametrize("name", ["paper", "compared", "gallery"])
def test_a_phone_shows_whole_figures_with_letters_of_9_px(visit, name):
    """Plots and their legends are as wide as the screen; diagrams scroll in boxes of their own."""
    page = visit(name, width=PHONE)
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    drawings = page.locator("figure svg").all()
    assert drawings
    for drawing in drawings:
        box, is_diagram = (
            drawing.bounding_box(),
            "diagram" in (drawing.get_attribute("class") or ""),
        )
        points = float(drawing.get_attribute("viewBox").split()[2])
        assert box["width"] > 0.5 * PHONE
        assert is_diagram or box["width"] <= PHONE - box["x"]
        assert (SMALLEST_OF_DIAGRAMS if is_diagram else LEAST_LETTERS) * box[
            "width"
        ] / points >= 9.0


@pytest.mark.parametrize("scripts", [True, False])
def test_what_is_folded_opens_for_a_link_and_for_paper(visit, scripts):
    """Also where the link is in the address, and again after it has been closed by hand."""
    page = visit("paper", scripts=scripts)
    table = page.locator("#example-1-parameters-table")
    fold = page.locator("details", has=table)
    assert not table.is_visible()
    page.locator('nav a[href="#example-1-parameters"]').click()
    table.wait_for(state="visible")
    assert page.locator("#example-2-parameters-table").is_hidden()
    page.locator("summary", has_text="Parameters as printed").first.click()
    table.wait_for(state="hidden")
    if scripts:
        page.locator('nav a[href="#example-1-parameters"]').click()
        table.wait_for(state="visible")
        page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = false; })")
        page.goto(page.url.partition("#")[0] + "#example-1-figures-table")
        page.locator("#example-1-figures-table").wait_for(state="visible")
        assert fold.count() == 1
    page.emulate_media(media="print")
    heights = page.evaluate(
        "[...document.querySelectorAll('details')].map(d => [d.open, d.scrollHeight])"
    )
    assert any(not is_open for is_open, _ in heights)
    assert all(height > 100 for _, height in heights)


def test_everything_unfolds_at_once_and_folds_again(visit):
    """One button before the contents."""
    page = visit("paper")
    count = page.locator("details").count()
    for name, wanted in (("Unfold all", count), ("Fold all", 0)):
        page.get_by_role("button", name=name, exact=True).click()
        assert page.locator("details[open]").count() == wanted > -1


def test_the_first_screen_tells_the_story(visit):
    """Question, verdict and picture side by side, and the first claims below them."""
    page = visit("paper", width=1300)
    verdict, picture, claims = (
        page.locator(where).bounding_box() for where in (".verdict", "#lead svg", "#claims")
    )
    assert verdict["x"] + verdict["width"] < picture["x"]
    assert abs(verdict["y"] - picture["y"]) < 60
    assert claims["y"] < 600
    assert page.locator(".verdict").inner_text().startswith("Question:")


def luminance(page, element, what):
    """Relative luminance of a computed colour (WCAG 2.2)."""
    colour = page.evaluate(
        "([e, w]) => getComputedStyle(document.querySelector(e))[w]", [element, what]
    )
    parts = [int(p) / 255 for p in colour.removeprefix("rgb(").removesuffix(")").split(",")]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize(
    ("scheme", "media", "is_dark"),
    [("light", "screen", False), ("dark", "screen", True), ("dark", "print", False)],
)
def test_dark_pages_are_dark_and_paper_is_white(visit, scheme, media, is_dark):
    """Text and the lines of figures stand out from the page in each of them."""
    page = visit("plain", scheme=scheme)
    page.emulate_media(media=media, color_scheme=scheme)
    ground, ink = (luminance(page, "body", w) for w in ("backgroundColor", "color"))
    assert (ground < 0.05) is is_dark
    assert ground > 0.99 or is_dark
    light, dark = max(ground, ink), min(ground, ink)
    assert (light + 0.05) / (dark + 0.05) > 7
    axis = "figure svg path[stroke=currentColor]"
    assert luminance(page, axis, "stroke") == ink
    assert page.locator("nav").is_visible() is (media == "screen")
    assert page.locator("th button").first.is_visible()
    assert page.locator("figcaption button").first.is_visible() is (media == "screen")


def test_figures_enlarge_and_return(visit):
    """The dialog holds the figure itself, and its place gets it back; so does the Escape key."""
    page = visit("plain")
    before = page.locator("main").inner_html()
    button = page.locator("figcaption button").first
    small = page.locator("figure svg").first.bounding_box()["width"]
    for leave in ("Close", "Escape"):
        button.click()
        assert page.locator("dialog svg").is_visible()
        large = page.locator("dialog svg").bounding_box()
        room = page.locator("dialog").bounding_box()
        assert large["width"] > small
        assert large["width"] > 0.9 * room["width"]
        assert large["height"] > 0.7 * room["height"]
        assert page.locator("dialog p").inner_text() == "plain"  # its caption goes with it
        if leave == "Close":
            page.get_by_role("button", name="Close").click()
        else:
            page.keyboard.press("Escape")
        page.locator("dialog svg").wait_for(state="detached")
        assert page.locator("main").inner_html() == before


def test_the_brace_of_cases_spans_its_rows_and_the_hat_sits_on_its_letter(visit):
    """What the math font is there for."""
    page = visit("plain")
    page.evaluate("document.fonts.ready")
    assert page.evaluate("document.fonts.check('16px \"nlctl Math\"')")
    height = "e => document.querySelector(e).getBoundingClientRect().height"
    assert page.evaluate(height, "math mo[fence=true]") > 0.9 * page.evaluate(height, "mtable")
    assert page.evaluate(height, "math mtable") > 2 * page.evaluate(height, "mtr mi")
    gap = page.evaluate(
        "() => { const m = document.querySelector('mover');"
        "const [w, hat] = [...m.children].map(c => c.getBoundingClientRect());"
        "return [w.top - hat.top, w.height, m.getBoundingClientRect().height]; }"
    )
    assert gap[2] < 2 * gap[1]


# How many points of the first chart have the colour of a curve.
INK = """curve => {
  const rgb = getComputedStyle(document.body).getPropertyValue(`--curve-${curve}`);
  const wanted = [1, 3, 5].map(i => parseInt(rgb.trim().slice(i, i + 2), 16));
  const canvas = document.querySelector("canvas");
  const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let found = 0;
  for (let i = 0; i < data.length; i += 4)
    found += data[i + 3] === 255 && wanted.every((c, j) => Math.abs(c - data[i + j]) < 9);
  return found;
}"""


def is_drawn(page, curve, *, wanted=True):
    """Wait until a curve is drawn in its colour, or is not."""
    condition = "> 200" if wanted else "=== 0"
    page.wait_for_function(f"curve => ({INK})(curve) {condition}", arg=curve)
    return True


def plot(page):
    """Where the first chart's curves are on the screen."""
    over = page.locator(".u-over").first
    over.scroll_into_view_if_needed()
    return over.bounding_box()


def span(page):
    """The times between which the first chart is drawn."""
    return page.evaluate("[charts[0].scales.x.min, charts[0].scales.x.max]")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_charts_are_drawn_in_the_colours_of_the_page(visit, scheme):
    """At first the signals that are to be shown; again when the page's colours change."""
    page = visit("charts", scheme=scheme)
    assert is_drawn(page, 0)
    assert is_drawn(page, 1)
    assert is_drawn(page, 2, wanted=False)
    page.emulate_media(color_scheme="light" if scheme == "dark" else "dark")
    assert is_drawn(page, 0)
    page.emulate_media(media="print")
    assert not page.locator(".history").first.is_visible()
    assert page.locator("figure svg").first.is_visible()


def test_signals_are_shown_and_hidden_by_key(visit):
    """Each has a button with its name and its value."""
    page = visit("charts")
    buttons = page.locator(".signals").first.locator("button")
    for place, before in ((0, "true"), (2, "false")):
        button = buttons.nth(place)
        assert f"wave {place}" in button.text_content()
        assert button.get_attribute("aria-pressed") == before
        button.focus()
        page.keyboard.press("Enter")
        assert button.get_attribute("aria-pressed") != before
    assert is_drawn(page, 0, wanted=False)
    assert is_drawn(page, 2)


def test_values_are_told_by_pointer_and_by_key(visit):
    """Both ways the samples themselves; gaps have no value."""
    page = visit("charts")
    slider = page.locator("input[type=range]").first
    for _ in range(3):
        slider.press("ArrowRight")
    assert slider.input_value() == "3"
    told = page.locator(".signals").first.locator(".value").all_text_contents()
    t = 3 * 10 / 500
    wanted = [(i + 1) * math.sin(t + i) for i in range(3)]
    assert [float(x.replace("−", "-")) for x in told] == [float(f"{x:.6g}") for x in wanted]
    assert slider.get_attribute("aria-valuetext").startswith("0.06 s, wave 0: plain 0.0599")
    box = plot(page)
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20)
    assert slider.input_value() == "250"
    odd = page.locator(".history").nth(1)
    odd.locator("input[type=range]").press("End")
    assert odd.locator(".signals .value").all_text_contents() == ["1e+300", "no value", "2"]


def test_charts_zoom_by_pointer_and_by_key_and_return(visit):
    """A drag selects a stretch, a double click shows the whole run again; so do the buttons."""
    page = visit("charts")
    whole = span(page)
    assert whole == [0, 10]
    box = plot(page)
    left, middle = box["x"] + 0.2 * box["width"], box["x"] + 0.5 * box["width"]
    page.mouse.move(left, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(middle, box["y"] + 60, steps=5)
    page.mouse.up()
    assert span(page) == pytest.approx([2, 5], abs=0.05)
    page.mouse.dblclick(middle, box["y"] + 50)
    assert span(page) == whole
    page.locator("input[type=range]").first.fill("250")
    page.get_by_role("button", name="Zoom in").first.press("Enter")
    assert span(page) == [2.5, 7.5]
    page.get_by_role("button", name="Reset zoom").first.press("Enter")
    assert span(page) == whole


def test_charts_follow_the_width_of_the_page_and_need_scripts(visit):
    """A narrow page has narrow ones, one without scripts has none, but the figure beside them."""
    page = visit("charts")
    wide = page.locator("canvas").first.bounding_box()["width"]
    page.set_viewport_size({"width": PHONE, "height": 900})
    page.wait_for_function("w => document.querySelector('canvas').clientWidth < w", arg=PHONE)
    assert wide > 600
    still = visit("charts", scripts=False)
    assert still.locator("figure svg").first.is_visible()
    assert not any(chart.is_visible() for chart in still.locator(".history").all())


def test_hostile_names_of_signals_do_nothing_and_are_shown(visit):
    """Nor does pressing what has such a name."""
    page = visit("hostile charts")
    for button in page.locator(".history button").all():
        button.press("Enter")
    assert page.evaluate("window.__pwned") is None
    shown = page.locator(".signals button span").first.text_content()
    assert all(text in shown for name, text in HOSTILE.items() if name != "long")
    assert page.seen == []


def test_a_page_is_printed_to_pdf(chromium, pages, tmp_path):
    """Through the same Chromium, without its address and date in the margins."""
    made = write_pdf(pages["plain"], tmp_path / "report.pdf")
    content = made.read_bytes()
    assert content.startswith(b"%PDF-")
    assert content.count(b"/Type /Page\n") >= 2
    assert [p.name for p in tmp_path.iterdir()] == ["report.pdf"]


def test_pages_of_paper_are_numbered_and_unfolded(chromium, pages, tmp_path):
    """Each has its number and their count at its foot; what is folded on the screen is there."""
    reader = needed_program(("pdftotext",))
    made = write_pdf(pages["paper"], tmp_path / "report.pdf")
    run = subprocess.run([reader, "-layout", made, "-"], capture_output=True, text=True, check=True)
    *sheets, _ = run.stdout.split("\f")
    assert len(sheets) > 5
    for number, sheet in enumerate(sheets, 1):
        assert sheet.rstrip().endswith(f"{number} / {len(sheets)}")
    assert "the play operator" in run.stdout  # of a folded table
    heads = re.compile(r"case +quantity +found")
    for sheet in sheets:
        for head in heads.finditer(sheet):
            assert sheet[head.end() :].count("pass") + sheet[head.end() :].count("fail") > 1


@pytest.mark.parted
@pytest.mark.parametrize("name", ["paper", "compared", "gallery"])
def test_no_page_of_paper_is_half_empty(chromium, pages, tmp_path, name):
    """But the last one: what does not fit below leaves less than half of a page."""
    printer = needed_program(("pdftoppm",))
    made = write_pdf(pages[name], tmp_path / "report.pdf")
    subprocess.run([printer, "-gray", "-r", "30", made, tmp_path / "sheet"], check=True)
    *sheets, _ = sorted(tmp_path.glob("sheet-*.pgm"))
    for sheet in sheets:
        assert filled(sheet) > 0.5, sheet.name


def filled(path):
    """How much of a sheet's height between its margins is used (1)."""
    magic, size, _, grey = path.read_bytes().split(b"\n", 3)
    assert magic == b"P5"
    width, height = map(int, size.split())
    shade = np.frombuffer(grey, dtype=np.uint8).reshape(height, width)
    top, bottom = (round(height * x / 297) for x in (16, 297 - 18))  # mm of @page
    used = np.flatnonzero((shade[top:bottom] < 200).any(axis=1))
    return (used[-1] + 1) / (bottom - top) if used.size else 0.0
