"""A saved certificate with a reference model follows from its file; a tampered one does not."""

import copy
import json
import random
import tempfile
from fractions import Fraction

import numpy as np
import pytest
from examples import many
from mrac_loops import SINE, e_modification, first_order, half_sine, projection, sigma, wing_rock
from tampering import answers, leaves_of, put, scaled

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.recheck import Refuted, main, proved_bounds, recheck, seal_of

pytestmark = pytest.mark.slow
ROLL = {"plant.x1": (-0.2, 0.2), "plant.x2": (-0.2, 0.2), "model.xm1": (-0.1, 0.1),
        "weights.W_hat": (-0.1, 0.1)}  # fmt: skip
bent = nlctl.equation(lambda x, v: 2.0 * x[0] + 0.1 * np.tanh(x[0]) + v)
direct = nlctl.equation(lambda x, v: -x[0] + 2.0 * v)


def driven(weights, **how):
    """Order one, with a command and a disturbance."""
    return first_order(weights, d=half_sine, b=1.0, reference=SINE, **how)


LOOPS = {
    "sigma": lambda: certify(driven(sigma())),
    "sigma of order 2 from a box": lambda: certify(
        wing_rock(sigma(nodes=6)), starts=ROLL
    ),
    "sigma from a level": lambda: certify(driven(sigma()), starts={"V": 6.0, "model.xm1": (-1, 1)}),
    "e": lambda: certify(driven(e_modification())),
    "e from a box": lambda: certify(wing_rock(e_modification(nodes=6)), starts=ROLL),
    "projection": lambda: certify(driven(projection())),
    "projection without a disturbance": lambda: certify(wing_rock(projection(nodes=6))),
    "no modification": lambda: certify(first_order(sigma(0.0))),
    "an external input": lambda: certify(first_order(sigma(), inputs=["w"]), inputs={"w": 0.5}),
    "a direct law": lambda: certify(
        first_order(sigma(0.3, 20.0), f=direct, k=3.0, b=3.0, law=nlctl.controllers.DirectLaw())
    ),
    "a function that is not spanned": lambda: certify(first_order(sigma(), f=bent)),
    "a negative gain of both": lambda: certify(
        first_order(sigma(), f=nlctl.equation(lambda x, v: 2.0 * x[0] - 3.0 * v), gain=-2.0)
    ),
    "a backlash": lambda: certify(
        first_order(sigma(), actuator=nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.4, c_l=-0.4))
    ),
    "another function as command": lambda: certify(
        first_order(
            sigma(), b=1.0,
            reference=nlctl.FunctionReference(order=0, function=lambda t: (0.1 * np.cos(t),)),
        )
    ),
}  # fmt: skip


@pytest.fixture(scope="module", params=LOOPS)
def saved(request, tmp_path_factory):
    """A certificate, and its file."""
    found = LOOPS[request.param]()
    assert found.holds
    return found, found.save(tmp_path_factory.mktemp("saved") / "certificate.json")


@pytest.fixture(scope="module")
def contents(tmp_path_factory):
    """What four of the files hold."""
    folder = tmp_path_factory.mktemp("some")
    names = {"box": "sigma of order 2 from a box", "sigma": "sigma", "e": "e",
             "projection": "projection", "level": "sigma from a level"}  # fmt: skip
    return {
        short: json.loads(LOOPS[name]().save(folder / f"{short}.json").read_text())
        for short, name in names.items()
    }


def test_the_answer_is_yes(saved, capsys):
    """With bounds that are those of the certificate, to a few percent; none is below it."""
    found, file = saved
    assert main([str(file)]) == 0
    assert capsys.readouterr().out.startswith("yes: |E_1| <= ")
    claim = {name: float(Fraction(b)) for name, b in json.loads(file.read_text())["claim"].items()}
    known = {f"|E_{i + 1}|": e for i, e in enumerate(found.errors)}
    known |= {"|u|": found.u_max, "|W_hat|": found.region.W_hat, "limsup |E_1|": found.ultimate}
    assert claim.keys() == known.keys()
    for name, bound in known.items():
        assert bound * (1 - 1e-6) <= claim[name] <= 1.05 * bound + 1e-9, name


def entry(*path):
    return ("premises", *path)


CLAIMS = ("|E_1|", "|E_2|", "|W_hat|", "|u|", "limsup |E_1|")
ADDED = ["number", "1"]


def more(nodes):
    """Add 1 to an equation."""
    nodes.extend([ADDED, ["+", len(nodes) - 1, len(nodes)]])


def negated(nodes):
    """Multiply an equation by -1."""
    nodes.extend([["number", "-1"], ["*", len(nodes) - 1, len(nodes)]])


