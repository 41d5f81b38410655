"""Figures of findings take numbers of any size: recorded tables may hold any that a file can."""

import io

import numpy as np
import pandas as pd
import pytest

from nlctl.analysis import figures

NAMES = ["a", "b", "c"]
BY = ["search", "Sobol'", "search"]
FIGURES = {
    "screening": (figures.screening, "mu_star low high sigma"),
    "shares": (figures.shares, "S1 S1_low S1_high ST ST_low ST_high"),
    "tornado": (lambda t: figures.tornado(t, 0.4), "low high run_low run_high"),
    "set apart": (figures.set_apart, "statistic"),
    "violation rates": (figures.violation_rates, "rate rate_low rate_high"),
    "paired": (
        lambda t: figures.paired_differences(t, NAMES, "iae"), "median median_low median_high",
    ),
    "fault margins": (lambda t: figures.fault_margins(t["m"]), "m"),
    "fault pairs": (lambda t: figures.fault_pairs(t.set_axis(NAMES, axis=1)), "x y z"),
    "bought": (lambda t: figures.bought(t, 0.1, 0.4, "margin"), "alone put_back"),
    "tried": (lambda t: figures.tried(t.assign(by=BY)), "runs margin"),
    "tried, cost": (lambda t: figures.tried(t.assign(by=BY), cost=True), "runs cost"),
    "both": (lambda t: figures.margins_of_both(t["m"].to_numpy(), t["n"].to_numpy()), "m n"),
    "degradation": (lambda t: figures.degradation(t.set_axis([0.1, 0.2, 0.3])), "rate lower upper"),
    "deviations": (figures.deviations, "row other"),
    "radius": (lambda t: figures.radius_steps(t, 0.3), "size margin"),
    "search": (lambda t: figures.search(t["m"].to_numpy(), NAMES), "m"),
    "estimate": (lambda t: figures.running_estimate(t.set_axis([1, 2, 3])), "rate low high"),
}  # fmt: skip
EXTREMES = [np.inf, -np.inf, np.nan, 1e308, -1e308, 0.0, 1e-320]


@pytest.mark.parametrize(
    ("values", "parts"),
    [
        pytest.param((np.nan, np.inf, 1e-320), [slice(None)], marks=pytest.mark.ci, id="three"),
        pytest.param(EXTREMES, [slice(0, 1), slice(None)], marks=pytest.mark.weekly, id="all"),
    ],
)
@pytest.mark.parametrize("name", FIGURES)
def test_numbers_of_any_size_are_drawn(name, values, parts):
    """In one row or in all, each column: a figure, and no warning (which would be an error)."""
    draw, columns = FIGURES[name][0], FIGURES[name][1].split()
    plain = np.array([[0.3], [-0.2], [0.5]]) * (1.0 + np.arange(len(columns)))
    for column in columns:
        for value in values:
            for rows in parts:
                table = pd.DataFrame(plain, index=NAMES, columns=columns)
                table.loc[table.index[rows], column] = value
                file = io.BytesIO()
                draw(table).savefig(file, format="svg")
                assert file.getbuffer().nbytes > 2000
