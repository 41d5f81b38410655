"""Sampled blocks: discrete time in a diagram of continuous time."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..arguments import flag, number, of_type
from ..blocks import Block, block, default_state
from ..diagrams import leaves
from ..errors import ParameterError, UsageError
from ..names import Parameters
from ..params import integer
from ..upstream.control_internals import (
    Around,
    current_parameters,
    is_system,
    outputs_now,
    rates_now,
    set_parameters,
)
from ..upstream.systems import System
from .clock import Clock, Moment
from .discretised import discretise, rebuilt, staged, with_equations
from .parameters import Sampling

Happening = frozenset[Moment]
_MOST_WAITING = 10_000  # samples, each a state of its own
_HAPPENING: ContextVar[Happening | None] = ContextVar("nlctl_happening", default=None)


@contextmanager
def happening(what: Happening = frozenset()) -> Iterator[None]:
    """Say what happens at the instant at which a diagram with sampled blocks is evaluated."""
    # Inside, derivatives of states of sampled blocks that nothing happens to are 0: between
    # samples they stand still. Of those that sample now they are the next states, and their
    # outputs are the new ones. Outside python-control is refused the derivatives: it would
    # integrate over the samples without a word.
    token = _HAPPENING.set(what)
    try:
        yield
    finally:
        _HAPPENING.reset(token)


class Sampled(Around):
    """A block in discrete time, in a diagram of continuous time; made by `sampled`.

    Its states are those of the block, the outputs that wait, the first to come last,
    and the outputs that it holds.

    Attributes
    ----------
    inner : control.InputOutputSystem
        The block that is sampled.
    sampling : Block
        When, and with which converters: a `Sampling`, which blocks of one program share.
    euler : bool
        Whether the block is in continuous time, and its next states are x + dt f(t, x, u).
    delays : bool
        Whether its outputs wait for the delay.
    converters : tuple of str
        Which quantum of `sampling` its inputs and its outputs are rounded to; "" for none.

    Examples
    --------
    See `sampled`.
    """

    def __init__(
        self,
        inner: Any,
        sampling: Any,
        *,
        euler: bool = False,
        delays: bool = False,
        converters: tuple[str, str] = ("", ""),
    ) -> None:
        of_type("Sampled", "inner", inner, ct.InputOutputSystem, "a block")
        of_type("Sampled", "sampling", sampling, Block, "a block of a Sampling")
        self.inner, self.sampling = inner, sampling
        self.euler, self.delays = flag("Sampled", "euler", euler), flag("Sampled", "delays", delays)
        self.converters = converters
        outputs = list(inner.output_labels)
        self.waiting = sampling.spec.waiting if delays else 0
        waiting = [f"{y}_pending{i + 1}" for i in range(self.waiting) for y in outputs]
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
        """Parameters of the block that is sampled, and of the sampling."""
        return self.sampling.params | self.inner.params

    @params.setter
    def params(self, values: object) -> None:
        ours, theirs = self._divided(values or {})
        if ours:
            self.sampling.params = ours
        if theirs:
            self.inner.params = theirs

    def _divided(self, values: Any) -> tuple[dict[str, Any], Any]:
        """Return which parameters are the sampling's, and the others."""
        prefix = f"{self.sampling.name}."
        ours = {k: v for k, v in values.items() if str(k).startswith(prefix)}
        theirs = values.copy()
        for name in ours:
            dict.pop(theirs, name)
        return {k.removeprefix(prefix): v for k, v in ours.items()}, theirs

    def copy(self, name: str | None = None, use_prefix_suffix: bool = True) -> "Sampled":
        """Return a copy, whose parameters have its name in front; it has the same clock."""
        inner = self.inner.copy(name=name, use_prefix_suffix=use_prefix_suffix)
        sampling = self.sampling
        if sampling.name == _own_name(self.inner.name):  # of this block alone
            sampling = _alone(sampling.spec, inner)
        return Sampled(
            inner, sampling, euler=self.euler, delays=self.delays, converters=self.converters
        )

    def default_state(self) -> np.ndarray:
        """The block's own initial state; what it holds is 0 until its first sample."""
        start = default_state(self.inner)
        return np.concatenate([start, np.zeros(self.nstates - start.size)])

    def parts(self, x: Any) -> tuple[Any, Any, Any]:
        """Divide states into the block's own, outputs that wait, held outputs."""
        n, m = self.inner.nstates or 0, self.noutputs or 0
        return x[:n], x[n : len(x) - m], x[len(x) - m :]

    def answers(self, now: Happening) -> bool:
        """Whether its outputs are new ones, made of the inputs that it has now."""
        return self.samples(now) and not self.delays

    def samples(self, now: Happening) -> bool:
        """Whether it takes a sample."""
        return Moment(self.sampling, 1) in now

    def acts(self, now: Happening) -> bool:
        """Whether anything happens to it."""
        return self.samples(now) or self.releases(now)

    def releases(self, now: Happening) -> bool:
        """Whether outputs follow that have waited."""
        return self.delays and Moment(self.sampling, 0) in now

    def override(self, params: object) -> None:
        """Divide overrides between the sampling and the block that is sampled."""
        ours, theirs = self._divided(params or {})
        full = {f"{self.sampling.name}.{name}": value for name, value in ours.items()}
        set_parameters(self.sampling, Parameters(full) if ours else None)
        set_parameters(self.inner, theirs)

    def rates(self, t: float, x: object, u: object) -> np.ndarray:
        """Return the rates of its states, or the next ones; see `happening`."""
        now = _HAPPENING.get()
        if now is None:
            raise UsageError(
                f"block '{self.name}' is sampled every {self.sampling.current_spec.dt:g} s, and "
                "python-control would integrate over its samples: use "
                "nlctl.input_output_response, which stops at each of them "
                "(engine='python-control' is the reference), and nlctl.linearize for the exact map "
                "from sample to sample"
            )
        x = np.array(x, dtype=float)
        state, _, _ = self.parts(x)
        if not self.acts(now):
            return np.zeros(x.size)
        p = current_parameters(self.sampling)

        def computed() -> tuple[Any, Any]:
            given = self.converted(rounded, np.asarray(u, dtype=float), p, 0)
            following = rates_now(self.inner, t, state, given) if state.size else state
            if self.euler:
                following = state + p.dt * following
            return following, self._new(t, state, given, p)

        return np.concatenate(self.after(now, x, self.oldest(oldest, x, p), computed))

    def _answer(self, t: float, x: object, u: object) -> np.ndarray:
        """Return its outputs; see `happening`."""
        x = np.asarray(x, dtype=float)
        state, _, held = self.parts(x)
        now, p = _HAPPENING.get() or frozenset(), current_parameters(self.sampling)
        if self.answers(now):
            return self._new(t, state, self.converted(rounded, np.asarray(u, dtype=float), p, 0), p)
        return self.oldest(oldest, x, p) if self.releases(now) else held

    def after(
        self, now: Happening, x: Any, due: Any, computed: Callable[[], tuple[Any, Any]]
    ) -> list[Any]:
        """Return the parts of the states after what happens, one behind the other."""
        # Shapes: `x` (nstates,), `due` (noutputs,).
        state, waiting, held = self.parts(x)
        held = due if self.releases(now) else held
        if not self.samples(now):
            return [state, waiting, held]
        following, y = computed()
        if not self.delays:
            return [following, y]
        return [following, y, waiting[: len(waiting) - len(held)], held]

    def oldest(self, function: Callable[..., Any], x: object, p: Any) -> Any:
        """Return the outputs that have waited for the delay, by `oldest` or what stands for it."""
        _, waiting, held = self.parts(x)
        return function(waiting, len(held), p.pending) if self.waiting else held

    def converted(self, function: Callable[..., Any], values: Any, p: Any, which: int) -> Any:
        """Return inputs (0) or outputs (1) behind their converter, by `rounded`."""
        name = self.converters[which]
        return function(values, getattr(p, name)) if name and len(values) else values

    def _new(self, t: float, state: np.ndarray, u: np.ndarray, p: object) -> np.ndarray:
        y = outputs_now(self.inner, t, state, u).astype(float)
        return self.converted(rounded, y, p, 1)


