"""The paper's controller, unchanged, and its rivals through every actuator of nlctl: a kept record.

    python campaign/actuator_limits.py docs/explanation

makes it again, in five minutes, prints the tables of ``docs/explanation/actuators.md`` and draws
its figures into that folder.  Friction is left out: it takes a velocity and makes a force, and is
not an actuator of the form v = k(u, t) u + eps_u (2) between the controller and the plant.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from page_tables import markdown_table

from nlctl import actuators, native, paper
from nlctl.analysis.lyapunov.bounds.decomposition import DecompositionError, decompose
from nlctl.analysis.paper.reproduction import HORIZON, TAIL
from nlctl.analysis.paper.rivals import rival_controller, rival_controllers
from nlctl.analysis.paper.sampling_limits import BAND, meets_the_spec
from nlctl.analysis.report.svg import svg_files
from nlctl.native import Status
from nlctl.plotting.axes import GREY, STYLES, legend_above, set_style
from nlctl.response import input_output_response

ACTUATOR_RECORD = Path(__file__).with_name("actuator-limits.csv")
_COLUMNS = ["example", "controller", "actuator", "status", "time", "error", "peak"]
_LOOK = 1e-3  # s: between samples
_EFFORT = 1_000_000  # steps of a run
_BOUND = 60.0  # largest |u| over which eps_u is bounded, as the ledger has it


def actuators_of_the_table() -> dict[str, Any]:
    """Return every actuator of nlctl that takes u and makes v, with its default values, by name."""
    records = {name: getattr(actuators, name) for name in actuators.__all__}
    return {
        name: record()
        for name, record in records.items()
        if isinstance(record, type) and _fits(record)
    }


def _fits(record: type) -> bool:
    return getattr(record, "inputs", ()) == ("u",) and getattr(record, "outputs", ()) == ("v",)


def assumption(actuator: Any) -> str:
    """Return the bounds of the split (2) of an actuator, or why it has none, with formulas."""
    try:
        split = decompose(actuator, u_max=_BOUND)
    except DecompositionError as error:
        words = str(error).removesuffix("; replace the actuator")
        words = words.removeprefix(f"{type(actuator).__name__} is ")
        for plain, formula in _FORMULAS.items():
            words = words.replace(plain, formula)
        return words
    eps = _latex(max(abs(split.eps_low), abs(split.eps_high)))
    bounds = rf"{_latex(split.k_1)} \leq k \leq {_latex(split.k_2)}"
    return rf"${bounds}$, $\lvert \varepsilon_u \rvert \leq {eps}$ ({split.provenance})"


_FORMULAS = {  # of the reasons of `decompose`
    "v = k(u, t) u + eps_u": r"$v = k(u, t)\, u + \varepsilon_u$",
    "k >= k_1 > 0": r"$k \geq k_1 > 0$",
    "keeps eps_u": r"keeps $\varepsilon_u$",
}


def _latex(value: float) -> str:
    """Return a number to three digits, with its power of ten as a formula has it."""
    return re.sub(
        r"e([+-])0*(\d+)", lambda m: rf" \times 10^{{{m[1].strip('+')}{m[2]}}}", f"{value:.3g}"
    )


def actuator_run(example: str, name: str, label: str = "paper") -> dict[str, Any]:
    """Run an example with one actuator instead of its own."""
    actuator, controller = actuators_of_the_table()[name], rival_controller(example, label)
    times = np.linspace(0, HORIZON, round(HORIZON / _LOOK) + 1)
    loop = paper.EXAMPLES[example](actuator=actuator, controller=controller)
    response: Any = native.uninterrupted(
        input_output_response(loop, times, ignore_errors=True, max_steps=_EFFORT)
    )
    row = {
        "example": example, "controller": label, "actuator": name,
        "status": response.statistics.status.name, "time": response.statistics.time,
        "error": np.nan, "peak": np.nan,
    }  # fmt: skip
    if response.statistics.status is Status.OK:
        y, yd, u = (response.outputs[loop.output_index[signal]] for signal in ("y", "yd", "u"))
        row["error"] = float(np.abs(y - yd)[times >= TAIL].max())
        row["peak"] = float(np.abs(u).max())
    return row


def assumption_text() -> str:
    """Return what is known of the split (2) of each actuator, as a table in Markdown."""
    rows = ((name, assumption(actuator)) for name, actuator in actuators_of_the_table().items())
    return markdown_table(("actuator", "Assumption 1 and (2)"), rows)


def controllers_text(record: pd.DataFrame, example: str) -> str:
    """Return the runs of an example, actuators x controllers, as a table in Markdown.

    A cell has the error, then what of the spec of reports/example-1.toml it violates, or how and
    when the run ended.
    """
    of_example: Any = record[record["example"] == example]
    cells = [
        _cell(row, ok)
        for row, ok in zip(of_example.to_dict("records"), meets_the_spec(of_example), strict=True)
    ]
    labels = list(dict.fromkeys(of_example["controller"]))
    table = of_example.assign(cell=cells).pivot(
        index="actuator", columns="controller", values="cell"
    )
    rows = ((name, *table.loc[name, labels]) for name in table.index)
    return markdown_table(("actuator", *labels), rows)


def _cell(row: dict[str, Any], meets: bool) -> str:
    if row["status"] != Status.OK.name:
        return f"{row['status'].lower().replace('_', ' ')} at {row['time']:.3g} s"
    if meets:
        return f"{row['error']:.3g}"
    error = f"{row['error']:.3g}"
    return f"**{error}**" if row["error"] > BAND else f"{error}, **u {row['peak']:.3g}**"


_DOTS = (*(colour for colour, _ in STYLES), *(colour for colour, _ in STYLES))
_MARKERS = "osD^vP<>"  # colours repeat: the marker distinguishes as well
_BEYOND, _HALF = 2.3, 0.7  # log10: place of the runs that did not reach their end


def actuator_errors(
    record: pd.DataFrame, meets: Callable[[pd.DataFrame], np.ndarray], band: float
) -> Figure:
    """Largest late errors behind each actuator, a line for each and a dot for each controller.

    Hollow dots violate the spec; at the right are the runs that did not reach their end.
    """
    figure = Figure(figsize=(6.2, 7.2), layout="constrained")
    ax = figure.subplots()
    set_style(ax)
    names, labels = (list(dict.fromkeys(record[c])) for c in ("actuator", "controller"))
    shown: dict[str, object] = {}
    for place, label in enumerate(labels):
        of_controller: Any = record[record["controller"] == label]
        colour, marker = _DOTS[place], _MARKERS[place]
        lines = [
            names.index(name) + 0.1 * (place - (len(labels) - 1) / 2)
            for name in of_controller["actuator"]
        ]
        aside = _BEYOND + 0.16 * (place - (len(labels) - 1) / 2)
        error = of_controller["error"].fillna(10**aside).to_numpy()
        fill = [colour if good else "none" for good in meets(of_controller)]
        ax.scatter(error, lines, 18, fill, marker=marker, edgecolors=colour, linewidths=1.0)
        shown[label] = ax.scatter([], [], 18, colour, marker=marker)
    ax.axvline(band, color=GREY, linewidth=0.9)
    ax.axvspan(
        10 ** (_BEYOND - _HALF), 10 ** (_BEYOND + _HALF), color=GREY, alpha=0.12, linewidth=0
    )
    for line in range(1, len(names)):
        ax.axhline(line - 0.5, color=GREY, linewidth=0.4)
    ax.set(xscale="log", ylim=(len(names) - 0.5, -0.5), yticks=range(len(names)), yticklabels=names)
    ax.grid(visible=False, axis="y")
    ticks = [*(10.0**power for power in range(-3, 2)), 10**_BEYOND]
    ax.set(xlim=(2e-4, 10 ** (_BEYOND + _HALF)), xlabel="largest $|y - y_d|$ for t ≥ 10 s")
    ax.set_xticks(ticks, ["0.001", "0.01", "0.1", "1", "10", "ended\nbefore"])
    ax.minorticks_off()
    legend_above(figure, shown)
    return figure


def figure_files(record: pd.DataFrame) -> dict[str, bytes]:
    """Return the figures of the page as SVG by the names of their files."""
    return {
        f"actuators-{example[-1]}.svg": svg_files(
            [actuator_errors(record[record["example"] == example], meets_the_spec, BAND)]
        )[0]
        for example in paper.EXAMPLES
    }


def _main() -> None:
    """Make the record again, print its tables, and draw its figures where a folder is named."""
    rows = [
        actuator_run(example, name, label)
        for example in paper.EXAMPLES
        for label in rival_controllers(example)
        for name in actuators_of_the_table()
    ]
    table = pd.DataFrame(rows).reindex(columns=_COLUMNS)
    table.to_csv(ACTUATOR_RECORD, index=False, float_format="%.6g")
    kept = pd.read_csv(ACTUATOR_RECORD)
    print(assumption_text())
    for example in paper.EXAMPLES:
        print("\n" + controllers_text(kept, example))
    for folder in sys.argv[1:]:
        for name, file in figure_files(kept).items():
            (Path(folder) / name).write_bytes(file)


if __name__ == "__main__":
    _main()
