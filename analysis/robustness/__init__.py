"""Robustness studies: how sure, how far, what breaks it, what drives it."""

from ..lyapunov.nussbaum.forecast import BurstForecast
from ..metrics import tracking_metrics
from .runs.experiment import Experiment, Prepared, evaluate, prepare
from .runs.progress import Progress, until_decided
from .runs.store import StoreError
from .runs.sweep import Sweep, load, sweep
from .search.confirmation import Confirmation, confirm
from .search.degradation import Degradation, degradation_curve
from .search.failure_map import FailureMap, boundary, failure_map
from .search.first_order import FirstOrder, first_order
from .search.radius import Radius, largest_scale, robustness_radius
from .search.shrink import Shrunk, shrink
from .search.worst_case import WorstCase, worst_case
from .statistics.comparison import Comparison, compare, crossed
from .statistics.guarantee import (
    NoGuaranteeError,
    Violation,
    clopper_pearson,
    runs_needed,
    violation_probability,
)
from .statistics.paired import differences, holm, mcnemar, wins
from .statistics.sensitivity import (
    censored,
    elementary_effects,
    morris,
    regional,
    saltelli,
    sobol_indices,
)
from .statistics.sequential import (
    SequentialTest,
    Verdict,
    bound_verdict,
    confidence_sequence,
    decide,
    sequence_bounds,
    test_verdict,
)
from .stl.formula import always, eventually, in_band
from .stl.spec import Requirement, Spec, margin, margins, unfinished_margin
from .stl.text import parse_formula
from .uncertainty.binding import diagrams, resolved
from .uncertainty.design import (
    Design,
    from_table,
    independent,
    latin_hypercube,
    row_seed,
    rows,
    seed_number,
    sobol,
)
from .uncertainty.lattice import corners, grid, one_at_a_time
from .uncertainty.space import Choice, Space, SpaceError, Uncertain, arguments, nominal, scaled

__all__ = [
    "BurstForecast",
    "Choice",
    "Comparison",
    "Confirmation",
    "Degradation",
    "Design",
    "Experiment",
    "FailureMap",
    "FirstOrder",
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
    "first_order",
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
    "parse_formula",
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
