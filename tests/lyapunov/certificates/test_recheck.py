"""A saved certificate is believed by who knows nothing of what found it; a tampered one is not."""

import copy
import json
import random
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from planted_loops import wired
from tampering import answers, put, scaled

import nlctl
from nlctl.analysis import recheck as package
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.recheck import Refuted, main, recheck, seal_of
from nlctl.errors import UsageError

pytestmark = pytest.mark.slow


def sliding(order=2, **how):
    """Sliding mode for a chain of integrators with cos, tanh and a gain that is not affine."""
    plant = nlctl.PureFeedback(
        order=order,
        f=how.get(
            "f", lambda x, v: 0.3 * np.tanh(x[0]) - 0.2 * x[-1] + v * (1.2 + 0.1 * np.cos(v))
        ),
    )
    lambdas = {1: (), 2: (1.5,), 3: (4.0, 4.0), 4: (6.0, 11.0, 6.0)}[order]
    return nlctl.interconnect(
        {
            "reference": nlctl.SumOfSines(
                order=order, amplitudes=(0.2,), frequencies=(0.7,), phases=(0.4,)
            ),
            "plant": plant,
            "actuator": how.get("actuator", nlctl.Gain()),
            "filtered_error": nlctl.controllers.FilteredError(lambdas=lambdas),
            "law": nlctl.controllers.SlidingModeLaw(K=how.get("K", 20.0), phi=0.1),
        },
        outputs=["x1", "r", "u"],
        name="sliding",
    )  # fmt: skip


LOOPS = {
    "known sign": lambda: certify(wired()),
    "known sign from a box": lambda: certify(
        wired(), starts={"plant.x1": (-0.2, 0.5), "weights.W_hat": (-0.1, 0.1)}
    ),
    "sliding mode": lambda: certify(sliding()),
    "sliding mode from a box": lambda: certify(
        sliding(), starts={"plant.x1": (-0.3, 0.3), "plant.x2": (-0.2, 0.4)}
    ),
    "sliding mode of order 1": lambda: certify(sliding(1), starts={"plant.x1": (-0.1, 0.2)}),
    "sliding mode of order 3": lambda: certify(sliding(3)),
    "sliding mode behind a backlash": lambda: certify(sliding(actuator=nlctl.Backlash())),
}


@pytest.fixture(scope="module", params=LOOPS)
def saved(request, tmp_path_factory):
    """A certificate, and its file."""
    found = LOOPS[request.param]()
    assert found.status == "proved"
    return found, found.save(tmp_path_factory.mktemp("saved") / "certificate.json")


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    """What the file of a sliding mode from a box holds."""
    file = LOOPS["sliding mode from a box"]().save(tmp_path_factory.mktemp("one") / "one.json")
    return json.loads(file.read_text())


