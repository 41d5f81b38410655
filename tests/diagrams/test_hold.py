"""Inputs of a zero-order hold, and the arguments of an ensemble that are python-control's."""

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl

T = np.linspace(0, 6, 41)
OSCILLATOR = ct.ss([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0]], 0, name="oscillator")
ENGINES = [
    {"engine": "native", "method": "tsit5"}, {"engine": "native", "method": "rodas5p"},
    {"engine": "native", "method": "taylor"}, {"engine": "python-control"},
]  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("how", ENGINES, ids=str)
def test_it_is_the_sampled_system(how):
    """At the samples exactly what `ct.sample_system` computes by matrix exponentials."""
    u = np.random.default_rng(1).standard_normal(T.size)
    sampled = ct.sample_system(OSCILLATOR, T[1], "zoh")
    exact = ct.forced_response(sampled, T, u).outputs
    run = nlctl.input_output_response(OSCILLATOR, T, u, hold="zoh", rtol=1e-9, atol=1e-11, **how)
    np.testing.assert_allclose(run.outputs, exact, atol=1e-8)
    np.testing.assert_array_equal(np.ravel(run.inputs), u)
    np.testing.assert_array_equal(run.time, T)


@given(height=st.floats(-3, 3), at=st.integers(1, 38))
@settings(max_examples=10, deadline=None)
def test_one_sample_is_a_pulse_of_one_interval(height, at):
    """x' = u: the area of the pulse is its height times the interval, and half outside it."""
    u = np.zeros(T.size)
    u[at] = height
    integrator = ct.ss([0], [1], [1], 0)
    held, linear = (
        nlctl.input_output_response(integrator, T, u, hold=hold).outputs[-1]
        for hold in ("zoh", "foh")
    )
    assert held == pytest.approx(height * T[1], abs=1e-9)
    assert linear == pytest.approx(height * T[1], abs=1e-9)  # a triangle of two intervals
    between = nlctl.input_output_response(
        integrator, T, u, hold="zoh", evaluation_times=[0.0, T[at], T[at] + 0.5 * T[1], T[-1]]
    )
    np.testing.assert_allclose(between.outputs, height * T[1] * np.array([0, 0, 0.5, 1]), atol=1e-9)


@pytest.mark.parametrize("engine", ["auto", "native", "python-control"])
def test_a_block_without_sizes_is_held_and_named_as_one_that_has_them(engine):
    """x' = u - x, y = x: a run says how many signals there are, in both engines."""
    u = np.cos(3 * T)
    vague, sized = (
        ct.nlsys(lambda t, x, u, params: u - x, None, name="lag", **sizes)
        for sizes in ({}, {"states": 1, "inputs": 1, "outputs": 1})
    )
    for hold in ("zoh", "foh"):
        run, reference = (
            nlctl.input_output_response(lag, T, u, 0.0, hold=hold, engine=engine)
            for lag in (vague, sized)
        )
        np.testing.assert_array_equal(run.outputs, reference.outputs)
        assert run.to_pandas().equals(reference.to_pandas())


def test_what_remembers_is_not_called_to_be_sized():
    """Then no one knows how many inputs are held; without a hold python-control runs it."""
    calls: list[float] = []

    def output(t, x, u, params):
        calls.append(t)
        return 2 * u

    vague = ct.nlsys(None, output, name="vague")
    with pytest.raises(nlctl.errors.ParameterError, match="number of inputs of block 'vague'"):
        nlctl.input_output_response(vague, T, T, hold="zoh")
    assert not calls
    run = nlctl.input_output_response(vague, T, T[None, :], engine="python-control")
    np.testing.assert_array_equal(np.ravel(run.outputs), 2 * T)


def test_a_memory_sees_the_steps():
    """A play of half gap 0.5 moves by what a step goes beyond it, and holds."""
    play = nlctl.block(nlctl.Backlash(c_r=0.5, c_l=-0.5, m_r=1.0, m_l=1.0), "play")
    u = np.array([0.0, 2.0, 1.2, 0.0, 0.0])
    times = np.arange(5.0)
    for engine in ("native", "python-control"):
        run = nlctl.input_output_response(play, times, u, hold="zoh", engine=engine)
        np.testing.assert_allclose(run.outputs, [0.0, 1.5, 1.5, 0.5, 0.5], atol=1e-9)


