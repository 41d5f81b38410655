"""The arguments of runs: those of python-control, in both engines, or refused by name."""

import warnings
from typing import Any

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import nlctl

reference: Any = ct.input_output_response
PRECISE = {"rtol": 1e-9, "atol": 1e-11, "max_step": 0.1}
T = np.linspace(0, 1, 6)
M = T.size
ONE = ct.ss([[0.0, 1.0], [-1.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]], name="one")
THREE = ct.ss(
    [[-1.0, 0.3], [0.2, -2.0]], [[1.0, 2.0, 3.0], [0.5, -1.0, 4.0]], np.eye(2), np.zeros((2, 3)),
    name="three", inputs=["a", "b", "c"], states=["p", "q"],
)  # fmt: skip
SAMPLED = ct.ss([[0.5, 0.1], [0.0, 0.9]], [[1.0], [2.0]], [[1.0, 0.0]], [[0.0]], 0.1, name="dt")
SYSTEMS = {"one": ONE, "three": THREE, "sampled": SAMPLED}
COMPILED = {name: nlctl.compile(system) for name, system in SYSTEMS.items()}
ENGINES = ["compiled", "python-control"]

numbers = st.floats(-3, 3)


def simulate(system, *arguments: Any, **how: Any) -> Any:
    """Run a compiled diagram as it is, any other in python-control by default."""
    if not isinstance(system, nlctl.native.Compiled | list):
        how = {"engine": "python-control"} | how
    return nlctl.input_output_response(system, *arguments, **how)


def system_for(name, engine):
    return COMPILED[name] if engine == "compiled" else SYSTEMS[name]


def entry(rows):
    """An entry of a list of inputs that stands for so many of them."""
    kinds = [arrays(float, (rows, M), elements=numbers), arrays(float, rows, elements=numbers)]
    kinds += [st.lists(numbers, min_size=rows, max_size=rows)]
    if rows == 1:
        kinds += [numbers, arrays(float, M, elements=numbers), st.integers(-3, 3)]
    return st.one_of(kinds)


ENTRIES = st.sampled_from([(1, 1, 1), (2, 1), (1, 2), (3,)]).flatmap(
    lambda rows: st.tuples(*map(entry, rows))
)
INPUTS = st.one_of(numbers, arrays(float, (3, M), elements=numbers), ENTRIES, ENTRIES.map(list))
STATES = st.one_of(
    numbers,
    arrays(float, (2,), elements=numbers),
    arrays(float, (1,), elements=numbers),
    arrays(float, (), elements=numbers),
    arrays(float, (2, 1), elements=numbers),
    st.lists(numbers, min_size=1, max_size=2),
    st.tuples(arrays(float, (1,), elements=numbers), numbers),
    st.just([np.array([1.0, 2.0])]),
)


def agree(ours, theirs, atol=1e-6):
    np.testing.assert_array_equal(ours.time, theirs.time)
    for name in ("outputs", "states", "inputs"):
        one, other = getattr(ours, name), getattr(theirs, name)
        assert one.shape == other.shape
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=atol)


