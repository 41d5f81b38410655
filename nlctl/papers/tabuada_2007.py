"""Tabuada 2007: event-triggered sampling of a linear feedback (doi 10.1109/TAC.2007.904277).

The numbers are those that readers of the article quote: see ``nlctl report tabuada_2007``.
"""

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..blocks import block
from ..diagrams import interconnect
from ..equations import equation
from ..params import param, record
from ..sampling.triggered import TriggeredHold

__all__ = ["INITIAL_STATE", "RelativeThreshold", "example_1", "least_interval"]


@record
class RelativeThreshold:
    """Feedback of held samples w of the state, and the rule that takes the next one.

        u = K w,   trigger = sigma |x| - |w - x|

    `nlctl.TriggeredHold` samples where the trigger falls through 0.

    Examples
    --------
    The error is 0.1 where 0.03 |x| is allowed: a sample is due.

    >>> rule = nlctl.block(nlctl.papers.tabuada_2007.RelativeThreshold(), "rule")
    >>> print(rule.output(0, [], [1.0, 0.0, 1.1, 0.0]).round(3))
    [ 1.1  -0.07]
    """

    K: tuple[float, ...] = param((1.0, -4.0), unit="1", meaning="feedback gains")
    sigma: float = param(0.03, unit="1", meaning="error that is allowed, of |x|", above=0)

    outputs = ("u", "trigger")
    vector = True

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names x1, ..., xn, w1, ..., wn."""
        numbers = range(1, len(self.K) + 1)
        return (*(f"x{i}" for i in numbers), *(f"w{i}" for i in numbers))

    @equation
    def output(t, x, u, p):
        """The control input, and how far the error is from what is allowed."""
        n = p.K.size
        state, held = u[:n], u[n:]
        error, size = np.sum((held - state) ** 2), np.sum(state * state)
        return np.sum(p.K * held), p.sigma * np.sqrt(size) - np.sqrt(error)


@as_annotated
def example_1(*, sigma: float = 0.03, name: str = "example_1") -> ct.InterconnectedSystem:
    """Linear example: an unstable plant of order 2 whose state is sampled at events.

        x' = [0 1; -2 3] x + [0; 1] u,   u = [1 -4] w

    It starts from (0.5, 0.5).  Its theorem keeps the decay of V = x^T [1 1/4; 1/4 1] x for
    errors up to 0.05 |x|; a sample is taken earlier, at `sigma`.

    Parameters
    ----------
    sigma : float, optional
        Error |w - x| that is allowed, as a part of |x|.
    name : str, optional
        Name of the diagram.

    Returns
    -------
    control.InterconnectedSystem
        Its outputs are x1, x2, the samples w1, w2, u, the trigger and the last interval (s).

    Raises
    ------
    ParameterError
        If sigma is not positive.

    Examples
    --------
    >>> loop = nlctl.papers.tabuada_2007.example_1()
    >>> run = nlctl.input_output_response(loop, [0, 1], 0, nlctl.papers.tabuada_2007.INITIAL_STATE)
    >>> print(run.events["time"].iloc[1:].diff().min() > 0.005)
    True
    """
    plant = ct.ss(
        [[0, 1], [-2, 3]], [[0], [1]], np.eye(2), 0, inputs="u", outputs=["x1", "x2"], name="plant"
    )  # fmt: skip
    names = ["x1", "x2", "trigger"]
    parts = [
        plant,
        block(TriggeredHold(n=2), "hold", inputs=names),
        block(RelativeThreshold(sigma=sigma), "rule"),
    ]
    outputs = ["x1", "x2", "w1", "w2", "u", "trigger", "interval"]
    return interconnect(parts, outputs=outputs, name=name)


INITIAL_STATE = {"plant.x[0]": 0.5, "plant.x[1]": 0.5}
"""Where a program of a reader starts; the article's own start could not be read."""


@as_annotated
def least_interval(a: float, b: float, sigma: float) -> float:
    """Return how long y' = (1 + y) (a + b y) takes from 0 to sigma (s).

    For x' = (A + B K) x + B K e with a = |A + B K| and b = |B K| the ratio y = |e| / |x| grows no
    faster: no interval between samples is shorter.

    Parameters
    ----------
    a, b : float
        Norms of A + B K and of B K, positive (1/s).
    sigma : float
        Where a sample is taken.

    Returns
    -------
    float
        Lower bound of the intervals between samples (s).

    Examples
    --------
    >>> round(nlctl.papers.tabuada_2007.least_interval(1.0, 1.0, 1.0), 12)  # y' = (1 + y)^2
    0.5
    """
    if a == b:
        return float(sigma / (1 + sigma) / a)
    return float((np.log1p(sigma) - np.log1p(b * sigma / a)) / (a - b))
