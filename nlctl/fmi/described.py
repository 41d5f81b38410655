"""What an FMU says of itself, and what of it cannot be a block, by name."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

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
