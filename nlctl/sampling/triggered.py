"""Event-triggered sampling: signals that are held until a condition of the diagram is met."""

import numpy as np

from ..equations import equation
from ..params import param, record


@record
class TriggeredHold:
    """Sample and hold at events: w keeps u until ``trigger`` falls through 0.

        w' = 0;      w+ = u,  interval+ = time since the last sample,  where trigger falls below 0

    The rule is a block of the diagram: with trigger = sigma |u| - |w - u| a control law that holds
    for the state holds for its samples, and the intervals have a positive lower bound (Tabuada,
    Event-triggered real-time scheduling of stabilizing control tasks, 2007).  The first sample is
    taken right behind the start; until then w is 0.

    ``interval`` is the time between the last two samples (s), 0 before there are two.

    Examples
    --------
    x' = x + w with w = -2 x, sampled where the error exceeds 0.3 |x|:

    >>> plant = ct.ss(1, 1, 1, 0, inputs="u", outputs="x", name="plant")
    >>> hold = nlctl.block(nlctl.TriggeredHold(n=1), "hold")
    >>> rule = ct.nlsys(
    ...     None, lambda t, x, u, params: (-2 * u[1], 0.3 * abs(u[0]) - abs(u[1] - u[0])),
    ...     inputs=["x", "w1"], outputs=["u", "trigger"], name="rule",
    ... )
    >>> loop = ct.interconnect(
    ...     [plant, hold, rule],
    ...     [["plant.u", "rule.u"], ["hold.u1", "plant.x"], ["hold.trigger", "rule.trigger"],
    ...      ["rule.x", "plant.x"], ["rule.w1", "hold.w1"]],
    ...     inplist=[], outlist=["plant.x", "hold.interval"], outputs=["x", "interval"],
    ... )
    >>> run = nlctl.input_output_response(loop, [0, 5], 0, {"plant.x[0]": 1.0})
    >>> print(len(run.events), run.outputs[1, -1].round(4), np.log(2 - 1 / 1.3).round(4))
    26 0.2076 0.2076
    """

    n: int = param(1, unit="1", meaning="number of signals", at_least=1)

    feedthrough = False
    vector = True
    inputs = property(lambda self: (*(f"u{i + 1}" for i in range(self.n)), "trigger"))
    outputs = property(lambda self: (*(f"w{i + 1}" for i in range(self.n)), "interval"))

    @property
    def states(self) -> tuple[str, ...]:
        """What is held, the last interval, the time since the last sample, and the start."""
        return (*(f"held{i + 1}" for i in range(self.n)), "last", "since", "start")

    @equation
    def update(t, x, u, p):
        """What is held stands still; from 0 on `start` falls, until the first sample makes it 1."""
        return np.concatenate([np.zeros(x.size - 2), np.ones(1), x[-1:] - 1.0])

    @equation
    def output(t, x, u, p):
        """What is held, and the last interval."""
        return x[:-2]

    @equation
    def guard(t, x, u, p):
        """The trigger, and the start."""
        return np.concatenate([u[-1:], x[-1:]])

    @equation
    def reset(t, x, u, p):
        """Take the inputs; the time since the start is not an interval."""
        interval = np.where(x[-1:] > 0.5, x[-2:-1], 0.0)
        return np.concatenate([u[:-1], interval, np.zeros(1), np.ones(1)])
