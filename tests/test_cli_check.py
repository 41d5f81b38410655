"""`nlctl check`: the ledger on the command line."""

import json

import pytest
from test_cli import nlctl


def check(*arguments):
    """Exit code and what was printed."""
    done = nlctl("check", *arguments)
    return done.returncode, done.stdout, done.stderr


def test_the_published_loop_holds_and_the_paper_does_not():
    """All corrected lines hold, and the literal reading of (31) is violated, with the time."""
    code, said, _ = check("example-1", "--json")
    assert code == 0
    lines = {line["key"]: line for line in json.loads(said)["lines"]}
    assert lines["(31)"]["status"] == "checked"
    assert lines["(31) literal"]["status"] == "violated"
    assert 0 < lines["(31) literal"]["time"] < 20
    assert lines["(29)"]["status"] == "proved"


def test_a_violation_is_exit_code_1():
    """Without sigma-modification the decay rate of (31) is zero."""
    code, said, _ = check("example-1", "--set", "robust.sigma_2=0", "--horizon", "5")
    assert code == 1
    assert "violated" in said


def test_an_ensemble_names_its_worst_member():
    """Five members from random states; every line says how many runs stand behind it."""
    code, said, _ = check("example-1", "--ensemble", "5", "--horizon", "5", "--seed", "3")
    assert code == 0
    assert "5 runs" in said.splitlines()[0]
    again = check("example-1", "--ensemble", "5", "--horizon", "5", "--seed", "3")[1]
    assert said == again


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["example-3"], "unknown example 'example-3'"),
        (["example-1", "--set", "robust.sgma_2=0"], "nearest: 'controller.robust.sigma_2'"),
        (["example-1", "--horizon", "-1"], "horizon > 0, got -1"),
    ],
)
def test_bad_input_is_exit_code_2(arguments, message):
    """One sentence that says what to put right."""
    code, _, said = check(*arguments)
    assert code == 2
    assert message in said
