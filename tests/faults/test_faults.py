"""Faults against closed forms: what becomes of a signal is known, and so is a lag behind it."""

import itertools
import pickle
from typing import Any

import cloudpickle
import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as some
from rows import each_row

import nlctl
from nlctl.errors import UsageError
from nlctl.faults.cut import signal_names
from nlctl.functions import noise_spectrum, noise_value

run: Any = nlctl.input_output_response
AT, UNTIL, END = 2.3, 4.1, 6.0
TIMES = np.linspace(0, END, 61)


@nlctl.record
class Wave:
    """s = 1 + sin 2t."""

    inputs, outputs, states, feedthrough = (), ("s",), (), False

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (1 + np.sin(2 * t),)


@nlctl.record
class Lag:
    """y' = s - y from 0."""

    inputs, outputs, states, feedthrough = ("s",), ("y",), ("y",), False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (u[0] - x[0],)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def loop():
    return nlctl.interconnect({"wave": Wave(), "lag": Lag()}, name="loop")


def healthy(t):
    return 1 + np.sin(2 * t)


def noise(t):
    omega, phase = noise_spectrum(0.0, 5.0, [3, 0], 32)
    return np.array([noise_value(x, 0.4, omega, phase) for x in np.atleast_1d(t)])


KINDS = {
    "stuck": (nlctl.Fault("wave.s", "stuck", at=AT), lambda t: healthy(AT) + 0 * t),
    "stuck at": (nlctl.Fault("wave.s", "stuck", -0.7, at=AT), lambda t: -0.7 + 0 * t),
    "bias": (nlctl.Fault("wave.s", "bias", 0.6, at=AT), lambda t: healthy(t) + 0.6),
    "drift": (nlctl.Fault("wave.s", "drift", 0.6, at=AT), lambda t: healthy(t) + 0.6 * (t - AT)),
    "gain": (nlctl.Fault("wave.s", "gain", 0.3, at=AT), lambda t: 0.3 * healthy(t)),
    "noise": (
        nlctl.Fault("wave.s", "noise", 0.4, at=AT, seed=3, high=5.0),
        lambda t: healthy(t) + noise(t),
    ),
    "dropout": (nlctl.Fault("wave.s", "dropout", at=AT, until=UNTIL), lambda t: 0 * t),
    "disconnection": (nlctl.Fault("wave.s", "disconnection", at=AT), lambda t: 0 * t),
}


