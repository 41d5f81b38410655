"""A loop that runs in WebAssembly: the same numbers as here, to the bit; what it refuses."""

import ctypes
import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import control as ct
import numpy as np
import pytest
from closed_form_runs import Ball
from exported import halved
from extras import needed

import nlctl
from nlctl import actuators, sources
from nlctl.errors import CompileError, DivergedError, ParameterError, UsageError
from nlctl.export.web import handles, web_program
from nlctl.export.web.rounding import integrators_alike
from nlctl.native.floats import with_every_float
from nlctl.native.machine.finish import finished

HERE = Path(__file__).parent
ENGINE = HERE.parents[1] / "analysis" / "report" / "templates" / "live_engine.js"
TIMES = np.linspace(0.0, 3.0, 301)


@pytest.fixture(scope="module")
def node():
    needed("ziglang", "export")
    found = shutil.which("node")  # or the one that drives Chromium
    return found or str(Path(needed("playwright", "browser").__file__).parent / "driver" / "node")


@pytest.fixture
def in_node(node, tmp_path):
    """Run a program as a page does."""

    def run(program, *runs):
        module = tmp_path / "page.wasm"
        module.write_bytes(program.module)
        task = {"engine": str(ENGINE), "module": str(module), "facts": program.facts,
                "runs": list(runs or [{}])}  # fmt: skip
        done = subprocess.run(
            [node, str(HERE / "page_run.mjs")], input=json.dumps(task), capture_output=True,
            text=True, check=True,
        )  # fmt: skip
        return json.loads(done.stdout)

    return run


def samples(found, program):
    """Return the outputs of a page's run, shape (outputs, times)."""
    return np.array(found["outputs"], dtype=float)[: len(program.outputs)]


def here(program):
    return np.array([*program.signals.values()])


@nlctl.equation
def pendulum(x, v):
    x1, x2 = x
    return -9.81 * np.sin(x1) - 0.1 * x2 + 3.0 * v


def loop_with(actuator, **sampling):
    """A pendulum that a sampled law drives through an actuator."""
    law = ct.ss([], [], [], [[-4.0, -1.0]], 0.05, inputs=["x1", "x2"], outputs="u", name="law")
    return nlctl.interconnect(
        {
            "plant": nlctl.PureFeedback(order=2, f=pendulum, initial={"x1": 1.5}),
            "law": nlctl.sampled(law, **sampling),
            "actuator": actuator,
        }
    )


def ball():
    return nlctl.interconnect({"ball": Ball(g=2.0, e=0.5)})


def faulty():
    fault = nlctl.Fault("actuator.v", "gain", 0.4, at=nlctl.faults.NEVER)
    return nlctl.with_faults(nlctl.paper.example_1(), fault)


def test_powers_of_step_control_are_those_of_python_to_rounding():
    """x^y with a relative error of few ulp of 1 + |y ln x|; 0 and NaN as they should."""
    text = """
declare double @llvm.pow.f64(double, double)
define double @power(double %x, double %y) {
  %r = call double @llvm.pow.f64(double %x, double %y)
  ret double %r
}
"""
    code = finished(integrators_alike(text), ("power",))
    double = ctypes.c_double
    power = ctypes.CFUNCTYPE(double, double, double)(code.addresses["power"])
    for x in np.logspace(-12, 12, 301).tolist():
        for y in (-0.2, 0.04, 1 / 7, 0.7, 2.0):
            room = 4 * np.finfo(float).eps * (1 + abs(y * math.log(x)))
            assert abs(power(x, y) / x**y - 1) <= room, (x, y)
    assert (power(0.0, 0.2), power(0.0, -0.2)) == (0.0, math.inf)
    assert math.isnan(power(math.nan, 0.2))
    assert math.isnan(power(0.5, math.nan))


@pytest.mark.ci
def test_example_1_has_the_same_numbers_to_the_bit(in_node):
    program = web_program(nlctl.paper.example_1(), TIMES)
    (found,) = in_node(program)
    assert np.array_equal(samples(found, program), here(program))
    assert found["steps"] == int(program.run.lanes["accepted"][0])
    assert found["ends"] == ""


