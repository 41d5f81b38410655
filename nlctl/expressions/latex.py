"""Expressions as LaTeX: the formula that is computed, in the names that its author gave."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from itertools import repeat

from .functions import FUNCTIONS
from .graph import Expr, Untraceable, needed

_GREEK = """alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma
tau upsilon phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"""
GREEK_LETTERS = frozenset(_GREEK.split())
MARKS = {"hat": r"\hat", "bar": r"\bar", "tilde": r"\tilde", "dot": r"\dot", "ddot": r"\ddot"}
_RELATIONS = {"lt": "<", "le": r"\le", "gt": ">", "ge": r"\ge", "eq": "=", "ne": r"\ne"}
_WORDS = {"and": r"\text{ and }", "or": r"\text{ or }", "xor": r"\text{ xor }"}
# how tightly a formula holds together; what is unclosed, as \sin x, would take what follows into it
WORD, SUM, TERM, SIGNED, UNCLOSED, FACTOR, ATOM = range(7)
# of others by their brackets
_TIGHTNESS = {"remainder": SUM, "exp": FACTOR, "exp2": FACTOR, "hypot": ATOM}
LETTERS = "ijklm"
Index = tuple[int, int, str]  # element start + step (letter - 1) of a vector, from 0
ENCLOSED = (
    r"(?:\{{\{{|\\left\(|\\left\||\\l(?:floor|ceil) |, |\(1 \+ )\{{{}\}}"  # where {0} needs no ( )
)


def symbol(name: str) -> str:
    r"""Return an identifier as a symbol: ``W_hat`` is a W with a hat, ``b_r`` a b with index r.

    Elements of vectors are counted from 1, as on paper: ``W_hat[0]`` is the first one.

    Examples
    --------
    >>> symbol("delta_hat")
    '\\hat{\\delta}'
    >>> symbol("x1"), symbol("p_mean")
    ('x_{1}', 'p_{\\mathrm{mean}}')
    """
    element = re.fullmatch(r"(.*?)\[(\d+)\]", name)
    if element:
        return with_index(symbol(element[1]), str(int(element[2]) + 1))
    head, *rest = [part for part in name.split("_") if part] or [name]
    marks = [MARKS[part] for part in rest if part in MARKS]
    rest = [part for part in rest if part not in MARKS]
    letters = re.fullmatch(r"([A-Za-z]+)(\d+)", head)
    if letters:
        head, rest = letters[1], [letters[2], *rest]
    if len(head) == 2 and (head[1] == "d" or head[0] in "kK"):  # yd, what is desired; gains, kp
        head, rest = head[0], [head[1], *rest]
    text = _word(head)
    for mark in marks:
        text = f"{mark}{{{text}}}"
    return f"{text}_{{{','.join(map(_word, rest))}}}" if rest else text


def with_index(text: str, index: str) -> str:
    """Return a symbol with an index, behind those that it has: LaTeX takes one subscript."""
    has_one = re.search(r"_\{(?:[^{}]|\{[^{}]*\})*\}$", text)
    return f"{text[:-1]},{index}}}" if has_one else f"{text}_{{{index}}}"


def _word(part: str) -> str:
    for letter in (part, part.removesuffix("s")):  # lambdas
        if letter in GREEK_LETTERS:
            return f"\\{letter}"
    return part if len(part) == 1 or part.isdigit() else rf"\mathrm{{{part}}}"


def number_text(value: float) -> str:
    """Return a number with all its digits and no more; powers of ten and parts of pi as such."""
    if value != value:
        return r"\mathrm{NaN}"
    if value in (float("inf"), float("-inf")):
        return r"\infty" if value > 0 else r"-\infty"
    for n in (1, 2, 3, 4, 6) if abs(value) < 100 * math.pi else ():
        k = round(value * n / math.pi)
        if 0 < abs(k) < 100 and math.gcd(k, n) == 1 and value == k * math.pi / n:
            top = {1: r"\pi", -1: r"-\pi"}.get(k, rf"{k} \pi")
            return top if n == 1 else ("-" if k < 0 else "") + rf"\frac{{{top.lstrip('-')}}}{{{n}}}"
    digits = repr(float(value))
    mantissa, _, exponent = digits.partition("e")
    mantissa = mantissa.removesuffix(".0")
    if not exponent:
        return mantissa
    power = f"10^{{{int(exponent)}}}"
    return {"1": power, "-1": f"-{power}"}.get(mantissa, rf"{mantissa} \cdot {power}")


@dataclass(kw_only=True)
class LatexWriter:
    """Writes the formulas of one function."""

    # takes an array's name and the place in it, and returns the symbol; for a vector the
    # place is that of its first element and the third argument an index
    leaf: Callable[[str, Index], str]
    # expressions that have a name; those that are used are in `used` afterwards
    known: Mapping[Expr, str] = field(default_factory=dict)
    used: dict[Expr, str] = field(default_factory=dict)
    # names of vectors of constants, found on the way
    tables: dict[Expr, str] = field(default_factory=dict)

    def formula(self, expr: Expr, index: Index | None = None, *, by_name: bool = True) -> str:
        """Return an expression, or the element of a vector at an index, as a formula."""
        return self._written(expr, index, 0, by_name=by_name)[0]

    def _written(
        self, expr: Expr, index: Index | None, depth: int, *, by_name: bool = True
    ) -> tuple[str, int]:
        """Return a formula and how tightly it holds together."""
        index = index if expr.size else None
        if by_name and expr in self.known:
            self.used[expr] = self.known[expr]
            name = self.known[expr]
            return (name if index is None else with_index(name, index_text(index))), ATOM
        if expr.op in FUNCTIONS:
            return self._function(expr, index, depth)
        return getattr(self, f"_{expr.op}", self._other)(expr, index, depth)

    def _held(self, expr: Expr, index: Index | None, depth: int, least: int) -> str:
        """Return a formula, in parentheses where it would fall apart."""
        return _held(*self._written(expr, index, depth), least)

    def _const(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        text = number_text(float(expr.data))
        is_product = r"\cdot" in text or text.endswith(r" \pi")
        return text, SIGNED if text.startswith("-") else FACTOR if is_product else ATOM

    def _table(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        assert index is not None
        if not index[1]:
            return number_text(expr.data[index[0]]), ATOM
        name = self.tables.setdefault(expr, f"c^{{({len(self.tables) + 1})}}")
        return with_index(name, index_text(index)), ATOM

    def _leaf(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        array, start, step = expr.data
        first, by, letter = index or (0, 0, "")
        return self.leaf(array, (start + step * first, step * by, letter)), ATOM

    def _item(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        return self._written(expr.args[0], (expr.data, 0, ""), depth)

    def _slice(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        start, step = expr.data
        first, by, letter = index or (0, 0, "")
        return self._written(expr.args[0], (start + step * first, step * by, letter), depth)

    def _concat(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        first, by, letter = index or (0, 0, "")
        at, rows = 0, []
        for piece, length in zip(expr.args, expr.data, strict=True):
            if not by and at <= first < at + length:
                return self._written(piece, (first - at, 0, ""), depth)
            text = self._written(piece, (first - at, by, letter), depth)[0]
            rows.append(rf"{text} & {_range_text(at, length, index)}")
            at += length
        return _cases(rows), UNCLOSED

    def _sum(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        letter = LETTERS[depth + 1] if depth + 1 < len(LETTERS) else f"i_{depth}"
        body = self._held(expr.args[0], (0, 1, letter), depth + 1, TERM)
        return rf"\sum_{{{letter}=1}}^{{{expr.args[0].size or 1}}} {body}", TERM

    def _terms(self, expr: Expr, sign: str, index: Index | None, depth: int) -> Iterator[str]:
        """Yield the signed terms of a sum, a difference or a negative."""
        flip = {"+": "-", "-": "+"}
        signs = {"add": (sign, sign), "sub": (sign, flip[sign]), "neg": (flip[sign],)}
        for its_sign, arg in zip(signs[expr.op], expr.args, strict=True):
            if arg.op in signs and arg not in self.known:
                yield from self._terms(arg, its_sign, index, depth)
                continue
            if expr.op == "sub" and arg.op == "const" and arg.data == 0.0:
                continue  # what asks for a zero's sign
            text = self._held(arg, index, depth, TERM)
            negative = text.startswith("-")
            yield f"{flip[its_sign] if negative else its_sign} {text[1:] if negative else text}"

    def _add(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        *before, last = self._terms(expr, "+", index, depth)
        text = " ".join([*(f"{term[:2]}{_closed(term[2:])}" for term in before), last])
        return (text[2:] if text.startswith("+ ") else f"-{text[2:]}"), SUM

    _sub = _neg = _add

    def _mul(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        factors = list(self._factors(expr))
        flipped = [f.op == "neg" and f not in self.known for f in factors]
        factors = [f.args[0] if flip else f for f, flip in zip(factors, flipped, strict=True)]
        numbers = [float(f.data) for f in factors if f.op == "const"]
        negative = (sum(flipped) + sum(value < 0 for value in numbers)) % 2
        texts = [number_text(abs(value)) for value in numbers if abs(value) != 1]
        last = []
        for factor in dict.fromkeys(f for f in factors if f.op != "const"):
            count = factors.count(factor)
            text, tightness = self._written(factor, index, depth)
            if count > 1:
                texts.append(f"{_held(text, tightness, ATOM)}^{{{count}}}")
            else:
                held = _held(text, tightness, UNCLOSED)
                (last if tightness == UNCLOSED else texts).append(held)
        return ("-" if negative else "") + _product(
            [*texts, *map(_closed, last[:-1]), *last[-1:]] or ["1"]
        ), TERM

    def _factors(self, expr: Expr) -> Iterator[Expr]:
        for arg in expr.args:
            if arg.op == "mul" and arg not in self.known:
                yield from self._factors(arg)
            else:
                yield arg

    def _div(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        above, below = (self._written(arg, index, depth)[0] for arg in expr.args)
        return rf"\frac{{{above}}}{{{below}}}", FACTOR

    def _select(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        if _is_guard(expr):
            return self._written(expr.args[1], index, depth)
        if extremum := _extremum(expr):
            parts = (self._held(arg, index, depth, SUM) for arg in reversed(expr.args[1:]))
            return FUNCTIONS[extremum].latex.format(*parts), ATOM
        rows, rest = [], expr
        while rest.op == "select" and (rest is expr or rest not in self.known):
            condition, yes, rest = rest.args
            conditions = [condition]
            while yes.op == "select" and yes.args[2] is rest and yes not in self.known:
                inner, yes, _ = yes.args
                conditions.append(inner)
            text = self._all(conditions, index, depth)
            rows.append(f"{self._written(yes, index, depth)[0]} & {text}")
        rows.append(rf"{self._written(rest, index, depth)[0]} & \text{{otherwise}}")
        return _cases(rows), UNCLOSED

    def _all(self, conditions: Sequence[Expr], index: Index | None, depth: int) -> str:
        """Return that several conditions hold at once."""
        if len(conditions) == 1:
            return self._written(conditions[0], index, depth)[0]
        least = (WORD if condition.op == "and" else SUM for condition in conditions)
        return reduce(_both, map(self._held, conditions, repeat(index), repeat(depth), least))

    def _lu(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        return self._matrix(expr.args, expr.data[1], expr.data[0], depth), ATOM

    def _lu_det(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        return rf"\det {self._lu(expr.args[0], None, depth)[0]}", UNCLOSED

    def _lu_solve(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        assert index is not None
        columns, (first, step, _) = expr.data[0][1], index
        matrix = self._lu(expr.args[0], None, depth)[0]
        right = self._matrix(expr.args[1:], expr.data[1][1:], columns, depth)
        text = rf"\left({matrix}^{{-1}} {right}\right)"
        if columns == 1 or step:
            rows = text if columns == 1 else rf"\operatorname{{vec}}\left({text}^{{T}}\right)"
            return rf"{rows}_{{{index_text(index)}}}", ATOM
        return rf"{text}_{{{first // columns + 1},{first % columns + 1}}}", ATOM

    def _matrix(
        self, args: Sequence[Expr], lengths: Sequence[int], columns: int, depth: int
    ) -> str:
        """Return a matrix of entries that are given row by row."""
        places = [(arg, k) for arg, n in zip(args, lengths, strict=True) for k in range(n)]
        entries = [self._written(arg, (k, 0, ""), depth)[0] for arg, k in places]
        rows = [" & ".join(entries[at : at + columns]) for at in range(0, len(entries), columns)]
        body = r" \\ ".join(rows)
        return rf"\begin{{pmatrix}} {body} \end{{pmatrix}}"

    def _not(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        return rf"\text{{not }} {self._held(expr.args[0], index, depth, ATOM)}", FACTOR

    def _function(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        row, argument = FUNCTIONS[expr.op], expr.args[0]
        if expr.op == "exp" and argument not in self.known and argument.op in ("div", "neg"):
            return rf"\exp\left({self._written(argument, index, depth)[0]}\right)", ATOM
        enclosed = [bool(re.search(ENCLOSED.format(i), row.latex)) for i in range(row.count)]
        if expr.op == "power":
            base, exponent = self._held(expr.args[0], index, depth, ATOM), expr.args[1]
            return row.latex.format(base, self._written(exponent, index, depth)[0]), FACTOR
        parts = [
            self._held(arg, index, depth, SUM if inside else ATOM)
            for arg, inside in zip(expr.args, enclosed, strict=True)
        ]
        text = row.latex.format(*parts).replace("1 + -", "1 - ")
        return text, _TIGHTNESS.get(expr.op, ATOM if all(enclosed) else UNCLOSED)

    def _other(self, expr: Expr, index: Index | None, depth: int) -> tuple[str, int]:
        if expr.op in _RELATIONS:
            left, right = (self._held(arg, index, depth, SUM) for arg in expr.args)
            return f"{_closed(left)} {_RELATIONS[expr.op]} {_closed(right)}", SUM
        if expr.op in _WORDS:
            least = [WORD if arg.op == expr.op != "xor" else SUM for arg in expr.args]
            pairs = zip(expr.args, least, strict=True)
            left, right = (self._held(arg, index, depth, least_bound) for arg, least_bound in pairs)
            return f"{_closed(left)}{_WORDS[expr.op]}{_closed(right)}", WORD
        raise Untraceable(f"{expr.op} of {expr.data} has no formula")


def _product(texts: list[str]) -> str:
    """Return factors behind each other: a dot between numbers, a thin space next to words."""
    joined = texts[0]
    for text in texts[1:]:
        dot = text[:1].isdigit() or (text.startswith(r"\frac") and joined[-1:].isdigit())
        word = text.startswith(r"\mathrm") or joined.rpartition(" ")[2].startswith(r"\mathrm")
        joined += rf" \cdot {text}" if dot else rf" \, {text}" if word else f" {text}"
    return joined


def _held(text: str, tightness: int, least: int) -> str:
    return text if tightness >= least else rf"\left({text}\right)"


def _closed(text: str) -> str:
    """Return what something may follow: in brackets if it ends with a list of cases."""
    return rf"\left({text}\right)" if text.endswith(r"\end{cases}") else text


def _is_guard(choice: Expr) -> bool:
    """Whether a choice is there for arguments at which Python's own function raises an error."""
    undefined = choice.args[2].op == "const" and choice.args[2].data != choice.args[2].data
    parts = needed([choice.args[0]]) if undefined else ()
    return any(e.op == "lu_regular" or (e.op == "const" and e.data == math.inf) for e in parts)