def lagged(signal, breaks, end):
    """Return y(end) of y' = s - y by Gauss quadrature between the breaks of s."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    corners, total = [0.0, *sorted(b for b in breaks if b < end), end], 0.0
    for a, b in itertools.pairwise(corners):
        s = (a + b) / 2 + (b - a) / 2 * nodes
        total += (b - a) / 2 * weights @ (signal(s) * np.exp(s - end))
    return total


def faulty(kind, t, onset=AT):
    fault, formula = KINDS[kind]
    end = UNTIL if fault.until is not None else np.inf
    return np.where((t >= onset) & (t < end), formula(t), healthy(t))


@pytest.mark.parted
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_in_front_of_a_lag(kind):
    """The faulty signal at the samples, and y(end) to the tolerance, by machine code."""
    made = run(nlctl.with_faults(loop(), KINDS[kind][0]), TIMES, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(made.outputs[0], faulty(kind, TIMES), atol=1e-9)
    wanted = lagged(lambda t: faulty(kind, t), (AT, UNTIL), END)
    assert made.outputs[1, -1] == pytest.approx(wanted, abs=2e-9)
    assert made.statistics.events <= 2


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_in_python_control(kind):
    """By the reference engine; what is stuck was caught at the onset there as well."""
    diagram = nlctl.with_faults(loop(), KINDS[kind][0])
    made = run(diagram, TIMES, engine="python-control", rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(made.outputs[0], faulty(kind, TIMES), atol=1e-7)
    wanted = lagged(lambda t: faulty(kind, t), (AT, UNTIL), END)
    assert made.outputs[1, -1] == pytest.approx(wanted, abs=1e-7)


EXAMPLES = {"example-1": nlctl.paper.example_1, "example-2": nlctl.paper.example_2}


@pytest.mark.parted
@pytest.mark.parametrize("example", EXAMPLES)
@pytest.mark.parametrize("signal", ["actuator.v", "plant.x1", "controller.x1", "controller.law.u"])
def test_a_fault_that_does_not_begin_changes_no_bit(example, signal):
    """Of the right-hand side in python-control, for every kind at once; nor does the copy."""
    plain = EXAMPLES[example]()
    faults = [
        nlctl.Fault(signal, f.kind, f.value, at=50.0, until=f.until and 60.0)
        for f, _ in KINDS.values()
    ]
    diagram = nlctl.with_faults(plain, *faults)
    names = nlctl.state_names(diagram)
    same = [names.index(name) for name in nlctl.state_names(plain)]
    rng = np.random.default_rng(1)
    x = nlctl.initial_state(plain)
    for t in (0.0, 0.7, 12.3):
        x = x + 0.1 * rng.normal(size=x.size)
        with_memory = nlctl.initial_state(diagram)
        with_memory[same] = x
        np.testing.assert_array_equal(
            diagram.dynamics(t, with_memory, [])[same], plain.dynamics(t, x, [])
        )
        np.testing.assert_array_equal(diagram.output(t, with_memory, []), plain.output(t, x, []))


@pytest.mark.ci
@each_row(
    "example, kind, more",
    [
        ("example-1", "bias", {"value": 0.5}),
        ("example-1", "stuck", {}),
        ("example-1", "gain", {"value": 0.5, "when": "|e| > 99"}),
        ("example-2", "drift", {"value": 0.5}),
        ("example-2", "disconnection", {}),
    ],
)
def test_a_run_of_an_example_without_its_fault_is_the_same_to_the_bit(example, kind, more):
    """In machine code, by one method: the default takes another one where there is no memory."""
    plain, times = EXAMPLES[example](), np.linspace(0, 20, 201)
    diagram = nlctl.with_faults(plain, nlctl.Fault("actuator.v", kind, at=99.0, **more))
    one, other = (run(each, times, method="tsit5") for each in (plain, diagram))
    np.testing.assert_array_equal(one.outputs, other.outputs)
    assert one.statistics == other.statistics


def test_the_given_diagram_stays_as_it_is():
    """Neither its wires nor its blocks are shared: each is run with parameters of its own."""
    plain = nlctl.paper.example_1()
    before = pickle.dumps([plain.connect_map, plain.input_map, plain.output_map])
    x = nlctl.initial_state(plain)
    rates = plain.dynamics(1.0, x, [])
    diagram = nlctl.with_faults(plain, nlctl.Fault("controller.law.u", "gain", 0.0, at=0.0))
    diagram.dynamics(1.0, nlctl.initial_state(diagram), [], params={"actuator.b_r": 0.01})
    assert pickle.dumps([plain.connect_map, plain.input_map, plain.output_map]) == before
    np.testing.assert_array_equal(plain.dynamics(1.0, x, []), rates)
    shared = {id(p.system) for p in nlctl.diagrams.leaves(plain)}
    assert not shared & {id(p.system) for p in nlctl.diagrams.leaves(diagram)}


def test_an_output_is_cut_for_all_readers_and_an_input_for_one():
    """The plant's x1 is also an output of the loop; what the controller reads is not."""
    plain, times = nlctl.paper.example_1(), np.linspace(0, 3, 4)
    x1 = plain.output_index["x1"]
    for signal, seen in (("plant.x1", [0.0, 0.0]), ("controller.x1", None)):
        diagram = nlctl.with_faults(plain, nlctl.Fault(signal, "disconnection", at=1.5))
        made = run(diagram, times)
        assert (made.outputs[x1, 2:] == 0).all() == (seen is not None)
        assert made.outputs[x1, 1] == run(plain, times).outputs[x1, 1]


def test_an_external_input_and_faults_in_series():
    """y = 2 (u + 1), once both have begun: first the bias, then the gain; a fan-out as well."""
    blocks = {"lag": Lag(), "same": nlctl.Gain()}
    system = ct.interconnect(
        [nlctl.block(b, n) for n, b in blocks.items()],
        inplist=[["lag.s", "same.u"]],
        inputs=["w"],
        outlist=["lag.y", "same.v", "same.u"],
        outputs=["y", "v", "u"],
    )
    faults = (nlctl.Fault("w", "bias", 1.0, at=1.0), nlctl.Fault("w", "gain", 2.0, at=2.5))
    times = np.linspace(0, 4, 5)
    made = run(nlctl.with_faults(system, *faults), times, 3.0, rtol=1e-9, atol=1e-11)
    np.testing.assert_array_equal(made.outputs[1], [3.0, 4.0, 4.0, 8.0, 8.0])
    np.testing.assert_array_equal(made.outputs[2], made.outputs[1])
    steps = 3.0 * (1 - np.exp(-4)) + (1 - np.exp(-3)) + 4 * (1 - np.exp(-1.5))
    assert made.outputs[0, -1] == pytest.approx(steps, abs=1e-8)


