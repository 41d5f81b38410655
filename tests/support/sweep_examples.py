"""A cheap loop with a known answer for the tests of sweeps, and what they compare with."""

import lag
import numpy as np
import pandas as pd
from scipy import stats

from nlctl.analysis import metrics
from nlctl.analysis.metrics import Metric
from nlctl.analysis.robustness import (
    Experiment,
    Requirement,
    Space,
    Spec,
    Uncertain,
    always,
    in_band,
)

T = np.linspace(0, 2, 101)


def loop(rate=1.0):
    """Return the diagram."""
    return lag.loop(lag.Lag(rate=rate))


def experiment(**changes):
    """Return an experiment in which some runs diverge and some violate."""
    given = {
        "space": Space(
            quantities=(
                Uncertain(name="lag.rate", law=stats.uniform(0.5, 2)),
                Uncertain(name="lag.gain", law=stats.uniform(0, 2)),
            )
        ),
        "build": loop,
        "spec": Spec(
            requirements=(
                Requirement(key="small", formula=always(in_band("y", upper=0.5), 1, 2), until=2),
                Requirement(key="bounded", formula=always(in_band("y", upper=2)), until=2),
            )
        ),
        "timepts": T,
        "metrics": (
            Metric(key="end", signal="y", unit="1", meaning="final", function=metrics.final),
            Metric(key="peak", signal="y", unit="1", meaning="peak", function=metrics.peak),
        ),
    }
    return Experiment(**given | changes)


def same(found, expected):
    """Hold two tables against each other, bit for bit; only wall times may differ."""
    found, expected = (table.drop(columns="wall_time") for table in (found, expected))
    pd.testing.assert_frame_equal(found, expected, check_exact=True)
    for name in found.select_dtypes("float64"):
        bits = (table[name].to_numpy().view(np.uint64) for table in (found, expected))
        np.testing.assert_array_equal(*bits, err_msg=name)
