"""Shares of the variance of a response."""

from collections.abc import Iterator

from pydantic import Field

from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, captioned
from ...robustness import Design, Space, saltelli, sobol_indices
from .. import page as text
from ..file.schema import Asked, Confidence, Whole
from ..kind import Ground, Kind, finding_of
from ..page import column_in_words, result_table
from ..result import Finding, Result
from .context import response

SOBOL_CAPTION = (
    "Shares of the variance of '{of}' with bootstrap intervals, confidence {confidence:g} % each. "
    "S₁: a quantity by itself; S_T: with all its interactions."
)
SALTELLI = (
    "A. Saltelli, P. Annoni, I. Azzini, F. Campolongo, M. Ratto, S. Tarantola: Variance based "
    "sensitivity analysis of model output. Comput. Phys. Commun. 181 (2010) 259–270. "
    "doi 10.1016/j.cpc.2009.09.018."
)
SOBOL_2001 = (
    "I. Sobol': Global sensitivity indices for nonlinear mathematical models and their Monte Carlo "
    "estimates. Math. Comput. Simul. 55 (2001) 271–280. doi 10.1016/S0378-4754(00)00270-6."
)


class Sobol(Asked):
    """Shares of the variance of a response, with bootstrap intervals."""

    size: Whole = Field(ge=2, description="A power of 2; it takes size (quantities + 2) rows.")
    confidence: Confidence = 0.95
    of: str = Field("spec", description="Column: a margin, or a metric that every row has.")


def _design(asked: Sobol, space: Space, seed: int) -> Design:
    return saltelli(space, asked.size, seed)


def _run(asked: Sobol, ground: Ground) -> Finding | None:
    design = _design(asked, ground.prepared.experiment.space, ground.seed)
    done = ground.run_design(design)
    if not done.complete:
        return None
    values, failed, numbers = response(asked.of, ground, done)
    table = sobol_indices(design, values, asked.confidence)
    largest = table.nlargest(3, "ST")["ST"].to_dict()
    shares = ", ".join(f"{name} ({share:.0%})" for name, share in largest.items())
    return finding_of(
        asked,
        f"Largest shares of the variance of '{asked.of}', interactions included: {shares} "
        f"({counted(done.done, 'run')}; intervals by bootstrap with confidence "
        f"{100 * asked.confidence:g} % each).{failed}",
        runs=done.done,
        numbers={"of": asked.of, "confidence": asked.confidence, **numbers},
        tables={"indices": table},
    )


def _items(finding: Finding, result: Result, asked: Sobol, key: str) -> Iterator[Item]:
    """Yield the shares of the variance."""
    table = finding.tables["indices"]
    caption = SOBOL_CAPTION.format(
        of=finding.numbers["of"], confidence=100 * finding.numbers["confidence"]
    )
    yield captioned(
        f"{key}-shares", caption, f"S_T: {column_in_words(table['ST'])}.", figures.shares(table)
    )
    columns = {"S1": "S₁", "S1_low": "from", "S1_high": "to"}
    columns |= {"ST": "S_T", "ST_low": "from", "ST_high": "to"}
    ordered = table.sort_values("ST", ascending=False, kind="stable")
    yield result_table(ordered, f"{text.SAME}.", columns)


SOBOL = Kind(
    name="sobol",
    schema=Sobol,
    run=_run,
    title="Sensitivity: shares of the variance",
    answers="shares of the variance, with intervals",
    method=(
        "Shares of the variance are estimated from two Sobol' samples and their mixtures (Sobol' "
        "2001; Saltelli et al. 2010)."
    ),
    sources=(SOBOL_2001, SALTELLI),
    columns=("of",),
    design=_design,
    largest=lambda asked, quantities: asked.size * (quantities + 2),
    items=_items,
)
