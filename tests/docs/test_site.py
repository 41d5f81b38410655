"""The site builds without a warning, its scripts are checked, and no public name is left out."""

import ast
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from extras import needed, needed_program
from places import ROOT
from reference import documented_names
from rows import each_row

from nlctl.analysis.catalogue import block_records
from nlctl.analysis.report.browser import BROWSERS

DOCS = ROOT / "docs"
GALLERY = sorted((DOCS / "gallery").glob("*.py"))
SCRIPTS = GALLERY + sorted([*DOCS.glob("tutorials/*.py"), *DOCS.glob("how-to/*.py")])
PUBLIC = [
    *(
        "nlctl",
        "nlctl.paper",
        *(f"nlctl.papers.{name}" for name in ("tabuada_2007", "karason_1994", "chowdhary_2010")),
        "nlctl.papers.canudas_de_wit_1995",
        "nlctl.analysis.lyapunov",
        "nlctl.analysis.robustness",
        "nlctl.analysis.studies",
    ),
    *("nlctl.analysis.report", "nlctl.analysis.loop_report", "nlctl.analysis.metrics"),
]


def text(path):
    return path.read_text(encoding="utf-8")


PAGES = (
    *("index", "auto/tutorials/index", "auto/tutorials/t7_from_simulink", "auto/gallery/index"),
    *("how-to/index", "explanation/paper", "reference/blocks", "reference/study-files"),
    *("studies", "glossary", "explanation/actuators"),
)


@each_row("script", [path.name for path in GALLERY])
def test_a_script_of_the_gallery_is_short_and_asserts(script):
    """Under 60 lines, and what it asserts is not a constant."""
    source = text(DOCS / "gallery" / script)
    assert len(source.splitlines()) < 60
    asserted = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Assert)]
    assert asserted
    assert not any(isinstance(node.test, ast.Constant) for node in asserted)


def test_every_block_is_in_the_gallery():
    """Its characteristic, its step response, or a loop with it; at least 25 scripts in all."""
    shown = " ".join(map(text, GALLERY))
    missing = [name for name in block_records() if not re.search(rf"\b{name}\b", shown)]
    assert missing == []
    assert len(GALLERY) >= 25


def test_every_page_that_is_executed_asserts_something():
    """Tutorials and how-to pages too."""
    for path in SCRIPTS:
        assert any(isinstance(node, ast.Assert) for node in ast.walk(ast.parse(text(path)))), path


@each_row("module", PUBLIC)
def test_every_public_name_is_in_the_reference(module):
    """And nothing else: the lists of the pages are the modules' own."""
    told = [name for home, name in documented_names() if home == module]
    assert sorted(told) == sorted(importlib.import_module(module).__all__)


def built(folder, *options):
    """Build the site in a folder; return what Sphinx says of it."""
    needed("sphinx_gallery", "docs")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-n", "-E", *options, str(DOCS), folder]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built without a warning; nothing is executed. `.ci/run` has built it."""
    if "NLCTL_SITE" in os.environ:
        return Path(os.environ["NLCTL_SITE"])
    folder = tmp_path_factory.mktemp("site")
    said = built(str(folder), "-D", "plot_gallery=0")
    assert said.returncode == 0, said.stderr
    return folder


@pytest.mark.docs
def test_the_site_builds_without_a_warning(site):
    """Links, names and formulas."""
    assert "<math" in text(site / "explanation" / "paper.html")


@pytest.mark.docs
@pytest.mark.browser
@pytest.mark.parametrize("pages", [PAGES[:2], pytest.param(PAGES[2:], marks=pytest.mark.weekly)])
def test_axe_finds_nothing_on_these_pages(site, pages):
    """Contrast, names, roles, headings, keyboard; of some pages in the dark, too."""
    axe = needed("axe_playwright_python.sync_playwright", "browser")
    chromium = needed_program(BROWSERS)
    found = []
    with needed("playwright.sync_api", "browser").sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--disable-quic"])
        looked_at = [(name, "light") for name in pages] + [(name, "dark") for name in pages[:2]]
        for name, scheme in looked_at:
            page = browser.new_page(color_scheme=scheme)
            page.goto((site / f"{name}.html").as_uri())
            violations = axe.Axe().run(page).response["violations"]
            found += [(name, scheme, v["id"], v["nodes"][0]["html"][:200]) for v in violations]
            page.close()
        browser.close()
    assert found == []


@pytest.mark.docs
@pytest.mark.weekly
def test_every_page_is_executed(tmp_path):
    """All scripts run, and their assertions hold."""
    said = built(str(tmp_path))
    assert said.returncode == 0, said.stderr
