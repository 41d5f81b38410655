"""Actuators: nonlinearities of (2), v = k(u, t) u + eps_u, and others that it does not describe.

Each record says whether it obeys (2), as `nlctl.analysis.lyapunov.decompose` finds it: with bounds
(k_1, k_2) of k, its ``gains``, and the least and greatest output at an input, its ``band``; or
with the reason why not, its ``no_split``.  What breaks an assumption is here to see what a
controller makes of it.  Friction is here as a force law, from velocity to force.
"""

from .backlash import Backlash
from .cascade import cascade
from .dynamic import Lag, RateLimiter, SecondOrderLag
from .friction import BoucWen, Coulomb, Dahl, LuGre, StickSlip, Stribeck
from .generalised_plays import GeneralisedPrandtlIshlinskii
from .inverses import BacklashInverse, DeadZoneInverse, PrandtlIshlinskiiInverse
from .prandtl_ishlinskii import OneSidedDeadZones, PrandtlIshlinskii, Stop
from .relay import Preisach, Relay, relay_grid
from .static import AsymmetricSaturation, DeadZone, Gain, Quantiser, Saturation

__all__ = [
    "AsymmetricSaturation",
    "Backlash",
    "BacklashInverse",
    "BoucWen",
    "Coulomb",
    "Dahl",
    "DeadZone",
    "DeadZoneInverse",
    "Gain",
    "GeneralisedPrandtlIshlinskii",
    "Lag",
    "LuGre",
    "OneSidedDeadZones",
    "PrandtlIshlinskii",
    "PrandtlIshlinskiiInverse",
    "Preisach",
    "Quantiser",
    "RateLimiter",
    "Relay",
    "Saturation",
    "SecondOrderLag",
    "StickSlip",
    "Stop",
    "Stribeck",
    "cascade",
    "relay_grid",
]
