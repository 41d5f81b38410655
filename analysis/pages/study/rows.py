"""The report's sections on the rows of a study: what was asked and how they ended."""

import shlex
from collections.abc import Iterator

import numpy as np
import pandas as pd

from nlctl.wording import counted

from ... import figures as figures
from ...report.document import History, Item, Paragraph, Table, captioned
from ...robustness.search.evaluation import margins_of
from ...robustness.stl.spec import violates
from ...studies.page import clipped, known, margin_in_words, margin_text, status_text, violate
from ...studies.result import Result
from .claims import has_ids, refusal
from .histories import Histories
from .loop import Published

_SPEC = (
    "What is required of every run. A margin is the distance to the bound of a requirement, as a "
    "share of that bound: 0.2 means that 20 % of it are left; a run violates the spec unless the "
    "least of its margins is above 0."
)
_SPACE = (
    "What is uncertain: nominal value, law, and the box that corners and searches stay in. "
    "Everything else keeps its nominal value."
)
_METRICS_CAPTION = (
    "Metrics of the runs. Missing: runs that did not reach their end; they are not in the other "
    "columns."
)
_MARGINS_CAPTION = (
    "Left: number of runs by margin. Right: share of the runs with at most that margin."
)
WORST = 10  # rows that are listed
_PARTS = {0.5: "median", 0.95: "95 %", 1.0: "largest"}  # quantiles of the metrics


def setup_items(result: Result, published: Published | None = None) -> Iterator[Item]:
    """Yield the loop, the spec, and what is uncertain."""
    study = result.study
    about = f" ({published.title})" if published else ""
    options = ", ".join(f"{key} = {value}" for key, value in study.options.items())
    changed = f" It is made with {options}." if options else ""
    inputs = ", ".join(f"{key} = {value:g}" for key, value in study.inputs.items())
    changed += f" Its inputs are {inputs}." if inputs else ""
    yield Paragraph(
        text=f"Loop: {study.loop}{about}.{changed} Runs last {study.time.end:g} s. All random "
        f"numbers follow from the seed {study.study.seed}."
    )
    ids = has_ids(result)
    yield Table(
        caption=_SPEC,
        columns=("id",) * ids + ("requirement", "formula", "until (s)", "meaning"),
        rows=[
            (study.spec[str(key)].id,) * ids + (key, row["formula"], row["until"], row["meaning"])
            for key, row in result.requirements.iterrows()
        ],
    )
    yield Table(
        caption=_SPACE,
        columns=("quantity", "nominal", "unit", "law", "box from", "to"),
        rows=[*known(result.quantities, "nominal", "unit", "law", "low", "high")],
    )


def row_items(result: Result, table: pd.DataFrame, key: str) -> Iterator[Item]:
    """Yield how the rows of the main table ended, and the worst of them."""
    margins = table["spec"].to_numpy(dtype=float)
    violated = int(np.sum(violates(margins)))
    sentence = violate(violated, len(table))
    if refused := refusal(result):
        sentence += f". That is not an estimate of a probability: {refused}"
    yield Paragraph(text=f"{sentence}.")
    statuses = table["status"].astype(str)
    counts = statuses.value_counts().sort_index()
    yield Table(
        caption="How the runs ended. A run that did not reach its end violates the spec.",
        columns=("status", "runs", "share"),
        rows=[
            (status_text(name), int(n), f"{100 * n / len(table):.4g} %")
            for name, n in counts.items()
        ],
    )
    yield from margin_items(result, table, key)
    yield from _worst_rows(result, table)
    if len(result.metrics):
        yield _metrics(result, table)


def margin_items(result: Result, table: pd.DataFrame, key: str) -> Iterator[Item]:
    """Yield the margins of the rows: by requirement, and how they are distributed."""
    yield _requirements(result, table)
    margins = table["spec"].to_numpy(dtype=float)
    violated = int(np.sum(violates(margins)))
    caption = _MARGINS_CAPTION + " Orange: violations." * bool(violated) + clipped(margins)
    yield captioned(
        f"{key}-margins",
        caption,
        f"{violate(violated, margins.size)}; the median margin is "
        f"{margin_text(float(figures.quantile(margins, 0.5, -np.inf)))}.",
        figures.margins_figure(margins),
    )


def _requirements(result: Result, table: pd.DataFrame) -> Table:
    rows = []
    for key in [*result.requirements.index, "spec"]:
        margins = table[key].to_numpy(dtype=float)
        violated = int(np.sum(violates(margins)))
        ends = (float(figures.quantile(margins, part, -np.inf)) for part in (0.0, 0.5, 1.0))
        share = f"{100 * violated / len(table):.4g} %"
        rows.append((key, violated, share, *map(margin_text, ends)))
    return Table(
        caption="Margins by requirement; the spec is the least of them.",
        columns=("requirement", "violations", "share", "least margin", "median", "largest"),
        rows=rows,
    )


