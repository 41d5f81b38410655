"""The paper's controller and its rivals, with gains found by one budget on the same samples.

`rival_loop` is for the studies ``reports/rivals-1.toml`` and ``rivals-2.toml``, which compare the
controllers on fresh samples behind one actuator after the other; ``campaign/rival_gains.py`` finds
the gains.
"""

import csv
import functools
import json
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import control as ct
import pandas as pd

from nlctl import paper
from nlctl.actuators import Backlash, DeadZone, Gain, Saturation
from nlctl.blocks import Spec
from nlctl.controllers import (
    PID,
    DynamicSurface,
    FunnelControl,
    NussbaumLaw,
    PrescribedPerformance,
    SlidingModeLaw,
    SuperTwistingLaw,
    dynamic_surface_control,
    replaced,
    sliding_mode,
)
from nlctl.names import check_known

from ..loop_record import loop_facts, loop_values
from ..studies import shipped
from . import loops
from .controllers import part_of, published_controller

KNOWLEDGE = {
    "paper": "states, n derivatives of the reference",
    "paper, tuned": "states, n derivatives of the reference; gains for this plant",
    "PID": "sign of the gain, e and e', gains for this plant",
    "sliding mode": "sign of the gain, states, n - 1 derivatives of the reference, a bound of "
    "what disturbs",
    "super-twisting": "sign of the gain, states, n - 1 derivatives of the reference, a bound of "
    "the rate of what disturbs",
    "dynamic surface": "sign of the gain and about its size, states, one derivative of the "
    "reference",
    "prescribed performance": "sign of the gain, states, a bound of the initial errors",
    "funnel": "sign of the gain, states, n - 1 derivatives of the reference, a bound of the "
    "initial errors",
}
"""What each controller has to know."""


def _of(gains: Mapping[str, float], part: str) -> dict[str, float]:
    """Return the gains of a part of a controller, by their names there."""
    return {
        key.removeprefix(f"{part}."): value
        for key, value in gains.items()
        if key.startswith(f"{part}.")
    }


def _vector(gains: Mapping[str, float], name: str) -> tuple[float, ...]:
    """Return the elements ``name[0]``, ``name[1]``, ... of a vector."""
    return tuple(value for key, value in gains.items() if key.startswith(f"{name}["))


def _part(example: str, name: str) -> Any:
    """Return the record of a part of the paper's controller."""
    return part_of(published_controller(example), name).spec


def _paper(example: str, gains: Mapping[str, float]) -> ct.InterconnectedSystem:
    return replaced(
        published_controller(example),
        weights=replace(_part(example, "weights"), **_of(gains, "weights")),
        robust=replace(_part(example, "robust"), **_of(gains, "robust")),
        law=NussbaumLaw(beta=gains["law.beta"]),
    )


def _dynamic_surface(example: str, gains: Mapping[str, float]) -> ct.InterconnectedSystem:
    return dynamic_surface_control(
        DynamicSurface(c=_vector(gains, "surface.c"), tau=_vector(gains, "surface.tau")),
        basis=_part(example, "basis"),
        weights=replace(_part(example, "weights"), **_of(gains, "weights")),
    )


def _prescribed(example: str, gains: Mapping[str, float]) -> PrescribedPerformance:
    k, rho_inf = _vector(gains, "controller.k"), _vector(gains, "controller.rho_inf")
    rho_0, decay = (3.0, 6.0, 12.0)[: len(k)], (gains["controller.decay[0]"], 0.7, 0.7)[: len(k)]
    return PrescribedPerformance(k=k, rho_0=rho_0, rho_inf=rho_inf, decay=decay)


@functools.cache
def _order(example: str) -> int:
    return _part(example, "filtered_error").plant_order


_MAKERS: dict[str, Callable[[str, Mapping[str, float]], Any]] = {
    "paper, tuned": _paper,
    "PID": lambda example, gains: PID(**_of(gains, "controller"), u_max=100),
    "sliding mode": lambda example, gains: sliding_mode(
        _part(example, "filtered_error"), SlidingModeLaw(**_of(gains, "law"))
    ),
    "super-twisting": lambda example, gains: sliding_mode(
        _part(example, "filtered_error"), SuperTwistingLaw(**_of(gains, "law"))
    ),
    "dynamic surface": _dynamic_surface,
    "prescribed performance": _prescribed,
    "funnel": lambda example, gains: FunnelControl(
        order=_order(example), rho_0=5.0, **_of(gains, "controller")
    ),
}


