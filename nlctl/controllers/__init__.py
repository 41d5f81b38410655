"""The adaptive neural controller and its pieces."""

from .adaptive import Zero, adaptive_neural
from .filtered_error import FilteredError, binomial_lambdas
from .nussbaum import NussbaumLaw
from .rbf import (
    AdaptiveWeights,
    GaussianBasis,
    diagonal_centres,
    grid_centres,
    latin_hypercube_centres,
)
from .robust import RobustTerm

__all__ = [
    "AdaptiveWeights",
    "FilteredError",
    "GaussianBasis",
    "NussbaumLaw",
    "RobustTerm",
    "Zero",
    "adaptive_neural",
    "binomial_lambdas",
    "diagonal_centres",
    "grid_centres",
    "latin_hypercube_centres",
]
