"""Sampled blocks: discrete time in a diagram of continuous time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import control as ct
import numpy as np

from ..arguments import number
from ..blocks import block, default_state
from ..errors import ParameterError, UsageError
from ..upstream.control_internals import Around, outputs_now, rates_now
from .clock import Clock, Moment
from .discretised import discretise
from .rebuilt import rebuilt, staged

Happening = frozenset[Moment]
_HAPPENING: ContextVar[Happening | None] = ContextVar("nlctl_happening", default=None)


@contextmanager
def happening(what: Happening = frozenset()) -> Iterator[None]:
    """Say what happens at the instant at which a diagram with sampled blocks is evaluated.

    Inside, derivatives of states of sampled blocks that nothing happens to are 0: between samples
    they stand still.  Of those that sample now they are the next states, and their outputs are
    the new ones.  Outside python-control is refused the derivatives: it would integrate over the
    samples without a word.
    """
    token = _HAPPENING.set(what)
    try:
        yield
    finally:
        _HAPPENING.reset(token)


class Sampled(Around):
    """A block in discrete time, in a diagram of continuous time; made by `sampled`.

    Its states are those of the block, the outputs that are on their way, the first to come last,
    and the outputs that it holds.

    Attributes
    ----------
    inner : control.InputOutputSystem
        The block in discrete time.
    clock : Clock
    input_quantum, output_quantum : float
        Steps to which inputs and outputs are rounded; 0 for none.
    """

    def __init__(
        self, inner: Any, clock: Clock, *, input_quantum: float = 0.0, output_quantum: float = 0.0
    ) -> None:
        self.inner, self.clock = inner, clock
        self.input_quantum, self.output_quantum = input_quantum, output_quantum
        outputs = list(inner.output_labels)
        waiting = [f"{y}_pending{i + 1}" for i in range(clock.pending) for y in outputs]
        held = [f"{y}_held" for y in outputs]
        super().__init__(
            None if not outputs and not inner.nstates else _nothing,
            None if not outputs else _nothing,
            inputs=list(inner.input_labels) or 0,
            outputs=outputs or 0,
            states=[*(inner.state_labels or []), *waiting, *held] or None,
            name=inner.name,
            dt=0,
        )

    @property
    def params(self) -> Any:
        """Parameters of the block in discrete time."""
        return self.inner.params

    @params.setter
    def params(self, values: Any) -> None:
        if values:
            self.inner.params = values

    def copy(self, name: str | None = None, use_prefix_suffix: bool = True) -> Sampled:
        """Return a copy, whose parameters have its name in front."""
        inner = self.inner.copy(name=name, use_prefix_suffix=use_prefix_suffix)
        return Sampled(
            inner, self.clock, input_quantum=self.input_quantum, output_quantum=self.output_quantum
        )

    def default_state(self) -> np.ndarray:
        """The block's own initial state; what it holds is 0 until its first sample."""
        own = default_state(self.inner)
        return np.concatenate([own, np.zeros(self.nstates - own.size)])

    def parts(self, x: Any) -> tuple[Any, Any, Any]:
        """Divide states into the block's own, outputs that are on their way, held outputs."""
        n, m = self.inner.nstates or 0, self.noutputs or 0
        return x[:n], x[n : len(x) - m], x[len(x) - m :]

    def answers(self, now: Happening) -> bool:
        """Whether its outputs are new ones, made of the inputs that it has now."""
        return self.clock.sampling in now and not self.clock.pending

    def rates(self, t: float, x: Any, u: Any) -> np.ndarray:
        """Return what becomes of its states; see `happening`."""
        now = _HAPPENING.get()
        if now is None:
            raise UsageError(
                f"block '{self.name}' is sampled every {self.clock.dt:g} s, and python-control "
                "would integrate over its samples: use nlctl.input_output_response, which stops "
                "at each of them (engine='python-control' is the reference)"
            )
        x = np.array(x, dtype=float)
        own, _, _ = self.parts(x)
        if not self.acts(now):
            return np.zeros(x.size)

        def computed() -> tuple[Any, Any]:
            given = rounded(np.asarray(u, dtype=float), self.input_quantum)
            following = rates_now(self.inner, t, own, given) if own.size else own
            return following, self._new(t, own, given)

        return np.concatenate(self.after(now, x, computed))

    def answer(self, t: float, x: Any, u: Any) -> np.ndarray:
        """Return its outputs; see `happening`."""
        own, waiting, held = self.parts(np.asarray(x, dtype=float))
        now = _HAPPENING.get() or frozenset()
        if self.answers(now):
            return self._new(t, own, rounded(np.asarray(u, dtype=float), self.input_quantum))
        return self.shown(now, waiting, held)

    def after(self, now: Happening, x: Any, computed: Callable[[], tuple[Any, Any]]) -> list[Any]:
        """Return the parts of the states after what happens, one behind the other.

        Parameters
        ----------
        now : frozenset of Moment
        x : array_like of shape (nstates,)
            Numbers, or what stands for them.
        computed : callable
            Returns what a sample makes: the block's own next states, and its outputs.
        """
        own, waiting, held = self.parts(x)
        held = self.shown(now, waiting, held)
        if self.clock.sampling not in now:
            return [own, waiting, held]
        following, y = computed()
        if not self.clock.pending:
            return [following, y]
        return [following, y, waiting[: len(waiting) - len(held)], held]

    def shown(self, now: Happening, waiting: Any, held: Any) -> Any:
        """Return the outputs that are held, those that have waited if they follow now."""
        return waiting[len(waiting) - len(held) :] if self.releases(now) else held

    def acts(self, now: Happening) -> bool:
        """Whether anything happens to it."""
        return self.clock.sampling in now or self.releases(now)

    def releases(self, now: Happening) -> bool:
        """Whether outputs follow that have waited."""
        return bool(self.clock.delay) and self.clock.release in now

    def _new(self, t: float, own: np.ndarray, u: np.ndarray) -> np.ndarray:
        y = outputs_now(self.inner, t, own, u).astype(float)
        return rounded(y, self.output_quantum)