def _both(first: str, second: str) -> str:
    """Return two conditions that hold at once: a < b and b < c is a < b < c."""
    a, b = (re.split(r" (<|\\le|>|\\ge) ", text) for text in (first, second))
    turn = {">": "<", r"\ge": r"\le"}
    a, b = ([c[2], turn[c[1]], c[0]] if len(c) == 3 and c[1] in turn else c for c in (a, b))
    for low, high in ((a, b), (b, a)):
        if len(low) == len(high) == 3 and low[2] == high[0]:
            return " ".join([*low, *high[1:]])
    return rf"{first} \text{{ and }} {second}"


def _extremum(expr: Expr) -> str | None:
    """Return whether an expression is the larger or the smaller of two, as Python's `max` is."""
    condition, yes, no = expr.args
    if condition.op not in ("gt", "ge", "lt", "le") or {yes, no} != {*condition.args}:
        return None
    takes_first, above = yes is condition.args[0], condition.op in ("gt", "ge")
    return "maximum" if takes_first == above else "minimum"


def _cases(rows: list[str]) -> str:
    body = r" \\ ".join(rows)
    return rf"\begin{{cases}} {body} \end{{cases}}"


def index_text(index: Index) -> str:
    """Return an index as it is written: elements and letters count from 1."""
    start, step, letter = index
    if not step:
        return str(start + 1)
    name = letter if step == 1 else f"-{letter}" if step == -1 else f"{step}{letter}"
    ahead = start + 1 - step
    return name if not ahead else f"{name}{ahead:+d}"


def _range_text(at: int, length: int, index: Index | None) -> str:
    """Return for which indices a piece of a vector is meant."""
    place = index_text(index) if index else LETTERS[0]
    first, last = at + 1, at + length
    return f"{place} = {first}" if length == 1 else rf"{first} \le {place} \le {last}"