def test_in_discrete_time_inputs_are_held_anyway():
    """The same numbers."""
    sampled = ct.sample_system(OSCILLATOR, T[1], "zoh")
    u = np.sin(T)
    runs = [
        nlctl.input_output_response(sampled, T, u, hold=hold).outputs for hold in ("zoh", "foh")
    ]
    np.testing.assert_array_equal(*runs)


def test_another_word_is_refused():
    """With the two that there are."""
    for run in (nlctl.input_output_response, nlctl.ensemble_response):
        with pytest.raises(
            nlctl.errors.ParameterError, match="hold to be 'foh' or 'zoh', got 'zero'"
        ):
            run(OSCILLATOR, T, 0.0, hold="zero")


# -- ensembles -------------------------------------------------------------------------------------


def test_an_ensemble_takes_what_a_run_takes():
    """T, U, X0 by short names; a row of states for each member is that member's run."""
    u = np.cos(2 * T)
    starts = np.array([[1.0, 0.0], [0.0, -2.0], [0.5, 0.5]])
    for hold in ("foh", "zoh"):
        many = nlctl.ensemble_response(
            OSCILLATOR, T=T, U=u, X0=starts, keep=["y[0]"], hold=hold, rtol=1e-10, atol=1e-12
        )
        for row, start in zip(many.signals["y[0]"], starts, strict=True):
            alone = nlctl.input_output_response(
                OSCILLATOR, T, u, start, hold=hold, rtol=1e-10, atol=1e-12
            )
            np.testing.assert_allclose(row, alone.outputs, atol=1e-9)
    assert [c for c in many.table.columns if c.endswith("(0)")] == [
        "oscillator.x[0](0)", "oscillator.x[1](0)",
    ]  # fmt: skip


def test_one_state_is_that_of_all_members():
    """As an array, a number or by name; the table has what differs from the diagram's own."""
    lags = nlctl.interconnect(
        {"a": nlctl.Lag(T=1.0), "b": nlctl.block(nlctl.Lag(T=1.0), "b", inputs="v", outputs="w")},
        inputs=["u"], outputs=["v", "w"],
    )  # fmt: skip
    T_a = {"a.T": np.array([1.0, 2.0])}
    made = [
        nlctl.ensemble_response(lags, T, X0=start, params=T_a, keep=["v"])
        for start in ([2.0, 0.0], {"a.v": 2.0})
    ]
    for each in made:
        np.testing.assert_array_equal(each.signals["v"], made[0].signals["v"])
        assert "b.v(0)" not in each.table
    np.testing.assert_allclose(made[0].signals["v"][1], 2 * np.exp(-T / 2), rtol=1e-6)
    both = nlctl.ensemble_response(lags, T, X0=1.0, params=T_a, keep=["w"])
    np.testing.assert_allclose(both.signals["w"][0], (1 + T) * np.exp(-T), rtol=1e-6)


def test_members_that_start_alike_are_counted():
    """Rows that are the diagram's own start."""
    lag = nlctl.block(nlctl.Lag(), "lag")
    assert len(nlctl.ensemble_response(lag, T, X0=np.zeros((3, 1))).table) == 3


def test_a_member_is_the_run_of_its_values():
    """By default, to rounding: ensembles and runs have one default of tolerances."""
    diagram, b_r = nlctl.paper.example_1(), np.array([0.3, 0.6])
    many = nlctl.ensemble_response(diagram, T, params={"actuator.b_r": b_r}, keep=["y"])
    for row, value in zip(many.signals["y"], b_r, strict=True):
        alone = nlctl.input_output_response(
            diagram, T, params={"actuator.b_r": value}, method="tsit5"
        )
        np.testing.assert_allclose(row, alone.outputs[0], atol=1e-9)


def test_arguments_that_do_not_exist_are_refused():
    """python-control's others, and both names of one."""
    lag = nlctl.block(nlctl.Lag(), "lag")
    with pytest.raises(TypeError, match="unknown argument 't_eval' of ensemble_response"):
        nlctl.ensemble_response(lag, T, t_eval=[0.0])
    with pytest.raises(nlctl.errors.ParameterError, match="given twice"):
        nlctl.ensemble_response(lag, T, T=T)
