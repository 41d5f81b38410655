"""Robustness studies: how sure, how far, what breaks it, what drives it."""

from .burst import BurstForecast
from .compare import Comparison, compare, crossed
from .confirm import Confirmation, confirm
from .contenders import contenders
from .degradation import Degradation, degradation_curve
from .design import Design, from_table, independent, row_seed, rows, seed_number
from .experiment import Experiment, Prepared, evaluate, prepare
from .failure_map import FailureMap, boundary, failure_map
from .formula import always, eventually, in_band
from .guarantee import (
    NoGuaranteeError,
    Violation,
    clopper_pearson,
    runs_needed,
    violation_probability,
)
from .largest_scale import largest_scale
from .multiplicity import holm
from .paired import differences, mcnemar, wins
from .patterns import corners, grid, latin_hypercube, one_at_a_time, sobol
from .quantity import Choice, SpaceError, Uncertain
from .radius import Radius, robustness_radius
from .resolve import diagrams, resolved
from .sensitivity import (
    censored,
    elementary_effects,
    morris,
    regional,
    saltelli,
    sobol_indices,
)
from .sequential import SequentialTest, confidence_sequence, decide, sequence_bounds
from .shrink import Shrunk, shrink
from .space import Space, arguments, nominal, scaled
from .spec import Requirement, Spec, margin, margins, unfinished_margin
from .store import StoreError
from .sweep import Sweep, load, sweep
from .tracking import tracking_metrics
from .verdict import Verdict, bound_verdict, test_verdict
from .watch import Progress, until_decided
from .worst_case import WorstCase, worst_case

__all__ = [
    "BurstForecast",
    "Choice",
    "Comparison",
    "Confirmation",
    "Degradation",
    "Design",
    "Experiment",
    "FailureMap",
    "NoGuaranteeError",
    "Prepared",
    "Progress",
    "Radius",
    "Requirement",
    "SequentialTest",
    "Shrunk",
    "Space",
    "SpaceError",
    "Spec",
    "StoreError",
    "Sweep",
    "Uncertain",
    "Verdict",
    "Violation",
    "WorstCase",
    "always",
    "arguments",
    "bound_verdict",
    "boundary",
    "censored",
    "clopper_pearson",
    "compare",
    "confidence_sequence",
    "confirm",
    "contenders",
    "corners",
    "crossed",
    "decide",
    "degradation_curve",
    "diagrams",
    "differences",
    "elementary_effects",
    "evaluate",
    "eventually",
    "failure_map",
    "from_table",
    "grid",
    "holm",
    "in_band",
    "independent",
    "largest_scale",
    "latin_hypercube",
    "load",
    "margin",
    "margins",
    "mcnemar",
    "morris",
    "nominal",
    "one_at_a_time",
    "prepare",
    "regional",
    "resolved",
    "robustness_radius",
    "row_seed",
    "rows",
    "runs_needed",
    "saltelli",
    "scaled",
    "seed_number",
    "sequence_bounds",
    "shrink",
    "sobol",
    "sobol_indices",
    "sweep",
    "test_verdict",
    "tracking_metrics",
    "unfinished_margin",
    "until_decided",
    "violation_probability",
    "wins",
    "worst_case",
]
