r"""Runs of a loop that are observed for the proof.

Whether yd1, ..., ydn are the derivatives of yd, along a run.

The reference block itself is differentiated: with its own rates :math:`x' = f(t, x)`,

.. math:: \frac{d}{dt} y_d^{(k-1)} = \frac{d}{ds} g_{k-1}(t + s, x + s f(t, x)) \Big|_{s=0},

by central differences of order 8 with four steps, so that one fits whatever the frequencies are.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from nlctl import native
from nlctl.arguments import number
from nlctl.diagrams import Place, initial_state
from nlctl.diagrams import state_names as all_states
from nlctl.errors import AlgebraicLoopError, DiagramError, ParameterError
from nlctl.references import derivative_names
from nlctl.response import input_output_response
from nlctl.upstream.control_internals import outputs_now, rates_now
from nlctl.upstream.systems import SystemResponse
from nlctl.wording import counted

from ...response_of_loop import own_parameters
from ..bounds.decomposition import Decomposition
from ..bounds.error_bounds import Gains, alpha_1
from .checked import check_same, points_around
from .instrumented import observed
from .roles import Parts, declared, read_parts
from .signals import Margin, Signals, equality, signals_of

SAMPLING_INTERVAL = 4e-3  # s, sampling interval of a run that is given by its horizon
_LOOKS = 12  # samples of a run at which the observed loop is compared with the one given
_MOST = 10_000_000  # samples of a run
_AGREE = 1e-3  # relative distance beyond which a response is not one of the loop


@dataclass(frozen=True, kw_only=True)
class Member:
    """Where a run starts, and its parameters, both by qualified name."""

    start: Mapping[str, float]
    params: Mapping[str, Any]
    times: np.ndarray  # shape (m,)
    expected: Any = None  # a response that the run must reproduce

    @property
    def options(self) -> str:
        """Options of the command line that replay it; vectors are left out."""
        values = {**self.params, **{f"{k}(0)": v for k, v in self.start.items()}}
        return " ".join(f'--set "{k}={v:.17g}"' for k, v in values.items() if np.ndim(v) == 0)


@dataclass(frozen=True, kw_only=True)
class MemberRun:
    """A member, and its run."""

    member: Member
    parts: Parts  # with the member's parameters and gains
    signals: Signals  # up to the time that the run reached
    lost: float | None  # time (s) at which the run ended early, diverged or too stiff
    message: str = ""  # why it ended early
    # of the reference's derivatives
    reference: Margin | None = None

    @property
    def gains(self) -> Gains:
        """Gains of the member."""
        return self.parts.gains


def members_of(
    loop: ct.InterconnectedSystem,
    run: object,
    step: float,
    start: Mapping[str, Any] | None,
    params: Mapping[str, Any] | None,
) -> list[Member]:
    """Return the members that a horizon or responses stand for."""
    if not np.isscalar(run):
        if start or params:
            raise ParameterError("ledger takes start and params of the responses: leave them out")
        responses = list(run) if isinstance(run, Sequence) else [run]
        return [_of_response(loop, response) for response in responses]
    horizon, step = number("ledger", "horizon", run), number("ledger", "step", step)
    if not (0 < step < horizon < np.inf):
        raise ParameterError(f"ledger needs 0 < step < horizon, got {step:g} and {horizon:g}")
    if horizon > _MOST * step:
        raise ParameterError(
            f"ledger needs horizon <= {_MOST:g} step, got {horizon:g} and {step:g}"
        )
    times = np.linspace(0.0, horizon, round(horizon / step) + 1)
    varied = {**(start or {}), **(params or {})}
    sizes = {len(v) for v in varied.values() if np.ndim(v) == 1 and not isinstance(v, tuple)}
    if len(sizes) > 1:
        raise ParameterError(f"ledger needs arrays of one length, got lengths {sorted(sizes)}")
    count = sizes.pop() if sizes else 1

    def one(values: Mapping[str, Any] | None, i: int) -> dict[str, Any]:
        return {
            k: v[i] if np.ndim(v) == 1 and not isinstance(v, tuple) else v
            for k, v in (values or {}).items()
        }

    return [Member(start=one(start, i), params=one(params, i), times=times) for i in range(count)]


def _of_response(loop: ct.InterconnectedSystem, response: Any) -> Member:
    if getattr(response, "states", None) is None or not hasattr(response, "time"):
        raise ParameterError(
            f"ledger needs a horizon in s, or responses with their states, got {response!r:.60}"
        )
    states = np.atleast_2d(np.asarray(response.states))
    if states.shape[0] != (loop.nstates or 0):
        raise ParameterError(
            f"ledger needs responses with the {counted(loop.nstates, 'state')} of '{loop.name}', "
            f"got {states.shape[0]}"
        )
    start = dict(zip(all_states(loop), map(float, states[:, 0]), strict=True))
    params = own_parameters(loop, response)
    return Member(
        start=start, params=params, times=np.asarray(response.time, dtype=float), expected=response
    )


def observe(
    loop: ct.InterconnectedSystem,
    members: Sequence[Member],
    split: Decomposition,
    max_steps: int = 2_000_000,
) -> Iterator[MemberRun]:
    """Run the members, observed; see `nlctl.analysis.lyapunov.loop.instrumented`."""
    compiled = observed_loop(loop, split)
    for place, member in enumerate(members):
        parts = read_parts(loop, member.start, member.params)
        params = {**member.params, "integral.alpha_1": alpha_1(parts.gains)}
        x0 = initial_state(loop, member.start)
        points = points_around(x0) if place == 0 else [(0.0, x0)]
        check_same(loop, compiled.system, points, member.params, params)
        response = input_output_response(
            compiled,
            member.times,
            0,
            member.start,
            params=params,
            max_steps=max_steps,
            ignore_errors=True,
        )
        signals = signals_of(native.uninterrupted(response))
        seen = _along(loop, response, _LOOKS if place == 0 else 1)
        check_same(loop, compiled.system, seen, member.params, params)
        _check_reproduced(member, signals)
        yield MemberRun(
            member=member,
            parts=parts,
            signals=signals,
            lost=None if response.success else float(response.statistics.time),
            message=str(response.message or ""),
            reference=_reference(loop, parts, response, signals),
        )


def _along(loop: ct.InterconnectedSystem, response: SystemResponse, count: int) -> list[Any]:
    """Return times and states of the loop that a response of the observed loop has visited."""
    states = np.asarray(response.states)[: loop.nstates or 0]
    finite = np.flatnonzero(np.isfinite(states).all(axis=0))
    places = np.unique(np.linspace(finite.size - 1, 0, count).astype(int)) if finite.size else []
    return [(float(response.time[i]), states[:, i].copy()) for i in finite[places]]


def _reference(
    loop: ct.InterconnectedSystem, parts: Parts, response: SystemResponse, signals: Signals
) -> Margin | None:
    """Compare the reference's derivatives with those of its own outputs."""
    states = np.asarray(response.states)[: loop.nstates or 0]
    whole = np.isfinite(states).all(axis=0)
    place = parts.roles.places["reference"]
    return reference_margin(place, signals.t[whole], states[:, whole]) if whole.sum() > 1 else None


