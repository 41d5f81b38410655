"""What the file of a certificate holds, and the answer no."""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from .integers import Interval, exact_text

FORMAT = ["nlctl certificate", 1]
_RATIONAL = re.compile(r"-?\d{1,400}(/[1-9]\d{0,400})?\Z")


class Refuted(Exception):  # noqa: N818 (the answer no)
    """A line of the proof that does not hold.

    Examples
    --------
    See `recheck`.
    """


def need(holds: bool, line: str) -> None:
    """Answer no with a line of the proof that does not hold."""
    if not holds:
        raise Refuted(line)


def read_rational(text: Any) -> Fraction:
    """Return a rational number of the file."""
    need(isinstance(text, str) and bool(_RATIONAL.match(text)), f"{text!r} is not rational")
    return Fraction(text)


class Record:
    """A part of the file, from which everything is asked for by name and form."""

    def __init__(self, content: Any, where: str) -> None:
        need(isinstance(content, dict), f"{where} is not a record")
        self.content, self.where = content, where

    def __getitem__(self, name: str) -> Any:
        need(name in self.content, f"{self.where} has no {name}")
        return self.content[name]

    def record(self, name: str) -> "Record":
        """Return a record in this one."""
        return Record(self[name], name)

    def number(self, name: str) -> Fraction:
        """Return a number."""
        return read_rational(self[name])

    def positive(self, name: str) -> Fraction:
        """Return a number above 0."""
        number = read_rational(self[name])
        need(number > 0, f"{name} is not above 0")
        return number

    def not_negative(self, name: str) -> Fraction:
        """Return a number that is 0 or above."""
        number = read_rational(self[name])
        need(number >= 0, f"{name} is below 0")
        return number

    def numbers(self, name: str, count: int | None = None) -> list[Fraction]:
        """Return a list of numbers, `count` of them."""
        listed = self[name]
        need(
            isinstance(listed, list) and count in (None, len(listed)), f"{name} is of another size"
        )
        return [read_rational(text) for text in listed]

    def interval(self, name: str) -> Interval:
        """Return an interval from its two ends."""
        low, high = self.numbers(name, 2)
        need(low <= high, f"{name} is empty")
        return Interval.of(low, high)

    def listed(self, name: str) -> list[Any]:
        """Return a list of anything."""
        entries = self[name]
        need(isinstance(entries, list), f"{name} is not a list")
        return entries

    def states(self, name: str, count: int | None = None) -> list[str]:
        """Return names of states, `count` of them and none twice."""
        names = self.listed(name)
        need(all(isinstance(one, str) for one in names), f"{name} are not names")
        need(
            count in (None, len(names)) and len(set(names)) == len(names),
            f"{name} has other states",
        )
        return names


def begins(starts: Record, open_ended: bool = False) -> str:
    """Return in words from where a loop starts; what is not named starts at 0, or anywhere."""
    sides = {name: starts.interval(name) for name in starts.content}
    named = [
        f"{name}(0) = {exact_text(x.top)}"
        if x.low == x.high
        else f"{name}(0) in [{exact_text(x.bottom)}, {exact_text(x.top)}]"
        for name, x in sides.items()
        if x.low or x.high or open_ended
    ]
    rest = [] if open_ended else ["all other states 0" if named else "all states 0"]
    return ", ".join(named + rest)


def read_split(split: Record, u: Fraction) -> tuple[Fraction, Fraction, Fraction]:
    """Return k_1, k_2 and eps of an actuator, and check that they hold up to |u|."""
    k_1, k_2, eps = split.positive("k_1"), split.number("k_2"), split.not_negative("eps")
    need(k_1 <= k_2, "k_1 <= k_2")
    most = split["range"]
    need(most is None or u <= read_rational(most), f"|u| may reach {float(u):.6g}")
    return k_1, k_2, eps


def states_text(premise: Record, parts: Sequence[str]) -> str:
    """Return in words which states are what."""
    return ", ".join(f"{part}: {', '.join(premise.states(part)) or 'none'}" for part in parts)


def split_text(split: Record) -> str:
    """Return in words what the actuator is."""
    how_far = "all u" if split["range"] is None else f"|u| <= {exact_text(split.number('range'))}"
    k_1, k_2, eps = (exact_text(split.number(name)) for name in ("k_1", "k_2", "eps"))
    return f"v = k u + eps_u with {k_1} <= k <= {k_2}, |eps_u| <= {eps} for {how_far}"


def seal_of(content: Mapping[str, Any]) -> str:
    """Return the hash of all of a certificate but its own entry for it.

    Parameters
    ----------
    content : dict
        What the file holds.

    Returns
    -------
    str
        SHA-256 of the entries in order of their names, in hexadecimal digits.

    Examples
    --------
    See `recheck`.
    """
    rest = {name: value for name, value in content.items() if name != "seal"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()
