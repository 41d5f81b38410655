"""The range that `slow_drift` gives for a burst: how often the burst lies in it."""

import functools
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nlctl
from nlctl.analysis.lyapunov.nussbaum.slow_drift import slow_drift
from nlctl.errors import DiagramError

NAMES = ("zeta", "r", "u")
SHARE = 0.5  # of the time until the burst, from which it is forecast


def covered(time, signals, burst, N, window):
    """Whether the burst lies in the range that its first half tells."""
    keep = time <= SHARE * burst
    seen = SimpleNamespace(
        time=time[keep], outputs=signals[:, keep], output_labels=list(NAMES), params={}
    )
    found = slow_drift(seen, N, window=window)
    assert found.time < found.burst_range[0] <= found.burst <= found.burst_range[1]
    return found.burst_range[0] <= burst <= found.burst_range[1]


def scalar_loop(rng):
    """r' = u + d(t), u = N beta r, zeta' = beta r^2, with a lobe of N until zeta = 3."""
    height, beta, d_0, d_1 = rng.uniform((10, 1.5, 1, 0), (30, 4, 2, 1))
    w, start = rng.uniform((1, 1), (4, 2.2))

    def N(zeta):  # noqa: N802
        return -height * np.sin(np.pi / 2 * (zeta - 1))

    def rhs(t, x):
        eta = beta * x[1]
        return x[1] * eta, N(x[0]) * eta + d_0 + d_1 * np.sin(w * t)

    def crossed(t, x):
        return x[0] - 3.0

    crossed.terminal = True
    run = solve_ivp(
        rhs, (0, 3000), [start, 0], "LSODA", events=crossed, rtol=1e-8, atol=1e-10,
        dense_output=True,
    )  # fmt: skip
    burst, period = float(run.t_events[0][0]), 2 * np.pi / w
    time = np.arange(0, burst, 0.05)
    zeta, r = run.sol(time)
    window = period * max(1, round(3 / period))
    return time, np.array([zeta, r, N(zeta) * beta * r]), burst, N, window


def late_example_2(compiled, rng):
    """Example 2 with another disturbance and gain, from a zeta close to the end of its lobe."""
    labels = list(compiled.system.output_labels)
    start = {"law.zeta": rng.uniform(2.94, 2.965)}
    params = {
        "plant.d_amplitude": rng.uniform(1.5, 4.0),
        "plant.d_frequency": rng.uniform(0.05, 0.4),
        "law.beta": rng.uniform(3.0, 7.0),
    }
    times, rows = [], []
    for begin in range(0, 1000, 50):
        grid = begin + 0.01 * np.arange(5001)
        run = nlctl.input_output_response(
            compiled, grid, 0, start, params=params, rtol=1e-6, atol=1e-8, ignore_errors=True,
            max_steps=200_000,
        )  # fmt: skip
        signals = np.array([run.outputs[labels.index(name)] for name in NAMES])
        beyond = np.flatnonzero(signals[0] >= 3)
        end = beyond[0] if beyond.size else -1
        times.append(run.time[:end])
        rows.append(signals[:, :end])
        if beyond.size:
            burst = float(
                np.interp(3.0, signals[0][end - 1 : end + 1], run.time[end - 1 : end + 1])
            )
            return np.concatenate(times), np.concatenate(rows, axis=1), burst
        start = run.states[:, -1]
    return None


@pytest.mark.weekly
def test_scalar_loops():
    """A few loops whose balance is exact, every day."""
    rng = np.random.default_rng(0)
    for _ in range(2):
        assert covered(*scalar_loop(rng))


@pytest.mark.weekly
def test_the_burst_lies_in_its_range_in_nine_of_ten_loops():
    """Over 40 loops whose burst was simulated, of both kinds."""
    rng = np.random.default_rng(5)
    seen = [covered(*scalar_loop(rng)) for _ in range(24)]
    compiled = nlctl.compile(nlctl.paper.example_2())
    for _ in range(30):
        run = late_example_2(compiled, rng)
        if run is not None and run[2] > 14 * 4 * np.pi:  # five windows in its half
            seen.append(covered(*run, nlctl.functions.nussbaum, 4 * np.pi))
    assert len(seen) >= 40
    assert np.mean(seen) >= 0.9


@functools.cache
def example_2():
    """Example 2 compiled, and 90 s of it."""
    loop = nlctl.compile(nlctl.paper.example_2())
    return loop, nlctl.input_output_response(loop, np.linspace(0, 90, 9001))


class TestOfWhichLoop:
    def test_the_loop_gives_its_function(self):
        """With the loop, N is that of its law, and the samples are compared with it."""
        loop, response = example_2()
        assert slow_drift(response, loop=loop, window=4 * np.pi) == slow_drift(
            response, window=4 * np.pi
        )

    def test_a_response_of_another_loop_is_refused(self):
        """Of the same blocks with another Nussbaum function, and of another number of states."""
        _, response = example_2()
        controller = nlctl.paper.example_2().syslist[2]
        law = nlctl.controllers.NussbaumLaw(beta=5.0, N=lambda zeta: -np.exp(zeta))
        other = nlctl.paper.example_2(controller=nlctl.controllers.replaced(controller, law=law))
        with pytest.raises(DiagramError, match=r"not of 'example_2': u is .*, and the loop says"):
            slow_drift(response, loop=other)
        with pytest.raises(DiagramError, match="states"):
            slow_drift(response, loop=nlctl.paper.example_1())

    def test_another_wiring_is_refused(self):
        """A minus at the plant's input."""
        other = nlctl.paper.example_2()
        signs = np.ones((other.connect_map.shape[0], 1))
        signs[other.input_offset[[s.name for s in other.syslist].index("plant")]] = -1
        other.set_connect_map(other.connect_map * signs)
        with pytest.raises(DiagramError, match=r"'v' of block 'plant' is -'v'"):
            slow_drift(example_2()[1], loop=other)

    def test_one_time_is_printed_and_no_double_minus(self):
        """What the README shows."""
        text = str(slow_drift(example_2()[1], window=4 * np.pi))
        assert "- -" not in text
        assert text.count("the budget lasts until") <= 1