WRONG = {
    **{("box", f"less {name}"): scaled(("claim", name), Fraction(99, 100)) for name in CLAIMS},
    ("box", "another bound"): put(("claim", "|x1|"), "1"),
    ("box", "more starts"): scaled(entry("starts", "plant.x1"), 30),
    ("box", "more of the model"): scaled(entry("starts", "model.xm1"), 30),
    ("box", "more weights"): scaled(entry("starts", "weights.W_hat[3]"), 50),
    ("box", "an empty start"): put(entry("starts", "plant.x2"), ["1", "0"]),
    ("box", "no starts"): put(entry("starts"), {}),
    ("box", "a state twice"): put(entry("plant"), ["plant.x1", "plant.x1"]),
    ("box", "one weight"): put(entry("W_hat"), ["weights.W_hat[0]"]),
    ("box", "other gains"): scaled(entry("K"), 2),
    ("box", "another model"): scaled(entry("a"), 3),
    ("box", "more of the command"): scaled(entry("b"), 3),
    ("box", "a larger command"): scaled(entry("command"), 2),
    ("box", "a negative command"): scaled(entry("command"), -1),
    ("box", "another gain of the law"): scaled(entry("gain"), 2),
    ("box", "the other sign of the law"): scaled(entry("gain"), -1),
    ("box", "a law without gain"): put(entry("gain"), None),
    ("box", "another r"): scaled(entry("P_b"), Fraction(11, 10)),
    ("box", "weights that learn faster"): scaled(entry("weights", "Gamma"), 4),
    ("box", "weights that learn slower"): scaled(entry("weights", "Gamma"), Fraction(1, 4)),
    ("sigma", "no modification"): put(entry("weights", "sigma"), "0"),
    ("box", "a negative one"): scaled(entry("weights", "sigma"), -1),
    ("box", "an unknown one"): put(entry("weights", "kind"), "dead zone"),
    ("box", "a stronger actuator"): scaled(entry("actuator", "k_2"), 2),
    ("box", "a weaker actuator"): scaled(entry("actuator", "k_1"), Fraction(1, 2)),
    ("box", "no gain"): put(entry("actuator", "k_1"), "0"),
    ("box", "an actuator that errs"): put(entry("actuator", "eps"), "20"),
    ("box", "one that errs by less than nothing"): put(entry("actuator", "eps"), "-1"),
    ("box", "a range of the split"): put(entry("actuator", "range"), "1"),
    ("box", "a disturbance"): lambda made: more(made["premises"]["equation"]),
    ("box", "the other sign of the plant"): lambda made: negated(made["premises"]["equation"]),
    ("box", "another regressor"): lambda made: more(made["premises"]["regressor"][3]),
    ("box", "one regressor less"): lambda made: made["premises"]["regressor"].pop(),
    ("box", "another P"): scaled(("proof", "error", "P"), 2),
    ("box", "a P that is not symmetric"): lambda made: made["proof"]["error"]["P"].reverse(),
    ("box", "a faster decay"): scaled(("proof", "error", "mu"), Fraction(101, 100)),
    ("box", "no decay"): put(("proof", "error", "mu"), "0"),
    ("box", "no P of the model"): put(("proof", "model", "P"), ["0"] * 4),
    ("box", "a negative P of the model"): scaled(("proof", "model", "P"), -1),
    ("box", "a faster model"): scaled(("proof", "model", "mu"), 2),
    ("box", "another input gain"): scaled(("proof", "beta"), 2),
    ("box", "no input gain"): put(("proof", "beta"), "0"),
    ("box", "other weights"): scaled(("proof", "W"), Fraction(9, 10)),
    ("box", "a smaller C"): scaled(("proof", "stages", 0, "C"), Fraction(1, 2)),
    ("box", "a larger C"): scaled(("proof", "stages", 0, "C"), 100),
    ("box", "no stages"): put(("proof", "stages"), []),
    ("box", "a rate that is too fast"): scaled(("proof", "stages", 0, "alpha_1"), 100),
    ("box", "no rate"): put(("proof", "stages", 0, "alpha_1"), "0"),
    ("box", "another kind"): put(("kind",), "sliding mode"),
    ("sigma", "less of what is not learned"): scaled(
        ("proof", "stages", 0, "rest"), Fraction(9, 10)
    ),
    ("sigma", "a negative rest"): put(("proof", "stages", 0, "rest"), "-1"),
    ("sigma", "faster in the end"): scaled(("proof", "stages", 0, "alpha_1"), 3),
    ("e", "less of e-modification"): scaled(("proof", "stages", 0, "V_e"), Fraction(98, 100)),
    ("e", "none"): put(entry("weights", "sigma"), "0"),
    ("e", "a second stage"): lambda made: made["proof"]["stages"].append(
        made["proof"]["stages"][0]
    ),
    ("e", "as projection"): put(entry("weights", "kind"), "projection"),
    ("e", "as sigma-modification"): put(entry("weights", "kind"), "sigma-modification"),
    ("projection", "a ball that is too small"): put(entry("weights", "W_max"), "2"),
    ("projection", "a larger ball"): put(entry("weights", "W_max"), "5"),
    ("projection", "a wide boundary"): put(entry("weights", "width"), "3"),
    ("projection", "a later start"): scaled(("proof", "stages", 0, "C"), Fraction(9, 10)),
    ("level", "a higher level"): scaled(entry("level"), 4),
    ("level", "no level"): put(entry("level"), None),
    ("level", "a negative level"): put(entry("level"), "-1"),
}  # fmt: skip
TRUE = {
    ("box", "a larger bound"): scaled(("claim", "|u|"), 2),
    ("box", "fewer starts"): scaled(entry("starts", "plant.x1"), Fraction(1, 2)),
    ("box", "a smaller command"): scaled(entry("command"), Fraction(1, 2)),
    ("sigma", "a range that is reached"): put(entry("actuator", "range"), "1000"),
    ("level", "a lower level"): scaled(entry("level"), Fraction(1, 2)),
    ("projection", "a narrower boundary"): scaled(entry("weights", "width"), Fraction(1, 2)),
}


