"""The ledger of whole loops: the audit's figures, what is violated, ensembles."""

import _thread
import dataclasses
import functools
import json
import threading

import numpy as np
import pytest

import nlctl
from nlctl.analysis.lyapunov import (
    Box,
    conservatism,
    decompose,
    examine,
    inequalities,
    ledger,
    literal,
    premises,
)
from nlctl.analysis.lyapunov.conclusions import slow_drift_of
from nlctl.analysis.lyapunov.loop.simulation import observed_loop
from nlctl.errors import ParameterError, UnknownNameError

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them

BOXES = {
    1: Box.of(x1=(-0.85, 1.0), x2=(-0.55, 1.1), v=(-12, 6)),
    2: Box.of(x1=(-0.85, 1.1), x2=(-0.55, 0.75), x3=(-0.6, 0.6), v=(-2.5, 4.5)),
}
FOUND_BY_THE_AUDIT = {"Lemma 1", "closure"}


@functools.cache
def example(number):
    return getattr(nlctl.paper, f"example_{number}")()


@functools.cache
def study(number):
    return examine(example(number), 20.0, box=BOXES[number])


@functools.cache
def book(number):
    return ledger(study(number))


@functools.cache
def faults():
    """A healthy member of Example 1, and one with each fault, on the same constants."""
    n = 5
    x1, d, gain, sigma = np.full(n, 0.5), np.full(n, 0.1), np.full(n, 0.2), np.full(n, 0.5)
    x1[1], d[2], gain[3], sigma[4] = 1.3, 1.0, 0.5, 0.0
    return {
        "start": {"plant.x1": x1},
        "params": {
            "plant.d_amplitude": d,
            "plant.gain_v": gain,
            "controller.robust.sigma_2": sigma,
        },
    }


@functools.cache
def of_member(i):
    """The ledger of one member, with the constants of the healthy loop."""
    many = {kind: {k: v[[i, i]] for k, v in named.items()} for kind, named in faults().items()}
    return ledger(example(1), 2.0, box=BOXES[1], W=np.zeros(27), step=0.01, **many)


@nlctl.record
class FaultyPlant(nlctl.PureFeedback):
    """A double integrator with a case for each of four faults."""

    fault: int = nlctl.param(0, unit="1", meaning="which of the faults there is")

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        x1, x2 = x
        rate = -x1 - x2 + u[0]
        if p.fault == 1:
            rate = rate + 1.0
        if p.fault == 2:
            rate = 2.0 * rate
        if p.fault == 3:
            rate = rate - x1
        if p.fault == 4:
            rate = 0.5 * rate
        return x2, rate


@pytest.mark.parted
@pytest.mark.parametrize("fault", range(5))
def test_a_plant_of_many_cases_is_observed(fault):
    """Its rates are outputs next to its other cases; no loop of signals without a state appears."""
    plant = FaultyPlant(order=2, f=lambda x, v: -x[0] - x[1] + v, fault=fault)
    loop = nlctl.paper.example_1(plant=plant)
    seen = observed_loop(loop, decompose(nlctl.DeadZone()))
    rng, names = np.random.default_rng(fault), list(seen.output_labels)
    for _ in range(20):
        outputs = seen.output(0.3, rng.normal(size=seen.nstates), [])
        x1, x2, v, rate = (outputs[names.index(name)] for name in ("x1", "x2", "v", "rate_x2"))
        plain = -x1 - x2 + v
        assert rate == pytest.approx([plain, plain + 1, 2 * plain, plain - x1, plain / 2][fault])


@pytest.mark.parted
@pytest.mark.parametrize("number", [1, 2])
def test_the_examples_hold_as_corrected(number):
    """No corrected statement is violated; of the paper's own, Lemma 1 and the closed set are."""
    assert not book(number).violated
    assert {line.key for line in book(number).failing} == FOUND_BY_THE_AUDIT
    statuses = {line.key: line.status for line in book(number).lines}
    assert statuses["A2"] == statuses["A3"] == statuses["(10)"] == statuses["(29)"] == "proved"
    assert statuses["A1"] == "computed"
    assert statuses["(31)"] == statuses["(32)"] == statuses["Lemma 1, horizon"] == "checked"
    assert statuses["(b)"] == "not applicable"  # zeta falls at times
    assert statuses["slow drift"] == "undecided"
    assert slow_drift_of(study(number).runs.first)[0] is None


