r"""Proofs on a page: a ledger line by line, and a certificate with its constants.

The ledger's notation -> text with formulas: what stands for symbols becomes LaTeX.

    "V' <= -alpha_1 V, Q = sup I"  ->  r"\(\dot{V}\le -\alpha_{1}\,V\), \(Q=\sup I\)"

The ledger writes a formula as it is typed on a terminal.  A word is part of a formula if it is a
symbol of the paper, a function, or a single letter; numbers and signs next to it belong to it.
"""

import itertools
import re
from collections import Counter
from collections.abc import Iterator

import numpy as np

from ..lyapunov.ledger import Ledger, Line
from ..lyapunov.proofs.result import Certificate
from ..report.document import Item, Paragraph, Section, Table
from .diagram import own_values

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


PROVED = (
    "Proved: by interval arithmetic over the whole box of states, or for all arguments. Computed: "
    "in closed form."
)
CHECKED = (
    "Only checked: seen to hold at every sample of this run, up to rounding. That is not a proof "
    "for other runs, nor between samples. “Literal”: with q cos(w t) counted to g(x), as the paper "
    "has it, and with the d* and eps* of that g; the corrected line counts it to d."
)
VIOLATED = (
    "Violated: statements of the proof in their corrected form that do not hold along this run."
)
FAILING = "False as printed, or as the paper uses it."
LEFT_OPEN = "Left open: what this run cannot decide, and what does not apply to it."
_GROUPS = (  # of the ledger's lines, each a table of its own
    (("violated",), "corrected", VIOLATED),
    (("proved", "computed"), None, PROVED),
    (("checked",), None, CHECKED),
    (("violated",), "paper", FAILING),
    (("undecided", "not applicable"), None, LEFT_OPEN),
)


def ledger_section(ledger: Ledger, key: str, title: str, level: int = 2) -> Section:
    """Return a ledger: a sentence, then its lines, a table for each group of statuses."""
    items: list[Item] = [Paragraph(text=ledger_text(ledger)), *_ledger_tables(ledger)]
    return Section(key=key, title=title, items=items, level=level, folded=True)


def ledger_text(ledger: Ledger) -> str:
    """Return the ledger in a paragraph: what is violated, and how many lines are what."""
    corrected = ", ".join(line.key for line in ledger.violated)
    paper = ", ".join(line.key for line in ledger.failing)
    count = Counter(line.status for line in ledger.lines)
    counts = ", ".join(f"{number} {status}" for status, number in count.items())
    return (
        f"Corrected statements violated: {corrected or 'none'}. False as printed: "
        f"{paper or 'none'}. One run over {ledger.horizon:g} s; of {len(ledger.lines)} lines "
        f"{counts}. The constants hold on the box {formulas(str(ledger.constants.box))}."
    )


def _ledger_tables(ledger: Ledger) -> Iterator[Table]:
    """Yield the lines of a ledger as tables, one for each group of statuses."""
    for statuses, reading, caption in _GROUPS:
        group = [x for x in ledger.lines if x.status in statuses and reading in (None, x.reading)]
        rows = [_row(line) for line in group]
        if rows:
            columns = ("line", "status", "statement", "least margin", "at (s)", "evidence")
            yield Table(caption=caption, columns=columns, rows=rows, status="status")


def _row(line: Line) -> tuple[str, ...]:
    least, at = ("" if np.isnan(x) else f"{x + 0.0:.4g}" for x in (line.least, line.time))
    evidence = formulas(line.evidence)
    if not np.isnan(line.first):
        evidence = f"{evidence}, first at {line.first:.4g} s"
    if line.follows:
        evidence = f"{evidence}. What follows: {formulas(line.follows)}"
    status = line.status
    if status == "violated" and line.reading == "paper":
        status = "violated as printed"  # the paper's statement is wrong, nothing of ours
    return line.key, status, formulas(line.statement), least, at, evidence


def certificate_section(certificate: Certificate) -> Section:
    """Return a certificate: what is proved, then every constant with where it comes from."""
    table = Table(
        caption="The constants of the certificate, and the bounds that follow from them.",
        columns=("symbol", "value", "unit", "status", "how", "for"),
        rows=[
            (c.symbol, f"{c.value:.6g}", c.unit, c.provenance, c.how, c.over)
            for c in certificate.constants
        ],
        status="status",
    )
    values = own_values("The loop of the proof", certificate.params)
    items: list[Item] = [Paragraph(text=f"{certificate.verdict}."), *values, table]
    return Section(key="certificate", title="A bound for all time", items=items)