def _nothing(t: float, x: Any, u: Any, params: Any) -> Any:
    """Never called: a sampled block asks the block that it samples."""
    raise AssertionError("the equations of a sampled block are those of the block inside")


def rounded(values: Any, quantum: float) -> Any:
    """Round to multiples of a quantum, halves to the even one; 0 for none."""
    return quantum * np.rint(values / quantum) if quantum else values


def sampled(
    system: Any,
    dt: float | None = None,
    *,
    offset: float = 0.0,
    delay: float = 0.0,
    jitter: float = 0.0,
    seed: int = 0,
    input_quantum: float = 0.0,
    output_quantum: float = 0.0,
    method: str | None = None,
) -> Any:
    """Put a block or diagram in discrete time beside continuous ones: a computer's program.

    At t = offset + k dt it samples its inputs, computes, and holds its outputs until the next
    sample (zero-order hold).  Blocks that sample at one instant see each other's new outputs,
    in the order of the signal flow, at whatever rates they run.

    Parameters
    ----------
    system : control.InputOutputSystem or record
        In discrete time: ``ct.nlsys(..., dt=0.1)``, ``ct.ss(..., 0.1)``, a record whose ``update``
        returns x[k+1], diagrams of these; a block without states may have any timebase.
        `discretise` makes one of a block in continuous time.
    dt : float, optional
        Sampling time (s); by default that of `system`.
    offset : float, optional
        Time of the first sample (s); until then outputs are 0, or what the initial state says.
    delay : float, optional
        Time that it takes to compute (s), also longer than `dt`: so much later than the sample
        its outputs change.
    jitter : float, optional
        Each sample is late by a random time, uniform in [0, jitter] (s), the same in every run.
    seed : int, optional
        Of the random times.
    input_quantum, output_quantum : float, optional
        Steps of the converters: inputs and outputs are rounded to multiples of these, in their
        own units.
    method : str, optional
        How one in continuous time becomes one in discrete time, as in `discretise`; by default it
        is refused.

    Returns
    -------
    Sampled or control.InterconnectedSystem
        In continuous time, to be connected as any block.  `nlctl.input_output_response` simulates
        it; python-control, which would integrate over the samples, is refused.

    Raises
    ------
    ParameterError
        If a number is out of its bounds, `system` is in continuous time, or has another sampling
        time than `dt`.

    Notes
    -----
    A run ends before what happens at its last instant: another one that starts from its last
    state resumes there.

    Examples
    --------
    >>> import control as ct
    >>> plant = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="plant")
    >>> law = ct.ss([], [], [], -2, 0.1, inputs="y", outputs="u", name="law")
    >>> parts = [plant, nlctl.sampled(law)]
    >>> loop = ct.interconnect(parts, inputs=[], outputs=["y"], inplist=[])
    >>> run = nlctl.input_output_response(loop, [0, 0.1], 0, {"plant.x[0]": 1.0})
    >>> round(float(run.outputs[0, -1]), 6)  # 3 exp(-0.1) - 2
    0.714512
    """
    for name, value in (("input_quantum", input_quantum), ("output_quantum", output_quantum)):
        number("sampled", name, value, at_least=0)
    if not isinstance(system, ct.InputOutputSystem):
        is_discrete = getattr(system, "discrete", False)
        system = block(system, "sampled", dt=dt if is_discrete else None)
    if method is not None and system.dt in (0, None):
        system = discretise(system, number("sampled", "dt", dt, above=0), method)
    period = _sampling_time(system, dt)
    clock = Clock(dt=period, offset=offset, delay=delay, jitter=jitter, seed=seed)
    quanta = {"input_quantum": input_quantum, "output_quantum": output_quantum}
    if not isinstance(system, ct.InterconnectedSystem):
        return Sampled(_discrete(system), clock, **quanta)
    made = rebuilt(system, lambda part: Sampled(_discrete(part), clock.sampling.clock), dt=0)
    first = _through(made.input_labels, "input_stage", clock.sampling.clock, input_quantum)
    last = _through(made.output_labels, "output_stage", clock, output_quantum)
    return staged(made, first if input_quantum else None, last if delay or output_quantum else None)


