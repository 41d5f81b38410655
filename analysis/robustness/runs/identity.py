"""What a study is made of, so that its results are never mixed with those of another one."""

from __future__ import annotations

import functools
import hashlib
import json
import platform
from collections.abc import Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nlctl import errors

from ...loop_record import array_text, loop_facts, short_key, text_key
from ...metrics import Metric
from ..uncertainty.design import Design
from ..uncertainty.space import Space, Uncertain
from .experiment import Prepared

VERSIONS = ("control", "numpy", "scipy", "numba", "llvmlite", "cma")
TELLING = {  # by the root of the modules: rooms that show numbers; all others may compute them
    Path(errors.__file__).parent: ("analysis/", "drawing/"),
    Path(__file__).parents[2]: ("cli/", "figures/", "pages/", "paper/page/", "recheck/", "report/"),
}
PROBES = np.array([0.01, 0.25, 0.5, 0.75, 0.99])


def identity_of(
    prepared: Prepared, design: Design, more: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return everything that the numbers of a study follow from, as data for a JSON file."""
    # It names no path and no machine.
    content = experiment_facts(prepared, design.space) | {
        "design": {
            "kind": design.kind,
            "size": design.size,
            "is_iid": design.is_iid,
            "entropy": str(design.entropy),  # too long for the numbers of other JSON readers
            "points": None if design.points is None else _table(design.points),
        },
        "study": dict(more or {}),
    }
    return json.loads(json.dumps(content)) | {"sha256": text_key(json.dumps(content))}


def experiment_facts(prepared: Prepared, space: Space | None = None) -> dict[str, Any]:
    """Return what the numbers of any row of an experiment follow from, its design aside."""
    experiment = prepared.experiment
    space = experiment.space if space is None else space
    return {
        "space": {q.name: _quantity(q) for q in space.quantities},
        "choices": {c.name: dict(zip(c.options, c.weights, strict=True)) for c in space.choices},
        "scale": space.scale,
        "spec": {
            r.key: {"formula": repr(r.formula), "until": r.until}
            for r in experiment.spec.requirements
        },
        "metrics": {m.key: _metric(m) for m in experiment.metrics},
        "settings": {
            "times": array_text(experiment.timepts),
            "inputs": array_text(experiment.inputs),
            **{k: getattr(experiment, k) for k in ("rtol", "atol", "max_steps", "method")},
        },
        "diagrams": {
            labels_text(labels): loop_facts(loop.system) for labels, loop in prepared.loops
        },
        "versions": versions_of_numbers(),
    }


def labels_text(labels: Mapping[str, str]) -> str:
    """Return which diagram of an experiment this is: the options that it has."""
    return ", ".join(f"{name} = {label}" for name, label in labels.items()) or "only"


@functools.cache
def versions_of_numbers() -> dict[str, str]:
    """Return the versions of all that computes numbers; nlctl's with a key of its source."""
    source = hashlib.sha256()
    for path, name in computing():
        source.update(f"{name}\0".encode() + path.read_bytes())
    version = f"{metadata.version('nlctl')} ({source.hexdigest()[:12]})"
    libraries = {name: metadata.version(name) for name in VERSIONS}
    return {"nlctl": version, **libraries, "python": platform.python_version()}


def computing() -> Iterator[tuple[Path, str]]:
    """Yield the files that numbers may come from, with their names below the root."""
    for root, telling in TELLING.items():
        for path in sorted(root.glob("**/*.py")):
            name = path.relative_to(root).as_posix()
            if not name.startswith(telling):
                yield path, name


def _quantity(quantity: Uncertain) -> dict[str, Any]:
    law = quantity.law
    numbers = [np.asarray(a).tolist() for a in law.args]
    numbers += [f"{k}={np.asarray(v).tolist()}" for k, v in law.kwds.items()]
    return {
        "law": f"{law.dist.name}({', '.join(map(str, numbers))})",
        "quantiles": [f"{v:.10g}" for v in law.ppf(PROBES)],  # of a law of the user's own as well
        "content": short_key(law),  # a histogram has its numbers nowhere else
        "bounds": list(quantity.box),
        "nominal": quantity.nominal,
        "unit": quantity.unit,
    }


def _metric(metric: Metric) -> dict[str, Any]:
    return {
        "signals": list(metric.signals),
        "function": _function(metric.function),
        "start": repr(metric.start),
        "end": repr(metric.end),
        "unit": metric.unit,
    }


def _function(function: object) -> str:
    """Return a function's name, and a key of it and of all that it reaches."""
    plain = function
    while isinstance(plain, functools.partial):
        plain = plain.func
    plain = getattr(plain, "py_func", plain)
    name = getattr(plain, "__qualname__", type(plain).__qualname__)
    return f"{name} {short_key(function)}"


def _table(points: pd.DataFrame) -> str:
    digest = hashlib.sha256(",".join(map(str, points.columns)).encode())
    for column in points.columns:
        values = points[column].to_numpy()
        is_number = values.dtype.kind in "iuf"
        digest.update(values.astype("<f8").tobytes() if is_number else repr(list(values)).encode())
    return f"{digest.hexdigest()[:16]} of shape {points.shape}"


def differences_of(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return what differs between two identities, one text for each place."""
    old, new = dict(_flat(before)), dict(_flat(now))
    keys = [key for key in {**old, **new} if key != "sha256"]
    missing = "nothing"
    return [
        f"{key} was {old.get(key, missing)}, now {new.get(key, missing)}"
        for key in keys
        if not _same(old.get(key, missing), new.get(key, missing))
    ]


def _same(one: object, other: object) -> bool:
    """Whether two values of JSON are equal; NaN equals NaN, here and inside of lists."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[k], other[k]) for k in one)
    return one == other or (one != one and other != other)


def _flat(content: Mapping[str, Any], place: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in content.items():
        here = f"{place}.{key}" if place else key
        if isinstance(value, Mapping):
            yield from _flat(value, here)
        else:
            yield here, value
