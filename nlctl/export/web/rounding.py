"""A program in which every operation rounds alike, on a page and here.

Machine code may round a product and a sum once, where the processor can; WebAssembly cannot.  Here
both are rounded, and what has to be rounded once, reductions of angles and exponents by multiples
of a constant, is a product in two parts of which the first is exact.  exp, log and pow of step
control are written out: those of two C libraries differ in the last place.
"""

from __future__ import annotations

import re
import struct

_FUSED = re.compile(r"^declare (<\d+ x double>|double) @llvm\.(fma|fmuladd)\.(\w+)\(.*\n?", re.M)
_SCALE = "0x41A0000002000000"  # 2^27 + 1


def rounding_alike(text: str) -> str:
    """Return the IR of a program, with every product and every sum rounded."""
    text = text.replace("preserve_allcc ", "")  # x86 alone has it
    text = re.sub(r"\bcontract ", "", text)
    found = [match.groups() for match in _FUSED.finditer(text)]
    text = _FUSED.sub("", text)
    for _, name, suffix in found:
        text = text.replace(f"@llvm.{name}.{suffix}(", f"@page.{name}.{suffix}(")
    return text + "".join(_written(*each) for each in found)


def _written(kind: str, name: str, suffix: str) -> str:
    """Return a product and a sum as a function."""
    arguments = f"{kind} %a, {kind} %b, {kind} %c"
    head = f"\ndefine internal {kind} @page.{name}.{suffix}({arguments}) alwaysinline nounwind {{\n"
    if name == "fmuladd":
        return f"{head}  %p = fmul {kind} %a, %b\n  %r = fadd {kind} %p, %c\n  ret {kind} %r\n}}\n"
    scale = f"double {_SCALE}"
    factor = scale.split()[1] if kind == "double" else f"splat ({scale})"
    return f"""{head}  %s = fmul {kind} %b, {factor}
  %d = fsub {kind} %s, %b
  %high = fsub {kind} %s, %d
  %low = fsub {kind} %b, %high
  %first = fmul {kind} %a, %high
  %sum = fadd {kind} %c, %first
  %second = fmul {kind} %a, %low
  %r = fadd {kind} %sum, %second
  ret {kind} %r
}}
"""


def integrators_alike(text: str) -> str:
    """Return the IR of the integrators with functions of their own for step control."""
    for name in ("exp", "log", "pow"):
        text = text.replace(f"@llvm.{name}.f64(", f"@page.{name}(")
    text = re.sub(r"^declare .*@page\.(exp|log|pow)\(.*\n", "", text, flags=re.MULTILINE)
    return text + _POWERS


def _horner(terms: list[float], x: str) -> str:
    """Return the lines of a polynomial, from its last coefficient on."""
    lines, value = [], repr(terms[-1])
    for k, term in enumerate(reversed(terms[:-1])):
        lines += [f"  %m{k} = fmul double {value}, {x}", f"  %n{k} = fadd double %m{k}, {term!r}"]
        value = f"%n{k}"
    return "\n".join([*lines, f"  %sum = fadd double {value}, 0.0"])


def _number(value: float) -> str:
    """Return a number as LLVM reads it exactly."""
    return "0x" + struct.pack(">d", value).hex().upper()


def _exact(text: str) -> str:
    """Return IR with decimal numbers bit by bit."""
    return re.sub(r"(?<=[ ,])-?\d+\.\d+(?:e-?\d+)?\b", lambda m: _number(float(m[0])), text)


def _factorials(count: int) -> list[float]:
    terms, value = [], 1.0
    for k in range(count):
        terms.append(value)
        value /= k + 1
    return terms


_POWERS = _exact(f"""
declare double @llvm.rint.f64(double)
declare i64 @llvm.fptosi.sat.i64.f64(double)

; of numbers that are finite and not too small: what step control takes
define internal double @page.log(double %x) nounwind {{
  %bits = bitcast double %x to i64
  %shifted = sub i64 %bits, 4604544271217802189
  %n = ashr i64 %shifted, 52
  %moved = shl i64 %n, 52
  %rest = sub i64 %bits, %moved
  %m = bitcast i64 %rest to double
  %up = fadd double %m, 1.0
  %down = fsub double %m, 1.0
  %s = fdiv double %down, %up
  %z = fmul double %s, %s
{_horner([1.0 / (2 * k + 1) for k in range(12)], "%z")}
  %two = fmul double %s, 2.0
  %of.m = fmul double %two, %sum
  %e = sitofp i64 %n to double
  %of.e = fmul double %e, 0.6931471805599453
  %q = fadd double %of.e, %of.m
  %gone = fsub double %x, %x
  %r = fadd double %q, %gone
  ret double %r
}}

define internal double @page.exp(double %x) nounwind {{
  %turns = fmul double %x, 1.4426950408889634
  %e = call double @llvm.rint.f64(double %turns)
  %back = fmul double %e, 0.6931471805599453
  %rest = fsub double %x, %back
{_horner(_factorials(15), "%rest")}
  %n = call i64 @llvm.fptosi.sat.i64.f64(double %e)
  %low = icmp slt i64 %n, -1000
  %not.low = select i1 %low, i64 -1000, i64 %n
  %high = icmp sgt i64 %not.low, 1000
  %some = select i1 %high, i64 1000, i64 %not.low
  %biased = add i64 %some, 1023
  %bits = shl i64 %biased, 52
  %power = bitcast i64 %bits to double
  %r = fmul double %sum, %power
  ret double %r
}}

define internal double @page.pow(double %x, double %y) nounwind {{
  %log = call double @page.log(double %x)
  %both = fmul double %log, %y
  %r = call double @page.exp(double %both)
  %none = fcmp oeq double %x, 0.0
  %sign = fcmp olt double %y, 0.0
  %ends = select i1 %sign, double 0x7FF0000000000000, double 0.0
  %s = select i1 %none, double %ends, double %r
  ret double %s
}}
""")
