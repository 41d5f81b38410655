"""The two examples of Lv et al. 2017 (doi 10.1007/978-3-319-70136-3_22) as diagrams.

Every choice that the paper leaves open is an argument; the defaults are the readings that its
other statements support.
"""

from collections.abc import Callable
from typing import Any, Literal

import control as ct

from .actuators import Backlash, DeadZone
from .annotations import as_annotated
from .blocks import Spec
from .controllers import (
    AdaptiveWeights,
    FilteredError,
    GaussianBasis,
    NussbaumLaw,
    RobustTerm,
    adaptive_neural,
    diagonal_centres,
    grid_centres,
)
from .diagrams import as_system, interconnect
from .errors import ParameterError
from .names import unknown
from .plants import ForcedDuffing, Genesio, coordinate_names
from .references import SumOfSines
from .wording import counted

__all__ = ["EXAMPLES", "example_1", "example_2", "named_example", "paper_centres"]

_INTERNAL = ("r", "zeta", "delta_hat", "W_norm")  # a controller of another kind may lack these


@as_annotated
def paper_centres(layout: object, order: int) -> Any:
    """Return the centres that a layout name stands for, on [-10, 10]^n.

    Examples
    --------
    >>> len(nlctl.paper.paper_centres("3x3x3", 3)), nlctl.paper.paper_centres("diagonal", 2)[0]
    (27, (-10.0, -10.0))
    """
    if not isinstance(layout, str):
        return layout
    if layout == "diagonal":
        return diagonal_centres(27, order)
    counts = layout.split("x")
    if all(c.isdigit() and int(c) > 0 for c in counts) and 1 <= len(counts) <= order:
        return grid_centres([int(c) for c in counts])
    raise ParameterError(
        f"centres must be 'diagonal', a grid such as '{'x'.join(['3'] * order)}' with at most "
        f"{order} factors, or an array of shape (l, {order}); got {layout!r}"
    )


@as_annotated
def example_1(
    *,
    plant: Any = None,
    actuator: Any = None,
    controller: Any = None,
    reference: Any = None,
    sensor: object = None,
    centres: object = None,
    p1: float | None = None,
    phase: Literal["product", "integral"] | None = None,
    name: str = "example_1",
) -> ct.InterconnectedSystem:
    """Example 1: forced oscillator with a dead zone, n = 2.

    Examples
    --------
    >>> loop = nlctl.paper.example_1()
    >>> start = nlctl.initial_state(loop)
    >>> print(len(start), loop.output_labels[:4])
    31 ['y', 'yd', 'e', 'r']
    """
    _exclusive("plant", plant, p1=p1, phase=phase)
    _exclusive("controller", controller, centres=centres)
    if phase not in (None, "product", "integral"):
        raise unknown("phase", str(phase), ("product", "integral"))
    if plant is None:
        plant = ForcedDuffing(p1=-0.2 if p1 is None else p1, integrate_w=phase == "integral")
    if controller is None:
        basis = GaussianBasis(centres=paper_centres("diagonal" if centres is None else centres, 2))
        controller = adaptive_neural(2, basis=basis)
    actuator = DeadZone() if actuator is None else actuator
    reference = SumOfSines(order=2) if reference is None else reference
    return _closed_loop(2, plant, actuator, controller, reference, sensor, name)


@as_annotated
def example_2(
    *,
    plant: Any = None,
    actuator: Any = None,
    controller: Any = None,
    reference: Any = None,
    sensor: object = None,
    centres: object = None,
    lambdas: tuple[float, float] | None = None,
    v0: float | None = None,
    name: str = "example_2",
) -> ct.InterconnectedSystem:
    """Example 2: Genesio system with backlash, n = 3.

    Examples
    --------
    Another actuator in the paper's loop:

    >>> loop = nlctl.paper.example_2(actuator=nlctl.DeadZone())
    >>> float(nlctl.parameters(loop)["value"]["actuator.b_r"])
    0.5
    """
    _exclusive("actuator", actuator, v0=v0)
    _exclusive("controller", controller, centres=centres, lambdas=lambdas)
    if controller is None:
        basis = GaussianBasis(centres=paper_centres("3x3x3" if centres is None else centres, 3))
        controller = adaptive_neural(
            3,
            filtered_error=FilteredError(lambdas=(2.0, 1.0) if lambdas is None else lambdas),
            basis=basis,
            weights=AdaptiveWeights(nodes=len(basis.centres), sigma_1=0.3),
            robust=RobustTerm(gamma=1.2, sigma_2=0.3, tau=0.5),
            law=NussbaumLaw(beta=5.0),
        )
    if actuator is None:
        actuator = Backlash(v0=0.0 if v0 is None else v0)
    plant = Genesio() if plant is None else plant
    reference = SumOfSines(order=3) if reference is None else reference
    return _closed_loop(3, plant, actuator, controller, reference, sensor, name)


EXAMPLES = {make.__name__: make for make in (example_1, example_2)}
"""The examples by name, which is also that of their diagrams."""


@as_annotated
def named_example(name: str) -> Callable[..., ct.InterconnectedSystem]:
    """Return the example that the command line and study files call ``"example-1"``.

    Examples
    --------
    >>> nlctl.paper.named_example("example-1") is nlctl.paper.example_1
    True
    """
    known = {key.replace("_", "-"): make for key, make in EXAMPLES.items()}
    if name not in known:
        raise unknown("example", name, known)
    return known[name]


def _exclusive(block: str, given: object, **choices: object) -> None:
    """Refuse a choice that a replaced block would silently ignore."""
    ignored = [name for name, value in choices.items() if value is not None]
    if given is not None and ignored:
        raise ParameterError(
            f"{' and '.join(ignored)} would be ignored, since {block} is given: "
            f"set it in the {block} instead"
        )


def _closed_loop(
    order: int,
    plant: Spec,
    actuator: Spec,
    controller: Spec,
    reference: Spec,
    sensor: object,
    name: str,
) -> ct.InterconnectedSystem:
    blocks = {
        "reference": as_system(reference, "reference"),
        "plant": as_system(plant, "plant"),
        "controller": as_system(controller, "controller"),
        "actuator": as_system(actuator, "actuator"),
    }
    delivered = len([s for s in blocks["reference"].output_labels if s.startswith("yd")])
    if delivered <= order:
        raise ParameterError(
            f"the reference has {counted(delivered - 1, 'derivative')}, a plant of order {order} "
            f"needs {order}: make it with order={order}"
        )
    if sensor is not None:
        blocks["sensor"] = as_system(sensor, "sensor")
        blocks["controller"] = _behind(blocks["controller"], blocks["sensor"])
    available = [s for system in blocks.values() for s in system.output_labels]
    internal = [s for s in _INTERNAL if s in available]
    outputs = ["y", "yd", "e", *internal[:1], "u", "v", *internal[1:], *coordinate_names(order)]
    return interconnect(blocks, outputs=outputs, name=name)


def _behind(controller: ct.InputOutputSystem, sensor: ct.InputOutputSystem) -> ct.InputOutputSystem:
    """Return the controller with its inputs fed by the sensor: x_i becomes what measures x_i."""
    measured = dict(zip(sensor.input_labels, sensor.output_labels, strict=True))
    renamed = controller.copy(name=controller.name)
    renamed.update_names(inputs=[measured.get(s, s) for s in controller.input_labels])
    return renamed
