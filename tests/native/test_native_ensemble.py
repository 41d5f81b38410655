"""Ensembles: independent members, the same numbers whatever runs beside them."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.metrics import Metric, final, peak


@nlctl.equation
def decay(x, v):
    """x' = -x + x^2 + v: from below 1 it decays, from above it escapes."""
    (x1,) = x
    return -x1 + x1 * x1 + v


@nlctl.record
class Gain:
    """v = k u + c."""

    k: float = nlctl.param(1.0, unit="1", meaning="gain", above=0)
    c: float = nlctl.param(0.0, unit="1", meaning="offset")
    inputs, outputs, states, feedthrough = ("u",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (p.k * u[0] + p.c,)


T = np.linspace(0, 3, 31)
END = Metric(key="end", signal="y", unit="1", meaning="final value", function=final)
LATE = Metric(key="late", signal="y", unit="1", meaning="late peak", function=peak, start=2.0)


@pytest.fixture(scope="module")
def loop():
    """A plant behind a gain, compiled."""
    blocks = {"gain": Gain(), "plant": nlctl.PureFeedback(order=1, f=decay)}
    return nlctl.compile(nlctl.interconnect(blocks, inputs=["u"], outputs=["y", "v"], name="loop"))


def test_members_are_the_single_runs(loop):
    """Every row and every kept signal: to rounding as a single run, bit for bit alone."""
    k, x0 = np.array([0.5, 1.0, 2.0]), np.array([0.1, 0.2, -0.3])
    made = nlctl.ensemble_response(
        loop, T, 0.1, {"plant.x1": x0}, params={"gain.k": k}, metrics=[END, LATE], keep=["y"]
    )
    for i in range(3):
        alone = nlctl.input_output_response(
            loop, T, 0.1, {"plant.x1": x0[i]}, params={"gain.k": k[i]}
        )
        np.testing.assert_allclose(made.signals["y"][i], alone.y[0], rtol=1e-12, atol=1e-14)
        replayed = nlctl.ensemble_response(
            loop, T, 0.1, {"x1": x0[i]}, params={"gain.k": k[i]}, keep=["y"]
        ).signals["y"][0]
        np.testing.assert_array_equal(made.signals["y"][i], replayed)
        assert made.table["end"][i] == replayed[-1]
        assert made.table["late"][i] == peak(T[T >= 2], replayed[T >= 2])
        assert made.table["gain.k"][i] == k[i]
        assert made.table["plant.x1(0)"][i] == x0[i]
    assert list(made.table["status"]) == ["OK"] * 3


@pytest.mark.parametrize("threads", [2, 8])
def test_any_number_of_threads_gives_the_same_bits(loop, threads):
    """Forty members on one thread and on several."""
    x0 = np.random.default_rng(1).uniform(-1, 0.9, 40)
    settings = {"metrics": [END, LATE], "keep": ["y", "v"]}
    one = nlctl.ensemble_response(loop, T, 0, {"x1": x0}, threads=1, **settings)
    several = nlctl.ensemble_response(loop, T, 0, {"x1": x0}, threads=threads, **settings)
    assert one.table.equals(several.table)
    for signal in ("y", "v"):
        np.testing.assert_array_equal(one.signals[signal], several.signals[signal])


def test_closed_form_of_every_member(loop):
    """x(t) = x0 / (x0 + (1 - x0) e^t) for v = 0."""
    x0 = np.linspace(-2, 0.9, 15)
    made = nlctl.ensemble_response(loop, T, 0, {"x1": x0}, keep=["y"], rtol=1e-10, atol=1e-12)
    wanted = x0[:, None] / (x0[:, None] + (1 - x0[:, None]) * np.exp(T))
    np.testing.assert_allclose(made.signals["y"], wanted, atol=1e-8)


@pytest.mark.parametrize("method", ["tsit5", "rodas5p"])
@pytest.mark.parametrize("count", [1, 2, 9])
def test_every_method_reaches_the_closed_form(loop, method, count):
    """The stiff method takes members one by one, the other one side by side."""
    x0 = np.linspace(-2, 0.9, count)
    tight = {"keep": ["y"], "rtol": 1e-8, "atol": 1e-10, "method": method}
    made = nlctl.ensemble_response(loop, T, 0, {"x1": x0}, **tight)
    wanted = x0[:, None] / (x0[:, None] + (1 - x0[:, None]) * np.exp(T))
    assert list(made.table["status"]) == ["OK"] * count
    np.testing.assert_allclose(made.signals["y"], wanted, atol=1e-6)


def test_a_diverged_member_is_a_status_in_its_row(loop):
    """From 1.5 the state escapes at t = ln 3; the other members are untouched."""
    made = nlctl.ensemble_response(loop, T, 0, {"x1": [0.5, 1.5, 0.2]}, metrics=[END], keep=["y"])
    status, end = made.table["status"], made.table["end"]
    assert status[0] == status[2] == "OK"
    assert status[1] in ("DIVERGED", "STEP_TOO_SMALL")
    assert made.table["time"][1] == pytest.approx(np.log(3), abs=1e-4)
    assert np.isnan(end[1])
    assert np.isfinite(end[[0, 2]]).all()
    after = np.log(3) + 1e-3 < T
    assert np.isnan(made.signals["y"][1][after]).all()
    assert np.isfinite(made.signals["y"][[0, 2]]).all()


def test_numbers_hold_for_all_members_and_nothing_varied_is_one_member(loop):
    """A scalar is broadcast; without arrays there is one row."""
    made = nlctl.ensemble_response(loop, T, 0.1, {"x1": [0.1, 0.2]}, params={"gain.k": 2.0})
    assert list(made.table["gain.k"]) == [2.0, 2.0]
    assert len(nlctl.ensemble_response(loop, T, 0.1).table) == 1


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (
            {"params": {"gain.k": [1.0, -1.0]}},
            nlctl.errors.ParameterError,
            r"k > 0, got -1.*member 1",
        ),
        ({"params": {"gain.kk": [1.0]}}, nlctl.errors.UnknownNameError, "nearest: 'gain.k'"),
        (
            {"initial_state": {"plant.x2": [1.0]}},
            nlctl.errors.UnknownNameError,
            "nearest: 'plant.x1'",
        ),
        ({"keep": ["w"]}, nlctl.errors.UnknownNameError, "unknown signal 'w'"),
        (
            {"params": {"gain.k": [1.0, 2.0]}, "initial_state": {"x1": [0.1, 0.2, 0.3]}},
            nlctl.errors.ParameterError,
            "arrays of one length",
        ),
    ],
)
def test_bad_input_names_the_culprit(loop, arguments, error, message):
    """Nothing runs before all members are known to be good."""
    with pytest.raises(error, match=message):
        nlctl.ensemble_response(loop, T, **arguments)


