"""The record of a loop changes whenever something changes that its equations reach."""

import json
import pickle
import subprocess
import sys

import control as ct
import numpy as np
import pytest
import source_text
from places import ROOT

import nlctl
from nlctl.analysis.loop_record import loop_facts, loop_values, values_differ

THIRD_PARTY = """
import functools
import numpy as np
import control as ct

LIMIT = 2.0
TABLE = np.array([1.0, 2.0, 3.0])
NAMES = {"k": 1.0}

def inner(z):
    return 1.0 * z

def helper(z):
    return inner(z) + 0.0

class Gains:
    k = 1.0
    def scaled(self, z):
        return z * self.k

class Held:
    def __init__(self, k):
        self.k = k
    def __call__(self, z):
        return z * self.k

class Slotted:
    __slots__ = ("k",)
    def __init__(self, k):
        self.k = k

def times(k):
    def f(z):
        return k * z
    return f

def wrapped(f):
    @functools.wraps(f)
    def outer(t, x, u, params):
        return f(t, x, u, params)
    return outer

def product(k, z):
    return k * z

closure, part, held = times(1.0), functools.partial(product, 1.0), Held(1.0)
slotted, gains = Slotted(1.0), Gains()

@wrapped
def update(t, x, u, params, rate=1.0, *, extra=0.0):
    \"\"\"An equation.\"\"\"
    s = helper(x[0]) + LIMIT + TABLE[1] + NAMES["k"] + gains.scaled(x[0]) + extra
    s = s + closure(x[0]) + part(x[0]) + held(x[0]) + slotted.k + gains.k + params["p"]
    return np.array([-rate * s + u[0] + (lambda z: 3.0 * z)(x[0])])

def output(t, x, u, params):
    return np.array([1.0 * x[0]])

def loop():
    lag = ct.nlsys(update, output, inputs="u", outputs="y", states=1, params={"p": 1.0},
                   name="lag")
    gain = ct.ss([], [], [], [[-0.5]], inputs="y", outputs="u", name="gain")
    filtered = ct.tf([1.0], [1.0, 2.0], inputs="y", outputs="w", name="filter")
    return ct.interconnect([lag, gain, filtered], outputs=["y", "w"], name="d")
"""
EDITS = {
    "a helper's helper": ("return 1.0 * z", "return 1.1 * z"),
    "a helper": ("inner(z) + 0.0", "inner(z) + 0.1"),
    "a global constant": ("LIMIT = 2.0", "LIMIT = 2.1"),
    "a global array": ("[1.0, 2.0, 3.0]", "[1.0, 2.1, 3.0]"),
    "a global dict": ('{"k": 1.0}', '{"k": 1.1}'),
    "an attribute of a class": ("    k = 1.0", "    k = 1.1"),
    "a method": ("return z * self.k\n\nclass Held", "return z + self.k\n\nclass Held"),
    "a call of an object": ("return z * self.k\n\nclass Slotted", "return z + 1\n\nclass Slotted"),
    "an attribute of an object": ("Held(1.0)", "Held(1.1)"),
    "a slot of an object": ("Slotted(1.0)", "Slotted(1.1)"),
    "what a closure holds": ("times(1.0)", "times(1.1)"),
    "a function in a closure": ("return k * z\n    return f", "return k + z\n    return f"),
    "an argument of a partial": ("(product, 1.0)", "(product, 1.1)"),
    "a function in a partial": ("return k * z\n\nclosure", "return k + z\n\nclosure"),
    "a default argument": ("rate=1.0", "rate=1.1"),
    "a keyword's default": ("extra=0.0", "extra=0.1"),
    "a lambda": ("3.0 * z", "3.1 * z"),
    "the function inside a decorator": ("-rate * s", "rate * s"),
    "the decorator": ("return f(t, x, u, params)", "return 2 * f(t, x, u, params)"),
    "the output": ("1.0 * x[0]])", "1.1 * x[0]])"),
    "a parameter of a third-party block": ('{"p": 1.0}', '{"p": 1.1}'),
    "a matrix": ("[[-0.5]]", "[[-0.6]]"),
    "a denominator": ("[1.0, 2.0], inputs", "[1.0, 2.1], inputs"),
    "a connection": ('inputs="y", outputs="w"', 'inputs="u", outputs="w"'),
    "a block more": (
        'filtered], outputs=["y", "w"]',
        'filtered, ct.ss(-1, 1, 1, 0, inputs="y", outputs="q")], outputs=["y", "w", "q"]',
    ),
    "the order of the outputs": ('["y", "w"]', '["w", "y"]'),
}
SAME = {
    "nothing": ("LIMIT", "LIMIT"),
    "a comment": ("LIMIT = 2.0", "LIMIT = 2.0  # of the drive"),
    "lines": ("def helper", "\n\n\ndef helper"),
    "what nobody reads": ("NAMES =", "OTHER = 5\nNAMES ="),
}


def facts(text):
    return loop_facts(source_text.run(text)["loop"]())


@pytest.mark.slow
@pytest.mark.parametrize("name", EDITS)
def test_every_edit_that_the_equations_reach_is_seen(name):
    """Each by itself; the values at the points see it too, where it changes any."""
    old, new = EDITS[name]
    assert THIRD_PARTY.count(old) == 1
    edited = THIRD_PARTY.replace(old, new)
    assert facts(THIRD_PARTY) != facts(edited)
    one, other = (loop_values(source_text.run(t)["loop"](), 1.0) for t in (THIRD_PARTY, edited))
    assert values_differ(one, other) or name == "the order of the outputs"
    assert not values_differ(one, one)


