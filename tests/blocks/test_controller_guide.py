"""Which controller is for which plant: what the table says of each is what each is."""

import inspect
from dataclasses import is_dataclass

import pytest
from rows import each_row

import nlctl
from nlctl.analysis.controller_guide import GUIDES
from nlctl.analysis.lyapunov.certificate.certify import PROOFS, certify
from nlctl.diagrams import leaves
from nlctl.errors import DiagramError

MADE = {guide.name: eval(guide.code, {"nlctl": nlctl}) for guide in GUIDES}
BY_NAME = {guide.name: guide for guide in GUIDES}


def system(name):
    made = MADE[name]
    return made if hasattr(made, "input_labels") else nlctl.block(made, "controller")


def records_in(name):
    """The names of the records that a controller consists of."""
    found = [place.system for place in leaves(system(name))]
    return {type(leaf.spec).__name__ for leaf in found if hasattr(leaf, "spec")}


def test_every_controller_has_its_row():
    """A block of `nlctl.controllers` is a piece of one, or said to stand in the place of one."""
    named = {piece for name in MADE for piece in records_in(name)}
    named |= {piece for guide in GUIDES for piece in guide.instead}
    blocks = {
        name
        for name in nlctl.controllers.__all__
        if is_dataclass(made := getattr(nlctl.controllers, name)) and inspect.isclass(made)
    }
    missing = blocks - named - {"Zero"}  # which is put where a piece is left out
    assert missing == set(), "add a record to analysis/controller_guide.py, or a name to `instead`"
    assert {name for guide in GUIDES for name in guide.instead} <= blocks


def test_every_function_that_connects_a_controller_is_called():
    """Those that make a diagram of their defaults."""
    connecting = set()
    for name in nlctl.controllers.__all__:
        made = getattr(nlctl.controllers, name)
        arguments = inspect.signature(made).parameters.values()
        if inspect.isfunction(made) and "name" in [one.name for one in arguments]:
            connecting.add(name)
    called = {name for name in connecting if any(f"nlctl.{name}(" in g.code for g in GUIDES)}
    assert connecting == called
    assert "mrac" in called


@each_row("name", list(MADE))
def test_what_is_measured_and_what_it_costs(name):
    """Its inputs, its states and its parameters are counted on the controller itself."""
    guide, made = BY_NAME[name], system(name)
    assert tuple(made.input_labels) == guide.measured
    assert made.nstates == guide.costs.states
    assert len(nlctl.parameters(made)) == guide.costs.parameters


@pytest.mark.slow
@each_row("name", [guide.name for guide in GUIDES if guide.costs.time is not None])
def test_a_proof_is_one_that_certify_finds(name):
    """The kind that fits the loop of Example 1 with it, and none where none is named."""
    loop = nlctl.paper.example_1(controller=MADE[name])
    fitting = [kind.name for kind in PROOFS if kind.fits is not None and kind.fits(loop)]
    if BY_NAME[name].proof:
        assert fitting == [BY_NAME[name].proof]
    elif fitting:
        with pytest.raises(DiagramError, match="ConstrainedError"):
            certify(loop)


def test_what_is_said_to_be_proved_has_a_kind_of_proof():
    """And what has none says so in its first words."""
    kinds = {kind.name for kind in PROOFS}
    for guide in GUIDES:
        assert guide.proof in kinds | {""}
        assert bool(guide.proof) != guide.proved.startswith(("nothing", "here nothing"))
