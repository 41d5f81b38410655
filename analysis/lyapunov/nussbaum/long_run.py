"""A loop far beyond the paper's 20 s: whether its gain loses its sign, and what predicted it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import control as ct
import numpy as np

from nlctl import native
from nlctl.attributes import described_record
from nlctl.response import input_output_response

from ..loop.roles import read_parts
from ..loop.signals import Signals, signals_of
from .property import Lobe, lobe_around
from .slow_drift import SlowDrift, slow_drift

Outcome = Literal["held", "failed", "open"]
REST_TOLERANCE = 0.01  # how far from the place that was forecast zeta may come to rest
_STILL = 0.1  # share of it by which zeta may move from one window to the next, at rest


def outcome(forecast: SlowDrift, time: np.ndarray, zeta: np.ndarray) -> Outcome:
    """Tell whether a run bore a forecast out; shapes: `time` (m,), `zeta` (m,)."""
    beyond = np.flatnonzero(zeta >= forecast.lobe.high)
    if forecast.rest is not None:
        return "failed" if beyond.size else _rest(forecast, forecast.rest, time, zeta)
    first, last = forecast.burst_range
    if not np.isfinite(forecast.burst):
        return "failed" if beyond.size else "open"
    if beyond.size:
        return "held" if first <= time[beyond[0]] <= last else "failed"
    return "failed" if time[-1] > last else "open"


def _rest(forecast: SlowDrift, place: float, time: np.ndarray, zeta: np.ndarray) -> Outcome:
    ends = time[-1] - forecast.window * np.arange(3)
    if not ends[-1] >= forecast.time:
        return "open"
    late, before = (
        float(np.mean(zeta[(time > a) & (time <= b)])) for a, b in ((ends[1], ends[0]), ends[:0:-1])
    )
    if late > place + REST_TOLERANCE:
        return "failed"
    still = abs(late - before) <= _STILL * REST_TOLERANCE
    return "held" if still and abs(late - place) <= REST_TOLERANCE else "open"


# From so many seconds of the run the rest is predicted, from windows of so many: whole periods of
# the paper's reference, which lasts 4 pi.
LOOKS = {200.0: 4 * np.pi, 1000.0: 16 * np.pi}
FINE, COARSE = (
    0.01,
    0.1,
)  # s; sampling interval up to the last look, which `slow_drift` needs, and beyond
END, _FINEST = 0.5, 1e-5  # s; how much of a burst is run again, and the sampling interval there
_STANDSTILL = 1e-5  # s; a burst has no end: a run that gets no further in 2000 steps is given up
LONG_RUN_SIGNALS = ("zeta", "e", "r", "u")


@described_record
class LongRun:
    """How a loop behaved over a long time."""

    loop: str  # Name of the diagram.
    horizon: float  # What was asked for (s), and the relative tolerance of the integrator.
    rtol: float
    # (m,): In s, up to the time that the run reached; not evenly spaced.
    time: np.ndarray = field(repr=False)
    signals: Mapping[str, np.ndarray] = field(repr=False)  # zeta, e, r and u over `time`.
    lobe: Lobe  # The lobe of the Nussbaum function that zeta starts in.
    predictions: tuple[SlowDrift, ...]  # Each made from the beginning of the run alone.
    # Time (s) at which the run was given up, because its steps shrank to nothing.
    lost: float | None
    # Relative tolerance and `burst` (s) of a second run, if there was one: what errors that add up
    # over hours make of it.
    again: tuple[float, float] | None = None
    # State of the loop at the end of `time`.
    last: tuple[float, ...] = field(default=(), repr=False)

    @property
    def burst(self) -> float:
        """Time (s) at which zeta leaves its lobe and N changes its sign; NaN if it never does."""
        zeta = self.signals["zeta"]
        beyond = np.flatnonzero(zeta >= self.lobe.high)
        if not beyond.size:
            return np.nan
        around = slice(max(beyond[0] - 1, 0), beyond[0] + 1)
        return float(np.interp(self.lobe.high, zeta[around], self.time[around]))

    @property
    def calm(self) -> float:
        """Largest |e| from 200 s until a second before the burst or the end; NaN if none."""
        end = self.time[-1] if np.isnan(self.burst) else self.burst - 1.0
        settled = np.abs(self.signals["e"][(self.time >= 200.0) & (self.time <= end)])
        return float(np.max(settled)) if settled.size else np.nan

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """The outcome of each prediction."""
        return tuple(outcome(p, self.time, self.signals["zeta"]) for p in self.predictions)

    def __str__(self) -> str:
        end, zeta = self.time[-1], self.signals["zeta"][-1]
        what = f"no burst, zeta ends at {zeta:.4g}"
        if np.isfinite(self.burst):
            what = f"zeta crosses {self.lobe.high:g} at {self.burst:.1f} s"
        lost = "" if self.lost is None else f"; steps shrink to nothing at {self.lost:.3f} s"
        if self.again is not None:
            lost += f"; at {self.again[1]:.1f} s at rtol {self.again[0]:g}"
        lines = [
            f"{self.loop} at rtol {self.rtol:g} over {end:.6g} s: {what}{lost}",
            f"max |e| before, from 200 s on: {self.calm:.3g}",
        ]
        for p, became in zip(self.predictions, self.outcomes, strict=True):
            rest = "" if p.rest is None else f", at rest at zeta = {p.rest:.4g}"
            burst = f", burst at {p.burst:.4g} s"
            lines.append(
                f"predicted after {p.time:g} s: {p.verdict}"
                + (burst if np.isfinite(p.burst) else rest)
                + f": {became}"
            )
        return "\n".join(lines)


def long_run(
    loop: ct.InterconnectedSystem,
    horizon: float = 9_600.0,
    *,
    rtol: float = 1e-6,
    start: Mapping[str, float] | None = None,
    progress: Callable[[float], object] | None = None,
) -> LongRun:
    """Run a loop with a Nussbaum law for hours of its time, and predict the end early on."""
    last = min(max(LOOKS), horizon)
    times = np.append(
        np.linspace(0.0, last, round(last / FINE) + 1),
        np.arange(1, round((horizon - last) / COARSE) + 1) * COARSE + last,
    )
    compiled, N = native.compile(loop), read_parts(loop).law.N
    settings: Any = {"rtol": rtol, "atol": rtol / 100, "ignore_errors": True}
    whole = _watched(compiled, times, start, progress, settings)
    time, signals = whole.time, _signals(whole)
    predictions = tuple(
        slow_drift(_until(look, time, signals), N, window=window)
        for look, window in LOOKS.items()
        if look <= last
    )
    lost, last = None, whole.states[:, -1]
    if not whole.success:
        i = max(int(np.searchsorted(time, whole.statistics.time - END)) - 1, 0)
        again = np.arange(time[i], whole.statistics.time + END, _FINEST)
        end = _watched(compiled, again, whole.states[:, i], progress, settings)
        late = _signals(end)
        time = np.append(time[:i], end.time)
        signals = {name: np.append(signals[name][:i], late[name]) for name in LONG_RUN_SIGNALS}
        lost, last = None if end.success else end.statistics.time, end.states[:, -1]
    return LongRun(
        loop=str(loop.name),
        horizon=horizon,
        rtol=rtol,
        time=time,
        signals=signals,
        lobe=lobe_around(float(signals["zeta"][0]), N),
        predictions=predictions,
        lost=lost,
        last=tuple(map(float, last)),
    )


def _watched(
    compiled: native.Compiled,
    times: np.ndarray,
    start: object,
    progress: Callable[[float], object] | None,
    settings: Mapping[str, Any],
) -> Any:
    """Return a run that may end where it stands still, but not where Ctrl-C ends it."""
    watch = _Watch(progress)
    response = input_output_response(compiled, times, 0, start, progress=watch, **settings)
    return response if watch.stands_still else native.uninterrupted(response)


def _signals(response: Any) -> dict[str, np.ndarray]:
    signals = signals_of(response)
    return {name: signals[name] for name in LONG_RUN_SIGNALS}


def _until(end: float, time: np.ndarray, signals: Mapping[str, np.ndarray]) -> Signals:
    seen = time <= end + 1e-9
    return Signals(t=time[seen], values={name: y[seen] for name, y in signals.items()})


@dataclass
class _Watch:
    """Ends a run that stands still, as Ctrl-C would: what it has reached is kept."""

    progress: Callable[[float], object] | None
    reached: float = -np.inf
    stands_still: bool = False

    def __call__(self, t: float) -> None:
        if self.progress is not None:
            self.progress(t)
        self.stands_still = t - self.reached < _STANDSTILL
        if self.stands_still:
            raise KeyboardInterrupt
        self.reached = t
