"""v = k(u, t) u + eps_u (2): every actuator has such a split, or says why it has none."""

import numpy as np
import pytest
from actuator_rig import along
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl import actuators
from nlctl.analysis.catalogue import block_records
from nlctl.analysis.lyapunov import DecompositionError, decompose, examine

RECORDS = {
    name: kind for name, kind in block_records().items() if getattr(actuators, name, None) is kind
}
SPLIT = {
    "Backlash", "DeadZone", "DeadZoneInverse", "Gain", "OneSidedDeadZones", "PrandtlIshlinskii",
    "PrandtlIshlinskiiInverse", "Quantiser",
}  # fmt: skip
RATED = {"BacklashInverse"}
BOUNDED = {
    "AsymmetricSaturation", "GeneralisedPrandtlIshlinskii", "Preisach", "Relay", "Saturation",
    "Stop",
}  # fmt: skip
LATE = {"Lag", "RateLimiter", "SecondOrderLag"}
FORCES = {"BoucWen", "Coulomb", "Dahl", "LuGre", "StickSlip", "Stribeck"}
WHY = [
    (BOUNDED, "its output is bounded"),
    (LATE, "follows u later"),
    (FORCES, "a force law"),
    (RATED, "takes the rate"),
]


def test_every_actuator_is_in_one_class():
    """None is left out, none is in two."""
    classes = [SPLIT, BOUNDED, LATE, FORCES, RATED]
    assert sorted(RECORDS) == sorted(name for names in classes for name in names)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SPLIT))
@given(data=st.data())
@settings(max_examples=10)
def test_the_bounds_hold_along_runs(name, data):
    """k in [k_1, k_2] and eps_u in its bounds, whatever the input and the memory."""
    spec = RECORDS[name]()
    split = cached_split(name)
    path = np.round(data.draw(st.lists(st.floats(-50, 50), min_size=2, max_size=12)), 6)
    u = np.repeat(path, 2)  # each is held: what the memory has become counts as well
    v = along(spec, u)
    k, eps = split.gain(u, v), split.eps_u(u, v)
    assert np.all((k >= split.k_1 - 1e-9) & (k <= split.k_2 + 1e-9) | (u == 0))
    assert np.all((eps >= split.eps_low - 1e-9) & (eps <= split.eps_high + 1e-9))


_SPLITS = {}


def cached_split(name):
    if name not in _SPLITS:
        _SPLITS[name] = decompose(RECORDS[name]())
    return _SPLITS[name]


@pytest.mark.parametrize(("names", "why"), WHY, ids=["bounded", "late", "forces", "rated"])
def test_the_others_say_why_they_have_none(names, why):
    """With and without bounds of k given: a refusal that names the record, never another error."""
    for name in sorted(names):
        with pytest.raises(DecompositionError, match=f"{name} is not of the form.*{why}"):
            decompose(RECORDS[name]())
        with pytest.raises(DecompositionError, match=f"{name} is not of the form"):
            decompose(RECORDS[name](), k=(0.5, 1.5))


@pytest.mark.slow
@given(w=st.lists(st.floats(0.05, 1), min_size=4, max_size=4), w_0=st.floats(0.1, 1))
@settings(max_examples=10)
def test_the_sum_of_plays_attains_its_bounds(w, w_0):
    """eps_u = -+ sum w_i r_i after a long way up or down, k the sum of the weights."""
    spec = nlctl.actuators.PrandtlIshlinskii(w=w, w_0=w_0)
    split, most = decompose(spec), float(np.dot(w, spec.r))
    assert split.provenance == "proved"
    assert (split.k_1, split.k_2) == pytest.approx((w_0 + sum(w),) * 2)
    assert (split.eps_low, split.eps_high) == pytest.approx((-most, most), abs=1e-4)
    u = np.array([-3.0, 3.0, -3.0])
    eps = split.eps_u(u, along(spec, u))
    np.testing.assert_allclose(eps[1:], [-most, most], atol=1e-12)


@nlctl.record
class Leaning:
    """A memory of a user's that tells a band: that of u +- lean."""

    lean: float = nlctl.param(0.3, unit="1", meaning="half the band that it tells", above=0)
    inputs, outputs, states, feedthrough = ("u",), ("v",), ("m",), True
    gains = (1.0, 1.0)

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (u[0] - x[0],)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (u[0] + 0.3 * np.tanh(x[0]),)

    @staticmethod
    @nlctl.equation
    def band(t, u, p):
        return u - p.lean, u + p.lean


def test_a_band_that_a_user_declares_is_tried_and_never_called_proved():
    """Given where samples of its output stay inside, refused where one does not."""
    split = decompose(Leaning())
    assert split.provenance == "given"
    assert split.eps_star == pytest.approx(0.3, abs=1e-4)
    with pytest.raises(DecompositionError, match=r"Leaning declares the band .* correct its band"):
        decompose(Leaning(lean=0.1))


@each_row(
    ("spec", "told"),
    [
        (nlctl.Gain(k=-1.0), "Gain violates Assumption 1: its gain is -1"),
        (nlctl.SumOfSines(order=2), "SumOfSines has no known split"),
    ],
)
def test_other_records_are_refused_too(spec, told):
    """A gain of the wrong sign, and what is not an actuator."""
    with pytest.raises(DecompositionError, match=told):
        decompose(spec)


@pytest.mark.ci
def test_the_proof_is_examined_with_several_memories_or_refused():
    """The ledger's runs with four plays; with relays one sentence, before anything runs."""
    found = examine(nlctl.paper.example_1(actuator=nlctl.actuators.PrandtlIshlinskii()), 1.0)
    run = found.runs.first
    eps = found.runs.split.eps_u(run.signals["u"], run.signals["v"])
    assert np.abs(eps).max() <= found.runs.split.eps_star + 1e-12
    with pytest.raises(DecompositionError, match="Preisach is not of the form"):
        examine(nlctl.paper.example_1(actuator=nlctl.actuators.Preisach()), 1.0)
