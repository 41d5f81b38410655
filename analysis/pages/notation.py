r"""The ledger's notation -> text with formulas: what stands for symbols becomes LaTeX.

    "V' <= -alpha_1 V, Q = sup I"  ->  r"\(\dot{V}\le -\alpha_{1}\,V\), \(Q=\sup I\)"

The ledger writes a formula as it is typed on a terminal.  A word is part of a formula if it is a
symbol of the paper, a function, or a single letter; numbers and signs next to it belong to it.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator

_GREEK = {
    "eps": r"\varepsilon", "delta": r"\delta", "alpha": r"\alpha", "sigma": r"\sigma",
    "Gamma": r"\Gamma", "gamma": r"\gamma", "beta": r"\beta", "tau": r"\tau", "zeta": r"\zeta",
    "kappa": r"\kappa", "psi": r"\psi", "Omega": r"\Omega", "inf": r"\infty", "mu": r"\mu",
    "lambda": r"\lambda", "eta": r"\eta", "phi": r"\varphi", "rho": r"\rho",
}  # fmt: skip
_FUNCTIONS = ("arctan", "argmin", "cosh", "tanh", "sinh", "sqrt", "cos", "sin", "exp", "log", "max",
              "min", "sup")  # fmt: skip
_SIGNS = {"<=": r"\le ", ">=": r"\ge ", "{": r"\{", "}": r"\}", "~": r"\approx "}
_RELATIONS = frozenset(["<=", ">=", "=", "<", ">"])
OPENING, _CLOSING = frozenset("([{"), frozenset(")]}")

_NAME = (
    rf"(?:d?(?:{'|'.join(_GREEK)})|[A-Za-z])"  # also dzeta
    r"(?:_(?:max|min|hat|\{[a-z0-9+-]+\}|[A-Za-z]|\d+))*\d*(?:~|(?<=[lE])[+-](?=[\s,=]|$))?\*?'*"
)
_TOKEN = re.compile(
    rf"(?P<integral>int(?:_0\^s)?(?![A-Za-z]))|(?P<function>(?:{'|'.join(_FUNCTIONS)})(?![A-Za-z_]))"
    rf"|(?P<name>{_NAME}(?![A-Za-z_~'\d]))|(?P<word>[^\W\d_][\w'-]*(?:-[\w'-]+)*)"
    r"|(?P<label>(?<![\w~'*])\((?:\d+[a-z]?|[a-z])\))|(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?)"
    r"|(?P<sign><=|>=|[-+=/|(\[{}\])<>^])|(?P<space> +)|(?P<other>.)"
)
ARTICLES = frozenset(["a", "A"])


def formulas(words: str) -> str:
    """Return a statement of the ledger as text with formulas between ``\\(`` and ``\\)``."""
    text, run = "", []
    for kind, token in _tokens(words):
        if kind in ("integral", "function", "name", "number", "sign", "space", "label"):
            run.append((kind, token))
        elif token == "," and _depths(run)[-1] > 0:
            run.append(("sign", token))
        else:
            text, run = text + _segment(run) + token, []
    return text + _segment(run)


def _tokens(words: str) -> Iterator[tuple[str, str]]:
    """Yield kind and text; an article and the unit of a number are words."""
    before: list[str] = ["", ""]
    for match in _TOKEN.finditer(words):
        kind, token = str(match.lastgroup), match[0]
        alone = before[-1] in ("", "space", "other", "word")
        if kind == "name" and token in ARTICLES and alone and words[match.end() :][:1] == " ":
            kind = "word"
        if kind == "name" and token == "s" and before in (["number", "space"], ["]", "space"]):
            kind = "word"
        yield kind, token
        before = [before[-1], token if token == "]" else kind]


def _depths(run: list[tuple[str, str]]) -> list[int]:
    """Return how many brackets of a run are open, at first and after each of its signs."""
    signs = [token for kind, token in run if kind == "sign"]
    return [0, *itertools.accumulate((s in OPENING) - (s in _CLOSING) for s in signs)]


def _segment(run: list[tuple[str, str]]) -> str:
    """Return tokens as a formula, and as text what surrounds it or is none."""
    named = [i for i, (kind, _) in enumerate(run) if kind in ("name", "function", "integral")]
    if not named:
        return "".join(token for _, token in run)
    start, end = 0, len(run)
    while start < named[0] and run[start][0] in ("space", "label"):
        start += 1
    while end - 1 > named[-1] and run[end - 1][0] in ("space", "label"):
        end -= 1
    before, after = ("".join(token for _, token in part) for part in (run[:start], run[end:]))
    depths = _depths(run[start:end])
    if min(depths) < 0 or depths[-1] > 0:
        return _without_brackets(run)
    return rf"{before}\({_latex(run[start:end])}\){after}"


def _without_brackets(run: list[tuple[str, str]]) -> str:
    """Return a run whose brackets hold words as well: formulas between its brackets."""
    text, part = "", []
    for kind, token in run:
        if kind == "sign" and token in OPENING | _CLOSING:
            text, part = text + _segment(part) + token, []
        else:
            part.append((kind, token))
    return text + _segment(part)


def _latex(run: list[tuple[str, str]]) -> str:
    """Return the LaTeX of tokens; factors that a space sets apart get a thin one."""
    latex = ""
    for place, (kind, token) in enumerate(run):
        if kind == "space":
            sides = run[place - 1], run[place + 1]
            latex += r"\," if all(map(_is_factor, sides, (True, False))) else ""
        elif kind == "name":
            latex += _name(token)
        elif kind == "function":
            latex += {"sqrt": r"\sqrt", "argmin": r"\mathrm{argmin}"}.get(token, rf"\{token} ")
        elif kind == "integral":
            latex += r"\int_0^s " if "_" in token else r"\int "
        else:
            latex += _SIGNS.get(token, token)
    return _powers(latex)


def _is_factor(token: tuple[str, str], before: bool) -> bool:
    kind, text = token
    if kind == "sign":
        return text in (_CLOSING if before else OPENING) or text == "|"
    return kind in ("name", "number", "label") or (kind in ("function", "integral") and not before)


def _powers(latex: str) -> str:
    """Put into braces what is raised or under a root, and make one of two exponents."""
    latex = re.sub(r"\^\(([^()]*)\)", r"^{\1}", latex)
    latex = re.sub(r"\^(-?\w+)", r"^{\1}", latex)
    latex = re.sub(r"\\sqrt\(([^()]*)\)", r"\\sqrt{\1}", latex)
    return re.sub(r"\^\{\*\}\^\{(\w+)\}", r"^{*\1}", latex)


def _name(token: str) -> str:
    """Return a symbol: letter, accents for hats, tildes and derivatives, index, star."""
    dots = len(token) - len(token.rstrip("'"))
    token = token.rstrip("'")
    star, token = ("^{*}" if token.endswith("*") else ""), token.rstrip("*")
    tilde, token = token.endswith("~"), token.rstrip("~")
    side = token[-1] if token[-1] in "+-" else ""
    token = token.rstrip("+-")
    base, *indices = token.split("_")
    base, number = re.fullmatch(r"(.*?)(\d*)", base).groups()  # type: ignore[union-attr]
    differential, letter = ("d", base[1:]) if base[1:] in _GREEK and base[0] == "d" else ("", base)
    latex = _GREEK.get(letter, letter)
    for accent in (*(["hat"] if "hat" in indices else []), *(["tilde"] if tilde else [])):
        latex = rf"\{accent}{{{latex}}}"
    if dots:
        latex = rf"\{'dot' if dots == 1 else 'ddot'}{{{latex}}}"
    lower = ",".join(
        rf"\{i}" if i in ("max", "min") else i.strip("{}")
        for i in [*indices, number, side]
        if i not in ("", "hat")
    )
    return f"{differential}{latex}{f'_{{{lower}}}' if lower else ''}{star}" + (
        " " if latex.startswith("\\") and not latex.endswith("}") and not lower + star else ""
    )
