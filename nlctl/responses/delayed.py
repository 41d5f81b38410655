"""Diagrams with transport delays in python-control: the method of steps, the reference.

From break to break, and no further than the shortest delay at a time, all that leaves a delay is
known, and python-control integrates what is left.  Signals are kept as Chebyshev polynomials
through its solution; a step whose polynomials do not settle is halved.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from scipy.optimize import brentq

from ..blocks import Block, DelayLine, past
from ..delays.lines import delayed_blocks
from ..delays.pieces import PLACES
from ..delays.variation import check_positive, variation
from ..sampling.system import happening
from ..upstream.control_internals import set_parameters
from .arguments import interpolated
from .time_response import response_of

_DEGREE = 12
_NODES = chebyshev.chebpts2(_DEGREE + 1)
_FITTED = np.linalg.inv(chebyshev.chebvander(_NODES, _DEGREE))
_HALVINGS = 12
_ASIDE = 1e-9  # part of a step: what lies so close to its end is read from inside
_ROUNDING = 1e-14


@dataclass(kw_only=True)
class Past:
    """What is known of delayed signals while a run goes on.

    Attributes
    ----------
    blocks : list of Block
        The transport delays.
    begin, end : float
        First and last time of the run (s).
    lines : dict
        What leaves each, and what arrives there.
    starts, ends : list of float
        Times of the steps.
    pieces : list of list of ndarray
        Chebyshev coefficients of the signals of each block, step by step.
    step : tuple of float
        Begin and end of the step that is being made.
    breaks : list of float
        Times at which a signal, or one of its derivatives, jumps.
    """

    blocks: list[Block]
    begin: float
    end: float
    lines: dict[Any, DelayLine] = field(default_factory=dict)
    starts: list[float] = field(default_factory=list)
    ends: list[float] = field(default_factory=list)
    pieces: list[list[np.ndarray]] = field(default_factory=list)
    step: tuple[float, float] = (0.0, 0.0)
    breaks: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        for number, made in enumerate(self.blocks):
            count = made.noutputs or 0
            self.lines[made] = DelayLine(
                leaving=lambda t, number=number: self.leaving(number, t),
                arriving=np.full(count, np.nan),
            )

    def leaving(self, number: int, t: float) -> np.ndarray:
        """Return what leaves a block: of the side of a break that the step lies on."""
        spec: Any = self.blocks[number].current_spec
        a, b = self.step
        aside = _ASIDE * (b - a)
        s, inside = _sent(spec, t), _sent(spec, min(max(t, a + aside), b - aside))
        if inside < self.begin:
            return spec.earlier(min(s, self.begin))
        k = max(bisect_right(self.starts, inside) - 1, 0)
        a, b = self.starts[k], self.ends[k]
        return np.asarray(chebyshev.chebval((2.0 * s - a - b) / (b - a), self.pieces[k][number]))

    def stops(self, begin: float, end: float) -> Iterator[tuple[float, float]]:
        """Yield steps from break to break, none longer than the shortest delay."""
        specs: list[Any] = [made.current_spec for made in self.blocks]
        a = begin
        while a < end:
            later = [self.arrival(spec, s) for s in self.breaks for spec in specs]
            ahead = (s for s in (*later, *self.breaks) if s > a + _ROUNDING * abs(a))
            b = min([*(self.arrival(spec, a) for spec in specs), end, *ahead])
            b = end if end - b <= _ROUNDING * abs(end) else b
            yield a, b
            if any(abs(s - b) <= _ROUNDING * abs(b) for s in later):
                self.broken(b)
            a = b

    def arrival(self, spec: Any, s: float) -> float:
        """Return when leaves a delay what it is given at time s; inf behind the run."""
        if spec.varying is None:
            return s + spec.delay
        if _sent(spec, self.end) <= s:
            return math.inf
        found: Any = brentq(lambda t: _sent(spec, t) - s, self.begin, self.end, xtol=1e-14)
        return float(found)

    def longest_step(self, a: float, b: float) -> float:
        """Return how long steps from a to b may be to go over no pulse that leaves a delay.

        A function that nobody knows between two places is looked at at 1000; pieces of the past
        are shorter the faster their signals move, three of them together: one alone may be what
        is left between two breaks.
        """
        found = [math.inf]
        for made in self.blocks:
            spec: Any = made.current_spec
            first, last = _sent(spec, a), _sent(spec, b)
            if spec.varying is not None:
                found.append((self.end - self.begin) / PLACES)
            if spec.history is not None and first < self.begin:
                found.append((self.begin - _sent(spec, self.begin)) / PLACES)
            read = range(bisect_right(self.ends, first), bisect_right(self.starts, last) - 2)
            found += [(self.ends[k + 2] - self.starts[k]) / 3 for k in read]
        return min(found)

    def broken(self, t: float) -> None:
        """Note a break; those that all delays have left behind are forgotten."""
        oldest = min(_sent(made.current_spec, t) for made in self.blocks)
        self.breaks = [s for s in self.breaks if s > oldest - 1e-9 * abs(t)]
        if not self.breaks or self.breaks[-1] != t:
            self.breaks.append(t)


def _sent(spec: Any, t: float) -> float:
    """Return when a delay was given what leaves it at time t."""
    return t - (spec.delay + spec.varied(t))


def by_steps(
    simulate: Callable[..., Any],
    known: Past,
    system: Any,
    times: np.ndarray,
    inputs: np.ndarray,
    x0: np.ndarray,
    *,
    params: Any,
    evaluation_times: np.ndarray | None = None,
    **settings: Any,
) -> Any:
    """Simulate a diagram with transport delays from where its past ends.

    Parameters
    ----------
    simulate : callable
        `control.input_output_response`.
    known : Past
        It grows.
    system, times, inputs, x0, params, evaluation_times, **settings
        As of `sampled.from_sample_to_sample`.

    Returns
    -------
    control.TimeResponseData
        Signals at an instant at which something jumps are those after it, at the last one those
        before.
    """
    wanted = times if evaluation_times is None else evaluation_times
    form = {name: settings.pop(name, None) for name in ("squeeze", "transpose", "return_states")}
    set_parameters(system, params)
    for made in known.blocks:
        spec: Any = made.current_spec
        varied = variation(spec, known.begin, known.end, str(made.name))
        check_positive(varied, np.array([spec.delay]), str(made.name))
    run = _Run(
        simulate=simulate, known=known, system=system, times=times, inputs=inputs, params=params,
        settings=settings, wanted=wanted, x=np.array(x0, dtype=float),
    )  # fmt: skip
    y = np.full((system.noutputs or 0, wanted.size), np.nan)
    states = np.full((system.nstates or 0, wanted.size), np.nan)
    known.broken(float(times[0]))
    for t in break_points(times, inputs):
        known.breaks.append(t)  # what happens there arrives later
    for begin, end in known.stops(float(times[0]), float(times[-1])):
        for taken, outputs, path in run.stepped(begin, end, 0):
            y[:, taken], states[:, taken] = outputs, path
    signals = (wanted, y, states, interpolated(inputs, times, wanted))
    return response_of(system, signals, params, form)


@dataclass(kw_only=True)
class _Run:
    """A run that is being made, and the state that it has reached."""

    simulate: Callable[..., Any]
    known: Past
    system: Any
    times: np.ndarray
    inputs: np.ndarray
    params: Any
    settings: dict[str, Any]
    wanted: np.ndarray
    x: np.ndarray

    def stepped(self, a: float, b: float, halvings: int) -> Iterator[tuple[Any, Any, Any]]:
        """Make a step; yield which of the wanted times it has, with outputs and states."""
        known, system = self.known, self.system
        known.step = (a, b)
        nodes = 0.5 * ((b - a) * _NODES + (a + b))
        nodes[0], nodes[-1] = a, b
        inner = np.union1d(np.union1d(self.times, self.wanted), nodes)
        grid = inner[(inner >= a) & (inner <= b)]
        solver = self.settings["solve_ivp_kwargs"]
        longest = min(solver.get("max_step", math.inf), known.longest_step(a, b))
        part = self.simulate(
            system, grid, interpolated(self.inputs, self.times, grid), self.x, params=self.params,
            squeeze=False, transpose=False, return_states=False,
            **self.settings | {"solve_ivp_kwargs": solver | {"max_step": longest}},
        )  # fmt: skip
        states = () if part.x is None else part.x  # None of a diagram without states
        path = np.reshape(states, (system.nstates or 0, grid.size))
        values = self._arriving(nodes, path[:, np.searchsorted(grid, nodes)])
        pieces = [_FITTED @ each for each in values]
        if halvings < _HALVINGS and not all(map(self._settled, pieces)):
            middle = 0.5 * (a + b)
            yield from self.stepped(a, middle, halvings + 1)
            yield from self.stepped(middle, b, halvings + 1)
            return
        known.starts.append(a)
        known.ends.append(b)
        known.pieces.append(pieces)
        taken = (self.wanted >= a) & ((self.wanted < b) | (b == self.times[-1]))
        columns = np.searchsorted(grid, self.wanted[taken])
        self.x = path[:, -1].copy()
        yield taken, np.reshape(part.y, (-1, grid.size))[:, columns], path[:, columns]

    def _arriving(self, nodes: np.ndarray, path: np.ndarray) -> list[np.ndarray]:
        """Return what arrives at each transport delay, at times of the step."""
        found: list[list[np.ndarray]] = [[] for _ in self.known.blocks]
        u = interpolated(self.inputs, self.times, nodes)
        for k, t in enumerate(nodes):
            evaluate = self.system.dynamics if self.system.nstates else self.system.output
            evaluate(float(t), path[:, k], u[:, k], params=self.params)
            for own, line in zip(found, self.known.lines.values(), strict=True):
                own.append(line.arriving)
        return [np.array(own) for own in found]

    def _settled(self, piece: np.ndarray) -> bool:
        """Whether the last coefficients of a polynomial are within the tolerance."""
        given = self.settings["solve_ivp_kwargs"]
        size = np.abs(piece).sum(axis=0)
        return bool(np.all(np.abs(piece[-2:]) <= given["atol"] + given["rtol"] * size))


def with_delays(simulate: Callable[..., Any], system: Any, *given: Any, **settings: Any) -> Any:
    """Simulate a diagram with transport delays by `simulate`, which takes a `Past` first."""
    blocks, times = delayed_blocks(system), given[0]
    known = Past(blocks=blocks, begin=float(times[0]), end=float(times[-1]))
    known.step = (known.begin, known.begin)
    with past(known.lines), happening():
        return simulate(known, system, *given, **settings)


def break_points(times: np.ndarray, inputs: np.ndarray) -> list[float]:
    """Return the times at which an input has a break point."""
    if not np.size(inputs):
        return []
    rises, lengths = np.diff(np.atleast_2d(inputs)), np.diff(times)
    bent = np.any(rises[:, :-1] * lengths[1:] != rises[:, 1:] * lengths[:-1], axis=0)
    return times[1:-1][bent].tolist()
