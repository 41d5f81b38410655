"""Which controller is for which plant: one record each, which the site and ``nlctl list`` read.

What can be counted or called (signals, states, parameters, the proof) is compared with the
controller itself by ``tests/blocks/test_controller_guide.py``; importing this takes no time.
"""

from nlctl.attributes import described_record
from nlctl.wording import counted


@described_record
class Costs:
    """What a controller takes with these defaults; printed, it is a line."""

    states: int  # Every state is an integrator.
    parameters: int
    # Time of a run of Example 1 with it, with PID as 1 (``python benchmarks/controllers.py``); None
    # where it does not fit that loop.
    time: float | None = None

    def __str__(self) -> str:
        time = "" if self.time is None else f"; time of a run, with PID as 1: {self.time:g}"
        counts = f"{counted(self.states, 'state')}, {counted(self.parameters, 'parameter')}"
        return counts + time


@described_record
class ControllerGuide:
    """What one controller is for."""

    name: str  # What it is called here.
    plant: str  # Class of plants that it is made for.
    measured: tuple[str, ...]  # Its inputs, for a plant of order 2 where the order is free.
    known: str  # What has to be known of the plant, actuator and reference.
    proved: str  # What is proved of the loop, and by whom.
    # Name of the kind of certificate that `nlctl.analysis.lyapunov.certify` finds for its loops;
    # empty if there is none.
    proof: str = ""
    costs: Costs
    code: str  # One line that makes it.
    instead: tuple[str, ...] = ()  # Names of `nlctl` that may replace a piece of it.


_CLASS_1 = "pure-feedback (1), any order"
_COMMAND = "linear with a matched uncertainty W^T psi, any order"
_PUBLISHED = "here nothing; its authors prove"
_STATES = ("x1", "x2")
_REFERENCE = ("yd", "yd1", "yd2")

