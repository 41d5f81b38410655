"""The value of a formula: a reader of the LaTeX that nlctl writes, with its own rules."""

import math
import re

import numpy as np
from scipy import special

FUNCTIONS = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "tanh": np.tanh, "sinh": np.sinh,
    "cosh": np.cosh, "ln": np.log, "arcsin": np.arcsin, "arccos": np.arccos,
    "arctan": np.arctan, "exp": np.exp,
}  # fmt: skip
NAMED = {"sgn": np.sign, "arsinh": np.arcsinh, "arcosh": np.arccosh, "artanh": np.arctanh,
         "trunc": np.trunc, "round": np.rint, "atan2": np.arctan2, "fmod": np.fmod,
         "erf": special.erf, "erfc": special.erfc}  # fmt: skip
OPEN = (r"\operatorname", r"\log", *(rf"\{name} " for name in FUNCTIONS))
RELATIONS = {"<": "__lt__", r"\le": "__le__", ">": "__gt__", r"\ge": "__ge__",
             "=": "__eq__", r"\ne": "__ne__"}  # fmt: skip


class Reader:
    """Reads one formula from left to right; `symbols` are the values of symbols."""

    def __init__(self, text, symbols):
        self.text, self.symbols = text.strip(), symbols
        self.order = sorted(symbols, key=len, reverse=True)

    def skip(self):
        self.text = re.sub(r"^(\s|\\,)+", "", self.text)

    def take(self, start):
        self.skip()
        if self.text.startswith(start):
            self.text = self.text[len(start) :]
            return True
        return False

    def need(self, start):
        assert self.take(start), f"expected {start} before {self.text!r}"

    def total(self):
        """A sum of products."""
        sign = -1.0 if self.take("-") else 1.0
        value = sign * self.product()
        while True:
            if self.take("+"):
                value = value + self.product()
            elif self.take("-"):
                value = value - self.product()
            else:
                return value

    def product(self):
        value = self.power()
        while True:
            self.skip()
            if self.take(r"\cdot"):
                value = value * self.power()
            elif self.take(r"\bmod"):
                value = np.remainder(value, self.product())
            elif self.begins():
                value = value * self.power()
            else:
                return value

    def operand(self):
        """What a function has that stands without brackets: all up to the next function."""
        if self.text.startswith(r"\left("):
            return self.atom()
        value = self.power()
        while True:
            self.skip()
            if not self.begins() or self.text.startswith(OPEN):
                return value
            value = value * self.power()

    def begins(self):
        closing = (r"\right", r"\end", r"\\", r"\le", r"\ge", r"\ne", r"\text", r"\quad")
        if self.text.startswith((r"\left", r"\ln")):
            return True
        return bool(self.text) and not self.text.startswith((*closing, *"+-,)}&<>=|"))

    def power(self):
        base = self.atom()
        return np.power(base, self.braced()) if self.take("^") else base

    def braced(self):
        self.need("{")
        value = self.total()
        self.need("}")
        return value

    def atom(self):
        self.skip()
        for name in self.order:
            rest = self.text[len(name) :]
            if self.text.startswith(name) and not re.match(r"_|[a-zA-Z]", rest):
                self.text = rest
                return self.symbols[name]
        number = re.match(r"\d+(\.\d+)?", self.text)
        if number:
            self.text = self.text[number.end() :]
            return float(number[0])
        if self.take(r"\frac"):
            return np.divide(self.braced(), self.braced())
        if self.take(r"\sqrt[3]"):
            return np.cbrt(self.braced())
        if self.take(r"\sqrt"):
            return np.sqrt(self.braced())
        for opening, closing, function in (
            ("(", ")", float), ("|", "|", abs),
            (r"\lfloor", r"\rfloor", np.floor), (r"\lceil", r"\rceil", np.ceil),
        ):  # fmt: skip
            if self.take(rf"\left{opening}"):
                value = self.total()
                self.need(rf"\right{closing}")
                return function(value)
        if self.take(r"\begin{cases}"):
            return self.cases()
        if self.take(r"\infty"):
            return math.inf
        if self.take(r"\mathrm{NaN}"):
            return math.nan
        if self.take(r"\pi"):
            return math.pi
        if re.match(r"e\^", self.text):
            self.text = self.text[1:]
            return math.e
        return self.function()

    def function(self):
        for name, extreme in ((r"\min", np.minimum), (r"\max", np.maximum)):
            if self.take(name):
                return extreme(*self.arguments())
        for base in ("2", "{10}"):
            if self.take(rf"\log_{base}"):
                return np.log(self.operand()) / np.log(float(base.strip("{}")))
        found = re.match(r"\\operatorname\{(\w+)\}", self.text)
        if found:
            self.text = self.text[found.end() :]
            if found[1] == "H":  # its index is the value at 0
                self.need("_")
                at_0 = self.braced()
                return np.heaviside(self.atom(), at_0)
            two = found[1] in ("atan2", "fmod")
            return NAMED[found[1]](*(self.arguments() if two else [self.operand()]))
        found = re.match(r"\\([a-z]+)", self.text)
        assert found is not None, self.text
        assert found[1] in FUNCTIONS, self.text
        self.text = self.text[found.end() :]
        return FUNCTIONS[found[1]](self.operand())

    def arguments(self):
        self.need(r"\left(")
        first = self.total()
        self.need(",")
        second = self.total()
        self.need(r"\right)")
        return first, second

    def cases(self):
        chosen = None
        while not self.take(r"\end{cases}"):
            with np.errstate(all="ignore"):
                value = self.number_or_truth("&")
            self.need("&")
            holds = self.take(r"\text{otherwise}") or self.condition()
            chosen = value if chosen is None and holds else chosen
            self.take(r"\\")
        self.skip()
        ends = (r"\right", r"\end", r"\\", "}", "&", ",")
        assert not self.text or self.text.startswith(ends), "nothing may follow a list of cases"
        return chosen

    def number_or_truth(self, end):
        """A sum, or a condition, which ends where `end` follows."""
        before = self.text
        try:
            value = self.total()
            self.skip()
            if self.text.startswith(end) and bool(self.text) == bool(end):
                return value
        except AssertionError:
            pass
        self.text = before
        return self.condition()

    def condition(self):
        value = self.comparison()
        while True:
            if self.take(r"\text{ and }"):
                value = self.comparison() and value
            elif self.take(r"\text{ or }"):
                value = self.comparison() or value
            elif self.take(r"\text{ xor }"):
                value = self.comparison() != value
            else:
                return value

    def comparison(self):
        if self.take(r"\text{not }"):
            return not self.comparison()
        if self.take(r"\left("):
            before = self.text
            try:
                value = self.condition()
                self.need(r"\right)")
                number = (*RELATIONS, r"\bmod", "+", "-", "^")  # is made of what is in brackets
                self.skip()
                if not self.text.startswith(number) and not self.begins():
                    return value
            except AssertionError:
                pass
            self.text = rf"\left({before}"
        low, holds = self.total(), None
        for _ in range(2):
            self.skip()
            sign = next((r for r in RELATIONS if self.text.startswith(r)), None)
            if sign is None:
                break
            self.need(sign)
            high = self.total()
            holds = holds is not False and bool(getattr(np.float64(low), RELATIONS[sign])(high))
            low = high
        return bool(low) if holds is None else holds


def value(text, symbols):
    """Return the value of a formula."""
    reader = Reader(text, symbols)
    found = reader.number_or_truth("")
    reader.skip()
    assert not reader.text, f"left over: {reader.text!r} of {text!r}"
    return float(found)


def values(equations, where, symbols):
    """Return the values of the left sides of equations, by symbol."""
    symbols = dict(symbols)
    for line in reversed(where):  # what is used comes later
        name, _, right = line.partition(" = ")
        symbols[name] = value(right, symbols)
    pairs = [line.partition(" = ") for line in equations]
    return {name: value(right, symbols) for name, _, right in pairs}
