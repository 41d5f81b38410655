"""One colour has one meaning in all figures; what it is is said next to the colours."""

import ast
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from drawn import hidden
from matplotlib.colors import to_hex, to_rgb
from places import ROOT

from nlctl.analysis import figures
from nlctl.plotting import axes
from nlctl.plotting.bands import bands

COLOURS = {name: getattr(axes, name) for name in ("BLUE", "ORANGE", "GREEN", "PURPLE", "GREY")}
T = np.linspace(0, 1, 51)


def colours_of(figure):
    """The colours of all lines of a figure, by their labels."""
    return {
        line.get_label(): to_hex(line.get_color()).upper()
        for ax in figure.axes
        for line in ax.get_lines()
    }


def luminance(colour):
    """Relative luminance (1) as WCAG 2 defines it."""
    rgb = np.array(to_rgb(colour))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4) @ (
        0.2126, 0.7152, 0.0722,
    )  # fmt: skip


def test_no_signal_has_the_colour_of_a_limit():
    """Signals and options are told by colours and by styles, of which none is orange."""
    colours, styles = zip(*axes.STYLES, strict=True)
    assert axes.ORANGE not in colours
    assert len(set(colours)) == len(set(styles)) == 4


def test_options_and_single_runs_differ_from_the_limit():
    """A study with choices: bands of options, the nominal run, the worst one, and the limit."""
    runs = np.vstack([np.sin(T), np.cos(T), np.sin(T) + 0.1, np.cos(T) + 0.1])
    figure, (ax,) = bands(
        T, {"y": runs}, {"nominal": {"y": T}, "worst": {"y": -T}},
        limits={"y": [(0.5, 0.0, 1.0)]}, groups=("a", "b", "a", "b"),
    )  # fmt: skip
    limit = {to_hex(c).upper() for part in ax.collections for c in part.get_edgecolor()}
    assert axes.ORANGE in limit
    found = colours_of(figure)
    assert axes.ORANGE not in found.values()
    assert found["nominal"] == found["worst"] == axes.TEXT_INK
    assert found["a"] != found["b"] != axes.TEXT_INK


def test_what_was_before_is_grey_and_what_is_after_is_blue():
    """In tuning and in comparisons."""
    signals = {"y": np.sin(T)}
    compared = figures.overlaid((T, signals), (T, {"y": np.cos(T)}))
    margins = figures.margins_of_both(np.sin(T), np.cos(T))
    for figure in (compared, margins):
        found = colours_of(figure)
        assert (found["before"], found["after"]) == (axes.GREY.upper(), axes.BLUE)


def test_lines_show_on_white():
    """A contrast of 3 to 1 (WCAG 2.2, 1.4.11), and no two alike."""
    for colour in COLOURS.values():
        assert 1.05 / (luminance(colour) + 0.05) >= 3.0
    for one, other in combinations(COLOURS.values(), 2):
        assert np.linalg.norm(np.subtract(to_rgb(one), to_rgb(other))) > 0.3


def test_figures_take_their_colours_from_here():
    """No module of figures has a colour of its own but the ink of a map, light everywhere."""
    own = {}
    for path in [*(ROOT / "analysis/figures").glob("*.py"), ROOT / "analysis/paper/figures.py"]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
            if is_text and node.value.startswith("#"):
                own[node.value] = path.name
    assert own == {"#111111": "searches.py"}


@pytest.mark.parted
@pytest.mark.parametrize("low", [-0.3, -0.0123, -12.5])
def test_ticks_of_margins_do_not_run_into_each_other(low):
    """Numbers of any length, at the size of letters that a page has."""
    assert hidden(figures.margins_figure(np.linspace(low, low / 2.5, 40))) == []


def test_a_trend_of_many_revisions_can_be_read():
    """Labels of revisions are turned where they are long, and left out where they are many."""
    for count in (2, 7, 60):
        labels = [f"revision {n}, 2026-01-15" for n in range(count)]
        ends = {f"REQ-{n}: a claim with a long text": ["holds"] * count for n in range(4)}
        drawn = figures.trend(labels, ends, {"margin": np.linspace(0.3, -0.1, count).tolist()})
        assert hidden(drawn) == []
    steps = pd.DataFrame({"size": [1.0, 2.0], "margin": [0.1, -0.1]})
    assert colours_of(figures.radius_steps(steps, 1.5))["violation"] == axes.ORANGE
