"""A running FMU whose past states are kept by number, so that what is asked of it depends on these.

A block's equations are functions of time, states, inputs and parameters.  What an FMU keeps inside
is none of its states; so each inner state that it has been in has a number, and that is one.
"""

import ctypes
import os
import shutil
import tempfile
import weakref
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..errors import ParameterError, UsageError
from ..names import unknown

_KINDS = {"ModelExchange": "modelExchange", "CoSimulation": "coSimulation"}
_NUMBERS = {
    *("Real", "Integer", "Boolean", "Enumeration", "Float64", "Float32", "Int8", "UInt8"),
    *("Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"),
}  # fmt: skip
_REALS = {"Real", "Float64"}


@dataclass(frozen=True, kw_only=True)
class Described:
    """An FMU as its description has it."""

    path: Path
    kind: str  # ``"ModelExchange"`` or ``"CoSimulation"``
    version: int  # of FMI: 2 or 3
    whole: Any
    inputs: tuple[Any, ...]  # FMPy's variables; no states in Co-Simulation
    outputs: tuple[Any, ...]
    parameters: tuple[Any, ...]
    states: tuple[Any, ...]
    keeps_states: bool  # whether its state can be read and written as a whole

    @property
    def own(self) -> Any:
        """What it says of its kind: identifier and abilities."""
        return getattr(self.whole, _KINDS[self.kind])


def read_description(
    path: str | os.PathLike[str], kind: str | None, *, ignore_completed_steps: bool = False
) -> Described:
    """Read the description of an FMU; what cannot be a block is refused."""
    fmpy = _fmpy()
    path = Path(path)
    if not path.is_file():
        raise ParameterError(f"there is no file '{path}'")
    try:
        root = _root(path)
    except Exception as error:  # whatever zip files and XML may have
        raise ParameterError(f"'{path.name}' is not an FMU: {error}") from error
    if root.get("fmiVersion", "").startswith("1."):
        raise UsageError(f"'{path.name}' is an FMU of FMI 1.0: 2.0 and 3.0 are supported")
    try:
        whole = fmpy.read_model_description(str(path))
    except Exception as error:  # whatever FMPy and its parser raise
        raise ParameterError(f"'{path.name}' is not a valid FMU: {error}") from error
    kind = _kind(path, whole, kind)
    if fmpy.platform not in fmpy.supported_platforms(str(path)):
        raise UsageError(
            f"'{path.name}' has no library for this platform, {fmpy.platform}: it has those for "
            f"{', '.join(fmpy.supported_platforms(str(path))) or 'none'}"
        )
    description = _of_description(path, whole, kind)
    if kind == "ModelExchange":
        _check_keeps_states(description)
        if not ignore_completed_steps and _needs_completed_steps(description, root):
            raise UsageError(
                f"'{path.name}' cannot be a block in Model Exchange: by its description it needs a "
                "report of each accepted step (completedIntegratorStep), which a block does not "
                "make; take kind='CoSimulation', or give ignore_completed_steps=True if nothing "
                "happens there"
            )
    return description


def _root(path: Path) -> Any:
    """Return its description as XML."""
    with zipfile.ZipFile(path) as archive:
        return ElementTree.fromstring(archive.read("modelDescription.xml"))


def _fmpy() -> Any:
    try:
        import fmpy
    except ImportError as error:
        raise UsageError(
            "an FMU is run by FMPy, which is not installed: pip install 'nlctl[export]'"
        ) from error
    return fmpy


def _kind(path: Path, whole: object, kind: str | None) -> str:
    """Return which of its kinds is meant: Model Exchange if it has that."""
    there = [name for name, key in _KINDS.items() if getattr(whole, key) is not None]
    if kind is None and there:
        return there[0]
    if kind in there:
        return kind
    if kind in _KINDS or kind is None:
        raise UsageError(f"'{path.name}' has no {kind or 'Model Exchange, and no Co-Simulation'}: "
                         f"it has {' and '.join(there) or 'neither'}")  # fmt: skip
    raise unknown("kind", str(kind), _KINDS, "of FMUs")


