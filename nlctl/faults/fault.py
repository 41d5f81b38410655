"""A fault: which signal, how it changes, and when."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from ..arguments import integer, number, text
from ..delays import TransportDelay
from ..errors import ParameterError
from ..names import unknown
from . import effects

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
NAME = r"[A-Za-z_][\w.]*(?:\[\d+\])?"
TEXT = re.compile(rf"\s*(\|?)\s*({NAME})\s*(\|?)\s*(>=?|<=?)\s*({NUMBER})\s*")


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A signal, or its magnitude, above or below a level."""

    signal: str
    level: float
    is_magnitude: bool
    is_below: bool


def parse_condition(text: str) -> Condition:
    """Read a condition such as ``|e| > 0.5``."""
    # ``>`` and ``>=`` say the same: the instant at which a signal reaches a level is that at which
    # it passes it.
    match = TEXT.fullmatch(text) if isinstance(text, str) else None
    if match is None or match[1] != match[3]:
        raise ParameterError(
            f"Fault needs a condition such as when='|e| > 0.5' or when='plant.y < -1', got {text!r}"
        )
    return Condition(
        signal=match[2], level=float(match[5]), is_magnitude=bool(match[1]),
        is_below=match[4].startswith("<"),
    )  # fmt: skip


FAULT_KINDS: Mapping[str, Any] = MappingProxyType({
    "stuck": effects.StuckAt,
    "bias": effects.Bias,
    "drift": effects.DriftFault,
    "gain": effects.LossOfEffectiveness,
    "noise": effects.Noise,
    "delay": effects.Late,
    "dropout": effects.Outage,
    "disconnection": effects.Outage,
})  # fmt: skip
"""The record of each kind; ``stuck`` without a value is `effects.LockInPlace`."""

NEEDS = {"bias": "offset", "drift": "rate in 1/s", "gain": "factor", "noise": "RMS",
         "delay": "time in s"}  # fmt: skip


