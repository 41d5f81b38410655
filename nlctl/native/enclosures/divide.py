"""Claims and suprema when boxes are divided in machine code."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .boxes import BoxCode
from .search import ALL_PROVED, BOX_SEARCH, FULL, REFUTED
from .writer import LANES

_ROOM = 2_048  # boxes for which there is room to begin with
_ALONE = 20_000  # boxes after which the rest is divided among threads
_PARTS = 16  # into which it is divided, whatever their number


@dataclass(frozen=True, kw_only=True)
class BoxVerdict:
    """The verdict on the claim that the least of some functions is at most a bound on a box."""

    holds: bool | None  # none: undecided
    # boxes judged, and those that stayed undecided
    boxes: int
    undecided: int
    # where it is refuted, or the centre of an undecided box; not a number along sides without an
    # end
    point: np.ndarray
    value: float  # the least of the functions at a point that refutes it, rounded down


@dataclass(frozen=True, kw_only=True)
class Supremum:
    """A supremum between two numbers."""

    high: float  # no value is above it: infinite where that has no proof
    attained: float  # a lower bound of a value at a point; see `supremum` for sides without an end
    # boxes judged, and those left without a bound
    boxes: int
    unbounded: int


def decide_claim(
    code: BoxCode,
    low: ArrayLike,
    high: ArrayLike,
    bound: float,
    *,
    max_boxes: int,
    numbers: Sequence[float] | np.ndarray = (),
    threads: int = 1,
) -> BoxVerdict:
    """Prove or refute that the least of the functions is at most `bound` on a box."""
    # Shapes: `low, high` (sides,), without those whose `numbers` are given.
    low, high = (np.append(side, numbers) for side in (low, high))
    _check_fixed(code, low, high)
    begun = _Search(code, np.stack([low, high], axis=1).reshape(1, -1), bound)
    begun.run(min(max_boxes, _ALONE))
    if begun.finished or begun.boxes >= max_boxes:
        return begun.verdict([])
    rest = begun.stack[: begun.counts[0]]
    begun.counts[0] = 0
    share = -(-(max_boxes - begun.boxes) // _PARTS)
    parts = [_Search(code, rest[k::_PARTS], bound, begun.whole) for k in range(_PARTS)]
    if threads > 1:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(lambda part: part.run(share), parts))
    else:
        for part in parts:
            if part.run(share) == REFUTED:
                break
    return begun.verdict(parts)


class _Search:
    """A search that can be continued."""

    def __init__(
        self, code: BoxCode, boxes: np.ndarray, bound: float, whole: np.ndarray | None = None
    ) -> None:
        n = code.sides
        self.code, self.bound, self.status = code, bound, FULL
        self.whole = _widths(boxes[0]) if whole is None else whole
        self.stack = np.empty((len(boxes) + _ROOM, 2 * n))
        self.stack[: len(boxes)] = boxes
        self.counts = np.array([len(boxes), 0, 0])
        self.point = np.full(n + 1, np.nan)
        self.room = _room(code)

    @property
    def boxes(self) -> int:
        """Boxes judged."""
        return int(self.counts[1])

    @property
    def finished(self) -> bool:
        """Whether nothing is left to be judged."""
        return self.status == REFUTED or self.counts[0] == 0

    def run(self, most: int) -> int:
        """Judge boxes until there are so many, or none is left."""
        rows = self.code.rows
        places, prove_below = (rows.centre, rows.weight), BOX_SEARCH.functions["prove_below"]
        while True:
            self.status = prove_below(
                self.code.judge, places, *self.room, self.stack, self.whole, self.bound, most,
                self.counts, self.point,
            )  # fmt: skip
            if self.status != FULL:
                return self.status
            self.stack = np.concatenate([self.stack, np.empty_like(self.stack)])

    def verdict(self, parts: "list[_Search]") -> BoxVerdict:
        """Return what was found, by this search and by others that went on with its boxes."""
        # The first that is refuted counts, and those before it.
        every = [self, *parts]
        refuted = [part.status == REFUTED for part in every]
        every = every[: refuted.index(True) + 1] if any(refuted) else every
        boxes, open_ = sum(p.boxes for p in every), sum(int(p.counts[[0, 2]].sum()) for p in every)
        last = every[-1]
        if last.status == REFUTED:
            point, value = last.point[:-1], float(last.point[-1])
            return BoxVerdict(holds=False, boxes=boxes, undecided=0, point=point, value=value)
        if not open_:
            return BoxVerdict(
                holds=True, boxes=boxes, undecided=0, point=self.point[:-1], value=np.nan
            )
        where = next(p for p in every if p.counts[0] or p.counts[2])
        point = where.point[:-1]
        if not where.counts[2]:
            ends = where.stack[where.counts[0] - 1].reshape(-1, 2)
            point = 0.5 * ends[:, 0] + 0.5 * ends[:, 1]
        return BoxVerdict(holds=None, boxes=boxes, undecided=open_, point=point, value=np.nan)


def enclose_supremum(
    code: BoxCode,
    low: np.ndarray,
    high: np.ndarray,
    *,
    tol: float,
    max_boxes: int,
    hopeless: int,
    relative: float = 1e-10,
) -> Supremum:
    """Enclose the supremum of the least of the functions on a box; shapes: `low, high` (sides,)."""
    _check_fixed(code, low, high)
    box = np.stack([low, high], axis=1).reshape(-1)
    nodes, index, keys = np.empty((_ROOM, box.size)), np.zeros((3, _ROOM), dtype=np.int64), None
    nodes[0], keys = box, np.empty(_ROOM)
    counts, bounds = np.array([1, 0, 1, 0, 0]), np.array([-np.inf, -np.inf])
    rows, room, whole = code.rows, _room(code), _widths(box)
    limits = (float(tol), float(relative), int(max_boxes), int(hopeless))
    supremum = BOX_SEARCH.functions["supremum"]
    while True:
        status = supremum(
            code.judge, (rows.centre, rows.weight), *room, nodes, index, keys, whole, limits,
            counts, bounds,
        )  # fmt: skip
        if status == ALL_PROVED:
            break
        nodes = np.concatenate([nodes, np.empty_like(nodes)])
        index = np.concatenate([index, np.zeros_like(index)], axis=1)
        keys = np.concatenate([keys, np.empty_like(keys)])
    return Supremum(
        high=float(bounds[0]), attained=float(bounds[1]), boxes=int(counts[3]),
        unbounded=int(counts[4]),
    )  # fmt: skip


def _check_fixed(code: BoxCode, low: np.ndarray, high: np.ndarray) -> None:
    first = code.sides - code.fixed
    if not np.array_equal(low[first:], high[first:]):
        raise ValueError(f"sides from {first} on are numbers, and have no width")


def _room(code: BoxCode) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((2 * code.sides, LANES)), np.zeros((code.rows.count, LANES))


def _widths(box: np.ndarray) -> np.ndarray:
    ends = box.reshape(-1, 2)
    return ends[:, 1] - ends[:, 0]