class TestAsInPythonControl:
    """What has a meaning gives the same response."""

    @pytest.mark.slow
    @given(inputs=INPUTS, start=STATES)
    def test_inputs_and_initial_states(self, inputs, start):
        """Numbers, arrays, short vectors, lists of all of these, blocks of inputs."""
        with warnings.catch_warnings(record=True) as theirs:
            warnings.simplefilter("always")
            read = reference(THREE, T, inputs, start)
        # exact, as break points of the inputs can deceive the error control of python-control's run
        exact = ct.forced_response(THREE, T, read.inputs, read.states[:, 0])
        for engine in ENGINES:
            with warnings.catch_warnings(record=True) as ours:
                warnings.simplefilter("always")
                made = simulate(system_for("three", engine), T, inputs, start)
            agree(made, exact)
            assert [w.category for w in ours] == [w.category for w in theirs]
            assert all("too short; padding with zeros" in str(w.message) for w in ours)

    @pytest.mark.parametrize("engine", ENGINES)
    @pytest.mark.parametrize("peak", range(1, M - 1))
    def test_a_pulse_is_not_stepped_over(self, engine, peak):
        """From rest: a solver that tries a long step sees the same input at both of its ends."""
        times = 100 * T
        pulse = np.zeros((3, M))
        pulse[1, peak] = 1.0
        made = simulate(system_for("three", engine), times, pulse, 0)
        agree(made, ct.forced_response(THREE, times, pulse, 0))

    @pytest.mark.parametrize("engine", ENGINES)
    @pytest.mark.parametrize("given", [[1.0], np.array([1.0]), np.array(1.0), (np.ones((1, 1)),)])
    def test_a_short_initial_state(self, engine, given):
        """[1] starts at [1, 0] and warns; a number holds for all states; [0] needs no warning."""
        with pytest.warns(UserWarning, match="initial_state too short; padding with zeros"):
            made = simulate(system_for("one", engine), T, 0, given)
        np.testing.assert_array_equal(made.states[:, 0], [1.0, 0.0])
        assert np.all(simulate(system_for("one", engine), T, 0, 1.0).states[:, 0] == 1.0)
        assert np.all(simulate(system_for("one", engine), T, 0, [0.0]).states == 0.0)

    @pytest.mark.parametrize("inputs", [2.0, [2.0], T, list(T), T[None], [T], [list(T)], [[2.0]]])
    @pytest.mark.parametrize("engine", ENGINES)
    def test_one_input(self, engine, inputs):
        """A list as long as the times has the samples of one input."""
        wanted = reference(ONE, T, inputs, [0.0, 1.0], solve_ivp_kwargs=PRECISE)
        agree(simulate(system_for("one", engine), T, inputs, [0.0, 1.0]), wanted)

    @pytest.mark.slow
    @pytest.mark.parametrize("engine", ENGINES)
    @pytest.mark.parametrize("name", SYSTEMS)
    @pytest.mark.parametrize("squeeze", [None, True, False])
    @pytest.mark.parametrize("transpose", [True, False])
    def test_the_form_of_a_response(self, engine, name, squeeze, transpose):
        """Axes of length 1, the order of axes, and what it unpacks to."""
        t = T if name != "sampled" else 0.1 * np.arange(M)
        how = {"squeeze": squeeze, "transpose": transpose}
        precise = {} if name == "sampled" else {"solve_ivp_kwargs": PRECISE}
        wanted = reference(SYSTEMS[name], t, 1.0, 0.5, **how, **precise)
        agree(simulate(system_for(name, engine), t, 1.0, 0.5, **how), wanted)
        for states in (True, False):
            made = simulate(system_for(name, engine), t, 1.0, 0.5, return_states=states, **how)
            pair = reference(SYSTEMS[name], t, 1.0, 0.5, return_states=states, **how)
            assert [np.shape(part) for part in made] == [np.shape(part) for part in pair]

    @pytest.mark.slow
    @given(
        wanted=st.lists(
            st.one_of(st.floats(0, 1), st.sampled_from(list(T))), min_size=1, max_size=8
        )
    )
    def test_a_response_at_other_times(self, wanted):
        """Inputs keep their corners; the times are those that were asked for."""
        wanted = np.unique(wanted)
        u = np.sin(7 * np.arange(3 * M)).reshape(3, M)
        there = reference(THREE, T, u, 1.0, t_eval=wanted, solve_ivp_kwargs=PRECISE)
        for engine in ENGINES:
            system = system_for("three", engine)
            agree(simulate(system, T, u, 1.0, evaluation_times=wanted), there)

    def test_times_that_differ_by_rounding(self):
        """A last bit more or less than a time of the inputs."""
        wanted = np.sort([np.nextafter(T[2], 0), T[2], np.nextafter(T[3], 1), 0.95])
        made = simulate(COMPILED["one"], T, np.cos(9 * T), 1.0, t_eval=wanted)
        there = reference(ONE, T, np.cos(9 * T), 1.0, t_eval=wanted, solve_ivp_kwargs=PRECISE)
        agree(made, there)
        assert made.statistics.accepted < 1000

    @pytest.mark.parametrize("engine", ENGINES)
    def test_a_sampled_system_starts_with_the_first_of_them(self, engine):
        """And reads the inputs there."""
        t, wanted = 0.1 * np.arange(20), 0.1 * np.arange(3, 9)
        there = reference(SAMPLED, t, np.sin(t), 1.0, t_eval=wanted)
        agree(simulate(system_for("sampled", engine), t, np.sin(t), 1.0, t_eval=wanted), there)

        (first,) = simulate(COMPILED["sampled"], t, np.sin(t), 1.0, t_eval=[0.3]).time
        assert first == 0.3
        with pytest.raises(nlctl.errors.ParameterError, match="needs two times, got one"):
            simulate(SAMPLED, t, np.sin(t), 1.0, t_eval=[0.3])

    def test_the_steps_of_the_integrator(self):
        """None in python-control; there are other times then than those of the inputs."""
        made = simulate(ONE, T, 0, [1.0, 0.0], evaluation_times=None)
        assert made.time[0] == 0.0
        assert made.time[-1] == 1.0
        assert made.time.size != M
        np.testing.assert_allclose(made.outputs, np.cos(made.time), atol=1e-6)

    @pytest.mark.parametrize("engine", ENGINES)
    def test_short_names(self, engine):
        """T, U, X0, t_eval, return_x."""
        system = system_for("one", engine)
        made = simulate(system, T=T, U=T, X0=[1.0, 2.0], t_eval=T[1:3], return_x=True)
        there = simulate(system, T, T, [1.0, 2.0], evaluation_times=T[1:3], return_states=True)
        for part, other in zip(made, there, strict=True):
            np.testing.assert_array_equal(part, other)

    def test_tolerances_for_scipy_are_tolerances(self):
        """``solve_ivp_kwargs`` with rtol and atol: as if they were given themselves."""
        tight = {"rtol": 1e-11, "atol": 1e-13}
        one = simulate(COMPILED["one"], T, 0, 1.0, solve_ivp_kwargs=tight)
        other = simulate(COMPILED["one"], T, 0, 1.0, **tight)
        assert one.statistics == other.statistics
        assert one.statistics.accepted > simulate(COMPILED["one"], T, 0, 1.0).statistics.accepted
        at = simulate(COMPILED["one"], T, 0, 1.0, solve_ivp_kwargs={"t_eval": [0.5]})
        assert at.time == [0.5]

    def test_a_method_of_scipy_in_python_control(self):
        """By any of its three names."""
        for how in (
            {"method": "DOP853"},
            {"solve_ivp_method": "DOP853"},
            {"solve_ivp_kwargs": {"method": "DOP853"}},
        ):
            made = simulate(ONE, T, 0, [1.0, 0.0], **how)
            np.testing.assert_allclose(made.outputs, np.cos(T), atol=1e-7)

    def test_a_run_that_ends_early_at_other_times(self):
        """What was reached of them is there."""
        part = simulate(
            COMPILED["one"], T, 0, 1.0, step=0.05, max_steps=10, ignore_errors=True,
            evaluation_times=[0.1, 0.3, 0.9],
        )  # fmt: skip
        assert not part.success
        np.testing.assert_array_equal(part.time, [0.1, 0.3])
        assert part.outputs.shape == (2,)


