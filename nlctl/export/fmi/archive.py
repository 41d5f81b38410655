"""An FMU as a file: everything is made before a byte of it is written."""

import io
import os
import struct
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any

import control as ct
import jinja2
import numpy as np

from ... import native
from ..._version import __version__
from ...annotations import as_annotated
from ...arguments import RTOL, number
from ...diagrams import initial_state as state_of
from ...diagrams import supplied_blocks
from ...errors import CompileError, ParameterError, UsageError
from ...host.files import replace_file
from ...names import unknown
from ...native import Compiled
from ...native.diagram.program import clocks_at, slots_of_clocks
from ...native.floats import with_every_float
from ...native.timed.ahead import ahead
from ...sampling.clock import Clock, schedules
from ...sliding.relay import SLIDING
from ...wording import counted
from ..words import c_name, check_integers, check_written_out, refuse_if_any
from ..zig import check_zig, zig
from .source import sources, token_of
from .variables import Happenings, Model, all_variables, is_structured, value_references


@dataclass(frozen=True, kw_only=True)
class Platform:
    """A platform that libraries are compiled for."""

    targets: tuple[tuple[str, str], ...]  # Zig's name and FMI 3.0's name of each processor
    folder: str  # as FMI 2.0 calls it
    suffix: str  # of libraries


PLATFORMS: Mapping[str, Platform] = MappingProxyType({
    "linux": Platform(
        targets=(("x86_64-linux-gnu.2.17", "x86_64-linux"),), folder="linux64", suffix=".so"
    ),
    "windows": Platform(
        targets=(("x86_64-windows-gnu", "x86_64-windows"),), folder="win64", suffix=".dll"
    ),
    "macos": Platform(
        targets=(("x86_64-macos", "x86_64-darwin"), ("aarch64-macos", "aarch64-darwin")),
        folder="darwin64", suffix=".dylib",
    ),
})  # fmt: skip
"""Platforms by name."""

_COMMAND = ("-shared", "-fPIC", "-O2", "-g0", "-s", "-std=c99", "-fvisibility=hidden",
            "-ffp-contract=off", "-fno-math-errno", "-Wall", "-Wextra", "-Werror")  # fmt: skip
_PROCESSORS = {"x86_64": (0x01000007, 3), "aarch64": (0x0100000C, 0)}  # as Mach-O calls them
_PAGE = 14  # bits of an address in a page of macOS


def libraries(
    sources: Mapping[str, str], name: str, version: int, platforms: Sequence[str]
) -> dict[str, bytes]:
    """Return libraries by their paths below ``binaries``."""
    binaries = {}
    with tempfile.TemporaryDirectory() as folder:
        for file, text in sources.items():
            (Path(folder) / file).write_text(text, encoding="utf-8", newline="\n")
        for key in platforms:
            platform = PLATFORMS[key]
            compiled = {
                theirs: _compiled(folder, sources, name + platform.suffix, zig)
                for zig, theirs in platform.targets
            }
            if version == 2:
                whole = next(iter(compiled.values())) if len(compiled) == 1 else _united(compiled)
                compiled = {platform.folder: whole}
            binaries |= {f"{key}/{name}{platform.suffix}": code for key, code in compiled.items()}
    return binaries


def _compiled(folder: str, sources: Mapping[str, str], library: str, target: str) -> bytes:
    """Return a library for a processor and system."""
    code = sorted(file for file in sources if file.endswith(".c"))
    arguments = ["cc", "-target", target, *_COMMAND, "-I.", *code, "-o", library]
    arguments += [] if "windows" in target else ["-lm"]
    return zig(arguments, folder, library, f"ziglang did not compile {library} for {target}")