def _through(labels: list[str], name: str, clock: Clock, quantum: float) -> Sampled:
    """Return a sampled block whose outputs are its inputs, rounded and later."""
    outputs = [f"{label}_{name}" for label in labels]
    inner = ct.ss(
        [], [], [], np.eye(len(labels)), clock.dt, inputs=labels, outputs=outputs, name=name
    )
    return Sampled(inner, clock, output_quantum=quantum)


def _sampling_time(system: Any, dt: float | None) -> float:
    own = system.dt if isinstance(system.dt, int | float) and system.dt is not True else None
    if own == 0 and (system.nstates or 0) > 0:
        raise ParameterError(
            f"'{system.name}' is in continuous time, and a sampled block is in discrete time: "
            f"say how, nlctl.sampled(system, {0.01 if dt is None else dt}, method='euler'), or "
            "give ct.sample_system(system, dt) of a linear one"
        )
    if dt is None and not own:
        raise ParameterError(f"'{system.name}' has no sampling time of its own: give dt in s")
    if dt is not None and own and not np.isclose(own, dt, rtol=1e-12, atol=0):
        raise ParameterError(
            f"'{system.name}' has a sampling time of {own:g} s and cannot be sampled every {dt} s"
        )
    return number("sampled", "dt", own if dt is None else dt, above=0)


def _discrete(system: Any) -> Any:
    """Return a block that can be sampled: transfer functions as state-space systems."""
    if isinstance(system, ct.TransferFunction):
        return ct.ss(
            system, name=system.name, inputs=system.input_labels, outputs=system.output_labels
        )
    if not isinstance(system, ct.StateSpace | ct.NonlinearIOSystem):
        raise ParameterError(
            f"'{system.name}' is a {type(system).__name__}, which has no equations"
        )
    for kind in ("inputs", "outputs", "states"):
        if getattr(system, f"n{kind}") is None:
            raise ParameterError(
                f"'{system.name}' does not say how many {kind} it has: give {kind}=... to ct.nlsys"
            )
    return system
