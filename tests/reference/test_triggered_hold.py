"""Event-triggered sampling, in both engines: closed forms, and Tabuada's bound on the intervals."""

import control as ct
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import nlctl

TIGHT = {"rtol": 1e-10, "atol": 1e-12}
engines = pytest.mark.parametrize("engine", ["python-control", "native"])


def loop(A, B, K, sigma):
    """x' = A x + B K w with w = x from the last sample, where |w - x| exceeds sigma |x|."""
    A, B, K = (np.array(each, dtype=float) for each in (A, B, K))
    n = A.shape[0]
    x_names, w_names = [f"u{i + 1}" for i in range(n)], [f"w{i + 1}" for i in range(n)]
    plant = ct.ss(A, B, np.eye(n), 0, inputs="v", outputs=x_names, name="plant")

    def rule(t, x, u, params):
        state, held = u[:n], u[n:]
        error = held - state
        return [K @ held, sigma * np.sqrt(state @ state) - np.sqrt(error @ error)]

    blocks = {
        "plant": plant,
        "hold": nlctl.TriggeredHold(n=n),
        "rule": ct.nlsys(None, rule, inputs=[*x_names, *w_names], outputs=["v", "trigger"],
                         name="rule"),
    }  # fmt: skip
    return nlctl.interconnect(blocks, outputs=[*x_names, "interval", "trigger"])


def samples(made):
    """Times of the samples behind the first one."""
    rows = made.events
    return rows["time"][(rows["block"] == "hold") & (rows["which"] == "guard 1")].to_numpy()


@pytest.mark.parted
@engines
@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.1, 0.3, 0.9])
def test_intervals_of_a_scalar_loop(sigma, engine):
    """x' = x - 2 w: x = w (2 - exp(s)), and exp(s) - 1 = sigma (2 - exp(s)) at the next sample."""
    interval = np.log(2 - 1 / (1 + sigma))
    times = np.r_[0.0, interval * (np.arange(12) + 0.5)]
    made = nlctl.input_output_response(
        loop([[1]], [[1]], [-2], sigma), times, 0, {"plant.x[0]": 1.0}, engine=engine, **TIGHT
    )
    np.testing.assert_allclose(samples(made), interval * np.arange(1, 12), rtol=0, atol=1e-8)
    last = (1 + sigma) ** -np.arange(12.0)
    np.testing.assert_allclose(
        made.outputs[0, 1:], last * (2 - np.exp(interval / 2)), rtol=0, atol=1e-8
    )
    np.testing.assert_allclose(made.outputs[1], np.r_[0, 0, np.full(11, interval)], atol=1e-8)


A, B, K = [[0, 1], [-2, 3]], [[0], [1]], [1, -4]  # the linear example
P, Q = np.array([[1, 0.25], [0.25, 1]]), np.array([[0.5, 0.25], [0.25, 1.5]])


def bound(sigma):
    """Until |e| / |x| has come from 0 to sigma at (1 + r) (|A + B K| + |B K| r)."""
    BK = np.array(B) @ np.array([K])
    a, b = np.linalg.norm(A + BK, 2), np.linalg.norm(BK, 2)
    return (np.log1p(sigma) - np.log1p(b * sigma / a)) / (a - b)


def test_the_example_is_that_of_the_theorem():
    """P is a Lyapunov matrix of the closed loop, and sigma = 0.05 keeps its decay."""
    BK = np.array(B) @ np.array([K])
    closed = A + BK
    np.testing.assert_allclose(closed.T @ P + P @ closed, -Q, atol=1e-15)
    coupled = np.linalg.norm(BK.T @ P + P @ BK, 2)
    assert np.linalg.eigvalsh(Q)[0] / coupled > 0.05


