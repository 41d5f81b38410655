"""The examples' loops with one keyword per question: noise, wrong sign, saturation, controller.

For study files, ``nlctl.analysis.paper.loops:example_1``: every choice may be given by a label or a
number.  What is asked of the actuator are parameters of its cascade: ``actuator.body.b_r``,
``actuator.body.c_r``, ``actuator.saturation.limit``, ``actuator.gain.k``.
"""

from typing import Any

import control as ct

from nlctl.actuators import Backlash, DeadZone, Gain, Saturation, cascade
from nlctl.blocks import Spec
from nlctl.diagrams import interconnect
from nlctl.names import check_known
from nlctl.sampling import sampled

from .controllers import compared_controllers, paper_example, sensor

_WIDE = 1e6  # a saturation beyond every |u| of a run that is worth keeping


def example_1(
    *,
    controller: Any = "paper",
    actuator: object = None,
    gain: float = 1.0,
    limit: float = _WIDE,
    noise: float | None = None,
) -> ct.InterconnectedSystem:
    """Example 1 with another controller, gain, saturation or noise."""
    body = DeadZone() if actuator is None else actuator
    return _loop("example_1", body, controller, gain, limit, noise)


def example_2(
    *,
    controller: Any = "paper",
    actuator: object = None,
    gain: float = 1.0,
    limit: float = _WIDE,
    noise: float | None = None,
) -> ct.InterconnectedSystem:
    """Example 2 with another controller, gain, saturation or noise; see `example_1`."""
    body = Backlash() if actuator is None else actuator
    return _loop("example_2", body, controller, gain, limit, noise)


def true_error(example: str = "example_1") -> ct.InterconnectedSystem:
    """An example with the output ``error``, y - yd of the plant itself."""
    # The output e is what the controller makes of its measurements: with a fault on one of them it
    # is not an error of the plant.
    return _with_error(paper_example(example)())


def on_a_computer(
    example: str = "example_1", *, controller: Any = "paper", waiting: int = 20
) -> ct.InterconnectedSystem:
    """An example whose controller is a program, every 2 ms by Euler's method, 1 ms late."""
    # What may be varied are ``sampling.dt``, ``sampling.delay``, ``sampling.jitter``, and, from 0
    # on, ``sampling.input_quantum`` and ``sampling.output_quantum``.
    make = paper_example(example)
    program = sampled(
        _controller(example, controller), 0.002, method="euler", delay=0.001, waiting=waiting,
        input_quantum=0.0, output_quantum=0.0,
    )  # fmt: skip
    return _with_error(make(controller=program))


def _with_error(loop: ct.InterconnectedSystem) -> ct.InterconnectedSystem:
    difference = ct.summing_junction(["y", "-yd"], "error", name="difference")
    return interconnect([loop, difference])


def _controller(example: str, controller: Spec) -> Any:
    """Return the controller of a label; others as they are."""
    if not isinstance(controller, str):
        return controller
    known = compared_controllers(example)
    check_known("controller", controller, known)
    return known[controller]


def _loop(
    example: str, body: object, controller: Spec, gain: float, limit: float, noise: float | None
) -> ct.InterconnectedSystem:
    stages = {"saturation": Saturation(limit=limit), "gain": Gain(k=gain), "body": body}
    return paper_example(example)(
        controller=_controller(example, controller),
        actuator=cascade(stages),
        sensor=None if noise is None else sensor(example, noise),
    )
