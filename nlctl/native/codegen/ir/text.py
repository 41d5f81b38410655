"""LLVM IR as text: values with their types, and the instructions that make new ones.

Every number of a diagram is one value: a ``double``, or a vector of as many as there are members
of a batch or elements in a turn of a loop.  Text is written directly: objects for each
instruction would take ten times as long as all the rest.
"""

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

_KINDS = {"f": "double", "b": "i1", "i": "i64", "p": "ptr"}
RARELY = "!prof !0"  # the first way of a branch is all but never taken


@dataclass(frozen=True)
class Value:
    """A value of a function."""

    text: str  # its name, or a constant
    width: int  # number of elements, 0 for what is not a vector
    kind: str = "f"  # ``"f"`` float, ``"b"`` truth value, ``"i"`` integer, ``"p"`` pointer

    @property
    def type(self) -> str:
        """LLVM's name of its type."""
        return llvm_type(self.width, self.kind)

    def __str__(self) -> str:
        return f"{self.type} {self.text}"


def llvm_type(width: int, kind: str = "f") -> str:
    """Return LLVM's name of a type."""
    return f"<{width} x {_KINDS[kind]}>" if width else _KINDS[kind]


def float_text(x: float) -> str:
    """Return a float bit by bit."""
    return "0x" + struct.pack(">d", x).hex().upper()


def constant(x: float | bool | int, width: int = 0, kind: str = "f") -> Value:
    """Return a constant, repeated in every element."""
    text = {"f": float_text, "b": lambda v: str(v).lower(), "i": str}[kind](x)
    one = Value(text, 0, kind)
    return Value(f"splat ({one})", width, kind) if width else one


@dataclass(kw_only=True)
class Module:
    """Functions that are compiled together."""

    inlined: bool  # whether small functions become part of those that call them
    # text of what is declared, constants by name, and text of functions by name, in the order in
    # which they were needed
    declared: dict[str, None] = field(default_factory=dict)
    tables: dict[tuple[float, ...], str] = field(default_factory=dict)
    functions: dict[str, str] = field(default_factory=dict)

    def table(self, values: tuple[float, ...]) -> str:
        """Return the name of an array of constants."""
        return self.tables.setdefault(values, f"@table{len(self.tables)}")

    def text(self) -> str:
        """Return all of it."""
        tables = []
        for values, name in self.tables.items():
            inside = ", ".join(f"double {float_text(v)}" for v in values)
            tables.append(
                f"{name} = private constant [{len(values)} x double] [{inside}], align 32"
            )
        weights = '!0 = !{!"branch_weights", i32 1, i32 100000}\n'
        return "\n".join([*self.declared, *tables, "", *self.functions.values(), weights])


def pointers(names: Iterable[str]) -> str:
    """Return the arguments of a function of addresses, of which no two overlap."""
    return ", ".join(f"ptr noalias %{name}" for name in names)


Operand = Value | float


