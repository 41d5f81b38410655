"""What faults on the signals of the loop do, one at a time and in pairs."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import Any

import control as ct
import numpy as np
import pandas as pd
from pydantic import Field

from nlctl.errors import ParameterError
from nlctl.faults import NEVER, Fault, with_faults
from nlctl.names import check_known
from nlctl.native import Status
from nlctl.wording import some_of

from ... import figures as figures
from ...report.document import Figure, Item, Paragraph, Table, captioned
from ...robustness import Experiment, Prepared, Uncertain, from_table, nominal, prepare
from ...robustness.runs.experiment import signals_of_rows
from ...robustness.stl.spec import Requirement, ViolationTime, violates, violation_time
from ...robustness.stl.text import parse_formula
from ..build import faults_of
from ..file.schema import Asked, Flag, Names, Size
from ..kind import Ground, Kind, Setup, finding_of
from ..page import DID_NOT_END, margin_in_words, margin_text
from ..result import Finding, Result

TOGETHER = 256  # unfinished runs that are simulated again in batches
_MOST = 40  # rows of the table of pairs
_MARGINS = (
    "Least margin that each fault leaves, worst first, drawn between −1 and 1. Hatched: violated."
)
PAIRS = (
    "Least margin under each pair of faults, on the diagonal under one alone, drawn between −1 and "
    "1. Cross: violated."
)
EFFECTS = (
    "Each fault by itself, worst first: the least margin, and the time from the onset to the "
    "violation of each requirement; –: not violated."
)


class Faults(Asked):
    """What the faults under [faults] do to the nominal loop, one at a time and in pairs."""

    onset: Size | tuple[Size, ...] = Field(description="When a fault begins (s); several: each.")
    pairs: Flag = Field(True, description="Whether every two faults are also tried together.")
    tolerates: Names = Field(
        (), description="Claim: under each of these, 'SIGNAL KIND', the spec holds."
    )
    detects: dict[str, str] = Field(
        {},
        description="What detects a fault: formulas by name, such as bounds of the ledger. "
        "When each is violated is reported; none is part of the spec.",
    )

    @property
    def onsets(self) -> tuple[float, ...]:
        """The onsets, also where there is only one."""
        return self.onset if isinstance(self.onset, tuple) else (self.onset,)

    @property
    def claim(self) -> str:
        names = ", ".join(self.tolerates)
        return f"the spec holds under each of: {names}" if names else ""


def _faults(setup: Setup) -> dict[str, Fault]:
    """Return the faults of a study by name."""
    every = (faults_of(signal, faulty) for signal, faulty in setup.study.faults.items())
    return {name: fault for faults in every for name, fault in faults.items()}


def _faulty(
    build: Any, options: Mapping[str, Any], faults: Sequence[Fault]
) -> ct.InterconnectedSystem:
    """Return the loop with all faults in it; parameters say which of them begin."""
    return with_faults(build(**options), *faults)


def _experiment(asked: Faults, setup: Setup) -> Experiment:
    """Return what the rows are run with: the loop of nominal options, its faults' onsets varied."""
    base, faults = setup.experiment, _faults(setup)
    options = {c.name: c.options[c.nominal] for c in base.space.choices}
    onsets = tuple(
        Uncertain(name=f"{fault.name}.onset", bounds=(0.0, NEVER), nominal=NEVER, unit="s")
        for fault in faults.values()
    )
    space = replace(base.space, quantities=(*base.space.quantities, *onsets), choices=())
    watched = (*base.spec.requirements, *_detectors(asked, base))
    times = tuple(ViolationTime(requirement=r) for r in watched)
    return replace(
        base,
        space=space,
        build=partial(_faulty, base.build, options, tuple(faults.values())),
        metrics=(*base.metrics, *times),  # type: ignore[arg-type]
    )


def _detectors(asked: Faults, experiment: Experiment) -> tuple[Requirement, ...]:
    """Return the detectors of faults, as requirements that the spec does not have."""
    end = float(experiment.timepts[-1])
    return tuple(
        Requirement(key=name, formula=parse_formula(formula), until=end)
        for name, formula in asked.detects.items()
    )


