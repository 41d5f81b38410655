"""FMUs of others as blocks: Model Exchange with its events, Co-Simulation as a sampled block."""

from .imported import FMU

__all__ = ["FMU"]