def _of_description(path: Path, whole: Any, kind: str) -> Described:
    def of(causality: str) -> list[Any]:
        return [v for v in whole.modelVariables if v.causality == causality]

    inputs, outputs = of("input"), of("output")
    for v in [*inputs, *outputs]:
        allowed = _REALS if v.causality == "input" else _NUMBERS
        if v.type not in allowed:
            raise UsageError(
                f"'{path.name}' cannot be a block: its {v.causality} '{v.name}' is of type {v.type}"
            )
        if getattr(v, "dimensions", None):
            raise UsageError(
                f"'{path.name}' cannot be a block: its {v.causality} '{v.name}' is an array"
            )
    parameters = [
        v for v in of("parameter")
        if v.type in _REALS and v.start is not None and not getattr(v, "dimensions", None)
    ]  # fmt: skip
    own = getattr(whole, _KINDS[kind])
    states: Sequence[Any] = ()
    if kind == "ModelExchange":
        states = [u.variable.derivative for u in whole.derivatives]
    return Described(
        path=path, kind=kind, version=int(whole.fmiVersion[0]), whole=whole, inputs=tuple(inputs),
        outputs=tuple(outputs), parameters=tuple(parameters), states=tuple(states),
        keeps_states=bool(own.canGetAndSetFMUstate),
    )  # fmt: skip


def _check_keeps_states(of: Described) -> None:
    """Refuse in Model Exchange what cannot begin a step again."""
    if not of.keeps_states:
        raise UsageError(
            f"'{of.path.name}' cannot be a block in Model Exchange: its state cannot be read and "
            "written (canGetAndSetFMUState), which a step that is repeated needs"
        )


def _needs_completed_steps(of: Described, root: Any) -> bool:
    """Whether `completedIntegratorStep` matters: FMI 2.0 says so of who is silent, FMI 3.0 not."""
    attributes = dict(getattr(root.find("ModelExchange"), "attrib", {}))
    if of.version == 2:
        return attributes.get("completedIntegratorStepNotNeeded", "false") in ("false", "0")
    return attributes.get("needsCompletedIntegratorStep", "false") in ("true", "1")


_MOST = 100  # repetitions at one event
_GETTERS = {"Real": "getReal", "Integer": "getInteger", "Boolean": "getBoolean",
            "Enumeration": "getInteger"}  # fmt: skip


