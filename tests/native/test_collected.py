"""How often garbage is collected while a diagram is compiled, and behind that."""

import gc

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import CompileError
from nlctl.native.collected import collected_rarely


@pytest.fixture(
    params=[(700, 10, 10), (0, 10, 10), (100_000, 5, 5)], ids=["often", "never", "rare"]
)
def threshold(request):
    before = gc.get_threshold()
    gc.set_threshold(*request.param)
    yield request.param
    gc.set_threshold(*before)


def test_it_is_as_before_behind_that(threshold):
    with collected_rarely(), collected_rarely():
        assert not 0 < gc.get_threshold()[0] < 50_000
        assert gc.get_threshold()[1:] == threshold[1:]
    assert gc.get_threshold() == threshold


def drawn(t, x, u, p):
    return [np.random.default_rng().normal() - x[0]]


def test_it_is_as_before_behind_what_is_refused(threshold):
    noisy = ct.nlsys(drawn, lambda t, x, u, p: x, inputs=0, outputs=1, states=1, name="noisy")
    with pytest.raises(CompileError):
        nlctl.compile(noisy)
    assert gc.get_threshold() == threshold
