"""The verdict on the paper, and the claims behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..reproduction import HORIZON, TAIL, Check, Run
from . import paper_text as text
from .document import Claim


def verdict(compared: Sequence[Check]) -> str:
    """Return the report's first sentence."""
    total = len(compared)
    missed = [c for c in compared if not c.passed]
    if missed:
        worst = max(missed, key=lambda c: c.error / c.expectation.tolerance)
        return (
            f"Not reproduced: {len(missed)} of {total} figures are missed, most of all "
            f"{worst.metric.meaning} of case {worst.expectation.case} "
            f"({worst.value:.8g} instead of {worst.expectation.printed})."
        )
    return (
        f"Both examples are reproduced: all {total} figures are reached, and the same controller "
        f"follows the reference through a dead zone and through backlash over {HORIZON:g} s."
    )


def claims(runs: Mapping[str, Run], compared: Sequence[Check]) -> list[Claim]:
    """Return what the paper claims and these runs can show, with what was found."""
    found = [
        Claim(
            text=f"{text.TITLES[n]}: the output follows the reference",
            measured=f"max |e₁| = {runs[key].metrics['tail_max_e']:.5f} for t ≥ {TAIL:g} s",
            limit=_limit(key, "tail_max_e", compared),
            holds=_holds(key, "tail_max_e", compared),
            evidence=f"example-{n}",
        )
        for n, key in ((1, "1"), (2, "2"))
    ]
    found += [
        Claim(
            text=f"Example {n}'s controller, unchanged, drives {what} as well",
            measured=f"max |e₁| = {runs[key].metrics['tail_max_e']:.4f} for t ≥ {TAIL:g} s",
            limit=_limit(key, "tail_max_e", compared),
            holds=_holds(key, "tail_max_e", compared),
            evidence="exchange",
        )
        for n, key, what in ((1, "1-backlash", "backlash"), (2, "2-dead-zone", "the dead zone"))
    ]
    reached = sum(c.passed for c in compared)
    found.append(
        Claim(
            text="All figures of an independent computation are reached",
            measured=f"{reached} of {len(compared)}",
            limit=f"{len(compared)}",
            holds=reached == len(compared),
            evidence="example-1-figures",
        )
    )
    return found


def _of(key: str, metric: str, compared: Sequence[Check]) -> Check:
    return next(c for c in compared if c.expectation.case == key and c.expectation.metric == metric)


def _holds(key: str, metric: str, compared: Sequence[Check]) -> bool:
    return _of(key, metric, compared).passed


def _limit(key: str, metric: str, compared: Sequence[Check]) -> str:
    expected = _of(key, metric, compared).expectation
    return f"{expected.printed} ± {expected.tolerance:.0e}"
