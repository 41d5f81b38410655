"""Every controller on a computer, until its spec ends: two minutes.

    python campaign/sampling_runs.py

It writes the record that the paper's page reads.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from nlctl import paper
from nlctl.analysis.paper.controllers import compared_controllers
from nlctl.analysis.paper.sampling_limits import (
    QUANTITIES,
    SAMPLING_RECORD,
    sampling_runs,
    spec_ends,
    where_it_ends,
)

FINE = 8  # values between the last good and the first bad


def refined_runs(example: str, label: str) -> pd.DataFrame:
    """Run an example with one controller over all quantities, finer where its spec ends."""
    first = sampling_runs(example, label, {q.key: q.values for q in QUANTITIES})
    between = {}
    for quantity in QUANTITIES:
        good, bad = where_it_ends(first[first["quantity"] == quantity.key])
        if np.isfinite(good) and np.isfinite(bad):
            between[quantity.key] = np.geomspace(good, bad, FINE + 2)[1:-1]
    runs = pd.concat([first, sampling_runs(example, label, between)]) if between else first
    parts = [runs[runs["quantity"] == q.key].sort_values("value") for q in QUANTITIES]
    return pd.concat(parts, ignore_index=True)


def _main() -> None:
    """Make the record again."""
    record = pd.concat(
        refined_runs(example, label)
        for example in paper.EXAMPLES
        for label in compared_controllers(example)
    )
    record.to_csv(SAMPLING_RECORD, index=False, float_format="%.6g")
    print(spec_ends(record).to_string())


if __name__ == "__main__":
    _main()