@pytest.mark.parametrize("name", SAME)
def test_what_computes_nothing_is_not_seen(name):
    """A second reading of the file, comments, the place in the file."""
    old, new = SAME[name]
    assert facts(THIRD_PARTY) == facts(THIRD_PARTY.replace(old, new, 1))


RECORDS = """
import nlctl
import numpy as np

STIFFNESS = 9.81

@nlctl.equation
def torque(x):
    return STIFFNESS * np.sin(x)

@nlctl.equation
def pendulum(x, v):
    x1, x2 = x
    return -torque(x1) - 0.1 * x2 + (2 + np.cos(x1)) * v

@nlctl.record
class Soft:
    limit: float = nlctl.param(20.0, unit="1", meaning="largest", above=0)
    inputs, outputs, states, feedthrough = ("u",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (p.limit * np.tanh(u[0] / p.limit),)

def loop():
    return nlctl.interconnect({
        "reference": nlctl.SumOfSines(order=2),
        "plant": nlctl.PureFeedback(order=2, f=pendulum, initial={"x1": 0.5}),
        "controller": nlctl.adaptive_neural(order=2),
        "actuator": Soft(limit=30.0),
    })
"""


@pytest.mark.parted
@pytest.mark.parametrize(
    ("old", "new", "part", "place"),
    [
        ("STIFFNESS = 9.81", "STIFFNESS = 9.82", "blocks", "plant"),
        ("0.1 * x2", "0.2 * x2", "blocks", "plant"),
        ("np.sin(x)", "np.tan(x)", "blocks", "plant"),
        ("np.tanh(u", "np.arctan(u", "blocks", "actuator"),
        ("Soft(limit=30.0)", "Soft(limit=31.0)", "parameters", "actuator.limit"),
        ('{"x1": 0.5}', '{"x1": 0.6}', "initial_state", "plant.x1"),
        ('"actuator": Soft', '"motor": Soft', "wiring", "diagram"),
        ("neural(order=2)", "neural(order=2, law=nlctl.controllers.KnownSignLaw())",
         "blocks", "controller.law"),
    ],
)  # fmt: skip
def test_the_place_of_an_edit_is_named(old, new, part, place):
    """Blocks of nlctl: the plant's function, an own record, a value, a block that was exchanged."""
    assert RECORDS.count(old) == 1
    one, other = facts(RECORDS), facts(RECORDS.replace(old, new))
    if old.startswith('"actuator"'):
        assert "motor" in other["blocks"]
        return
    assert {p for p in one if one[p] != other[p]} >= {part}
    changed = {k for k in {**one[part], **other[part]} if one[part].get(k) != other[part].get(k)}
    assert place in changed
    if part != "blocks" or place == "plant":
        assert changed == {place}


def test_the_names_that_python_control_gives_do_not_count():
    """They are numbered by the process."""

    def make():
        first = ct.ss(-1.0, 1.0, 1.0, 0.0, inputs="u", outputs="y")
        other = ct.ss(-2.0, 1.0, 1.0, 0.0, inputs="y", outputs="z")
        return ct.interconnect([first, other], inputs="u", outputs="z")

    one, other = make(), make()
    assert one.syslist[0].name != other.syslist[0].name
    assert loop_facts(one) == loop_facts(other)
    assert loop_values(one, 1.0) == loop_values(other, 1.0)


@pytest.mark.weekly
@pytest.mark.ci
def test_a_record_is_the_same_in_another_process():
    """Addresses, hash seeds and the order of sets are no part of it."""
    script = (
        "import json, nlctl\n"
        "from nlctl.analysis.loop_record import loop_facts, loop_values\n"
        "loop = nlctl.paper.example_2()\n"
        "print(json.dumps([loop_facts(loop), loop_values(loop, 20.0)]))\n"
    )
    there = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True,
        cwd=ROOT,
    ).stdout  # fmt: skip
    loop = nlctl.paper.example_2()
    assert json.loads(there) == [loop_facts(loop), loop_values(loop, 20.0)]


def test_points_at_which_a_function_raises_are_left_out_and_told():
    """The points are not the user's: his function may refuse some of them."""

    def loop(gain, least):
        def update(t, x, u, params):
            if x[0] < least:
                raise ZeroDivisionError
            return gain * x

        return ct.nlsys(update, None, states=1, outputs=1, inputs=0)

    every = ", ".join(f"ZeroDivisionError at point {k}" for k in range(6))
    assert loop_values(loop(1.0, np.inf), 1.0)["raises"] == every
    one, other = (loop_values(loop(gain, 0.0), 1.0) for gain in (1.0, 2.0))
    assert one["raises"] == other["raises"]
    assert 0 < one["raises"].count("at point") < 6
    assert len([name for name in values_differ(one, other) if name.endswith("'")]) == 1


def test_facts_stay_whatever_else_is_declared_or_pickled():
    """Blocks that are declared later, and pickles, change nothing of a loop."""
    loop = nlctl.paper.example_1()
    before = loop_facts(loop)

    @nlctl.record
    class Later:
        inputs, outputs = ("u",), ("v",)

        @nlctl.equation
        def output(t, x, u, p):
            return (2 * u[0],)

    pickle.dumps(nlctl.DeadZone())
    nlctl.block(Later(), "later")
    assert loop_facts(loop) == before
