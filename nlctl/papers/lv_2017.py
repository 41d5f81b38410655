"""Lv et al. 2017: adaptive neural control through a dead zone and through backlash.

Its examples are those of `nlctl.paper`.
"""

from ..paper import example_1, example_2

__all__ = ["example_1", "example_2"]
