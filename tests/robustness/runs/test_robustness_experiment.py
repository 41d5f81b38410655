"""Rows in, margins and metrics out: against closed forms of a linear loop."""

import numpy as np
import pandas as pd
import pytest
from lag import Lag, loop
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis import metrics
from nlctl.analysis.metrics import Metric
from nlctl.analysis.robustness import (
    Choice,
    Experiment,
    Requirement,
    Space,
    Spec,
    Uncertain,
    always,
    evaluate,
    in_band,
    independent,
    prepare,
    unfinished_margin,
)

T = np.linspace(0, 2, 201)


def experiment(**changes):
    given = {
        "space": Space(quantities=(Uncertain(name="lag.rate", law=stats.uniform(0.5, 2)),)),
        "build": loop,
        "spec": Spec(
            requirements=(
                Requirement(key="small", formula=always(in_band("y", upper=0.5), 1, 2), until=2),
                Requirement(
                    key="both", formula=in_band("y", upper=2) & in_band("z", upper=3), until=2
                ),
            )
        ),
        "timepts": T,
        "metrics": (
            Metric(key="end", signal="y", unit="1", meaning="final", function=metrics.final),
        ),
    }
    return Experiment(**given | changes)


def test_margins_and_metrics_are_those_of_the_closed_form():
    """y = exp(-rate t): a requirement on two signals is a metric like any other."""
    made = prepare(experiment())
    table = independent(made.experiment.space, 20, 1).table
    found = evaluate(made, table)
    rate = table["lag.rate"].to_numpy()
    np.testing.assert_allclose(found["end"], np.exp(-2 * rate), atol=1e-7)
    np.testing.assert_allclose(found["small"], (0.5 - np.exp(-rate)) / 0.5, atol=1e-5)
    np.testing.assert_allclose(found["both"], 1 / 3, atol=1e-6)
    np.testing.assert_array_equal(found["spec"], found[["small", "both"]].min(axis=1))
    pd.testing.assert_index_equal(found.index, table.index)


def test_a_diverged_run_fails_everything_the_worse_the_earlier():
    """x' = g x^3 from 1 escapes at 1 / (2 g); a rate of 1e-9 makes no difference."""
    space = Space(quantities=(Uncertain(name="lag.gain", bounds=(0.0, 4)),))
    made = prepare(experiment(space=space, build=lambda: loop(Lag(rate=1e-9))))
    found = evaluate(made, pd.DataFrame({"lag.gain": [0.5, 1.0, 2.0]}))
    assert not np.any(found["status"] == "OK")
    np.testing.assert_allclose(found["time"], [1, 0.5, 0.25], rtol=1e-3)
    assert np.all(np.isnan(found["end"]))
    expected = [unfinished_margin(time, 2.0) for time in found["time"]]
    for key in ("small", "both", "spec"):
        np.testing.assert_array_equal(found[key], expected)
    assert np.all(np.diff(found["spec"]) < 0)


def test_choices_run_in_their_own_diagrams_and_rows_keep_their_order():
    """Each row alone gives what it gives in company."""
    space = Space(
        quantities=(Uncertain(name="lag.x(0)", bounds=(0.0, 2.0)),),
        choices=(Choice(name="lag", options={"calm": Lag(), "slow": Lag(rate=0.1)}),),
    )
    made = prepare(experiment(space=space))
    table = pd.DataFrame(
        {"lag.x(0)": [1.0, 0.5, 1.5, 2.0], "lag": ["slow", "calm", "slow", "calm"]},
        index=[7, 3, 5, 1],
    )
    found = evaluate(made, table)
    assert list(found.index) == [7, 3, 5, 1]
    rate = np.array([0.1, 1.0, 0.1, 1.0])
    np.testing.assert_allclose(found["end"], table["lag.x(0)"] * np.exp(-2 * rate), atol=1e-6)
    for row in table.index:
        pd.testing.assert_frame_equal(evaluate(made, table.loc[[row]]), found.loc[[row]])


@each_row(
    ("changes", "message"),
    [
        ({"timepts": T + 1}, "times from 0 s, got 1 s"),
        ({"timepts": T / 2}, "'small' needs a response until 2 s, the experiment ends at 1 s"),
        (
            {"space": Space(quantities=(Uncertain(name="small", bounds=(0, 1)),))},
            r"got twice: \['small'\]",
        ),
    ],
)
def test_an_experiment_that_contradicts_itself_is_refused(changes, message):
    """Before anything is built."""
    with pytest.raises(nlctl.errors.ParameterError, match=message):
        experiment(**changes)


def test_a_missing_signal_is_named_with_the_nearest():
    """Before the first row is run."""
    spec = Spec(requirements=(Requirement(key="r", formula=in_band("yy", upper=1), until=2),))
    with pytest.raises(nlctl.errors.UnknownNameError, match="yy"):
        prepare(experiment(spec=spec))
