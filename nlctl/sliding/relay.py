"""The relay without hysteresis, and its sliding motion."""

from typing import Any

import numpy as np

from ..equations import equation
from ..params import param, record
from ..supplied import Supplied

SLIDING = Supplied(
    why="is an ideal relay, whose output while it slides follows from the rates of the whole "
    "diagram, and python-control does not look at these: use nlctl.input_output_response(diagram, "
    "...) in machine code and nlctl.compile(diagram).linearize, or nlctl.Relay, which has "
    "hysteresis",
    continuous="slides in continuous time only: sampled it switches once a sample, as a block that "
    "returns np.sign(u) does",
    shared="output",
    rates=2,  # a and b of the rate u' = a + b v that the whole diagram gives its input
)


@equation
def kept_mode(mode):
    """1, -1 or 0: what a memory of modes stands for."""
    return np.where(mode < -0.5, -1.0, np.where(mode > 0.5, 1.0, 0.0 * mode))  # NaN stays


@equation
def rates_beside(u, p):
    """u' with an output of +height and of -height."""
    _, drift, gain = u
    return drift + gain * p.height, drift - gain * p.height


@equation
def relay_mode(u, mode, p):
    """1 or -1 on a side; 0 while it slides, that is where u' leads back from both sides."""
    above, below = rates_beside(u, p)
    kept = kept_mode(mode)
    here = np.where(u[0] == 0, kept, np.sign(u[0]))  # both lead away from u = 0: it continues
    down = np.where((above <= 0) & (below < 0), -1.0, here)
    through = np.where((above > 0) & (below >= 0), 1.0, down)
    leads_back = (above < 0) & (below > 0)
    stays = (kept == 0) & (above == 0) & (below == 0)  # neither leads away, and it is there
    crossing = np.where(leads_back | stays, 0.0, through) + 0.0 * (above + below)
    near = np.where(kept * u[0] > 0, kept, crossing)
    return np.where(np.abs(u[0]) > p.rest, np.sign(u[0]), near + 0.0 * u[0])


@equation
def parts_here(u, mode, now, p):
    """Whether it slides no longer because u' leads away from u = 0 on both sides."""
    above, below = rates_beside(u, p)
    return (kept_mode(mode) == 0) & (now != 0) & (above > 0) & (below < 0)