@pytest.mark.parametrize(
    ("number", "Q", "C_0", "largest"), [(1, None, 11.035, 0.99591), (2, 0.0339, 20.948, 0.6768)]
)
def test_the_bound_is_that_of_the_audit(number, Q, C_0, largest):
    """C_0 and max |r| of an independent computation; Q where the split is the same."""
    assert book(number).max_r == pytest.approx(largest, abs=3e-4)
    assert book(number).constants.C_0(book(number).Q) == pytest.approx(C_0, rel=1e-3)
    if Q is not None:
        assert pytest.approx(Q, abs=1e-4) == book(number).Q


def test_the_margins_of_example_2_are_those_of_the_audit():
    """Least margins and their times, of an independent computation."""
    audit = {"(30)": (1.0009, 9.947), "(31)": (13.779, 10.08), "(32b)": (156.8, 10.96)}
    audit |= {"(36)": (20.27, 0.046), "(36b)": (10.45, 0.04)}
    for key, (least, time) in audit.items():
        assert book(2)[key].least == pytest.approx(least, rel=1e-3)
        assert book(2)[key].time == pytest.approx(time, abs=5e-3)


def test_the_margins_of_example_1_are_those_of_the_audit():
    """With the textbook's split of the dead zone, which the audit used."""
    split, found = decompose(nlctl.DeadZone()), study(1).constants
    given = premises(found, split=split)
    signals = study(1).runs.first.signals
    seen = {m.equation: m for m in inequalities(signals, given)}
    for key, least, time in (("(30)", 0.1343, 12.537), ("(31)", 6.975, 0.766)):
        assert seen[key].least == pytest.approx(least, rel=5e-3)
        assert seen[key].at == pytest.approx(time, abs=5e-3)


def test_the_margins_with_an_eps_of_another_g_are_those_of_the_audit():
    """Which took eps* of g without q cos(w t), and so found (20), (30) and (31) violated."""
    split, found = decompose(nlctl.DeadZone()), study(1).constants
    given = premises(found, split=split)
    printed, signals = literal(given, found), study(1).runs.first.signals
    delta = given.G_max * split.eps_star + printed.d + given.eps
    mixed = dataclasses.replace(printed, eps=given.eps, delta=delta)
    seen = {m.equation: m for m in inequalities(signals, mixed)}
    audit = {"(20)": (-4.313, 0.234), "(30)": (-4.228, None), "(31)": (-1.578, 0.238)}
    for key, (least, time) in audit.items():
        assert seen[key].least == pytest.approx(least, rel=1e-2)
        assert time is None or seen[key].at == pytest.approx(time, abs=5e-3)
    assert all(m.holds for m in inequalities(signals, printed))


def test_example_1_as_printed_holds_with_the_eps_of_its_g():
    """q cos(w t) in g: the paper's d*, and an eps* of 5.1 at least, with which no line fails."""
    lines = [line for line in book(1).lines if line.key.endswith(" literal")]
    keys = {line.key.removesuffix(" literal") for line in lines}
    assert keys == {"A2", "(10)", "(18)", "(20)", "(22)", "(30)", "(31)", "(32)", "(36)"}
    for line in lines:
        assert (line.status, line.reading) == ("checked", "paper")
        assert line.least >= -1e-9
        assert "eps* = 6" in line.statement or "eps* = 5" in line.statement
        assert "0 % of" in line.evidence
    assert "below 5.1" in book(1)["(10) literal"].evidence
    assert not any(line.key.endswith(" literal") for line in book(2).lines)


