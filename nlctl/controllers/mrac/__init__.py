"""Model reference adaptive control (MRAC): reference model, error, regressors, weights, laws."""

from .concurrent import ConcurrentWeights, HistoryStack
from .connected import mrac
from .constrained import ConstrainedError, ConstrainedLaw
from .laws import DirectLaw, ModelReferenceLaw
from .model_error import ModelError
from .modified_weights import EModifiedWeights, ProjectedWeights
from .reference_model import ReferenceModel
from .regressors import LinearRegressor, WingRockRegressor

__all__ = [
    "ConcurrentWeights",
    "ConstrainedError",
    "ConstrainedLaw",
    "DirectLaw",
    "EModifiedWeights",
    "HistoryStack",
    "LinearRegressor",
    "ModelError",
    "ModelReferenceLaw",
    "ProjectedWeights",
    "ReferenceModel",
    "WingRockRegressor",
    "mrac",
]