def _check(asked: Faults, setup: Setup) -> None:
    """Refuse an analysis without faults, an onset that comes too late, unknown names."""
    faults = _faults(setup)
    if not faults:
        raise ParameterError("'faults' needs signals and kinds of faults under [faults], got none")
    end = float(setup.experiment.timepts[-1])
    for onset in asked.onsets:
        if not onset < end:
            raise ParameterError(f"'faults' needs onset < {end:g} s, the end, got {onset:g}")
    for name in asked.tolerates:
        check_known("fault", name, faults)
    taken = [requirement.key for requirement in setup.experiment.spec.requirements]
    detectors = _detectors(asked, setup.experiment)
    for name in {d.key for d in detectors} & set(taken):
        raise ParameterError(
            f"'faults' needs another name for '{name}' of detects: the spec has it"
        )
    diagram = _experiment(asked, setup).build()
    for detector in detectors:
        for signal in detector.signals:
            check_known("signal", signal, diagram.output_labels, f"of '{detector.key}'")


def _cases(asked: Faults, setup: Setup) -> list[tuple[tuple[str, ...], float]]:
    """Return which faults begin in each row, and when; none in the first."""
    names = list(_faults(setup))
    single = [(name,) for name in names]
    chosen = [*single, *(combinations(names, 2) if asked.pairs else ())]
    return [((), NEVER), *((which, onset) for onset in asked.onsets for which in chosen)]


def _run(asked: Faults, ground: Ground) -> Finding | None:
    """Run the loop without a fault, with each, and with every two."""
    faults = _faults(ground)
    if not faults:
        raise ParameterError("no faults under [faults]")
    prepared, cases = prepare(_experiment(asked, ground)), _cases(asked, ground)
    space = prepared.experiment.space
    onsets = dict(zip(faults, space.names[-len(faults) :], strict=True))
    rows = pd.DataFrame([nominal(space)] * len(cases))
    for i, (which, onset) in enumerate(cases):
        for name in which:
            rows.loc[i, onsets[name]] = onset
    done = ground.run_design(from_table(space, rows, entropy=ground.seed), prepared)
    if not done.complete:
        return None
    table = done.table
    effects = pd.DataFrame(
        {
            "first": [which[0] if which else "" for which, _ in cases],
            "second": [which[1] if len(which) > 1 else "" for which, _ in cases],
            "onset": [onset if which else np.inf for which, onset in cases],
            "margin": table["spec"].to_numpy(),
            "status": table["status"].astype(str).to_numpy(),
        }
    )
    watched = (*ground.experiment.spec.requirements, *_detectors(asked, ground.experiment))
    effects = effects.join(_times(prepared, table, watched)).rename_axis("row")
    return _finding(asked, effects)


def _times(
    prepared: Prepared, table: pd.DataFrame, requirements: Sequence[Requirement]
) -> pd.DataFrame:
    """Return when each requirement is violated, also where the run did not reach its end."""
    keys = {r.key: ViolationTime(requirement=r).key for r in requirements}
    times = {key: table[key].to_numpy(dtype=float).copy() for key in keys.values()}
    signals = sorted({s for r in requirements for s in r.signals})
    timepts = np.asarray(prepared.experiment.timepts, dtype=float)
    unfinished = np.flatnonzero(table["status"].astype(str).to_numpy() != Status.OK.name)
    for start in range(0, unfinished.size, TOGETHER):
        chosen = unfinished[start : start + TOGETHER]
        part = table.iloc[chosen].filter(prepared.experiment.space.names)
        again, _ = signals_of_rows(prepared, part, signals)
        for i, row in enumerate(chosen):
            samples = {s: again[s][i] for s in signals}
            for r in requirements:
                times[keys[r.key]][row] = violation_time(r, timepts, samples)
    return pd.DataFrame(times)


