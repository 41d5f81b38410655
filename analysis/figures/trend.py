"""Claims and numbers of one study over its revisions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from nlctl.plotting.axes import BLUE, GREY, LINE, ORANGE, legend_above
from nlctl.plotting.labels import plain

from .labels import draws, panels

_LOOKS = {  # how a claim ended: colour, marker, word
    "holds": (BLUE, "o", "holds"),
    "open": (GREY, "D", "open"),
    "fails": (ORANGE, "X", "fails or is refuted"),
}
ROW, PANEL, _FRAME = 0.3, 1.1, 0.9  # in
_MOST = 20  # labels of revisions


@draws
def trend(
    labels: Sequence[str],
    claims: Mapping[str, Sequence[str]],
    numbers: Mapping[str, Sequence[float]],
) -> Figure:
    """Marks for claims, and a line for each number, over revisions.

    Parameters
    ----------
    labels : sequence of str
        The revisions, the oldest first.
    claims : mapping of str to sequence of str
        By name how each claim ended: ``"holds"``, ``"open"``, ``"fails"``, or nothing where it was
        not made.
    numbers : mapping of str to sequence of float
        By name; what is not finite is a gap.
    """
    heights = [_FRAME / 2 + ROW * len(claims)] * bool(claims) + [PANEL] * len(numbers)
    shape = {"sharex": True, "height_ratios": heights or None}
    figure, rows = panels(sum(heights) + _FRAME, max(1, len(heights)), **shape)
    at = np.arange(len(labels))
    if claims:
        _marks(rows.pop(0), claims)
    for ax, (name, row) in zip(rows, numbers.items(), strict=False):
        ax.plot(at, np.asarray(row, dtype=float), "-o", color=BLUE, markersize=4, linewidth=1.4)
        ax.set_title(plain(name), loc="left", fontsize="medium", parse_math=False)
        ax.yaxis.set_major_locator(MaxNLocator(3))
        ax.margins(y=0.2)
    last = figure.axes[-1]
    last.set_xlim(-0.4, len(labels) - 0.6)
    step = -(-len(labels) // _MOST)  # of very many not each has its label
    turned = max(map(len, labels), default=0) * len(labels) > LINE
    last.set_xticks(
        at[::step],
        [plain(x) for x in labels[::step]],
        parse_math=False,
        rotation=90 if turned else 0,
    )
    return figure


def _marks(ax: Axes, claims: Mapping[str, Sequence[str]]) -> None:
    """Draw a row of marks for each claim, the first one at the top."""
    drawn: dict[str, Any] = {}
    for row, ends in enumerate(claims.values()):
        for place, end in enumerate(ends):
            if end in _LOOKS:
                colour, marker, word = _LOOKS[end]
                (drawn[word],) = ax.plot([place], [row], marker, color=colour, markersize=7)
    ax.set_yticks(range(len(claims)), [plain(name) for name in claims], parse_math=False)
    ax.set_ylim(len(claims) - 0.5, -0.5)
    legend_above(ax, drawn)
