"""What stands for an integrator of SciPy: without states, and over what rounding alone crosses."""

from collections.abc import Callable

import numpy as np


class Still:
    """What stands for an integrator where there are no states: it goes from place to place."""

    status = "running"

    def __init__(
        self, rates: object, t: float, y: np.ndarray, end: float, max_step: float, **_: object
    ) -> None:
        self.t, self.t_old, self.y, self._end, self._step = t, t, y, end, max_step

    def step(self) -> None:
        """Go to the next place."""
        self.t_old, self.t = self.t, min(self.t + self._step, self._end)
        self.status = "finished" if self.t >= self._end else "running"

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """Return the solution, which has no entries."""
        return lambda t: self.y


class Across:
    """A step by rounding alone: over a jump of the rates, or away from one."""

    status = "finished"

    def __init__(self, t: float, y: np.ndarray, rates: np.ndarray, end: float) -> None:
        self.t_old, self.t, self._begin, self._rates = t, end, y, rates
        self.y = y + (end - t) * rates

    def step(self) -> None:
        """Make no other step than this one."""

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """Return the solution, a straight line."""
        return lambda t: self._begin + (t - self.t_old) * self._rates