REFUSED = [
    ({"solve_ivp_method": "BDF"}, "'BDF' has no meaning in machine code: method='rodas5p'"),
    ({"solve_ivp_method": "RK45"}, "'RK45' has no meaning in machine code: method='tsit5'"),
    ({"solve_ivp_kwargs": {"method": "LSODA"}}, "'LSODA' has no meaning .*method='auto'"),
    ({"solve_ivp_kwargs": {"max_step": 0.1}}, "'max_step' has no meaning .*step="),
    ({"solve_ivp_kwargs": {"first_step": 0.1}}, "'first_step' has no meaning"),
    ({"solve_ivp_kwargs": {"events": []}}, "'events' has no meaning"),
    ({"solve_ivp_kwargs": {"jac": None}}, "'jac' has no meaning"),
    ({"solve_ivp_kwargs": {"atol": [1e-3, 1e-6]}}, "atol must be one number"),
    ({"rtol": "small"}, "needs a number for rtol, got 'small'"),
    ({"evaluation_times": None}, "evaluation_times needs a list of times, or 'T' .*got None"),
]
REFUSED_BY_BOTH = [
    ({"evaluation_times": [0.5, 0.2]}, "evaluation_times needs finite times in increasing order"),
    ({"evaluation_times": [0.5, 1.5]}, r"evaluation_times has 1\.5 s, outside of timepts"),
    ({"evaluation_times": [[0.5]]}, "evaluation_times needs a list of times"),
    ({"t_eval": [0.5], "evaluation_times": [0.2]}, "'evaluation_times' is given twice"),
    ({"t_eval": [0.5], "solve_ivp_kwargs": {"t_eval": [0.5]}}, "'t_eval' is given twice"),
    ({"U": 1.0, "inputs": 2.0}, "'inputs' is given twice, as inputs= and as U="),
    ({"method": "a", "solve_ivp_method": "b"}, "the method is given twice: 'a' and 'b'"),
    ({"solve_ivp_kwargs": 3}, "solve_ivp_kwargs needs a mapping, got 3"),
    ({"initial_state": [1.0, 2.0, 3.0]}, "initial_state needs 2 values for 'three', got 3"),
    ({"initial_state": "x"}, "initial_state needs real numbers, got 'x'"),
    ({"initial_state": [1.0, None]}, "initial_state needs real numbers, got None"),
    ({"initial_state": [0.0, np.nan]}, r"initial_state has nan at 'three\.q'"),
    ({"initial_state": np.inf}, r"initial_state has inf at 'three\.p'"),
    ({"inputs": np.zeros((2, M))}, r"inputs need shape \(3, 6\) for these times, got \(2, 6\)"),
    ({"inputs": [1.0, 2.0]}, r"inputs need shape \(3, 6\) for these times, got \(2, 6\)"),
    ({"inputs": [1.0, np.zeros((2, 5))]}, r"inputs\[1\] has shape \(2, 5\)"),
    ({"inputs": [1.0, "b", 2.0]}, r"inputs\[1\] needs real numbers, got 'b'"),
    ({"inputs": None}, "inputs need real numbers, got None"),
    ({"inputs": 1j}, "inputs need real numbers, got 1j"),
    ({"inputs": [0.0, np.where(T[3] == T, np.nan, T), 0.0]}, r"inputs has nan at 'b', t = 0\.6 s"),
    ({"inputs": np.full((3, M), -np.inf)}, "inputs has -inf at 'a', t = 0 s"),
]


