"""C99 as text, by the methods by which LLVM IR is written: one statement for each instruction.

A function that is written by `ir.text.Body` is written by this class as well, number by number:
there is one definition of exp, sin and all others.  Nothing is contracted, what may be rounded once
is, by the C library's ``fma``; so the values are those of portable machine code.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..ir.text import Body, Module, Operand, Value

_TYPES = {"f": "double", "b": "int", "i": "uint64_t"}
_SIGNS = {"fadd": "+", "fsub": "-", "fmul": "*", "fdiv": "/"}
_COMPARED = {
    "olt": "{} < {}", "ole": "{} <= {}", "ogt": "{} > {}", "oge": "{} >= {}", "oeq": "{} == {}",
    "une": "{} != {}", "one": "islessgreater({}, {})", "uno": "isunordered({}, {})",
}  # fmt: skip
_LOGIC = {"and": "&&", "or": "||", "xor": "!="}
_BITS = {"and": "&", "or": "|", "xor": "^", "add": "+", "sub": "-", "mul": "*", "shl": "<<"}
_NAME = re.compile(r"\b[ve]\d+\b")
SUPPORT = """\
static uint64_t nlctl_bits(double x) { uint64_t y; memcpy(&y, &x, sizeof y); return y; }
static double nlctl_real(uint64_t x) { double y; memcpy(&y, &x, sizeof y); return y; }
"""


@dataclass(kw_only=True)
class CModule(Module):
    """Functions that are compiled together."""

    inlined: bool = False  # the C compiler says

    def table(self, values: tuple[float, ...]) -> str:
        """Return the name of an array of constants."""
        return self.tables.setdefault(values, f"table{len(self.tables)}")

    def text(self) -> str:
        """Return all of it."""
        tables = []
        for values, name in self.tables.items():
            numbers = ", ".join(map(c_number, values))
            tables.append(f"static const double {name}[{len(values)}] = {{{numbers}}};")
        body = "\n".join([*tables, *self.functions.values()])
        used = [
            line
            for line in SUPPORT.splitlines()
            if f"{line.partition('(')[0].split()[-1]}(" in body
        ]
        return "\n".join([*used, body])


def c_number(x: float) -> str:
    """Return a float that a C compiler reads bit by bit."""
    if math.isnan(x):
        return "NAN"
    if math.isinf(x):
        return "INFINITY" if x > 0 else "-INFINITY"
    return repr(float(x))


class CBody(Body):
    """The statements of one function; see `ir.text.Body` for the methods."""

    def __init__(self, module: Module, labels: Mapping[str, str] | None = None) -> None:
        super().__init__(module, portable=True)
        self.labels, self.indent = labels or {}, "  "
        self._named: dict[str, str] = {}
        self._hint = ""
        self._last = ""

    def text(self) -> str:
        """Return the statements, without those that nothing reads."""
        self.note("")
        lines = [_NAME.sub(lambda m: self._named.get(m[0], m[0]), line) for line in self.lines]
        return "".join(f"{line}\n" for line in _read(lines))

    def write(self, text: str) -> None:
        """Add a statement."""
        self.lines.append(f"{self.indent}{text}")

    def note(self, text: str) -> None:
        """Say what is computed next: its result takes that name."""
        if self._hint and self._last:
            self._named[self._last] = self._hint
        name, _, rest = text.partition(" = ")
        self._hint, self._last = (name if rest else ""), ""

    def new(self, text: str, width: int = 0, kind: str = "f") -> Value:
        """Add a variable."""
        self._count += 1
        self._last = f"v{self._count}"
        self.write(f"const {_TYPES[kind]} {self._last} = {text};")
        return Value(self._last, width, kind)

    def literal(self, x: float | bool | int, width: int = 0, kind: str = "f") -> Value:
        """Return a constant."""
        if kind == "f":
            return Value(c_number(float(x)), 0)
        return Value(str(int(x)) if kind == "b" else f"UINT64_C({int(x) % 2**64})", 0, kind)

    def wide(self, v: Operand, width: int) -> Value:
        return v if isinstance(v, Value) else self.literal(v)

    # -- arithmetic

    def op(self, name: str, a: Operand, b: Operand, *, exact: bool = False) -> Value:
        x, y = self.same(a, b)
        return self.new(f"{x.text} {_SIGNS[name]} {_after(y.text)}")

    def neg(self, a: Value) -> Value:
        return self.new(f"-{_after(a.text)}")

    def intrinsic(self, name: str, *values: Operand) -> Value:
        """Call a function of the C library that rounds alike everywhere."""
        return self.new(f"{name}({', '.join(v.text for v in self.same(*values))})")

    def each(self, name: str, *values: Value) -> Value:
        return self.intrinsic(name, *values)

    # -- truth values and bits

    def compare(self, how: str, a: Operand, b: Operand) -> Value:
        return self.new(_COMPARED[how].format(*(v.text for v in self.same(a, b))), kind="b")

    def select(self, condition: Value, a: Operand, b: Operand) -> Value:
        x, y = self.same(a, b)
        return self.new(f"{condition.text} ? {x.text} : {y.text}", kind=x.kind)

    def logic(self, name: str, a: Value, b: Value) -> Value:
        sign = (_LOGIC if a.kind == "b" else _BITS)[name]
        return self.new(f"{a.text} {sign} {b.text}", kind=a.kind)

    def integer(self, name: str, a: Value, b: int) -> Value:
        right = str(b) if name == "shl" else self.literal(b, 0, "i").text
        return self.new(f"{a.text} {_BITS[name]} {right}", kind="i")

    def mask(self, c: Value) -> Value:
        return self.new(f"{c.text} ? UINT64_MAX : UINT64_C(0)", kind="i")

    def is_negative(self, a: Value) -> Value:
        return self.new(f"({a.text} >> 63) != 0", kind="b")

    def bits(self, a: Value) -> Value:
        return self.new(f"nlctl_bits({a.text})", kind="i")

    def real(self, a: Value) -> Value:
        return self.new(f"nlctl_real({a.text})")

    # -- functions

    def called(
        self, name: str, make: Callable[..., tuple[Value, ...]], args: list[Value], count: int
    ) -> tuple[Value, ...]:
        """Call a function; a second result is written to its last argument."""
        full = f"nlctl_{name}"
        if full not in self.module.functions:
            inner = CBody(self.module)
            given = [Value(f"x{i}", 0) for i in range(len(args))]
            results = make(inner, *given)
            taken = [f"double {v.text}" for v in given]
            if count == 2:
                taken.append("double *second")
                inner.write(f"*second = {results[1].text};")
            inner.write(f"return {results[0].text};")
            text = f"static double {full}({', '.join(taken)})\n{{\n{inner.text()}}}\n"
            self.module.functions[full] = text  # behind those that it calls
        passed = [v.text for v in args]
        if count == 1:
            return (self.new(f"{full}({', '.join(passed)})"),)
        second = Value(f"second{self._count + 1}", 0)
        self.write(f"double {second.text};")
        return self.new(f"{full}({', '.join([*passed, f'&{second.text}'])})"), second

    def routine(
        self, name: str, make: Callable[..., None], where: str, sizes: Sequence[int], step: int
    ) -> None:
        """Call a function of numbers in memory."""
        full = f"nlctl_{name}"
        names = [f"n{i}" for i in range(len(sizes))]
        if full not in self.module.functions:
            inner = CBody(self.module)
            make(inner, step, *(Value(n, 0, "i") for n in names))
            taken = ", ".join(["double *a", *(f"uint64_t {n}" for n in names)])
            self.module.functions[full] = f"static void {full}({taken})\n{{\n{inner.text()}}}\n"
        self.write(f"{full}({', '.join([f'&{where}', *map(str, sizes)])});")

    def counted(self, start: Value, end: Value, turn: Callable[[Value], None]) -> None:
        self._count += 1
        k = f"k{self._count}"
        self.write(f"for (uint64_t {k} = {start.text}; {k} < {end.text}; ++{k}) {{")
        self._inside(lambda: turn(Value(k, 0, "i")))

    def when(self, condition: Value, then: Callable[[], None]) -> None:
        self.write(f"if ({condition.text}) {{")
        self._inside(then)

    def _inside(self, part: Callable[[], None]) -> None:
        self.indent += "  "
        part()
        self.indent = self.indent[:-2]
        self.write("}")

    def as_number(self, index: Value) -> Value:
        return self.new(f"(double){index.text}")

    def as_index(self, number: Value) -> Value:
        return self.new(f"(uint64_t){number.text}", kind="i")

    def unless_larger(self, x: Value, limit: float, near: Mapping[str, Value]) -> tuple[Value, ...]:
        far = self.compare("ogt", self.intrinsic("fabs", x), limit)
        return tuple(
            self.new(f"{far.text} ? {name}({x.text}) : {y.text}") for name, y in near.items()
        )

    # -- memory

    def address(self, array: str, at: int, index: str | None = None, step: int = 1) -> str:
        """Return the entry `at` of an array, or ``index * step + at``."""
        if index is None:
            return f"{array}[{at}]"
        scaled = f"{step} * {index}" if step != 1 else index
        return f"{array}[{at} + {scaled}]" if at else f"{array}[{scaled}]"

    def load(self, where: str, width: int) -> Value:
        self.note("")
        value = self.new(where)
        if where in self.labels:
            self.lines[-1] += f" /* {self.labels[where]} */"
        return value

    def store(self, value: Value, where: str, *, alone: bool = False) -> None:
        self.write(f"{where} = {value.text};")


def _after(text: str) -> str:
    """Return an operand that may stand behind a sign."""
    return f"({text})" if text.startswith("-") else text


_DECLARED = re.compile(r"\s*(?:const )?(?:double|int|uint64_t) (\w+)( =|;)")


def _read(lines: Sequence[str]) -> list[str]:
    """Return lines without variables that nothing reads."""
    kept: list[str] = []
    used: set[str] = set()
    for line in reversed(lines):
        declared = _DECLARED.match(line)
        if declared and declared[1] not in used:
            continue
        used.update(re.findall(r"[A-Za-z_]\w*", line.partition("/*")[0]))
        if declared:
            used.discard(declared[1])
        kept.append(line)
    return kept[::-1]