def _worst_rows(result: Result, table: pd.DataFrame) -> Iterator[Table]:
    """Yield the rows with the lowest margins: how they ended, how to run them again, values."""
    worst = table.iloc[np.argsort(margins_of(table), kind="stable")[:WORST]]
    keys, names = list(result.requirements.index), list(result.quantities.index)
    folder = shlex.quote(str(result.folder))
    ended = [
        (
            number,
            margin_text(row["spec"]),
            min(keys, key=lambda key: np.nan_to_num(row[key], nan=-np.inf)),
            status_text(row["status"]),
            row["time"],
            f"nlctl replay {folder} {number}",
        )
        for number, row in worst.to_dict("index").items()
    ]
    which = f"The {len(worst)} rows" if len(worst) > 1 else "The row"
    yield Table(
        caption=f"{which} with the lowest margins, and the command that runs each again, bit for "
        "bit.",
        columns=("row", "margin", "least in", "status", "reached (s)", "again"),
        rows=ended,
        folded=True,
    )
    values = worst[names].itertuples(name=None)
    yield Table(
        caption="The values of these rows.", columns=("row", *names), rows=list(values), folded=True
    )


def _metrics(result: Result, table: pd.DataFrame) -> Table:
    rows = []
    for key, about in result.metrics.iterrows():
        values = table[key].to_numpy(dtype=float)
        there = values[~np.isnan(values)]
        ends = [float(figures.quantile(there, q, np.inf)) if there.size else np.nan for q in _PARTS]
        missing = values.size - there.size
        rows.append((key, about["meaning"], about["unit"], *ends, missing))
    return Table(
        caption=_METRICS_CAPTION,
        columns=("metric", "meaning", "unit", *_PARTS.values(), "missing"),
        rows=rows,
        folded=True,
    )


def fan_items(histories: Histories, key: str) -> Iterator[Item]:
    """Yield quantile fans of some rows with the nominal and the worst run, and these as charts."""
    count = len(next(iter(histories.signals.values())))
    ended = (
        f" Runs that did not reach their end, {histories.ended} of these, count from there on as "
        "lying beyond both ends of every band."
        if histories.ended
        else ""
    )
    worst = margin_in_words(histories.margin)
    caption = (
        f"The first {counted(count, 'row')} simulated again: {_bands(histories)}, the nominal run, "
        f"and the worst run that is known ({worst}).{_limits(histories)}{ended} What "
        "leaves the picture is cut off."
    )
    drawn = figures.fans(
        histories.time, histories.signals, histories.nominal, histories.worst,
        limits=histories.limits, units=histories.units, groups=histories.groups,
    )  # fmt: skip
    yield captioned(f"{key}-fans", caption, _peaks(histories), drawn)
    runs = {"nominal": histories.nominal, "worst": histories.worst}
    both = {f"{name}, {run}": runs[run][name] for name in histories.nominal for run in runs}
    yield History(
        key=f"{key}-history",
        caption=f"The nominal run and the worst one that is known ({worst}).",
        description=f"Chart of {', '.join(histories.nominal)} in the nominal and in the worst run; "
        "the figure above shows the same runs, the slider below shows their values.",
        time=histories.time,
        signals=both,
        shown=list(both)[: len(runs)],
        bands={}
        if histories.groups
        else {  # ends of the band that holds 90 % of the rows at each time
            f"{n}, nominal": (figures.quantile(y, 0.05, -np.inf), figures.quantile(y, 0.95, np.inf))
            for n, y in histories.signals.items()
        },
    )


def _bands(kept: Histories) -> str:
    """Say what the bands are; rows of different kinds have one each."""
    if not kept.groups:
        return "bands that hold all, 90 % and 50 % of them at each time"
    shown, every = figures.most_frequent(kept.groups), set(kept.groups)
    which = "each option" if len(shown) == len(every) else f"the {len(shown)} most frequent options"
    return f"for {which} the median at each time and a band that holds 90 % of its rows"


def _limits(kept: Histories) -> str:
    shown = any(kept.limits.get(name) for name in kept.signals)
    return " Straight lines: limits of the spec, where and as long as they count." * shown


def _peaks(kept: Histories) -> str:
    """Say how large each signal becomes; a run that has ended counts as infinite."""
    sentences = []
    for name, samples in kept.signals.items():
        largest = [
            float(np.max(np.where(np.isnan(y), np.inf, np.abs(y))))
            for y in (kept.nominal[name], samples, kept.worst[name])
        ]
        sentences.append(
            f"Largest magnitude of {name}: nominal {largest[0]:.4g}, of all {largest[1]:.4g}, of "
            f"the worst run {largest[2]:.4g}."
        )
    return " ".join(sentences)
