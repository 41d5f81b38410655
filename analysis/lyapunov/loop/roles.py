"""Which block is what in a closed loop, read from its wiring, and whether that is the proof's.

The proof is about one loop: plant, actuator, reference and the paper's controller, each signal
connected once, with gain 1.  Blocks are known by the signals that their records declare, whatever
these are called in the diagram; every wire is read from python-control's own maps.

What a loop consists of, and what has been seen of it before.

Whatever was checked of a loop holds as long as its functions, wiring and values are the same.  A
key of these sees whether they are; where no key sees everything nothing is remembered.
"""

import inspect
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import control as ct
import numpy as np

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.blocks import Block
from nlctl.controllers import AdaptiveWeights, KnownSignLaw, MonotoneNussbaumLaw
from nlctl.diagrams import Place, initial_state, interconnect, leaves, overridden, places
from nlctl.diagrams.points import values_now
from nlctl.errors import CompileError, DiagramError
from nlctl.native.diagram.checks import check_functions, check_sizes
from nlctl.native.diagram.wiring import Combination, Signal, Wiring
from nlctl.plants import coordinate_names
from nlctl.upstream.control_internals import Around
from nlctl.upstream.systems import System

from ...loop_record import facts_and_unseen, text_key, value_text
from ..bounds.error_bounds import Gains

_MOST = 1024  # checks that are remembered
_RECORDS = ("spec", "current_spec")


@dataclass(frozen=True, kw_only=True)
class LoopContent:
    """What a loop consists of."""

    # as of `nlctl.analysis.loop_record.loop_facts`
    facts: Mapping[str, dict[str, str]] = field(repr=False)
    # of all that python-control computes of it with the parameters of the run; empty where no
    # key sees everything
    key: str
    # of its functions, and of what kinds of values they get; empty where `key` is
    functions: str = ""


UNREAD_CONTENT = LoopContent(facts={}, key="")


class Remembered:
    """Keys of the latest checks that were passed; an empty key stands for none."""

    def __init__(self) -> None:
        self._passed: OrderedDict[str, None] = OrderedDict()

    def __contains__(self, key: str) -> bool:
        return bool(key) and key in self._passed

    def add(self, key: str) -> None:
        """Note that a check was passed."""
        if key:
            self._passed[key] = None
            while len(self._passed) > _MOST:
                self._passed.popitem(last=False)


def loop_content(
    loop: ct.InterconnectedSystem, params: Mapping[str, Any] | None = None
) -> LoopContent:
    """Return what a loop consists of now."""
    facts, unseen = facts_and_unseen(loop)
    is_seen = not unseen and all(_is_plain(place.system) for place in places(loop))
    values = {name: value_text(value) for name, value in (params or {}).items()}
    if not is_seen:
        return LoopContent(facts=facts, key="")
    kinds = {n: v if type((params or {})[n]) is not float else "float" for n, v in values.items()}
    return LoopContent(
        facts=facts, key=text_key(repr((facts, values))), functions=text_key(repr((facts, kinds)))
    )


def _is_plain(system: object) -> bool:
    """Whether a system computes what its class, its maps and its record say, and nothing else."""
    fields = {name: value for name, value in vars(system).items() if name not in _RECORDS}
    update, output = fields.pop("updfcn", None), fields.pop("outfcn", None)
    if any(callable(value) for value in fields.values()):  # instead of a method
        return False
    if type(system) is Block:
        spec = system.spec
        return output is spec.output and (not spec.states or update is spec.update)
    return type(system) is ct.InterconnectedSystem


_PURE = Remembered()  # loops whose functions were read
Pieces = Mapping[str, tuple[str, tuple[str, ...]]]
# A block is known by a signal that it outputs, and by what the proof reads of its record.
PIECES: Pieces = {
    "reference": ("yd", ()),
    "plant": ("y", ("f", "d")),
    "actuator": ("v", ()),
    "filtered_error": ("r", ("lambdas",)),
    "basis": ("psi[0]", ("centres",)),
    "weights": ("W_psi", ()),
    "robust": ("robust", ("gamma", "sigma_2", "tau")),
    "law": ("u", ("beta",)),
}


@dataclass(frozen=True, kw_only=True)
class Roles:
    """The blocks of a closed loop by the part that they play, with the wiring checked."""

    # place of every block, by part: "reference", "plant", "actuator", "filtered_error",
    # "basis" (where there is one), "weights", "robust", "law"
    places: Mapping[str, Place] = field(repr=False)
    # gain of every external input that is added to the plant's input v, by name
    disturbances: Mapping[str, float] = field(default_factory=dict)

    @property
    def paths(self) -> dict[str, str]:
        """Path of every block in the diagram, by part."""
        return {part: place.path for part, place in self.places.items()}

    def spec(self, part: str) -> Any:
        """Return the record of a part with the parameters of the latest run; None without one."""
        return record_of(self.places[part]) if part in self.places else None


