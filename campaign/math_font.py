"""The font of formulas on pages: the characters that formulas need, of a math font.

    python campaign/math_font.py STIXTwoMath-Regular.woff2

makes the file that `nlctl.analysis.report.mathml` puts into every page.
"""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path

from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont

import nlctl.analysis.report
from nlctl.analysis.report.mathml import FAMILY, FILE

_GREEK = "αβγδεζηθικλμνξοπρςστυφχψωϑϕϖϱϵΓΔΘΛΞΠΣΥΦΨΩ"
_OPERATORS = "·×÷±∓∂∇∞∫∑∏√∈∉∋∀∃∅∩∪⊂⊆≤≥≪≫≠≈≡∼∝∘∗⋅⋯…⋮⋱∧∨¬⊤⊥∣∥‖|−⁄′″ℓℎℏℜℑ"
_ARROWS = "←→↔↑↓⇐⇒⇔↦⟶⟹⟨⟩⌈⌉⌊⌋"
_ACCENTS = "ˆ^~˜¯‾―_˙¨˘ˇ\u0302\u0303\u0304\u0307\u0308\u20d7"
_BLACKBOARD = "ℂℕℚℝℤ"


def italic(character: str) -> str:
    """Return the slanted form in which a browser draws a one-letter ``<mi>``."""
    code = ord(character)
    if character == "h":
        return "ℎ"
    for first, last, start in (
        ("A", "Z", 0x1D434),
        ("a", "z", 0x1D44E),
        ("Α", "Ω", 0x1D6E2),
        ("α", "ω", 0x1D6FC),
    ):
        if ord(first) <= code <= ord(last):
            return chr(start + code - ord(first))
    odd = {"∂": 0x1D715, "ϵ": 0x1D716, "ϑ": 0x1D717, "ϕ": 0x1D719, "ϱ": 0x1D71A, "ϖ": 0x1D71B}
    return chr(odd.get(character, code))


_LATIN = "".join(chr(code) for code in range(0x20, 0x7F))
CHARACTERS = frozenset(_LATIN + _GREEK + _OPERATORS + _ARROWS + _ACCENTS + _BLACKBOARD)
CHARACTERS |= {"\u00a0"} | {italic(c) for c in _LATIN + _GREEK + "∂"}


def subset(source: str | os.PathLike[str]) -> bytes:
    """Return the subset of a math font that `CHARACTERS` need, as WOFF2."""
    # The pieces of stretched signs and the MATH table stay; the names change, as the licence asks.
    font = TTFont(source, recalcTimestamp=False)
    options = Options()
    options.layout_features = []
    options.desubroutinize = True  # larger, but it packs better
    options.hinting = False
    options.name_IDs = [0, 1, 2, 4, 6, 14]
    options.drop_tables += ["DSIG", "FFTM"]
    subsetter = Subsetter(options)
    subsetter.populate(unicodes=[ord(c) for c in CHARACTERS])
    subsetter.subset(font)
    names = {1: FAMILY, 4: FAMILY, 6: FAMILY.replace(" ", "-")}
    for record in font["name"].names:
        if record.nameID in names:
            record.string = names[record.nameID].encode(record.getEncoding())
    top = font["CFF "].cff
    top.fontNames = [FAMILY.replace(" ", "-")]
    top.topDictIndex[0].FullName = top.topDictIndex[0].FamilyName = FAMILY
    font.flavor = "woff2"
    buffer = io.BytesIO()
    font.save(buffer)
    return buffer.getvalue()


if __name__ == "__main__":
    Path(nlctl.analysis.report.__file__).parent.joinpath(FILE).write_bytes(subset(sys.argv[1]))
