"""A comparison is remembered by what a loop computes: no change of a loop goes unnoticed."""

import types

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.lyapunov.loop import checked as same_loop
from nlctl.analysis.lyapunov.loop.roles import loop_content
from nlctl.errors import DiagramError

SLOPE = 1.0


@nlctl.equation
def drift(x, v):
    """A plant's f, whose slope is a global number."""
    return -SLOPE * x[0] + 5.0 * v


def known_sign(**fields):
    law = nlctl.controllers.KnownSignLaw(**fields)
    robust = nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5)
    weights = nlctl.controllers.AdaptiveWeights(Gamma=10.0)
    return nlctl.adaptive_neural(2, law=law, weights=weights, robust=robust)


def example():
    return nlctl.paper.example_1(controller=known_sign())


def block(loop, path):
    system = loop
    for name in path.split("."):
        (system,) = (part for part in system.syslist if part.name == name)
    return system


@pytest.fixture
def compared(monkeypatch):
    """Count the points at which loops are compared."""
    points = []
    compare = same_loop._compare
    monkeypatch.setattr(
        same_loop, "_compare", lambda *given: points.append(given[2][0]) or compare(*given)
    )
    return points


def test_a_loop_of_the_same_content_is_compared_at_its_start_and_has_the_same_bounds(compared):
    first = certify(example())
    before = len(compared)
    again = certify(example())
    assert len(compared) - before == 1
    assert compared[-1] == 0.0
    assert (again.C_0, again.u_max, again.loop_facts) == (first.C_0, first.u_max, first.loop_facts)


@pytest.mark.parametrize("change", [{"law.beta": 2.5}, {"plant.p1": -0.3}, {"actuator.b_r": 0.4}])
def test_other_values_are_compared_again(change, compared):
    certify(example())
    before = len(compared)
    certify(example(), params=change)
    assert len(compared) - before > 1


def test_the_same_gains_with_more_values_are_compared_at_fewer_points(compared):
    """The functions and the wiring are what was compared at all of them."""
    certify(example(), params={"law.beta": 2.1})
    before = len(compared)
    found = certify(example(), params={"law.beta": 2.2})
    assert len(compared) - before == 4
    assert found.C_0 == certify(nlctl.paper.example_1(controller=known_sign(beta=2.2))).C_0


def test_another_wiring_with_other_values_is_compared_and_refused():
    for beta in (2.1, 2.2):
        certify(example(), params={"law.beta": beta})
    loop = example()
    rewired(loop)
    with pytest.raises((DiagramError, AttributeError)):
        certify(loop, params={"law.beta": 2.3})


def swapped_output(loop):
    actuator = block(loop, "actuator")
    code = actuator.spec.output.__code__
    other = types.FunctionType(code, {**actuator.spec.output.__globals__, "np": None})
    actuator.outfcn = other


def rewired(loop):
    loop.connect_map[0, :] = -loop.connect_map[0, :]


def other_rates(loop):
    rates = type(loop)._rhs
    loop._rhs = lambda t, x, u: 2.0 * rates(loop, t, x, u)


def other_rates_of_a_block(loop):
    plant = block(loop, "plant")
    rates = type(plant)._rhs
    plant._rhs = lambda t, x, u: rates(plant, t, x, u) + 1.0 * (t > 0)


def other_signals(loop):
    found = type(loop)._compute_static_io

    def computed(t, x, u):
        given, signals = found(loop, t, x, u)
        return given + 0.5 * (np.abs(x).max() > 1.0), signals

    loop._compute_static_io = computed


@pytest.mark.parted
@pytest.mark.parametrize(
    "plant", [swapped_output, rewired, other_rates, other_rates_of_a_block, other_signals]
)
def test_a_loop_that_was_changed_in_place_is_not_certified(plant):
    certify(example())
    loop = example()
    certify(loop)
    plant(loop)
    with pytest.raises((DiagramError, AttributeError)):
        certify(loop)


def test_a_global_number_that_changes_is_another_loop(monkeypatch, compared):
    def loop():
        plant = nlctl.PureFeedback(order=1, f=drift, d=lambda x, t: 0.5 * np.sin(t))
        weights = nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=5.0, sigma_1=0.2)
        model = nlctl.controllers.ReferenceModel(a=(1.0,), b=0.0)
        controller = nlctl.mrac(model, weights=weights)
        blocks = {"reference": nlctl.SumOfSines(order=0), "actuator": nlctl.Gain()}
        return nlctl.interconnect({**blocks, "plant": plant, "controller": controller})

    first, key = certify(loop()), loop_content(loop()).key
    assert key
    assert loop_content(loop()).key == key
    monkeypatch.setitem(globals(), "SLOPE", -2.0)
    before = len(compared)
    again = certify(loop())
    assert loop_content(loop()).key != key
    assert len(compared) - before > 1
    assert again.V_max != first.V_max
    assert again.loop_facts["blocks"]["plant"] != first.loop_facts["blocks"]["plant"]


def test_nothing_is_remembered_of_blocks_whose_functions_no_record_says():
    system = ct.NonlinearIOSystem(
        lambda t, x, u, params: -x,
        lambda t, x, u, params: x,
        states=1,
        inputs=0,
        outputs=["y"],
        name="P",
    )
    assert loop_content(nlctl.interconnect([system])).key == ""
    assert loop_content(example()).key