def clocks_of(blocks: Iterable[Any]) -> dict[Any, Clock]:
    """Return the clocks of blocks, among them sampled ones, with the parameters of now."""
    samplings = [one.sampling for one in blocks if isinstance(one, Sampled)]
    return {sampling: sampling.current_spec.clock for sampling in samplings}


def _alone(spec: Sampling, sampled: Any) -> Any:
    """Return the sampling of a single block, whose parameters have that block's name in front."""
    sampling = block(spec, "sampling")
    sampling.name = _own_name(sampled.name)  # no diagram has this block, so that it may have a dot
    return sampling


def _own_name(block_name: str) -> str:
    """Return what the sampling of a single block is called."""
    return f"{block_name}.sampling"


def _nothing(t: float, x: object, u: object, params: object) -> Any:
    """Never called: a sampled block asks the block that it samples."""
    raise AssertionError("the equations of a sampled block are those of the block inside")


def rounded(values: Any, quantum: Any) -> Any:
    """Round to multiples of a quantum, halves to the even one; 0 leaves all as it is."""
    step = np.where(quantum > 0.0, quantum, 1.0)
    return np.where(quantum > 0.0, step * np.rint(values / step), values)


def oldest(waiting: Any, size: int, pending: object) -> Any:
    """Return those of the outputs that wait that a number of samples have come after."""
    count = len(waiting) // size
    outputs = waiting[len(waiting) - size :]
    for i in range(count - 1):
        outputs = np.where(pending == i + 1.0, waiting[i * size : (i + 1) * size], outputs)
    return outputs


