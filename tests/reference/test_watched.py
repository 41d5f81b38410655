"""Events of a run, and its end, in both engines: closed-form times, and what is refused."""

import control as ct
import numpy as np
import pytest

import nlctl

engines = pytest.mark.parametrize("engine", ["python-control", "native"])
TIMES = np.linspace(0, 10, 11)
CROSSINGS = np.pi * np.array([0.5, 1.5, 2.5])  # of cos(t), on 0 to 10 s


def oscillator():
    """x = (cos t, -sin t) from (1, 0)."""
    return ct.nlsys(lambda t, x, u, p: [x[1], -x[0]], None, states=2, inputs=0, outputs=2,
                    name="oscillator")  # fmt: skip


def run(engine, times=TIMES, **watched):
    return nlctl.input_output_response(
        oscillator(), times, 0, [1.0, 0.0], engine=engine, rtol=1e-10, atol=1e-12, **watched
    )


def way(function, direction=0, terminal=False):
    function.direction, function.terminal = direction, terminal
    return function


def position(t, x, u, params):
    return x[0]


@engines
def test_the_table_of_events(engine):
    made = run(engine, events={"x": position, "late": lambda t, x, u, p: t - 9.25})
    assert list(made.events.columns) == ["time", "block", "which", "direction"]
    assert made.events["which"].tolist() == ["x", "x", "x", "late"]
    assert made.events["direction"].tolist() == ["falling", "rising", "falling", "rising"]
    assert set(made.events["block"]) == {""}
    np.testing.assert_allclose(made.events["time"], [*CROSSINGS, 9.25], rtol=0, atol=1e-8)
    np.testing.assert_array_equal(made.time, TIMES)


@pytest.mark.parted
@engines
@pytest.mark.parametrize(("direction", "kept"), [(1, [1]), (-1, [0, 2]), (0, [0, 1, 2])])
def test_only_changes_of_one_direction_count(engine, direction, kept):
    watched = way(lambda t, x, u, p: x[0], direction)
    made = run(engine, events=watched)
    np.testing.assert_allclose(made.events["time"], CROSSINGS[kept], rtol=0, atol=1e-8)


@engines
def test_a_run_ends_where_its_condition_changes_its_sign(engine):
    """cos(t) = 1/2 at pi / 3, behind the sample at 1 s."""
    made = run(engine, stop_when=lambda t, x, u, p: x[0] - 0.5)
    assert made.success
    np.testing.assert_allclose(made.time, [0, 1, np.pi / 3], rtol=0, atol=1e-8)
    np.testing.assert_allclose(made.states[:, -1], [0.5, -np.sqrt(0.75)], rtol=0, atol=1e-8)
    assert made.events["which"].tolist() == ["stop_when"]


@engines
def test_the_end_of_a_run_has_its_own_inputs(engine):
    """x' = u = t comes to 1 at t = sqrt(2), and behind a delay of 0.5 s so much later."""
    x = ct.nlsys(lambda t, x, u, p: [u[0]], lambda t, x, u, p: [x[0], u[0]], inputs=["u"],
                 outputs=["x", "v"], states=1, name="x")  # fmt: skip
    late = nlctl.block(nlctl.TransportDelay(outputs=("v",), delay=0.5), "late")
    behind = ct.interconnect([late, x], [["x.u", "late.v"]], ["late.u"], ["x.x", "x.v"],
                             inputs=["u"], outputs=["x", "v"], name="behind")  # fmt: skip
    for loop, delay in ((x, 0.0), (behind, 0.5)):
        made = nlctl.input_output_response(
            loop, [0, 1, 5], [0, 1, 5], engine=engine, rtol=1e-10, atol=1e-12,
            stop_when=lambda t, x, u, p: x[0] - 1.0,
        )  # fmt: skip
        end = np.sqrt(2) + delay
        np.testing.assert_allclose(made.outputs[:, -1], [1, np.sqrt(2)], atol=1e-8)
        np.testing.assert_allclose([made.time[-1], made.inputs[0, -1]], end, atol=1e-8)


