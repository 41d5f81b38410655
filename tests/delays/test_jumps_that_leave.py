"""When jumps leave delays that vary, in closed form, and numbers of signals that jump there."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.metrics import Metric, breaks_of, highest, lowest

END, TIMES = 5.0, np.linspace(0, 5, 401)
SOURCE = ct.nlsys(
    None, lambda t, x, u, p: [t % 1.0 if t % 1.0 < 0.4 else -1.0], inputs=0, outputs="u",
    name="source",
)  # fmt: skip
JUMPS = np.array([s + k for k in range(5) for s in (0.0, 0.4)])


def loop(**how):
    wire = nlctl.TransportDelay(**how)
    return nlctl.interconnect({"source": SOURCE, "wire": wire}, outputs=["y"])


def inside(times):
    times = np.asarray(times)
    return times[(times > 0) & (times < END)]


@pytest.mark.parted
@pytest.mark.parametrize("engine", ["native", "python-control"])
@pytest.mark.parametrize(
    ("how", "arrival"),
    [
        ({"delay": 0.137}, lambda s: s + 0.137),
        ({"delay": 0.2, "varying": lambda t: 0.3 * t}, lambda s: (s + 0.2) / 0.7),
        ({"delay": 0.9, "varying": lambda t: -0.5 / (1 + t)},  # (t - s - 0.9) (1 + t) = -0.5
         lambda s: (s - 0.1 + np.sqrt((s - 0.1) ** 2 + 4 * (s + 0.4))) / 2),
    ],
    ids=["constant", "ramp", "hyperbola"],
)  # fmt: skip
def test_jumps_are_breaks_where_they_leave(how, arrival, engine):
    """A tooth of 0.4 s whose sides lie between samples: what leaves is at most just below 0.4."""
    run = nlctl.input_output_response(loop(**how), TIMES, engine=engine, rtol=1e-9, atol=1e-11)
    breaks, leave = breaks_of(run), inside(arrival(JUMPS))
    assert leave.size > 6
    for t in leave:
        assert np.abs(breaks - t).min() < 1e-9
    y = run.outputs.ravel()
    assert highest(run.time, y, breaks) == pytest.approx(0.4, abs=1e-9)
    assert lowest(run.time, y, breaks) == pytest.approx(-1.0, abs=1e-12)


@pytest.mark.parted
@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_kinks_of_delays_and_jumps_before_the_run_are_breaks(engine):
    varying = loop(delay=0.5, varying=lambda t: 0.3 * abs(t - 2.3))
    run = nlctl.input_output_response(varying, TIMES, engine=engine)
    assert np.abs(run.jump_times - 2.3).min() < 1e-9
    early = loop(delay=0.5, varying=lambda t: 0.1 * t, history=lambda t: float(t > -0.2))
    run = nlctl.input_output_response(early, TIMES, engine=engine)
    for sent in (-0.2, 0.0):  # 0.9 t = sent + 0.5
        assert np.abs(run.jump_times - (sent + 0.5) / 0.9).min() < 1e-9


@pytest.mark.parted
@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_jumps_leave_one_delay_behind_another(engine):
    one = nlctl.TransportDelay(outputs=("m",), delay=0.2, varying=lambda t: 0.3 * t)
    other = nlctl.TransportDelay(inputs=("m",), delay=0.1, varying=lambda t: 0.05 * t)
    both = nlctl.interconnect({"source": SOURCE, "one": one, "other": other}, outputs=["y"])
    run = nlctl.input_output_response(both, TIMES, engine=engine, rtol=1e-9, atol=1e-11)
    for t in inside(((JUMPS + 0.2) / 0.7 + 0.1) / 0.95):
        assert np.abs(run.jump_times - t).min() < 1e-9


def test_members_of_ensembles_know_their_own():
    """Samples and delays of each member: the tooth is cut off where it still rises."""
    top = Metric(key="top", signal="y", unit="1", meaning="of y", function=highest)
    delays = np.array([0.11, 0.2, 0.317])
    found = nlctl.ensemble_response(
        loop(delay=0.2, varying=lambda t: 0.3 * t), TIMES, params={"wire.delay": delays},
        metrics=[top], rtol=1e-9, atol=1e-11,
    )  # fmt: skip
    np.testing.assert_allclose(found.table["top"], 0.4, atol=1e-9)
