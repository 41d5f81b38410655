"""The adaptive neural controller and its pieces, and baselines to compare it with."""

from .ablations import FixedGainLaw, ablations, replaced
from .adaptive import Zero, adaptive_neural
from .adaptive_inverse import AdaptiveDeadZoneInverse
from .dynamic_surface import DynamicSurface, dynamic_surface_control
from .extremum_seeking import ExtremumSeeking
from .filtered_error import FilteredError, binomial_lambdas
from .known_sign import KnownSignLaw
from .mrac.concurrent import ConcurrentWeights, HistoryStack
from .mrac.connected import mrac
from .mrac.constrained import ConstrainedError, ConstrainedLaw
from .mrac.l1 import FilteredLaw, StatePredictor, l1_adaptive
from .mrac.laws import DirectLaw, ModelReferenceLaw
from .mrac.model_error import ModelError
from .mrac.modified_weights import EModifiedWeights, ProjectedWeights
from .mrac.reference_model import ReferenceModel
from .mrac.regressors import AffineRegressor, LinearRegressor, WingRockRegressor
from .nussbaum import NussbaumLaw
from .performance import FunnelControl, PrescribedPerformance
from .pid import PID, PID2, standard_pid
from .rbf import (
    AdaptiveWeights,
    GaussianBasis,
    diagonal_centres,
    grid_centres,
    latin_hypercube_centres,
)
from .remedies import DeadZoneNussbaumLaw, LeakyNussbaumLaw, MonotoneNussbaumLaw
from .robust import RobustTerm
from .sliding_modes import SlidingModeLaw, SuperTwistingLaw, sliding_mode

__all__ = [
    "PID",
    "PID2",
    "AdaptiveDeadZoneInverse",
    "AdaptiveWeights",
    "AffineRegressor",
    "ConcurrentWeights",
    "ConstrainedError",
    "ConstrainedLaw",
    "DeadZoneNussbaumLaw",
    "DirectLaw",
    "DynamicSurface",
    "EModifiedWeights",
    "ExtremumSeeking",
    "FilteredError",
    "FilteredLaw",
    "FixedGainLaw",
    "FunnelControl",
    "GaussianBasis",
    "HistoryStack",
    "KnownSignLaw",
    "LeakyNussbaumLaw",
    "LinearRegressor",
    "ModelError",
    "ModelReferenceLaw",
    "MonotoneNussbaumLaw",
    "NussbaumLaw",
    "PrescribedPerformance",
    "ProjectedWeights",
    "ReferenceModel",
    "RobustTerm",
    "SlidingModeLaw",
    "StatePredictor",
    "SuperTwistingLaw",
    "WingRockRegressor",
    "Zero",
    "ablations",
    "adaptive_neural",
    "binomial_lambdas",
    "diagonal_centres",
    "dynamic_surface_control",
    "grid_centres",
    "l1_adaptive",
    "latin_hypercube_centres",
    "mrac",
    "replaced",
    "sliding_mode",
    "standard_pid",
]