@pytest.mark.parametrize(("which", "what"), WRONG)
def test_what_does_not_follow_is_answered_with_no(contents, which, what, tmp_path, capsys):
    """Whether or not the file was sealed anew; and never with a traceback."""
    made = copy.deepcopy(contents[which])
    WRONG[which, what](made)
    file = tmp_path / "tampered.json"
    for seal in (made["seal"], seal_of(made)):
        made["seal"] = seal
        file.write_text(json.dumps(made))
        assert main([str(file)]) == 1
        assert capsys.readouterr().out.startswith("no: ")


@pytest.mark.parametrize(("which", "what"), TRUE)
def test_another_true_claim_is_another_file(contents, which, what):
    """What follows as well is believed once it is sealed, and not before."""
    made = copy.deepcopy(contents[which])
    TRUE[which, what](made)
    with pytest.raises(Refuted, match="changed after it was written"):
        recheck(made)
    made["seal"] = seal_of(made)
    assert recheck(made)


@pytest.mark.parametrize("which", ["box", "e", "projection", "level"])
def test_nonsense_is_answered_with_no(contents, which, tmp_path, capsys):
    """Any entry replaced by anything; yes only where it is a premise, or weakens the claim."""
    content, rng = contents[which], random.Random(which)
    things = [None, True, -1, "1/0", "1e9", "x", [], {}, ["1", "2"], "0", 1.5, {"a": "1"}, "1"]
    file = tmp_path / "nonsense.json"
    for way, answer, said in answers(content, rng, things, 100, file, capsys):
        assert (answer, said[:4]) in ((1, "no: "), (0, "yes:")), way
        assert answer or way[0] in ("claim", "loop", "premises"), way


@pytest.mark.parametrize("factor", [2, Fraction(1, 2)])
@pytest.mark.parametrize("way", [("command",), ("b",), ("weights", "Gamma"), ("weights", "sigma")])
def test_the_premises_are_printed(contents, way, factor):
    """With another premise there is another sentence, if there is one."""
    content = contents["sigma"]
    made = copy.deepcopy(content)
    scaled(("premises", *way), factor)(made)
    del made["claim"]["limsup |E_1|"]
    made["claim"] = {name: str(Fraction(bound) * 9) for name, bound in made["claim"].items()}
    C = str(Fraction(made["proof"]["stages"][0]["C"]) * 5)
    made["proof"]["stages"] = [{"C": C, "rest": "1/2", "alpha_1": "1/4"}]
    made["seal"] = seal_of(made)
    premises = [recheck(each).partition("Premises: ")[2] for each in (content, made)]
    assert premises[0] != premises[1]


@pytest.mark.weekly
def test_no_other_proof_gives_less_than_what_runs_do():
    """Numbers of the proof moved at random: what is still accepted holds along runs."""
    loop, rng = driven(sigma()), random.Random(1)
    content = _content(certify(loop))
    run = nlctl.input_output_response(loop, np.linspace(0, 40, 4001), rtol=1e-8, atol=1e-10)
    signals = {"|E_1|": "e", "|u|": "u", "|W_hat|": "W_norm"}
    rows = {name: run.outputs[run.output_labels.index(label)] for name, label in signals.items()}
    accepted = 0
    for _ in range(many(300, part=3)):
        made = copy.deepcopy(content["proof"])
        numbers = [way for way in leaves_of(made) if isinstance(_at(made, way), str)]
        for way in rng.sample(numbers, rng.randint(1, 2)):
            scaled(way, Fraction(rng.choice([1, 5, 9, 10, 11, 20, 40]), 10))(made)
        try:
            bounds = proved_bounds(content | {"proof": made})
        except (Refuted, ArithmeticError):
            continue
        accepted += 1
        assert all(float(bounds[name]) >= np.abs(row).max() for name, row in rows.items())
    assert accepted > many(10, part=3)


def _at(made, way):
    for key in way:
        made = made[key]
    return made


def _content(found):
    with tempfile.TemporaryDirectory() as folder:
        return json.loads(found.save(f"{folder}/certificate.json").read_text())