@engines
def test_a_terminal_function_ends_a_run_in_its_direction_only(engine):
    made = run(engine, events={"up": way(lambda t, x, u, p: x[0], 1, terminal=True)})
    assert made.time[-1] == pytest.approx(1.5 * np.pi, abs=1e-8)


@engines
def test_functions_see_inputs_and_overrides(engine):
    """A ramp, and a level among the overrides of the run."""
    lag = ct.nlsys(lambda t, x, u, p: u - x * p["a"], None, states=1, inputs=1, outputs=1,
                   params={"a": 0.0}, name="lag")  # fmt: skip
    made = nlctl.input_output_response(
        lag, [0.0, 4.0], [0.0, 4.0], 0, params={"a": 1.0}, engine=engine, rtol=1e-10, atol=1e-12,
        events={"input": lambda t, x, u, p: u[0] - 1.5, "state": lambda t, x, u, p: x[0] - p["a"]},
    )  # fmt: skip
    crossed = 1.841405660436961  # t - 1 + exp(-t) = 1
    np.testing.assert_allclose(made.events["time"], [1.5, crossed], rtol=0, atol=1e-8)


@engines
def test_nothing_that_is_watched_moves_the_result(engine):
    watched = run(engine, events=position).states[:, -1]
    np.testing.assert_allclose(watched, run(engine).states[:, -1], rtol=0, atol=1e-8)


@pytest.mark.parted
@engines
@pytest.mark.parametrize(
    ("function", "time"),
    [
        (lambda t, x, u, p: x[0] * np.nan, 0.0),
        (lambda t, x, u, p: np.sqrt(x[0] - 0.5) + 0.1, np.pi / 3),
        (lambda t, x, u, p: np.log(2.5 - t) + 50.0, 2.5),
    ],
)
@pytest.mark.parametrize("how", ["events", "stop_when"])
def test_an_event_function_that_becomes_nan_ends_the_run_by_name(engine, function, time, how):
    name = "own" if how == "events" else "stop_when"
    given = {how: {"own": function} if how == "events" else function}
    with pytest.raises(
        nlctl.errors.DivergedError, match=f"event function '{name}' is NaN"
    ) as ended:
        run(engine, **given)
    assert ended.value.time == pytest.approx(time, abs=1e-6)


@engines
def test_a_run_that_ends_before_its_condition_is_nan_is_fine(engine):
    """sqrt(cos t - 1/2) = 1/10 at cos t = 0.51."""
    made = run(engine, stop_when=lambda t, x, u, p: np.sqrt(x[0] - 0.5) - 0.1)
    assert made.time[-1] == pytest.approx(np.arccos(0.51), abs=1e-7)


@engines
@pytest.mark.parametrize("function", [lambda t, x, u, p: 0.0, lambda t, x, u, p: 0 * x[0]])
def test_a_condition_that_is_always_zero_is_refused_by_name(engine, function):
    with pytest.raises(
        nlctl.errors.ParameterError, match="'stop_when' is 0 at all times of the run"
    ):
        run(engine, stop_when=function)
    with pytest.raises(nlctl.errors.ParameterError, match="'flat' is 0 at all times of the run"):
        run(engine, events={"flat": function})


@engines
def test_a_condition_that_is_zero_at_every_sample_is_not(engine):
    """sin(pi t) at integer times."""
    made = run(engine, times=np.arange(4.0), events={"s": lambda t, x, u, p: np.sin(np.pi * t)})
    inner = made.events["time"][made.events["time"].between(0.5, 2.5)]
    np.testing.assert_allclose(inner, [1, 2], rtol=0, atol=1e-8)


