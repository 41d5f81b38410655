"""Observers: states from measured outputs, as blocks next to the plant.

`luenberger` for linear plants, `high_gain` for chains of integrators with an unknown end, and
`kalman` for any plant with noise, its Jacobians derived from the functions that it is given.
"""

from .high_gain import HighGainObserver
from .kalman import ExtendedKalmanFilter
from .linear import LuenbergerObserver, luenberger

__all__ = ["ExtendedKalmanFilter", "HighGainObserver", "LuenbergerObserver", "luenberger"]
