"""The figures to reach, by plain python-control at tight tolerance and by machine code."""

import dataclasses

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis import metrics
from nlctl.analysis.paper import (
    CASES,
    METRICS,
    checks,
    expectations,
    sample_times,
)
from nlctl.analysis.reproductions.paper import PaperRun, numbers_of, simulate_case, simulate_cases

CASE = {case.key: case for case in CASES}


def interpreted(diagram):
    return diagram


def fused(diagram):
    """Put the diagram's compiled right-hand side, as test_native_rhs compares it, into one block.

    python-control integrates it: by the interpreted one tight tolerances take minutes.
    """
    compiled = nlctl.compile(diagram)
    (rhs, out), p = compiled.native, compiled.parameter_vector()
    g, m = (np.empty(compiled.lowered.rows[name]) for name in "gm")

    def filled(function, size, t, x, u, *more):
        result = np.empty(size)
        function(t, np.ascontiguousarray(x), u, p, result, *more)
        return result

    return ct.nlsys(
        lambda t, x, u, params: filled(rhs, x.size, t, x, u, g, m),
        lambda t, x, u, params: filled(out, diagram.noutputs, t, x, u),
        inputs=0,
        outputs=diagram.output_labels,
        states=diagram.state_labels,
    )


def plain_run(case, system=interpreted, *, timepts=None, **solver):
    """Run a case by ct.input_output_response alone, without nlctl's own call."""
    diagram = case.make()
    timepts = sample_times() if timepts is None else timepts
    with np.errstate(over="ignore", invalid="ignore"):  # rejected trial steps may overflow
        response = ct.input_output_response(
            system(diagram), timepts, 0, nlctl.initial_state(diagram), **solver
        )
    signals = {name: response.y[i] for name, i in diagram.output_index.items()}
    return PaperRun(case=case, time=response.time, signals=signals)


def measure(result):
    metrics = numbers_of(result.case, result.time, result.signals)
    return dataclasses.replace(result, metrics=metrics)


@pytest.mark.weekly
def test_example_1_holds_to_the_digits_given():
    """States at the end agree in every digit given, peaks to 1e-6 (read between samples)."""
    tight = {"method": "DOP853", "solve_ivp_kwargs": {"rtol": 1e-13, "atol": 1e-14}}
    result = measure(plain_run(CASE["1"], fused, **tight))
    for check in checks({"1": result}):
        digits = len(check.statement.printed.partition(".")[2])
        at_end = "(20 s)" in check.statement.quantity
        allowed = 1.01 * 0.5 * 10.0**-digits if at_end else check.statement.tolerance
        assert check.error <= max(allowed, 2e-12), check


RELAXED = 5e-5  # what python-control's relaxed play allows
LSODA = {"method": "LSODA", "solve_ivp_kwargs": {"rtol": 1e-8, "atol": 1e-10}}


@pytest.mark.weekly
@pytest.mark.parametrize("key", ["1", "2", "2-dead-zone"])
def test_diagrams_as_they_stand_reach_their_figures_in_python_control(key):
    """With LSODA at rtol 1e-8 every figure is within the tolerance of its method."""
    result = measure(plain_run(CASE[key], **LSODA))
    found = checks({key: result})
    assert found
    for check in found:
        assert check.error <= max(RELAXED, check.statement.tolerance), check


@pytest.mark.slow
def test_every_case_reaches_its_figures():
    """Machine code of every case, to the tolerance in the table."""
    found = checks(simulate_cases(CASES))
    assert len(found) == len(expectations())
    for check in found:
        assert check.holds, check


@pytest.mark.weekly
@pytest.mark.parametrize(
    ("example", "max_e", "rms_e", "max_u", "zeta", "tolerance"),
    [
        (1, 0.0963227014, 0.0543846010, 5.937481, 2.0892126, 1e-6),
        (2, 0.0582407872, 0.0338259565, 2.116018, 1.9497874, 5e-6),
    ],
)
def test_long_horizon_figures(example, max_e, rms_e, max_u, zeta, tolerance):
    """The figures on [100, 200] s hold; with the relaxed play to 5e-6."""
    timepts = np.concatenate([[0.0], np.linspace(100, 200, 10001)])
    tight = {"method": "LSODA", "solve_ivp_kwargs": {"rtol": 1e-9, "atol": 1e-11}}
    result = plain_run(CASE[str(example)], fused, timepts=timepts, **tight)
    t, e = metrics.over(result.time, result.signals["e"], 100, 200)
    assert metrics.peak(t, e) == pytest.approx(max_e, abs=tolerance)
    assert metrics.rms(t, e) == pytest.approx(rms_e, abs=tolerance)
    u = metrics.over(result.time, result.signals["u"], 100, 200)
    assert metrics.peak(*u) == pytest.approx(max_u, abs=4e-4)  # read from samples 10 ms apart
    assert result.signals["zeta"][-1] == pytest.approx(zeta, abs=tolerance)


@pytest.mark.weekly
def test_nlctl_call_and_plain_call_agree():
    """nlctl's reference engine and python-control's own call integrate one right-hand side."""
    diagram, timepts = CASE["1"].make(), np.linspace(0, 0.5, 11)
    ours = nlctl.input_output_response(diagram, timepts, engine="python-control")
    plain = plain_run(CASE["1"], timepts=timepts, **LSODA)
    u = ours.y[diagram.output_index["u"]]
    np.testing.assert_allclose(u, plain.signals["u"], atol=1e-5 * np.abs(u).max())


def test_every_expectation_names_a_case_and_a_metric():
    """A figure to reach that no case produces would never be checked."""
    cases, keys = {case.key for case in CASES}, {m.key for m in METRICS}
    for expectation in expectations():
        assert expectation.case in cases
        assert expectation.metric in keys


def test_a_wrong_figure_fails_and_nan_fails():
    """A check can fail: a wrong value does, and so does NaN."""
    case = CASE["1"]
    right = {e.metric: e.value for e in expectations() if e.case == "1"}
    exact = PaperRun(case=case, time=np.zeros(1), signals={}, metrics=right)
    assert all(check.holds for check in checks({"1": exact}))
    for wrong in (right["max_r"] + 1e-4, np.nan, np.inf):
        spoiled = PaperRun(
            case=case, time=np.zeros(1), signals={}, metrics=right | {"max_r": wrong}
        )
        failed = [c.statement.quantity for c in checks({"1": spoiled}) if not c.holds]
        assert failed == ["max |r|"]


def test_variants_move_the_loop_and_processes_change_nothing():
    """A run in this process equals the same run again, bit for bit."""
    case = CASE["1-p1"]
    first, second = simulate_case(case), simulate_case(case)
    assert first.metrics == second.metrics
    assert first.metrics["tail_max_e"] != pytest.approx(0.11741705334, abs=1e-5)
