"""What results are computed from: study, equations, wiring, values, versions.

The record is kept with a run (``run.json``), a key of it with every finding and all rows.  Whatever
adds to a run or draws from it compares first: no statement about one loop appears next to the
numbers of another one.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from ..json_values import as_json, from_json
from ..loop_record import (
    difference_text,
    fact_differences,
    loop_facts,
    loop_values,
    short_key,
    unseen_parts,
    values_differ,
)
from ..robustness import Prepared, diagrams
from ..robustness.runs.store import differences_of, experiment_facts, labels_text
from .file.schema import Study, keyed, study_data
from .kind import Setup


def origin_of(setup: Setup, prepared: Prepared) -> dict[str, Any]:
    """Return what the results of a study follow from, as data for a JSON file."""
    end, study = float(setup.experiment.timepts[-1]), setup.study
    facts = experiment_facts(prepared)
    values = {labels_text(labels): loop_values(p.system, end) for labels, p in prepared.loops}
    every = [p.system for _, p in prepared.loops]
    for key, asked in keyed(study).items():
        if (experiment := asked.definition.experiment) is not None:
            widened = experiment(asked, setup)
            for labels, diagram in diagrams(widened.space, widened.build):
                name = _compared_name(key, labels)
                facts["diagrams"][name] = loop_facts(diagram)
                values[name] = loop_values(diagram, end)
                every.append(diagram)
    own_kinds = {a.kind: short_key(a.definition.run) for a in study.analysis if ":" in a.kind}
    facts |= {"kinds": own_kinds} if own_kinds else {}
    unseen = dict[str, list[str]]()
    for diagram in every:
        unseen |= unseen_parts(diagram)
    facts |= {"unseen": unseen} if unseen else {}
    content = {**facts, "study": plain_study(study), "values": values}
    return from_json(as_json(content))  # as it is read from a file


def unseen_notes(origin: Mapping[str, Any]) -> list[str]:
    """Return what the keys of a run do not see, one sentence for each block."""
    return [
        f"What '{block}' computes depends on what no key can see, so that a change of it would "
        f"not be noticed: {'; '.join(reasons)}."
        for block, reasons in origin.get("unseen", {}).items()
    ]


def _compared_name(key: str, labels: Mapping[str, str]) -> str:
    return f"{key}: {labels_text(labels)}"


def compared_differences(origin: Mapping[str, Any], key: str, prepared: Prepared) -> str:
    """Return in words how the loops of a comparison differ from those of a record."""
    # They are made again when the comparison begins, hours later: what they read may have changed.
    end = float(prepared.experiment.timepts[-1])
    names = {_compared_name(key, labels): loop.system for labels, loop in prepared.loops}
    before = {part: {n: origin[part].get(n) for n in names} for part in ("diagrams", "values")}
    now = {
        "diagrams": {name: loop_facts(system) for name, system in names.items()},
        "values": {name: loop_values(system, end) for name, system in names.items()},
    }
    return difference_text(list(dict.fromkeys(_diagrams(before, from_json(as_json(now))))))


def diagram_differences(origin: Mapping[str, Any], diagram: Any) -> str:
    """Return in words how a diagram differs from those of a record; nothing if it does not."""
    now = from_json(as_json(loop_facts(diagram)))
    differences = [list(fact_differences(before, now)) for before in origin["diagrams"].values()]
    return difference_text(
        min(differences, key=len, default=["the study kept no record of its loop"])
    )


def plain_study(study: Study) -> dict[str, Any]:
    """Return a study as a record has it."""
    return from_json(as_json(study_data(study)))


def version_differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return which versions differ, in words; nothing if none does."""
    old, new = before["versions"], now["versions"]
    return difference_text(
        [
            f"{name} {old.get(name, 'absent')} then, {new.get(name, 'absent')} now"
            for name in dict.fromkeys([*old, *new])
            if old.get(name) != new.get(name)
        ]
    )


def loop_differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return what else differs, in words; nothing if nothing does."""
    differences = list(dict.fromkeys([*_settings(before, now), *_diagrams(before, now)]))
    return difference_text(differences)


def _settings(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield what differs besides the diagrams."""
    keys = dict.fromkeys([*before["study"], *now["study"]])
    changed = [key for key in keys if before["study"].get(key) != now["study"].get(key)]
    if changed:
        yield f"{', '.join(f'[{key}]' for key in changed)} of the study"
        return  # the rest follows
    others = [k for k in before if k not in ("study", "diagrams", "versions", "values")]
    yield from differences_of(*({k: part[k] for k in others} for part in (before, now)))


def _diagrams(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield what differs in diagrams; what several have in common comes several times."""
    old, new = before["diagrams"], now["diagrams"]
    for name in dict.fromkeys([*old, *new]):
        if name not in old or name not in new:
            yield f"the diagram '{name}' is {'new' if name in new else 'gone'}"
            continue
        differences = list(fact_differences(old[name], new[name]))
        moved = values_differ(before["values"][name], now["values"][name])
        if moved and not differences:
            differences = [f"the value of {moved[0]} at the same point"]
        if not differences and old[name] != new[name]:
            differences = ["the compiled program"]
        yield from differences
