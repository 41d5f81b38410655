"""The block whose outputs are its inputs at an earlier time."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arguments import pairs
from ..errors import ParameterError, UsageError
from ..params import param, record
from ..supplied import Supplied
from ..wording import counted

_DISCRETE = (
    "in discrete time k samples late is ct.tf(1, [1] + [0] * k, dt), and nlctl.sampled has "
    "delay=..."
)
PAST = Supplied(
    why="delays its signals, and python-control does not keep the past: use "
    "nlctl.input_output_response (engine='python-control' is the reference); to linearize, put "
    "ct.ss(ct.tf(*ct.pade(delay, n))) in its place",
    continuous=f"needs continuous time: {_DISCRETE}",
    shared="past",
    discrete=_DISCRETE,
)


@record
class TransportDelay:
    """Transport delay (dead time) of signals.

        y_i(t) = u_i(t - delay - varying(t))

    A delay that varies is continuous and grows by less than 1 s per second, so that signals arrive
    in the order in which they were sent: what a run sees of it is checked before the run.

    A run knows its signals from its first time t_0 on; earlier they are `before`, or what
    `history` says.  The delay breaks algebraic loops.  It has no finite state:
    `nlctl.frequency_response` keeps it exactly, and to linearize, put `control.pade` in its place;
    a run cannot be resumed from its last state alone, and `nlctl.stepper` keeps the past.

    Parameters
    ----------
    inputs, outputs : tuple of str
        Names of the signals before and after, pairwise.
    varying : callable, optional
        ``varying(t)`` in s, 0 by default: what the delay is longer at time t.  It is called in
        Python, before the run, at 1000 places at least: a pulse between two of them is not seen.
    history : callable, optional
        ``history(t)`` for t <= t_0 instead of `before`: a number, or one for each signal.  It is
        called in Python, before the run, at 1000 places of the longest delay at least.

    Examples
    --------
    >>> wire = nlctl.block(nlctl.TransportDelay(inputs=("x",), outputs=("y",), delay=1.0), "wire")
    >>> plant = ct.ss(0, -1, 1, 0, inputs="y", outputs="x", name="plant")
    >>> loop = ct.interconnect([wire, plant], inputs=[], outputs=["x"], inplist=[])
    >>> run = nlctl.input_output_response(loop, [0, 1, 3], 0, {"plant.x[0]": 1.0})
    >>> [round(float(x), 6) for x in run.outputs[0]]  # x' = -x(t - 1), and 0 before t = 0
    [1.0, 1.0, -0.5]
    """

    inputs: tuple[str, ...] = ("u",)
    outputs: tuple[str, ...] = ("y",)
    delay: float = param(0.1, unit="s", meaning="time from input to output", above=0, symbol="tau")
    before: float = param(0.0, unit="1", meaning="signals before the run")
    varying: Callable[[float], float] | None = None
    history: Callable[[float], Any] | None = None

    feedthrough = False
    supplied = PAST

    def check(self) -> None:
        """Signals come in pairs; a history and a variation are functions."""
        pairs("TransportDelay", self.inputs, self.outputs)
        if self.varying is not None and not callable(self.varying):
            raise ParameterError(
                f"TransportDelay needs a function of time for varying, got {self.varying!r}: a "
                "constant belongs to delay"
            )
        if self.history is not None and not callable(self.history):
            raise ParameterError(
                "TransportDelay needs a function of time for history, got "
                f"{self.history!r}: a constant is called before"
            )

    def varied(self, t: float) -> float:
        """Return what the delay is longer at a time.

        Parameters
        ----------
        t : float
            Time (s).

        Returns
        -------
        float
            In s.

        Raises
        ------
        ParameterError
            If `varying` does not return a finite number.
        """
        return 0.0 if self.varying is None else float(self._known("varying", t, 1)[0])

    def earlier(self, t: float) -> np.ndarray:
        """Return the signals at a time before the run.

        Parameters
        ----------
        t : float
            Time before the run (s).

        Returns
        -------
        ndarray of shape (k,)
            One number for each signal.

        Raises
        ------
        ParameterError
            If `history` does not return a finite number, or one for each signal.
        """
        count = len(self.inputs)
        if self.history is None:
            return np.full(count, self.before)
        return np.broadcast_to(self._known("history", t, count), (count,)).astype(float)

    def _known(self, name: str, t: float, count: int) -> np.ndarray:
        """Return what a function of time of this record returns: a number, or one a signal."""
        try:
            values = np.asarray(getattr(self, name)(float(t)), dtype=float).reshape(-1)
        except Exception as error:
            raise ParameterError(
                f"TransportDelay needs a {name} that is known at t = {t:g} s, but it raises "
                f"{type(error).__name__}: {error}"
            ) from error
        if values.size not in (1, count) or not np.all(np.isfinite(values)):
            rule = "a finite number" if count == 1 else counted(count, "finite number")
            raise ParameterError(
                f"TransportDelay needs a {name} that returns {rule}, got "
                f"{', '.join(map(str, values.tolist()))} at t = {t:g} s"
            )
        return values

    @staticmethod
    def output(t: float, x: object, u: object, p: object) -> Any:
        """Not a function of the present: only a run knows it."""
        raise UsageError(
            "a TransportDelay has no output that follows from the present: "
            "nlctl.input_output_response keeps the past"
        )
