"""Margins of switched signals against a brute force on 1e5 samples."""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d
from scipy.optimize import brentq

from nlctl.analysis.robustness import Requirement, always, eventually, in_band, margin
from nlctl.analysis.robustness.stl.spec import violation_time
from nlctl.errors import ParameterError

END = 10.0
T = np.linspace(0, END, 401)
FINE = np.linspace(0, END, 100_001)


def drive(t):
    return 2 * np.exp(-0.2 * t) * np.sin(2 * t + 0.3)


SWITCHED = {
    "saturation": (lambda t: np.clip(drive(t), -1, 1), (-1.0, 1.0)),
    "dead zone": (
        lambda t: np.sign(drive(t)) * np.maximum(np.abs(drive(t)) - 0.5, 0), (-0.5, 0.5)
    ),
    "relay": (lambda t: np.where(drive(t) > 0.2, 1.0, -0.5) * np.cos(0.3 * t), (0.2,)),
}  # fmt: skip


def crossings(levels):
    """When the drive is at one of some levels."""
    found = []
    for level in levels:
        above = drive(FINE) > level
        changes = np.flatnonzero(np.diff(above.astype(int)))
        found += [brentq(lambda t, c=level: drive(t) - c, FINE[k], FINE[k + 1]) for k in changes]
    return np.sort(found)


def windows(values, start, end, pick):
    """Brute force: pick of values over [t + start, t + end], on the fine grid."""
    i, j = round(start / END * 1e5), round(end / END * 1e5)
    size = j - i + 1
    sign = 1.0 if pick == "max" else -1.0
    padded = np.concatenate([sign * values, np.full(2 * size + j, -np.inf)])
    filtered = maximum_filter1d(padded, size, origin=-(size // 2), mode="constant", cval=-np.inf)
    return sign * filtered[i : i + values.size - j]


BAND = in_band("v", lower=-0.6, upper=0.7, scale=1.0)
FORMULAS = {
    "always": (always(BAND, 1.2345, 7.891), lambda r: windows(r, 1.2345, 7.891, "min")),
    "eventually": (eventually(BAND, 0.3333, 1.7777), lambda r: windows(r, 0.3333, 1.7777, "max")),
    "always eventually": (
        always(eventually(BAND, 0.1, 0.9), 0.5, 8.0),
        lambda r: windows(windows(r, 0.1, 0.9, "max"), 0.5, 8.0, "min"),
    ),
    "eventually always": (
        eventually(always(BAND, 0.0, 0.4), 0.7, 6.0),
        lambda r: windows(windows(r, 0.0, 0.4, "min"), 0.7, 6.0, "max"),
    ),
}


@pytest.mark.parametrize("kind", SWITCHED)
@pytest.mark.parametrize("name", FORMULAS)
def test_margins_are_those_of_a_brute_force(kind, name):
    """To 1e-6 with breaks; what 1e5 samples miss themselves next to a jump or corner is added."""
    v, levels = SWITCHED[kind]
    breaks = crossings(levels)
    formula, brute = FORMULAS[name]
    fine = v(FINE)
    rho = np.minimum(0.7 - fine, fine + 0.6)
    exact = brute(rho)[0]
    asked = Requirement(key="r", formula=formula, until=END)
    found = margin(asked, T, {"v": v(T)}, breaks=breaks)
    steps = np.abs(np.diff(fine))
    between = np.max(steps[steps < 0.1])  # of the fine samples, between jumps
    assert found == pytest.approx(exact, abs=1e-6 + between * (name != "always" or kind == "relay"))


@pytest.mark.parametrize("samples", [101, 137, 401, 1000])
def test_a_saturated_signal_stays_within_its_limit(samples):
    """Without breaks and with them: always |v| <= 1.02 behind a saturation at 1."""
    t = np.linspace(0, END, samples)
    v = np.clip(5 * np.sin(9 * t), -1, 1)
    asked = Requirement(key="r", formula=always(in_band("v", lower=-1.02, upper=1.02)), until=END)
    assert margin(asked, t, {"v": v}) == pytest.approx(0.02 / 1.02, abs=1e-12)


def test_a_violation_begins_at_the_jump():
    """v jumps from 0 to 1 at 3.21 s, between two samples."""
    asked = Requirement(key="r", formula=always(in_band("v", upper=0.5)), until=END)
    v = np.where(T < 3.21, 0.0, 1.0)
    assert violation_time(asked, T, {"v": v}, breaks=[3.21]) == pytest.approx(3.21, abs=1e-9)


@pytest.mark.parametrize("bad", [[2.0, 1.0], [np.nan], [[1.0]], ["a"]])
def test_breaks_that_make_no_sense_are_refused(bad):
    asked = Requirement(key="r", formula=in_band("v", upper=0.5), until=END)
    with pytest.raises(ParameterError, match="breaks need"):
        margin(asked, T, {"v": 0 * T}, breaks=bad)
