"""`nlctl check`: the ledger on the command line."""

import dataclasses
import io
import itertools
import json
import re
import shlex

import numpy as np
import pytest
from command_line import nlctl_here
from rich.console import Console
from rows import each_row

from nlctl import paper
from nlctl.analysis.cli.check import (
    ledger_summary,
    random_start,
    repeat_command,
    show_ledger,
    worst_lines,
)
from nlctl.analysis.lyapunov.ledger import ledger
from nlctl.diagrams import initial_state, state_names
from nlctl.errors import ParameterError, UnknownNameError

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them


@pytest.fixture(scope="module")
def found():
    """A short run of Example 1."""
    return ledger(paper.example_1(), 1.0)


def check(*arguments):
    """Exit code and what was printed."""
    done = nlctl_here("check", *arguments)
    return done.returncode, done.stdout, done.stderr


def test_the_published_loop_holds_and_the_papers_lemma_does_not():
    """No corrected line is violated; of the paper's own, Lemma 1 and the closed set are.

    Where the drift of zeta ends is open: neither "holds" nor "violated", and exit code 5.
    """
    done = nlctl_here("check", "example-1", "--json")
    content = json.loads(done.stdout)
    assert (done.returncode, content["holds"], content["answer"]) == (5, None, "undecided")
    lines = {line["key"]: line for line in content["lines"]}
    corrected = [line for line in lines.values() if line["reading"] == "corrected"]
    assert [x["key"] for x in corrected if x["status"] == "undecided"] == ["slow drift"]
    assert [x["key"] for x in lines.values() if x["status"] == "violated"] == ["Lemma 1", "closure"]
    assert lines["(31)"]["status"] == lines["(31) literal"]["status"] == "checked"
    assert lines["(29)"]["status"] == "proved"


@pytest.mark.weekly
@pytest.mark.ci
def test_runs_of_python_control_are_reproduced_and_give_the_same_ledger():
    """Two engines, one loop: the same statuses, and margins that agree to the runs' tolerance."""
    arguments = ("example-1", "--until", "0.5", "--json", "--set", "actuator.b_r=0.4")
    ledgers = [
        {line["key"]: line for line in json.loads(check(*arguments, *more)[1])["lines"]}
        for more in ((), ("--engine", "python-control"))
    ]
    native, interpreted = ledgers
    assert native.keys() == interpreted.keys()
    for key, line in native.items():
        assert line["status"] == interpreted[key]["status"], key
        if line["least"] is not None:
            assert line["least"] == pytest.approx(interpreted[key]["least"], rel=1e-3, abs=1e-6)
    engines = (("--engine", engine) for engine in ("native", "python-control"))
    refused = {check("example-1", "--until", "0.002", *engine) for engine in engines}
    assert refused == {(2, "", "nlctl: ledger needs 0 < step < horizon, got 0.004 and 0.002\n")}
    code, _, said = check("example-1", "--engine", "pyton-control")
    assert (code, "nearest: 'python-control'" in said) == (2, True)


def test_bounds_of_the_actuators_gain_can_be_given():
    """k of (2): the proof is made with these, or says that they are none."""
    code, _, said = check("example-1", "--until", "0.1", "--k", "1.2", "0.7")
    assert (code, "0 < k_1 <= k_2" in said) == (2, True)


def test_a_violation_is_exit_code_1():
    """Without sigma-modification the decay rate of (31) is zero."""
    code, said, _ = check("example-1", "--set", "robust.sigma_2=0", "--until", "5")
    assert code == 1
    assert "violated" in said


def test_a_diverging_run_is_exit_code_1():
    """From zeta(0) = 4.5 the run is lost at once: a violated line, not a calm table."""
    code, said, _ = check("example-1", "--set", "law.zeta(0)=4.5", "--horizon", "1", "--json")
    assert code == 1
    lines = {line["key"]: line for line in json.loads(said)["lines"]}
    assert lines["run"]["status"] == "violated"


@pytest.mark.weekly
def test_the_worst_run_of_an_ensemble_can_be_run_again():
    """The printed command starts where the member started: its largest |r| is the same state."""
    options = ("--horizon", "3", "--ensemble", "2", "--seed", "3", "--set", "law.beta=3.5")
    code, said, _ = check("example-1", *options)
    assert code == 5
    assert "2 runs" in said.splitlines()[0]
    command = shlex.split(said.splitlines()[-1])
    assert command[:2] == ["nlctl", "check"]
    states = []
    for arguments in (("example-1", *options), command[2:]):
        lines = json.loads(check(*arguments, "--json")[1])["lines"]
        states.append(next(line["state"] for line in lines if line["key"] == "(36)"))
    one, again = states
    assert again == pytest.approx(one, rel=1e-9)


def test_random_states_are_the_plants_and_lie_within_the_spread():
    """Each state fills its interval around what was set; the rest stays; a seed repeats."""
    loop, start = paper.example_2(), {"plant.x2": 0.7, "law.zeta": 1.5}
    drawn = random_start(loop, start, 500, 0.2, 5)
    assert set(drawn) == {"plant.x1", "plant.x2", "plant.x3", "controller.law.zeta"}
    assert drawn["controller.law.zeta"] == 1.5
    nominal = dict(zip(state_names(loop), initial_state(loop, start), strict=True))
    for name in ("plant.x1", "plant.x2", "plant.x3"):
        away = drawn[name] - nominal[name]
        assert np.max(np.abs(away)) <= 0.2
        assert np.max(away) > 0.19
        assert np.min(away) < -0.19
    again = random_start(loop, start, 500, 0.2, 5)
    np.testing.assert_array_equal(again["plant.x1"], drawn["plant.x1"])
    other = random_start(loop, start, 500, 0.2, 6)
    assert not np.any(other["plant.x1"] == drawn["plant.x1"])


