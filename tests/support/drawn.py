"""What a reader could not see of a figure: words that are cut off or lie on curves."""

from itertools import combinations, pairwise

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.container import BarContainer
from matplotlib.legend import Legend

from nlctl.analysis.report.svg import LEAST_LETTERS

EDGE = 0.01  # inches: half the width of a line


def hidden(figure):
    """Return a sentence for each text that is cut off and each that lies on a curve or another.

    Letters are as large as on a page.
    """
    with mpl.rc_context({"font.size": LEAST_LETTERS}):
        return _hidden(figure, FigureCanvasAgg(figure).get_renderer())


def _hidden(figure, renderer):
    figure.draw(renderer)
    told = [] if _inside(figure.get_tightbbox(renderer), figure) else ["something is cut off"]
    for ax in figure.axes:
        inner = [*ax.texts, *filter(None, [ax.get_legend()])]
        for item in inner:
            box = item.get_window_extent(renderer).shrunk(0.96, 0.8)
            told += [f"{_name(item)} lies on {line}" for line in _crossing(ax, box)]
    labels = [t for ax in figure.axes for t in (*ax.texts, ax.xaxis.label, ax.yaxis.label)]
    places = {t: t.get_window_extent(renderer) for t in labels if t.get_text()}
    told += [
        f"{_name(a)} lies on {_name(b)}"
        for a, b in combinations(places, 2)
        if places[a].shrunk(0.9, 0.8).overlaps(places[b].shrunk(0.9, 0.8))
    ]
    ticks = [axis.get_ticklabels() for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)]
    for texts in ticks:
        shown = [t for t in texts if t.get_visible() and t.get_text()]
        told += [
            f"the tick {_name(a)} runs into {_name(b)}"
            for a, b in pairwise(shown)
            if a.get_window_extent(renderer).overlaps(b.get_window_extent(renderer))
        ]
    return told


def _inside(drawn, figure):
    """Whether what is drawn, in inches, lies on the paper."""
    low, high = np.array([drawn.min, drawn.max])
    return bool(np.all(low >= -EDGE) and np.all(high <= figure.get_size_inches() + EDGE))


def _name(item):
    if isinstance(item, Legend):
        return f"the legend of {[t.get_text() for t in item.get_texts()]}"
    return f"'{item.get_text()}'"


def _crossing(ax, box):
    """Yield curves and bars that pass through a box; straight lines across are no curves."""
    for line in ax.lines:
        path = line.get_path().transformed(line.get_transform())
        xy = path.vertices[np.all(np.isfinite(path.vertices), axis=1)]
        if len(xy) > 2 and path.intersects_bbox(box, filled=False):
            yield f"the curve '{line.get_label()}'"
    for bar in (bar for bars in ax.containers if isinstance(bars, BarContainer) for bar in bars):
        if bar.get_window_extent().overlaps(box):
            yield "a bar"