def coupled(t, x, u, params):
    """Seven masses whose matrix depends on where they are."""
    mass = np.cos(x[:7, None] - x[:7]) + 3.0 * np.eye(7)
    return np.concatenate([x[7:], np.linalg.solve(mass, np.sin(t) - x[:7] - x[7:])])


@pytest.mark.ci
def test_linear_equations_have_the_same_numbers_to_the_bit(in_node):
    plant = ct.nlsys(coupled, None, inputs=[], outputs=14, states=14, name="plant")
    program = web_program(nlctl.interconnect([plant], outputs=["y[0]", "y[3]"]), TIMES)
    (found,) = in_node(program)
    assert np.array_equal(samples(found, program), here(program))
    assert np.ptp(samples(found, program)) > 0.1


def pulses(t, x, u, params):
    return [np.where(t % 0.5 < 0.2, 1.0, 0.0) - x[0]]


@pytest.mark.ci
def test_a_loop_without_parameters_switches_when_it_must(in_node):
    """Its conditions of time alone are solved on the page, too."""
    lag = ct.nlsys(pulses, None, inputs=0, outputs=["x"], states=["x"], name="lag")
    program = web_program(ct.interconnect([lag], outputs=["x"]), TIMES)
    assert not program.parameters
    (found,) = in_node(program)
    np.testing.assert_allclose(samples(found, program), here(program), rtol=0, atol=1e-9)


@pytest.mark.ci
def test_it_is_the_run_of_the_engine_within_its_tolerance():
    needed("ziglang", "export")
    loop = nlctl.paper.example_1()
    program = web_program(loop, TIMES)
    response = nlctl.input_output_response(loop, TIMES, 0.0, method="tsit5")
    assert np.abs(here(program) - response.y).max() < 1e-6


@pytest.mark.ci
def test_integers_that_are_given_steer_functions_of_time_as_those_of_the_diagram():
    """n jumps of t, of which the diagram's own number is 1: the module of a diagram with n."""
    needed("ziglang", "export")

    def update(t, x, u, p):
        rate = -x[0]
        for k in range(p["n"]):
            rate = rate + (1.0 if t > p["T"] * (k + 1) else 0.0)
        return [rate]

    def program(n, **given):
        diagram = ct.nlsys(update, None, inputs=0, outputs=1, states=1, name="stairs",
                           params={"n": n, "T": 0.3})  # fmt: skip
        return web_program(diagram, np.linspace(0, 2, 21), **given)

    given, own = program(1, params={"n": 3}), program(3)
    assert given.facts == own.facts
    assert given.module == own.module


@pytest.mark.ci
def test_a_fault_that_is_switched_on_begins_when_it_is_said(in_node):
    loop, onset = faulty(), "fault_actuator_v.onset"
    program = web_program(loop, TIMES)
    place = list(program.parameters).index(onset)
    other = web_program(loop, TIMES, params={onset: 1.2345})
    healthy, found = in_node(program, {}, {"given": {"p": [[place, 1.2345]]}})
    assert np.array_equal(samples(found, program), here(other))
    assert np.array_equal(samples(healthy, program), here(program))
    assert any(abs(t - 1.2345) < 1e-12 for t in found["events"])


@pytest.mark.ci
def test_another_reference_is_the_run_that_is_made_with_it(in_node):
    loop = nlctl.paper.example_1()
    program, frequencies = web_program(loop, TIMES), [3.0, 0.5]
    other = web_program(loop, TIMES, params={"reference.frequencies": frequencies})
    place = list(program.parameters).index("reference.frequencies[0]")
    (found,) = in_node(program, {"given": {"p": [[place, 3.0]]}})
    assert np.array_equal(samples(found, program), here(other))


@pytest.mark.ci
def test_other_initial_states_and_tolerances(in_node):
    loop = nlctl.paper.example_1()
    program = web_program(loop, TIMES)
    other = web_program(loop, TIMES, initial_state={"plant.x1": 0.8}, rtol=1e-6, atol=1e-8)
    (found,) = in_node(program, {"given": {"x": [[0, 0.8]]}, "rtol": 1e-6})
    assert np.array_equal(samples(found, program), here(other))


