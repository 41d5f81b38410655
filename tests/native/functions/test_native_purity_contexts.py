"""Contexts of one's own and attributes by computed names: what they change is refused."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError


class Counting:
    """A context that counts how often it was entered."""

    count = 0

    def __enter__(self):
        self.count += 1
        return self

    def __exit__(self, *_):
        return None


class Swallowing:
    def __enter__(self):
        return self

    def __exit__(self, *_):
        return True


class Late:
    """A context that changes an array when it is left."""

    def __init__(self, kept):
        self.kept = kept

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kept[0] += 1.0


class Holder:
    def __init__(self):
        self.low, self.high, self.calls = 1.0, 2.0, [0]

    @property
    def counted(self):
        self.calls[0] += 1
        return float(self.calls[0])


COUNTING, HOLDER, KEPT = Counting(), Holder(), np.zeros(2)


def counted(t, x, u, params):
    with COUNTING as c:
        return -x * c.count


def swallowed(t, x, u, params):
    with Swallowing():
        return -x / {}["k"]
    return -x


def changed_late(t, x, u, params):
    with Late(KEPT):
        return -x + KEPT


def changed_by_a_property(t, x, u, params):
    return [getattr(HOLDER, name) * x[0] for name in ("counted", "low")]


def changed_through_a_part(t, x, u, params):
    parts = [getattr(HOLDER, name) for name in ("calls", "calls")]
    parts[0][0] += 1
    return -x * parts[1][0]


REFUSED = [counted, swallowed, changed_late, changed_by_a_property, changed_through_a_part]


@pytest.mark.parametrize("update", REFUSED)
def test_it_is_refused(update):
    system = ct.nlsys(update, None, inputs=0, outputs=2, states=2, name="s")
    with pytest.raises(CompileError, match="cannot be compiled"):
        nlctl.compile(system)
