"""Requirements as text: the words that `str(formula)` prints, read back.

    formula  = both ("or" both)*
    both     = part ("and" part)*
    part     = "not" part | ("always" | "eventually") [window] part | "(" formula ")" | band
    window   = "in" "[" number "," number "]" "s" | "from" number "s" "on"
    band     = "|" signal [("+" | "-") number] "|" "<=" number | signal ("<=" | ">=") number
             | number "<=" signal "<=" number

"not", "always" and "eventually" hold for the next part only; use parentheses for more.  A part that
looks at its own time alone may not stand next to one that begins with "always" or "eventually":
``always |e| <= 0.6 and |u| <= 0.5`` would look at u at t = 0 only.
"""

import re
from collections.abc import Callable, Sequence

from nlctl.errors import ParameterError
from nlctl.wording import nearest

from .formula import And, Formula, always, begins_window, eventually, in_band, looks_ahead

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_NAME = r"[A-Za-z_][\w.]*(?:\[\d+\])?"
_TOKEN = re.compile(
    rf"\s*(?:(?P<number>{_NUMBER})|(?P<name>{_NAME})|(?P<sign><=|>=|[-+|()\[\],])|(\S))"
)
_WORDS = ("always", "and", "eventually", "from", "in", "not", "on", "or", "s")
DEPTH = 50
EXAMPLE = "always from 10 s on |e| <= 0.15"


def parse_formula(text: str) -> Formula:
    """Read a formula such as ``always from 10 s on |e| <= 0.15``, as study files have them.

    Parameters
    ----------
    text : str
        What ``str(formula)`` prints: bands, ``and``, ``or``, ``not``, ``always`` and ``eventually``
        with ``in [0.5, 2] s`` or ``from 10 s on``, and parentheses.

    Returns
    -------
    Formula
        With scales that follow from the bounds.

    Raises
    ------
    ParameterError
        If it cannot be read: where, and what is expected there.

    Examples
    --------
    >>> print(parse_formula("always from 10 s on |e| <= 0.15"))
    always from 10 s on |e| <= 0.15
    """
    reader = _Reader(text)
    formula = _formula(reader, 0)
    if reader.here:
        raise reader.error("'and', 'or' or the end")
    return formula


