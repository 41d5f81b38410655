"""What is wrong with a block of one's own is said when it is made; records travel in pickles."""

import copy
import pickle
from dataclasses import replace

import cloudpickle
import numpy as np
import pytest

import nlctl

OUTPUT, UPDATE = (lambda t, x, u, p: (p.gain * u[0],)), (lambda t, x, u, p: (-x[0],))
RESET = {"reset": lambda t, x, u, p: (x[0],)}


def own(**equations):
    """Return a record with a gain and a state, and these equations instead of its own."""
    fields = {"__annotations__": {"gain": float}, "gain": nlctl.param(1.0, unit="1", meaning="it")}
    fields |= {"inputs": ("u",), "outputs": ("v",), "states": ("q",), "feedthrough": True}
    functions = {"output": OUTPUT, "update": UPDATE} | equations
    fields |= {k: staticmethod(f) if callable(f) else f for k, f in functions.items()}
    return nlctl.record(type("Own", (), fields))()


def misspelt(t, x, u, p):
    return (p.gian * x[0],)


@pytest.mark.parametrize("what", ["output", "update", "guard", "reset", "switching", "commit"])
def test_a_parameter_that_is_not_declared_is_named_with_the_nearest(what):
    """Whichever equation reads it, and wherever that is called first."""
    rest = {"guard": RESET, "reset": {"guard": UPDATE}, "commit": {"memory": ("q",)}}
    told = rf"unknown parameter 'p\.gian' in {what} of Own \(block 'it'\) \(.*line \d+\); nearest: "
    with pytest.raises(nlctl.errors.BlockError, match=told + r"'p\.gain'"):
        nlctl.block(own(**{what: misspelt}, **rest.get(what, {})), "it")


@pytest.mark.parametrize(
    ("equations", "told"),
    [
        ({"output": lambda t, x, u: (u[0],)}, r"output\(t, x, u, p\), a static .*\(t, x, u\)$"),
        ({"guard": lambda x: (x[0],), **RESET}, r"needs guard\(t, x, u, p\).*got guard\(x\)"),
        ({"output": 3.0}, r"needs a function output\(t, x, u, p\), got 3\.0"),
        ({"output": lambda t, x, u, p: "a"}, r"returns 'a' from output, needs 1 number: v"),
        ({"update": lambda t, x, u, p: None}, r"returns 'None' from update, needs 1 number: q"),
        ({"update": lambda t, x, u, p: (1, 2)}, r"returns 2 values from update, needs 1: q"),
        ({"update": lambda t, x, u, p: (1, (2, 3))}, r"from update, needs 1 number: q"),
        ({"guard": lambda t, x, u, p: ("a",), **RESET}, r"from guard, needs numbers"),
        ({"output": lambda t, x, u, p: (u[1],)}, r"IndexError from output \(.*1 state and 1 input"),
        ({"output": lambda t, x, u, p: (p["gain"],)}, r"TypeError from output .*line \d+\)"),
    ],
)
def test_equations_that_cannot_be_called_are_named_with_their_place(equations, told):
    with pytest.raises(nlctl.errors.BlockError, match=rf"^Own \(block 'it'\) .*{told}"):
        nlctl.block(own(**equations), "it")


def test_a_name_in_front_and_arguments_without_names_are_refused():
    with pytest.raises(nlctl.errors.BlockError, match="block takes the record first"):
        nlctl.block("zone", nlctl.DeadZone())
    with pytest.raises(
        nlctl.errors.UnknownKeywordError, match=r"by name, DeadZone\(slope_r=\.\.\."
    ):
        nlctl.DeadZone(0.1)
    with pytest.raises(nlctl.errors.UnknownKeywordError, match=r"'output' of interconnect; near"):
        nlctl.interconnect([], output=["y"])


@nlctl.equation
def falling(x, v):
    return v - x[0]


def test_records_of_functions_travel_by_name():
    """Also after use, and what follows from them does not travel."""
    record = nlctl.PureFeedback(order=2, f=falling)
    nlctl.compile(nlctl.block(record, "plant"))
    for copied in (pickle.loads(pickle.dumps(record)), copy.copy(record), copy.deepcopy(record)):
        assert copied == record
        assert copied.f is falling
        assert vars(copied).keys() == {"order", "f", "d", "initial"}


@pytest.mark.parametrize("pickler", [pickle, cloudpickle])
def test_functions_without_a_name_travel_by_value(pickler):
    """A function in a function keeps what it has captured."""
    gain = np.array([2.0, 3.0])

    def inside(x, v):
        return v - gain[1] * x[0]

    record = pickler.loads(pickler.dumps(nlctl.PureFeedback(order=2, f=inside)))
    assert record.f([2.0, 0.0], 1.0) == -5.0
    assert replace(record, order=3).order == 3
    assert copy.deepcopy(record).f is record.f
    assert nlctl.block(record, "plant").dynamics(0, [2.0, 0.0], [1.0]).tolist() == [0.0, -5.0]


def test_a_function_that_cannot_travel_is_named():
    def made(lock):
        return lambda x, v: v if lock else -v

    class Lock:
        def __reduce__(self):
            raise TypeError("a lock stays here")

    record = nlctl.PureFeedback(order=2, f=made(Lock()))
    told = "PureFeedback cannot be pickled: its f, '.*made.*', reads what cannot be .a lock stays"
    with pytest.raises(nlctl.errors.UsageError, match=told):
        pickle.dumps(record)
