"""The rows of the table: plants, requirements, and what others published about them.

Requirements are those of ARCH-COMP 2020, falsification (`spec_*.m` and `requirements.txt` in
``arch/arch20/shared/benchmarks`` of github.com/ismailbennani/zlscheck); inputs are those of its
first instance, any signal within bounds.  Published cells are attempts falsified of 50 and the mean
number of simulations, at most 300 an attempt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import afc
import at
import cc
import nn
import numpy as np
import sc
from inputs import names

from nlctl.analysis.robustness import Requirement, Space, Uncertain, always, eventually, in_band
from nlctl.analysis.robustness.stl.formula import Formula

Bounds = dict[str, tuple[float, float, int]]


@dataclass(frozen=True, kw_only=True)
class Row:
    """A plant, its inputs, and a formula; `zlscheck` and `aristeo` are (attempts, mean)."""

    key: str
    build: Callable[[], Any]
    signals: Bounds
    formula: Formula
    until: float
    step: float = 0.01
    method: str = "auto"
    zlscheck: tuple[int, float] | None = None
    aristeo: tuple[int, float] | None = None
    suspect: bool = False
    note: str = ""

    @property
    def space(self) -> Space:
        """What the search chooses: every piece of every signal."""
        return Space(quantities=tuple(
            Uncertain(name=name, bounds=(low, high), nominal=(low + high) / 2)
            for signal, (low, high, count) in self.signals.items() for name in names(signal, count)
        ))  # fmt: skip

    @property
    def requirement(self) -> Requirement:
        """The formula with its name."""
        return Requirement(key=self.key, formula=self.formula, until=self.until)

    @property
    def timepts(self) -> np.ndarray:
        """When signals are sampled (s)."""
        return self.step * np.arange(round(self.until / self.step) + 1)


def implies(left: Formula, right: Formula) -> Formula:
    """Return "not left, or right"."""
    return ~left | right


def shifts(gear: int) -> Formula:
    """AT5: a gear that is shifted to is kept for 2.5 s."""
    on = in_band("gear", lower=gear - 0.5, upper=gear + 0.5)
    return always(
        implies(~on & eventually(on, 0.001, 0.1), eventually(always(on, 0, 2.5), 0.001, 0.1)), 0, 30
    )


def slow(end: float, speed: float) -> Formula:
    """AT6: with less than 3000 rpm for 30 s, until `end` (s) no faster than `speed` (mph)."""
    return implies(
        always(in_band("rpm", upper=3000), 0, 30), always(in_band("speed", upper=speed), 0, end)
    )


PEDALS = {"throttle": (0.0, 100.0, at.COUNT), "brake": (0.0, 325.0, at.COUNT)}
DRIVER = {"throttle": (0.0, 1.0, cc.COUNT), "brake": (0.0, 1.0, cc.COUNT)}
NORMAL = {"throttle": (0.0, 61.1, afc.COUNT), "engine": (900.0, 1100.0, 1)}
POWER = {"throttle": (61.2, 81.2, afc.COUNT), "engine": (900.0, 1100.0, 1)}
REFERENCE = {"reference": (1.0, 3.0, nn.COUNT)}
STEAM = {"steam": (3.99, 4.01, sc.COUNT)}

_LOW, _HIGH = in_band("throttle", upper=8.8), in_band("throttle", lower=40.0)
_EDGES = (_LOW & eventually(_HIGH, 0, 0.05)) | (_HIGH & eventually(_LOW, 0, 0.05))


def settles(allowed: float = 0.005) -> Formula:
    """NN: an error that is too large is small for 1 s within 2 s."""
    near = in_band("excess", upper=allowed)
    return always(implies(~near, eventually(always(near, 0, 1), 0, 2)), 1, 37)


FALCAUN = {
    "AT1": "1029 (4) / 896", "AT2": "501 (6) / 256", "AT6a": "458 / 1002", "AT6b": "600 / -",
    "AT6c": "901 / 898", "CC1": "229 / 396", "CC2": "119 / 76", "CC3": "195 / 122",
    "CC4": "- / 1256",
}  # fmt: skip

NEAR = in_band("mu", lower=-0.008, upper=0.008)
NEARER = always(in_band("mu", lower=-0.007, upper=0.007), 11, 50)
CLOSE, FAR = in_band("gap2", upper=20), in_band("gap5", upper=40)
CHASE = implies(always(in_band("gap2", lower=9), 0, 5), always(in_band("gap5", lower=9), 5, 20))
_AT = (
    ("AT1", always(in_band("speed", upper=120), 0, 20), 20.0, (50, 3.4), (0, np.nan)),
    ("AT2", always(in_band("rpm", upper=4750), 0, 10), 10.0, (50, 15.5), (50, 4.4)),
    ("AT51", shifts(1), 32.6, (50, 3.5), None),
    ("AT52", shifts(2), 32.6, (50, 1.6), None),
    ("AT53", shifts(3), 32.6, (50, 1.4), None),
    ("AT54", shifts(4), 32.6, (50, 3.5), None),
    ("AT6a", slow(4, 35), 30.0, (50, 48.0), (45, 101.0)),
    ("AT6b", slow(8, 50), 30.0, (39, 78.0), (50, 18.0)),
    ("AT6c", slow(20, 65), 30.0, (32, 19.0), (44, 109.0)),
)
_AFC = (
    ("AFC27", NORMAL, always(implies(_EDGES, always(NEAR, 1, 5)), 11, 45), (50, 1.0), (50, 2.3)),
    ("AFC29", NORMAL, NEARER, (50, 1.9), (50, 28.5)),
    ("AFC33", POWER, NEARER, (50, 2.0), (50, 24.7)),
)
_CC = (
    ("CC1", always(FAR, 0, 100), (50, 8.8), (50, 16.0), False),
    ("CC2", always(eventually(in_band("gap5", lower=15), 0, 30), 0, 70),
     (50, 4.7), (50, 1.0), True),
    ("CC3", always(always(CLOSE, 0, 20) | eventually(in_band("gap5", lower=40), 0, 20), 0, 80),
     (50, 23.0), (50, 46.0), False),
    ("CC4", always(eventually(always(in_band("gap5", lower=8), 0, 5), 0, 30), 0, 65),
     (32, 125.0), (50, 1.0), True),
    ("CC5", always(eventually(CHASE, 0, 8), 0, 72), (50, 2.0), (49, 54.0), False),
)  # fmt: skip
_WIDER = partial(nn.plant, 0.04)
ROWS = (
    *(Row(key=key, build=at.plant, signals=PEDALS, formula=formula, until=until, zlscheck=one,
          aristeo=other) for key, formula, until, one, other in _AT),
    *(Row(key=key, build=afc.plant, signals=signals, formula=formula, until=50.0, method="rodas5p",
          zlscheck=one, aristeo=other, note="exhaust read every 0.01 s")
      for key, signals, formula, one, other in _AFC),
    Row(key="NN.03", build=nn.plant, signals=REFERENCE, formula=settles(), until=40.0,
        zlscheck=(50, 1.0), aristeo=(50, 62.8)),
    Row(key="NN.04", build=_WIDER, signals=REFERENCE, formula=settles(), until=40.0,
        zlscheck=(50, 1.06)),
    *(Row(key=key, build=cc.plant, signals=DRIVER, formula=formula, until=100.0, zlscheck=one,
          aristeo=other, suspect=suspect) for key, formula, one, other, suspect in _CC),
    Row(key="SC", build=sc.plant, signals=STEAM, until=35.0, zlscheck=(50, 2.1), aristeo=(50, 1.0),
        formula=always(in_band("pressure", lower=87, upper=87.5), 30, 35), suspect=True),
)  # fmt: skip
