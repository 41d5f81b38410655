"""Loops that differ from the certified one in one planted thing, by what was changed."""

import dataclasses

import control as ct

import nlctl

CENTRES = nlctl.adaptive_neural(2).syslist[1].spec.centres[::9]  # three of them: quick to wire
PARTS = {
    "reference": lambda: nlctl.SumOfSines(order=2),
    "plant": lambda: nlctl.plants.ForcedDuffing(),
    "actuator": lambda: nlctl.DeadZone(),
    "filtered_error": lambda: nlctl.controllers.FilteredError(),
    "basis": lambda: nlctl.controllers.GaussianBasis(centres=CENTRES),
    "weights": lambda: nlctl.controllers.AdaptiveWeights(nodes=3, Gamma=10.0),
    "robust": lambda: nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5),
    "law": lambda: nlctl.controllers.KnownSignLaw(),
}
WIRES = {
    "plant.v": "actuator.v",
    "actuator.u": "law.u",
    **{f"filtered_error.x{i}": f"plant.x{i}" for i in (1, 2)},
    **{f"basis.x{i}": f"plant.x{i}" for i in (1, 2)},
    **{f"filtered_error.{s}": f"reference.{s}" for s in ("yd", "yd1", "yd2")},
    "weights.r": "filtered_error.r",
    **{f"weights.psi[{i}]": f"basis.psi[{i}]" for i in range(3)},
    "robust.r": "filtered_error.r",
    "law.r": "filtered_error.r",
    "law.W_psi": "weights.W_psi",
    "law.robust": "robust.robust",
    "law.Y_d": "filtered_error.Y_d",
}
OUTPUTS = {"r": "filtered_error.r", "u": "law.u", "x1": "plant.x1"}
KNOWN_SIGN = PARTS, WIRES
SLIDING = (
    {
        **{k: PARTS[k] for k in ("reference", "plant", "filtered_error")},
        "actuator": lambda: nlctl.Gain(),
        "law": lambda: nlctl.controllers.SlidingModeLaw(K=25.0, phi=0.1),
    },
    {
        k: v
        for k, v in WIRES.items()
        if k.partition(".")[0] in ("plant", "actuator", "filtered_error")
    }
    | {"law.r": "filtered_error.r"},
)


def system(thing, name):
    """A record as a block; a system as it is."""
    return thing if isinstance(thing, ct.InputOutputSystem) else nlctl.block(thing, name)


def wired(wires=None, *, inputs=None, outputs=None, params=None, more=(), of=KNOWN_SIGN, **parts):
    """A certified loop, flat, by explicit connections, with some of them changed.

    `wires` maps an input to a source, or to a list of sources that are added, with gains as
    python-control writes them: ``"-actuator.v"``, ``("actuator", "v", 0.05)``, None for none.
    """
    blocks = [system(parts.get(k, make()), k) for k, make in of[0].items()] + list(more)
    places = {block.name: block for block in blocks}

    def full(signal):  # brackets mean more than one signal in python-control's text
        if not isinstance(signal, str):
            return signal
        sign = -1 if signal.startswith("-") else 1
        name, _, label = signal.removeprefix("-").partition(".")
        return name, label, sign

    def numbered(signal, kind):
        name, label, *gain = full(signal)
        labels = getattr(places[name], f"{kind}_labels")
        return [list(places).index(name), labels.index(label), *gain]

    connections = []
    for target, sources in {**of[1], **(wires or {})}.items():
        listed = [] if sources is None else sources if isinstance(sources, list) else [sources]
        if listed:
            into = tuple(numbered(target, "input")[:2])
            connections += [[into, *(tuple(numbered(s, "output")) for s in listed)]]
    outputs = OUTPUTS if outputs is None else outputs
    inputs = inputs or {}
    return ct.interconnect(
        blocks,
        connections,
        inplist=[[tuple(numbered(t, "input")) for t in targets] for targets in inputs.values()],
        inputs=list(inputs),
        outlist=[tuple(numbered(s, "output")) for s in outputs.values()],
        outputs=list(outputs),
        params=params or {},
        check_unused=False,
        name="planted",
    )


def nested(input_gain=1.0, output_gain=1.0, disturbed=False):
    """Actuator and plant in a diagram of their own, with gains at its ends."""
    plant, actuator = (system(PARTS[k](), k) for k in ("plant", "actuator"))
    inner = ct.interconnect(
        [actuator, plant],
        [["plant.v", "actuator.v"]],
        inplist=[[(0, 0)], *([[(1, 0)]] if disturbed else [])],
        inputs=["command", *(["w"] if disturbed else [])],
        outlist=[(1, 1, output_gain), (1, 2)],
        outputs=["angle", "rate"],
        name="machine",
    )
    inner.set_input_map(inner.input_map * input_gain)
    rest = {k: system(PARTS[k](), k) for k in PARTS if k not in ("plant", "actuator")}
    controller = nlctl.interconnect(
        {k: rest[k] for k in ("filtered_error", "basis", "weights", "robust", "law")},
        inputs=["x1", "x2", "yd", "yd1", "yd2"], outputs=["r", "u"], name="controller",
    )  # fmt: skip
    return ct.interconnect(
        [rest["reference"], controller, inner],
        [
            ["machine.command", "controller.u"],
            ["controller.x1", "machine.angle"],
            ["controller.x2", "machine.rate"],
            *([f"controller.{s}", f"reference.{s}"] for s in ("yd", "yd1", "yd2")),
        ],
        inplist=["machine.w"] if disturbed else None,
        inputs=["w"] if disturbed else None,
        outlist=["controller.r", "controller.u"],
        outputs=["r", "u"],
        name="planted",
    )


def actuator(output):
    """A record of an actuator without memory, from ``output(t, u)``."""
    characteristic = nlctl.equation(output)

    @nlctl.equation
    def equation(t, x, u, p):
        return (characteristic(t, u[0]),)

    return nlctl.record(
        type("Own", (), {
            "__annotations__": {}, "inputs": ("u",), "outputs": ("v",), "states": (),
            "feedthrough": True, "output": staticmethod(equation),
        })
    )()  # fmt: skip


def plant(update=None, output=None, **more):
    """A Duffing plant with its own update or output function."""
    changed = {
        name: staticmethod(nlctl.equation(function))
        for name, function in (("update", update), ("output", output))
        if function is not None
    }
    return type("OwnPlant", (nlctl.plants.ForcedDuffing,), changed | more)()


UPDATE = nlctl.plants.ForcedDuffing.update


def again(kind, **changed):
    """A record of a kind of one's own, which has other functions than its parent."""
    functions = {k: staticmethod(nlctl.equation(f)) for k, f in changed.items() if callable(f)}
    rest = {k: v for k, v in changed.items() if not callable(v)}
    return type(f"Own{kind.__name__}", (kind,), functions)(**rest)


def exchanged(record, **functions):
    """A record whose functions were replaced after it was made."""
    for name, function in functions.items():
        object.__setattr__(record, name, nlctl.equation(function))
    return record


def patched(part, **functions):
    """A block whose functions were replaced after it was made."""
    block = system(PARTS[part](), part)
    for name, function in functions.items():
        setattr(block, name, function)
    return {part: block}


def sampled(record):
    """A record whose update returns x[k+1], as a block with a sampling interval."""
    kind = type(type(record).__name__, (type(record),), {"discrete": True})
    values = {f.name: getattr(record, f.name) for f in dataclasses.fields(record) if f.init}
    return kind(**values)
