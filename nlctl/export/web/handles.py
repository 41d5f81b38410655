"""What may be moved of a loop on a page: parameters, initial states, inputs, faults; by name."""

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...attributes import described_record
from ...diagrams import state_names
from ...diagrams.parameters import declared_rules
from ...errors import ParameterError, UsageError
from ...names import base_name, element_index, unknown
from ...native import Compiled
from ...native.diagram.parameters import Slot
from ...native.diagram.program import slots_of_clocks
from ...native.timed.ahead import ahead
from ...params import Param

_MOST = 8  # handles, where the author names none
_OF_STATES = 2
_FAULT = ("onset", "duration")  # what the record of every fault has
_CLOSE = 8192 / 2  # switches of functions of time in a run that a page distinguishes


@described_record(made_by="handles")
class Handle:
    """One number that a page moves."""

    # As ``nlctl simulate --set`` takes it: ``"plant.a"``, ``"plant.x1(0)"``; of an input its label.
    name: str
    kind: str  # ``"p"`` of a parameter, ``"x"`` of an initial state, ``"u"`` of an input.
    place: int  # Where it stands among all of its kind.
    value: float  # As reported, and the ends of its slider.
    low: float
    high: float
    unit: str = ""
    meaning: str = ""
    # Name of the block of a fault whose onset it is: a switch, which sets the onset to the value,
    # or to a time that no run reaches.
    fault: str = ""
    is_on: bool = False  # Whether that fault happens in the reported run.


def handles(
    compiled: Compiled,
    names: Sequence[str],
    p: np.ndarray,
    x0: np.ndarray,
    u: np.ndarray,
    span: tuple[float, float],
) -> tuple[Handle, ...]:
    """Return what the names stand for; a sensible few where there are none.

    Parameters
    ----------
    compiled : Compiled
        The diagram.
    names : sequence of str
        A name may have a range: ``"plant.a=0:3"``.  That of a fault's block stands for its onset
        and its value.
    p, x0 : ndarray
        Parameters and initial states of the reported run.
    u : ndarray of shape (inputs, m)
        Its inputs.
    span : tuple of 2 floats
        From when to when it goes (s).

    Returns
    -------
    tuple of Handle
        In the order of the names.

    Raises
    ------
    UnknownNameError
        If there is no such parameter, state, input or fault.
    ParameterError
        If it cannot be moved on a page: an integer, a choice, a sampling time, what other numbers
        follow from, a range that the block forbids.

    Examples
    --------
    >>> from nlctl.export.web import handles
    >>> loop = nlctl.paper.example_1()
    >>> compiled = nlctl.compile(loop)
    >>> x0, u = nlctl.initial_state(loop), np.zeros((0, 2))
    >>> (beta,) = handles(
    ...     compiled, ["controller.law.beta=1:4"], compiled.parameter_vector(), x0, u, (0, 20)
    ... )
    >>> beta.value, beta.low, beta.high
    (2.5, 1.0, 4.0)
    """
    reader = _Reader(compiled, p, x0, u, span)
    if not names:
        return tuple(reader.few())
    return tuple(dict.fromkeys(handle for name in names for handle in reader.named(name)))


