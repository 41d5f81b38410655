"""Functions of time that are pieces of straight lines, and where they switch."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...expressions.functions import COUNTING
from ...expressions.graph import Expr, needed, numpy_function

_MOST = 1_000_000  # pieces


class NotLines(Exception):  # noqa: N818 (it ends a reading; nobody else sees it)
    """A function of time is not made of pieces of straight lines."""


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Pieces of straight lines, values[k] + slopes[k] (t - starts[k]) from starts[k] on."""

    starts: np.ndarray  # shape (k,)
    values: np.ndarray
    slopes: np.ndarray
    end: float  # where the last piece ends (s)

    @property
    def ends(self) -> np.ndarray:
        """Where the pieces end (s)."""
        return np.append(self.starts[1:], self.end)

    def at(self, starts: np.ndarray) -> "Lines":
        """Return the same with pieces that begin at `starts`, its own among them."""
        k = np.searchsorted(self.starts, starts, side="right") - 1
        with np.errstate(all="ignore"):  # a piece that nothing chooses may be a division by 0
            values = self.values[k] + self.slopes[k] * (starts - self.starts[k])
        return Lines(starts=starts, values=values, slopes=self.slopes[k], end=self.end)

    def divided(self, at: np.ndarray) -> "Lines":
        """Return the same, with more pieces."""
        inner = at[(at > self.starts[0]) & (at < self.end)]
        starts = np.union1d(self.starts, inner)
        if starts.size > _MOST:
            raise NotLines
        return self.at(starts)

    def roots(self) -> np.ndarray:
        """Return where it is 0 inside of a piece, or its sign changes between two pieces."""
        with np.errstate(all="ignore"):
            inner = self.starts - self.values / self.slopes
        inside = (inner > self.starts) & (inner < self.ends)
        last = self.values + self.slopes * (self.ends - self.starts)
        turned = self.starts[1:][np.sign(last[:-1]) != np.sign(self.values[1:])]
        return np.union1d(inner[inside], turned)

    def integers(self, shift: float) -> np.ndarray:
        """Return where it + shift is an integer inside of a piece."""
        first = self.values + shift
        last = first + self.slopes * (self.ends - self.starts)
        low, high = np.ceil(np.minimum(first, last)), np.floor(np.maximum(first, last))
        counts = np.where(self.slopes == 0, 0, np.maximum(high - low + 1, 0))
        if not np.isfinite(counts).all() or counts.sum() > _MOST:
            raise NotLines
        counts = counts.astype(int)
        piece = np.repeat(np.arange(counts.size), counts)
        step = np.arange(piece.size) - np.repeat(np.cumsum(counts) - counts, counts)
        with np.errstate(all="ignore"):
            return self.starts[piece] + (low[piece] + step - first[piece]) / self.slopes[piece]


def as_lines(
    results: list[Expr], constants: Callable[[Expr], np.ndarray], span: tuple[float, float]
) -> dict[Expr, Lines]:
    """Return expressions of t alone as pieces of lines, those that are."""
    found: dict[Expr, Lines] = {}
    for node in needed(results):
        try:
            if not node.varies:
                value = constants(node)
                if value.ndim:
                    continue
                found[node] = _line(float(value), 0.0, span)
            elif node.op == "leaf" and node.data[0] == "t":
                found[node] = _line(span[0], 1.0, span)
            elif all(arg in found for arg in node.args):
                found[node] = _combined(node, found)
        except NotLines:
            continue
    return found


def switches(node: Expr, found: Mapping[Expr, Lines]) -> np.ndarray:
    """Return when a condition of t alone switches, whose arguments are known as lines (s)."""
    args = [found[arg] for arg in node.args]
    if node.op in ("floor", "ceil", "trunc"):
        return args[0].integers(0.0)
    if node.op == "rint":
        return args[0].integers(0.5)
    if node.op in ("remainder", "fmod", "floor_divide"):
        return _divide(*_same(*args)).integers(0.0)
    if node.op in ("lt", "le", "gt", "ge", "eq", "ne", "minimum", "maximum"):
        a, b = _same(*args)
        return _sum(a, b, -1.0).roots()
    return (args[1] if node.op == "copysign" else args[0]).roots()