@engines
def test_what_is_not_one_number_is_refused_by_name(engine):
    with pytest.raises(nlctl.errors.ParameterError, match="'pair' must return one number, got 2"):
        run(engine, events={"pair": lambda t, x, u, p: x})
    with pytest.raises(
        nlctl.errors.ParameterError, match="'none' must return one number, got None"
    ):
        run(engine, events={"none": lambda t, x, u, p: None})


def test_what_cannot_be_watched_is_refused_by_name():
    with pytest.raises(nlctl.errors.ParameterError, match="event 'x' must be a function"):
        run("native", events={"x": 1.0})
    with pytest.raises(nlctl.errors.ParameterError, match="two events are called 'position'"):
        run("native", events=[position, position])
    third = way(lambda t, x, u, p: x[0], terminal=3)
    with pytest.raises(
        nlctl.errors.ParameterError, match="'third' needs terminal = True or False, got 3"
    ):
        run("native", events={"third": third})


def falling(**own):
    """A block with x' = -1 from 1/2, a guard, and a reset."""
    common = {
        "inputs": (), "outputs": ("x", "count"), "states": ("x", "count"), "feedthrough": False,
        "initial": {"x": 0.5}, "update": lambda t, x, u, p: (-1.0, 0.0),
        "output": lambda t, x, u, p: (x[0], x[1]), "guard": lambda t, x, u, p: (x[0],),
        "reset": lambda t, x, u, p: (x[0] + 1.0, x[1] + 1.0),
    }  # fmt: skip
    own = {k: staticmethod(v) if callable(v) else v for k, v in (common | own).items()}
    return nlctl.record(type("Falling", (), own))()


@engines
def test_two_guards_at_one_instant_are_one_jump(engine):
    """A state has one reset, of its block: there are no two without an order."""
    both = falling(guard=lambda t, x, u, p: (x[0], 2.0 * x[0]))
    made = nlctl.input_output_response(nlctl.block(both, "one"), [0.0, 2.0], engine=engine)
    np.testing.assert_allclose(made.outputs[:, -1], [0.5, 2.0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(made.events["time"], [0.5, 0.5, 1.5, 1.5], rtol=0, atol=1e-8)
    assert made.events["which"].tolist() == ["guard 1", "guard 2"] * 2


def test_a_reset_that_changes_the_number_of_states_is_refused_by_name():
    for wrong in ((0.0,), (0.0, 0.0, 0.0)):
        record = falling(reset=lambda t, x, u, p, wrong=wrong: wrong)
        with pytest.raises(
            nlctl.errors.BlockError, match=r"block 'one'\) returns .* from reset, needs 2"
        ):
            nlctl.block(record, "one")


@engines
def test_a_reset_that_changes_it_later_is_refused_by_name(engine):
    """At the start it has two values, where it jumps three."""
    record = falling(reset=lambda t, x, u, p: (1.0, 0.0) if t < 0.25 else (1.0, 0.0, 0.0))
    with pytest.raises(nlctl.errors.BlockError, match=r"block 'one'.* 3 values from (its )?reset"):
        nlctl.input_output_response(nlctl.block(record, "one"), [0.0, 2.0], engine=engine)


@engines
def test_a_guard_or_a_reset_that_is_nan_ends_the_run_by_name(engine):
    late = falling(guard=lambda t, x, u, p: (np.sqrt(x[0]) + 1.0,))
    jumps = falling(reset=lambda t, x, u, p: (np.nan * x[0], x[1]))
    for record in (late, jumps):
        with pytest.raises(nlctl.errors.DivergedError, match="block 'one' has a guard that is NaN"):
            nlctl.input_output_response(nlctl.block(record, "one"), [0.0, 2.0], engine=engine)


@engines
def test_a_guard_that_is_always_zero_never_falls(engine):
    still = falling(guard=lambda t, x, u, p: (0.0 * x[0],))
    made = nlctl.input_output_response(nlctl.block(still, "one"), [0.0, 2.0], engine=engine)
    assert made.outputs[0, -1] == pytest.approx(-1.5, abs=1e-9)
    assert made.events.empty
