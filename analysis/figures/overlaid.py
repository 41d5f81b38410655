"""Signals of two runs in one figure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from nlctl.annotations import as_annotated
from nlctl.plotting.axes import BLUE, GREY, TIME, legend_above, stacked_axes
from nlctl.plotting.labels import plain


@as_annotated
def overlaid(
    before: tuple[np.ndarray, Mapping[str, np.ndarray]],
    after: tuple[np.ndarray, Mapping[str, np.ndarray]],
    unit: str = "",
) -> Figure:
    """Signals over time before and after a change, a row for each that both have.

    Parameters
    ----------
    before, after : tuple of array of shape (m,) and mapping of str to array of shape (m,)
        Times (s), and samples by name; what is not finite is drawn as a gap.
    unit : str, optional
        Of all signals.

    Returns
    -------
    Figure
        Of matplotlib; nothing is written or shown.
    """
    names = [name for name in before[1] if name in after[1]]
    figure, axes = stacked_axes(rows=max(1, len(names)), height=1.9 if len(names) > 1 else 2.6)
    for ax, name in zip(axes, names, strict=False):
        ax.plot(before[0], before[1][name], color=GREY, linewidth=2.4, alpha=0.6, label="before")
        ax.plot(after[0], after[1][name], "--", color=BLUE, linewidth=1.4, label="after")
        ax.set_ylabel(plain(name) + (f" ({plain(unit)})" if unit else ""), parse_math=False)
    legend_above(axes[0])
    axes[-1].set_xlabel(TIME)
    return figure
