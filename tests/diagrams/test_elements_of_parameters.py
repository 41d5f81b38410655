"""Elements of parameters that are arrays: one name for each, wherever it is used."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.robustness import Space, Uncertain, nominal, resolved
from nlctl.errors import ParameterError

MATRIX = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
SPELLINGS = ("[{}, {}]", "[{},{}]", "[{}][{}]")
TIMES = np.linspace(0.0, 1.0, 5)


def weighted(kind=np.array, name="plant"):
    """x' = -sum(W[0]) x, y' = -sum(W[1]) y of a third-party block."""
    return ct.nlsys(
        lambda t, x, u, p: [-sum(p["W"][0]) * x[0], -sum(p["W"][1]) * x[1]], None,
        states=["x", "y"], inputs=0, params={"W": kind(MATRIX)}, name=name,
    )  # fmt: skip


@given(
    row=st.integers(0, 1), column=st.integers(0, 2), value=st.floats(-1, 9),
    spelling=st.sampled_from(SPELLINGS), kind=st.sampled_from((np.array, list)),
)  # fmt: skip
def test_an_element_is_set_and_no_other(row, column, value, spelling, kind):
    """Of arrays and of nested lists, as NumPy or as lists write the index."""
    name = "plant.W" + spelling.format(row, column)
    expected = np.array(MATRIX)
    expected[row, column] = value
    found = nlctl.compile(weighted(kind)).parameter_vector({name: value})
    assert np.array_equal(found, expected.ravel())


@pytest.mark.parametrize(
    "index",
    ["[1]", "[2, 0]", "[0, 3]", "[0, 1, 2]", "[-1, 0]", "[]", "[a]", "[0, 1", "[0, 1]]", "[0.5]"],
)
@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_what_is_no_element_is_refused(index, engine):
    """A row is not a number, and what cannot be read is nothing."""
    with pytest.raises(
        ParameterError, match=r"not one number: name one, such as 'plant\.W\[0, 0\]'"
    ):
        nlctl.input_output_response(
            weighted(), TIMES, 0, [1.0, 1.0], params={f"plant.W{index}": 9.0}, engine=engine
        )


def test_one_number_has_no_elements():
    lag = ct.nlsys(lambda t, x, u, p: [-p["a"] * x[0]], None, states=1, inputs=0,
                   params={"a": 2.0}, name="lag")  # fmt: skip
    with pytest.raises(ParameterError, match=r"'lag\.a' is one number, of which 'lag\.a\[0\]'"):
        nlctl.input_output_response(lag, TIMES, 0, [1.0], params={"lag.a[0]": 9.0})


@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_elements_go_on_top_of_the_whole_whatever_the_order(engine):
    """Alone and in a diagram."""
    other = nlctl.block(nlctl.Gain(), "gain")
    inside = nlctl.interconnect([weighted(), other], inputs=["u"], outputs=["v"])
    params = {"plant.W[0, 1]": 1.0, "plant.W": np.full((2, 3), 0.5)}
    for system in (weighted(), inside):
        for given_params in (params, dict(reversed(params.items()))):
            run = nlctl.input_output_response(
                system, TIMES, 0, [1.0, 1.0], params=given_params, engine=engine
            )
            assert np.allclose(run.states[:, -1], np.exp([-2.0, -1.5]), atol=1e-7)


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_a_name_means_the_same_to_runs_derivatives_and_spaces(spelling):
    """The derivative by W[0, 2] is -t exp(-6 t), in the run and at a point."""
    name = f"plant.W{spelling.format(0, 2)}"
    made = nlctl.sensitivity_response(
        weighted(), TIMES, initial_state=[1.0, 1.0], with_respect_to=[name]
    )
    assert np.allclose(made["x", name], -TIMES * np.exp(-6 * TIMES), atol=1e-7)
    assert np.allclose(made["y", name], 0)
    rates, _ = nlctl.compile(weighted()).parameter_jacobian([name], [2.0, 3.0])
    assert rates.ravel().tolist() == [-2.0, 0.0]
    space = resolved(Space(quantities=(Uncertain(name=name, bounds=(0, 9)),)), weighted())
    assert list(nominal(space).values()) == [3.0]
    found = nlctl.fit(
        weighted(), TIMES, data={"x": np.exp(-5 * TIMES)}, parameters={name: 3.0},
        initial_state=[1.0, 1.0], rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    assert found[name] == pytest.approx(2.0, rel=1e-6)