def record_of(place: Place) -> Any:
    """Return the record of a block with the parameters of the latest run; None if it has none."""
    return place.system.current_spec if type(place.system) is Block else None


def has_law(loop: System, law: type) -> bool:
    """Whether a diagram has a block with such a record."""
    return isinstance(loop, ct.InterconnectedSystem) and any(
        isinstance(record_of(place), law) for place in leaves(loop)
    )


def declared(place: Place, kind: str) -> list[str]:
    """Return the names of a block's signals as its record declares them, not as it was renamed."""
    spec = record_of(place)
    labels = place.system.input_labels if kind == "inputs" else place.system.output_labels
    return list(labels if spec is None else getattr(spec, kind))


def read_roles(loop: object, pieces: Pieces = PIECES, content: str = "") -> Roles:
    """Find the blocks of a closed loop and check every wire between them."""
    # `content` is a key of its functions: which ones were read before is remembered.
    diagram = isinstance(loop, ct.InterconnectedSystem)
    if not diagram or (pieces is PIECES and "r" not in loop.output_labels):
        raise DiagramError(
            "the proof needs a closed loop, a diagram with the output r, which is the filtered "
            "error of a controller such as nlctl.adaptive_neural"
        )
    wiring = Wiring(loop)
    _check_blocks(loop, wiring)
    if content not in _PURE:
        _check_functions(wiring)
        _PURE.add(content)
    places = _places(wiring, pieces)
    named = {
        name: Signal(i, k)
        for i, place in enumerate(wiring.blocks)
        for k, name in enumerate(declared(place, "outputs"))
    }
    disturbances = _check_inputs(wiring, places, named)
    _check_outputs(wiring, named)
    return Roles(places=places, disturbances=disturbances)


def _check_blocks(loop: System, wiring: Wiring) -> None:
    """Continuous time, no block that remembers or changes something, no states left out."""
    check_sizes(loop, (place.system for place in wiring.blocks))
    for place in (wiring.top, *wiring.blocks):
        if not ct.isctime(place.system):
            raise DiagramError(
                f"the proof is about continuous time, and '{place.path or loop.name}' is sampled "
                f"with dt = {place.system.dt}: leave dt out"
            )
        if isinstance(place.system, Around):
            raise DiagramError(
                f"the proof is about continuous time, and '{place.path}' is sampled: put the block "
                "itself there, without nlctl.sampled"
            )


def _check_functions(wiring: Wiring) -> None:
    """Functions of their arguments alone, which are the records' own."""
    for place in wiring.blocks:
        try:
            check_functions(place.path, place.system)
        except CompileError as error:
            raise DiagramError(f"the proof needs functions of their arguments: {error}") from None
        _check_functions_are_own(place)


def _check_functions_are_own(place: Place) -> None:
    """A run calls the functions of the block, the proof reads those of its record."""
    system = place.system
    if type(system) is not Block:
        return
    pairs = [("output", system.outfcn)] + ([("update", system.updfcn)] if system.nstates else [])
    for name, used in pairs:
        declared_function = getattr(system.spec, name)
        if getattr(used, "__code__", used) is not getattr(
            declared_function, "__code__", declared_function
        ):
            raise DiagramError(
                f"block '{place.path}' has another {name} function than its record "
                f"{type(system.spec).__name__}, which the proof reads: make the block of a record "
                "with that function"
            )
    _check_functions_of_kind(place)


def _check_functions_of_kind(place: Place) -> None:
    """What is known of a kind of record is known of the functions that its class has."""
    spec = place.system.spec
    for name in ("update", "output", "band"):
        of_class = inspect.getattr_static(type(spec), name, None)  # inherited ones, too
        if isinstance(of_class, staticmethod) and getattr(spec, name) is not of_class.__func__:
            raise DiagramError(
                f"block '{place.path}' has another {name} function than {type(spec).__name__}: "
                "the proof is about the latter, make a record of a class of its own"
            )


def _places(wiring: Wiring, pieces: Pieces) -> dict[str, Place]:
    """Return the block of every part."""
    places: dict[str, Place] = {}
    for place in wiring.blocks:
        outputs = declared(place, "outputs")
        part = next((p for p, (signal, _) in pieces.items() if signal in outputs), None)
        if part is None:
            raise DiagramError(
                f"the proof does not know what block '{place.path}' ({', '.join(outputs)}) is for: "
                f"it knows {', '.join(pieces)} only"
            )
        if part in places:
            raise DiagramError(
                f"two blocks output '{pieces[part][0]}', '{places[part].path}' and '{place.path}': "
                f"the proof is about one {part}"
            )
        places[part] = place
    for part, (signal, needed) in pieces.items():
        if part in places:
            _check_record(places[part], part, needed)
        elif part != "basis" or isinstance(_weights(places), AdaptiveWeights):
            raise DiagramError(f"the proof needs a block that outputs '{signal}' ({part})")
    return places


