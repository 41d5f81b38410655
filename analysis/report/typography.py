"""Text as it is set in print: minus signs, powers, units that stay with their number, formulas.

Whatever a report says is plain text; a formula inside it is written as LaTeX between ``\\(`` and
``\\)``.  `pieces` says what the page shows of it, `plain_text` how it reads where only text can
stand.
"""

import re
from dataclasses import dataclass, replace

from .mathml import spoken

NO_BREAK = "\u00a0"
UNITS = (
    "%|‰|°C|°|s|ms|µs|min|h|m|mm|cm|µm|km|g|kg|N|kN|Nm|rad|mrad|deg|Hz|kHz|V|mV|A|mA|W|kW|K|Pa|kPa"
    "|J|kJ|kB|MB|GB"
)
FORMULA = re.compile(r"\\\((.+?)\\\)", re.DOTALL)
DOI = re.compile(r"(?:\bdoi:?\s*|https://doi\.org/)(10\.\d{4,9}/[\w.()/:-]*\w)", re.IGNORECASE)
RAISED = str.maketrans("-+0123456789i", "⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹ⁱ")

_POWER_OF_TEN = re.compile(r"(?<![\w.·])(\d+(?:\.\d+)?)e([+-]?)0*(\d{1,3})(?![\w.]*\w)")
_POWER = re.compile(r"(?<=[A-Za-zα-ω)|])\^(-?(?:\d+|i))(?![\w.])")
_MINUS = re.compile(r"(?:^|(?<=[\s(\[{=,;:|<>≤≥±…·]))-(?=[\d∞]|\.\d)")
_SIGNS = ((" <= ", " ≤ "), (" >= ", " ≥ "), (")-(", ")–("))
_UNIT = re.compile(
    rf"(?<=[\d∞⁰¹²³⁴⁵⁶⁷⁸⁹\]]) (?=(?:{UNITS}|1/[A-Za-z]+|/ [A-Za-z])(?![A-Za-z0-9_]))"
)
_TAIL = re.compile(r"[,.;:)\]]+")
_RELATED = re.compile(r"(?<=[=<>≤≥±≈]) (?=[−+]?[\d∞])")
_SYMBOL = re.compile(rf"(?<!\S)(\(?[^\W\d]\S{{0,19}}|\|\S{{1,12}}\|) (?=[=<>≤≥±≈]{NO_BREAK})")
_PER_CENT = re.compile(r"(?<=\d)(?=%(?![\w%]))")
_NUMBERED = re.compile(r"\b(Example|Lemma|row|size) (?=\d)")
_SLASH = re.compile(rf"(?<=\d{NO_BREAK}/) (?=[A-Za-z])")


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A stretch of text: plain, or a formula (LaTeX), or a DOI."""

    text: str = ""
    latex: str = ""
    tail: str = ""  # what stays on the line of the formula before it
    doi: str = ""


def in_print(text: str) -> str:
    """Return plain text with the signs of print; what is not a number, power or unit stays."""
    # 1e-06 becomes 10⁻⁶, 1/s^4 becomes 1/s⁴, -0.5 has a minus sign, and the spaces of 10 s, 99 %, t
    # = 3 and Example 1 do not break.
    text = _POWER_OF_TEN.sub(_scientific, text)
    text = _POWER.sub(lambda match: match[1].translate(RAISED), text)
    text = _MINUS.sub("−", text)
    for typed, sign in _SIGNS:
        text = text.replace(typed, sign)
    text = _UNIT.sub(NO_BREAK, text)
    text = _SLASH.sub(NO_BREAK, text)
    text = _PER_CENT.sub(NO_BREAK, text)
    text = _RELATED.sub(NO_BREAK, text)
    text = _SYMBOL.sub(rf"\1{NO_BREAK}", text)
    return _NUMBERED.sub(rf"\1{NO_BREAK}", text)


def _scientific(number: re.Match[str]) -> str:
    mantissa, sign, exponent = number.groups()
    if float(mantissa) == 0:
        return "0"
    if exponent == "0":
        return mantissa
    power = f"10{(sign.strip('+') + exponent).translate(RAISED)}"
    return power if mantissa == "1" else f"{mantissa}·{power}"


def pieces(text: str) -> list[Piece]:
    """Split a text at its formulas and DOIs; what is between them is set as in print."""
    parts = []
    for number, part in enumerate(FORMULA.split(text)):
        if number % 2:
            parts.append(Piece(latex=part))
            continue
        if parts and (tail := _TAIL.match(part)):
            parts[-1] = replace(parts[-1], tail=tail[0])
            part = part[tail.end() :]
        words, *rest = DOI.split(part)
        for doi, after in zip(rest[0::2], rest[1::2], strict=True):
            parts += [Piece(text=f"{in_print(words)}doi "), Piece(doi=doi)]
            words = after
        parts.append(Piece(text=in_print(words)))
    return [piece for piece in parts if piece != Piece()]


def plain_text(text: str) -> str:
    """Return a text whose formulas are written in letters, for titles and descriptions."""
    return in_print(FORMULA.sub(lambda match: spoken(match[1]), text))