class _Reader:
    """The words of a formula, and how far they have been read."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.words: list[tuple[str, str, int]] = []  # (kind, word, column), then the end
        self.next = 0
        for match in _TOKEN.finditer(text.rstrip()):
            kind = match.lastgroup or "other"
            word = match[match.lastgroup or 4]
            kind = "word" if kind == "name" and word in _WORDS else kind
            self.words.append((kind, word, match.end() - len(word)))
        self.words.append(("end", "", len(text)))

    @property
    def here(self) -> str:
        return self.words[self.next][1]

    @property
    def kind(self) -> str:
        return self.words[self.next][0]

    def took(self, word: str) -> bool:
        """Step over `word` if it stands here."""
        matches = self.here == word
        self.next += matches
        return matches

    def take(self, words: Sequence[str]) -> None:
        for word in words:
            if not self.took(word):
                raise self.error(f"'{word}'")

    def one(self, kind: str, what: str) -> str:
        if self.kind != kind:
            raise self.error(what)
        self.next += 1
        return self.words[self.next - 1][1]

    def number(self) -> float:
        return float(self.one("number", "a number"))

    def signal(self) -> str:
        return self.one("name", "the name of a signal")

    def is_bracketed(self, first: int) -> bool:
        """Whether what was read from a word on stands in one pair of brackets."""
        depth = 0
        for number, (_, word, _) in enumerate(self.words[first : self.next], first):
            depth += (word == "(") - (word == ")")
            if depth == 0:
                return word == ")" and number == self.next - 1
        return False

    def error(self, expected: str) -> ParameterError:
        _, word, column = self.words[self.next]
        here = f"'{word}' at character {column + 1}" if word else "the end"
        return ParameterError(
            f"formula '{self.text}' needs {expected}, found {here}; write it like '{EXAMPLE}'"
        )


def _formula(reader: _Reader, depth: int) -> Formula:
    parts = _parts(reader, depth, "or", _both)
    return parts[0] if len(parts) == 1 else ~And(parts=tuple(~part for part in parts))


def _both(reader: _Reader, depth: int) -> Formula:
    parts = _parts(reader, depth, "and", _part)
    return parts[0] if len(parts) == 1 else And(parts=tuple(parts))


def _parts(
    reader: _Reader, depth: int, word: str, read: Callable[[_Reader, int], Formula]
) -> list[Formula]:
    """Read the parts between words; refuse what is easily read as something else."""
    parts, are_open = [], []
    while not parts or reader.took(word):
        first = reader.next
        parts.append(read(reader, depth))
        are_open.append(not reader.is_bracketed(first))
    windows = [
        p
        for p, is_open in zip(parts, are_open, strict=True)
        if is_open and any(map(begins_window, p.parts if isinstance(p, And) else (p,)))
    ]
    now = [part for part in parts if not looks_ahead(part)]
    if windows and now:
        raise ParameterError(
            f"formula '{reader.text}' looks at '{now[0]}' at one time only, since 'always' and "
            f"'eventually' hold for the next part alone: write 'always (... {word} ...)' for all "
            f"of it, or '({windows[0]}) {word} {now[0]}' where that is meant"
        )
    return parts


def _part(reader: _Reader, depth: int) -> Formula:
    if depth > DEPTH:
        raise ParameterError(f"a formula needs at most {DEPTH} levels, got more: '{reader.text}'")
    if reader.took("not"):
        return ~_part(reader, depth + 1)
    for word, operator in (("always", always), ("eventually", eventually)):
        if reader.took(word):
            start, end = _window(reader)
            return operator(_part(reader, depth + 1), start, end)
    if reader.took("("):
        inner = _formula(reader, depth + 1)
        reader.take([")"])
        return inner
    return _band(reader)


def _window(reader: _Reader) -> tuple[float, float]:
    if reader.took("in"):
        reader.take(["["])
        start = reader.number()
        reader.take([","])
        end = reader.number()
        reader.take(["]", "s"])
        return start, end
    if reader.took("from"):
        start = reader.number()
        reader.take(["s", "on"])
        return start, float("inf")
    return 0.0, float("inf")


def _band(reader: _Reader) -> Formula:
    if reader.took("|"):
        signal, middle = reader.signal(), _middle(reader)
        reader.take(["|", "<="])
        bound = reader.number()
        return in_band(signal, lower=middle - bound, upper=middle + bound)
    if reader.kind == "number":
        lower = reader.number()
        reader.take(["<="])
        signal = reader.signal()
        reader.take(["<="])
        return in_band(signal, lower=lower, upper=reader.number())
    if reader.kind != "name":
        raise reader.error("a band such as |e| <= 0.15")
    signal = reader.signal()
    if reader.took("<="):
        return in_band(signal, upper=reader.number())
    if reader.took(">="):
        return in_band(signal, lower=reader.number())
    near = nearest(signal, ("always", "eventually", "not"), 1, 0.7)
    meant = f" (is '{signal}' meant to be '{near[0]}'?)" if near else ""
    raise reader.error(f"'<=' or '>='{meant}")


def _middle(reader: _Reader) -> float:
    """Return around what a signal lies in |y - 1|, which is 0 in |y|."""
    if reader.kind == "number" and reader.here[0] in "+-":
        return -reader.number()
    for sign, factor in (("-", 1.0), ("+", -1.0)):
        if reader.took(sign):
            if reader.kind == "name":
                raise reader.error(
                    f"a number behind '{sign}' (a difference of two signals is an output of the "
                    "loop, such as e)"
                )
            return factor * reader.number()
    return 0.0