LOOPS = {
    "exact backlash": lambda: loop_with(nlctl.Backlash()),
    "relay with hysteresis": lambda: loop_with(nlctl.Relay()),
    "play operators": lambda: loop_with(nlctl.actuators.PrandtlIshlinskii()),
    "resets": ball,
    "a stiff lag": lambda: loop_with(nlctl.Lag(T=1e-5)),
}


@pytest.mark.ci
@pytest.mark.parametrize("name", LOOPS)
def test_whatever_jumps_has_the_same_numbers_to_the_bit(in_node, name):
    times = np.linspace(0.0, 2.0, 201)
    program = web_program(LOOPS[name](), times)
    (found,) = in_node(program)
    assert np.array_equal(samples(found, program), here(program))
    response = nlctl.input_output_response(LOOPS[name](), times, 0.0)
    assert np.abs(here(program) - response.y).max() < 1e-5 * np.abs(response.y).max()
    if response.events is not None:
        assert len(found["events"]) == len(response.events)


def square(period):
    wave = sources.Square(outputs=("u",), period=period)
    return nlctl.interconnect({"source": wave, "lag": nlctl.Lag(T=0.1)})


@pytest.mark.ci
def test_switches_of_functions_of_time_are_found_again(in_node):
    program, other = web_program(square(0.7), TIMES), web_program(square(0.91), TIMES)
    place = list(program.parameters).index("source.period")
    as_it_is, found = in_node(program, {}, {"given": {"p": [[place, 0.91]]}})
    assert np.array_equal(samples(as_it_is, program), here(program))
    assert np.array_equal(samples(found, program), here(other))


def test_switches_that_are_too_close_for_a_page_are_refused():
    assert [each.name for each in moved(square(2.0), "source.period")] == ["source.period"]
    with pytest.raises(ParameterError, match=r"come every 0\.0025 s, too close together"):
        moved(square(0.005), "source.period")


@pytest.mark.weekly
@pytest.mark.parametrize("name", actuators.__all__)
def test_every_actuator_has_the_same_numbers_to_the_bit(in_node, name):
    made = getattr(actuators, name)
    record = made() if isinstance(made, type) else None
    if record is None or (len(record.inputs), len(record.outputs)) != (1, 1):
        pytest.skip("no block from one signal to one")
    loop = loop_with(nlctl.block(record, "actuator", inputs="u", outputs="v"))
    times = np.linspace(0.0, 1.0, 101)
    try:
        nlctl.input_output_response(loop, times, 0.0)
    except DivergedError:
        pytest.skip("not with this plant")
    program = web_program(loop, times)
    (found,) = in_node(program)
    assert np.array_equal(samples(found, program), here(program))


REFUSED = {
    "transport delays": lambda: nlctl.block(
        nlctl.TransportDelay(inputs=("x1",), outputs=("v",), delay=0.1), "law"
    ),
    "a function of it is called": lambda: ct.nlsys(
        None, halved, inputs="x1", outputs="v", name="law"
    ),
    "'erf', which JavaScript has not": lambda: ct.nlsys(
        None, error_function, inputs="x1", outputs="v", name="law"
    ),
}


def error_function(t, x, u, params):
    return [-math.erf(u[0])]


@pytest.mark.ci
@pytest.mark.parametrize("what", REFUSED)
def test_what_a_page_cannot_hold_is_refused_by_name(what):
    needed("ziglang", "export")
    plant = nlctl.PureFeedback(order=2, f=pendulum)
    loop = nlctl.interconnect([nlctl.block(plant, "plant"), REFUSED[what]()], name="loop")
    with pytest.raises(CompileError, match=f"'loop' cannot .*{re.escape(what)}"):
        web_program(loop, TIMES)


@pytest.mark.ci
def test_a_loop_that_diverges_as_it_stands_is_refused():
    needed("ziglang", "export")
    plant = nlctl.PureFeedback(order=1, f=escapes, initial={"x1": 1.0})
    loop = nlctl.interconnect(
        {"plant": plant, "law": ct.ss([], [], [], 1.0, inputs="x1", outputs="v")}
    )
    with pytest.raises(ParameterError, match="its run ends at t = 1"):
        web_program(loop, np.linspace(0.0, 2.0, 21))


@nlctl.equation
def escapes(x, v):
    return x[0] ** 2


