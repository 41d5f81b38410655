"""One analysis of a study -> what it has found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from analysis.robustness import (
    Design,
    bound_verdict,
    decide,
    elementary_effects,
    regional,
    sobol_indices,
    test_verdict,
    violation_probability,
)
from analysis.robustness.runs.sweep import Sweep
from analysis.robustness.statistics.sensitivity import censored
from nlctl.errors import ParameterError, UsageError
from nlctl.native import Status

from ..build import own_design
from ..result import Finding
from .analyses import Morris, Probability, Regional, Sequential, Sobol
from .comparison import comparison
from .context import Ground, column, made, statement_numbers
from .searches import degradation, failures, lowest_margin, radius

__all__ = ["answer", "unanswered"]


def answer(key: str, asked: Any, ground: Ground) -> Finding | None:
    """Run one analysis.

    Returns
    -------
    Finding
        None if its rows are incomplete.

    Raises
    ------
    UsageError
        If the rows do not admit the analysis, such as a regional one where all rows pass.
    KeyboardInterrupt
        If Ctrl-C ended a search.
    """
    found = KINDS[asked.kind](asked, ground)
    if found is None:
        return None
    return _headed(key, asked, found)


def unanswered(key: str, asked: Any, error: UsageError, runs: int = 0) -> Finding:
    """Return what stands in the place of an analysis that its `runs` or the loop do not admit."""
    found = made(
        asked,
        f"Not answered: {error}.",
        claim="the analysis can be made",
        answer="refuted",
        runs=runs,
        is_answered=False,
    )
    return _headed(key, asked, found)


def _headed(key: str, asked: Any, found: Finding) -> Finding:
    return replace(found, key=key, title=asked.title or key.replace("-", " ").capitalize())


def _probability(asked: Probability, ground: Ground) -> Finding:
    design, margins = ground.main
    found = violation_probability(design, margins, asked.confidence, asked.side)
    claimed: dict[str, Any] = {}
    if asked.limit is not None:
        claimed["claim"] = f"a violation has at most probability {asked.limit:g}"
        claimed |= vars(bound_verdict(found, asked.limit))
    return made(
        asked,
        str(found),
        **claimed,
        runs=found.runs,
        numbers=statement_numbers(found),
    )


def _sequential(asked: Sequential, ground: Ground) -> Finding:
    design, margins = ground.main
    test = decide(design, margins, asked.limit, asked.confidence)
    return made(
        asked,
        str(test),
        claim=f"the probability of a violation is below {asked.limit:g}",
        **vars(test_verdict(test)),
        runs=test.statement.runs,
        numbers={"decision": test.decision, **statement_numbers(test.statement)},
    )


def _morris(asked: Morris, ground: Ground) -> Finding | None:
    design, done = _own_rows(asked, ground)
    if not done.complete:
        return None
    values, failed, numbers = _response(asked.of, ground, done)
    table = elementary_effects(design, values)
    order = ", ".join(table.nlargest(3, "mu_star").index)
    return made(
        asked,
        f"Largest mean effects on '{asked.of}': {order} ({done.done} runs of a Morris design, "
        f"which screens and proves nothing).{failed}",
        runs=done.done,
        numbers={"of": asked.of, "trajectories": asked.trajectories, **numbers},
        tables={"effects": table},
    )


def _sobol(asked: Sobol, ground: Ground) -> Finding | None:
    design, done = _own_rows(asked, ground)
    if not done.complete:
        return None
    values, failed, numbers = _response(asked.of, ground, done)
    table = sobol_indices(design, values, asked.confidence)
    largest = table.nlargest(3, "ST")["ST"].to_dict()
    told = ", ".join(f"{name} ({share:.0%})" for name, share in largest.items())
    return made(
        asked,
        f"Largest shares of the variance of '{asked.of}', interactions included: {told} "
        f"({done.done} runs; intervals by bootstrap with confidence {100 * asked.confidence:g} % "
        f"each).{failed}",
        runs=done.done,
        numbers={"of": asked.of, "confidence": asked.confidence, **numbers},
        tables={"indices": table},
    )


def _own_rows(asked: Any, ground: Ground) -> tuple[Design, Sweep]:
    """Run the analysis' own design."""
    design = own_design(asked, ground.prepared.experiment.space, ground.seed)
    assert design is not None
    return design, ground.run_design(design)


def _response(of: str, ground: Ground, done: Sweep) -> tuple[np.ndarray, str, dict[str, Any]]:
    """Return the column that a sensitivity is of, and how failed rows count: text and numbers.

    Raises
    ------
    ParameterError
        If it is a metric that some rows do not have, or no row reached its end.
    """
    values = column(done, of)
    if of in ("spec", *(r.key for r in ground.prepared.experiment.spec.requirements)):
        values, failed, least = censored(values)
        if not failed:
            return values, "", {}
        text = f" {failed} of them did not reach their end: each counts as a margin of {least:.4g}"
        text += ", no better than any of the others."
        return values, text, {"failed": failed, "counted_as": least}
    lacking = int(np.count_nonzero(~np.isfinite(values)))
    if lacking:
        failed = int(np.count_nonzero(column(done, "status") != Status.OK.name))
        why = "did not reach their end and have" if failed else "have"
        raise ParameterError(
            f"{failed or lacking} of {done.done} rows {why} no finite '{of}': take a margin, such "
            'as of = "spec", which every row has, or a space without such rows'
        )
    return values, "", {}


def _regional(asked: Regional, ground: Ground) -> Finding:
    design, margins = ground.main
    passed = int(np.count_nonzero(margins > 0))
    if passed in (0, margins.size):
        which = "passes" if passed else "fails"
        sentence = f"Every one of {margins.size} rows {which}: nothing sets failures apart."
        return made(asked, sentence, runs=margins.size)
    table = regional(design, margins)
    largest = table.nlargest(3, "statistic")["statistic"].to_dict()
    told = ", ".join(f"{name} ({value:.2g})" for name, value in largest.items())
    return made(
        asked,
        f"What sets {margins.size - passed} failing rows most apart from {passed} passing ones "
        f"(distance of the two distributions, 0 to 1): {told}.",
        runs=margins.size,
        tables={"differences": table},
    )


KINDS: dict[str, Callable[..., Finding | None]] = {
    "probability": _probability,
    "sequential": _sequential,
    "morris": _morris,
    "sobol": _sobol,
    "regional": _regional,
    "worst case": lowest_margin,
    "degradation": degradation,
    "radius": radius,
    "failure map": failures,
    "compare": comparison,
}