GUIDES = (
    ControllerGuide(
        name="PID",
        plant="order 2 with a gain of known sign; one operating region",
        measured=(*_STATES, "yd", "yd1"),
        known="the sign of the gain; gains are tuned for the plant",
        proved="nothing",
        costs=Costs(states=2, parameters=6, time=1.0),
        code="nlctl.PID()",
        instead=("PID2",),
    ),
    ControllerGuide(
        name="sliding mode",
        plant=_CLASS_1,
        measured=(*_STATES, *_REFERENCE),
        known="the sign of the gain; a bound of what disturbs",
        proved="|r| is bounded for all time where K dominates",
        proof="sliding mode",
        costs=Costs(states=0, parameters=3, time=1.4),
        code="nlctl.sliding_mode()",
        instead=("SlidingModeLaw",),
    ),
    ControllerGuide(
        name="super-twisting",
        plant=_CLASS_1,
        measured=(*_STATES, *_REFERENCE),
        known="the sign of the gain; a bound of the rate of what disturbs",
        proved=f"{_PUBLISHED} r = 0 in finite time for r' = u + d without the boundary layer",
        costs=Costs(states=1, parameters=4, time=1.6),
        code="nlctl.sliding_mode(law=nlctl.controllers.SuperTwistingLaw())",
    ),
    ControllerGuide(
        name="funnel",
        plant="relative degree n with stable internal dynamics",
        measured=(*_STATES, "yd", "yd1"),
        known="the sign of the gain; a bound of the initial errors",
        proved=f"{_PUBLISHED} that e stays in the funnel; at its boundary u is NaN",
        costs=Costs(states=0, parameters=4, time=4.1),
        code="nlctl.controllers.FunnelControl()",
    ),
    ControllerGuide(
        name="prescribed performance",
        plant=_CLASS_1,
        measured=(*_STATES, "yd"),
        known="the sign of the gain; a bound of the initial errors; no derivative of the reference",
        proved=f"{_PUBLISHED} that e stays within its bound; at the bound u is NaN",
        costs=Costs(states=0, parameters=4, time=1.9),
        code="nlctl.controllers.PrescribedPerformance()",
    ),
    ControllerGuide(
        name="adaptive neural",
        plant=f"{_CLASS_1}, behind an actuator with a split (2)",
        measured=(*_STATES, *_REFERENCE),
        known="the order: neither plant, nor actuator, nor the sign of the gain",
        proved="nothing for all time: the theorem fails as printed; the ledger checks its lines",
        costs=Costs(states=29, parameters=9, time=2.1),
        code="nlctl.adaptive_neural(order=2)",
        instead=("LeakyNussbaumLaw", "DeadZoneNussbaumLaw", "MonotoneNussbaumLaw", "FixedGainLaw"),
    ),
    ControllerGuide(
        name="adaptive neural, known sign",
        plant=f"{_CLASS_1}, behind an actuator with a split (2)",
        measured=(*_STATES, *_REFERENCE),
        known="the sign of the gain, and a lower bound of it",
        proved="|r| is bounded for all time, from a set of starts",
        proof="known sign",
        costs=Costs(states=28, parameters=11, time=1.8),
        code="nlctl.adaptive_neural(order=2, law=nlctl.controllers.KnownSignLaw())",
    ),
    ControllerGuide(
        name="dynamic surface",
        plant="pure-feedback (1) whose first n - 1 equations are known",
        measured=(*_STATES, "yd", "yd1"),
        known="the sign of the gain, and about its size",
        proved=f"{_PUBLISHED} that all signals stay bounded from a compact set",
        costs=Costs(states=28, parameters=7, time=1.5),
        code="nlctl.dynamic_surface_control()",
    ),
    ControllerGuide(
        name="model reference",
        plant=_COMMAND,
        measured=(*_STATES, "yd"),
        known="the regressor psi, and the gain of the input",
        proved="|E| is bounded for all time, with weights that stay bounded",
        proof="reference model",
        costs=Costs(states=5, parameters=7, time=1.3),
        code="nlctl.mrac()",
        instead=(
            *("EModifiedWeights", "ProjectedWeights", "ConcurrentWeights", "HistoryStack"),
            "WingRockRegressor",
        ),
    ),
    ControllerGuide(
        name="model reference, direct",
        plant=_COMMAND,
        measured=(*_STATES, "yd"),
        known="the regressor psi, and the sign of the gain",
        proved="|E| is bounded for all time, with weights that stay bounded",
        proof="reference model",
        costs=Costs(states=5, parameters=6, time=1.1),
        code="nlctl.mrac(law=nlctl.controllers.DirectLaw())",
    ),
    ControllerGuide(
        name="model reference, constrained",
        plant=f"{_COMMAND}, behind a saturation of known limits",
        measured=(*_STATES, "yd"),
        known="the regressor psi, the sign of the gain, the limits",
        proved=f"{_PUBLISHED} a bounded error, from states from which the plant can be held",
        costs=Costs(states=8, parameters=8, time=1.3),
        code=(
            "nlctl.mrac(error=nlctl.controllers.ConstrainedError(), "
            "law=nlctl.controllers.ConstrainedLaw())"
        ),
    ),
    ControllerGuide(
        name="L1 adaptive",
        plant=f"{_COMMAND}, with W changing fast",
        measured=(*_STATES, "yd"),
        known="the gain of the input, and a ball that the weights lie in",
        proved=f"{_PUBLISHED} a bound of the error under an L1 condition that you check",
        costs=Costs(states=6, parameters=10, time=4.1),
        code="nlctl.l1_adaptive()",
    ),
    ControllerGuide(
        name="adaptive inverse",
        plant="known, of first order in r, behind a dead zone of unknown width",
        measured=("u_d", "r"),
        known="the plant; lower bounds of the slopes",
        proved=f"{_PUBLISHED} that r goes to 0 while the estimate is wide enough",
        costs=Costs(states=4, parameters=4),
        code="nlctl.controllers.AdaptiveDeadZoneInverse()",
    ),
    ControllerGuide(
        name="extremum seeking",
        plant="stable, with a performance y that has an extremum over a parameter",
        measured=("y",),
        known="the sign of the curvature",
        proved=f"{_PUBLISHED} that it ends near the extremum, on average and from nearby",
        costs=Costs(states=3, parameters=5),
        code="nlctl.controllers.ExtremumSeeking()",
    ),
)
"""Every controller, the simplest first."""


def rows_of(guide: ControllerGuide) -> dict[str, str]:
    """Return plant, measured, known, proved, costs and code of a controller, in words."""
    return {
        "plant": guide.plant,
        "measured": ", ".join(guide.measured),
        "known": guide.known,
        "proved": guide.proved,
        "costs": str(guide.costs),
        "code": guide.code,
    }