@pytest.mark.parted
def test_the_answer_is_yes(saved, capsys):
    """With bounds that are those of the certificate, to a few percent, and its starts."""
    found, file = saved
    assert main([str(file)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("yes: |r| <= ")
    claim = json.loads(file.read_text())["claim"]
    share = float(Fraction(claim["|r|"])) / found.C_0
    assert 1 - 1e-6 <= share <= 1.05
    begins = str(found.starts).partition(",")[0].removesuffix(" at t = 0")
    assert f"for all t >= 0 from {begins}" in said


@pytest.mark.parted
def test_nothing_but_python_takes_part(saved, tmp_path):
    """A copy of the package alone, without any third-party package, says the same."""
    _, file = saved
    shutil.copytree(Path(package.__file__).parent, tmp_path / "alone", dirs_exist_ok=True)
    run = (
        "import sys, runpy; sys.path.insert(0, sys.argv.pop(1)); "
        "runpy.run_module('alone', run_name='__main__')"
    )
    made = subprocess.run(
        [sys.executable, "-I", "-S", "-c", run, str(tmp_path), str(file)],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    assert made.stdout == f"yes: {recheck(json.loads(file.read_text()))}\n"


WRONG = {  # all of them sealed anew, as one would who knows the format
    "a smaller bound of r": scaled(("claim", "|r|"), Fraction(9, 10)),
    "a smaller bound of e_1": scaled(("claim", "|e_1|"), Fraction(1, 2)),
    "a smaller bound of u": scaled(("claim", "|u|"), Fraction(99, 100)),
    "a smaller bound in the end": scaled(("claim", "limsup |r|"), Fraction(1, 2)),
    "another bound": put(("claim", "|x1|"), "1/10"),
    "more starts": scaled(("premises", "starts", "plant.x1"), 4),
    "a start far away": put(("premises", "starts", "plant.x2"), ["0", "100"]),
    "an empty start": put(("premises", "starts", "plant.x2"), ["1", "0"]),
    "no starts": put(("premises", "starts"), {}),
    "a weaker law": scaled(("premises", "gains", "K"), Fraction(1, 20)),
    "a wider layer": scaled(("premises", "gains", "phi"), 3),
    "a negative gain": scaled(("premises", "gains", "K"), -1),
    "a weaker actuator": scaled(("premises", "actuator", "k_1"), Fraction(1, 30)),
    "an actuator the other way round": scaled(("premises", "actuator", "k_1"), -1),
    "an actuator that errs": put(("premises", "actuator", "eps"), "20"),
    "a range of the split": put(("premises", "actuator", "range"), "1"),
    "a faster reference": scaled(("premises", "reference", "frequencies"), 9),
    "a larger reference": scaled(("premises", "reference", "amplitudes"), 9),
    "another filter": scaled(("premises", "lambdas"), Fraction(1, 2)),
    "other poles": put(("proof", "poles"), [["1/2", "1/2"]]),
    "no poles": put(("proof", "poles"), []),
    "less of the plant": scaled(("proof", "matched"), Fraction(1, 2)),
    "more gain of the plant": scaled(("proof", "G_min"), 2),
    "less gain of the plant": scaled(("proof", "G_max"), Fraction(1, 2)),
    "a state twice": put(("premises", "plant"), ["plant.x1", "plant.x1"]),
    "a state that is none": put(("premises", "plant"), ["plant.x1", "plant.x3"]),
    "an actuator that errs by less than nothing": put(("premises", "actuator", "eps"), "-1"),
    "a larger C": scaled(("proof", "C"), 100),
    "a smaller C": scaled(("proof", "C"), Fraction(9, 10)),
    "less of the reference": scaled(("proof", "reference"), Fraction(1, 2)),
    "a disturbance": lambda made: made["premises"]["equation"].extend(
        [["number", "50"], ["+", len(made["premises"]["equation"]) - 1,
                            len(made["premises"]["equation"])]]),
    "the other sign of the input": lambda made: made["premises"]["equation"].extend(
        [["number", "-1"], ["*", len(made["premises"]["equation"]) - 1,
                            len(made["premises"]["equation"])]]),
    "another proof": put(("kind",), "known sign"),
    "nothing": put(("claim",), {}),
    "an unknown proof": put(("kind",), "passivity"),
    "another version": put(("version",), 2),
}  # fmt: skip
TRUE = {
    "a larger bound": scaled(("claim", "|r|"), 2),
    "fewer starts": scaled(("premises", "starts", "plant.x1"), Fraction(1, 2)),
    "less to be followed": scaled(("premises", "reference", "amplitudes"), Fraction(9, 10)),
}


@pytest.mark.parted
@pytest.mark.parametrize("what", WRONG)
def test_what_does_not_follow_is_answered_with_no(content, what, tmp_path, capsys):
    """Whether or not the file was sealed anew; and never with a traceback."""
    made = copy.deepcopy(content)
    WRONG[what](made)
    file = tmp_path / "tampered.json"
    for content_seal in (made["seal"], seal_of(made)):
        made["seal"] = content_seal
        file.write_text(json.dumps(made))
        assert main([str(file)]) == 1
        assert capsys.readouterr().out.startswith("no: ")


@pytest.mark.parametrize("what", TRUE)
def test_another_true_claim_is_another_file(content, what):
    """What follows as well is believed once it is sealed, and not before."""
    made = copy.deepcopy(content)
    TRUE[what](made)
    with pytest.raises(Refuted, match="changed after it was written"):
        recheck(made)
    made["seal"] = seal_of(made)
    assert recheck(made)


def test_the_answer_says_no_more_than_the_file(content):
    """A bound is rounded up; two premises that are not equal are not printed alike."""
    made = copy.deepcopy(content)
    made["claim"] = {"|u|": "4124230001/10000000"}
    made["premises"]["actuator"]["k_2"] = str(Fraction(made["premises"]["actuator"]["k_2"]) + 1)
    scaled(("premises", "reference", "amplitudes"), 1 - Fraction(1, 10**9))(made)
    made["seal"] = seal_of(made)
    assert recheck(made).startswith("|u| <= 412.424; ")
    plain, changed = (one.partition("yd = ")[2].partition(";")[0]
                      for one in (recheck(content), recheck(made)))  # fmt: skip
    assert plain != changed


def test_nonsense_is_answered_with_no(content, tmp_path, capsys):
    """Any entry replaced by anything, and files that are none."""
    things = [None, True, -1, "1/0", "1e999999999", "x", [], {}, ["1", "2"], "0", 1.5, {"a": "1"}]
    file = tmp_path / "nonsense.json"
    for way, answer, said in answers(content, random.Random(0), things, 150, file, capsys):
        assert (answer, said[:4]) in ((1, "no: "), (0, "yes:"))
        if answer == 0:  # an unread entry, a claim left out, or premises from which it follows, too
            assert way[0] in ("claim", "loop", "premises")
    for text in ("", "[]", "{", "null", "[" * 100_000, '{"format": 1}'):
        file.write_text(text)
        assert main([str(file)]) == 1
    assert main([str(tmp_path / "none.json")]) == 2
    assert main([]) == 2


def test_what_is_not_proved_is_not_saved(tmp_path):
    """Nor is what has functions that the recheck does not know."""
    lost = certify(sliding(K=0.1))
    assert lost.status == "undecided"
    assert lost.missing in lost.verdict
    with pytest.raises(UsageError, match="nothing is proved of 'sliding'"):
        lost.save(tmp_path / "lost.json")
    blunt = sliding(f=lambda x, v: v + (0.1 if x[0] > 0 else -0.1))
    with pytest.raises(UsageError, match="a comparison cannot be written"):
        certify(blunt).save(tmp_path / "blunt.json")
    assert not list(tmp_path.iterdir())
