"""Robustness studies: how sure, how far, what breaks it, what drives it."""

from .design import Design, from_table, independent, row_seed, rows, seed_number
from .experiment import Experiment, Prepared, evaluate, prepare
from .formula import always, eventually, in_band
from .guarantee import (
    NoGuaranteeError,
    Violation,
    clopper_pearson,
    runs_needed,
    violation_probability,
)
from .multiplicity import holm
from .paired import differences, mcnemar, wins
from .patterns import corners, grid, latin_hypercube, one_at_a_time, sobol
from .quantity import Choice, SpaceError, Uncertain
from .resolve import diagrams, resolved
from .sensitivity import elementary_effects, morris, regional, saltelli, sobol_indices
from .sequential import SequentialTest, confidence_sequence, decide, sequence_bounds
from .space import Space, arguments, nominal, scaled
from .spec import Requirement, Spec, margin, margins, unfinished_margin
from .tracking import tracking_metrics

__all__ = [
    "Choice",
    "Design",
    "Experiment",
    "NoGuaranteeError",
    "Prepared",
    "Requirement",
    "SequentialTest",
    "Space",
    "SpaceError",
    "Spec",
    "Uncertain",
    "Violation",
    "always",
    "arguments",
    "clopper_pearson",
    "confidence_sequence",
    "corners",
    "decide",
    "diagrams",
    "differences",
    "elementary_effects",
    "evaluate",
    "eventually",
    "from_table",
    "grid",
    "holm",
    "in_band",
    "independent",
    "latin_hypercube",
    "margin",
    "margins",
    "mcnemar",
    "morris",
    "nominal",
    "one_at_a_time",
    "prepare",
    "regional",
    "resolved",
    "row_seed",
    "rows",
    "runs_needed",
    "saltelli",
    "scaled",
    "seed_number",
    "sequence_bounds",
    "sobol",
    "sobol_indices",
    "tracking_metrics",
    "unfinished_margin",
    "violation_probability",
    "wins",
]
