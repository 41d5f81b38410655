"""Equations in C: the rates and outputs of the diagram, and where it switches."""

import control as ct
import numpy as np
import pytest
from exported import evaluated

import nlctl
from nlctl.errors import CompileError
from nlctl.export import c_files, export_equations


@pytest.mark.ci
@pytest.mark.parametrize("example", ["example_1", "example_2"])
def test_rates_and_outputs_are_those_of_python_control(tmp_path, example):
    loop = getattr(nlctl.paper, example)()
    equations = export_equations(loop, name=example)
    rng = np.random.default_rng(3)
    points = [
        (float(t), nlctl.initial_state(loop) + 0.3 * rng.normal(size=loop.nstates),
         np.zeros(max(loop.ninputs or 0, 1)))
        for t in rng.uniform(0, 20, 50)
    ]  # fmt: skip
    for (t, x, u), (dx, y) in zip(points, evaluated(tmp_path, equations, points), strict=True):
        u = u[: loop.ninputs or 0]
        expected = loop.dynamics(t, x, u)
        np.testing.assert_allclose(dx, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
        np.testing.assert_allclose(y, loop.output(t, x, u), rtol=1e-12, atol=1e-12)


@pytest.mark.ci
def test_a_rate_that_is_written_as_2_may_be_two_and_a_half(tmp_path):
    """A caller may set it in the parameters, and nothing cuts it to 2."""
    lag = ct.nlsys(lambda t, x, u, p: [-p["a"] * x[0]], None, inputs=0, states=1, name="lag",
                   params={"a": 2})  # fmt: skip
    assert export_equations(lag, name="lag").parameters == {"lag.a": 2.0}
    equations = export_equations(lag, params={"lag.a": 2.5}, name="lag")
    ((dx, _),) = evaluated(tmp_path, equations, [(0.0, np.array([2.0]), np.zeros(1))])
    assert dx == [-5.0]


def test_conditions_and_memories_are_counted():
    """A dead zone has two kinks, a play remembers one state."""
    plant = ct.ss(-1, 1, 1, 0, inputs="v", outputs="y", name="plant")
    for actuator, conditions, memory in ((nlctl.DeadZone(), 2, ()), (nlctl.Backlash(), 2, ("v",))):
        loop = nlctl.interconnect(
            [nlctl.block(actuator, "actuator"), plant], inputs="u", outputs="y"
        )
        equations = export_equations(loop, name="loop")
        assert equations.conditions == conditions
        assert len(equations.memory) == len(memory)
        assert f"#define LOOP_CONDITIONS {conditions}" in c_files(equations)["loop.h"]


def test_other_integers_that_steer_the_equations_are_refused():
    """Those of the diagram are written, and the functions would compute another loop."""

    def update(t, x, u, p):
        rate = 0.0 * x[0]
        for _ in range(p["n"]):
            rate = rate + p["k"]
        return [-rate * x[0]]

    params = {"n": 3, "k": 0.5}
    loop = ct.nlsys(update, None, inputs=0, states=1, name="loop", params=params)
    assert export_equations(loop, params={"n": 3, "k": 0.7}).parameters["loop.k"] == 0.7
    with pytest.raises(CompileError, match="integers among the parameters steer its equations"):
        export_equations(loop, params={"n": 5})


REFUSED = {
    "sampled blocks": lambda: nlctl.sampled(
        ct.ss([], [], [], -1.0, 0.1, inputs="y", outputs="u", name="law")
    ),
    "transport delays": lambda: nlctl.block(
        nlctl.TransportDelay(delay=0.1), "law", inputs="y", outputs="u"
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_three_functions_cannot_say_is_refused(what):
    plant = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="plant")
    loop = nlctl.interconnect(
        [plant, REFUSED[what]()], inputs=[], inplist=[], outputs="y", name="l"
    )
    with pytest.raises(CompileError, match=what):
        export_equations(loop)


def root_by(passes):
    """x' = -y, y = cos(y) + x / 10 by Newton's method, until it stands still or so many times."""

    def step(y, x):
        return (y - np.cos(y) - 0.1 * x) / (1 + np.sin(y))

    def until_still(t, x, u, p):
        y = 0.5
        while abs(step(y, x[0])) > 1e-13:
            y = y - step(y, x[0])
        return [-y]

    def so_often(t, x, u, p):
        y = 0.5
        for _ in range(passes):
            y = y - step(y, x[0])
        return [-y]

    update = so_often if passes else until_still
    return ct.nlsys(update, None, inputs=0, outputs=["x"], states=["x"], name="s")


EXPORTS = {
    "equations": lambda system: export_equations(system),
    "controller": lambda system: nlctl.export.export_controller(
        nlctl.interconnect([system], inputs=[], outputs=["x"], name="loop"), "s", dt=0.1,
        method="euler",
    ),
    "fmu": lambda system: nlctl.export.fmi.archive.read_model(system, {}, {}, "s", 1.0, 1e-6),
}  # fmt: skip


@pytest.mark.parametrize("kind", EXPORTS)
def test_a_loop_without_a_fixed_number_of_passes_is_refused_and_one_with_is_written(kind):
    """Nobody could call the function where the passes that are written out do not suffice."""
    with pytest.raises(CompileError, match=r"update function of block 's.*for _ in range\(20\)"):
        EXPORTS[kind](root_by(None))
    assert EXPORTS[kind](root_by(20)).lowered.cut == frozenset()


@pytest.mark.ci
def test_a_loop_of_so_many_passes_is_in_c_what_it_is_in_python(tmp_path):
    system = root_by(20)
    points = [(0.0, np.array([x]), np.zeros(1)) for x in (-20.0, -3.0, 0.0, 1.0, 7.0)]
    results = evaluated(tmp_path, export_equations(system), points)
    for (t, x, _), (dx, _) in zip(points, results, strict=True):
        assert dx == pytest.approx(system.dynamics(t, x, []), abs=1e-13)