def _united(compiled: Mapping[str, bytes]) -> bytes:
    """Return one file for several processors: FMI 2.0 has one folder for all of macOS."""
    page = 1 << _PAGE
    header, parts, at = [struct.pack(">II", 0xCAFEBABE, len(compiled))], [], page
    for name, code in compiled.items():
        kind, variant = _PROCESSORS[name.partition("-")[0]]
        header.append(struct.pack(">IIIII", kind, variant, at, len(code), _PAGE))
        parts.append(code.ljust(-(-len(code) // page) * page, b"\0"))
        at += len(parts[-1])
    return b"".join(header).ljust(page, b"\0") + b"".join(parts)


_MOST_SERIES = 31  # of instants of samples: bits of a number


def read_model(
    diagram: Any,
    params: Mapping[str, Any] | None,
    initial_state: Mapping[str, float] | None,
    name: str | None,
    stop_time: float,
    tolerance: float,
) -> Model:
    """Return what an FMU of a diagram is made of."""
    compiled = with_every_float(native.compile(diagram))
    system, what, program = compiled.system, str(compiled.system.name), compiled.program
    p = compiled.parameter_vector(params)
    _check(compiled, what, p)
    start, lowered = state_of(system, initial_state), compiled.lowered
    check_integers(compiled, p, what)
    happenings = _happenings(compiled, p, stop_time, what)
    rows = lowered.rows
    at = value_references(rows["x"], rows["u"], rows["y"], rows["g"] + len(program.memory), p.size)
    fixed = _fixed(compiled)
    still = {*program.memory, *program.sampled}
    return Model(
        name=c_name(name, what), meaning=what,
        variables=tuple(all_variables(compiled, system, at, p, start, fixed)), places=at,
        continuous=tuple(i for i in range(rows["x"]) if i not in still), memory=program.memory,
        sampled=program.sampled, declared=program.switching, guards=program.guards,
        jumping=program.jumping, parameters=p, start=start, happenings=happenings,
        lowered=lowered, tolerance=tolerance, stop_time=stop_time,
    )  # fmt: skip


def _check(compiled: Compiled, what: str, p: np.ndarray) -> None:
    """Refuse what the C of an FMU cannot say."""
    check_written_out(compiled, what, p)
    is_continuous = ct.isctime(compiled.system)
    refuse_if_any(what, {
        "is in discrete time; put it into a diagram by nlctl.sampled": not is_continuous,
        "has transport delays": bool(compiled.schedule.lines),
    })  # fmt: skip
    for relay in supplied_blocks(compiled.system, SLIDING):
        raise CompileError(
            f"'{what}' cannot be exported: block '{relay.name}' is an ideal relay, whose sliding "
            "an importer does not know; nlctl.Relay has a hysteresis"
        )
    beyond = compiled.lowered.conditions.beyond
    refuse_if_any(what, {f"has {counted(beyond, 'condition')} more than are located": beyond > 0})


def _fixed(compiled: Compiled) -> set[int]:
    """Return the places of parameters that hold at export alone: of clocks, of instants, of loops.

    And those that steer which equations there are.
    """
    fixed = {*compiled.lowered.assumed, *compiled.lowered.timed.parameters.tolist()}
    clocks = slots_of_clocks(compiled.schedule, compiled.program)
    return fixed | {slot.offset for slots in clocks for slot in slots.values()}


def _happenings(compiled: Compiled, p: np.ndarray, stop_time: float, what: str) -> Happenings:
    """Return when something happens in it."""
    clocks = clocks_at(compiled.schedule, compiled.program, p)
    series, meetings = _series(clocks, compiled, what)
    timed = compiled.lowered.timed
    known = ahead(timed, p[:, None], np.array([0.0, stop_time]), np.inf)
    pairs = zip(known["until"][0].tolist(), known["jumps"][0].tolist(), strict=True)
    longest = float(known["longest"][0])
    reach = known["reach"][0]
    if reach.size:  # no step may pass over half of a pulse, wherever it begins
        begins = np.linspace(0.0, stop_time, reach.size + 1)[:-1]
        longest = min(longest, float(np.min(reach - begins)))
    return Happenings(
        series=series, meetings=meetings, breaks=tuple(pair for pair in pairs if pair[1] < np.inf),
        known_until=stop_time if timed.conditions.of_time else np.inf, longest=longest,
    )  # fmt: skip


def _series(
    clocks: Mapping[Any, Clock], compiled: Compiled, what: str
) -> tuple[tuple[tuple[int, int, int], ...], tuple[int, ...]]:
    """Return the instants of clocks, and of each meeting which of these meet."""
    for clock in clocks.values():
        if clock.jitter:
            raise CompileError(
                f"'{what}' cannot be exported: a clock has a jitter of {clock.jitter:g} s, random "
                "times that are the computer's; set it to 0"
            )
    series = schedules(clocks)
    largest = max((max(numbers) for numbers, _ in series), default=0)
    if len(series) > _MOST_SERIES or largest >= 2**40:
        raise CompileError(
            f"'{what}' cannot be exported: its clocks have instants in parts of 1/{largest} s, or "
            f"{len(series)} different ones, more than its C counts; round their times"
        )
    meetings = tuple(
        sum(1 << k for k, (_, together) in enumerate(series) if together <= meeting)
        for meeting in compiled.program.meetings
    )
    return tuple(numbers for numbers, _ in series), meetings


_BASE = {"s": 's="1"', "m": 'm="1"', "kg": 'kg="1"', "A": 'A="1"', "K": 'K="1"',
         "rad": 'rad="1"', "1/s": 's="-1"', "rad/s": 'rad="1" s="-1"', "m/s": 'm="1" s="-1"',
         "N": 'kg="1" m="1" s="-2"', "1": ""}  # fmt: skip


def description(model: Model, version: int, token: str, code: list[str]) -> str:
    """Return ``modelDescription.xml``; `code` are the files that are compiled."""
    return _rendered(
        f"modelDescription{version}.xml", model=model, token=token, code=code, tool=__version__,
        convention="structured" if is_structured(model.variables) else "flat",
        units={v.unit: _BASE.get(v.unit) for v in model.variables if v.unit},
        place={v.reference: i for i, v in enumerate(model.variables, start=1)},
        outputs=model.of("outputs"), rates=model.of("rates"), indicators=model.of("indicators"),
    )  # fmt: skip


def build_description(model: Model, code: list[str]) -> str:
    """Return ``buildDescription.xml`` of FMI 3.0."""
    return _rendered("buildDescription.xml", model=model, code=code)


def _rendered(template: str, **values: object) -> str:
    folder = files("nlctl.export.fmi") / "templates"
    templates = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    templates.filters["number"] = _number
    templates.tests["finite"] = np.isfinite
    text = (folder / f"{template}.j2").read_text(encoding="utf-8")
    return templates.from_string(text).render(**values)


def _number(value: float) -> str:
    return repr(float(value))


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
