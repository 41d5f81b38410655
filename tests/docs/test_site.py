"""The site builds without a warning, its scripts are checked, and no public name is left out."""

import ast
import importlib
import os
import re
import subprocess
import sys
from itertools import chain
from pathlib import Path

import pytest
from extras import needed, needed_program
from places import ROOT
from reference import documented_names, our_modules
from rows import each_row

from nlctl.analysis.catalogue import block_records, function_summaries
from nlctl.analysis.report.browser import BROWSERS

DOCS = ROOT / "docs"
GALLERY = sorted((DOCS / "gallery").rglob("*.py"))
SCRIPTS = GALLERY + sorted([*DOCS.glob("tutorials/*.py"), *DOCS.glob("how-to/*.py")])
PUBLIC = [
    *(
        "nlctl",
        "nlctl.errors",
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
    *("studies", "glossary", "explanation/actuators", "start/which-controller"),
    *("start/quick-start", "start/from-matlab", "reference/configuration", "project/release-notes"),
    *("auto/blocks/DeadZone", "auto/blocks/mrac", "auto/blocks/groups/controllers"),
    *("reference/inside", "project/citing"),
)


@each_row("script", GALLERY)
def test_a_script_of_the_gallery_is_short_and_asserts(script):
    """Under 60 lines, and what it asserts is not a constant."""
    source = text(script)
    assert len(source.splitlines()) < 60
    asserted = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Assert)]
    assert asserted
    assert not any(isinstance(node.test, ast.Constant) for node in asserted)


def test_every_script_of_the_gallery_has_a_theme():
    """It lies in a folder whose header says what the theme is."""
    themes = {path.parent.relative_to(DOCS / "gallery").as_posix() for path in GALLERY}
    assert "." not in themes, "move the script into the folder of its theme"
    headers = [text(DOCS / "gallery" / theme / "GALLERY_HEADER.rst") for theme in themes]
    assert all(len(header.splitlines()) >= 4 for header in headers)


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
def test_every_name_of_these_modules_is_in_the_reference(module):
    """And nothing else: the lists of the pages are the modules' own."""
    told = [name for home, name in documented_names() if home == module]
    assert sorted(told) == sorted(importlib.import_module(module).__all__)


def test_every_public_name_is_in_the_reference():
    """Of each package with an `__all__`: where it is, or under the name by which it is offered."""
    told = set(documented_names())
    known = {id(getattr(importlib.import_module(home), name)) for home, name in told}
    inside = re.compile(r"^\.\. inside:: (\S+)$", re.MULTILINE)
    whole = {home for path in DOCS.glob("reference/*.rst") for home in inside.findall(text(path))}
    missing = []
    for place in filter(lambda each: each.ispkg and each.name not in whole, our_modules()):
        home = importlib.import_module(place.name)
        named = {f"{place.name}.{name}": name for name in getattr(home, "__all__", ())}
        missing += [
            full
            for full, name in named.items()
            if (place.name, name) not in told and id(getattr(home, name)) not in known
        ]
    assert missing == []
    assert len(told) > 350


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
def test_every_block_has_its_page(site):
    """With its picture, and what it is called."""
    for name in [*block_records(), *chain(*function_summaries().values())]:
        page = text(site / "auto" / "blocks" / f"{name}.html")
        assert f"<h1>{name}" in page
    for name in ("DeadZone", "mrac", "Genesio"):
        page = text(site / "auto" / "blocks" / f"{name}.html")
        assert f'{name}.svg" alt="{name}:' in page or f"{name}.svg" in page


@pytest.mark.docs
def test_names_of_other_libraries_lead_to_their_pages(site):
    """By inventories that are kept here; nothing is fetched when the site is built."""
    page = text(site / "auto" / "blocks" / "mrac.html")
    assert "python-control.readthedocs.io" in page


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