@each_row("spread", [0.0, -1.0, np.inf, np.nan])
def test_a_spread_that_draws_nothing_is_refused(spread):
    """Zero, negative, infinite, NaN."""
    with pytest.raises(ParameterError, match="finite spread > 0"):
        random_start(paper.example_1(), {}, 3, spread, 0)


def test_random_start_refuses_a_state_that_does_not_exist():
    """With the nearest name."""
    with pytest.raises(UnknownNameError, match=r"plant\.x2"):
        random_start(paper.example_1(), {"plant.x3": 0.0}, 3, 0.1, 0)


def test_replay_keeps_every_digit_and_every_kind_of_parameter():
    """Vectors and truth values go through as they were typed."""
    typed = ["filtered_error.lambdas=1,2", "plant.integrate_w=true", "plant.x1(0)=9"]
    start = {"plant.x1": np.array([0.1, 1 / 3]), "law.zeta": 1.25}
    parts = shlex.split(repeat_command("example-1", 0.1, typed, start, 1))
    assert float(parts[parts.index("--until") + 1]) == 0.1
    told = dict(a.split("=") for o, a in itertools.pairwise(parts) if o == "--set")
    assert told["filtered_error.lambdas"] == "1,2"
    assert told["plant.integrate_w"] == "true"
    assert float(told["plant.x1(0)"]) == 1 / 3
    assert float(told["law.zeta(0)"]) == 1.25
    assert "--engine" not in parts
    again = shlex.split(repeat_command("example-1", 0.1, typed, start, 1, "python-control"))
    assert again == [*parts, "--engine", "python-control"]
    bounded = shlex.split(repeat_command("example-1", 0.1, typed, start, 1, k=(0.6, 1 / 3)))
    assert [float(x) for x in bounded[bounded.index("--k") + 1 :]] == [0.6, 1 / 3]


def test_worst_lines_hold_every_run_that_violates_something(found):
    """One line per run, the first in the order of the proof; without any, that of (36)."""
    assert worst_lines(found) == [found["(36)"]]
    broken = {"(9)": 2, "A2": 1, "(31)": 2}
    lines = tuple(
        dataclasses.replace(x, status="violated", member=broken[x.key]) if x.key in broken else x
        for x in found.lines
    )
    worst = worst_lines(dataclasses.replace(found, lines=lines))
    assert [(x.key, x.member) for x in worst] == [("A2", 1), ("(9)", 2)]


def test_the_terminal_table_shows_every_line_with_its_brackets(found):
    """Formulas with brackets are text, not markup; colours are for terminals only."""
    screen = io.StringIO()
    show_ledger(found, Console(file=screen, force_terminal=True, width=250))
    shown = screen.getvalue()
    for line in found.lines:
        assert line.statement in shown
        assert line.key in shown
    assert "\x1b[" in shown
    assert "V' <= -alpha_1 V + [k G N + 1] zeta' + alpha_0" in shown


def test_elsewhere_the_table_is_the_ledgers_own_text(found, capsys):
    """One line per statement, for grep."""
    show_ledger(found, Console(file=io.StringIO()))
    assert capsys.readouterr().out == f"{found}\n"


def test_one_line_that_is_violated_or_undecided_is_the_answer(found):
    """Violated before undecided before holds; what the paper says differently does not count."""
    decided = [x for x in found.lines if x.status != "undecided"]
    one = next(x for x in decided if x.reading == "corrected")
    answers = {}
    for reading in ("corrected", "paper"):
        for status in ("checked", "undecided", "violated"):
            other = dataclasses.replace(one, status=status, reading=reading)
            lines = tuple(other if x is one else x for x in decided)
            another = dataclasses.replace(found, lines=lines)
            answers[reading, status] = another.answer
            assert another.holds is {"holds": True, "violated": False}.get(another.answer)
            kept, all_lines = map(int, re.findall(r"\d+", another.tally)[:2])
            counts = (another.answer != "holds", len(another.undecided))
            assert (all_lines - kept, another.tally.count("undecided")) == counts
    assert answers == {
        ("corrected", "checked"): "holds",
        ("corrected", "undecided"): "undecided",
        ("corrected", "violated"): "violated",
        **{("paper", status): "holds" for status in ("checked", "undecided", "violated")},
    }
    both = dataclasses.replace(one, status="violated")
    lines = tuple(both if x is one else x for x in found.lines)
    assert dataclasses.replace(found, lines=lines).answer == "violated"


def test_summary_counts_every_line_once_and_names_what_fails(found):
    """Statements of the paper that fail are named apart from corrected ones."""
    said = ledger_summary(found)
    counts = said.splitlines()[1].partition(":")[2].split(",")
    assert sum(int(part.split()[0]) for part in counts) == len(found.lines)
    assert "none of the corrected statements" in said
    assert "undecided: slow drift (1 s show nothing of it" in said
    assert "Lemma 1" in said.splitlines()[-1]


@each_row(
    ("arguments", "message"),
    [
        (["example-3"], "unknown example 'example-3'"),
        (["example-1", "--set", "robust.sgma_2=0"], "nearest: 'controller.robust.sigma_2'"),
        (["example-1", "--horizon", "-1"], "horizon > 0, got -1"),
        (["example-1", "--ensemble", "2", "--spread", "0"], "finite spread > 0, got 0"),
        (["example-1", "--ensemble", "-2"], "--ensemble"),
    ],
)
def test_bad_input_is_exit_code_2(arguments, message):
    """One sentence that says what to put right."""
    code, _, said = check(*arguments)
    assert code == 2
    assert message in said