class Body:
    """The instructions of one function, and what writes the next one."""

    # Arithmetic may be contracted: a product and a sum become one instruction that rounds once.
    # Where ``exact`` is given it is not.  A float next to a vector is meant in every element.
    # What is `portable` rounds in the same way on every processor, and whatever else a function
    # computes: nothing is contracted, what may be rounded once is, and each sine has a polynomial
    # of its own.
    def __init__(self, module: Module, portable: bool = False) -> None:
        self.module, self.portable = module, portable
        self.lines: list[str] = []
        self.block = "entry"
        self._count = self._labels = 0

    def text(self) -> str:
        """Return the instructions, one a line."""
        return "".join(f"{line}\n" if line.endswith(":") else f"  {line}\n" for line in self.lines)

    def function(self, name: str, given: str, linkage: str = "", how: str = "") -> str:
        """Return the text of a function without a result, whose instructions these are."""
        self.write("ret void")
        head = f"define {linkage}void @{name}({given}) {how}nounwind"
        return f"{head} {{\nentry:\n{self.text()}}}\n"

    def write(self, text: str) -> None:
        """Add an instruction without a result."""
        self.lines.append(text)

    def note(self, text: str) -> None:
        """Add a comment."""
        self.lines.append(f"; {text}")

    def new(self, text: str, width: int = 0, kind: str = "f") -> Value:
        """Add an instruction, and return its result."""
        self._count += 1
        name = f"%v{self._count}"
        self.lines.append(f"{name} = {text}")
        return Value(name, width, kind)

    def literal(self, x: float | bool | int, width: int = 0, kind: str = "f") -> Value:
        """Return a constant, repeated in every element."""
        return constant(x, width, kind)

    # -- elements

    def wide(self, v: Operand, width: int) -> Value:
        """Repeat a number in every element."""
        if not isinstance(v, Value):
            return constant(v, width)
        if v.width == width:
            return v
        one, whole = llvm_type(width, v.kind), f"<{width} x i32> zeroinitializer"
        first = self.new(f"insertelement {one} poison, {v}, i64 0")
        return self.new(f"shufflevector {one} {first.text}, {one} poison, {whole}", width, v.kind)

    def same(self, *values: Operand) -> list[Value]:
        """Return values as vectors of one width."""
        width = max((v.width for v in values if isinstance(v, Value)), default=0)
        return [self.wide(v, width) for v in values]

    def element(self, v: Value, i: int) -> Value:
        """Return one element."""
        return self.new(f"extractelement {v}, i64 {i}", 0, v.kind)

    def gathered(self, values: Sequence[Value], width: int) -> Value:
        """Return numbers as one vector; the last is repeated where there are too few."""
        kind = values[0].kind
        last = Value("poison", width, kind)
        for i in range(width):
            one = values[min(i, len(values) - 1)]
            last = self.new(f"insertelement {last}, {one}, i64 {i}", width, kind)
        return last

    def shuffled(self, a: Value, b: Value, order: Sequence[int]) -> Value:
        """Return a vector of elements of two others."""
        mask = ", ".join(f"i32 {i}" for i in order)
        width = len(order)
        return self.new(f"shufflevector {a}, {b}, <{width} x i32> <{mask}>", width, a.kind)

    def halved(self, v: Value, join: Callable[[Value, Value], Value]) -> Value:
        """Return what is left of a vector whose halves are joined again and again."""
        width = v.width
        while width > 1:
            width //= 2
            low, high = (
                self.shuffled(v, Value("poison", v.width), range(k, k + width)) for k in (0, width)
            )
            v = join(low, high)
        return self.element(v, 0)

    # -- arithmetic

    def op(self, name: str, a: Operand, b: Operand, *, exact: bool = False) -> Value:
        """Return ``fadd``, ``fsub``, ``fmul`` or ``fdiv`` of two values."""
        x, y = self.same(a, b)
        how = "" if exact or self.portable else "contract "
        return self.new(f"{name} {how}{x}, {y.text}", x.width)

    def add(self, a: Operand, b: Operand, *, exact: bool = False) -> Value:
        return self.op("fadd", a, b, exact=exact)

    def sub(self, a: Operand, b: Operand, *, exact: bool = False) -> Value:
        return self.op("fsub", a, b, exact=exact)

    def mul(self, a: Operand, b: Operand, *, exact: bool = False) -> Value:
        return self.op("fmul", a, b, exact=exact)

    def neg(self, a: Value) -> Value:
        return self.new(f"fneg {a}", a.width)

    def fma(self, a: Operand, b: Operand, c: Operand) -> Value:
        """Return a b + c, rounded once on every processor."""
        return self.intrinsic("fma", a, b, c)

    def muladd(self, a: Operand, b: Operand, c: Operand) -> Value:
        """Return a b + c, rounded once where that is fast, or everywhere."""
        return self.intrinsic("fma" if self.portable else "fmuladd", a, b, c)

    def intrinsic(self, name: str, *values: Operand) -> Value:
        """Call one of LLVM's own functions of floats."""
        args = self.same(*values)
        kind, width = args[0].type, args[0].width
        full = f"@llvm.{name}.{f'v{width}f64' if width else 'f64'}"
        self.module.declared[f"declare {kind} {full}({', '.join([kind] * len(args))})"] = None
        return self.new(f"call {kind} {full}({', '.join(map(str, args))})", width)

    def each(self, name: str, *values: Value) -> Value:
        """Call a function of the C library for every element."""
        args = self.same(*values)
        width = args[0].width
        self.module.declared[f"declare double @{name}({', '.join(['double'] * len(args))})"] = None

        def one(parts: Sequence[Value]) -> Value:
            return self.new(f"call double @{name}({', '.join(map(str, parts))})")

        if not width:
            return one(args)
        return self.gathered([one([self.element(a, i) for a in args]) for i in range(width)], width)

    # -- truth values and bits

    def compare(self, how: str, a: Operand, b: Operand) -> Value:
        x, y = self.same(a, b)
        return self.new(f"fcmp {how} {x}, {y.text}", x.width, "b")

    def select(self, condition: Value, a: Operand, b: Operand) -> Value:
        """Return `a` where a condition holds, otherwise `b`."""
        width = max(v.width for v in (condition, a, b) if isinstance(v, Value))
        c, x, y = (self.wide(v, width) for v in (condition, a, b))
        return self.new(f"select {c}, {x}, {y}", width, x.kind)

    def logic(self, name: str, a: Value, b: Value) -> Value:
        """Return ``and``, ``or``, ``xor`` bit by bit; ``add``, ``sub``, ``mul`` of integers."""
        x, y = self.same(a, b)
        return self.new(f"{name} {x}, {y.text}", x.width, x.kind)

    def integer(self, name: str, a: Value, b: int) -> Value:
        """Return an operation on integers and a constant one."""
        return self.new(f"{name} {a}, {constant(b, a.width, 'i').text}", a.width, "i")

    def mask(self, c: Value) -> Value:
        """Return all bits where a condition holds, none elsewhere."""
        return self.new(f"sext {c} to {llvm_type(c.width, 'i')}", c.width, "i")

    def is_negative(self, a: Value) -> Value:
        """Return whether integers are below 0."""
        zero = "zeroinitializer" if a.width else "0"
        return self.new(f"icmp slt {a}, {zero}", a.width, "b")

    def bits(self, a: Value) -> Value:
        return self.new(f"bitcast {a} to {llvm_type(a.width, 'i')}", a.width, "i")

    def real(self, a: Value) -> Value:
        return self.new(f"bitcast {a} to {llvm_type(a.width)}", a.width)

    def any(self, c: Value) -> Value:
        """Return whether a condition holds for any element."""
        if not c.width:
            return c
        bits = self.new(f"bitcast {c} to i{c.width}")
        return self.new(f"icmp ne i{c.width} {bits.text}, 0", 0, "b")

    # -- functions of the module

    def called(
        self, name: str, make: Callable[..., tuple[Value, ...]], args: list[Value], count: int
    ) -> tuple[Value, ...]:
        """Call a function with some results, which `make` writes when it is first needed."""
        width = args[0].width
        full = f"@nlctl.{name}.{width or 1}{'.portable' if self.portable else ''}"
        kind = llvm_type(width)
        kind = f"{{{kind}, {kind}}}" if count == 2 else kind
        if full not in self.module.functions:
            self.module.functions[full] = ""  # before those that it calls
            self.module.functions[full] = self._defined(full, kind, make, args)
        result = self.new(f"call {kind} {full}({', '.join(map(str, args))})", width)
        if count == 1:
            return (result,)
        return tuple(
            self.new(f"extractvalue {kind} {result.text}, {i}", width) for i in range(count)
        )

    def _defined(self, full: str, kind: str, make: Callable[..., Any], args: list[Value]) -> str:
        """Return the text of a function."""
        inner = Body(self.module, self.portable)
        given = [Value(f"%x{i}", v.width, v.kind) for i, v in enumerate(args)]
        results = make(inner, *given)
        last = str(results[0])
        if len(results) > 1:
            last = f"{kind} poison"
            for i, v in enumerate(results):
                last = f"{kind} {inner.new(f'insertvalue {last}, {v}, {i}').text}"
        inner.write(f"ret {last}")
        how = "alwaysinline" if self.module.inlined else "noinline"
        taken = ", ".join(map(str, given))
        return (
            f"define internal {kind} {full}({taken}) {how} nounwind {{\nentry:\n{inner.text()}}}\n"
        )

    def routine(
        self, name: str, make: Callable[..., None], where: str, sizes: Sequence[int], step: int
    ) -> None:
        """Call a function of numbers in memory, each so many behind the one before."""
        full = f"nlctl.{name}.{step}{'.portable' if self.portable else ''}"
        names = [f"i64 %n{i}" for i in range(len(sizes))]
        if full not in self.module.functions:
            inner = Body(self.module, self.portable)
            make(inner, step, *(Value(f"%n{i}", 0, "i") for i in range(len(sizes))))
            taken = ", ".join(["ptr %a", *names])
            self.module.functions[full] = inner.function(full, taken, "internal ", "noinline ")
        given = [f"ptr {where}", *(f"i64 {n}" for n in sizes)]
        self.write(f"call void @{full}({', '.join(given)})")

    def unless_larger(self, x: Value, limit: float, near: Mapping[str, Value]) -> tuple[Value, ...]:
        """Return values, but those of the C library where |x| is larger than a limit, as seldom."""
        far = self.any(self.compare("ogt", self.intrinsic("fabs", x), limit))
        here, rare, done = self.block, self.label("far"), self.label("near")
        self.write(f"br {far}, label %{rare}, label %{done}, {RARELY}")
        self.begin(rare)
        exact = [self._seldom(name, x, limit, y) for name, y in near.items()]
        self.write(f"br label %{done}")
        self.begin(done)
        return tuple(
            self.new(f"phi {y.type} [{y.text}, %{here}], [{e.text}, %{rare}]", y.width)
            for y, e in zip(near.values(), exact, strict=True)
        )

    def _seldom(self, name: str, x: Value, limit: float, y: Value) -> Value:
        """Call a function that is seldom called: it leaves all registers as they were."""
        full, kind = f"@nlctl.far.{name}.{x.width or 1}", llvm_type(x.width)
        if full not in self.module.functions:
            inner, (given, known) = Body(self.module), (Value("%x", x.width), Value("%y", x.width))
            is_far = inner.compare("ogt", inner.intrinsic("fabs", given), limit)
            value = inner.select(is_far, inner.each(name, given), known)
            self.module.functions[full] = (
                f"define internal preserve_allcc {kind} {full}({given}, {known}) "
                f"noinline cold nounwind {{\nentry:\n{inner.text()}  ret {value}\n}}\n"
            )
        return self.new(f"call preserve_allcc {kind} {full}({x}, {y})", x.width)

    # -- memory

    def address(self, array: str, at: int, index: str | None = None, step: int = 1) -> str:
        """Return the address of entry `at` of an array, or of ``index * step + at``."""
        if index is None:
            return self.moved(f"%{array}", at) if at else f"%{array}"
        scaled = self.new(f"mul i64 {index}, {step}").text if step != 1 else index
        moved = self.new(f"add i64 {scaled}, {at}").text if at else scaled
        return self.moved(f"%{array}", moved)

    def moved(self, where: str, by: int | str) -> str:
        """Return the address that is so many numbers behind another one."""
        return self.new(f"getelementptr double, ptr {where}, i64 {by}").text

    def load(self, where: str, width: int) -> Value:
        """Return the number, or as many as a vector has, at an address."""
        return self.new(f"load {llvm_type(width)}, ptr {where}, align 8", width)

    def store(self, value: Value, where: str, *, alone: bool = False) -> None:
        """Write a number or vector to an address; alone it is not merged with its neighbours."""
        self.write(f"store {'volatile ' if alone else ''}{value}, ptr {where}, align 8")

    # -- control

    def label(self, what: str) -> str:
        """Return a new name of a block."""
        self._labels += 1
        return f"{what}{self._labels}"

    def begin(self, block: str) -> None:
        """Begin a block."""
        self.lines.append(f"{block}:")
        self.block = block

    def counted(self, start: Value, end: Value, turn: Callable[[Value], None]) -> None:
        """Repeat what is written for each integer from `start` to before `end`."""
        is_any = self.new(f"icmp slt {start}, {end.text}", 0, "b")
        loop = Turns(self, [start], only_if=is_any.text)
        (index,) = loop.carried
        turn(index)
        following = self.new(f"add {index}, 1", 0, "i")
        more = self.new(f"icmp slt {following}, {end.text}", 0, "b")
        loop.end(more, [following])

    def when(self, condition: Value, then: Callable[[], None]) -> None:
        """Do what is written only where a condition holds."""
        inside, after = map(self.label, ("then", "end"))
        self.write(f"br {condition}, label %{inside}, label %{after}")
        self.begin(inside)
        then()
        self.write(f"br label %{after}")
        self.begin(after)

    def as_number(self, index: Value) -> Value:
        return self.new(f"uitofp {index} to double")

    def as_index(self, number: Value) -> Value:
        return self.new(f"fptoui {number} to i64", 0, "i")


class Turns:
    """A loop in IR, with what it carries from turn to turn, given as what that is at first."""

    def __init__(self, b: Body, first: Sequence[Value], only_if: str = "") -> None:
        self.b, self.first = b, first
        self.loop, self.after, self.before = b.label("turns"), b.label("after"), b.block
        otherwise = f"i1 {only_if}, label %{self.loop}, label %{self.after}"
        b.write(f"br {otherwise if only_if else f'label %{self.loop}'}")
        b.begin(self.loop)
        self._head = len(b.lines)
        b.lines += [""] * len(first)  # where the values come from is known at the end
        self.carried = [
            Value(f"%carried{i}.{self.loop}", v.width, v.kind) for i, v in enumerate(first)
        ]

    def end(self, more: Value, following: Sequence[Value]) -> None:
        """End a turn: whether there are more, and what is carried on."""
        rows = zip(self.carried, self.first, following, strict=True)
        for i, (value, first, new) in enumerate(rows, self._head):
            ways = f"[{first.text}, %{self.before}], [{new.text}, %{self.b.block}]"
            self.b.lines[i] = f"{value.text} = phi {value.type} {ways}"
        self.b.write(f"br i1 {more.text}, label %{self.loop}, label %{self.after}")
        self.b.begin(self.after)
