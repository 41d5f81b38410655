"""The bound of an error that is given in advance, as a function of time."""

from __future__ import annotations

import numpy as np

from ...equations import equation


@equation
def performance_bound(t, rho_0, rho_inf, decay):
    """Performance function rho(t) = (rho_0 - rho_inf) exp(-decay t) + rho_inf."""
    return (rho_0 - rho_inf) * np.exp(-decay * t) + rho_inf