def _weights(places: Mapping[str, Place]) -> Any:
    return record_of(places["weights"]) if "weights" in places else None


def _check_record(place: Place, part: str, needed: tuple[str, ...]) -> None:
    spec = record_of(place)
    if part != "reference" and spec is None:
        raise DiagramError(
            f"the proof reads the record of '{place.path}', which is not an nlctl block"
        )
    if part == "plant":
        _check_coordinates(place, spec)
    missing = [name for name in needed if not hasattr(spec, name)]
    if missing:
        raise DiagramError(
            f"the proof needs {', '.join(missing)} of block '{place.path}', and "
            f"{type(spec).__name__} has no such thing"
        )


def _check_coordinates(place: Place, spec: Any) -> None:
    states = coordinate_names(len(spec.states))
    missing = [name for name in states if name not in spec.outputs]
    if tuple(spec.states) != states or missing:
        raise DiagramError(
            f"the proof needs the states {', '.join(states)} of block '{place.path}' in this order "
            f"and as outputs, got the states {', '.join(spec.states)} and the outputs "
            f"{', '.join(spec.outputs)}"
        )


def _check_inputs(
    wiring: Wiring, places: Mapping[str, Place], named: Mapping[str, Signal]
) -> dict[str, float]:
    """Check what feeds every block; return the external inputs that are added to v."""
    disturbances: dict[str, float] = {}
    for place in wiring.blocks:
        for name, terms in zip(declared(place, "inputs"), wiring.inputs(place), strict=True):
            given = {signal: gain for signal, gain in terms.items() if gain != 0}
            expected = {named[name]: 1.0} if name in named else {}
            if place is places["plant"] and name == "v":
                outside = {s: gain for s, gain in given.items() if s.block is None}
                labels = wiring.top.system.input_labels
                disturbances |= {labels[s.index]: gain for s, gain in outside.items()}
                given = {s: gain for s, gain in given.items() if s not in outside}
            if given != expected or not expected:
                raise DiagramError(_wrong_wire(wiring, place, name, given, expected))
    return disturbances


def _check_outputs(wiring: Wiring, named: Mapping[str, Signal]) -> None:
    """An output of the diagram that is called as a signal of the proof is that signal."""
    for i, label in enumerate(wiring.top.system.output_labels):
        if label in named:
            terms = {s: gain for s, gain in wiring.output(wiring.top, i).items() if gain != 0}
            if terms != {named[label]: 1.0}:
                raise DiagramError(
                    f"output '{label}' of '{wiring.top.system.name}' is {_combined(wiring, terms)},"
                    f" the proof takes {_signal(wiring, named[label])}: give it another name"
                )


def _wrong_wire(
    wiring: Wiring, place: Place, name: str, given: Combination, expected: Combination
) -> str:
    got = f"input '{name}' of block '{place.path}' is {_combined(wiring, given)}"
    if not expected:
        return f"{got}, and no block of the proof outputs '{name}': the proof is about another loop"
    if any(signal.block is None for signal in given):
        return (
            f"{got}: the proof knows external inputs only where they are added to the plant's v, "
            "with a declared bound; take the input away"
        )
    return (
        f"{got}, the proof is about {_combined(wiring, expected)}: correct the connection, or make "
        "gain and sign part of the block"
    )


def _combined(wiring: Wiring, terms: Combination) -> str:
    """Return a linear combination of signals in words."""
    parts = []
    for signal, gain in terms.items():
        factor = "" if gain == 1 else "-" if gain == -1 else f"{gain:g} * "
        parts.append(factor + _signal(wiring, signal))
    return " + ".join(parts) or "connected to nothing"


def _signal(wiring: Wiring, signal: Signal) -> str:
    if signal.block is None:
        return f"external input '{wiring.top.system.input_labels[signal.index]}'"
    place = wiring.blocks[signal.block]
    return f"'{declared(place, 'outputs')[signal.index]}' of '{place.path}'"