class TestRefused:
    """What has no meaning is named, with what comes nearest."""

    @pytest.mark.parametrize(("how", "told"), REFUSED)
    def test_in_machine_code(self, how, told):
        """Of a compiled diagram, and of one that is to run as machine code."""
        for system, engine in ((COMPILED["three"], None), (THREE, "native")):
            with pytest.raises(nlctl.errors.ParameterError, match=told):
                simulate(system, T, engine=engine, **how)

    @pytest.mark.parametrize(("how", "told"), REFUSED_BY_BOTH)
    @pytest.mark.parametrize("engine", ENGINES)
    def test_in_both_engines(self, engine, how, told):
        """With the same words."""
        with pytest.raises(nlctl.errors.ParameterError, match=told):
            simulate(system_for("three", engine), T, **how)

    @pytest.mark.parametrize("how", [{"max_steps": 10}, {"step": 0.1}])
    def test_in_python_control(self, how):
        """Settings of machine code."""
        with pytest.raises(
            nlctl.errors.ParameterError, match="has no meaning in python-control: engine="
        ):
            simulate(ONE, T, **how)

    @pytest.mark.parametrize("engine", ENGINES)
    def test_unknown_names(self, engine):
        """The nearest name is given; it is Python's own kind of error as well."""
        system = system_for("one", engine)
        told = "unknown argument 'sqeeze' of input_output_response; nearest: 'squeeze'"
        with pytest.raises(nlctl.errors.UnknownNameError, match=told):
            simulate(system, T, sqeeze=True)
        with pytest.raises(TypeError, match=r"'initial_states'.*nearest: 'initial_state'"):
            simulate(system, T, initial_states=[1.0])
        with pytest.raises(nlctl.errors.ParameterError, match="timepts is missing"):
            simulate(system)

    def test_an_unknown_keyword_for_scipy(self):
        """In ``solve_ivp_kwargs``."""
        with pytest.raises(
            nlctl.errors.UnknownNameError, match=r"'rtoll' in solve_ivp_kwargs.*'rtol'"
        ):
            simulate(COMPILED["one"], T, solve_ivp_kwargs={"rtoll": 1e-3})

    def test_what_is_no_diagram(self):
        """A list of diagrams, which python-control would run one by one."""
        with pytest.raises(nlctl.errors.ParameterError, match=r"system needs a diagram .*got list"):
            simulate([ONE, THREE], T)


class TestEnsembles:
    """Members start from finite numbers."""

    def test_values_that_are_no_numbers(self):
        """The member is named."""
        run: Any = nlctl.ensemble_response
        with pytest.raises(nlctl.errors.ParameterError, match=r"nan at 'three\.q', member 1"):
            run(COMPILED["three"], T, 0, {"q": [0.0, np.nan]})
        with pytest.raises(nlctl.errors.ParameterError, match=r"inf at 'three\.q':"):
            run(COMPILED["three"], T, 0, {"q": np.inf})
        with pytest.raises(
            nlctl.errors.ParameterError, match=r"'three\.q' needs a number, or one for"
        ):
            run(COMPILED["three"], T, 0, {"q": [[0.0]]})
        with pytest.raises(nlctl.errors.ParameterError, match="inputs has nan at 'c', t = 0 s"):
            run(COMPILED["three"], T, [0.0, 1.0, np.nan])
        with pytest.raises(nlctl.errors.ParameterError, match=r"needs real numbers, got '0.5'"):
            run(COMPILED["three"], T, 0, "0.5")
        with pytest.raises(nlctl.errors.ParameterError, match=r"nan at 'three\.p.*\(member 1\)"):
            run(COMPILED["three"], T, 0, [[0.0, 1.0], [np.nan, 1.0]])
