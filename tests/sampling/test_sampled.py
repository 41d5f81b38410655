"""Sampled blocks beside continuous ones: closed forms, and python-control from sample to sample."""

import pickle

import control as ct
import numpy as np
import pytest
from rows import each_row

import nlctl
from nlctl import Clock
from nlctl.errors import AlgebraicLoopError, AuditError, DivergedError, ParameterError, UsageError
from nlctl.native.equations.reader import Reader
from nlctl.params import declared_params
from nlctl.sampling.clock import common_period
from nlctl.sampling.system import happening

T = np.arange(0, 2.001, 0.05)
PLANT = ct.ss([[0, 1], [-2, -3]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y", name="plant")
FIRST = ct.ss([[0.5]], [[1.0]], [[0.3]], [[-1.0]], 0.1, inputs="y", outputs="u", name="law")


def closed(*blocks, inputs=(), outputs=("y", "u")):
    return ct.interconnect([PLANT, *blocks], inputs=list(inputs), outputs=list(outputs), inplist=[])


def start(loop, **values):
    return nlctl.initial_state(loop, {"plant.x[0]": 1.0, **values})


def function(name, formula, inputs, outputs, dt=0.1, states=None, update=None):
    return ct.nlsys(
        update, lambda t, x, u, params: formula(t, x, u), inputs=inputs, outputs=outputs,
        states=states, dt=dt, name=name,
    )  # fmt: skip


def two_rates():
    slow = function("slow", lambda t, x, u: [x[0] - 0.2 * u[0]], ["y"], ["s"], 0.3, ["i"],
                    lambda t, x, u, params: [x[0] - 0.1 * u[0]])  # fmt: skip
    fast = function("fast", lambda t, x, u: [u[0] - 0.5 * u[1] + np.sin(t)], ["s", "y"], ["u"], 0.1)
    return closed(nlctl.sampled(fast), nlctl.sampled(slow, offset=0.1))


LOOPS = {
    "as it stands": lambda: closed(nlctl.sampled(FIRST)),
    "an offset": lambda: closed(nlctl.sampled(FIRST, offset=0.04)),
    "a delay": lambda: closed(nlctl.sampled(FIRST, delay=0.03)),
    "a delay of one sample": lambda: closed(nlctl.sampled(FIRST, delay=0.1)),
    "a delay of two and a half": lambda: closed(nlctl.sampled(FIRST, delay=0.25)),
    "jitter": lambda: closed(nlctl.sampled(FIRST, jitter=0.05, delay=0.02, seed=3)),
    "quanta": lambda: closed(nlctl.sampled(FIRST, input_quantum=0.1, output_quantum=0.05)),
    "two rates": two_rates,
}


@pytest.mark.slow
@pytest.mark.parametrize("make", LOOPS.values(), ids=LOOPS)
def test_machine_code_is_python_control_from_sample_to_sample(make):
    """All signals, at samples and between them; quanta leave no room for rounding to move them."""
    loop = make()
    settings = {"rtol": 1e-10, "atol": 1e-12}
    theirs = nlctl.input_output_response(
        loop, T, 0, start(loop), engine="python-control", **settings
    )
    ours = nlctl.input_output_response(loop, T, 0, start(loop), engine="native", **settings)
    np.testing.assert_allclose(ours.outputs, theirs.outputs, atol=2e-9)
    np.testing.assert_allclose(ours.states, theirs.states, atol=2e-9)


def test_a_linear_plant_is_its_zero_order_hold_at_the_samples():
    loop, exact = closed(nlctl.sampled(FIRST)), ct.sample_system(PLANT, 0.1)
    A = np.block([[exact.A + exact.B @ FIRST.D @ exact.C, exact.B @ FIRST.C],
                  [FIRST.B @ exact.C, FIRST.A]])  # fmt: skip
    x, expected = np.array([1.0, 0.0, 0.0]), []
    for _ in range(21):
        expected.append(x[0])
        x = A @ x
    run = nlctl.input_output_response(loop, T, 0, start(loop), rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(run.outputs[0, ::2], expected, atol=1e-12)


def staircase(**settings):
    """A clock's time through a sampled block: what it shows, and when."""
    clock = function("clock", lambda t, x, u: [t], [], ["now"], None)
    taken = function("taken", lambda t, x, u: [u[0]], ["now"], ["seen"])
    return ct.interconnect(
        [clock, nlctl.sampled(taken, **settings)], outputs=["seen"], inputs=[], inplist=[]
    )


@each_row("given", [{}, {"delay": 0.04}, {"delay": 0.1}, {"delay": 0.27}, {"offset": 0.03}])
def test_a_ramp_becomes_the_staircase_of_its_samples(given):
    """Output at t: the time of the last sample that is `delay` old at least."""
    delay, offset = given.get("delay", 0.0), given.get("offset", 0.0)
    times = np.arange(0, 1, 0.01) + 0.005
    run = nlctl.input_output_response(staircase(**given), np.r_[0, times], 0)
    k = np.floor((times - delay - offset) / 0.1 + 1e-9)
    np.testing.assert_allclose(
        run.outputs[0, 1:], np.where(k < 0, 0.0, offset + 0.1 * k), atol=1e-14
    )


def test_quanta_round_to_the_nearest_multiple():
    times = np.arange(0, 1, 0.1) + 0.05
    run = nlctl.input_output_response(staircase(output_quantum=0.25), np.r_[0, times], 0)
    np.testing.assert_allclose(run.outputs[0, 1:], 0.25 * np.round(np.arange(10) / 2.5), atol=1e-14)


def test_blocks_that_sample_at_one_instant_see_each_others_new_outputs():
    """In the order of the signal flow, not of the list; one that samples later sees them too."""
    clock = function("clock", lambda t, x, u: [t], [], ["now"], None)
    parts = [
        nlctl.sampled(function("third", lambda t, x, u: [u[0] + 1], ["b"], ["c"], 0.2)),
        nlctl.sampled(function("second", lambda t, x, u: [u[0] + 1], ["a"], ["b"], 0.1)),
        nlctl.sampled(function("first", lambda t, x, u: [u[0]], ["now"], ["a"], 0.1)),
    ]
    loop = ct.interconnect([*parts, clock], inputs=[], outputs=["a", "b", "c"], inplist=[])
    times = np.array([0.0, 0.15, 0.25, 0.35])
    for engine in ("native", "python-control"):
        run = nlctl.input_output_response(loop, times, 0, engine=engine)
        np.testing.assert_allclose(run.outputs[0], [0, 0.1, 0.2, 0.3], atol=1e-14)
        np.testing.assert_allclose(run.outputs[1], [1, 1.1, 1.2, 1.3], atol=1e-14)
        np.testing.assert_allclose(run.outputs[2], [2, 2, 2.2, 2.2], atol=1e-14)


def test_outputs_that_need_each_other_at_one_instant_are_printed():
    """With a delay in one of them there is no loop."""

    def ring(**settings):
        one = function("one", lambda t, x, u: [0.5 * u[0]], ["b"], ["a"])
        two = function("two", lambda t, x, u: [u[0] + 1], ["a"], ["b"])
        blocks = [nlctl.sampled(one), nlctl.sampled(two, **settings)]
        return ct.interconnect(blocks, inputs=[], outputs=["a", "b"], inplist=[])

    with pytest.raises(AlgebraicLoopError, match=r"one\.a.*two\.b|two\.b.*one\.a"):
        nlctl.compile(ring())
    run = nlctl.input_output_response(ring(delay=0.1), np.linspace(0, 3, 31), 0)
    np.testing.assert_allclose(run.outputs[1, -1], 2.0, atol=1e-3)  # b = b / 2 + 1


@pytest.mark.parametrize("name", [name for name in LOOPS if name not in ("an offset", "jitter")])
def test_a_run_that_resumes_at_a_sample_is_the_whole_one_to_the_bit(name):
    """The first run leaves what happens then to the second; no step remembers those before it."""
    loop = nlctl.compile(LOOPS[name]())
    x0 = start(loop.system)
    whole = nlctl.input_output_response(loop, T, 0, x0)
    first = nlctl.input_output_response(loop, T[:21], 0, x0)
    second = nlctl.input_output_response(loop, T[20:], 0, first.states[:, -1])
    np.testing.assert_array_equal(second.states, whole.states[:, 20:])


@pytest.mark.parametrize("example", nlctl.paper.EXAMPLES)
def test_both_examples_resume_to_the_bit(example):
    """Through the corners of the dead zone, and with the memory of the backlash."""
    build = nlctl.paper.EXAMPLES[example]
    parts = build()
    controller = parts.syslist[parts.syslist_index["controller"]]
    program = nlctl.sampled(controller, 0.01, method="euler")
    loop = nlctl.compile(build(controller=program))
    times = np.arange(0, 4001, 5) / 1000
    whole = nlctl.input_output_response(loop, times)
    first = nlctl.input_output_response(loop, times[:501])
    second = nlctl.input_output_response(loop, times[500:], 0, first.states[:, -1])
    np.testing.assert_array_equal(second.states, whole.states[:, 500:])


def test_a_run_that_resumes_between_samples_is_the_whole_one_to_the_tolerance():
    """A step ends there that would not."""
    for make in LOOPS.values():
        loop = nlctl.compile(make())
        settings = {"rtol": 1e-11, "atol": 1e-13}
        whole = nlctl.input_output_response(loop, T, 0, start(loop.system), **settings)
        first = nlctl.input_output_response(loop, T[:22], 0, start(loop.system), **settings)
        second = nlctl.input_output_response(loop, T[21:], 0, first.states[:, -1], **settings)
        np.testing.assert_allclose(second.states, whole.states[:, 21:], atol=1e-9)


def test_members_are_the_single_runs_in_any_company():
    loop = nlctl.compile(nlctl.paper.example_1(controller=on_a_computer(0.01)))
    betas = np.linspace(2.0, 3.0, 11)
    times = np.linspace(0, 2, 41)
    made = {
        threads: nlctl.ensemble_response(
            loop, times, params={"law.beta": betas}, keep=["y", "u"], threads=threads
        )
        for threads in (1, 2)
    }
    for signal in ("y", "u"):
        np.testing.assert_array_equal(made[1].signals[signal], made[2].signals[signal])
    few = nlctl.ensemble_response(loop, times, params={"law.beta": betas[3:5]}, keep=["y"])
    np.testing.assert_array_equal(few.signals["y"], made[1].signals["y"][3:5])
    run = nlctl.input_output_response(
        loop, times, params={"law.beta": betas[7]}, rtol=1e-6, atol=1e-8
    )
    y = run.outputs[loop.system.output_index["y"]]
    np.testing.assert_allclose(made[1].signals["y"][7], y, atol=1e-5)


def on_a_computer(dt, **settings):
    return nlctl.sampled(nlctl.adaptive_neural(2), dt, method="euler", **settings)


def test_the_papers_controller_on_a_computer_is_the_papers_as_it_gets_faster():
    """Euler's method and the hold have order 1."""
    times = np.linspace(0, 2, 101)
    exact = nlctl.input_output_response(nlctl.paper.example_1(), times, rtol=1e-10).outputs[0]
    errors = []
    for dt in (0.004, 0.002, 0.001):
        loop = nlctl.paper.example_1(controller=on_a_computer(dt))
        run = nlctl.input_output_response(loop, times, rtol=1e-10)
        errors.append(np.abs(run.outputs[loop.output_index["y"]] - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 1) < 0.25), (errors, orders)


@pytest.mark.slow
def test_parameters_keep_their_names():
    loop = nlctl.paper.example_1(controller=on_a_computer(0.01, delay=0.004, input_quantum=1e-3))
    known = list(nlctl.parameters(nlctl.paper.example_1()).index)
    assert set(nlctl.parameters(loop).index) - set(known) == {
        f"controller.sampling.{field}" for field in declared_params(nlctl.sampling.Sampling)
    }
    assert set(known) <= set(nlctl.parameters(loop).index)
    times = np.linspace(0, 0.25, 6)
    runs = [
        nlctl.input_output_response(loop, times, params={"law.beta": 4.0}, engine=engine).outputs
        for engine in ("native", "python-control")
    ]
    np.testing.assert_allclose(*runs, atol=1e-5)
    plain = nlctl.input_output_response(loop, times).outputs
    assert np.abs(runs[0] - plain).max() > 1e-3


def test_python_control_does_not_integrate_over_samples():
    loop = closed(nlctl.sampled(FIRST))
    for call in (
        lambda: ct.input_output_response(loop, T, 0, [1, 0]),
        lambda: ct.linearize(loop, [0, 0, 0, 0], []),
        lambda: loop.dynamics(0, start(loop), []),
    ):
        with pytest.raises(UsageError, match=r"block 'law' is sampled every 0\.1 s.*nlctl\.input"):
            call()
    with happening():  # and between samples its states stand still
        np.testing.assert_array_equal(loop.dynamics(0, [1, 2, 3, 4], []), [2, -4, 0, 0])


def test_a_run_that_leaves_the_finite_numbers_says_so():
    lost = function("lost", lambda t, x, u: [np.where(t > 0.45, np.nan, -u[0])], ["y"], ["u"])
    with pytest.raises(DivergedError) as raised:
        nlctl.input_output_response(closed(nlctl.sampled(lost)), T, 0, [1, 0, 0])
    assert raised.value.time == pytest.approx(0.5)


def test_the_audit_finds_a_wrong_sample(monkeypatch):
    right = Reader.next_states
    monkeypatch.setattr(Reader, "next_states", lambda self, i: right(self, i) * (1 + 1e-6))
    loop = nlctl.compile(closed(nlctl.sampled(FIRST)))
    with pytest.raises(AuditError, match="law_"):
        nlctl.input_output_response(loop, T, 0, start(loop.system))


def test_a_compiled_one_goes_through_pickle():
    loop = nlctl.compile(two_rates())
    again = pickle.loads(pickle.dumps(loop))
    runs = [nlctl.input_output_response(x, T, 0, start(loop.system)).states for x in (loop, again)]
    np.testing.assert_array_equal(*runs)


def test_equations_of_a_sampled_block_are_differences():
    law = nlctl.typeset(closed(nlctl.sampled(FIRST)))[1]
    assert any("^{+}" in line for line in law.equations)


@each_row(
    "given",
    [
        (lambda: nlctl.sampled(PLANT, 0.1), "is in continuous time.*method='euler'"),
        (lambda: nlctl.sampled(FIRST, 0.2), "has a sampling time of 0.1 s"),
        (lambda: nlctl.sampled(nlctl.DeadZone()), "give dt in s"),
        (lambda: nlctl.sampled(FIRST, input_quantum=-1), "input_quantum"),
        (lambda: nlctl.sampled(FIRST, delay=-1), "delay"),
        (lambda: nlctl.sampled(FIRST, jitter=0.1), "jitter < dt"),
        (lambda: nlctl.discretise(PLANT, 0), "dt > 0"),
        (lambda: nlctl.discretise(PLANT, 0.1, "heun"), "method"),
        (lambda: nlctl.discretise(FIRST, 0.1), "in discrete time already"),
        (lambda: nlctl.discretise(nlctl.block(nlctl.Backlash(), "gap"), 0.1), "memory"),
        (lambda: nlctl.discretise(nlctl.Backlash(), 0.1), "nlctl.block makes"),
    ],
)
def test_mistakes_end_in_a_sentence(given):
    call, words = given
    with pytest.raises(ParameterError, match=words):
        call()


@each_row("method", ["euler", "tustin", "zoh"])
def test_linear_blocks_are_discretised_as_python_control_does(method):
    made = nlctl.discretise(PLANT, 0.05, method)
    kind = "forward_diff" if method == "euler" else method
    known = ct.sample_system(PLANT, 0.05, kind)
    for name in "ABCD":
        np.testing.assert_allclose(getattr(made, name), getattr(known, name), atol=1e-15)


def test_a_record_takes_eulers_steps():
    """x[k+1] = x[k] + dt f(x[k]), by hand."""
    plant = nlctl.block(nlctl.plants.ForcedDuffing(), "plant")
    made = nlctl.discretise(plant, 0.01)
    x = np.array([0.4, -0.3])
    for k in range(50):
        expected = x + 0.01 * plant.dynamics(0.01 * k, x, [0.7])
        x = made.dynamics(0.01 * k, x, [0.7])
        np.testing.assert_allclose(x, expected, rtol=1e-14)


def linear(delay=0.0):
    """A sampled linear loop with an input from outside, and its matrices by hand."""
    matrices = [[0.5]], [[1.0, -1.0]], [[0.3]], [[-1.0, 0.5]]
    law = ct.ss(*matrices, 0.1, inputs=["y", "w"], outputs="u", name="law")
    parts = [PLANT, nlctl.sampled(law, delay=delay)]
    return ct.interconnect(parts, inputs=["w"], outputs=["y", "u"]), law


def test_a_sampled_linear_loop_is_linearized_exactly():
    loop, law = linear()
    made = nlctl.compile(loop).linearize(0.0)
    exact = ct.sample_system(PLANT, 0.1)
    A = np.block([[exact.A + exact.B @ law.D[:, :1] @ exact.C, exact.B @ law.C],
                  [law.B[:, :1] @ exact.C, law.A]])  # fmt: skip
    B = np.vstack([exact.B @ law.D[:, 1:], law.B[:, 1:]])
    assert made.dt == 0.1
    np.testing.assert_allclose(made.A[:3, :3], A, atol=1e-13)
    np.testing.assert_allclose(made.B[:3], B, atol=1e-13)
    np.testing.assert_allclose(made.A[:, 3], 0, atol=1e-13)  # what was held before is forgotten
    np.testing.assert_allclose(made.C[1, :3], np.hstack([law.D[0, 0] * PLANT.C[0], law.C[0]]))


@each_row("delay", [0.0, 0.03, 0.1, 0.17])
def test_the_linearization_predicts_the_run(delay):
    """From a state at random, with a constant input: sample by sample, delays and all."""
    loop, _ = linear(delay)
    made = nlctl.compile(loop).linearize(0.0)
    x = np.random.default_rng(5).normal(size=loop.nstates)
    u = np.array([0.7])
    times = np.arange(10, 31) / 10  # when the first delayed outputs have come
    run = nlctl.input_output_response(loop, times, 0.7, x, rtol=1e-12, atol=1e-13)
    expected = [x]
    for _ in range(20):
        expected.append(made.A @ expected[-1] + made.B @ u)
    n = 2  # the plant's; those of sampled blocks are shown after the sample
    np.testing.assert_allclose(run.states[:n].T, np.array(expected)[:, :n], atol=1e-9)
    y = np.array(expected[:-1]) @ made.C.T + (made.D @ u)
    np.testing.assert_allclose(run.outputs[:, :-1].T, y, atol=1e-9)


def test_two_rates_are_linearized_over_their_common_period():
    made = nlctl.compile(two_rates()).linearize(0.0)
    assert made.dt == pytest.approx(0.3)
    with pytest.raises(ParameterError, match="no period"):
        nlctl.compile(closed(nlctl.sampled(FIRST, jitter=0.01))).linearize(0.0)
    odd = [Clock(dt=0.1), Clock(dt=0.1234567)]
    with pytest.raises(ParameterError, match="too long"):
        common_period(odd)


def test_a_diagram_keeps_the_parameters_that_it_was_given():
    """Those of `ct.interconnect` and of its own, not those that its blocks had."""

    def gain(name, inputs, outputs):
        return ct.nlsys(
            None, lambda t, x, u, params: [params["k"] * u[0]], inputs=inputs, outputs=outputs,
            params={"k": 1.0}, name=name,
        )  # fmt: skip

    inner = ct.interconnect(
        [gain("one", ["y"], ["m"]), gain("two", ["m"], ["u"])],
        inputs=["y"], outputs=["u"], params={"k": -2.0}, name="law",
    )  # fmt: skip
    for made in (nlctl.sampled(inner, 0.1), nlctl.sampled(inner, 0.1, delay=0.05)):
        assert made.params["k"] == -2.0
    loop = closed(nlctl.sampled(inner, 0.1))
    for engine in ("native", "python-control"):
        run = nlctl.input_output_response(loop, T[:2], 0, start(loop), engine=engine)
        assert run.outputs[1, 0] == pytest.approx(4.0)
    known = nlctl.adaptive_neural(2)
    known.params["law.beta"] = 9.0
    assert nlctl.discretise(known, 0.01).params["law.beta"] == 9.0


def test_equations_of_eulers_method_are_steps():
    """x + T_s f, with all inputs of the outputs."""
    law = {e.block: e for e in nlctl.typeset(on_a_computer(0.01))}["law"]
    assert law.equations[0].startswith(r"\zeta^{+} = \zeta + T_{s} ")
    assert not any("NaN" in line for line in law.equations)


SAMPLINGS = {
    "sampling time": {"dt": 0.02},
    "offset": {"offset": 0.003},
    "delay": {"delay": 0.011},
    "delay of the sampling time": {"delay": 0.01},
    "jitter": {"jitter": 0.004, "seed": 5},
    "quanta": {"input_quantum": 0.05, "output_quantum": 0.1},
}


@pytest.fixture(scope="module")
def variable():
    """A diagram in which everything may be varied, compiled once."""
    controller = on_a_computer(
        0.01, delay=0.004, waiting=2, input_quantum=0.0, output_quantum=0.0
    )  # fmt: skip
    return nlctl.compile(nlctl.paper.example_1(controller=controller))


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("changed", SAMPLINGS.values(), ids=SAMPLINGS)
def test_a_diagram_with_overrides_is_one_that_was_made_so(variable, changed):
    times = np.linspace(0, 0.5, 26)
    given = {"delay": 0.004, "waiting": 2, "input_quantum": 0.0, "output_quantum": 0.0, **changed}
    made = nlctl.paper.example_1(controller=on_a_computer(given.pop("dt", 0.01), **given))
    params = {f"sampling.{name}": value for name, value in changed.items()}
    expected = nlctl.input_output_response(made, times).outputs
    found = nlctl.input_output_response(variable, times, params=params).outputs
    np.testing.assert_array_equal(found, expected)


def test_members_of_different_clocks_are_the_single_runs(variable):
    """Side by side in one register, each with its own instants."""
    times = np.linspace(0, 0.5, 26)
    names = ("sampling.dt", "sampling.delay", "sampling.output_quantum")
    columns = [np.linspace(0.004, 0.02, 9), np.linspace(0.002, 0.004, 9), np.linspace(0, 0.1, 9)]
    params = dict(zip(names, columns, strict=True))
    made = nlctl.ensemble_response(variable, times, params=params, keep=["y"])
    for k in (0, 3, 8):
        one = {name: values[k] for name, values in params.items()}
        alone = nlctl.ensemble_response(variable, times, params=one, keep=["y"])
        np.testing.assert_array_equal(made.signals["y"][k], alone.signals["y"][0])


def test_clocks_that_are_moved_apart_still_run():
    """0.3 s is a multiple of 0.1 s, 0.25 s is none: what happens at an instant changes."""
    loop = nlctl.compile(two_rates())
    x0 = start(loop.system)
    params = {"fast.sampling.dt": 0.1, "slow.sampling.offset": 0.13}
    runs = [
        nlctl.input_output_response(system, T, 0, x0, params=params, engine=engine).outputs
        for system, engine in ((loop, "native"), (loop.system, "python-control"))
    ]
    np.testing.assert_allclose(*runs, atol=1e-7)


@each_row(
    "given",
    [
        ({"dt": 0.0}, "dt > 0, got 0"), ({"dt": -1}, "dt > 0, got -1"), ({"delay": -1}, "delay >="),
        ({"jitter": 0.02}, "jitter < dt"), ({"input_quantum": -1}, "input_quantum >= 0"),
        ({"delay": 0}, "delay > 0 where outputs wait"), ({"delay": 0.03}, "give .* waiting=3"),
        ({"dt": 0.001}, "give .* waiting=4"), ({"seed": 0.5}, "integer for seed"),
        ({"dtt": 1.0}, "nearest: .*sampling.dt"),
    ],
)  # fmt: skip
def test_impossible_samplings_are_refused(variable, given):
    """By name, before anything runs, also of one member."""
    changed, words = given
    params = {f"sampling.{name}": value for name, value in changed.items()}
    with pytest.raises(UsageError, match=words):
        nlctl.input_output_response(variable, T, params=params)
    every = {name: np.array([0.004, value]) for name, value in params.items()}
    with pytest.raises(UsageError, match=words):
        nlctl.ensemble_response(variable, T, params=every)


@each_row(
    "given",
    [
        ({}, {"delay": 0.01}, "delay = 0 where no outputs wait"),
        ({}, {"output_quantum": 0.01}, "where there is no converter"),
        ({}, {"dt": 0.2}, "dt = 0.1, got 0.2"),
    ],
)
def test_what_a_diagram_was_not_made_for_is_refused(given):
    made, changed, words = given
    loop = closed(nlctl.sampled(FIRST, **made))
    params = {f"law.sampling.{name}": value for name, value in changed.items()}
    with pytest.raises(ParameterError, match=words):
        nlctl.input_output_response(loop, T, 0, start(loop), params=params)


def test_two_programs_of_one_name_keep_their_own_clocks():
    """Diagrams without a name in front: what could mean both is refused, nothing is mixed up."""

    def program(k):
        gain = ct.nlsys(None, lambda t, x, u, params: [u[0] / 2], inputs=[f"a{k}"],
                        outputs=[f"a{k + 1}"], name=f"gain{k}")  # fmt: skip
        whole = ct.interconnect([gain], inputs=[f"a{k}"], outputs=[f"a{k + 1}"], name=f"program{k}")
        return nlctl.sampled(whole, 0.1 * (k + 1))

    loop = ct.interconnect([program(0), program(1)], inputs=["a0"], outputs=["a1", "a2"])
    times = np.linspace(0, 1, 21)
    runs = [
        nlctl.input_output_response(loop, times, times, engine=engine).outputs
        for engine in ("native", "python-control")
    ]
    np.testing.assert_allclose(*runs, atol=1e-12)
    assert np.unique(runs[0][0, :-1]).size == 10
    assert np.unique(runs[0][1, :-1]).size == 5
    with pytest.raises(UsageError, match="two blocks"):
        nlctl.input_output_response(loop, times, times, params={"sampling.dt": 0.3})