class TestOnsets:
    """The onset is an event, wherever it lies."""

    @pytest.mark.parametrize("kind", ["stuck", "gain"])
    def test_an_ensemble_of_onsets(self, kind):
        """Hundreds of phases against the steps, one compiled diagram: y(end) in closed form."""
        compiled = nlctl.compile(nlctl.with_faults(loop(), KINDS[kind][0]))
        onsets = np.linspace(0, 5.9, 96)
        name = "fault_wave_s.onset"
        made = nlctl.ensemble_response(
            compiled, TIMES, params={name: onsets}, keep=["s", "y"], rtol=1e-9, atol=1e-11
        )
        for onset, s, y in zip(onsets, made.signals["s"], made.signals["y"], strict=True):
            value = healthy(onset)

            def signal(t, at=onset, value=value):
                after = value if kind == "stuck" else 0.3 * healthy(t)
                return np.where(t >= at, after, healthy(t))

            assert y[-1] == pytest.approx(lagged(signal, [onset], END), abs=1e-8)
            far = abs(TIMES - onset) > 1e-9  # at the onset itself rounding decides
            np.testing.assert_allclose(s[far], signal(TIMES)[far], atol=1e-8)

    @given(some.integers(0, 10_000), some.floats(0.1, 10.0))
    @settings(max_examples=many(20, part=4))
    def test_a_random_onset_follows_from_its_seed(self, seed, mean):
        """The same each time, and proportional to the mean; other seeds give others."""
        one = nlctl.Fault("a", "bias", 1.0, mean_time=mean, seed=seed)
        other = nlctl.Fault("a", "bias", 1.0, mean_time=2 * mean, seed=seed)
        assert one.onset * 2 == pytest.approx(other.onset, rel=1e-15)
        assert one.onset != nlctl.Fault("a", "bias", 1.0, mean_time=mean, seed=seed + 1).onset

    def test_random_onsets_have_the_mean_of_their_law(self):
        """4000 seeds, within four standard errors."""
        onsets = [nlctl.Fault("a", "bias", 1.0, mean_time=3.0, seed=s).onset for s in range(4000)]
        assert np.mean(onsets) == pytest.approx(3.0, abs=4 * 3.0 / np.sqrt(4000))


class TestConditions:
    """A condition latches: the fault stays when it is no longer met."""

    @pytest.mark.parted
    @pytest.mark.slow
    @each_row(
        "when, begins",
        [
            ("s > 1.5", np.arcsin(0.5) / 2),
            ("wave.s >= 1.5", np.arcsin(0.5) / 2),
            ("s < 0.25", (np.pi + np.arcsin(0.75)) / 2),
            ("|s| > 1.5", np.arcsin(0.5) / 2),
            ("|s| < 0.25", (np.pi + np.arcsin(0.75)) / 2),
            ("s > 0.5", 0.0),
        ],
    )
    @pytest.mark.parametrize("kind", ["bias", "drift", "stuck", "dropout for good"])
    def test_it_begins_when_the_condition_is_met(self, when, begins, kind):
        """At the time at which the wave reaches the level; y(end) in closed form."""
        made_of = {"bias": ("bias", 0.6), "drift": ("drift", 0.6), "stuck": ("stuck", None)}
        fault = nlctl.Fault("lag.s", *made_of.get(kind, ("disconnection", None)), when=when)
        made = run(nlctl.with_faults(loop(), fault), TIMES, rtol=1e-10, atol=1e-12)

        def signal(t):
            after = {
                "bias": healthy(t) + 0.6,
                "drift": healthy(t) + 0.6 * (t - begins),
                "stuck": healthy(begins) + 0 * t,
            }.get(kind, 0 * t)
            return np.where(t >= begins, after, healthy(t))

        assert made.outputs[1, -1] == pytest.approx(lagged(signal, [begins], END), abs=1e-8)

    def test_python_control_latches_as_well(self):
        """At the same instant, where the signal passes the level."""
        fault = nlctl.Fault("lag.s", "disconnection", when="s > 1.9")
        diagram = nlctl.with_faults(loop(), fault)
        ours, theirs = (
            run(diagram, TIMES, engine=engine, rtol=1e-10, atol=1e-12)
            for engine in ("native", "python-control")
        )
        np.testing.assert_allclose(theirs.outputs[1], ours.outputs[1], atol=1e-7)
        assert ours.outputs[1, -1] < 0.01

    def test_a_condition_on_the_signal_that_becomes_stuck(self):
        """No loop without a state: y stays where it passed 0.8, for all who read it."""
        fault = nlctl.Fault("lag.y", "stuck", when="y > 0.8")
        made = run(nlctl.with_faults(loop(), fault), TIMES, rtol=1e-10, atol=1e-12)
        assert made.outputs[1, -1] == pytest.approx(0.8, abs=1e-7)
        assert made.outputs[1].max() == pytest.approx(0.8, abs=1e-7)

    def test_an_onset_holds_a_condition_back(self):
        """Met at 0.26 s, the fault begins at 3 s."""
        fault = nlctl.Fault("lag.s", "disconnection", when="s > 1.5", at=3.0)
        made = run(nlctl.with_faults(loop(), fault), TIMES, rtol=1e-10, atol=1e-12)
        wanted = lagged(lambda t: np.where(t >= 3.0, 0.0, healthy(t)), [3.0], END)
        assert made.outputs[1, -1] == pytest.approx(wanted, abs=1e-8)


