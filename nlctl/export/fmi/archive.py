"""An FMU as a file: everything is made before a byte of it is written."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import control as ct

from ...annotations import as_annotated
from ...arguments import RTOL, number
from ...errors import ParameterError, UsageError
from ...host.files import replace_file
from ...names import unknown
from ..zig import check_zig
from .binaries import PLATFORMS, libraries
from .description import build_description, description
from .reading import read_model
from .source import sources, token_of

_BEGINNING = (1980, 1, 1, 0, 0, 0)  # of the time of zip files: the same content is the same file
_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}  # fmt: skip


@as_annotated
def fmu(
    diagram: ct.InputOutputSystem,
    path: str | os.PathLike[str],
    *,
    version: int = 3,
    params: Mapping[str, Any] | None = None,
    initial_state: Mapping[str, float] | None = None,
    name: str | None = None,
    stop_time: float = 10.0,
    tolerance: float = RTOL,
    platforms: Sequence[str] = tuple(PLATFORMS),
) -> Path:
    """Write a diagram as an FMU: a model that other simulators run, without Python.

    It has Model Exchange and Co-Simulation in one file, with sources and libraries for all
    platforms.  What both engines of nlctl stop at is an event there: guards, switching functions
    and conditions are event indicators, samples of clocks and conditions of t alone are time
    events, and memories are committed after each accepted step.  In Co-Simulation no step leads
    over a function that is flat but for a narrow range of a state (a Gaussian, a steep tanh).  In
    Model Exchange steps are the importer's, and FMI has no word for this: bound them there.

    Parameters
    ----------
    diagram : control.InputOutputSystem
        In continuous time; parts of it may be sampled.
    path : str or path-like
        The file, ``loop.fmu``.
    version : int, optional
        Of FMI: 2 or 3.
    params : mapping, optional
        Parameters by qualified names, on top of those of the diagram: the start values there.
    initial_state : mapping of str to float, optional
        Initial states by name; by default those that blocks declare.
    name : str, optional
        Model identifier, a name in C; by default that of the diagram.
    stop_time : float, optional
        End of the default experiment (s).  Up to then it is known when conditions of t alone
        switch; a diagram that has some runs no further.
    tolerance : float, optional
        Of the integrator in Co-Simulation, unless an importer gives it another.
    platforms : sequence of str, optional
        Of ``"linux"``, ``"windows"`` and ``"macos"``, which libraries are compiled for; without
        any the FMU has its sources alone.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    CompileError
        If an FMU cannot say it: functions that are called, loops without a fixed number of
        passes, a search for signals of an algebraic loop, transport delays, ideal relays, jitter
        of a clock, discrete time.
    ParameterError
        If a number is out of its bounds, a name is none in C, or there is no such folder.
    UnknownNameError
        If a parameter, a state or a platform is unknown.
    UsageError
        If the extra ``export`` is not installed.

    Examples
    --------
    >>> import nlctl
    >>> loop = nlctl.paper.example_1()
    >>> nlctl.export.fmu(loop, "loop.fmu", name="loop")  # doctest: +SKIP
    PosixPath('loop.fmu')
    """
    path = Path(path)
    if version not in _HEADERS or isinstance(version, bool):
        raise ParameterError(f"fmu needs version 2 or 3, got {version!r}")
    if not path.parent.is_dir():
        raise ParameterError(f"fmu needs a path in a folder that exists, got '{path}'")
    version = int(version)
    chosen = list(dict.fromkeys([platforms] if isinstance(platforms, str) else platforms))
    for platform in chosen:
        if platform not in PLATFORMS:
            raise unknown("platform", platform, PLATFORMS, "of FMUs")
    stop_time = number("fmu", "stop_time", stop_time, above=0)
    tolerance = number("fmu", "tolerance", tolerance, above=0, below=1)
    model = read_model(diagram, params, initial_state, name, stop_time, tolerance)
    text = sources(model, version)
    code = sorted(file for file in text if file.endswith(".c"))
    text |= _headers(version)
    check_zig("an FMU is compiled")
    content = {"modelDescription.xml": description(model, version, token_of(text), code).encode()}
    content |= {f"sources/{file}": source.encode() for file, source in text.items()}
    if version == 3:
        content["sources/buildDescription.xml"] = build_description(model, code).encode()
    for file, library in libraries(text, model.name, version, chosen).items():
        content[f"binaries/{file}"] = library
    data = _zipped(content)
    return replace_file(path, lambda file: file.write(data))


def _headers(version: int) -> dict[str, str]:
    """Return the headers of FMI, which FMPy brings along."""
    spec = find_spec("fmpy")
    if spec is None or spec.origin is None:
        raise UsageError("an FMU has FMI's headers, which FMPy brings along, and it is not "
                         "installed: pip install 'nlctl[export]'")  # fmt: skip
    folder = Path(spec.origin).parent / "c-code"
    return {
        name: (folder / name).read_text(encoding="utf-8").replace("\r\n", "\n")
        for name in _HEADERS[version]
    }


def _zipped(content: Mapping[str, bytes]) -> bytes:
    """Return a zip file that depends on its content alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(content):
            entry = zipfile.ZipInfo(name, _BEGINNING)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            entry.create_system = 3
            archive.writestr(entry, content[name])
    return buffer.getvalue()