@pytest.mark.parametrize("number", [1, 2])
def test_the_line_of_the_closure_says_what_was_looked_for(number):
    """Of the published gains: no box up to 1000, whatever Q and W; and what this box gives."""
    line = book(number)["closure"]
    assert (line.status, line.reading) == ("violated", "paper")
    assert line.evidence.startswith("none up to |x_i| <= 1000 closes, whatever Q")
    assert "on this box C_0 = " in line.evidence
    assert "assumed and not shown" in line.follows


def test_the_integral_is_that_of_its_samples():
    """I from the integrator and I by the trapezoidal rule: two ways to one number."""
    run, rate = study(1).runs.first, study(1).constants["alpha_1"]
    s = run.signals
    w = s["r"] * s["kGu"] + s["rate_zeta"]
    weighted = np.exp(rate * s.t) * w
    steps = 0.5 * (weighted[1:] + weighted[:-1]) * np.diff(s.t)
    by_samples = np.exp(-rate * s.t[1:]) * np.cumsum(steps)
    assert s["I"][1:] == pytest.approx(by_samples, abs=3e-3)
    assert np.all(np.abs(s["I"]) <= s["I_bar"] + 1e-9)


def test_the_ledger_prints_tabulates_and_is_json():
    """Three readings of one record; numbers that are not finite become null."""
    text, table = str(book(1)), book(1).table()
    assert all(line.key in text for line in book(1).lines)
    assert "do not follow" in text.replace("\n", " ")
    assert list(table.index) == [line.key for line in book(1).lines]
    told = json.loads(book(1).to_json())
    assert (told["holds"], told["answer"]) == (book(1).holds, book(1).answer)
    assert {line["key"]: line["status"] for line in told["lines"]} == dict(table["status"])
    with pytest.raises(UnknownNameError, match=r"unknown line '\(13\)'"):
        book(1)["(13)"]