@dataclass(frozen=True)
class Fault:
    """A fault on a signal, for `nlctl.with_faults`.

    Parameters
    ----------
    signal : str
        The signal: an output of a block or diagram, ``"actuator.v"``, for all that read it; an
        input of one, ``"controller.x1"``, for that reader alone; an input of the whole loop.
        Blocks of nested diagrams by their path, ``"controller.law.u"``.
    kind : str
        ``"stuck"`` at `value`, or without a value at that of the onset; ``"bias"``, signal +
        value; ``"drift"``, signal + value (t - onset); ``"gain"``, value times the signal;
        ``"noise"``, band-limited with the RMS value; ``"delay"``, the signal as it was value
        seconds before, 0 before the run; ``"dropout"``, 0 while it lasts;
        ``"disconnection"``, 0 for ever.
    value : float, optional
        In the unit of the signal, for drift per s; a gain has none; a delay in s.
    at : float, optional
        Time of the onset in s, at which the fault begins; with `when` the time before which it
        does not.
    until : float, optional
        Time in s at which it ends, for a fault that begins `at` a time; dropouts need it.
    when : str, optional
        Condition on a signal of the same diagram, ``"|e| > 0.5"`` or ``"plant.y < -1"``.  The
        fault begins when it is first met, and stays.
    mean_time : float, optional
        Mean of an exponential law in s: the onset is drawn from it, the same for the same `seed`.
    seed : int, optional
        Of `mean_time` and of noise.
    low, high : float, optional
        Band of noise in rad/s.
    name : str, optional
        Of the block, and the first part of its parameters' names; ``"fault_actuator_v"`` for
        ``"actuator.v"``.

    Raises
    ------
    UnknownNameError
        If there is no such kind.
    ParameterError
        If a number, the condition or the trigger does not fit the kind.

    Examples
    --------
    >>> half = nlctl.Fault("actuator.v", "gain", 0.5, at=10.0)
    >>> stuck = nlctl.Fault("plant.y", "stuck", when="|e| > 0.1")
    >>> dropout = nlctl.Fault("controller.x1", "dropout", at=5.0, until=5.5)
    >>> half.kind, half.at
    ('gain', 10.0)
    """

    signal: str
    kind: str
    value: float | None = None
    at: float | None = None
    until: float | None = None
    when: str | None = None
    mean_time: float | None = None
    seed: int = 0
    low: float = 0.0
    high: float = 50.0
    name: str | None = None

    def __post_init__(self) -> None:
        text("Fault", "signal", self.signal)
        if self.kind not in FAULT_KINDS:
            raise unknown("kind of fault", str(self.kind), FAULT_KINDS, f"on '{self.signal}'")
        self._check_value()
        self._check_trigger()
        self.effect  # noqa: B018 (it is checked where it is made)

    @property
    def _who(self) -> str:
        return f"Fault '{self.kind}' on '{self.signal}'"

    def _check_value(self) -> None:
        """A kind has a value, or none."""
        if self.value is not None:
            number(self._who, "value", self.value)
            if FAULT_KINDS[self.kind] is effects.Outage:
                raise ParameterError(f"{self._who} takes no value, it is 0, got {self.value!r}")
        elif self.kind in NEEDS:
            raise ParameterError(f"{self._who} needs a value, its {NEEDS[self.kind]}, got none")
        if self.kind == "delay":
            number(self._who, "value", self.value, above=0)
        integer(self._who, "seed", self.seed, at_least=0)

    def _check_trigger(self) -> None:
        """A fault begins at a time, by a condition or at random, and ends after it has begun."""
        given = [k for k in ("at", "mean_time") if getattr(self, k) is not None]
        if not given and self.when is None:
            raise ParameterError(f"{self._who} needs a time at=, a condition when= or a mean_time=")
        if len(given) > 1 or (self.mean_time is not None and self.when is not None):
            raise ParameterError(f"{self._who} needs one of at=, when= and mean_time=, got several")
        if self.at is not None:
            number(self._who, "at", self.at, at_least=0)
        if self.mean_time is not None:
            number(self._who, "mean_time", self.mean_time, above=0)
        if self.until is not None and (self.at is None or self.when is not None):
            raise ParameterError(f"{self._who} needs at= for the time until= which it lasts")
        if self.until is not None:
            number(self._who, "until", self.until)
            if not self.until > self.onset:
                raise ParameterError(
                    f"{self._who} needs until > at, got {self.until:g} s and {self.onset:g} s"
                )
        is_outage = FAULT_KINDS[self.kind] is effects.Outage
        if is_outage and (self.kind == "dropout") != (self.until is not None):
            what = "needs" if self.kind == "dropout" else "takes no"
            other = "disconnection" if self.kind == "dropout" else "dropout"
            raise ParameterError(
                f"{self._who} {what} until=, the time at which it ends; the other is a '{other}'"
            )

    @cached_property
    def onset(self) -> float:
        """Time in s before which it does not begin; drawn with the seed where that is random."""
        if self.mean_time is not None:
            return float(np.random.default_rng(self.seed).exponential(self.mean_time))
        return 0.0 if self.at is None else float(self.at)

    @cached_property
    def condition(self) -> Condition | None:
        """What begins it, where that is a condition."""
        return None if self.when is None else parse_condition(self.when)

    @cached_property
    def effect(self) -> Any:
        """The record of its block."""
        given: dict[str, Any] = {"onset": self.onset, "has_condition": self.condition is not None}
        if self.until is not None:
            given["duration"] = self.until - self.onset
        if self.value is not None and self.kind != "delay":
            given["value"] = self.value
        if self.kind == "noise":
            given |= {"low": self.low, "high": self.high, "seed": self.seed}
        remembers = self.kind == "stuck" and self.value is None
        record = effects.LockInPlace if remembers else FAULT_KINDS[self.kind]
        try:
            return record(**given)
        except ParameterError as error:
            raise ParameterError(f"{self._who}: {error}") from None

    @property
    def line(self) -> TransportDelay | None:
        """The record of the block that delays its signal."""
        if self.kind != "delay" or self.value is None:
            return None
        return TransportDelay(inputs=("signal",), outputs=("late",), delay=self.value)

    @property
    def latch(self) -> effects.Latch | None:
        """The record of the block that watches its condition."""
        if self.condition is None:
            return None
        c = self.condition
        return effects.Latch(level=c.level, is_magnitude=c.is_magnitude, is_below=c.is_below)