def _single(effects: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with one fault."""
    alone = (effects["first"] != "").to_numpy() & (effects["second"] == "").to_numpy()
    return effects.loc[alone]


def _pairs(effects: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with two."""
    return effects.loc[(effects["second"] != "").to_numpy()]


def _violating(effects: pd.DataFrame) -> pd.DataFrame:
    return effects.loc[violates(effects["margin"])]


def _finding(asked: Faults, effects: pd.DataFrame) -> Finding:
    """Return what the effects say, in a sentence, and the answer to the claim."""
    single, pairs = _single(effects), _pairs(effects)
    bad, bad_pairs = _violating(single), _violating(pairs)
    alone = float(effects["margin"].iloc[0])
    singly = {(row["first"], row["onset"]) for row in bad.to_dict("records")}
    only = [
        number
        for number, row in bad_pairs.to_dict("index").items()
        if not {(row["first"], row["onset"]), (row["second"], row["onset"])} & singly
    ]
    worst = single.sort_values("margin", kind="stable").to_dict("records")[0]
    words = (
        f"The loop without a fault {'meets' if alone > 0 else 'already violates'} the spec ("
        f"{margin_in_words(alone)}). "
        f"{some_of(len(bad), len(single), 'single fault', 'violates', 'violate')} it; the worst is "
        f"{worst['first']} at {worst['onset']:g} s ({margin_in_words(worst['margin'])})."
    )
    if asked.pairs:
        words += (
            f" {some_of(len(bad_pairs), len(pairs), 'pair', 'does too', 'do too')}, {len(only)} of "
            "them although neither fault does alone."
        )
    if asked.detects:
        words += f" {_detection(asked, effects)}"
    numbers = {
        "nominal_margin": alone,
        "singles": len(single),
        "singles_violating": len(bad),
        "pairs": len(pairs),
        "pairs_violating": len(bad_pairs),
        "only_together": only,
    }
    return finding_of(
        asked,
        f"{words} Nominal values, one run each; other onsets and magnitudes were not examined.",
        **_answer(asked, bad),
        runs=len(effects),
        numbers=numbers,
        tables={"effects": effects},
    )


def _detection(asked: Faults, effects: pd.DataFrame) -> str:
    """Return how many single faults are detected, and whether before they violate the spec."""
    others = [k for k in effects if k.endswith(" violated at") and k[:-12] not in asked.detects]
    detected = effects[[f"{name} violated at" for name in asked.detects]].to_numpy().min(axis=1)
    violated = effects[others].to_numpy().min(axis=1)
    alone = ((effects["first"] != "") & (effects["second"] == "")).to_numpy()
    bad = alone & violates(effects["margin"])
    count, early = int(np.isfinite(detected[alone]).sum()), int((detected < violated)[bad].sum())
    words = (
        f"{some_of(count, int(alone.sum()), 'single fault', 'is', 'are')} detected; of those that "
        f"violate the spec {early} of {int(bad.sum())} before they do."
    )
    if np.isfinite(detected[0]):
        words += f" Without a fault there is a false alarm at {detected[0]:g} s."
    return words


def _answer(asked: Faults, violating: pd.DataFrame) -> dict[str, str]:
    """Return the answer to the claim that faults are tolerated."""
    if not asked.tolerates:
        return {}
    return {"answer": "refuted" if set(asked.tolerates) & set(violating["first"]) else "shown"}


def _measured(finding: Finding, asked: Faults) -> dict[str, str]:
    """Return the least margin under the faults that are claimed to be tolerated."""
    effects = finding.tables["effects"]
    every = _single(effects).sort_values("margin", kind="stable").to_dict("records")
    least = next(row for row in every if row["first"] in asked.tolerates)
    margin = margin_text(least["margin"])
    if margin == DID_NOT_END:
        measured, margin = f"a run that did not reach its end, {least['first']}", ""
    else:
        measured = f"least margin {margin} (1), {least['first']}"
    return {"measured": measured, "limit": "> 0", "margin": margin}


def _items(finding: Finding, result: Result, asked: Faults, key: str) -> Iterator[Item]:
    """Yield the margins under each fault and each pair, and when what is violated."""
    effects = finding.tables["effects"].sort_values("margin", kind="stable")
    several = len(asked.onsets) > 1
    single = _single(effects)
    names = [_label(row, several) for row in single.to_dict("records")]
    margin = pd.Series(single["margin"].to_numpy(), index=names)
    yield captioned(
        f"{key}-margins",
        _MARGINS,
        "; ".join(f"{n}: {margin_text(m)}" for n, m in zip(names, margin, strict=True)),
        figures.fault_margins(margin),
    )
    watched = _columns(asked, result)
    yield _effects(single, EFFECTS, result, finding.key, watched)
    pairs = _pairs(effects)
    if not len(pairs):
        return
    for i, onset in enumerate(asked.onsets, 1):
        at = f" Onset {onset:g} s." if several else ""
        yield Figure(
            key=f"{key}-pairs-{i}",
            caption=PAIRS + at,
            description=f"{PAIRS}{at} {finding.sentence}",
            figure=figures.fault_pairs(_matrix(effects, onset)),
        )
    more = f" The {_MOST} worst of {len(pairs)}; {finding.key}/effects.parquet has all."
    caption = "Pairs of faults, worst first." + more * (len(pairs) > _MOST)
    yield _effects(pairs.head(_MOST), caption, result, finding.key, watched, folded=True)
    yield Paragraph(
        text="A row again, by its number:",
        code=f"nlctl replay {shlex.quote(str(result.folder))} ROW --part {finding.key}",
    )


def _label(row: Mapping[Any, Any], with_onset: bool) -> str:
    both = f"{row['first']} + {row['second']}" if row["second"] else str(row["first"])
    return f"{both} at {row['onset']:g} s" if with_onset else both


def _matrix(effects: pd.DataFrame, onset: float) -> pd.DataFrame:
    """Return the margins of one onset as a symmetric table, single faults on the diagonal."""
    rows = [row for row in effects.to_dict("records") if row["onset"] == onset]
    names = sorted({row["first"] for row in rows})
    place = {name: i for i, name in enumerate(names)}
    square = np.full((len(names), len(names)), np.nan)
    for row in rows:
        i, j = place[row["first"]], place[row["second"] or row["first"]]
        square[i, j] = square[j, i] = row["margin"]
    return pd.DataFrame(square, index=names, columns=names)


def _columns(asked: Faults, result: Result) -> dict[str, str]:
    """Return the titles of the columns of times, by the requirement or detector."""
    titles = {str(key): f"{key} after (s)" for key in result.requirements.index}
    return titles | {name: f"detected by {name} after (s)" for name in asked.detects}


def _effects(
    effects: pd.DataFrame,
    caption: str,
    result: Result,
    part: str,
    watched: Mapping[str, str],
    *,
    folded: bool = False,
) -> Table:
    """Return a table of effects, with the command that runs each row again."""
    folder, step = shlex.quote(str(result.folder)), result.study.time.step
    times = [f"{key} violated at" for key in watched]
    return Table(
        caption=caption,
        columns=("fault", "onset (s)", "margin", *watched.values(), "replay"),
        rows=[
            (
                _label(row, with_onset=False),
                row["onset"],
                margin_text(row["margin"]),
                *(_after(row[t], row["onset"], step) for t in times),
                f"nlctl replay {folder} {number} --part {part}",
            )
            for number, row in effects.to_dict("index").items()
        ],
        folded=folded,
    )


def _after(time: float, onset: float, step: float) -> str:
    """Return the time from the onset to a violation, which samples give to within a `step`."""
    # One before the onset has nothing to do with the fault.
    if not np.isfinite(time):
        return "–"
    if time < onset - step:
        return "before"
    return f"{max(time - onset, 0.0):.4g}" if time - onset > step else f"≤ {step:g}"


FAULTS = Kind(
    name="faults",
    schema=Faults,
    run=_run,
    title="Faults",
    answers="what the faults under `[faults]` do, one at a time and in pairs, worst first",
    claims="the spec holds under each of `tolerates`",
    method=(
        "Each fault is a block in a wire of the loop, all in one compiled diagram; which of them "
        "begin, and when, are parameters. Rows are nominal but for these."
    ),
    check=_check,
    runs=lambda asked, setup: len(_cases(asked, setup)),
    largest=lambda asked, quantities: len(asked.onsets),
    experiment=_experiment,
    measured=_measured,
    items=_items,
)