class TestTwo:
    """Faults on several signals."""

    def test_two_at_once(self):
        """A bias in front of the lag, and later a lock of what comes out."""
        faults = (nlctl.Fault("lag.s", "bias", 0.6, at=AT), nlctl.Fault("lag.y", "stuck", at=UNTIL))
        made = run(nlctl.with_faults(loop(), *faults), TIMES, rtol=1e-10, atol=1e-12)
        wanted = lagged(lambda t: np.where(t >= AT, healthy(t) + 0.6, healthy(t)), [AT], UNTIL)
        np.testing.assert_allclose(made.outputs[1, TIMES > UNTIL], wanted, atol=1e-9)
        np.testing.assert_allclose(
            made.outputs[0], healthy(TIMES), atol=1e-15
        )  # only the lag's input is cut

    def test_one_after_the_other_is_both_at_once(self):
        """with_faults of with_faults makes the same signals."""
        one, two = nlctl.Fault("lag.s", "bias", 0.6, at=AT), KINDS["gain"][0]
        both = run(nlctl.with_faults(loop(), one, two), TIMES)
        nested = run(nlctl.with_faults(nlctl.with_faults(loop(), one), two), TIMES)
        np.testing.assert_array_equal(both.outputs, nested.outputs)


def test_a_diagram_with_faults_pickles():
    """As a diagram and compiled, also where its memory is a condition's."""
    fault = nlctl.Fault("controller.x2", "stuck", when="|e| > 0.1", at=4.0, name="sensor")
    diagram = nlctl.with_faults(nlctl.paper.example_1(), fault)
    compiled, times = nlctl.compile(diagram), np.linspace(0, 5, 51)
    made = run(compiled, times)
    for again in (
        cloudpickle.loads(cloudpickle.dumps(diagram)),
        pickle.loads(pickle.dumps(compiled)),
    ):
        np.testing.assert_array_equal(run(again, times).outputs, made.outputs)
    assert pickle.loads(pickle.dumps(fault)) == fault


def test_parameters_are_addressed_like_all_others():
    """On the outside, in a nested diagram, and a diagram's own values are kept."""
    plain = nlctl.paper.example_1()
    plain.params["actuator.b_r"] = 0.6
    faults = (
        nlctl.Fault("actuator.v", "bias", 1.0, at=2.0, until=5.0),
        nlctl.Fault("controller.law.u", "gain", 0.5, at=2.0, name="weak"),
    )
    diagram = nlctl.with_faults(plain, *faults)
    table = nlctl.parameters(diagram)["value"]
    assert table["fault_actuator_v.onset"] == 2.0
    assert table["fault_actuator_v.duration"] == 3.0
    assert table["controller.weak.value"] == 0.5
    assert diagram.params["actuator.b_r"] == 0.6
    assert set(nlctl.state_names(plain)) == set(nlctl.state_names(diagram))


