"""Functions whose steps are smaller than what anybody asks of them: searches by halves.

``for _ in range(40): mid = (lo + hi) / 2; if f(mid) > 0: hi = mid`` asks in each pass for what
those before have chosen.  Where one answer changes, the later ones change with it, and what comes
out hardly does: 2^40 steps, none of which is a jump.  With all answers as they are it moves as its
first bracket does, so that no expression has its slope.  Differences show this: where shorter ones
agree with longer ones and none with the derivative, while each has other answers, the function is
called.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from .conditions import JUMPING
from .dependence import rows_read
from .derivatives import tangents
from .evaluate import evaluate_expressions
from .graph import COMPARISONS, Expr, Graph, Untraceable, needed
from .passes import IN_TURN, depths_of

_ASKING = (*COMPARISONS, *JUMPING)
_OPEN = ("leaf", "call", "solve")  # what has a value of its own at each point
_POINTS, _NUMBERS = 1024, 10**7  # so many, where all of their numbers have room
_STEPS = 2.0 ** -np.array([3, 4, 5, 7])[:, None, None]  # parts of the sizes of arguments
_ALIKE, _APART = 0.03, 0.09  # parts by which differences agree, and by which they contradict
_ROUNDED = 1e-6  # part of a value in which no slope is seen
_FEW = 8  # points at which so many numbers may be alike by chance
_TOLERANCE = 1e-6  # constants below are no sizes of anything
_SIZES = (0.1, 1.0, 10.0)  # of arguments, next to those of a function's own constants


class Staircase(Untraceable):
    """What a function computes has steps smaller than rounding: no expression has its slope."""


def check_slopes(graph: Graph, results: Sequence[Expr], given: Iterable[Expr]) -> None:
    """Refuse what is asked in a long chain and has another slope than its expressions."""
    given = set(given)
    nodes = needed(results, given)
    asking = [n for n in nodes if n.varies and n.op in _ASKING and n not in given]
    if max(depths_of(nodes, set(asking)).values(), default=0) < IN_TURN:
        return
    alone, copies = _alone(nodes, given)
    z, sizes = _points(nodes, copies, graph.nominal)
    way = sizes * np.random.default_rng(1).standard_normal(z.shape)
    copied, asked = [copies[e] for e in results], [copies[e] for e in asking]
    seeds = tangents(alone, copied, lambda leaf: alone.leaf("way", leaf.data[1], leaf.size))
    slopes = _values([slope or alone.const(0.0) for slope in seeds], z, way)
    moved = _moved([*copied, *asked], z, way)
    values, answers = np.split(moved, [len(slopes)], axis=1)
    points = np.flatnonzero(_have_another(slopes, *np.split(values, 2)))
    answers = np.sign(answers[:, :, points])
    differ = (len(np.unique(of_one, axis=0)) == len(moved) for of_one in np.moveaxis(answers, 2, 0))
    if sum(differ) >= _FEW:
        raise Staircase("a search by halves, of whose derivative no pass knows")


def _have_another(slopes: np.ndarray, ahead: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """Return at which points central differences contradict a slope."""
    with np.errstate(all="ignore"):
        values = np.nan_to_num(abs(ahead).max(axis=0), posinf=0.0)
        least = _ROUNDED * np.maximum(values, np.median(values, axis=1, keepdims=True))
        measured = (ahead - behind) / (2 * _STEPS)
    return np.any(contradicted(slopes, measured, least, _ALIKE, _APART), axis=0)


def contradicted(
    slopes: np.ndarray, measured: np.ndarray, seen: np.ndarray, alike: float, apart: float
) -> np.ndarray:
    """Return where differences (steps, ...) agree with each other, and not with slopes (...)."""
    # Up to the size `seen` differences see nothing.
    with np.errstate(all="ignore"):
        size = np.maximum(np.abs(measured).max(axis=0), np.abs(slopes))
        differ = np.abs(measured - slopes).min(axis=0) > apart * size
        return np.asarray(differ & (np.ptp(measured, axis=0) <= alike * size) & (size > seen))


def _alone(nodes: Sequence[Expr], given: set[Expr]) -> tuple[Graph, dict[Expr, Expr]]:
    """Return a function's expressions in a graph of their own, what they are made of as leaves."""
    alone, copies, rows = Graph(), dict[Expr, Expr](), 0
    for node in nodes:
        if node in given or node.op in _OPEN:
            copies[node] = alone.leaf("z", rows, node.size, node.kind, node.value)
            rows += node.size or 1
        else:
            copies[node] = alone.like(node, *(copies[arg] for arg in node.args))
    return alone, copies


def _points(
    nodes: Sequence[Expr], copies: Mapping[Expr, Expr], nominal: Mapping[int, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return values for leaves, and how far each is moved: of shape (rows, points) both."""
    constants = {abs(float(node.data)) for node in nodes if node.op == "const"}
    known = [size for size in sorted(constants) if _TOLERANCE < size < np.inf]
    count = min(_POINTS, max(_NUMBERS // sum(node.size or 1 for node in nodes), 4 * _FEW))
    chance, z, sizes = np.random.default_rng(0), [], []
    for node in (node for node in nodes if copies[node].op == "leaf"):
        shape = (node.size or 1, count)
        size = chance.choice([*_SIZES, *known], (3, *shape)).prod(axis=0)
        value = size * chance.standard_normal(shape)
        if node.op == "leaf" and node.data[0] == "p":  # parameters have the values that they have
            now = [[nominal.get(row, node.value or 0.0)] for row in rows_read(node)]
            value, size = np.broadcast_to(now, shape), np.abs(np.broadcast_to(now, shape))
            size = size * (node.kind == "f")
        z.append(value)
        sizes.append(size)
    return np.concatenate(z), np.concatenate(sizes)


def _moved(exprs: Sequence[Expr], z: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return what expressions are behind all steps, of shape (steps, rows, points)."""
    steps = [*_STEPS, *-_STEPS]
    there = np.concatenate([z + h * way for h in steps], axis=1)
    return np.stack(np.split(_values(exprs, there, there), len(steps), axis=1))


def _values(exprs: Sequence[Expr], z: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return what expressions are at points, of shape (rows, points)."""
    at_points = zip(exprs, evaluate_expressions(exprs, {"z": z, "way": way}), strict=True)
    return np.concatenate([np.broadcast_to(v, (e.size or 1, z.shape[1])) for e, v in at_points])
