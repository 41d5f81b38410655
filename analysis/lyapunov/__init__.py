"""Lyapunov checks: constants with provenance, inequalities, certificates, the ledger."""

from ..intervals.box import Box, visited_box
from ..intervals.branch_and_bound import Proof, Range, enclose, prove
from ..intervals.level_set import prove_decrease
from .attraction.barrier import Barrier, barrier
from .attraction.reachable import ReachableSet, reachable_set
from .attraction.region import AttractionRegion, region_of_attraction
from .bounds.clipped import clipped_split
from .bounds.decomposition import Decomposition, DecompositionError, decompose
from .bounds.sector import Sector, sector
from .bounds.starts import Starts
from .bounds.weights import approximation_error, minimax_weights, tightest_weights
from .certificate.certify import certify
from .certificate.gains import GainDesign, design
from .certificate.known_sign import KnownSignCertificate
from .certificate.sliding_mode import SlidingModeCertificate
from .conservatism import Conservatism, DirectBound, comparison, conservatism
from .constants import Constants, Premises, constants, disturbance, kappa, literal, premises
from .examination import Examination, examine
from .inequalities import inequalities
from .ledger import Ledger, ledger
from .lines import Line
from .loop.instrumented import NussbaumIntegral, observed, sharpest
from .loop.roles import Parts, read_parts
from .loop.signals import Margin, Signals, signals_of
from .model_reference.model_certificate import ModelReferenceCertificate
from .nussbaum.aftermath import Aftermath, aftermath
from .nussbaum.energy import Drift, drift, drift_margin, safe_horizon
from .nussbaum.property import nussbaum_property
from .nussbaum.slow_drift import SlowDrift, burst_peak, slow_drift
from .proofs.result import Certificate, Constant
from .tighten import Tightened, tighten

__all__ = [
    "Aftermath",
    "AttractionRegion",
    "Barrier",
    "Box",
    "Certificate",
    "Conservatism",
    "Constant",
    "Constants",
    "Decomposition",
    "DecompositionError",
    "DirectBound",
    "Drift",
    "Examination",
    "GainDesign",
    "KnownSignCertificate",
    "Ledger",
    "Line",
    "Margin",
    "ModelReferenceCertificate",
    "NussbaumIntegral",
    "Parts",
    "Premises",
    "Proof",
    "Range",
    "ReachableSet",
    "Sector",
    "Signals",
    "SlidingModeCertificate",
    "SlowDrift",
    "Starts",
    "Tightened",
    "aftermath",
    "approximation_error",
    "barrier",
    "burst_peak",
    "certify",
    "clipped_split",
    "comparison",
    "conservatism",
    "constants",
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
    "reachable_set",
    "read_parts",
    "region_of_attraction",
    "safe_horizon",
    "sector",
    "sharpest",
    "signals_of",
    "slow_drift",
    "tighten",
    "tightest_weights",
    "visited_box",
]
