"""Actuators with uncertain nonlinearity, v = k(u, t) u + eps_u (2): dead zone and backlash.

Saturation does not obey (2), and a gain of the wrong sign breaks Assumption 1: both are here to
see what a controller makes of them.
"""

from .backlash import Backlash
from .cascade import cascade
from .dynamic import Lag, RateLimiter, SecondOrderLag
from .friction import BoucWen, Coulomb, Dahl, LuGre, Stribeck
from .inverses import DeadZoneInverse, PrandtlIshlinskiiInverse
from .prandtl_ishlinskii import OneSidedDeadZones, PrandtlIshlinskii, Stop
from .quantiser import Quantiser
from .relay import Preisach, Relay, relay_grid
from .static import AsymmetricSaturation, DeadZone, Gain, Saturation

__all__ = [
    "AsymmetricSaturation",
    "Backlash",
    "BoucWen",
    "Coulomb",
    "Dahl",
    "DeadZone",
    "DeadZoneInverse",
    "Gain",
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
    "Stop",
    "Stribeck",
    "cascade",
    "relay_grid",
]
