"""Figures of faults: what one leaves of the margin, and two together."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nlctl.plotting.axes import BLUE, GREY, ORANGE, WIDTH

from ..robustness.stl.spec import violates
from .labels import draws, number_axes, plain
from .searches import COLOURS, MAP_INK, centred

REACH = 1.0  # margins beyond are drawn there


@draws
def fault_margins(margin: pd.Series) -> Figure:
    """Least margin that each fault leaves, with its name at the left.

    Parameters
    ----------
    margin : pandas.Series
        Least margin by the name of the fault.
    """
    figure, ax = number_axes(margin.index)
    value = np.clip(np.nan_to_num(margin.to_numpy(dtype=float), nan=-REACH), -REACH, REACH)
    at, bad = np.arange(len(value)), violates(margin)
    ax.barh(at[~bad], value[~bad], 0.6, color=BLUE, edgecolor="white")
    ax.barh(at[bad], value[bad], 0.6, color=ORANGE, hatch="///", edgecolor="white")
    ax.axvline(0.0, color=GREY, linewidth=1.0)
    ax.set(xlabel="least margin (1)", xlim=(-1.05 * REACH, 1.05 * REACH))
    return figure


@draws
def fault_pairs(margin: pd.DataFrame) -> Figure:
    """Least margin under each pair of faults; on the diagonal under one alone.

    Parameters
    ----------
    margin : DataFrame
        Square and symmetric, with the names of the faults.
    """
    count = len(margin)
    figure = Figure(figsize=(WIDTH, 2.2 + 0.22 * count), layout="constrained")
    ax = figure.subplots()
    value = np.clip(np.nan_to_num(margin.to_numpy(dtype=float), nan=-REACH), -REACH, REACH)
    image = ax.imshow(value, cmap=COLOURS, norm=centred(value), aspect="auto")
    rows, columns = np.nonzero(violates(margin.to_numpy()))
    ax.plot(columns, rows, "x", color=MAP_INK, markersize=4)
    names = [plain(name) for name in margin.index]
    ax.set_yticks(np.arange(count), names, parse_math=False, fontsize="medium")
    ax.set_xticks(np.arange(count), names, parse_math=False, fontsize="medium", rotation=90)
    figure.colorbar(image, ax=ax, label="least margin (1)")
    return figure
