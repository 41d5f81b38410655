"""Signals of two runs in one figure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from nlctl.plotting.axes import BLUE, GREY, TIME, legend_above, stacked_axes
from nlctl.plotting.labels import plain

from .labels import draws

Bands = Mapping[str, tuple[np.ndarray, np.ndarray]]
"""Lower and upper end of a band over time, by the signal that it is drawn with."""


@draws
def overlaid(
    before: tuple[np.ndarray, Mapping[str, np.ndarray]],
    after: tuple[np.ndarray, Mapping[str, np.ndarray]],
    unit: str = "",
    bands: tuple[Bands, Bands] = ({}, {}),
) -> Figure:
    """Signals over time before and after a change, a row for each that both have.

    Parameters
    ----------
    before, after : tuple of array of shape (m,) and mapping of str to array of shape (m,)
        Times (s), and samples by name; what is not finite is drawn as a gap.
    unit : str, optional
        Of all signals.
    bands : tuple of two mappings of str to two arrays of shape (m,), optional
        Bands of ensembles before and after, by signal; drawn where both have one.
    """
    names = [name for name in before[1] if name in after[1]]
    figure, axes = stacked_axes(rows=max(1, len(names)), height=1.9 if len(names) > 1 else 2.6)
    for ax, name in zip(axes, names, strict=False):
        if name in bands[0] and name in bands[1]:
            lower, upper = bands[0][name]
            ax.fill_between(before[0], lower, upper, color=GREY, alpha=0.3, linewidth=0)
            lower, upper = bands[1][name]
            ax.fill_between(
                after[0], lower, upper, facecolor="none", edgecolor=BLUE, hatch="////",
                linewidth=0.6, alpha=0.5,
            )  # fmt: skip
        ax.plot(before[0], before[1][name], color=GREY, linewidth=2.4, alpha=0.6, label="before")
        ax.plot(after[0], after[1][name], "--", color=BLUE, linewidth=1.4, label="after")
        ax.set_ylabel(plain(name) + (f" ({plain(unit)})" if unit else ""), parse_math=False)
    legend_above(axes[0])
    axes[-1].set_xlabel(TIME)
    return figure
