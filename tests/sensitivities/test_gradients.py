"""Gradients of metrics and of margins of signal temporal logic, one-sided where they are."""

import numpy as np
import pytest
from closed_form_runs import block

import nlctl
from nlctl.analysis.metrics import Metric as Described
from nlctl.analysis.metrics import final, highest, integral, peak, rms
from nlctl.analysis.robustness import Requirement, always, eventually, in_band

T = np.linspace(0, 6, 1201)


def Metric(**given):  # noqa: N802 (as a record is made)
    return Described(unit="1", meaning="a number", **given)


def oscillation():
    """x = A sin(w t), y = A cos(w t)."""
    return block(lambda t, x, u, p: [p["w"] * x[1], -p["w"] * x[0]], {"w": 2.0}, ("x", "y"))


def response(**more):
    return nlctl.sensitivity_response(
        oscillation(), T, 0, [0.0, 1.5], with_respect_to=["plant.y(0)", "plant.w"], **more
    )


@pytest.mark.parametrize(
    ("function", "by_amplitude", "by_frequency"),
    [
        (lambda t, x: final(t, x), np.sin(12.0), 6 * 1.5 * np.cos(12.0)),
        (lambda t, x: integral(t, x), (1 - np.cos(12.0)) / 2,
         1.5 * (6 * np.sin(12.0) / 2 - (1 - np.cos(12.0)) / 4)),
        (lambda t, x: highest(t[:401], x[:401]), 1.0, 0.0),
        (lambda t, x: integral(t, x**2), 2 * 1.5 * (3 - np.sin(24.0) / 8),
         2.25 * (-6 * np.cos(24.0) / 4 + np.sin(24.0) / 16)),
    ],
    ids=["final", "integral", "highest", "square"],
)  # fmt: skip
def test_metrics(function, by_amplitude, by_frequency):
    """Numbers of A sin(w t) by A and w in closed form."""
    metric = Metric(key="m", signal="x", function=function)
    made = nlctl.metric_gradient(metric, response())
    assert made.one_sided == ()
    assert abs(made["plant.y(0)"] - by_amplitude) < 1e-5
    assert abs(made["plant.w"] - by_frequency) < 1e-4


def test_window():
    """Over a part of the response only the samples there count."""
    late = Metric(key="late", signal="x", function=rms, start=3.0, end=5.0)
    made = nlctl.metric_gradient(late, response())
    assert abs(made["plant.y(0)"] - made.value / 1.5) < 1e-9


def test_equal_peaks():
    """max |x - b| of x between -1 and 1: 1 + |b|, whose sides differ at b = 0."""
    plant = block(lambda t, x, u, p: [np.cos(t), 0.0], {"unused": 0.0}, ("x", "b"))
    made = nlctl.sensitivity_response(
        plant, np.linspace(0, 2 * np.pi, 401), with_respect_to=["plant.b(0)"]
    )
    size = Metric(key="size", signal="x", function=peak)
    assert nlctl.metric_gradient(size, made)["plant.b(0)"] == 0.0

    class Offset:
        key, signals, start, end = "offset", ("x", "b"), -np.inf, np.inf

        @staticmethod
        def function(t, x, b):
            return np.abs(x - b).max()

    found = nlctl.metric_gradient(Offset(), made)
    assert found.one_sided == ("plant.b(0)",)
    assert np.isnan(found.gradient).all()
    assert abs(found.above[0] - 1) < 1e-3
    assert abs(found.below[0] + 1) < 1e-3
    assert "above" in repr(found)


def test_margins():
    """|x| <= 2 always leaves 1 - A / 2; x >= 1 for once leaves A - 1."""
    made = response()
    bounded = Requirement(
        key="bounded", formula=always(in_band("x", lower=-2.0, upper=2.0)), until=6.0
    )
    reached = Requirement(key="reached", formula=eventually(in_band("x", lower=1.0)), until=6.0)
    by_bounded = nlctl.metric_gradient(bounded, made)
    by_reached = nlctl.metric_gradient(reached, made)
    assert abs(by_bounded.value - by_bounded.above[0] * 1.5 - 1) < 2e-4
    assert by_bounded["plant.y(0)"] < 0 < by_reached["plant.y(0)"]
    moved = nlctl.sensitivity_response(
        oscillation(), T, 0, [0.0, 1.501], with_respect_to=["plant.w"]
    )
    for requirement, found in ((bounded, by_bounded), (reached, by_reached)):
        change = nlctl.metric_gradient(requirement, moved).value - found.value
        assert abs(change / 1e-3 - found["plant.y(0)"]) < 1e-4


def test_no_derivative():
    """Behind the time from which there is none the gradient is NaN; before it is not."""
    plant = block(
        lambda t, x, u, p: [
            1.0, 1.0, np.where(x[0] > p["p"], np.where(x[1] > p["q"], 1.0, 0.0), 3.0),
        ], {"p": 0.5, "q": 0.5}, ("x", "y", "z"),
    )  # fmt: skip
    made = nlctl.sensitivity_response(
        plant, np.linspace(0, 1, 21), of=["z"], with_respect_to=["plant.p", "plant.z(0)"]
    )
    early = Metric(key="early", signal="z", function=integral, end=0.4)
    assert abs(nlctl.metric_gradient(early, made)["plant.z(0)"] - 0.4) < 1e-9
    whole = Metric(key="whole", signal="z", function=integral)
    found = nlctl.metric_gradient(whole, made)
    assert np.isnan(found["plant.p"])
    assert found.one_sided == ()
    assert abs(found["plant.z(0)"] - 1.0) < 1e-9  # it moves neither of what happens at once


def test_bad_input():
    """Signals that are not there, and times."""
    with pytest.raises(nlctl.errors.UnknownNameError, match="for metric 'm'"):
        nlctl.metric_gradient(Metric(key="m", signal="q", function=final), response())
    late = Metric(key="late", signal="x", function=final, start=7.0)
    with pytest.raises(nlctl.errors.ParameterError, match="no sample"):
        nlctl.metric_gradient(late, response())
    found = nlctl.metric_gradient(Metric(key="m", signal="x", function=final), response())
    with pytest.raises(nlctl.errors.UnknownNameError, match="of this gradient"):
        found["plant.v"]