def test_a_fault_in_discrete_time():
    """x[k+1] = x/2 + u with u = 1 up to sample 4 and 0 from sample 5 on."""
    half = ct.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1, name="half", inputs="u", outputs="y")
    diagram = nlctl.interconnect([half], inputs=["u"], name="sampled")
    fault = nlctl.Fault("half.u", "disconnection", at=0.45)
    times = 0.1 * np.arange(8)
    made = run(nlctl.with_faults(diagram, fault), times, 1.0)
    np.testing.assert_allclose(made.outputs, [0, 1, 1.5, 1.75, 1.875, 1.9375, 0.96875, 0.484375])
    with pytest.raises(
        nlctl.errors.ParameterError, match=r"continuous time, 'sampled' has dt = 0\.1"
    ):
        nlctl.with_faults(diagram, nlctl.Fault("half.u", "stuck", at=0.45))


class TestDelay:
    """The signal as it was: v(t - tau) of a wave that is known."""

    @staticmethod
    def wave():
        def rising(t, x, u, p):
            return [np.sin(3 * t) + 2.0]

        source = ct.nlsys(None, rising, inputs=0, outputs=["u"], name="source")
        return nlctl.interconnect({"source": source, "a": nlctl.Gain()}, outputs=["v"])

    @pytest.mark.parted
    @pytest.mark.parametrize("engine", ["native", "python-control"])
    @pytest.mark.parametrize("signal", ["source.u", "a.u"])
    def test_it_is_the_signal_of_before_while_it_lasts(self, signal, engine):
        """In both engines; behind the output for all that read it, at an input for one."""
        fault = nlctl.Fault(signal, "delay", 0.3, at=1.0, until=2.0)
        loop = nlctl.with_faults(self.wave(), fault)
        t = np.array([0.0, 0.5, 0.99, 1.01, 1.5, 1.99, 2.01, 3.0])
        made = nlctl.input_output_response(loop, t, engine=engine, rtol=1e-8)
        late = (t >= 1.0) & (t < 2.0)
        wanted = np.sin(3 * (t - np.where(late, 0.3, 0.0))) + 2.0
        np.testing.assert_allclose(made.outputs[0], wanted, atol=1e-7)

    def test_its_time_is_a_parameter(self):
        """An ensemble of delays of one diagram, that was compiled once."""
        fault = nlctl.Fault("source.u", "delay", 0.3, at=1.0)
        loop = nlctl.compile(nlctl.with_faults(self.wave(), fault))
        tau = np.array([0.1, 0.2, 0.5])
        made = nlctl.ensemble_response(
            loop, [0.0, 1.5], params={"fault_source_u_line.delay": tau}, keep=["v"]
        )
        wanted = np.sin(3 * (1.5 - tau)) + 2.0
        np.testing.assert_allclose(made.signals["v"][:, -1], wanted, atol=1e-7)

    def test_a_condition_begins_it(self):
        """When sin(3 t) + 2 first passes 2.5."""
        fault = nlctl.Fault("a.u", "delay", 0.1, when="source.u > 2.5")
        t = np.array([0.0, 0.15, 0.2, 1.0])
        made = nlctl.input_output_response(nlctl.with_faults(self.wave(), fault), t)
        wanted = np.sin(3 * (t - np.where(t > np.arcsin(0.5) / 3, 0.1, 0.0))) + 2.0
        np.testing.assert_allclose(made.outputs[0], wanted, atol=1e-7)


def test_a_condition_is_seen_that_is_met_within_one_step():
    """A peak that passes the level by a thousandth, where nothing else limits the steps."""
    fault = nlctl.Fault("a.u", "bias", 10.0, when="source.u > 2.999")
    made = nlctl.input_output_response(nlctl.with_faults(TestDelay.wave(), fault), [0.0, 0.4, 9.0])
    np.testing.assert_allclose(made.outputs[0, 1:], np.sin([1.2, 27.0]) + [2.0, 12.0], atol=1e-7)


def test_nan_travels_through_every_kind():
    """A signal that is lost in NaN does not look calm behind a fault."""
    for fault, _ in KINDS.values():
        made = nlctl.block(fault.effect, "effect")
        assert np.isnan(made.output(3.0, np.zeros(made.nstates), [np.nan], params={})).all()


