"""Loops with inputs from outside: a study gives each of them a value."""

import numpy as np
import pytest
from rows import each_row

from nlctl.analysis.robustness import nominal
from nlctl.analysis.robustness.runs.experiment import evaluate, prepare
from nlctl.analysis.robustness.search.evaluation import as_table
from nlctl.analysis.studies import StudyError, read_study

LOOP = """\
import control as ct


def tank(swapped=False):
    names = ["pull", "push"] if swapped else ["push", "pull"]
    lag = ct.nlsys(
        lambda t, x, u, params: [-params["rate"] * x[0] + u[0] - u[1]],
        inputs=["push", "pull"], outputs=["y"], states=["y"], params={"rate": 0.5}, name="lag",
    )
    return ct.interconnect([lag], inputs=names, outputs=["y"], name="tank")
"""

STUDY = """\
loop = "loop.py:tank"

[study]
title = "A tank"
seed = 1

[space]
rate = { bounds = [0.25, 1.0] }

[spec]
low = "always |y| <= 4"

[time]
end = 8.0
step = 0.01
"""
BOTH = "[inputs]\npush = 1.5\npull = 0.5\n"
CHOICE = "[choices.swapped]\noptions = { no = false, yes = true }\n"


def write(folder, *parts):
    (folder / "loop.py").write_text(LOOP, encoding="utf-8")
    (folder / "study.toml").write_text("\n".join((STUDY, *parts)), encoding="utf-8")
    return folder / "study.toml"


def test_inputs_have_the_values_of_the_file_all_the_time(tmp_path):
    """y = (push - pull)/rate (1 - exp(-rate t)) from rest, whatever their order in the file."""
    for inputs in (BOTH, "[inputs]\npull = 0.5\npush = 1.5\n"):
        prepared = prepare(read_study(write(tmp_path, inputs)).experiment)
        space = prepared.experiment.space
        rates = np.array([0.25, 0.5, 1.0])
        found = evaluate(prepared, as_table(space, [nominal(space) | {"rate": k} for k in rates]))
        peak = -np.expm1(-8 * rates) / rates
        assert found["low"].to_numpy() == pytest.approx(1 - peak / 4, abs=1e-6)


@each_row(
    ("parts", "message"),
    [
        (["[inputs]\npush = 1.5\n"], "input 'pull' is fed by nothing"),
        (["[inputs]\npush = 1.5\npul = 1.0\n"], "unknown input 'pul'; nearest: 'pull'"),
        ([], "input 'push' is fed by nothing"),
        ([CHOICE, BOTH], "inputs in the same order, got ['push', 'pull'] and ['pull', 'push']"),
    ],
)
def test_an_input_without_a_value_or_a_loop_is_a_mistake_of_the_file(tmp_path, parts, message):
    """Nothing is fed with 0 because it was forgotten, or with what was meant for another."""
    with pytest.raises(StudyError) as caught:
        read_study(write(tmp_path, *parts))
    assert message in str(caught.value)
    assert len(caught.value.problems) == 1