def observed_loop(loop: ct.InterconnectedSystem, split: Decomposition) -> native.Compiled:
    """Compile what `observe` runs."""
    base = read_parts(loop)
    try:
        return native.compile(observed(loop, base, split, alpha_1(base.gains)))
    except AlgebraicLoopError as error:
        native.compile(loop)  # a loop that has one itself says so
        raise DiagramError(
            f"the rates, g, G and d of '{base.paths['plant']}' cannot be written as expressions, "
            "which the ledger needs of them: its functions have too many cases, or call what is "
            "not traced; write cases as np.where, or leave some out, and call NumPy functions"
        ) from error


def _check_reproduced(member: Member, signals: Signals) -> None:
    if member.expected is None:
        return
    outputs = dict(zip(member.expected.output_labels, member.expected.outputs, strict=True))
    r, again = np.asarray(outputs["r"]), signals["r"]
    far = np.abs(r[: again.size] - again)
    if not np.all(far <= _AGREE * np.max(np.abs(r))):
        at = float(signals.t[int(np.argmax(far))])
        raise ParameterError(
            f"the response is not one of this loop: at t = {at:g} s its r is off by "
            f"{np.max(far):.3g} from a run with the same start and parameters"
        )


WEIGHTS = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])  # of differences at 1, ..., 4 steps
_STEPS = (1e-1, 1e-2, 1e-3, 1e-4)  # s
SAMPLES = 120
_TOLERANCE = 1e-6  # relative to the largest value of a derivative
SHIFT = 0.381966  # of a sampling interval: corners of a function of time lie on the samples


def reference_margin(place: Place, time: np.ndarray, states: np.ndarray) -> Margin | None:
    """Return how far the reference's derivatives are from those of its own outputs."""
    # Shapes: `time` (m,), `states` (n, m).
    names, block = declared(place, "outputs"), place.system
    order = sum(name in names for name in derivative_names(len(names))) - 1
    if order < 1 or block.ninputs:
        return None
    rows = [names.index(name) for name in derivative_names(order)]
    block_states = states[place.state_offset :][: block.nstates or 0]
    picked = np.unique(np.linspace(0, time.size - 2, SAMPLES).astype(int))
    times, outputs, rates = [], [], []
    for i in picked:
        shift = 0.0 if block.nstates else SHIFT * (time[i + 1] - time[i])
        t, x = float(time[i] + shift), block_states[:, i]
        here, slopes = outputs_now(block, t, x, np.zeros(0))[rows], _slopes(block, t, x, rows)
        far = np.abs(slopes - here[1:])
        best = np.argmin(np.where(np.isnan(far), np.inf, far), axis=0)
        times.append(t)
        outputs.append(here[1:])
        rates.append(slopes[best, np.arange(order)])
    return _worst(np.array(times), np.array(outputs), np.array(rates))


def _slopes(block: Any, t: float, x: np.ndarray, rows: list[int]) -> np.ndarray:
    """Return the derivatives of yd, ..., yd^(n-1) by each step, shape (steps, n)."""
    none = np.zeros(0)
    rate = rates_now(block, t, x, none) if block.nstates else none

    def along(s: float) -> np.ndarray:
        return outputs_now(block, t + s, x + s * rate, none)[rows[:-1]]

    with np.errstate(all="ignore"):
        return np.array([
            sum(w * (along(j * h) - along(-j * h)) for j, w in enumerate(WEIGHTS, 1)) / h
            for h in _STEPS
        ])  # fmt: skip


def _worst(t: np.ndarray, outputs: np.ndarray, rates: np.ndarray) -> Margin:
    """Return the equality for the derivative that is farthest off, relative to its size."""
    size = np.max(np.maximum(np.abs(outputs), np.abs(rates)), axis=0)
    size = np.where(size > 0, size, 1.0)
    k = int(np.argmax(np.max(np.nan_to_num(np.abs(outputs - rates), nan=np.inf) / size, axis=0)))
    return equality(
        "(yd)", "yd1, ..., ydn are the derivatives of yd", t, outputs[:, k], rates[:, k],
        float(size[k]), _TOLERANCE,
    )  # fmt: skip
