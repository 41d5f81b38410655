"""Object code and a linked program for WebAssembly: LLVM in a child process, the linker of Zig.

Records on the stack as on a machine of 64 bits, on one whose addresses have 32.

The integrators' bitcode has been simplified for 64 bits: where the parts of a record lie is written
into it as numbers of bytes.  So every record is made of parts of 64 bits here, and one that is
stored as a whole is stored part by part.
"""

import functools
import hashlib
import lzma
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import llvmlite.binding as llvm

from ...errors import CompileError
from ...native.integrators import INTEGRATORS
from ...native.machine import store
from ...native.machine.shipped import bitcode
from ..zig import check_zig, zig
from .rounding import integrators_alike

_ALLOCA = re.compile(r"= alloca ([^\n]*?), align 8")
_ADDRESS = re.compile(r"\bptr\b")
_STORE = re.compile(r"^  store (\{[^\n]*\}) (%[\w.$\"]+), ptr (%[\w.$\"]+), align \d+$", re.M)
_UNKNOWN = re.compile(r"getelementptr (?:inbounds )?(?:nuw )?(?:ptr|\{)|load \{[^\n]*ptr")
_SIZES = {"ptr": 8, "i64": 8, "double": 8, "i8": 1, "i1": 1}


def laid_out_as_here(text: str) -> str:
    """Return IR whose records lie on the stack as on a machine of 64 bits."""
    if unknown_record := _UNKNOWN.search(text):
        raise CompileError(f"the integrators' IR has what no page can hold: {unknown_record[0]}")
    text = _ALLOCA.sub(lambda m: _ADDRESS.sub("i64", m[0]), text)
    count = iter(range(len(text)))
    return _STORE.sub(lambda m: _parts_stored(m[1], m[2], m[3], next(count)), text)


def _parts_stored(kind: str, value: str, place: str, number: int) -> str:
    """Return the lines that store the parts of a record."""
    lines = []
    for k, (path, part, offset) in enumerate(_parts(kind)):
        name = f"%part.{number}.{k}"
        indices = ", ".join(map(str, path))
        lines += [
            f"  {name} = extractvalue {kind} {value}, {indices}",
            f"  {name}.at = getelementptr i8, ptr {place}, i64 {offset}",
            f"  store {part} {name}, ptr {name}.at, align 1",
        ]
    return "\n".join(lines)


def _parts(kind: str) -> Iterator[tuple[list[int], str, int]]:
    """Yield the parts of a record that are none: indices, type, place in bytes."""
    path, offset = [-1], 0
    for word in re.findall(r"[{}]|\[\d+ x \w+\]|\w+", kind[1:-1]):
        if word == "{":
            path[-1] += 1
            path.append(-1)
        elif word == "}":
            path.pop()
        else:
            path[-1] += 1
            repeated = re.fullmatch(r"\[(\d+) x (\w+)\]", word)
            size = _SIZES[repeated[2] if repeated else word]
            offset = -(-offset // size) * size
            for i in range(int(repeated[1]) if repeated else 1):
                yield [*path, *([i] if repeated else [])], repeated[2] if repeated else word, offset
                offset += size


OF_MATH = (
    "exp", "log", "log2", "log10", "log1p", "expm1", "sin", "cos", "tan", "sinh", "cosh", "asin",
    "acos", "atan", "asinh", "acosh", "atanh", "cbrt", "atan2", "hypot", "pow",
)  # fmt: skip
"""Functions of the C library that are JavaScript's ``Math``, by the same names."""
PROVIDED = frozenset({*OF_MATH, "fmod"})
_SCRIPT = Path(__file__).with_name("wasm_object.py")
_STACK = 1 << 20  # bytes
_SIZE = """
define internal {i64, i1} @size(i64 %a, i64 %b) alwaysinline nounwind {
  %product = mul i64 %a, %b
  %both = or i64 %a, %b
  %large = icmp ugt i64 %both, 2147483647
  %r = insertvalue {i64, i1} undef, i64 %product, 0
  %q = insertvalue {i64, i1} %r, i1 %large, 1
  ret {i64, i1} %q
}
"""  # of an array: products of 64 bits that may overflow call a function that is nowhere


def check_linker() -> None:
    """Refuse, before anything is computed, where there is no linker.

    Raises
    ------
    UsageError
        If Zig, which links WebAssembly, is not installed.

    Examples
    --------
    >>> from nlctl.export.web import check_linker
    >>> check_linker()  # doctest: +SKIP
    """
    check_zig("a page that runs is linked")


def linked(texts: Mapping[str, str], exports: Sequence[str], what: str) -> bytes:
    """Return modules of IR, by names of their own, and the integrators as a WebAssembly module."""
    check_linker()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "integrators.o").write_bytes(_integrators())
        objects = wasm_objects(texts, folder, what)
        arguments = [
            "wasm-ld", *(path.name for path in objects), "integrators.o", "-o", "page.wasm",
            "--no-entry", "--gc-sections", "--strip-all", "--allow-undefined", "--stack-first",
            "-z", f"stack-size={_STACK}", *(f"--export={name}" for name in exports),
        ]  # fmt: skip
        return zig(arguments, folder, "page.wasm", f"'{what}' cannot be linked for a page")


def wasm_objects(texts: Mapping[str, str], folder: Path, what: str) -> list[Path]:
    """Write object code of modules of IR; LLVM works in a child process, which it may end."""
    paths = [folder / f"{name}.ll" for name in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        path.write_text(text, encoding="utf-8")
    command = [sys.executable, str(_SCRIPT), *map(str, paths)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode:
        raise CompileError(f"LLVM makes no WebAssembly of '{what}': {_last(run.stderr)}")
    return [path.with_suffix(".o") for path in paths]


def _last(text: str) -> str:
    """Return the line of a message that says what is wrong."""
    lines = text.strip().splitlines() or ["no message"]
    return next((line for line in lines if "error" in line.lower()), lines[-1])


@functools.cache
def _integrators() -> bytes:
    """Return the integrators, from the cache of machine code if they are there."""
    text = integrators_text()
    key = hashlib.sha256(repr((_SCRIPT.read_bytes(), llvm.llvm_version_info, text)).encode())
    code = store.read(key.hexdigest())
    if code is None:
        with tempfile.TemporaryDirectory() as folder:
            texts = {"integrators": text}
            code = wasm_objects(texts, Path(folder), "the integrators")[0].read_bytes()
        store.write(key.hexdigest(), code)
    return code


@functools.cache
def integrators_text() -> str:
    """Return the integrators' IR for another machine than this one."""
    code = bitcode(INTEGRATORS)
    if code is None:
        raise CompileError(
            "a page that runs needs the integrators' bitcode that nlctl ships, which is not that "
            "of the sources here: python -m nlctl.native.ship"
        )
    text = str(llvm.parse_bitcode(lzma.decompress(code)))
    text = re.sub(r"^target (triple|datalayout) = .*\n", "", text, flags=re.MULTILINE)
    text = text.replace("@llvm.smul.with.overflow.i64", "@size")
    text = re.sub(r"^declare .*@size\(.*\n", _SIZE, text, flags=re.MULTILINE)
    return integrators_alike(laid_out_as_here(text))
