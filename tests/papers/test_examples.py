"""Loops of papers against closed forms, and in both engines."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import nlctl
from nlctl.analysis.papers import chowdhary_2010 as chowdhary
from nlctl.analysis.papers import tabuada_2007 as tabuada
from nlctl.papers import canudas_de_wit_1995, chowdhary_2010, karason_1994, lv_2017, tabuada_2007

TIGHT = {"rtol": 1e-9, "atol": 1e-15}
rates = st.floats(0.1, 10.0)
angles = st.floats(0.0, 2 * np.pi)

LOOPS = {
    "tabuada_2007.example_1": (tabuada_2007.example_1, tabuada_2007.INITIAL_STATE, 0.3),
    "karason_1994.example_1": (karason_1994.example_1, karason_1994.INITIAL_STATE, 2.0),
    "chowdhary_2010.example_1": (chowdhary_2010.example_1, chowdhary_2010.INITIAL_STATE, 0.4),
    "canudas_de_wit_1995.example_2": (canudas_de_wit_1995.example_2, {}, 0.02),
    "canudas_de_wit_1995.example_3": (canudas_de_wit_1995.example_3, {}, 0.01),
    "canudas_de_wit_1995.example_4": (canudas_de_wit_1995.example_4, {}, 0.01),
}


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize("name", LOOPS)
def test_both_engines_agree(name):
    """Outputs of the reference engine and of machine code, from the printed start."""
    make, start, horizon = LOOPS[name]
    times = np.linspace(0, horizon, 41)
    runs = [
        nlctl.input_output_response(make(), times, 0, dict(start), engine=engine, **TIGHT)
        for engine in ("python-control", "native")
    ]
    for label, expected, found in zip(
        make().output_labels, *(r.outputs for r in runs), strict=True
    ):
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * scale, err_msg=label)


@given(a=rates, b=rates, sigma=st.floats(0.01, 1.0))
def test_the_least_interval_is_that_of_its_differential_equation(a, b, sigma):
    """y' = (1 + y)(a + b y) from 0: at the closed form it is at sigma."""
    end = tabuada_2007.least_interval(a, b, sigma)
    made = solve_ivp(
        lambda t, y: (1 + y) * (a + b * y), (0, end), [0.0], rtol=1e-10, atol=1e-12
    )  # fmt: skip
    assert made.y[0, -1] == pytest.approx(sigma, rel=1e-7)


@given(x=angles, e=angles)
def test_the_effect_of_an_error_is_within_the_least_b(x, e):
    """2 x^T P B K e <= 2 |P B K| |x| |e|, in all directions; the quoted 8 is not enough in one."""
    x, e = np.array([np.cos(x), np.sin(x)]), np.array([np.cos(e), np.sin(e)])
    assert 2 * x @ tabuada.LYAPUNOV_MATRIX @ tabuada.BK @ e <= tabuada.coupling() * (1 + 1e-12)
    U, _, V = np.linalg.svd(tabuada.LYAPUNOV_MATRIX @ tabuada.BK)
    assert 2 * U[:, 0] @ tabuada.LYAPUNOV_MATRIX @ tabuada.BK @ V[0] == pytest.approx(8.5)


@pytest.mark.slow
@given(angle=angles, sigma=st.sampled_from((0.01, 0.03, 0.05)))
def test_no_interval_undercuts_the_bound(angle, sigma):
    """From any direction, for any sigma up to the article's, and V falls."""
    start = {"plant.x[0]": np.cos(angle), "plant.x[1]": np.sin(angle)}
    times = np.linspace(0, 0.4, 41)
    loop = nlctl.compile(tabuada_2007.example_1(sigma=sigma))
    made = nlctl.input_output_response(loop, times, 0, start, **TIGHT)
    between = np.diff(made.events["time"].to_numpy())
    assert between.min() >= tabuada.interval_bound(sigma) * (1 - 1e-7)
    x = made.outputs[:2]
    assert np.all(np.diff(np.einsum("ik,ij,jk->k", x, tabuada.LYAPUNOV_MATRIX, x)[1:]) < 0)


def test_the_plant_of_the_record_is_that_of_the_diagram():
    """What the page computes norms of is what is simulated."""
    plant = next(s for s in tabuada_2007.example_1().syslist if s.name == "plant")
    np.testing.assert_array_equal(plant.A, tabuada.PLANT_MATRIX)
    np.testing.assert_array_equal(plant.B @ [[1.0, -4.0]], tabuada.BK)


def test_the_lyapunov_function_of_concurrent_learning_is_balanced():
    """V(t) - V(s) is the integral of -E^T Q E - 2 (W_hat - W)^T Omega (W_hat - W)."""
    times = np.linspace(0.5, 4.0, 7001)
    loop = chowdhary_2010.example_1()
    made = nlctl.input_output_response(
        loop, np.append(0.0, times), 0, chowdhary_2010.INITIAL_STATE, **TIGHT
    )  # fmt: skip
    signals = dict(zip(nlctl.state_names(loop), made.states[:, 1:], strict=True))
    run = type("Run", (), {"time": times, "__getitem__": lambda self, name: signals[name]})()
    V, Omega = chowdhary.lyapunov_function(run), chowdhary.record_matrix(run)
    E = np.array([signals[f"plant.x{i}"] - signals[f"model.xm{i}"] for i in (1, 2)])
    off = chowdhary.weights(run) - np.array(chowdhary.W)[:, None]
    rate = -np.sum(E**2, axis=0) - 2 * np.einsum("ik,ij,jk->k", off, Omega, off)
    assert V[-1] - V[0] == pytest.approx(np.trapezoid(rate, times), rel=1e-5)


def test_presliding_of_a_slow_push_has_a_closed_form():
    """Before F_s: x = -(F_s / sigma_0) ln(1 - F / F_s); pushed in 100 s to 0.8 F_s."""
    times = np.linspace(0, 100, 101)
    loop = canudas_de_wit_1995.example_1()
    made = nlctl.input_output_response(loop, times, 0.012 * times, rtol=1e-9, atol=1e-13)
    assert made.outputs[0, -1] == pytest.approx(-1.5e-5 * np.log(1 - 0.8), rel=2e-3)


def test_the_examples_of_lv_are_those_of_nlctl_paper():
    """One definition, two names."""
    assert lv_2017.example_1 is nlctl.paper.example_1
    assert lv_2017.example_2 is nlctl.paper.example_2


def test_what_karason_learns_from_has_a_name():
    """Another word is refused."""
    with pytest.raises(nlctl.errors.ParameterError, match="learns_from"):
        karason_1994.example_1(learns_from="half")
