"""Derivatives of both examples of the paper against differences of runs, to 1e-6."""

import numpy as np
import pytest
from examples import many, some

import nlctl
from nlctl.native.floats import float_parameters

TIMES = np.linspace(0, 10, 41)
EXAMPLES = {  # the first of them each day
    "example_1": (nlctl.paper.example_1, {}),
    "example_1, backlash": (nlctl.paper.example_1, {"actuator": nlctl.Backlash()}),
    "example_2": (nlctl.paper.example_2, {}),
    "example_2, dead zone": (nlctl.paper.example_2, {"actuator": nlctl.DeadZone()}),
}
WIDTHS = (2e-3, 2e-4)  # of differences: a kink makes wide ones wrong, rounding narrow ones


def compared(compiled):
    """Parameters and initial states to be compared, with their values."""
    p = compiled.parameter_vector()
    parameters = {name: p[place] for name, (place, _) in float_parameters(compiled).items()}
    names = [n for n in parameters if "centres" not in n]
    own = [n for n in names if n.startswith(("actuator", "plant", "controller"))]
    found = {n: parameters[n] for n in own}
    states = zip(
        nlctl.state_names(compiled.system), nlctl.initial_state(compiled.system), strict=True
    )
    found |= {f"{n}(0)": v for n, v in states if n.startswith("plant") or n.endswith("[0]")}
    return found


def outputs(compiled, name, value):
    start, params = {}, {}
    if name.endswith("(0)"):
        start[name.removesuffix("(0)")] = value
    else:
        params[name] = value
    run = nlctl.input_output_response(
        compiled, TIMES, 0, start, params=params, rtol=1e-12, atol=1e-14, audit=False
    )
    return run.outputs[compiled.system.output_labels.index("y")]


def extrapolated(function, at, h):
    value = lambda step: (function(at + step) - function(at - step)) / (2 * step)  # noqa: E731
    return (4 * value(h / 2) - value(h)) / 3


@pytest.mark.parted(part=4)
@pytest.mark.parametrize("name", EXAMPLES)
def test_examples(name):
    """Every parameter of plant, actuator and controller, and where the run begins.

    All are computed, and a sixth of them compared; all once a week.
    """
    maker, given = EXAMPLES[name]
    compiled = nlctl.compile(maker(**given))
    by = compared(compiled)
    made = nlctl.sensitivity_response(compiled, TIMES, of=["y"], with_respect_to=list(by))
    assert made.success, made.message
    errors = {}
    for quantity, value in some(by.items(), part=6):
        own = made["y", quantity]
        scale = max(np.abs(own).max(), 1e-3 / max(abs(value), 1.0))
        apart = []
        for width in WIDTHS:
            h = width * max(abs(value), 0.05)
            expected = extrapolated(lambda v, q=quantity: outputs(compiled, q, v), value, h)
            apart.append(float(np.abs(own - expected).max() / scale))
        errors[quantity] = min(apart)
    assert len(errors) > many(12, part=6)
    assert max(errors.values()) < 1e-6, errors
