"""Whether a response is one of a loop: outputs are the loop's, and states follow from it."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from typing import Any

import control as ct
import numpy as np

from nlctl.blocks import memory_states
from nlctl.delays.transport import PAST
from nlctl.diagrams import leaves, supplied_blocks
from nlctl.diagrams.points import OF_RESPONSES, agree, rates_and_outputs
from nlctl.errors import DiagramError, DivergedError, EngineWarning
from nlctl.response import input_output_response
from nlctl.sampling.system import clocks_of
from nlctl.sliding.relay import SLIDING
from nlctl.upstream.systems import System, SystemResponse
from nlctl.wording import counted

_PLACES = 12  # samples, and spans between samples, that are compared
_SHORTEST = 1 / 200  # of the response: over shorter spans its states hardly move
_FOLLOWS = 1e-2  # of how far a state moves in a span
_STEPS = 1000  # between two samples: another loop may diverge, in ever shorter steps
_PLAIN: Any = {"method": "LSODA", "solve_ivp_kwargs": {"rtol": 1e-8, "atol": 1e-10}}
_LOCAL = 1e-3  # of a state's largest sample so far: python-control's default tolerance


def own_parameters(loop: Any, response: Any) -> dict[str, Any]:
    """Return the parameters of a response that differ from those of its loop."""
    usual, given = dict(loop.params or {}), dict(response.params or {})
    return {k: v for k, v in given.items() if not np.array_equal(usual.get(k, np.nan), v)}


def check_response(
    loop: Any,
    response: Any,
    params: Mapping[str, Any] | None = None,
    names: Sequence[str] = (),
) -> None:
    """Refuse a response that is not one of a loop."""
    # At twelve samples the outputs must be those that the loop has at the response's states. Over
    # twelve spans between samples the loop is simulated from the states at the beginning and must
    # come to those at the end, to a hundredth of how far each state moves and a thousandth of its
    # largest sample so far. What samples, delays or slides cannot begin anywhere: it is simulated
    # as a whole, and states and outputs at twelve samples are compared. A loop that differs by less
    # counts as this one; a response that was simulated so coarsely that it is wrong by more is
    # refused too.
    params = own_parameters(loop, response) if params is None else dict(params)
    check_shape(loop, response, names)
    t, finite = np.asarray(response.time, dtype=float), np.isfinite(response.x).all(axis=0)
    last = (len(t) if finite.all() else int(np.argmin(finite))) - 1
    places = np.unique(np.linspace(0, last, _PLACES).astype(int))
    if supplied_blocks(loop) or clocks_of(b.system for b in leaves(loop)):
        _check_span(loop, response, params, places, [*(names or loop.output_labels)])
        return
    for place, outputs in own_outputs(loop, response, params):
        _check_outputs(loop, response, place, outputs, names)
    ends = np.searchsorted(t, t + _SHORTEST * (t[last] - t[0]) * (1 - 1e-9))
    for a in places[:-1]:
        _check_span(loop, response, params, np.array([a, min(max(ends[a], a + 1), last)]), [])


def own_outputs(
    loop: System, response: SystemResponse, params: Mapping[str, Any]
) -> Iterator[tuple[int, dict[str, float]]]:
    """Yield a loop's outputs at samples of a response, as python-control evaluates them."""
    x, u, evaluate = _states(response), _inputs(loop, response), rates_and_outputs(loop, params)
    for place in np.unique(np.linspace(0, len(response.time) - 1, _PLACES).astype(int)):
        with np.errstate(all="ignore"):
            _, y = evaluate(float(response.time[place]), x[:, place], u[:, place])
        yield int(place), dict(zip(loop.output_labels, y.tolist(), strict=True))


def check_shape(loop: ct.InterconnectedSystem, response: Any, names: Sequence[str]) -> None:
    """Refuse a response with another number of states, other outputs, or several traces."""
    if response.x is None or np.ndim(response.y) != 2:
        raise DiagramError(
            f"a response of '{loop.name}' needs states and one trace, got outputs of shape "
            f"{np.shape(response.y)}" + (", and no states" if response.x is None else "")
        )
    known, count = list(response.output_labels), np.shape(response.x)[0]
    same = set(names) <= set(known) if names else known == list(loop.output_labels)
    if not same or count != loop.nstates:
        raise DiagramError(
            f"the response is not of '{loop.name}', whose outputs are "
            f"{', '.join(names or loop.output_labels)} and which has "
            f"{counted(loop.nstates or 0, 'state')}: it has {', '.join(known)} and {count}"
        )