def _recorded_gains() -> dict[str, dict[str, dict[str, float]]]:
    gains: dict[str, dict[str, dict[str, float]]] = {}
    text = Path(__file__).with_name("rival-gains.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        by_label = gains.setdefault(row["example"], {})
        by_label.setdefault(row["controller"], {})[row["gain"]] = float(row["value"])
    return gains


RIVAL_GAINS = _recorded_gains()
"""Gains by example and label, found by ``campaign/rival_gains.py``."""


def rival_controllers(example: str) -> dict[str, Any]:
    """Return the controllers of an example by label, the paper's as printed first."""
    labels = ("paper", *_gains(example))
    return {label: rival_controller(example, label) for label in labels}


def rival_controller(example: str, label: str) -> Any:
    """Return one of `rival_controllers`."""
    gains = _gains(example)
    if label == "paper":
        return published_controller(example)
    check_known("controller", label, ("paper", *gains))
    return made_with(example, label, gains[label])


def _gains(example: str) -> dict[str, dict[str, float]]:
    check_known("example", example, RIVAL_GAINS)
    return RIVAL_GAINS[example]


def made_with(example: str, label: str, gains: Mapping[str, float]) -> Any:
    """Return one of `rival_controllers` with other gains, by qualified name."""
    return _MAKERS[label](example, gains)


def rival_actuators(example: str) -> dict[str, Any]:
    """Return the actuators by label; the saturation leaves about half of what the paper uses."""
    limit = {"example_1": 6.0, "example_2": 3.0}[example]
    return {
        "ideal": Gain(k=1.0),
        "dead zone": DeadZone(),
        "backlash": Backlash(),
        "saturation": Saturation(limit=limit),
    }


def behind(example: str, actuator: str) -> dict[str, str]:
    """Return ``{controller: pair}`` for one actuator: the options of a comparison."""
    check_known("actuator", actuator, rival_actuators(example))
    return {label: f"{label} / {actuator}" for label in ("paper", *_gains(example))}


def rival_loop(
    example: str = "example_1", pair: str = "paper / dead zone", noise: float = 0.0
) -> ct.InterconnectedSystem:
    """An example with one controller behind one actuator."""
    label, _, actuator = pair.partition(" / ")
    controller, actuators = rival_controller(example, label), rival_actuators(example)
    check_known("actuator", actuator, actuators)
    return example_with(example, controller, actuators[actuator], noise)


def example_with(
    example: str, controller: Spec, actuator: Spec, noise: float = 0.0
) -> ct.InterconnectedSystem:
    """Return an example with a controller and an actuator."""
    return getattr(loops, example)(controller=controller, actuator=actuator, noise=noise)


RIVALS_RECORD = Path(__file__).with_name("rivals.csv")
KEY = ["parameters", "rates"]
RIVAL_ACTUATORS = {"ideal": "no nonlinearity"} | {
    name: name for name in ("dead zone", "backlash", "saturation")
}
"""What tables call the actuators of `nlctl.analysis.paper.rivals.rival_actuators`."""


def rivals_study(example: str) -> Path:
    """Return the study file of an example."""
    return shipped(f"rivals-{example[-1]}")


def study_key(example: str) -> str:
    """Return a key of all that the study file of an example asks; comments do not count."""
    asked = tomllib.loads(rivals_study(example).read_text(encoding="utf-8"))
    return sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()[:12]


def loop_key(example: str, controller: str, actuator: str) -> tuple[str, float]:
    """Return a key that differs where the loops of two pairs differ."""
    loop = rival_loop(example, f"{controller} / {actuator}")
    facts = loop_facts(loop)
    held = json.dumps([facts["parameters"], facts["initial_state"]], sort_keys=True)
    values = loop_values(loop, 20.0).values()
    size = sum(abs(value) for value in values if not isinstance(value, str))
    return sha256(held.encode()).hexdigest()[:12], size


def checked_rivals(path: Path = RIVALS_RECORD) -> pd.DataFrame:
    """Return the record, if it is of the study files and of the loops of today."""
    record = pd.read_csv(path)
    again = "make it again with 'python campaign/rival_runs.py'"
    for example in paper.EXAMPLES:
        keys = set(record.loc[record["example"] == example, "study"])
        if keys != {study_key(example)}:
            raise ValueError(
                f"the record of rivals in '{example}' is of another study than "
                f"reports/rivals-{example[-1]}.toml: {again}"
            )
    lines = record[["example", "controller", "actuator", *KEY]].itertuples(index=False)
    for example, controller, actuator, held, rates in lines:
        now = loop_key(example, controller, actuator)
        if now[0] != held or not math.isclose(now[1], rates, rel_tol=1e-5):
            raise ValueError(
                f"the record of rivals in '{example}' is of another loop of '{controller}' behind "
                f"'{actuator}' (parameters {held}, rates {rates:.6g}; now {now[0]}, {now[1]:.6g}): "
                + again
            )
    return record


def beaten_by(record: pd.DataFrame, example: str) -> dict[str, dict[str, tuple[str, ...]]]:
    """Return who beats the paper's controller as printed, and whom it beats, by actuator."""
    # One beats another with no more violations of the spec and a smaller RMS of e from 10 s on: the
    # exact interval of the median difference on the same samples is on one side of 0.
    tallies = {}
    for actuator, runs in record[record["example"] == example].groupby("actuator", sort=False):
        lines: list[dict[str, Any]] = runs.to_dict("records")  # type: ignore[assignment]
        (printed,) = (line for line in lines if line["controller"] == "paper")
        limit = printed["violations"]
        better = [r for r in lines if r["less_low"] > 0 and r["violations"] <= limit]
        worse = [r for r in lines if r["less_high"] < 0 and r["violations"] >= limit]
        tallies[str(actuator)] = {
            "beaten by": tuple(r["controller"] for r in better),
            "beats": tuple(r["controller"] for r in worse),
        }
    return tallies


def failed_text(row: dict[str, Any]) -> str:
    """Return how many runs violate the spec, and in brackets how many of them did not end."""
    return f"{row['violations']}" + (f" ({row['failed']})" if row["failed"] else "")