class TestFaults:
    @pytest.mark.parted
    @pytest.mark.parametrize(
        ("member", "broken"),
        [
            (1, {"Omega"}),
            pytest.param(2, {"A2"}, marks=pytest.mark.ci),  # in the ensemble every day
            pytest.param(3, {"A3"}, marks=pytest.mark.ci),
            pytest.param(4, {"decay"}, marks=pytest.mark.ci),
        ],
    )
    def test_planted_faults_are_named(self, member, broken):
        """A state out of the box, a larger disturbance, a gain out of its sector, no decay."""
        violated = {line.key for line in of_member(member).violated}
        assert broken <= violated
        assert all(line.follows for line in of_member(member).violated)

    @pytest.mark.ci
    def test_the_healthy_member_is_healthy(self):
        """A check that always fails is as bad as one that cannot."""
        assert not of_member(0).violated

    def test_a_run_that_is_lost_is_no_calm_one(self):
        """From the wrong sign of N the loop bursts at once; the ledger says when the run ended."""
        found = ledger(
            example(1),
            2.0,
            box=BOXES[1],
            W=np.zeros(27),
            start={"law.zeta": 3.05},
            max_steps=20_000,
        )
        assert found.holds is False
        assert found["run"].status == found["Lemma 1, horizon"].status == "violated"
        assert 0 < found["run"].time < 2
        assert f"{found['run'].time:.6g}" in found["run"].evidence
        assert found["run"].follows

    def test_an_ensemble_tells_the_worst_member_and_how_to_replay_it(self):
        """One line per statement over all members; the options carry every digit."""
        many = ledger(
            example(1), 2.0, box=BOXES[1], W=np.zeros(27), step=0.01, **faults()
        )  # fmt: skip
        assert many.members == 5
        worst = {key: many[key].member for key in ("Omega", "A2", "A3", "decay")}
        assert worst["A2"] == 2
        assert worst["A3"] == 3
        assert worst["decay"] == 4
        assert '--set "plant.d_amplitude=1"' in many["A2"].replay
        assert '--set "plant.x1(0)=0.5"' in many["A2"].replay
        assert "run 2" in many["A2"].text(10)


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_ends_the_examination_and_no_run_is_taken_for_a_whole_one():
    """Wherever it comes: in a run it was once the end of a response, and the report went on."""
    examine(example(1), 1.0, box=BOXES[1])  # compiled
    timer = threading.Timer(0.2, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        examine(example(1), 8_000.0, box=BOXES[1])
    timer.join()


def test_responses_are_run_again_with_what_the_proof_needs():
    """A response of the loop gives the ledger of its own start, times and parameters."""
    times = np.linspace(0, 0.2, 21)
    response = nlctl.input_output_response(
        example(1), times, 0, {"plant.x1": 0.6}, params={"law.beta": 3.0}
    )
    found = ledger(example(1), response, box=BOXES[1], W=np.zeros(27))
    assert not found.violated
    assert found.constants.parts.gains.beta == 3.0
    assert found.horizon == pytest.approx(0.2)
    assert found["(14)"].state["x1"] == pytest.approx(0.6)
    response.outputs[response.output_labels.index("r")][10:] += 0.1
    with pytest.raises(ParameterError, match="not one of this loop"):
        ledger(example(1), response, box=BOXES[1], W=np.zeros(27))


def test_without_a_box_it_is_what_the_run_visits():
    """A tenth of each side is added at both ends, so that a sixth of a half side is left."""
    found = ledger(example(1), 0.5, W=np.zeros(27))
    assert found["Omega"].least == pytest.approx(0.1 / 0.6)
    assert "visited by 1 response" in found["Omega"].evidence
    assert not found.violated


@pytest.mark.weekly
def test_a_long_run_tells_where_the_slow_drift_leads():
    """Example 2 spends its budget slowly: some percent, and a time long after the run."""
    found = ledger(example(2), 320.0, box=BOXES[2], W=np.zeros(27), step=0.04)
    assert found.slow_drift is not None
    assert found.slow_drift.burst > 5000
    line = found["slow drift"]
    assert line.status == "undecided"
    assert line.evidence.startswith("drifts")
    assert line.least == pytest.approx(1 - found.slow_drift.share)
    assert "budget spent by" in line.evidence
    assert found["(c)"].status == found["Lemma 1, horizon"].status == "checked"


def test_what_cannot_be_run_is_refused():
    """Arrays of two lengths, no horizon, a start for a response."""
    with pytest.raises(ParameterError, match="one length"):
        ledger(example(1), start={"plant.x1": [0.1, 0.2]}, params={"law.beta": [1.0, 2.0, 3.0]})
    with pytest.raises(ParameterError, match="horizon"):
        ledger(example(1), -1.0)
    with pytest.raises(UnknownNameError, match="x1"):
        ledger(example(1), 1.0, start={"plant.x9": 0.0})


class TestConservatism:
    def test_the_shares_are_those_of_the_bound(self):
        """The terms add up to C_0^2 / 2, and delta*'s to delta*."""
        for number in (1, 2):
            found = conservatism(study(number))
            whole = sum(share.value for share in found.shares)
            assert whole == pytest.approx(found.C_0**2 / 2, rel=1e-9)
            assert sum(s.share for s in found.shares) == pytest.approx(1)
            assert sum(s.share for s in found.delta_shares) == pytest.approx(1, rel=1e-9)
            assert found.C_0_fitted <= found.C_0_along <= found.C_0
            assert found.max_r <= found.sqrt_2V <= found.C_0
            assert found.e_1 >= found.tail_max_e_1
            assert {"Q", "|W| in alpha_0"} <= set(found.table().index)

    @pytest.mark.parametrize(
        ("number", "ratio", "bound", "from_1s"), [(1, 11.1, 0.2694, 1.19), (2, 31.0, 0.1382, 1.011)]
    )
    def test_the_ratios_are_those_of_the_audit(self, number, ratio, bound, from_1s):
        """C_0 / max |r|, and the direct comparison, which needs neither V nor Lemma 1."""
        found = conservatism(study(number))
        assert found.ratio == pytest.approx(ratio, rel=5e-3)
        first, half = found.comparisons
        assert half.bound == pytest.approx(bound, rel=2e-3)
        assert first.ratio == pytest.approx(from_1s, rel=3e-3)
        assert half.bound >= half.max_r
