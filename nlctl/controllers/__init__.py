"""The adaptive neural controller and its pieces."""

from .adaptive import Zero, adaptive_neural
from .filtered_error import FilteredError, binomial_lambdas
from .known_sign import KnownSignLaw
from .nussbaum import NussbaumLaw
from .rbf import (
    AdaptiveWeights,
    GaussianBasis,
    diagonal_centres,
    grid_centres,
    latin_hypercube_centres,
)
from .remedies import DeadZoneNussbaumLaw, LeakyNussbaumLaw, MonotoneNussbaumLaw
from .robust import RobustTerm

__all__ = [
    "AdaptiveWeights",
    "DeadZoneNussbaumLaw",
    "FilteredError",
    "GaussianBasis",
    "KnownSignLaw",
    "LeakyNussbaumLaw",
    "MonotoneNussbaumLaw",
    "NussbaumLaw",
    "RobustTerm",
    "Zero",
    "adaptive_neural",
    "binomial_lambdas",
    "diagonal_centres",
    "grid_centres",
    "latin_hypercube_centres",
]