class _Reader:
    """What there is to be moved of a loop."""

    def __init__(
        self,
        compiled: Compiled,
        p: np.ndarray,
        x0: np.ndarray,
        u: np.ndarray,
        span: tuple[float, float],
    ) -> None:
        self.compiled, self.p, self.x0, self.u, self.span = compiled, p, x0, u, span
        self.system = compiled.system
        self.slots: dict[str, Slot] = {
            slot.name: slot for block in compiled.program.layout.values() for slot in block.values()
        }
        self.rules = declared_rules(self.system)
        self.states = {f"{name}(0)": i for i, name in enumerate(state_names(self.system))}
        self.inputs: dict[str, int] = {
            label: i for i, label in enumerate(self.system.input_labels or ())
        }
        self.faults = [
            name
            for name in dict.fromkeys(n.rpartition(".")[0] for n in self.slots)
            if all(f"{name}.{field}" in self.slots for field in _FAULT)
        ]

    def few(self) -> Iterator[Handle]:
        """Return faults, a few initial states, and the first number of each block."""
        moved: dict[Handle, None] = {}
        for name in (*self.faults, *list(self.states)[:_OF_STATES], *self._firsts()):
            with contextlib.suppress(UsageError):  # not one that a page can move
                moved |= dict.fromkeys(self.named(name))
            if len(moved) >= _MOST:
                break
        return iter(moved)

    def _firsts(self) -> Iterator[str]:
        """Yield the first numbers of all blocks, then the second ones."""
        blocks: dict[str, list[str]] = {}
        for name, slot in self.slots.items():
            block = name.rpartition(".")[0]
            if not slot.shape and slot.kind == "f" and block not in self.faults:
                blocks.setdefault(block, []).append(name)
        for k in range(2):
            yield from (names[k] for names in blocks.values() if len(names) > k)

    def named(self, text: str) -> Iterator[Handle]:
        """Yield what one name stands for."""
        name, equals, ends = (part.strip() for part in text.partition("="))
        given = _range(text, ends) if equals else None
        if name in self.faults:
            yield from self._fault(name)
        elif name in self.states:
            yield self._state(name, given)
        elif name in self.inputs:
            yield self._input(name, given)
        else:
            yield self._parameter(name, given)

    def _fault(self, block: str) -> Iterator[Handle]:
        """Yield the onset of a fault, which is a switch, and its value."""
        onset = self._parameter(f"{block}.onset", (self.span[0], self.span[1]))
        happens = self.span[0] <= onset.value < self.span[1]
        middle = float(f"{self.span[0] + 0.25 * (self.span[1] - self.span[0]):.2g}")
        yield Handle(
            **vars(onset) | {
                "value": onset.value if happens else middle, "fault": block, "is_on": happens,
            }
        )  # fmt: skip
        if f"{block}.value" in self.slots:
            yield self._parameter(f"{block}.value", None)

    def _state(self, name: str, given: tuple[float, float] | None) -> Handle:
        place = self.states[name]
        value = float(self.x0[place])
        low, high = given or _around(value, 1.0)
        return Handle(
            name=name, kind="x", place=place, value=value, low=low, high=high,
            meaning="initial state",
        )  # fmt: skip

    def _input(self, name: str, given: tuple[float, float] | None) -> Handle:
        place = self.inputs[name]
        if np.ptp(self.u[place]):
            raise ParameterError(f"input '{name}' is not constant in this run: a slider moves one")
        value = float(self.u[place, 0])
        low, high = given or _around(value, 1.0)
        return Handle(
            name=name, kind="u", place=place, value=value, low=low, high=high, meaning="input"
        )

    def _parameter(self, name: str, given: tuple[float, float] | None) -> Handle:
        place, slot = self._place(name)
        base = slot.name
        if slot.kind != "f" or place in self.compiled.lowered.assumed:
            raise ParameterError(
                f"'{name}' is an integer or a choice, which a page does not move: name a number"
            )
        rule, value = self.rules.get(base), float(self.p[place])
        low, high = given or _within(_around(value), rule)
        self._check_moves(name, base, slot, place, (low, high))
        return Handle(
            name=name, kind="p", place=place, value=value, low=low, high=high,
            unit="" if rule is None or rule.unit == "1" else rule.unit,
            meaning="" if rule is None else rule.meaning,
        )  # fmt: skip

    def _place(self, name: str) -> tuple[int, Slot]:
        """Return where a number lies in the vector of parameters."""
        base = base_name(name)
        if base not in self.slots:
            every = [*self.slots, *self.states, *self.inputs, *self.faults]
            raise unknown("parameter, initial state, input or fault", name, every,
                          f"of '{self.system.name}'")  # fmt: skip
        slot = self.slots[base]
        index = element_index(name, slot.shape)
        return slot.offset + (int(np.ravel_multi_index(index, slot.shape)) if index else 0), slot

    def _check_moves(
        self, name: str, base: str, slot: Slot, place: int, ends: tuple[float, float]
    ) -> None:
        """Refuse a number by which another one of the program moves, or that rules forbid."""
        clocks = slots_of_clocks(self.compiled.schedule, self.compiled.program)
        if place in {slot.offset for slots in clocks for slot in slots.values()}:
            raise ParameterError(
                f"'{name}' says when samples are taken, which a page does not move"
            )
        self._check_switches(name, place)
        for value in ends:
            try:
                moved = self.compiled.parameter_vector({base: self._whole(slot, place, value)})
            except UsageError as error:
                raise ParameterError(
                    f"'{name}' cannot be moved to {value:g}: {error}: give a range, "
                    f"'{name}=LOW:HIGH'"
                ) from None
            expected = self.compiled.parameter_vector()
            expected[place] = value
            if not np.array_equal(moved, expected, equal_nan=True):
                raise ParameterError(
                    f"'{name}' cannot be moved on a page: other numbers of its block follow from "
                    "it, outside of its equations"
                )

    def _whole(self, slot: Slot, place: int, value: float) -> Any:
        """Return the value of a parameter with one of its numbers changed."""
        values = self.p[slot.offset : slot.offset + slot.size].copy()
        values[place - slot.offset] = value
        return values.reshape(slot.shape) if slot.shape else value

    def _check_switches(self, name: str, place: int) -> None:
        """Refuse what moves switches of functions of time that come too close for a page."""
        timed = self.compiled.lowered.timed
        if place not in set(timed.parameters.tolist()) or not timed.conditions.switches_of_time:
            return
        times = np.array(self.span)
        jumps = ahead(timed, self.p[:, None], times, np.inf)["jumps"][0]
        gaps = np.diff(jumps[np.isfinite(jumps)])
        if gaps.size and gaps.min() < (self.span[1] - self.span[0]) / _CLOSE:
            raise ParameterError(
                f"'{name}' moves switches of functions of time that come every {gaps.min():.3g} s, "
                "too close together for a page"
            )


def _around(value: float, least: float = 0.0) -> tuple[float, float]:
    """Return a range around a value: from 0 to twice the value, or to 1 on both sides of 0."""
    width = max(abs(value), least) or 1.0
    return value - width, value + width


def _within(ends: tuple[float, float], rule: Param | None) -> tuple[float, float]:
    """Return a range cut to the bounds of a parameter; a little is left to what is excluded."""
    if rule is None:
        return ends
    low, high = ends
    part = 0.01 * (high - low)
    (least, open_below), (most, open_above) = rule.ends
    return max(low, least + part * open_below), min(high, most - part * open_above)


def _range(text: str, ends: str) -> tuple[float, float]:
    """Return both ends of a range, ``"0:3"``."""
    try:
        low, high = (float(end) for end in ends.split(":"))
    except ValueError:
        raise ParameterError(f"a range is LOW:HIGH, as in 'plant.a=0:3', got '{text}'") from None
    if not (np.isfinite([low, high]).all() and low < high):
        raise ParameterError(f"a range needs numbers LOW < HIGH, got '{text}'")
    return low, high