def joined_again(
    loop: ct.InterconnectedSystem, roles: Roles, remade: Callable[[str, Any, str], Any]
) -> list[Any]:
    """Return copies of a loop's blocks that are connected by the names that the records declare."""
    parts = {place.path: part for part, place in roles.places.items()}

    def copied(diagram: ct.InterconnectedSystem, path: str) -> Iterator[Any]:
        for system in diagram.syslist:
            here = f"{path}{system.name}"
            if isinstance(system, ct.InterconnectedSystem):
                inner = list(copied(system, f"{here}."))
                inside = {label for block in inner for label in block.output_labels}
                taken = [label for block in inner for label in block.input_labels]
                outside = [label for label in dict.fromkeys(taken) if label not in inside]
                yield interconnect(inner, inputs=outside, name=system.name)
            elif type(system) is Block:
                yield remade(parts[here], system.current_spec, system.name)
            else:
                yield system.copy(name=system.name)

    return list(copied(loop, ""))


def check_kind(place: Place, kinds: tuple[type, ...]) -> None:
    """Check that a block is of a kind that the proof knows."""
    spec = record_of(place)
    if type(spec) not in kinds:
        choices = " or ".join(kind.__name__ for kind in kinds)
        raise DiagramError(
            f"the certificate is about a {choices} as '{place.path}', "
            f"got {type(spec).__name__}: put one there"
        )


DAMPED = (KnownSignLaw, MonotoneNussbaumLaw)  # laws with eta = beta r + s tanh(r s / b)


@described_record(made_by="read_parts")
class Parts:
    """The records of a loop, by the part that they play in the proof."""

    plant: Any  # With the parameters of the run.
    actuator: Any
    filtered_error: Any
    robust: Any
    law: Any
    basis: Any  # None where `nlctl.controllers.Zero` replaces the network.
    weights: Any
    roles: Roles  # Places of the blocks in the diagram.
    gains: Gains  # Gains and initial values of the controller.

    @property
    def paths(self) -> dict[str, str]:
        """Path of every block in the diagram, by part."""
        return self.roles.paths

    @property
    def order(self) -> int:
        """Order n of the plant."""
        return len(self.plant.states)


@as_annotated
def read_parts(
    loop: ct.InterconnectedSystem,
    start: Mapping[str, float] | None = None,
    params: Mapping[str, Any] | None = None,
) -> Parts:
    """Read plant, actuator and controller pieces of a loop such as `nlctl.paper.example_1`.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        With the output r.
    start : mapping, optional
        Initial states other than the blocks' own, ``{"plant.x1": 0.8}``.
    params : mapping, optional
        Qualified parameters other than the blocks' own.

    Returns
    -------
    Parts
        The pieces, with their records and initial states; their blocks are a copy's, so that the
        loop keeps its parameters.

    Raises
    ------
    DiagramError
        As `nlctl.analysis.lyapunov.loop.roles.read_roles` does, or if there are external inputs.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import read_parts
    >>> parts = read_parts(nlctl.paper.example_1(), params={"law.beta": 3.0})
    >>> type(parts.actuator).__name__, parts.gains.beta
    ('DeadZone', 3.0)
    """
    if isinstance(loop, ct.InterconnectedSystem):  # else it is refused
        loop = overridden(loop, params)
    roles = read_roles(loop)
    if roles.disturbances:
        names = ", ".join(f"'{name}'" for name in roles.disturbances)
        raise DiagramError(
            f"external input {names} is added to the plant's v: the proof needs its bound, and "
            "takes one in certify(loop, inputs={...}) only"
        )
    return loop_parts(loop, roles, start)


def loop_parts(
    loop: ct.InterconnectedSystem, roles: Roles, start: Mapping[str, float] | None = None
) -> Parts:
    """Return the parts of a loop that was read, with the parameters that its blocks have now."""
    specs = {part: roles.spec(part) for part in PIECES if part != "reference"}
    if not isinstance(specs["weights"], AdaptiveWeights):
        specs |= {"basis": None, "weights": None}  # without a network
    x0 = initial_state(loop, start)
    states = {p: x0[f.state_offset :][: f.system.nstates or 0] for p, f in roles.places.items()}
    _, outputs = values_now(loop, (0.0, x0, np.zeros(loop.ninputs or 0)))
    weights = specs["weights"]
    gains = Gains(
        beta=specs["law"].beta,
        Gamma=weights.Gamma if weights else 1.0,
        sigma_1=weights.sigma_1 if weights else 0.0,
        gamma=specs["robust"].gamma,
        sigma_2=specs["robust"].sigma_2,
        tau=specs["robust"].tau,
        r_0=float(outputs[loop.output_labels.index("r")]),
        delta_hat_0=float(states["robust"][0]),
        W_hat_0=tuple(map(float, states["weights"])) if weights else (),
        b=specs["law"].b if isinstance(specs["law"], DAMPED) else 0.0,
    )
    return Parts(**specs, roles=roles, gains=gains)
