"""What is compiled ahead of a run is what the run needs: nothing is left to be compiled."""

import re
from contextlib import contextmanager

import control as ct
import numpy as np
import pandas as pd
import pytest
from numba.core import config, event
from sweep_examples import experiment
from sweep_examples import loop as lag

import nlctl
from nlctl.analysis.lyapunov.examination import compile_examination_ahead as examine_ahead
from nlctl.analysis.lyapunov.examination import examine
from nlctl.analysis.robustness import prepare
from nlctl.analysis.robustness.runs.experiment import compile_experiment_ahead as rows_ahead
from nlctl.analysis.robustness.runs.experiment import evaluate
from nlctl.native import compile_ahead
from nlctl.native.machine import finish

T = np.linspace(0, 1, 11)
pytestmark = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="nothing is compiled without JIT"
)


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    """The integrators are there, programs are not."""
    nlctl.input_output_response(nlctl.compile(lag()), T)
    monkeypatch.setenv("NLCTL_CACHE_DIR", str(tmp_path))


@contextmanager
def compiling():
    """Return the names of the functions that are compiled meanwhile."""
    names, right = [], finish._object_code

    def noted(text):
        names.extend(re.findall(r"^define void @(\w+)\(", text, re.MULTILINE))
        return right(text)

    with pytest.MonkeyPatch.context() as patch, event.install_recorder("numba:compile") as recorder:
        patch.setattr(finish, "_object_code", noted)
        yield names
    names += [e.data["dispatcher"].py_func.__qualname__ for _, e in recorder.buffer if e.is_start]


def sampled():
    return ct.ss([[0.5]], [[1]], [[1]], [[0]], 0.1)


@pytest.mark.parted
@pytest.mark.parametrize("ensemble", [False, True])
@pytest.mark.parametrize(
    ("make", "functions", "varied"),
    [
        (lag, {"prepare", "rhs", "out"}, {"params": {"lag.rate": [2.0, 3.0]}}),
        pytest.param(
            *(nlctl.paper.example_1, {"prepare", "rhs", "out"}),
            {"params": {"law.beta": [2.0, 3.0]}},
            marks=pytest.mark.ci,
        ),
        (sampled, {"rhs", "out"}, {"initial_state": {"x[0]": [2.0, 3.0]}}),
    ],
)
def test_single_runs_and_ensembles(make, functions, varied, ensemble):
    compiled = nlctl.compile(make())
    with compiling() as before:
        compile_ahead(compiled, ensemble=ensemble)
    assert functions <= set(before)
    with compiling() as during:
        if ensemble:
            nlctl.ensemble_response(compiled, T, **varied)
        else:
            nlctl.input_output_response(compiled, T)
    assert during == []


@pytest.mark.weekly
def test_rows_of_an_experiment_and_their_metrics():
    prepared = prepare(experiment())
    with compiling() as before:
        rows_ahead(prepared)
    assert {"prepare", "rhs", "out"} <= set(before)
    with compiling() as during:
        found = evaluate(prepared, pd.DataFrame({"lag.rate": [1.0, 1.5], "lag.gain": [0.5, 0.1]}))
    assert during == []
    assert np.all(np.isfinite(found["peak"]))


@pytest.mark.ci
def test_the_observed_loop_of_a_proof():
    loop = nlctl.paper.example_1()
    with compiling() as before:
        examine_ahead(loop)
    assert "rhs" in before
    with compiling() as during:
        examine(loop, 1.0)
    assert during == []