def levels_met(
    node: Expr, found: Mapping[Expr, Lines], constants: Callable[[Expr], np.ndarray]
) -> np.ndarray | None:
    """Return when lines meet the levels of a table that they are compared with (s), or None."""
    line, table = node.args if len(node.args) == 2 else (node, node)
    line, table = (table, line) if table in found else (line, table)
    if node.op not in ("lt", "le", "gt", "ge") or line not in found or table.varies:
        return None
    levels, own = np.unique(constants(table)), found[line]
    if levels.size * own.starts.size > _MOST:
        return None
    above = (replace(own, values=own.values - level) for level in levels)
    return np.unique(np.concatenate([line.roots() for line in above]))


def _line(value: float, slope: float, span: tuple[float, float]) -> Lines:
    start = np.array([span[0]])
    return Lines(starts=start, values=np.array([value]), slopes=np.array([slope]), end=span[1])


def _same(*lines: Lines) -> list[Lines]:
    """Return functions with the same pieces."""
    starts = lines[0].starts
    for other in lines[1:]:
        starts = np.union1d(starts, other.starts)
    if starts.size > _MOST:
        raise NotLines
    return [each.at(starts) for each in lines]


def _sum(a: Lines, b: Lines, factor: float) -> Lines:
    return replace(a, values=a.values + factor * b.values, slopes=a.slopes + factor * b.slopes)


def _scaled(a: Lines, by: np.ndarray | float) -> Lines:
    return replace(a, values=a.values * by, slopes=a.slopes * by)


def _divide(a: Lines, b: Lines) -> Lines:
    if np.any(b.slopes):
        raise NotLines
    with np.errstate(all="ignore"):
        return _scaled(a, 1.0 / b.values)


def _combined(node: Expr, found: Mapping[Expr, Lines]) -> Lines:
    """Return what an operation makes of lines."""
    args = _same(*(found[arg] for arg in node.args))
    if node.op in ("add", "sub"):
        return _sum(args[0], args[1], 1.0 if node.op == "add" else -1.0)
    if node.op == "neg":
        return _scaled(args[0], -1.0)
    if node.op == "div":
        return _divide(*args)
    if node.op == "mul":
        steady = [not np.any(each.slopes) for each in args]
        if not any(steady):
            raise NotLines
        a, b = args if steady[1] else args[::-1]
        return _scaled(a, b.values)
    return _piecewise(node, args)


def _piecewise(node: Expr, args: list[Lines]) -> Lines:
    """Return an operation that is one of lines between its switches."""
    own = dict(zip(node.args, args, strict=True))
    if node.op not in _ON_PIECES:
        raise NotLines
    if node.op in ("select", "and", "or", "xor", "not"):
        parts = args
    else:
        at = switches(node, own)
        parts = [each.divided(at) for each in args]
    length = parts[0].ends - parts[0].starts
    middle = [each.values + 0.5 * each.slopes * length for each in parts]
    return _ON_PIECES[node.op](node.op, parts, middle, 0.5 * length)


def _constant(op: str, parts: list[Lines], middle: list[np.ndarray], half: object) -> Lines:
    """Return what is constant on each piece."""
    with np.errstate(all="ignore"):
        values = np.asarray(numpy_function(op)(*middle), dtype=float)
    return replace(parts[0], values=values, slopes=np.zeros(values.size))


def _chosen(op: str, parts: list[Lines], middle: list[np.ndarray], half: object) -> Lines:
    """Return one of the arguments on each piece, or its negative."""
    if op == "select":
        first, a, b = middle[0] != 0, parts[1], parts[2]
    elif op == "absolute":
        first, a, b = middle[0] >= 0, parts[0], _scaled(parts[0], -1.0)
    else:
        less = middle[0] < middle[1]
        first, (a, b) = (less if op == "minimum" else ~less), parts
    values, slopes = np.where(first, a.values, b.values), np.where(first, a.slopes, b.slopes)
    return replace(a, values=values, slopes=slopes)


def _rest(op: str, parts: list[Lines], middle: list[np.ndarray], half: object) -> Lines:
    """Return the remainder of a line by a constant: the same slope, another level."""
    if np.any(parts[1].slopes):
        raise NotLines
    with np.errstate(all="ignore"):
        return replace(parts[0], values=numpy_function(op)(*middle) - parts[0].slopes * half)


_ON_PIECES: dict[str, Callable[..., Lines]] = {
    **dict.fromkeys(("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "xor", "not"), _constant),
    **dict.fromkeys((*COUNTING, "sign", "heaviside"), _constant),
    **dict.fromkeys(("select", "absolute", "minimum", "maximum"), _chosen),
    **dict.fromkeys(("remainder", "fmod"), _rest),
}
