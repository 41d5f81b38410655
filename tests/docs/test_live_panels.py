"""Loops of executed pages are moved in the reader's browser: a site of two scripts, built once."""

import re
import subprocess
import sys

import pytest
from extras import needed, needed_program
from places import ROOT

from nlctl.analysis.report.browser import BROWSERS

pytestmark = [pytest.mark.docs, pytest.mark.browser]

CONF = f"""
import sys
sys.path[:0] = [{str(ROOT / "docs" / "_ext")!r}]
extensions = ["sphinx_gallery.gen_gallery", "live_panels"]
project = html_title = "nlctl"
html_theme = "pydata_sphinx_theme"
html_static_path = [{str(ROOT / "docs" / "_static")!r}]
html_css_files, html_js_files = ["site.css"], ["site.js"]
exclude_patterns = ["scripts"]
suppress_warnings = ["config.cache"]
sphinx_gallery_conf = dict(
    examples_dirs="scripts", gallery_dirs="auto", filename_pattern=".py",
    image_scrapers=("matplotlib", "live_panels.panel_scraper"),
    reset_modules=("live_panels.note_runs",), download_all_examples=False,
)
"""
BEGIN = '''"""
A loop
======
"""
import matplotlib.pyplot as plt
import numpy as np
import nlctl

plt.plot([0, 1])
t = np.linspace(0, 20, 401)
'''
SCRIPTS = {
    "moved": """# sphinx_gallery_live = ["lag.T=0.1:2", "lag.v(0)"]
source = nlctl.sources.Sine(outputs=("u",))
alone = nlctl.interconnect({"lag": nlctl.Lag(T=0.5), "source": source}, outputs=["v"])
nlctl.input_output_response(alone, t, 0, {"lag.v": 2.0})
""",
    "late": """late = nlctl.TransportDelay(inputs=("v",), outputs=("u",), delay=1.0)
loop = nlctl.interconnect({"late": late, "lag": nlctl.Lag()}, outputs=["v"])
nlctl.input_output_response(loop, t)
""",
}


def built(folder, before=""):
    """Build the site; return its folder, and what Sphinx says."""
    needed("sphinx_gallery", "docs")
    (folder / "scripts").mkdir(parents=True)
    (folder / "conf.py").write_text(before + CONF)
    (folder / "index.rst").write_text("Site\n====\n\n.. toctree::\n\n   auto/index\n")
    (folder / "scripts" / "GALLERY_HEADER.rst").write_text("Scripts\n=======\n")
    for name, text in SCRIPTS.items():
        (folder / "scripts" / f"{name}.py").write_text(BEGIN + text)
    command = [sys.executable, "-m", "sphinx", "-W", "-n", str(folder), str(folder / "site")]
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    return folder / "site", said.stdout


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    needed("ziglang", "export")
    return built(tmp_path_factory.mktemp("panels"))


@pytest.fixture(scope="module")
def browser():
    with needed("playwright.sync_api", "browser").sync_playwright() as playwright:
        running = playwright.chromium.launch(
            executable_path=needed_program(BROWSERS), args=["--disable-quic", "--no-sandbox"]
        )
        yield running
        running.close()


def opened(browser, site, policy="", **options):
    """Open the page of the loop that can be moved, from a server that gives a content policy."""
    page = browser.new_context(**options).new_page()

    def answer(route, request):
        path = site[0] / request.url.removeprefix("http://site.test/").partition("?")[0]
        if not path.is_file():  # axe asks for imports of styles where they are not
            return route.abort()
        headers = {"Content-Security-Policy": policy} if policy else {}
        kind = {".js": "text/javascript", ".css": "text/css"}.get(path.suffix)
        return route.fulfill(path=path, headers=headers | ({"Content-Type": kind} if kind else {}))

    page.route("http://site.test/**", answer)
    page.goto("http://site.test/auto/moved.html")
    return page


def test_a_page_says_why_its_loop_cannot_be_moved(site):
    folder, said = site
    late = (folder / "auto" / "late.html").read_text(encoding="utf-8")
    assert "[live] pages: 1 with sliders, 1 that say why not" in said
    (reason,) = re.findall(r'<p class="not-live">(.*?)</p>', late)
    assert "transport delays" in reason
    assert "live.js" not in late


def test_a_page_is_little_longer_and_its_script_is_another_file(site):
    text = (site[0] / "auto" / "moved.html").read_text(encoding="utf-8")
    assert text.count("live.js") == text.count("live.css") == 1
    (panel,) = re.findall(r'<figure class="live".*?</figure>', text, re.DOTALL)
    assert len(panel.encode()) < 100_000
    assert "const " not in panel


def test_sliders_move_the_loop_under_a_strict_policy(browser, site):
    """Nothing but files of the site and WebAssembly runs."""
    policy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'"
    page = opened(browser, site, policy)
    said = page.locator("figure.live .said", has_text=" steps, ")
    said.wait_for()
    before = page.locator("figure.live .curve").first.get_attribute("d")
    page.evaluate("document.querySelector('figure.live').loop.say('')")
    page.locator("figure.live input[type=range]").first.press("ArrowRight")
    said.wait_for()
    assert page.locator("figure.live .curve").first.get_attribute("d") != before
    assert page.locator("figure.live .as-reported").count() == 1
    command = page.locator("figure.live code").text_content()
    assert command.startswith("nlctl.input_output_response(alone, np.linspace(0, 20, 401), ")


@pytest.mark.parametrize(("width", "scheme"), [(1100, "light"), (1100, "dark"), (390, "light")])
def test_no_reader_of_a_panel_is_kept_out(browser, site, width, scheme):
    axe = needed("axe_playwright_python.sync_playwright", "browser").Axe()
    options = {"viewport": {"width": width, "height": 900}, "color_scheme": scheme}
    page = opened(browser, site, **options)
    page.locator("figure.live .said", has_text=" steps, ").wait_for()
    page.locator("figure.live details summary").click()
    found = axe.run(page)
    assert found.violations_count == 0, found.generate_report()
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_without_script_only_the_picture_is_seen(browser, site):
    page = opened(browser, site, java_script_enabled=False)
    assert not page.locator("figure.live").is_visible()
    assert page.locator(".sphx-glr-single-img").is_visible()


@pytest.mark.weekly
def test_without_zig_the_site_has_no_panels_and_says_so(tmp_path):
    folder, said = built(tmp_path, 'import sys\nsys.modules["ziglang"] = None\n')
    assert "[live] no panels: Zig is not installed" in said
    text = (folder / "auto" / "moved.html").read_text(encoding="utf-8")
    assert 'class="live"' not in text