@as_annotated
def sampled(
    system: Any,
    dt: float | None = None,
    *,
    offset: float = 0.0,
    delay: float = 0.0,
    jitter: float | None = None,
    seed: int = 0,
    input_quantum: float | None = None,
    output_quantum: float | None = None,
    method: str | None = None,
    waiting: int | None = None,
) -> ct.NonlinearIOSystem:
    """Put a block or diagram in discrete time next to continuous ones: a computer's program.

    At t = offset + k dt it samples its inputs, computes, and holds its outputs until the next
    sample (zero-order hold).  Blocks that sample at one instant see each other's new outputs,
    in the order of the signal flow, at whatever rates they run.

    Parameters
    ----------
    system : control.InputOutputSystem or record
        In discrete time: ``ct.nlsys(..., dt=0.1)``, ``ct.ss(..., 0.1)``, ``ct.tf(..., 0.1)``, a
        record whose ``update`` returns x[k+1], diagrams of these; a block without states may have
        any timebase.
        `discretise` makes one of a block in continuous time.
    dt : float, optional
        Sampling time (s); by default that of `system`.
    offset : float, optional
        Time of the first sample (s); until then outputs are 0, or what the initial state says.
    delay : float, optional
        Time that it takes to compute (s), also longer than `dt`: so much later than the sample
        its outputs change.
    jitter : float, optional
        Each sample is late by a random time, uniform in [0, jitter] (s), the same in every run;
        with None and 0.0 none is.
    seed : int, optional
        Of the random times.
    input_quantum, output_quantum : float, optional
        Steps of the converters: inputs and outputs are rounded to multiples of these, in their
        own units.  With None there is no converter; 0.0 is one that leaves all as it is.
    method : str, optional
        How one in continuous time becomes one in discrete time, as in `discretise`; by default it
        is refused.
    waiting : int, optional
        How many samples may wait for their outputs, if the delay is to be varied; by
        default as many as `delay` needs.

    Returns
    -------
    Sampled or control.InterconnectedSystem
        In continuous time, to be connected as any block.  `nlctl.input_output_response` simulates
        it; python-control, which would integrate over the samples, is refused.

    Raises
    ------
    ParameterError
        If a number is out of its bounds, `system` is in continuous time, does not say in which, is
        sampled already, or has another sampling time than `dt`.

    UsageError
        If a block of it has a guard.

    Notes
    -----
    What is due at the last instant of a run happens there, and its outputs are the new ones; the
    last column of its states is what they were before, as python-control's x[N] is: a run that
    begins at an instant takes the sample that is due there.

    The numbers are parameters, ``"sampling.dt"`` and so on, that runs, ensembles and studies
    override without compiling again.  Whether there are a delay and converters is part of the
    diagram, and a block that has a sampling time of its own keeps it.

    Examples
    --------
    >>> plant = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="plant")
    >>> law = ct.ss([], [], [], -2, 0.1, inputs="y", outputs="u", name="law")
    >>> parts = [plant, nlctl.sampled(law)]
    >>> loop = ct.interconnect(parts, inputs=[], outputs=["y"], inplist=[])
    >>> run = nlctl.input_output_response(loop, [0, 0.1], 0, {"plant.x[0]": 1.0})
    >>> round(float(run.outputs[0, -1]), 6)  # 3 exp(-0.1) - 2
    0.714512
    """
    if not is_system(system):
        is_discrete = getattr(system, "discrete", False)
        system = block(system, "sampled", dt=dt if is_discrete else None)
    system = with_equations("nlctl.sampled", system)
    _refuse_guards(system)
    euler = method == "euler" and system.dt in (0, None)
    if method is not None and system.dt in (0, None):
        discrete = discretise(system, number("sampled", "dt", dt, above=0), method)
        system = system if euler else discrete
    own_time = _own_time(system, dt, euler)
    period = number("sampled", "dt", own_time or dt, above=0)
    spec = Sampling(
        dt=period, offset=offset, delay=delay, jitter=0.0 if jitter is None else jitter, seed=seed,
        input_quantum=0.0 if input_quantum is None else input_quantum,
        output_quantum=0.0 if output_quantum is None else output_quantum,
        waiting=_waiting(dt=period, delay=delay, waiting=waiting), own_time=own_time,
        converts_inputs=input_quantum is not None, converts_outputs=output_quantum is not None,
    )  # fmt: skip
    return _sampled(system, spec, euler)


