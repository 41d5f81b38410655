"""The rows of the table: plants, requirements, and what others published about them.

Requirements are those of ARCH-COMP 2020, falsification (`spec_*.m` and `requirements.txt` in
``arch/arch20/shared/benchmarks`` of github.com/ismailbennani/zlscheck); inputs are those of its first
instance, any signal within bounds.  Published cells are attempts falsified of 50 and the mean number of
simulations, at most 300 an attempt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
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
    """One row: a plant, its inputs, and a formula; `zlscheck` and `aristeo` are (attempts, mean)."""

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
    """AT6: with less than 3000 rpm for 30 s the car is not faster than so many mph until so many s."""
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


def _at(key: str, formula: Formula, until: float, **published: Any) -> Row:
    return Row(key=key, build=at.plant, signals=PEDALS, formula=formula, until=until, **published)


def _afc(key: str, signals: Bounds, formula: Formula, **published: Any) -> Row:
    return Row(
        key=key, build=afc.plant, signals=signals, formula=formula, until=50.0, method="rodas5p",
        note="exhaust looked at every 0.01 s", **published,
    )  # fmt: skip


def _cc(key: str, formula: Formula, **published: Any) -> Row:
    return Row(key=key, build=cc.plant, signals=DRIVER, formula=formula, until=100.0, **published)


FALCAUN = {
    "AT1": "1029 (4) / 896", "AT2": "501 (6) / 256", "AT6a": "458 / 1002", "AT6b": "600 / -",
    "AT6c": "901 / 898", "CC1": "229 / 396", "CC2": "119 / 76", "CC3": "195 / 122", "CC4": "- / 1256",
}  # fmt: skip

GAP2, GAP5 = "gap2", "gap5"
ROWS = (
    _at("AT1", always(in_band("speed", upper=120), 0, 20), 20.0, zlscheck=(50, 3.4), aristeo=(0, np.nan)),
    _at("AT2", always(in_band("rpm", upper=4750), 0, 10), 10.0, zlscheck=(50, 15.5), aristeo=(50, 4.4)),
    _at("AT51", shifts(1), 32.6, zlscheck=(50, 3.5)),
    _at("AT52", shifts(2), 32.6, zlscheck=(50, 1.6)),
    _at("AT53", shifts(3), 32.6, zlscheck=(50, 1.4)),
    _at("AT54", shifts(4), 32.6, zlscheck=(50, 3.5)),
    _at("AT6a", slow(4, 35), 30.0, zlscheck=(50, 48.0), aristeo=(45, 101.0)),
    _at("AT6b", slow(8, 50), 30.0, zlscheck=(39, 78.0), aristeo=(50, 18.0)),
    _at("AT6c", slow(20, 65), 30.0, zlscheck=(32, 19.0), aristeo=(44, 109.0)),
    _afc("AFC27", NORMAL, always(implies(_EDGES, always(in_band("mu", lower=-0.008, upper=0.008), 1, 5)), 11, 45),
         zlscheck=(50, 1.0), aristeo=(50, 2.3)),
    _afc("AFC29", NORMAL, always(in_band("mu", lower=-0.007, upper=0.007), 11, 50),
         zlscheck=(50, 1.9), aristeo=(50, 28.5)),
    _afc("AFC33", POWER, always(in_band("mu", lower=-0.007, upper=0.007), 11, 50),
         zlscheck=(50, 2.0), aristeo=(50, 24.7)),
    Row(key="NN.03", build=nn.plant, signals=REFERENCE, formula=settles(), until=40.0,
        zlscheck=(50, 1.0), aristeo=(50, 62.8)),
    _cc("CC1", always(in_band(GAP5, upper=40), 0, 100), zlscheck=(50, 8.8), aristeo=(50, 16.0)),
    _cc("CC2", always(eventually(in_band(GAP5, lower=15), 0, 30), 0, 70), zlscheck=(50, 4.7), aristeo=(50, 1.0), suspect=True),
    _cc("CC3", always(always(in_band(GAP2, upper=20), 0, 20) | eventually(in_band(GAP5, lower=40), 0, 20), 0, 80),
        zlscheck=(50, 23.0), aristeo=(50, 46.0)),
    _cc("CC4", always(eventually(always(in_band(GAP5, lower=8), 0, 5), 0, 30), 0, 65),
        zlscheck=(32, 125.0), aristeo=(50, 1.0), suspect=True),
    _cc("CC5", always(eventually(implies(always(in_band(GAP2, lower=9), 0, 5), always(in_band(GAP5, lower=9), 5, 20)),
        0, 8), 0, 72), zlscheck=(50, 2.0), aristeo=(49, 54.0)),
    Row(key="SC", build=sc.plant, signals=STEAM, formula=always(in_band("pressure", lower=87, upper=87.5), 30, 35),
        until=35.0, zlscheck=(50, 2.1), aristeo=(50, 1.0), suspect=True),
)  # fmt: skip
