"""What a block diagram is made of on paper: records, lettering, pen strokes.  Units are points."""

import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

FONT = "DejaVu Sans"  # comes with matplotlib, so a figure is the same on every machine
GRID, LANE_WIDTH, STUB, ROW_GAP, APART = 8.0, 9.0, 16.0, 24.0, 48.0
EXTERNAL = -1  # in place of a wire: the arrow from or to the outside
_Point = tuple[float, float]
Links = set[tuple[int, int]]  # (source, target)
Heights = Mapping[tuple[int, int], float]  # [block, wire]


@dataclass(frozen=True)
class Text:
    """Words and the room they take on paper."""

    text: str = ""
    w: float = 0.0
    h: float = 0.0


@dataclass(frozen=True)
class LayoutNode:
    """What the layout knows of a block: its smallest size, its external inputs and outputs."""

    w: float
    h: float
    inlet: Text = Text()
    outlet: Text = Text()


@dataclass(frozen=True)
class Wire:
    """A bundle of signals, from a block to all blocks that receive exactly this bundle."""

    source: int
    targets: tuple[int, ...]
    label: Text


@dataclass(frozen=True)
class GridCell:
    """Cell of a block; `share` runs from 0 (top of its column) to 1 (bottom)."""

    band: int
    column: int
    share: float


@dataclass(frozen=True)
class BlockFrame:
    """Rectangle of a block; `x, y` is its upper left corner."""

    x: float
    y: float
    w: float
    h: float


@dataclass(frozen=True)
class Label:
    """Text at a place; `x, y` is its upper left corner."""

    x: float
    y: float
    text: Text


@dataclass(frozen=True)
class Route:
    """Orthogonal arrow; `source` or `target` is None (and so is `wire`) outside the diagram.

    The routes of one wire start together; the first of them carries the label.
    """

    points: tuple[_Point, ...]
    label: Label | None
    source: int | None
    target: int | None
    wire: int | None = None


@dataclass(frozen=True)
class Layout:
    """A placed diagram: one box per block, arrows, and dots where a wire branches."""

    width: float
    height: float
    boxes: tuple[BlockFrame, ...]
    routes: tuple[Route, ...]
    dots: tuple[_Point, ...]


def bundle(names: Sequence[str], letters: int = 14) -> str:
    """Write many names short: ``psi1 ... psi27`` for numbers in sequence, then a count."""
    runs: list[list[str]] = []
    for name in dict.fromkeys(names):
        follows = runs and _successor(runs[-1][-1]) == name
        runs[-1].append(name) if follows else runs.append([name])
    words = []
    for run in runs:
        words += [f"{run[0]} ... {run[-1]}"] if len(run) > 3 else run
    if len(words) > 9:
        words = [*words[:6], "...", words[-1], f"({len(set(names))} signals)"]
    # A name is never broken across lines, so its own spaces hide behind a letter meanwhile.
    text = ", ".join(word.replace(" ", "\xa0") for word in words).replace(", (", " (")
    lines = textwrap.wrap(text, letters, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace("\xa0", " ")


def _successor(name: str) -> str | None:
    """The name with its last number counted up by one."""
    parts = re.fullmatch(r"(.*?)(\d+)(\D*)", name, re.DOTALL)
    return parts and f"{parts[1]}{int(parts[2]) + 1}{parts[3]}"


def measured_text(text: str, size: float, weight: str = "normal") -> Text:
    """Text in `FONT` with its size on paper."""
    font, lines = FontProperties(family=FONT, size=size, weight=weight), text.split("\n")
    widths = [text_to_path.get_text_width_height_descent(s, font, False)[0] for s in lines if s]
    return Text(text, max(widths, default=0.0), 1.25 * size * len(lines) if text else 0.0)


def strokes(routes: Sequence[Route]) -> list[tuple[_Point, _Point]]:
    """Straight pen strokes that draw some routes, each stretch once though they share it."""
    lines: dict[tuple[int, float], list[tuple[float, float]]] = {}
    for start, end in [pair for route in routes for pair in pairwise(route.points)]:
        along = int(start[0] == end[0])
        span = min(start[along], end[along]), max(start[along], end[along])
        lines.setdefault((along, start[1 - along]), []).append(span)
    drawn: list[tuple[_Point, _Point]] = []
    for (along, at), spans in lines.items():
        merged: list[list[float]] = []
        for low, high in sorted(spans):
            if merged and low <= merged[-1][1]:
                merged[-1][1] = max(merged[-1][1], high)
            else:
                merged.append([low, high])
        drawn += [((at, a), (at, b)) if along else ((a, at), (b, at)) for a, b in merged]
    return drawn