class Running:
    """An instance of an FMU."""

    def __init__(self, of: Described, start: float) -> None:
        import fmpy

        self.of, self.start = of, start  # when it begins (s)
        self.folder = tempfile.mkdtemp()
        weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        fmpy.extract(str(of.path), unzipdir=self.folder)
        self.fmu = self._instance()
        self.kept: list[Any] = [None]  # inner states by number; 0 stands for the beginning
        self.times, self.next = [start], [np.inf]  # when it was in them, and what is due next
        self._known: dict[Any, float] = {}
        self._now = -1.0
        self._begun: list[bytes] = [b""]  # parameters of each

    def _instance(self) -> Any:
        from fmpy import fmi2, fmi3

        kinds = {
            (2, "ModelExchange"): fmi2.FMU2Model, (2, "CoSimulation"): fmi2.FMU2Slave,
            (3, "ModelExchange"): fmi3.FMU3Model, (3, "CoSimulation"): fmi3.FMU3Slave,
        }  # fmt: skip
        fmu = kinds[self.of.version, self.of.kind](
            guid=self.of.whole.guid, unzipDirectory=self.folder, instanceName=self.of.path.stem,
            modelIdentifier=self.of.own.modelIdentifier,
        )  # fmt: skip
        fmu.instantiate()
        return fmu

    # -- states by number

    def begin(self, p: Sequence[float]) -> float:
        """Return the number of the state in which it begins with parameters `p`."""
        key = np.asarray(p, dtype=float).tobytes()
        if key not in self._known:
            self._initialize(p)
            due = self._events() if self.of.kind == "ModelExchange" else np.inf
            self._known[key] = self._keep(self.start, due)
        return self._known[key]

    def _initialize(self, p: Sequence[float]) -> None:
        if self._now >= 0.0:
            self.fmu.reset()
        self._set([v.valueReference for v in self.of.parameters], p)
        if self.of.version == 2:
            self.fmu.setupExperiment(startTime=self.start)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=self.start)
        self.fmu.exitInitializationMode()

    def _keep(self, t: float, due: float) -> float:
        """Keep the inner state of now; return its number."""
        read = self.fmu.getFMUstate if self.of.version == 2 else self.fmu.getFMUState
        self.kept.append(read())
        self.times.append(t)
        self.next.append(due)
        self._now = float(len(self.kept) - 1)
        return self._now

    def go_to(self, number: float, p: Sequence[float]) -> int:
        """Be in a state that it has been in; return its number."""
        number = float(number) or self.begin(p)
        if number != self._now:
            write = self.fmu.setFMUstate if self.of.version == 2 else self.fmu.setFMUState
            write(self.kept[int(number)])
            self._now = number
        return int(number)

    # -- what is asked

    def _set(self, references: list[int], values: Sequence[float]) -> None:
        if references:
            setter = self.fmu.setReal if self.of.version == 2 else self.fmu.setFloat64
            setter(references, [float(v) for v in values])

    def outputs(self) -> tuple[float, ...]:
        """Return its outputs."""
        found = []
        for v in self.of.outputs:
            getter = _GETTERS.get(v.type, f"get{v.type}")
            found.append(float(getattr(self.fmu, getter)([v.valueReference])[0]))
        return tuple(found)

    def put(self, t: float, x: Sequence[float], u: Sequence[float]) -> None:
        """Set time, continuous states and inputs, in Model Exchange."""
        self.fmu.setTime(float(t))
        if len(x):
            self.fmu.setContinuousStates((ctypes.c_double * len(x))(*map(float, x)), len(x))
        self._set([v.valueReference for v in self.of.inputs], u)

    def put_inputs(self, u: Sequence[float]) -> None:
        """Set inputs, in Co-Simulation."""
        self._set([v.valueReference for v in self.of.inputs], u)

    def rates(self) -> tuple[float, ...]:
        """Return the rates of its continuous states."""
        name = "getDerivatives" if self.of.version == 2 else "getContinuousStateDerivatives"
        return self._numbers(name, len(self.of.states))

    def states(self) -> tuple[float, ...]:
        """Return its continuous states."""
        return self._numbers("getContinuousStates", len(self.of.states))

    def indicators(self) -> tuple[float, ...]:
        """Return its event indicators."""
        return self._numbers("getEventIndicators", self.of.whole.numberOfEventIndicators or 0)

    def _numbers(self, name: str, size: int) -> tuple[float, ...]:
        if not size:
            return ()
        values = (ctypes.c_double * size)()
        getattr(self.fmu, name)(values, size)
        return tuple(values)

    # -- what makes new states

    def event(self, number: float, t: float, x: Any, u: Any, p: Any) -> tuple[float, ...]:
        """Return the states behind an event, and the number of the inner state there."""
        key = (float(number), float(t), *map(float, x), *map(float, u), *map(float, p))
        if key not in self._known:
            self.go_to(number, p)
            self.put(t, x, u)
            self.fmu.enterEventMode()
            self._known[key] = self._keep(t, self._events())
        found = self._known[key]
        self.go_to(found, p)
        return *self.states(), found

    def _events(self) -> float:
        """Repeat an event until nothing is left to do; return when the next is due."""
        name = "newDiscreteStates" if self.of.version == 2 else "updateDiscreteStates"
        for _ in range(_MOST):
            again, ends, _, _, is_due, due = getattr(self.fmu, name)()
            if ends:
                raise UsageError(f"'{self.of.path.name}' ends the simulation: run it up to then")
            if not again:
                self.fmu.enterContinuousTimeMode()
                return float(due) if is_due else np.inf
        raise UsageError(f"'{self.of.path.name}' has an event that never ends")

    def step(self, number: float, u: Any, p: Any, dt: float) -> float:
        """Return the number of the state that a step of Co-Simulation leads to."""
        key = (float(number), *map(float, u), *map(float, p), "step")
        if key not in self._known:
            begin = self.times[self.go_to(number, p)]
            self.put_inputs(u)
            self._do_step(begin, dt)
            # k dt, as clocks count
            self._known[key] = self._keep(self.start + (round((begin - self.start) / dt) + 1) * dt,
                                          np.inf)  # fmt: skip
        return self._known[key]

    def _do_step(self, begin: float, dt: float) -> None:
        """Step, or say whose step failed."""
        from fmpy.fmi1 import FMICallException

        name = self.of.path.name
        try:
            done = self.fmu.doStep(currentCommunicationPoint=begin, communicationStepSize=dt)
        except FMICallException as error:
            raise UsageError(f"'{name}' makes no step from {begin:g} s on: {error}") from error
        if self.of.version == 3 and (done[1] or done[3] < begin + 0.5 * dt):
            raise UsageError(f"'{name}' ends the simulation at {done[3]:g} s: run it up to then")
