"""A program in which every operation rounds alike, on a page and here.

Machine code may round a product and a sum once, where the processor can; WebAssembly cannot.  Here
both are rounded, and what has to be rounded once, reductions of angles and exponents by multiples
of a constant, is a product in two parts of which the first is exact.  exp, log and pow of step
control are written out: those of two C libraries differ in the last place.
"""

import re
from collections.abc import Callable

from ...native.codegen.ir.functions import LN2, applied, estrin
from ...native.codegen.ir.text import Body, Module, Value

_FUSED = re.compile(r"^declare .* @llvm\.(fma|fmuladd)\.(?:v(\d+))?f64\(.*\n?", re.MULTILINE)
_SPLIT = 2.0**27 + 1.0
_ROOT_HALF = 4604544271217802189  # bits of sqrt(1 / 2)
_LOG = [1.0 / (2 * k + 1) for k in range(12)]  # artanh(s) / s in s^2


def rounding_alike(text: str) -> str:
    """Return the IR of a program, with every product and every sum rounded."""
    text = text.replace("preserve_allcc ", "")  # x86 alone has it
    text = re.sub(r"\bcontract ", "", text)
    module = Module(inlined=True)
    for name, width in _FUSED.findall(text):
        make = _in_two_parts if name == "fma" else _product_and_sum
        _enter(module, name, make, 3, int(width or 0))
    return _with_functions(_FUSED.sub("", text), "fma|fmuladd", module)


def integrators_alike(text: str) -> str:
    """Return the IR of the integrators with functions of their own for step control."""
    text = re.sub(r"^declare .*@llvm\.(exp|log|pow)\.f64\(.*\n", "", text, flags=re.MULTILINE)
    module = Module(inlined=False)
    _enter(module, "pow", _pow, 2)  # with exp and log
    return rounding_alike(_with_functions(text, "exp|log|pow", module))


def _enter(
    module: Module, name: str, make: Callable[..., tuple[Value]], count: int, width: int = 0
) -> None:
    """Write a function of so many arguments, with what it calls."""
    arguments = [Value(f"%x{i}", width) for i in range(count)]
    Body(module, portable=True).called(name, make, arguments, 1)


def _with_functions(text: str, names: str, module: Module) -> str:
    """Return IR that calls the functions of a module instead of LLVM's own."""
    text = re.sub(
        rf"@llvm\.({names})\.(?:v(\d+))?f64\(",
        lambda m: f"@nlctl.{m[1]}.{m[2] or 1}.portable(",
        text,
    )
    return "\n".join([text, *module.declared, *module.functions.values()])


def _product_and_sum(b: Body, x: Value, y: Value, z: Value) -> tuple[Value]:
    return (b.add(b.mul(x, y), z),)


def _in_two_parts(b: Body, x: Value, y: Value, z: Value) -> tuple[Value]:
    """Return x y + z, with y in two parts (T. J. Dekker, Numerische Mathematik 18:224, 1971)."""
    scaled = b.mul(y, _SPLIT)
    high = b.sub(scaled, b.sub(scaled, y))
    return (b.add(b.add(z, b.mul(x, high)), b.mul(x, b.sub(y, high))),)


def _log(b: Body, x: Value) -> tuple[Value]:
    """Return ln x = n ln 2 + 2 artanh((m - 1) / (m + 1)), of what is finite and not too small."""
    bits = b.bits(x)
    n = b.integer("ashr", b.integer("sub", bits, _ROOT_HALF), 52)
    m = b.real(b.logic("sub", bits, b.integer("shl", n, 52)))
    s = b.op("fdiv", b.sub(m, 1.0), b.add(m, 1.0))
    rest = b.mul(b.mul(s, 2.0), estrin(b, _LOG, b.mul(s, s)))
    log = b.add(b.mul(b.new(f"sitofp {n} to double"), LN2[0]), rest)
    return (b.add(log, b.sub(x, x)),)  # NaN stays


def _pow(b: Body, x: Value, y: Value) -> tuple[Value]:
    """Return x^y of x >= 0."""
    (log,) = b.called("log", _log, [x], 1)
    power = applied(b, "exp", b.mul(log, y))
    at_zero = b.select(b.compare("olt", y, 0.0), float("inf"), 0.0)
    return (b.select(b.compare("oeq", x, 0.0), at_zero, power),)
