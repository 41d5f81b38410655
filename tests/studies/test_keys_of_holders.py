"""Keys of what seldom holds a number: another number is another key, the same one is not."""

import functools
import string
import sys
import types
import weakref

import pytest

from nlctl.native.machine.fingerprint import content_key, unseen_in


class Thing:
    """A key of weak dictionaries, and a holder of attributes."""


KEY = Thing()


def template(value):
    held = string.Template(repr(value))
    return lambda v: float(held.template) * v


def formatter(value):
    class Own(string.Formatter):
        factor = value

    held = Own()
    return lambda v: held.factor * v


def weak_keys(value):
    held = weakref.WeakKeyDictionary({KEY: value})
    return lambda v: held[KEY] * v


def module_that_makes_names(value):
    held = types.ModuleType("made_here")
    held.__getattr__ = lambda name: value
    return lambda v: held.factor * v


def dispatched(value):
    @functools.singledispatch
    def held(v):
        return v

    held.register(float, lambda v: value * v)
    return lambda v: held(v)


HOLDERS = [template, formatter, weak_keys, module_that_makes_names, dispatched]


@pytest.mark.parametrize("holder", HOLDERS)
def test_another_number_is_another_key(holder):
    """In the ninth digit; and none of them is named as what nobody sees."""
    one, same, other = (content_key(holder(value)) for value in (1.0, 1.0, 1.0 + 1e-9))
    assert one == same
    assert one != other
    assert unseen_in(holder(1.0)) == []


def test_what_a_dispatcher_has_found_is_not_in_its_key():
    """It keeps by class which function was called, from call to call."""
    made = dispatched(2.0)
    before = content_key(made)
    assert (made(1.5), made("text")) == (3.0, "text")
    assert content_key(made) == before
    assert "made_here" not in sys.modules
