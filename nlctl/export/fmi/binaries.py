"""Libraries of an FMU for Linux, Windows and macOS, compiled on one machine by Zig's C compiler."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from ..zig import zig


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
