"""Tightening the bound of the paper's proof."""

import functools

import numpy as np
import pytest

import nlctl
from nlctl.analysis.lyapunov import ledger, tighten
from nlctl.errors import ParameterError, UnknownNameError

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them

LIMIT = 14.0


@functools.cache
def loop():
    return nlctl.paper.example_1()


@functools.cache
def found():
    return tighten(loop(), u_limit=LIMIT, horizon=2.0, evaluations=14)


@pytest.mark.weekly
def test_the_bound_gets_smaller_within_the_limit():
    """The published gains are the first trial; the best one keeps the limit of |u|."""
    first = found().trials[0]
    assert first.gains["controller.law.beta"] == pytest.approx(2.5)
    assert found().C_0 < 0.8 * first.C_0
    assert found().u <= LIMIT
    assert len(found().trials) <= 14


def test_the_best_trial_is_examined_with_proved_constants():
    """The ledger of the new gains holds, and its C_0 is what the search saw, to the grid."""
    book = ledger(found().examination)
    assert not book.violated
    assert book.constants.C_0(book.Q) == pytest.approx(found().C_0, rel=1e-9)
    best = min((t for t in found().trials if t.u <= LIMIT), key=lambda t: t.C_0)
    assert pytest.approx(best.C_0, rel=0.05) == found().C_0
    assert found().gains == best.gains
    provenance = book.constants.table()["provenance"]
    assert provenance["eps*"] == provenance["d*"] == provenance["G_max"] == "proved"


def test_the_trade_off_falls():
    """A larger input buys a smaller bound, or it is not on the curve."""
    curve = found().table()
    assert np.all(np.diff(curve["u"]) >= 0)
    assert np.all(np.diff(curve["C_0"]) < 0)
    assert {"controller.robust.tau", "ultimate"} <= set(curve.columns)


def test_impossible_wishes_are_refused():
    """A limit that no gains keep; an unknown bound; no evaluations."""
    with pytest.raises(ParameterError, match=r"the least is .*raise u_limit"):
        tighten(loop(), u_limit=0.01, horizon=1.0, evaluations=2)
    with pytest.raises(UnknownNameError, match="C_0"):
        tighten(loop(), u_limit=1.0, bound="C0")
    with pytest.raises(ParameterError, match="evaluations >= 1"):
        tighten(loop(), u_limit=1.0, evaluations=0)
