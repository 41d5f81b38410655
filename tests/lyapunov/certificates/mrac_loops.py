"""Loops of model reference adaptive control of order one and two, with planted differences."""

import control as ct
import numpy as np

import nlctl

OUTPUTS = ("x1", "e", "r", "u", "W_norm")
QUIET = nlctl.SumOfSines(order=0, amplitudes=0.0, frequencies=1.0, phases=0.0)
SINE = nlctl.SumOfSines(order=0, amplitudes=0.5, frequencies=1.0, phases=0.0)


@nlctl.equation
def unstable(x, v):
    """x' = 2 x + v."""
    return 2.0 * x[0] + v


@nlctl.equation
def half_sine(x, t):
    """d = 0.5 sin t."""
    return 0.5 * np.sin(t)


def sigma(sigma_1=0.2, Gamma=5.0, nodes=2):
    return nlctl.controllers.AdaptiveWeights(nodes=nodes, Gamma=Gamma, sigma_1=sigma_1)


def e_modification(own=0.2, Gamma=5.0, nodes=2):
    return nlctl.controllers.EModifiedWeights(nodes=nodes, Gamma=Gamma, sigma=own)


def projection(W_max=2.5, Gamma=5.0, nodes=2):
    return nlctl.controllers.ProjectedWeights(nodes=nodes, Gamma=Gamma, W_max=W_max)


def first_order(
    weights, *, f=unstable, d=None, gain=1.0, k=1.0, b=0.0, wires=None, inputs=(), **changed
):
    """An unstable plant x' = f + d, the model xm' = -k xm + b yd, Q = 1."""
    disturbance = {} if d is None else {"d": d}
    parts = {
        "reference": QUIET,
        "plant": nlctl.PureFeedback(order=1, f=f, **disturbance),
        "actuator": nlctl.Gain(),
        "model": nlctl.controllers.ReferenceModel(a=(k,), b=b),
        "error": nlctl.controllers.ModelError(K=(k,), Q=(1.0,)),
        "basis": nlctl.controllers.LinearRegressor(order=1),
        "weights": weights,
        "law": nlctl.controllers.ModelReferenceLaw(gain=gain),
    }
    return joined(parts | changed, wires, inputs)


def wing_rock(weights, *, wires=None, inputs=(), **changed):
    """Wing rock with its own regressor, as in the gallery, and a sine as command."""
    parts = {
        "reference": SINE,
        "plant": nlctl.plants.WingRock(),
        "actuator": nlctl.Gain(),
        "model": nlctl.controllers.ReferenceModel(a=(4.0, 2.0), b=4.0),
        "error": nlctl.controllers.ModelError(K=(1.5, 1.3), Q=(1.0, 1.0)),
        "basis": nlctl.controllers.WingRockRegressor(),
        "weights": weights,
        "law": nlctl.controllers.ModelReferenceLaw(gain=3.0),
    }
    return joined(parts | changed, wires, inputs)


def joined(parts, wires=None, inputs=()):
    """The parts connected by name, with some wires changed.

    `wires` maps an input, ``"plant.v"``, to its sources with gains, ``{"actuator.v": -1.0}``;
    `inputs` are names of external inputs that are added to the plant's v.
    """
    blocks = [
        thing if isinstance(thing, ct.InputOutputSystem) else nlctl.block(thing, name)
        for name, thing in parts.items()
    ]
    sources = {
        label: (i, k) for i, one in enumerate(blocks) for k, label in enumerate(one.output_labels)
    }
    connections = []
    for i, one in enumerate(blocks):
        for k, label in enumerate(one.input_labels):
            changed = (wires or {}).get(f"{one.name}.{label}", {label: 1.0})
            fed = [(*sources[name], gain) for name, gain in changed.items()]
            connections += [[(i, k), *fed]] if fed else []
    plant = list(parts).index("plant")
    return ct.interconnect(
        blocks,
        connections,
        inplist=[[(plant, 0)] for _ in inputs],
        inputs=list(inputs),
        outlist=[sources[label] for label in OUTPUTS],
        outputs=list(OUTPUTS),
        check_unused=False,
        name="adaptive",
    )