def test_without_a_linker_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"pip install 'nlctl\[export\]'"):
        web_program(nlctl.paper.example_1(), TIMES)


def moved(loop, *names, until=20.0):
    compiled = nlctl.compile(loop)
    u = np.zeros((compiled.ninputs, 2))
    x0 = nlctl.initial_state(loop)
    return handles(compiled, names, compiled.parameter_vector(), x0, u, (0.0, until))


def test_names_stand_for_numbers_with_ranges_and_units():
    beta, first, x1, onset, value = moved(
        faulty(), "controller.law.beta", "reference.amplitudes[1]=0:3", "plant.x1(0)",
        "fault_actuator_v",
    )  # fmt: skip
    assert (beta.value, beta.high, beta.meaning) == (2.5, 5.0, "gain of the filtered error")
    assert beta.low > 0.0  # it has to be positive
    assert (first.low, first.high) == (0.0, 3.0)
    assert (x1.kind, x1.value) == ("x", 0.5)
    assert (onset.fault, onset.is_on, onset.high) == ("fault_actuator_v", False, 20.0)
    assert (value.name, value.value) == ("fault_actuator_v.value", 0.4)


def test_converters_of_a_sampled_law_can_be_moved():
    """They say to what values are rounded, and not when."""
    loop = loop_with(nlctl.Gain(), input_quantum=0.01)
    (handle,) = moved(loop, "law.sampling.input_quantum")
    assert (handle.value, handle.low, handle.high) == (0.01, 0.0, 0.02)


def test_a_gain_that_is_written_as_2_can_be_moved():
    """Between two integers as well; a number of passes cannot."""
    plant = ct.nlsys(
        lambda t, x, u, p: [-p["a"] * sum(x[0] for _ in range(p["n"]))], None,
        inputs=0, states=["x"], params={"a": 2, "n": 2}, name="plant",
    )  # fmt: skip
    lag = with_every_float(nlctl.compile(plant))
    given = lag.parameter_vector(), np.array([1.0]), np.zeros((0, 2)), (0.0, 1.0)
    (handle,) = handles(lag, ["plant.a"], *given)
    assert (handle.value, handle.low, handle.high) == (2.0, 0.0, 4.0)
    with pytest.raises(ParameterError, match="is an integer or a choice"):
        handles(lag, ["plant.n"], *given)


def test_bounds_have_all_their_digits():
    @nlctl.record
    class Bounded:
        inputs, outputs, states, feedthrough = ("u",), ("v",), (), True
        a: float = nlctl.param(0.3, unit="1", meaning="gain", at_least=0.2, at_most=0.123456789 * 3)

        @staticmethod
        @nlctl.equation
        def output(t, x, u, p):
            return (p.a * u[0],)

    (handle,) = moved(loop_with(Bounded()), "actuator.a")
    assert (handle.low, handle.high) == (0.2, 0.123456789 * 3)


def test_a_few_are_chosen_where_none_is_named():
    names = [handle.name for handle in moved(faulty())]
    assert names[0] == "fault_actuator_v.onset"
    assert "plant.x1(0)" in names
    assert 4 <= len(names) <= 8


NOT_MOVED = {
    "reference.amplitudes": "is not one number: name one, such as 'reference.amplitudes[0]'",
    "reference.order": "is an integer or a choice",
    "controller.law.beta=-1:1": "NussbaumLaw needs beta > 0",
    "controller.law.beta=1": "a range is LOW:HIGH",
    "controller.law.beta=2:1": "LOW < HIGH",
}


@pytest.mark.parametrize("name", NOT_MOVED)
def test_what_a_slider_cannot_move_is_refused_by_name(name):
    with pytest.raises(UsageError, match=re.escape(NOT_MOVED[name])):
        moved(nlctl.paper.example_1(), name)


def test_numbers_that_others_follow_from_are_refused():
    loop = nlctl.with_faults(
        nlctl.paper.example_1(), nlctl.Fault("actuator.v", "noise", 0.1, at=1.0)
    )
    with pytest.raises(ParameterError, match="other numbers of its block follow from it"):
        moved(loop, "fault_actuator_v.high")
    with pytest.raises(ParameterError, match="says when samples are taken"):
        moved(loop_with(nlctl.Gain()), "law.sampling.dt")
