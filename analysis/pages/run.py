"""A run on a page: its own parameters, its signals over time, and their ranges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import control as ct
import numpy as np

from nlctl.errors import ParameterError
from nlctl.names import check_known
from nlctl.plotting.signals import rows_figure
from nlctl.responses.time_response import as_response

from ..report.document import Figure, History, Item, Paragraph, Section, Table

_SHOWN = 6  # signals of a chart at first


def run_section(
    loop: ct.InputOutputSystem,
    response: Any,
    signals: Sequence[str],
    params: Mapping[str, Any],
) -> Section:
    """Return one run: its own parameters, its signals over time, and their ranges."""
    curves = outputs_of_run(response)
    for name in signals:
        check_known("output", name, curves, f"of '{loop.name}'")
    t = np.asarray(response.time, dtype=float)
    shown, rows = as_response(response, loop).rows([*signals] or None)
    figure, _ = rows_figure(t, shown, rows)
    caption = f"{', '.join(shown)} over {t[-1]:g} s."
    ranges = [
        (n, *(float(f(y)) for f in (np.min, np.max)), float(y[-1])) for n, y in curves.items()
    ]
    text = "; ".join(f"{n} between {low:.4g} and {high:.4g}" for n, low, high, _ in ranges)
    history = History(
        key="run-history", caption=caption, description=text, time=t, signals=curves,
        shown=tuple(name for name in shown if name in curves)[:_SHOWN],
    )  # fmt: skip
    items: list[Item] = [
        *own_values("This run", params),
        Figure(key="run-signals", caption=caption, description=text, figure=figure),
        history,
        Table(
            caption="The outputs of this run: least and largest sample, and the last one.",
            columns=("output", "least", "largest", "at the end"),
            rows=ranges,
        ),
    ]
    return Section(key="run", title="A run", items=items)


def own_values(what: str, params: Mapping[str, Any]) -> list[Item]:
    """Return a paragraph with the values that are not the loop's nominal ones."""
    values = ", ".join(f"{name} = {value}" for name, value in params.items())
    return [Paragraph(text=f"{what} has values of its own: {values}.")] if params else []


def outputs_of_run(response: Any) -> dict[str, np.ndarray]:
    """Return the outputs of a run by name."""
    y = np.asarray(response.y, dtype=float)
    if y.ndim != 2:
        raise ParameterError(
            f"the response has outputs of shape {y.shape}: a report shows one run, give one trace"
        )
    return dict(zip(response.output_labels, y, strict=True))