def _check_outputs(
    loop: ct.InterconnectedSystem,
    response: Any,
    place: int,
    outputs: Mapping[str, float],
    names: Sequence[str],
) -> None:
    """Refuse outputs at one sample that are not the loop's at the same states."""
    for name in names or loop.output_labels:
        y = np.asarray(response.y[list(response.output_labels).index(name)], dtype=float)
        scale = float(np.nanmax(np.abs(y), initial=1.0))
        if np.isfinite(y[place]) and not agree(y[place], outputs[name], OF_RESPONSES * scale):
            raise _another(loop, name, y[place], response.time[place], outputs[name])


def _check_span(
    loop: System,
    response: SystemResponse,
    params: Mapping[str, Any],
    places: np.ndarray,
    names: list[str],
) -> None:
    """Simulate a loop from the first sample to the last; refuse other states, and named outputs."""
    span = slice(int(places[0]), int(places[-1]) + 1)
    whole, labels = _signals(response, names), [*loop.state_labels, *names]
    given_states = whole[:, span]
    moved = np.abs(np.diff(given_states, axis=1)).sum(axis=1)
    largest = np.abs(whole[:, : span.stop]).max(axis=1)
    allowed = (_FOLLOWS * moved + _LOCAL * largest + np.finfo(float).tiny)[:, None]
    places = places[1:] - places[0]
    for engine in _engines(loop):
        simulated = _again(loop, response, span, params, engine, names)
        wrong = ~(np.abs(simulated - given_states)[:, places] <= allowed)
        if not wrong.any():
            return
    first = int(np.argmax(wrong.any(axis=0)))
    row, k = int(np.argmax(wrong[:, first])), int(places[first])
    t = response.time[span]
    raise _another(loop, labels[row], given_states[row, k], t[k], simulated[row, k], t[0])


def _engines(loop: Any) -> tuple[str, ...]:
    """Whose run a response may be: plain python-control's as well, which relaxes memories."""
    if supplied_blocks(loop, SLIDING):
        return ("auto",)
    remembers = any(memory_states(getattr(leaf.system, "spec", None)) for leaf in leaves(loop))
    is_plain = remembers and not supplied_blocks(loop, PAST)
    is_plain = is_plain and not clocks_of(leaf.system for leaf in leaves(loop))
    return ("auto", "python-control", *(["plain"] if is_plain else []))


def _again(
    loop: Any,
    response: Any,
    span: slice,
    params: Mapping[str, Any],
    engine: str,
    names: list[str],
) -> np.ndarray:
    """Return states, and named outputs, of a loop over some samples; NaN where it does not come."""
    u, steps = _inputs(loop, response)[:, span], count()

    def bounded(t: float) -> None:
        if next(steps) > _STEPS * (span.stop - span.start):
            raise DivergedError("too many steps", t)

    rows = np.full((len(response.x) + len(names), span.stop - span.start), np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", EngineWarning)
        try:
            given: Any = (loop, response.time[span], u if u.size else 0, response.x[:, span.start])
            common: Any = {"params": dict(params), "squeeze": False}
            run: Any = (
                ct.input_output_response(*given, **common, **_PLAIN)
                if engine == "plain"
                else input_output_response(*given, **common, engine=engine, progress=bounded)
            )
        except DivergedError:
            return rows
    rows[:] = _signals(run, names)
    return rows


def _signals(response: Any, names: Sequence[str]) -> np.ndarray:
    """Return the states of a response, and below them the outputs that are named."""
    rows = [list(response.output_labels).index(name) for name in names]
    y = np.reshape(np.asarray(response.y, dtype=float), (-1, len(response.time)))
    return np.concatenate([_states(response), y[rows]])


def _states(response: Any) -> np.ndarray:
    return np.atleast_2d(np.asarray(response.x, dtype=float))


def _inputs(loop: Any, response: Any) -> np.ndarray:
    shape = (loop.ninputs or 0, len(response.time))
    return (
        np.zeros(shape)
        if response.u is None
        else np.asarray(response.u, dtype=float).reshape(shape)
    )


def _another(
    loop: System, name: str, value: float, t: float, simulated: float, since: float | None = None
) -> DiagramError:
    begun = "" if since is None else f" from the states at t = {since:g} s"
    return DiagramError(
        f"the response is not of '{loop.name}': {name} is {value:.6g} at t = {t:g} s, and the loop "
        f"says {simulated:.6g}{begun}; give the parameters that it was run with as params={{...}}"
        + ("" if since is None else ", or simulate it with smaller tolerances")
    )
