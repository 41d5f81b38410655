"""Calls of public functions with one wrong argument: what becomes of them, and how often.

What a call ends in is a refusal in a sentence of nlctl, a value, or a raw error of Python or of a
library, deep inside and without the argument's name.  The bounds of the latter may only fall.
"""

import contextlib
import decimal
import signal
import traceback
import warnings
from pathlib import Path

import control as ct
import numpy as np
import pandas as pd
import pytest
from call_examples import GROUPS
from examples import some

import nlctl
from nlctl.errors import DivergedError, UsageError
from nlctl.host.checkout import SOURCES

OWN = [Path(folder) for folder in SOURCES]
LIMIT = 10.0  # s that a call may take
WRONG = [
    None, True, 0, 1, -1, 10**30, -2.5, float("nan"), float("inf"), 1e308, 1j, "", "no such",
    "a\nb", b"x", [], [1], [float("nan")], ["a"], [None], [[1, 2], [3]], (), (1, 2, 3), {},
    {"a": 1}, {1: 2}, {"a": "b"}, {"a": None}, object(), int, len, lambda *given: None,
    np.array([]), np.array(1.0), np.ones((2, 2)), np.array(["a"]), np.array([1j]),
    np.datetime64("2020-01-01"), np.array([None]), pd.DataFrame(), pd.DataFrame({"a": ["b"]}),
    pd.Series([1.0]), range(3), Path("no/such"), iter([1]), ..., decimal.Decimal(1),
    ct.ss(-1, 1, 1, 0), nlctl.Gain(), nlctl.Gain,
]  # fmt: skip


class TooLong(BaseException):
    """A call has taken longer than `LIMIT`."""


@contextlib.contextmanager
def limited(limit):
    def late(*_):
        raise TooLong

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, limit, 1.0)  # again: a callback of ctypes swallows it
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def outcome(call, limit=LIMIT):
    """Return "value", "refused", "raw" or "long" for a call, and what it said."""
    try:
        with warnings.catch_warnings(), limited(limit), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            call()
    except TooLong:
        return "long", ""
    except (UsageError, DivergedError) as error:
        return ("refused" if len(str(error).split()) > 3 else "raw"), str(error)
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        ours = any(Path(last.filename).is_relative_to(folder) for folder in OWN)
        said = f"{type(error).__name__}: {error}"
        if isinstance(error, OSError) and error.filename:
            return "refused", said  # Python's own sentence names the file
        is_sentence = ours and "raise" in (last.line or "") and len(str(error).split()) > 3
        return ("refused" if is_sentence else "raw"), said
    return "value", ""


def wrong_calls(group):
    """Yield every call of a group with one wrong argument."""
    for function, example in GROUPS[group].items():
        for name in example():
            for k, value in enumerate(WRONG):
                given = example() | {name: value}
                yield f"{function.__name__}({name}=#{k})", lambda f=function, g=given: f(**g)


def counted(calls):
    """Return how many calls end in what, and the raw errors by call."""
    found, raw = dict.fromkeys(("value", "refused", "raw", "long"), 0), {}
    for name, call in calls:
        kind, said = outcome(call)
        found[kind] += 1
        if kind in ("raw", "long"):
            raw[name] = f"{kind} {said}".splitlines()[0][:100]
    return found, raw


BOUNDS = {  # raw errors and calls that do not end, of calls; 16 of 100 of all once: may only fall
    "nlctl": (0, 6900), "records": (0, 15400), "designs": (2, 4750), "statistics": (0, 2650),
    "searches": (20, 2900), "metrics": (2, 2400), "pages": (3, 3950), "figures": (27, 1200),
    "proofs": (6, 4550), "methods": (0, 1650),
}  # fmt: skip


@pytest.mark.weekly
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("group", GROUPS)
def test_calls_with_one_wrong_argument_end_in_a_sentence(group, tmp_path, monkeypatch):
    """Fifty wrong values of every argument; what is callable may raise what it likes."""
    monkeypatch.chdir(tmp_path)
    most, about = BOUNDS[group]
    found, raw = counted(wrong_calls(group))
    assert abs(sum(found.values()) - about) <= 0.02 * about  # the bound is of this many calls
    assert len(raw) <= most, raw


def test_less_than_one_call_of_a_hundred_may_end_raw():
    most, about = (sum(column) for column in zip(*BOUNDS.values(), strict=True))
    assert most < 0.01 * about


@pytest.mark.slow
@pytest.mark.parametrize("group", GROUPS)
def test_some_of_them_every_day(group, tmp_path, monkeypatch):
    """Each thirty-first call."""
    monkeypatch.chdir(tmp_path)
    calls = [call for k, call in enumerate(wrong_calls(group)) if k % 31 == 7]
    found, raw = counted(calls)
    assert found["refused"] > 0.4 * len(calls)
    assert len(raw) <= BOUNDS[group][0], raw


def test_what_is_counted_is_told_apart():
    assert outcome(lambda: 1)[0] == "value"
    assert outcome(lambda: {}["key"])[0] == "raw"
    assert outcome(lambda: float("a"))[0] == "raw"
    assert outcome(lambda: nlctl.block(nlctl.Gain, "gain"))[0] == "refused"
    assert outcome(lambda: open("no/such/file"))[0] == "refused"  # noqa: SIM115 (not opened)


@pytest.mark.slow
@pytest.mark.parametrize("group", GROUPS)
def test_the_examples_are_valid(group, tmp_path, monkeypatch):
    """But for a few, which ask for a folder or for a loop of the paper; a third each day."""
    monkeypatch.chdir(tmp_path)
    wrong = {f.__name__ for f, example in some(GROUPS[group].items())
             if outcome(lambda f=f, e=example: f(**e()), 300)[0] == "raw"}  # fmt: skip
    assert wrong == set()