def _refuse_guards(system: ct.NonlinearIOSystem) -> None:
    """Refuse blocks whose guards fall in continuous time."""
    for leaf in leaves(system):
        if isinstance(leaf.system, Block) and hasattr(leaf.system.spec, "guard"):
            raise UsageError(
                f"block '{leaf.path or leaf.system.name}' has a guard, which falls in continuous "
                "time, and is sampled: say in update how it changes at a sample"
            )


def _sampled(system: System, spec: Sampling, euler: bool) -> Any:
    """Return a system whose blocks are sampled."""
    before = "input_quantum" if spec.converts_inputs else ""
    behind = "output_quantum" if spec.converts_outputs else ""
    delays = spec.waiting > 0
    if not isinstance(system, ct.InterconnectedSystem):
        sampling = _alone(spec, system)
        return Sampled(system, sampling, euler=euler, delays=delays, converters=(before, behind))
    sampling = block(spec, "sampling")

    def each(part: ct.NonlinearIOSystem) -> Sampled:
        return Sampled(part, sampling, euler=euler and bool(part.nstates))

    whole = rebuilt(system, each, dt=0)
    first = _through(whole.input_labels, "input_stage", sampling, before)
    last = _through(whole.output_labels, "output_stage", sampling, behind, delays)
    return staged(whole, first if before else None, last if delays or behind else None)


def _waiting(dt: float, delay: float, waiting: int | None) -> int:
    """Return how many samples may wait."""
    least = Clock(dt=dt, delay=delay).pending
    if waiting is None:
        return least
    return integer("sampled", "waiting", waiting, at_least=least, at_most=_MOST_WAITING)


def _through(
    labels: list[str], name: str, sampling: Any, quantum: str, delays: bool = False
) -> Sampled:
    """Return a sampled block whose outputs are its inputs, rounded and later."""
    outputs = [f"{label}_{name}" for label in labels]
    inner = ct.ss([], [], [], np.eye(len(labels)), None, inputs=labels, outputs=outputs, name=name)
    return Sampled(inner, sampling, delays=delays, converters=("", quantum))


def _own_time(system: System, dt: float | None, euler: bool) -> float:
    """Return the sampling time that a system has of its own, 0 if it has none."""
    time = system.dt if isinstance(system.dt, int | float) and system.dt is not True else None
    untold = system.dt is None and not isinstance(system, Block)  # of a record nlctl knows
    if not time and system.dt is not True and (system.nstates or 0) > 0 and not euler:
        why = "says nothing of its time, dt=None" if untold else "is in continuous time"
        raise ParameterError(
            f"'{system.name}' {why}, and a sampled block is in discrete time: "
            f"say how, nlctl.sampled(system, {0.01 if dt is None else dt}, method='euler'), or "
            "give ct.sample_system(system, dt) of a linear one"
            + (", or its dt if it returns x[k+1]" if untold else "")
        )
    if dt is None and not time:
        raise ParameterError(f"'{system.name}' has no sampling time of its own: give dt in s")
    if dt is not None and time and not np.isclose(time, dt, rtol=1e-12, atol=0):
        raise ParameterError(
            f"'{system.name}' has a sampling time of {time:g} s and cannot be sampled every {dt} s"
        )
    return float(time or 0.0)
