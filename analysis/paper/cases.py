"""The closed loops that the reproduction runs, and the numbers it reads off them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import partial
from typing import Any

from nlctl import actuators, paper
from nlctl.annotations import as_annotated
from nlctl.attributes import described_record

from ..metrics import Metric, final, highest, lowest, peak, rms

HORIZON = 20.0
TAIL = HORIZON / 2
BOUND = 0.15  # of |e₁| from TAIL on: a sixth of the reference; the paper names none

_number = partial(Metric, unit="1")
METRICS = (
    _number(
        key="tail_max_e", signal="e", meaning="max |e₁| for t ≥ 10 s", function=peak, start=TAIL
    ),
    _number(
        key="tail_rms_e", signal="e", meaning="RMS of e₁ for t ≥ 10 s", function=rms, start=TAIL
    ),
    _number(key="rms_e", signal="e", meaning="RMS of e₁", function=rms),
    _number(key="max_u", signal="u", meaning="max |u|", function=peak),
    _number(key="zeta_min", signal="zeta", meaning="min ζ", function=lowest),
    _number(key="zeta_max", signal="zeta", meaning="max ζ", function=highest),
    _number(key="zeta_end", signal="zeta", meaning="ζ(20 s)", function=final),
    _number(key="max_r", signal="r", meaning="max |r|", function=peak),
    _number(
        key="tail_max_r", signal="r", meaning="max |r| for t ≥ 10 s", function=peak, start=TAIL
    ),
    _number(key="max_delta_hat", signal="delta_hat", meaning="max δ̂", function=highest),
    _number(key="max_W", signal="W_norm", meaning="max ‖Ŵ‖", function=highest),
    _number(key="x1_end", signal="x1", meaning="x₁(20 s)", function=final),
    _number(key="x2_end", signal="x2", meaning="x₂(20 s)", function=final),
)


@as_annotated
@described_record
class Case:
    """One closed loop of the paper, or of a choice that the paper leaves open."""

    key: str
    title: str
    example: int  # 1 or 2.
    # Keyword arguments of `nlctl.paper.example_1` or `example_2`.
    arguments: Mapping[str, Any] = field(default_factory=dict)
    group: str = "choice"  # ``"published"``, ``"choice"`` or ``"exchange"``.
    rtol: float = 1e-9  # Relative tolerance of the integrator.

    @property
    def diagram(self) -> Any:
        """The diagram of this case."""
        return paper.EXAMPLES[f"example_{self.example}"](**self.arguments)

    @property
    def call(self) -> str:
        """The Python call that makes the diagram."""
        arguments = ", ".join(f"{k}={v!r}" for k, v in self.arguments.items())
        return f"nlctl.paper.example_{self.example}({arguments})"


CASES = (
    Case(key="1", title="as published, diagonal centres", example=1, group="published"),
    Case(key="1-3x9", title="centres on a 3×9 grid", example=1, arguments={"centres": "3x9"}),
    Case(key="1-9x3", title="centres on a 9×3 grid", example=1, arguments={"centres": "9x3"}),
    Case(
        key="1-integral",
        title="forcing phase ∫w dt instead of w(t) t",
        example=1,
        arguments={"phase": "integral"},
    ),
    Case(key="1-p1", title="p₁ = +0.2 instead of −0.2", example=1, arguments={"p1": 0.2}),
    Case(
        key="1-backlash",
        title="Example 2's backlash",
        example=1,
        arguments={"actuator": actuators.Backlash()},
        group="exchange",
    ),
    Case(key="2", title="as published, 3×3×3 centres", example=2, group="published"),
    Case(key="2-diagonal", title="diagonal centres", example=2, arguments={"centres": "diagonal"}),
    Case(
        key="2-lambdas",
        title="r = 2e₁ + e₂ + e₃ instead of e₁ + 2e₂ + e₃",
        example=2,
        arguments={"lambdas": (1.0, 2.0)},
    ),
    Case(key="2-v0-low", title="v(0) = −0.6", example=2, arguments={"v0": -0.6}),
    Case(key="2-v0-high", title="v(0) = 0.72", example=2, arguments={"v0": 0.72}),
    Case(
        key="2-dead-zone",
        title="Example 1's dead zone",
        example=2,
        arguments={"actuator": actuators.DeadZone()},
        group="exchange",
    ),
)
