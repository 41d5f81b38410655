"""What a study is made of, so that its results are never mixed with those of another one."""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import platform
from collections.abc import Iterator, Mapping
from importlib import metadata
from typing import Any

import numpy as np
import pandas as pd

from nlctl._diagram import initial_state
from nlctl.native import Compiled
from nlctl.native.codegen.fingerprint import program_key

from ..metrics import Metric
from .design import Design
from .experiment import Prepared
from .quantity import Uncertain

__all__ = ["differences_of", "identity_of"]

VERSIONS = ("nlctl", "numpy", "scipy", "numba", "llvmlite")
PROBES = np.array([0.01, 0.25, 0.5, 0.75, 0.99])


def identity_of(
    prepared: Prepared, design: Design, more: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return everything that the numbers of a study follow from, as data for a JSON file.

    It names no path and no machine.

    Parameters
    ----------
    prepared : Prepared
    design : Design
    more : mapping, optional
        What else belongs to it, under ``"study"``; JSON must be able to hold it.
    """
    experiment = prepared.experiment
    content = {
        "space": {q.name: _quantity(q) for q in design.space.quantities},
        "choices": {
            c.name: dict(zip(c.options, c.weights, strict=True)) for c in design.space.choices
        },
        "scale": design.space.scale,
        "spec": {
            r.key: {"formula": repr(r.formula), "until": r.until}
            for r in experiment.spec.requirements
        },
        "metrics": {m.key: _metric(m) for m in experiment.metrics},
        "settings": {
            "times": _numbers(experiment.timepts),
            "inputs": _numbers(experiment.inputs),
            **{k: getattr(experiment, k) for k in ("rtol", "atol", "max_steps", "method")},
        },
        "design": {
            "kind": design.kind,
            "size": design.size,
            "is_iid": design.is_iid,
            "entropy": str(design.entropy),  # too long for the numbers of other JSON readers
            "points": None if design.points is None else _table(design.points),
        },
        "diagrams": {
            ", ".join(f"{k} = {v}" for k, v in labels.items()) or "only": _diagram(loop)
            for labels, loop in prepared.loops
        },
        "versions": {name: metadata.version(name) for name in VERSIONS}
        | {"python": platform.python_version()},
        "study": dict(more or {}),
    }
    return json.loads(json.dumps(content)) | {"sha256": _digest(json.dumps(content))}


def _quantity(quantity: Uncertain) -> dict[str, Any]:
    law = quantity.law
    numbers = [np.asarray(a).tolist() for a in law.args]
    numbers += [f"{k}={np.asarray(v).tolist()}" for k, v in law.kwds.items()]
    return {
        "law": f"{law.dist.name}({', '.join(map(str, numbers))})",
        "quantiles": [f"{v:.10g}" for v in law.ppf(PROBES)],  # of a law of the user's own as well
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


def _function(function: Any) -> str:
    """Return a function's name, its source's digest and the arguments that it was given."""
    if isinstance(function, functools.partial):
        given = [*map(repr, function.args), *(f"{k}={v!r}" for k, v in function.keywords.items())]
        return f"{_function(function.func)} with {', '.join(given)}"
    plain = getattr(function, "py_func", function)
    name = f"{getattr(plain, '__module__', '')}.{getattr(plain, '__qualname__', type(plain))}"
    try:
        return f"{name} {_digest(inspect.getsource(plain))[:16]}"
    except (OSError, TypeError):  # made at run time, or no function
        return name


def _diagram(loop: Compiled) -> dict[str, str]:
    return {
        "program": program_key(loop.program),
        "parameters": _numbers(loop.parameter_vector()),
        "initial_state": _numbers(initial_state(loop.system)),
    }


def _numbers(values: Any) -> str:
    array = np.asarray(values, dtype="<f8")
    return f"{_digest(array.tobytes())[:16]} of shape {array.shape}"


def _table(points: pd.DataFrame) -> str:
    digest = hashlib.sha256(",".join(map(str, points.columns)).encode())
    for column in points.columns:
        values = points[column].to_numpy()
        is_number = values.dtype.kind in "iuf"
        digest.update(values.astype("<f8").tobytes() if is_number else repr(list(values)).encode())
    return f"{digest.hexdigest()[:16]} of shape {points.shape}"


def _digest(content: str | bytes) -> str:
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def differences_of(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return what differs between two identities, one text for each place."""
    old, new = dict(_flat(before)), dict(_flat(now))
    places = [place for place in {**old, **new} if place != "sha256"]
    missing = "nothing"
    return [
        f"{place} was {old.get(place, missing)}, now {new.get(place, missing)}"
        for place in places
        if not _same(old.get(place, missing), new.get(place, missing))
    ]


def _same(one: Any, other: Any) -> bool:
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
