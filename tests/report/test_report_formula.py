"""Formulas: MathML through a whitelist, set as in print, in a font that travels with the page."""

import io
import re
from importlib.resources import files
from xml.etree import ElementTree

import pytest
from fontTools.ttLib import TTFont
from math_font import CHARACTERS, italic, subset
from rows import each_row

import nlctl
from nlctl.analysis.pages.diagram import equations_of
from nlctl.analysis.paper.page import text as text
from nlctl.analysis.report import Equation
from nlctl.analysis.report.mathml import (
    ATTRIBUTES,
    ELEMENTS,
    FAMILY,
    font_face,
    mathml,
)

EXAMPLES = (nlctl.paper.example_1(), nlctl.paper.example_2())
FORMULAS = [text.PLANT_CLASS, *text.CONTROLLER]
SHOWN = [e for made in EXAMPLES for e in equations_of(made, ("plant", "actuator"))]
FORMULAS += [item for item in SHOWN if isinstance(item, Equation)]
HARMFUL = [
    r"\href{javascript:alert(1)}{x}",
    r"\href{https://example.org}{x}",
    r"\style{background:url(x)}{x}",
    r"\class{badge}{x}",
    r"\cssId{provenance}{x}",
]
UNREADABLE = [r"\frac{", r"x_1_2", r"\left(", "{" * 3000, r"\begin{cases} a", "\\", r"\fracc{a}{b}"]


@pytest.fixture(scope="module")
def font():
    """The subset of the math font, as the page holds it."""
    data = files("nlctl.analysis.report").joinpath("fonts/nlctl-math.woff2").read_bytes()
    return TTFont(io.BytesIO(data))


def tree(latex):
    return ElementTree.fromstring(mathml(Equation(latex=latex)))


@pytest.mark.parametrize("formula", FORMULAS, ids=lambda f: f.latex[:20])
def test_formulas_of_the_paper_are_mathml_in_characters_of_the_font(formula, font):
    """One-letter names are drawn slanted, by other characters than they are written with."""
    root = ElementTree.fromstring(mathml(formula))
    assert root.tag == "math"
    drawn = set(font.getBestCmap())
    for element in root.iter():
        shown = element.text or ""
        if element.tag == "mi" and len(shown) == 1 and element.get("mathvariant") != "normal":
            shown += italic(shown)
        assert {ord(c) for c in shown if not c.isspace()} <= drawn


def test_the_font_has_every_character_that_it_should(font):
    """And the pieces that tall braces are made of, under a name of its own."""
    assert {ord(c) for c in CHARACTERS} <= set(font.getBestCmap())
    variants = font["MATH"].table.MathVariants
    tall = dict(zip(variants.VertGlyphCoverage.glyphs, variants.VertGlyphConstruction, strict=True))
    for sign in "{}()[]‖":
        construction = tall[font.getBestCmap()[ord(sign)]]
        assert construction.MathGlyphVariantRecord or construction.GlyphAssembly
    names = {name.nameID: name.toUnicode() for name in font["name"].names}
    assert names[1] == names[4] == FAMILY
    assert not any("STIX" in names[i] for i in (1, 4, 6))
    assert "STI Pub" in names[0]


def test_font_comes_with_its_licence_and_in_the_page():
    """The rule holds the whole font as data."""
    licence = files("nlctl.analysis.report").joinpath("fonts/OFL.txt").read_text(encoding="utf-8")
    assert "SIL OPEN FONT LICENSE" in licence
    assert re.search(r'url\("data:font/woff2;base64,[A-Za-z0-9+/=]+"\)', font_face())


@each_row("latex", HARMFUL)
def test_what_is_not_on_the_lists_is_shown_as_its_source(latex):
    """Addresses, styles, classes and ids of others never get into the page."""
    assert mathml(Equation(latex=latex)) == f"<code>{latex}</code>"


@each_row("latex", UNREADABLE)
def test_what_cannot_be_read_is_shown_as_its_source(latex):
    """A slip in a formula costs the formula, not the report."""
    assert mathml(Equation(latex=latex)) == f"<code>{latex}</code>"


@each_row(
    "latex", [r"\text{<script>alert(1)</script>}", "a < b & c", r"\text{&lt;i&gt;}", "<img src=x>"]
)
def test_markup_in_a_formula_is_text(latex):
    """The result has elements and attributes of the lists only."""
    root = tree(latex)
    for element in root.iter():
        assert element.tag in ELEMENTS
        assert set(element.attrib) <= ATTRIBUTES | {"class"}
        assert element.get("class") in (None, "left", "right")


def test_script_in_a_formula_is_shown():
    """What was written is what is read."""
    text_of = "".join(tree(r"\text{<script>}").itertext())
    assert text_of == "<script>"


def test_hats_are_accents_and_cases_are_left_aligned():
    """Both are told to the browser in the only way that it knows."""
    hat = tree(r"\hat W").find(".//mover")
    assert hat.get("accent") == "true"
    assert hat[1].text == "ˆ"
    cells = tree(r"\begin{cases} a & b \\ c & d \end{cases}").findall(".//mtd")
    assert [cell.get("class") for cell in cells] == ["left"] * 4


def test_a_sign_is_close_to_its_number_and_a_function_apart_from_its_factor():
    """x = -3 has a prefix minus, x - 3 has none; in q cos t there is a space before cos."""
    assert [m.get("form") for m in tree("x = -3").iter("mo")] == [None, "prefix"]
    assert [m.get("form") for m in tree("x - 3").iter("mo")] == [None]
    tags = [e.tag for e in tree(r"q \cos t").find("mrow")]
    assert tags == ["mi", "mspace", "mi", "mspace", "mi"]
    assert tree(r"\cos(t)").find(".//mspace") is None
    assert tree(r"\cos \mathrm{th}").find(".//mspace") is not None
    assert tree(r"\cos \left(\mathrm{th} + t\right)").find(".//mspace") is None


def test_subset_of_the_subset_keeps_all_that_is_asked_for(tmp_path):
    """The command that makes the font leaves characters and the table of mathematics in it."""
    source = files("nlctl.analysis.report").joinpath("fonts/nlctl-math.woff2")
    (tmp_path / "font.woff2").write_bytes(source.read_bytes())
    again = TTFont(io.BytesIO(subset(tmp_path / "font.woff2")))
    assert {ord(c) for c in CHARACTERS} <= set(again.getBestCmap())
    assert again["MATH"].table.MathConstants.AxisHeight.Value > 0