@each_row(
    "arguments, more, message",
    [
        (("v", "biased", 1.0), {"at": 1}, "unknown kind of fault 'biased' on 'v'; nearest: 'bias'"),
        (("v", "delay", 0.0), {"at": 1}, "needs a finite value > 0, got 0.0"),
        (("v", "delay"), {"at": 1}, "needs a value, its time in s, got none"),
        (("v", "bias"), {"at": 1}, "needs a value, its offset, got none"),
        (("v", "bias", "much"), {"at": 1}, "a number for value, got 'much'"),
        (("v", "bias", np.nan), {"at": 1}, "a finite value"),
        (("v", "noise", -1.0), {"at": 1}, "value >= 0, got -1"),
        (("v", "noise", 1.0), {"at": 1, "low": 9.0, "high": 2.0}, "low < high, got 9 and 2"),
        (("v", "disconnection", 1.0), {"at": 1}, "takes no value"),
        (("v", "disconnection"), {"at": 1, "until": 2}, "takes no until=.*'dropout'"),
        (("v", "dropout"), {"at": 1}, "needs until=.*'disconnection'"),
        (("v", "bias", 1.0), {}, "needs a time at=, a condition when= or a mean_time="),
        (("v", "bias", 1.0), {"at": 1, "mean_time": 2}, "needs one of"),
        (("v", "bias", 1.0), {"at": -1}, "at >= 0, got -1"),
        (("v", "bias", 1.0), {"at": 3, "until": 2}, "until > at, got 2 s and 3 s"),
        (("v", "bias", 1.0), {"when": "y > 1", "until": 2}, "needs at= for the time until="),
        (("v", "bias", 1.0), {"mean_time": 0}, "mean_time > 0, got 0"),
        (("v", "bias", 1.0), {"at": 1, "seed": 0.5}, "seed >= 0, got 0.5"),
        (("v", "bias", 1.0), {"when": "|e > 1"}, "a condition such as when='.e. > 0.5'"),
        (("v", "bias", 1.0), {"when": "e"}, "a condition such as when='.e. > 0.5'"),
        (("", "bias", 1.0), {"at": 1}, "needs a name for signal"),
    ],
)
def test_a_bad_fault_is_refused_in_one_sentence(arguments, more, message):
    """Where it is made, before any diagram is."""
    with pytest.raises(UsageError, match=message):
        nlctl.Fault(*arguments, **more)


@each_row(
    "signal, when, message",
    [
        ("wave.z", None, "unknown signal 'wave.z'; nearest: 'wave.s'"),
        ("lagg.y", None, "unknown signal 'lagg.y'; nearest: 'lag.y'"),
        ("lag.y", "q > 1", "unknown signal 'q'.*sees the signals of the diagram"),
    ],
)
def test_a_fault_on_an_unknown_signal_names_the_nearest(signal, when, message):
    """And so does a condition."""
    at = None if when else 1.0
    with pytest.raises(nlctl.errors.UnknownNameError, match=message):
        nlctl.with_faults(loop(), nlctl.Fault(signal, "bias", 1.0, at=at, when=when))


def test_what_is_no_diagram_or_no_fault_is_refused():
    """A block, and a tuple."""
    with pytest.raises(nlctl.errors.DiagramError, match="needs a diagram, got the block 'lag'"):
        nlctl.with_faults(nlctl.block(Lag(), "lag"), KINDS["bias"][0])
    with pytest.raises(nlctl.errors.ParameterError, match="needs faults"):
        nlctl.with_faults(loop(), ("wave.s", "bias"))
    with pytest.raises(
        nlctl.errors.AmbiguousNameError, match=r"controller\.law\.u or controller\.u"
    ):
        nlctl.with_faults(nlctl.paper.example_1(), nlctl.Fault("u", "bias", 1.0, at=1.0))


def test_every_signal_can_have_a_fault():
    """Names of the table, one after the other, on a loop with nested diagrams."""
    plain = nlctl.paper.example_1()
    names = signal_names(plain)
    assert {"actuator.v", "actuator.u", "controller.law.u", "controller.x1"} <= set(names)
    for name in names:
        diagram = nlctl.with_faults(plain, nlctl.Fault(name, "bias", 1.0, at=9.0))
        x = nlctl.initial_state(plain)
        np.testing.assert_array_equal(diagram.dynamics(0.5, x, []), plain.dynamics(0.5, x, []))
