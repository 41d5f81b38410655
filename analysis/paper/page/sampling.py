"""The part of the paper's page on controllers that run on computers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from ...report.document import Figure, Paragraph, Section, Table
from .. import TAIL
from ..figures import SAMPLED_CONTROLLERS, sampling_errors
from ..sampling_limits import BAND, PEAK, QUANTITIES, Quantity, spec_ends

# of the plant: e₁ is what the controller sees, in steps of the measurement
_ERROR = r"\(|y - y_d|\)"
_TITLES = {"example_1": "Example 1", "example_2": "Example 2"}


def sampling_section(record: pd.DataFrame) -> Section:
    """Return the section on sampling time, delay and steps of converters."""
    limits = spec_ends(record)
    return Section(
        key="sampling",
        title="Sampled implementation",
        items=[
            *(Paragraph(text=_sentence(limits, example, _ERROR)) for example in _TITLES),
            Figure(
                key="sampling-errors",
                caption=f"Largest {_ERROR} for t ≥ {TAIL:g} s against the sampling time, by "
                "Euler's method. Cross: the last run that meets the spec; line: the spec.",
                description=" ".join(_sentence(limits, example, "|y − yd|") for example in _TITLES),
                figure=sampling_errors(record, _TITLES, BAND),
            ),
            _table(limits),
            Paragraph(
                text="These are recorded runs, 13 to 21 for each entry of the table; two of them "
                "were repeated for this page and agree to 1e-3. The command that repeats all of "
                "them, in a checkout: python campaign/sampling_runs.py"
            ),
        ],
    )


def _sentence(limits: pd.DataFrame, example: str, error: str) -> str:
    """Say where the spec holds with the paper's controller, and with the others of the figure."""
    papers: Any = limits.loc[(example, "paper")]
    dt_text, delay, measured, given = (_text(papers, quantity) for quantity in QUANTITIES)
    rivals = [
        f"{r} {_text(limits.loc[(example, r)], QUANTITIES[0])}" for r in SAMPLED_CONTROLLERS[1:]
    ]
    return (
        f"{_TITLES[example]} with the paper's controller: {error} ≤ {BAND:g} for t ≥ {TAIL:g} s "
        f"and |u| ≤ {PEAK:g} hold up to a sampling time of {dt_text}. Sampled every 2 ms, they "
        f"hold with a delay of {delay}, or with measurements in steps of {measured}, or with u in "
        f"steps of {given}. Longest sampling times of other controllers: {', '.join(rivals)}."
    )


def _text(row: Any, quantity: Quantity) -> str:
    """Return how far a quantity may go, with its unit."""
    good, bad = row[(quantity.key, "good")], row[(quantity.key, "bad")]
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    if not np.isfinite(good):
        return f"less than {quantity.factor * bad:.3g}{unit}"
    more = "" if np.isfinite(bad) else " or more"
    return f"{quantity.factor * good:.3g}{unit}{more}"


def _table(limits: pd.DataFrame) -> Table:
    return Table(
        caption="Largest values with which each controller meets the spec, to 4 to 7 %. Less "
        "than: the least value that was tried violates it already, as continuous time may; or "
        "more: none did. Delay and converters: sampled every 2 ms. A run that diverges, or takes "
        "more than 60,000 steps, violates the spec.",
        columns=("example", "controller", *(q.title for q in QUANTITIES)),
        rows=[
            (_TITLES[example], label, *(_text(row, q) for q in QUANTITIES))
            for (example, label), row in zip(limits.index, limits.to_dict("records"), strict=True)
        ],
        folded=True,
    )