@engines
@pytest.mark.slow
@pytest.mark.parametrize("angle", [1.0, pytest.param(0.0, marks=pytest.mark.weekly)])
def test_the_bound_on_the_intervals_is_never_undercut(angle, engine):
    """Tabuada (2007): and the state decays, since sigma is below the bound of the theorem."""
    sigma = 0.05
    start = {"plant.x[0]": np.cos(angle), "plant.x[1]": np.sin(angle)}
    times = np.linspace(0, 2, 401)
    made = nlctl.input_output_response(
        loop(A, B, K, sigma), times, 0, start, engine=engine, **TIGHT
    )
    taken = samples(made)
    intervals = np.diff(np.r_[0.0, taken])
    assert taken.size > 20
    assert intervals.min() >= bound(sigma) * (1 - 1e-9)
    last = np.searchsorted(taken, times[1:] * (1 + 1e-12), side="right")
    np.testing.assert_allclose(made.outputs[2, 1:], np.r_[0.0, intervals][last], rtol=0, atol=1e-7)
    assert np.all(made.outputs[3, 1:] >= -1e-9)  # no error beyond sigma |x|
    energy = np.einsum("ik,ij,jk->k", made.outputs[:2], P, made.outputs[:2])
    assert np.all(np.diff(energy[1:]) < 0)


@engines
def test_samples_of_the_example_are_taken_as_computed_by_hand(engine):
    """From sample to sample x = (exp(A s) + int exp(A r) dr B K) w."""
    sigma, x, t, wanted = 0.05, np.array([1.0, -0.5]), 0.0, []
    M = np.zeros((4, 4))
    M[:2, :2], M[:2, 2:] = A, np.array(B) @ np.array([K])

    def state(s, w):
        return (expm(M * s) @ np.r_[w, w])[:2]

    def trigger(s, w):
        z = state(s, w)
        return sigma * np.linalg.norm(z) - np.linalg.norm(w - z)

    for _ in range(8):
        s = bound(sigma)
        while trigger(s + 0.01, x) > 0:
            s += 0.01
        s = brentq(trigger, s, s + 0.01, args=(x,), xtol=1e-14)
        x, t = state(s, x), t + s
        wanted.append(t)
    made = nlctl.input_output_response(
        loop(A, B, K, sigma), [0.0, t + 1e-3], 0, {"plant.x[0]": 1.0, "plant.x[1]": -0.5},
        engine=engine, **TIGHT,
    )  # fmt: skip
    np.testing.assert_allclose(samples(made)[:8], wanted, rtol=0, atol=1e-7)


def with_threshold(threshold):
    """x = t, held where it is further from what is held than a function of time."""
    plant = ct.nlsys(lambda t, x, u, p: [1.0], inputs=0, states=1, outputs=["u1"], name="plant")
    rule = ct.nlsys(
        None, lambda t, x, u, p: [threshold(t) - abs(u[1] - u[0])], inputs=["u1", "w1"],
        outputs=["trigger"], name="rule",
    )  # fmt: skip
    blocks = {"plant": plant, "hold": nlctl.TriggeredHold(n=1), "rule": rule}
    return nlctl.interconnect(blocks, outputs=["u1"])


@pytest.mark.parted
@pytest.mark.parametrize("how", [{"engine": "python-control"}, {}, {"method": "taylor"}])
def test_a_threshold_that_falls_to_0_has_no_end_of_samples(how):
    """t_k+1 - t_k = (1 - t_k+1) / 2: 1 - (2 / 3)^k, and none from t = 1 on."""
    system = with_threshold(lambda t: 0.5 * (1 - t))
    made = nlctl.input_output_response(system, [0, 1.5], 0, ignore_errors=True, **how, **TIGHT)
    np.testing.assert_allclose(samples(made)[:20], 1 - (2 / 3) ** np.arange(1, 21), atol=1e-9)
    with pytest.raises(nlctl.errors.ZenoError, match="before t = 1 s") as caught:
        nlctl.input_output_response(system, [0, 1.5], 0, **how)
    assert abs(caught.value.time - 1) < 1e-9


@engines
def test_a_threshold_that_decays_has_an_end_of_samples(engine):
    """exp(-3 t) is never 0: samples are as far apart as 1 / n, and the run comes to its end."""
    made = nlctl.input_output_response(
        with_threshold(lambda t: 0.3 * np.exp(-3 * t)), [0, 1], 0, engine=engine, **TIGHT
    )
    taken = np.r_[0.0, samples(made)]
    np.testing.assert_allclose(np.diff(taken), 0.3 * np.exp(-3 * taken[1:]), atol=1e-9)
    assert taken.size > 20