@pytest.mark.parametrize("times", [[0.0], [1.0, 0.0], [0.0, np.nan]])
def test_bad_time_grids_are_refused_as_for_one_run(loop, times):
    """Times must be finite, increasing, at least two."""
    with pytest.raises(nlctl.errors.ParameterError, match="timepts needs"):
        nlctl.ensemble_response(loop, times)


def test_interrupt_returns_what_is_finished(loop):
    """Ctrl-C after some members: at least three rows, all whole."""

    def interrupt(done):
        if done >= 3:
            raise KeyboardInterrupt

    x0 = np.linspace(0, 0.5, 200)
    made = nlctl.ensemble_response(
        loop, T, 0, {"x1": x0}, metrics=[END], threads=1, progress=interrupt
    )
    assert 3 <= len(made.table) < 200
    assert made.table["end"].notna().all()
    np.testing.assert_array_equal(made.table["plant.x1(0)"], x0[made.table.index])


def test_third_party_parameters_vary_by_their_bare_names():
    """A ct.nlsys parameter is an array over the members as well."""
    lag = ct.nlsys(
        lambda t, x, u, params: [-params["a"] * x[0]],
        lambda t, x, u, params: x,
        inputs=0, outputs=["y"], states=["x"], name="lag", params={"a": 1.0},
    )  # fmt: skip
    a = np.array([0.5, 1.0, 2.0])
    made = nlctl.ensemble_response(
        nlctl.compile(lag), T, 0, {"x": 1.0}, params={"a": a}, metrics=[END]
    )
    np.testing.assert_allclose(made.table["end"], np.exp(-3 * a), rtol=1e-4)
