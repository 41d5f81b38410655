"""Model reference adaptive control (MRAC): reference model, error, regressors, weights, laws."""

from .concurrent import ConcurrentWeights, HistoryStack
from .connected import mrac
from .constrained import ConstrainedError, ConstrainedLaw
from .l1 import FilteredLaw, StatePredictor, l1_adaptive
from .laws import DirectLaw, ModelReferenceLaw
from .model_error import ModelError
from .modified_weights import EModifiedWeights, ProjectedWeights
from .reference_model import ReferenceModel
from .regressors import AffineRegressor, LinearRegressor, WingRockRegressor

__all__ = [
    "AffineRegressor",
    "ConcurrentWeights",
    "ConstrainedError",
    "ConstrainedLaw",
    "DirectLaw",
    "EModifiedWeights",
    "FilteredLaw",
    "HistoryStack",
    "LinearRegressor",
    "ModelError",
    "ModelReferenceLaw",
    "ProjectedWeights",
    "ReferenceModel",
    "StatePredictor",
    "WingRockRegressor",
    "l1_adaptive",
    "mrac",
]
