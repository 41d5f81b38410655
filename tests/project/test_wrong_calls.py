"""Wrong calls of the public functions end in one sentence of nlctl, never in a library's error."""

import traceback
import warnings
from pathlib import Path

import pytest
from wrong_calls import GROUPS

from nlctl.errors import UsageError
from nlctl.host.checkout import SOURCES

OWN = [Path(folder) for folder in SOURCES]


def refusal(call):
    """Return the error that a call ends in, and where it was raised; warnings are errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result = call()
        except Exception as error:
            return error, traceback.extract_tb(error.__traceback__)[-1]
    return AssertionError(f"not refused: {result!r}"), None


def complaint(call):
    """Return what is wrong with how a call is refused; empty if nothing is."""
    error, where = refusal(call)
    told = str(error)
    if where is None:
        return told
    if not isinstance(error, UsageError):
        in_ours = any(Path(where.filename).is_relative_to(folder) for folder in OWN)
        if not (isinstance(error, TypeError | ValueError) and in_ours):
            return f"{type(error).__name__}: {told}"
        if "raise" not in where.line:
            return f"{type(error).__name__} by accident: {told}"
    if len(told.split()) < 4 or "\n" in told or len(told) > 400:
        return f"no sentence: {told!r}"
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("group", GROUPS)
def test_every_wrong_call_is_refused_in_a_sentence(group):
    """By an error of nlctl's that names the culprit, the rule and the value."""
    found = {name: complaint(call) for name, call in GROUPS[group].items()}
    assert {name: told for name, told in found.items() if told} == {}


def test_the_tables_are_long_and_the_check_sees_raw_errors():
    """Some 350 calls; what ends in a library's own error would be told."""
    assert sum(map(len, GROUPS.values())) > 300
    assert complaint(lambda: 1).startswith("not refused")
    assert complaint(lambda: {}["key"]).startswith("KeyError")
    assert complaint(lambda: float("a")).startswith("ValueError")
