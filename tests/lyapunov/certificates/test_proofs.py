"""The list of proofs: each is found by a public function, documented, and shown to hold once."""

import json
import re

import pytest
from mrac_loops import first_order, half_sine, sigma
from places import ROOT
from planted_loops import SLIDING, wired

from nlctl.analysis import lyapunov
from nlctl.analysis.lyapunov import Box, barrier, certify, region_of_attraction
from nlctl.analysis.lyapunov.certificate.certify import PROOFS
from nlctl.analysis.lyapunov.proofs.result import Certificate, ProofResult
from nlctl.analysis.recheck import RECHECKED, recheck

BOX = Box.of(x1=(-3, 3), x2=(-3, 3))
LOOPS = {  # of each kind that `certify` knows one that it proves
    "known sign": wired,
    "sliding mode": lambda: wired(of=SLIDING),
    "reference model": lambda: first_order(sigma(), d=half_sine),
}
OTHERS = {  # of each other kind one proof
    "region of attraction": lambda: region_of_attraction(
        lambda x: (-x[1], x[0] + (x[0] ** 2 - 1) * x[1]), BOX, P=[[1.5, -0.5], [-0.5, 1.0]]
    ),
    "barrier": lambda: barrier(
        lambda x: (x[1], -x[0] - x[1]),
        BOX,
        start=Box.of(x1=(0.9, 1.1), x2=(-0.1, 0.1)),
        unsafe=Box.of(x1=(-3, -0.95), x2=(-3, 3)),
    ),
}
FOR_LOOPS = [kind for kind in PROOFS if kind.fits is not None]


def leaves_of(kind):
    """The classes of results that nothing is derived from."""
    below = kind.__subclasses__()
    return {kind} if not below else set().union(*map(leaves_of, below))


def rows_of_the_guide():
    """The rows of the table of proofs in the guide, by name."""
    text = (ROOT / "docs" / "explanation" / "certificates.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([a-z ]+) \| `(\w+)` \| `(\w+)` \| (\w+) \|", text, re.MULTILINE)
    return {name: (find, result, again) for name, find, result, again in rows}


def test_every_result_is_of_a_kind_in_the_list():
    """A proof of which the list knows nothing is missing there: give it its line."""
    assert leaves_of(ProofResult) == {kind.result for kind in PROOFS}
    assert len({kind.name for kind in PROOFS}) == len(PROOFS)


def test_a_proof_is_missing_nowhere():
    """Its function and result are public, the guide has its row, and a test proves one."""
    public = set(lyapunov.__all__)
    assert {n for k in PROOFS for n in (k.find, k.result.__name__) if n not in public} == set()
    wanted = {
        k.name: (k.find, k.result.__name__, "yes" if k.name in RECHECKED else "no") for k in PROOFS
    }
    assert rows_of_the_guide() == wanted
    assert {k.name for k in PROOFS} == {*LOOPS, *OTHERS}


def test_every_proof_for_loops_is_rechecked():
    """The recheck has a list of its own, as it knows nothing of the prover: both are one."""
    assert {kind.name for kind in FOR_LOOPS} == set(RECHECKED)
    assert all(issubclass(kind.result, Certificate) for kind in FOR_LOOPS)


# a sliding mode is proved, saved and rechecked each day in test_recheck
@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[pytest.mark.weekly] * (kind.name == "sliding mode"))
        for kind in FOR_LOOPS
    ],
    ids=lambda kind: kind.name,
)
def test_a_loop_is_proved_by_its_kind_alone(kind, tmp_path):
    """It fits no other kind, closes a box, and its file is believed with what it claims."""
    loop = LOOPS[kind.name]()
    assert [other.name for other in FOR_LOOPS if other.fits(loop)] == [kind.name]
    found = certify(loop)
    assert (type(found), found.status, found.kind) == (kind.result, "proved", kind.name)
    assert found.iterations[-1] < found.C
    assert found.seconds > 0
    assert found.arithmetic in ("balls", "floats")
    content = json.loads(found.save(tmp_path / "proof.json").read_text())
    assert content["kind"] == kind.name
    assert recheck(content).startswith(next(iter(content["claim"])))


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_other_proofs_say_the_same_things(name):
    """Claim, status, what is missing, box, boxes, arithmetic, seconds: as those of loops do."""
    (kind,) = [kind for kind in PROOFS if kind.name == name]
    found = OTHERS[name]()
    assert type(found) is kind.result
    assert (found.status, found.missing, found.box) == ("proved", "", BOX)
    assert found.boxes > 0
    assert found.seconds > 0
    assert found.verdict.startswith(found.claim)
    assert "rounded outwards" in found.arithmetic