@record
class IdealRelay:
    """Relay without hysteresis, with Filippov's sliding motion where it would chatter.

        v = height sign(u)                 u != 0
            -(a + rate u) / b              it slides: u' = a + b v leads to u = 0 from both sides

    a and b are those of the whole diagram, by exact derivatives of its equations.  Where
    a + b height < 0 < a - b height at u = 0, no solution in the usual sense continues; Filippov's
    goes along u = 0, with the one v of [-height, height] that keeps u' = 0: what Utkin calls the
    equivalent control (the books of both were not read; of a hysteresis whose width tends to 0 it
    is the mean output).  It ends where |v| reaches the height.  Entry and end are events.

    What is left of u where the entry is located, and by rounding, decays with `rate` while it
    slides.  Beyond `rest` it slides no longer: something else has made u jump.  `rest` and
    `rest_rate` are in the units of u: where u itself is as small as these, take smaller ones.

    v may enter u' through saturations and other bends, u' = R(v) in straight pieces (np.clip,
    min, max, abs, choices that do not jump), if u' only falls or only rises with v: v is then the
    zero of R, and it slides as long as there is one.  What v does to the rates of other states is
    taken at that v, Utkin's way.

    With b = 0 and u'' = A(v) (behind a lag, relative degree two) it switches, and every passage
    through u = 0 is slower than the one before where J(height) / A(height)^2 is larger than
    J(-height) / A(-height)^2, with J = A', for a small u'.  There it slides in second order,
    u = u' = 0, as soon as |u'| < rest_rate and u'^2 < rest |A|: before, every switch is
    integrated; behind, u is off by `rest` and u' by `rest_rate` at most, until what is left has
    decayed.  With rest_rate = 0 it never does.  Other switches that accumulate end as
    chattering, with the reason.

    It runs in machine code.  `nlctl.compile` refuses it where u jumps with v, where v enters u'
    in another way, where u depends on a delayed signal, whose rate nobody knows, and where
    several such relays act on each other's u' otherwise than as a + B v.  Inputs of the diagram
    have the rates of a run, in which they are linear between its times.

    Examples
    --------
    x' = 1/2 - sign(x) from 1 comes to 0 at t = 2, and stays there with v = 1/2:

    >>> plant = ct.nlsys(
    ...     lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0], states=1, inputs=["v"],
    ...     outputs=["u"], name="plant",
    ... )
    >>> relay = nlctl.IdealRelay()
    >>> loop = nlctl.interconnect({"relay": relay, "plant": plant}, outputs=["u", "v"])
    >>> run = nlctl.input_output_response(loop, [0, 1, 2.5, 3], 0, {"plant.x[0]": 1.0})
    >>> print(run.outputs.round(6) + 0.0)
    [[1.  0.5 0.  0. ]
     [1.  1.  0.5 0.5]]
    """

    height: float = param(1.0, unit="1", meaning="output |v| next to u = 0", above=0)
    rest: float = param(1e-6, unit="1", meaning="input up to which it may slide", above=0)
    rate: float = param(1.0, unit="1/s", meaning="rate at which u decays in sliding", at_least=0)
    rest_rate: float = param(
        1e-3, unit="1/s", meaning="|u'| up to which it may slide in second order", at_least=0
    )

    inputs = ("u",)
    outputs = ("v",)
    states = ("mode",)
    memory = ("mode",)
    feedthrough = False
    supplied = SLIDING
    no_split = "its output jumps at u = 0: |v| = height for all u, so |v| <= k u + eps has no k"

    @staticmethod
    @equation
    def update(t: float, x: object, u: object, p: object) -> Any:
        """The mode changes at events only."""
        return (0.0,)

    @staticmethod
    @equation
    def output(t: float, x: Any, u: Any, p: Any) -> Any:
        """Next to u = 0 the side, with its height; on it what keeps u' = 0."""
        # A mode beyond 1 counts unchanged: it jumps, and nothing pushes it.
        mode = x[0]
        _, drift, gain = u
        keeping = np.where(gain == 0, 0.0, -(drift + p.rate * u[0]) / gain)
        beside = p.height * kept_mode(mode) * np.maximum(1.0, np.abs(mode))
        return (np.where(kept_mode(mode) == 0, keeping, beside),)

    @staticmethod
    @equation
    def commit(t: float, x: Any, u: object, p: object) -> Any:
        """The mode."""
        return (relay_mode(u, x[0], p),)

    @staticmethod
    @equation
    def switching(t: float, x: Any, u: Any, p: Any) -> Any:
        """Where u is 0; while it slides, where it jumps away and where one rate leads away."""
        mode = x[0]
        above, below = rates_beside(u, p)
        slides = kept_mode(mode) == 0
        beyond = np.where(slides, p.rest - np.abs(u[0]), u[0])
        return beyond, np.where(slides, above, 1.0), np.where(slides, below, 1.0)


@record
class RelayOfCondition(IdealRelay):
    """Ideal relay that knows when it has last slid to where both sides began to lead away (s)."""

    states = memory = ("mode", "parted")

    @staticmethod
    @equation
    def update(t: float, x: object, u: object, p: object) -> Any:
        """Both change at events only."""
        return 0.0, 0.0

    @staticmethod
    @equation
    def commit(t: float, x: Any, u: object, p: object) -> Any:
        """The mode, and the time if it leaves u = 0 where several solutions do."""
        mode, parted = x
        now = relay_mode(u, mode, p)
        return now, np.where(parts_here(u, mode, now, p), t, parted)
