"""Where in a program with derivatives everything lies."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class StatePlaces:
    """States of a program with derivatives, one group behind the other."""

    states: int  # of the diagram; their derivatives follow, those by one quantity together
    by: int  # number of quantities
    branches: int = 0  # number of sides of jumps that are kept

    def derivative(self, j: int) -> int:
        """Return where the derivatives by quantity `j` begin."""
        return self.states * (1 + j)

    @property
    def kept(self) -> int:
        """Where the sides begin that are kept."""
        return self.states * (1 + self.by)

    @property
    def together(self) -> int:
        """When two conditions were first met at one instant, by different derivatives."""
        return self.kept + self.branches

    @property
    def grazing(self) -> int:
        """When a condition was first met at a rate of 0."""
        return self.together + 1

    @property
    def jumped(self) -> int:
        """When something first jumped at a time that moves."""
        return self.together + 2

    @property
    def last(self) -> int:
        """When a block last jumped, at a guard or a clock."""
        return self.together + 3

    @property
    def at_reset(self) -> int:
        """When a guard and a condition were first met at one instant."""
        return self.together + 4

    @property
    def size(self) -> int:
        """Number of all states."""
        return self.together + 5
