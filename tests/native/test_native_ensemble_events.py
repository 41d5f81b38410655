"""Metrics of ensembles know the events of each member: what lies between samples counts."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.metrics import Metric, highest, in_machine_code, lowest
from nlctl.analysis.robustness import Requirement, always, in_band

TIMES = np.linspace(0, 10, 101)
HEIGHTS = np.array([0.0, 1.0, 5.0, -3.0])


def metric(function, key="top"):
    return Metric(key=key, signal="y", unit="1", meaning="of y", function=function)


def pulsed(begin, width):
    """exp(-t) + s, and s' = -s + pulse: a pulse is seen in y itself and after it in s."""
    return ct.nlsys(
        lambda t, x, u, params: [-x[0], -x[1] + params["h"] * (begin <= t < begin + width)],
        lambda t, x, u, params: [x[0] + params["h"] * (begin <= t < begin + width)],
        states=2, inputs=0, outputs=["y"], params={"h": 1.0}, name="pulsed",
    )  # fmt: skip


@pytest.mark.weekly
@pytest.mark.parametrize("compiled", [False, pytest.param(True, marks=pytest.mark.weekly)])
@pytest.mark.parametrize(("begin", "width"), [(3.33, 0.02), (0.01, 1e-4), (3.3, 0.05)])
def test_a_pulse_between_samples_counts_for_each_member(begin, width, compiled):
    functions = map(in_machine_code, (highest, lowest)) if compiled else (highest, lowest)
    low = Requirement(key="low", formula=always(in_band("y", upper=2.0, scale=1.0)), until=10.0)
    measures = [*map(metric, functions, ("top", "bottom")), low]
    how = {"params": {"h": HEIGHTS}, "rtol": 1e-10, "atol": 1e-12}
    start = {"pulsed.x[0]": 1.0}
    table = nlctl.ensemble_response(
        pulsed(begin, width), TIMES, 0, start, metrics=measures, **how
    ).table
    tops = np.maximum(1.0, HEIGHTS + np.exp(-begin))
    bottoms = np.minimum(np.exp(-10), HEIGHTS + np.exp(-begin - width))
    np.testing.assert_allclose(table["top"], tops, rtol=0, atol=1e-6)
    np.testing.assert_allclose(table["bottom"], bottoms, rtol=0, atol=1e-6)
    np.testing.assert_allclose(table["low"], 2 - tops, rtol=0, atol=1e-6)


@pytest.mark.parametrize("hold", ["foh", "zoh"])
def test_a_saturated_peak_between_samples_is_the_limit(hold):
    """v = clip(k sin t): a corner on each side of every peak, whatever samples show."""
    gain = np.array([0.5, 1.01, 1.5, 4.0])
    wave = ct.nlsys(lambda t, x, u, params: [x[1], -x[0]],
                    lambda t, x, u, p: [np.clip(p["k"] * x[0] + 0 * u[0], -1, 1)],
                    states=2, inputs=1, outputs=["y"], params={"k": 1.0}, name="wave")  # fmt: skip
    table = nlctl.ensemble_response(
        wave, np.linspace(0, 10, 41), 0.0, {"wave.x[1]": 1.0}, params={"k": gain},
        metrics=[metric(highest)], hold=hold, rtol=1e-10, atol=1e-12,
    ).table  # fmt: skip
    np.testing.assert_allclose(table["top"], np.minimum(gain, 1.0), rtol=0, atol=1e-6)


def test_what_happens_to_others_changes_nothing():
    """Members with 2, 2,000 and 20,000 events in one batch: the rows that each has alone."""
    periods = np.array([10.0, 0.01, 1e-3, 3.0])
    counted = ct.nlsys(lambda t, x, u, p: [x[1], -x[0] * (2 * np.pi / p["T"]) ** 2,
                                           1.0 if x[0] > 0 else 0.0],
                       lambda t, x, u, p: [x[2] + 0.1 * (x[0] > 0)], states=3, inputs=0,
                       outputs=["y"], params={"T": 1.0}, name="counted")  # fmt: skip
    course = {"timepts": np.linspace(0, 1, 11), "metrics": [metric(highest)], "keep": ["y"]}

    def runs(chosen):
        return nlctl.ensemble_response(
            counted, **course, initial_state={"counted.x[0]": 1.0}, params={"T": chosen}
        )

    together = runs(periods)
    assert set(together.table["status"]) == {"OK"}
    for i, period in enumerate(periods):
        alone = runs(np.array([period]))
        np.testing.assert_array_equal(together.signals["y"][i], alone.signals["y"][0])
        assert together.table["top"][i] == alone.table["top"][0]
        assert together.table["steps"][i] == alone.table["steps"][0]


def test_a_function_without_breaks_is_called_as_before():
    """It sees more samples where a member has events without one in between, and only there."""
    sizes = []

    def size(t, y):
        sizes.append(t.size)
        return float(t.size)

    table = nlctl.ensemble_response(
        pulsed(3.33, 0.02), TIMES, 0, {"pulsed.x[0]": np.array([1.0, 2.0])}, metrics=[metric(size)]
    ).table
    assert sizes == [TIMES.size + 9] * 2
    assert (table["top"] == TIMES.size + 9).all()
    smooth = nlctl.ensemble_response(pulsed(3.25, 1.0), TIMES, metrics=[metric(size)]).table
    assert (smooth["top"] == TIMES.size).all()


def test_a_member_that_fails_is_not_run_again():
    """x' = x^2 escapes at 1/x(0): it has the status that it has without metrics, and no number."""
    system = ct.nlsys(lambda t, x, u, params: [x[0] ** 2 + 0.0 * (3.33 <= t < 3.35)],
                      lambda t, x, u, params: [x[0]], states=1, inputs=0, outputs=["y"],
                      name="escaping")  # fmt: skip
    sizes = []

    def size(t, y):
        sizes.append(t.size)
        return float(t.size)

    start = {"escaping.x[0]": np.array([0.2, 0.05])}  # until 5 s, and beyond the end
    plain, asked = (
        nlctl.ensemble_response(system, TIMES, 0, start, metrics=metrics, keep=["y"])
        for metrics in ([], [metric(size)])
    )
    assert asked.table["status"][0] == plain.table["status"][0] != "OK"
    assert asked.table["steps"].tolist() == plain.table["steps"].tolist()
    np.testing.assert_array_equal(asked.signals["y"][0], plain.signals["y"][0])
    assert np.isnan(asked.table["top"][0])
    assert sizes == [TIMES.size + 9]
