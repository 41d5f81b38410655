"""Qualified names do not depend on how often python-control copies a dict of parameters."""

import control as ct
import pytest
from small_systems import chain, gain, out

import nlctl
from nlctl.errors import UnknownNameError
from nlctl.names import Parameters

MAKERS = {"control": ct.interconnect, "nlctl": nlctl.interconnect}


@pytest.fixture(params=[1, 2, 3])
def copies(request, monkeypatch):
    """Let every copy be one of a copy, as a python-control that copies more often would."""
    once = Parameters.copy

    def copied(parameters):
        for _ in range(request.param):
            parameters = once(parameters)
        return parameters

    monkeypatch.setattr(Parameters, "copy", copied)


def nested(join, **more):
    """y = 2 * 3 * 5 u: a chain inside of a diagram."""
    parts = [chain(join, name="inner"), gain("last", 5.0, "y", "z")]
    return ct.interconnect(parts, inputs=["u"], outputs=["z"], **more)


joins = pytest.mark.parametrize("join", MAKERS.values(), ids=MAKERS)


@joins
@pytest.mark.usefixtures("copies")
def test_values_are_those_that_were_given(join):
    """Defaults, changed defaults, overrides in a run and their combinations: y = k1 k2 u."""
    diagram = chain(join)
    assert out(diagram) == 6.0
    assert out(diagram, {"first.k": 7.0}) == 21.0
    assert out(diagram, diagram.params | {"first.k": 7.0}) == 21.0
    assert out(diagram, {**diagram.params, "second.k": 1.0}) == 2.0
    diagram.params.update({"first.k": 5.0})
    diagram.params["second.k"] = 7.0
    assert out(diagram) == 35.0
    assert out(diagram, {"first.k": 1.0}) == 7.0
    block = gain("own", 2.0)
    block.params["own.k"] = 4.0
    assert (out(block), out(block, {"own.k": 3.0}), out(block)) == (4.0, 3.0, 4.0)


@joins
@pytest.mark.usefixtures("copies")
def test_values_reach_into_diagrams(join):
    """The same through a diagram inside of one whose parameters are a plain dict, or collected."""
    name = "inner.first.k" if join is nlctl.interconnect else "first.k"
    plain = nested(join, params={"last.k": 10.0, name: 1.0})
    assert out(plain) == 30.0
    assert out(plain, {name: 2.0, "last.k": 1.0}) == 6.0
    collected = nested(join)
    assert (out(collected), out(collected, {"last.k": 1.0, name: 1.0})) == (30.0, 3.0)
    collected.params.update({name: 4.0})
    assert out(collected) == 60.0


def item(diagram, name):
    diagram.params[name] = 1.0


WAYS = {
    "run": lambda d, name: out(d, {name: 1.0}),
    "or": lambda d, name: out(d, d.params | {name: 1.0}),
    "dict": lambda d, name: out(d, {**d.params, name: 1.0}),
    "item": item,
    "update": lambda d, name: (d.params.update({name: 1.0}), out(d)),
    "ior": lambda d, name: (d.params.__ior__({name: 1.0}), out(d)),
}


@joins
@pytest.mark.parametrize("name", ["first.kk", "frist.k", "k"])
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
@pytest.mark.usefixtures("copies")
def test_a_misspelt_name_is_refused(join, name, way):
    """There, or by the run that follows; and the nearest name is told."""
    with pytest.raises(UnknownNameError, match=r"first\.k"):
        way(chain(join), name)


def test_a_name_that_was_refused_can_be_forgotten():
    """It is refused by every run until then."""
    diagram = chain()
    diagram.params.update({"frist.k": 1.0})
    for _ in range(2):
        with pytest.raises(UnknownNameError, match=r"params\.strays\.clear\(\)"):
            out(diagram)
    diagram.params.strays.clear()
    assert out(diagram) == 6.0


@joins
def test_merged_into_a_plain_dict_they_are_refused_and_never_mixed_up(join, monkeypatch):
    """A python-control that no longer copies and updates, but makes one dict of all."""

    def handed_down(diagram, params):
        for part in diagram.syslist:
            part._update_params({**part.params, **diagram.params, **(params or {})})

    monkeypatch.setattr(ct.InterconnectedSystem, "_update_params", handed_down)
    with pytest.raises(UnknownNameError, match="of block 'first'"):
        out(chain(join))
