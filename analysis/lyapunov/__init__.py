"""Lyapunov checks: constants with provenance, inequalities, certificates, the ledger."""

from .balls import Proof, Range, enclose, prove
from .box import Box, visited_box
from .certificate import Certificate, certify
from .certificate_design import Design, design
from .conservatism import Comparison, Conservatism, comparison, conservatism
from .constants import constants, disturbance, kappa
from .creep import Creep, burst_peak, creep
from .decomposition import Decomposition, DecompositionError, clipped_split, decompose
from .drift import Drift, drift, drift_margin, safe_horizon
from .examine import Examination, examine
from .inequalities import inequalities
from .integral import NussbaumIntegral, sharpest
from .ledger import Ledger, ledger
from .level_set import prove_decrease
from .lines import Line
from .nussbaum import nussbaum_property
from .observed import observed
from .parts import Parts, read_parts
from .premises import Premises, literal, premises
from .record import Constant, Constants
from .sector import Sector, sector
from .signals import Margin, Signals, signals_of
from .tighten import Tightened, tighten
from .weights import approximation_error, minimax_weights, tightest_weights

__all__ = [
    "Box",
    "Certificate",
    "Comparison",
    "Conservatism",
    "Constant",
    "Constants",
    "Creep",
    "Decomposition",
    "DecompositionError",
    "Design",
    "Drift",
    "Examination",
    "Ledger",
    "Line",
    "Margin",
    "NussbaumIntegral",
    "Parts",
    "Premises",
    "Proof",
    "Range",
    "Sector",
    "Signals",
    "Tightened",
    "approximation_error",
    "burst_peak",
    "certify",
    "clipped_split",
    "comparison",
    "conservatism",
    "constants",
    "creep",
    "decompose",
    "design",
    "disturbance",
    "drift",
    "drift_margin",
    "enclose",
    "examine",
    "inequalities",
    "kappa",
    "ledger",
    "literal",
    "minimax_weights",
    "nussbaum_property",
    "observed",
    "premises",
    "prove",
    "prove_decrease",
    "read_parts",
    "safe_horizon",
    "sector",
    "sharpest",
    "signals_of",
    "tighten",
    "tightest_weights",
    "visited_box",
]
