"""What a diagram computes, as data that can be kept and compared: another loop has another record.

Each block is identified by a key of its functions and of all that these reach
(`nlctl.native.machine.fingerprint`); connections and values are recorded too.  Independently of
any code that is read, python-control's own rates and outputs are evaluated at a few points: they
distinguish two loops where a key cannot, such as that of a function of another language.
"""

import hashlib
import math
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

import control as ct
import numpy as np

from nlctl.blocks import Block, within
from nlctl.diagrams import (
    all_parameter_rows,
    initial_state,
    leaves,
    overridden,
    places,
    state_names,
)
from nlctl.diagrams.points import OTHER_VERSIONS, agree, values_now
from nlctl.native.machine.fingerprint import content_key, content_of, unseen_in
from nlctl.params import declared_params
from nlctl.sampling.clock import moments
from nlctl.sampling.system import Sampled, clocks_of, happening
from nlctl.upstream.systems import System

_T = TypeVar("_T")
_EQUATIONS = ("update", "output", "switching", "commit")
SHAPE = ("inputs", "outputs", "states", "feedthrough", "vector", "memory", "initial")
_POINTS = 6
GOLDEN = (math.sqrt(5) - 1) / 2
GIVEN = re.compile(r"sys\[\d+\]")  # by python-control
_MOST = 4  # differences that a sentence names


def loop_facts(system: ct.InputOutputSystem) -> dict[str, dict[str, str]]:
    """Return what a diagram consists of."""
    return facts_and_unseen(system)[0]


def facts_and_unseen(
    system: ct.InputOutputSystem,
) -> tuple[dict[str, dict[str, str]], dict[str, list[str]]]:
    """Return what a diagram consists of, and what the keys of its blocks cannot see of it."""
    read = {p.path or p.system.name: _read(p.system) for p in leaves(system)}
    start = zip(state_names(system), initial_state(system).tolist(), strict=True)
    wired = [p for p in places(system) if isinstance(p.system, ct.InterconnectedSystem)]
    contents = {
        "blocks": {path: key for path, (key, _) in read.items()},
        "wiring": {p.path or "diagram": _wiring(p.system) for p in wired},
        "parameters": _parameters(system),
        "initial_state": {name: repr(value) for name, value in start if value},
    }
    unseen = {path: reasons for path, (_, reasons) in read.items() if reasons}
    facts = {part: _steady(system, content) for part, content in contents.items()}
    return facts, _steady(system, unseen)


def _steady(system: ct.InputOutputSystem, content: Mapping[str, _T]) -> dict[str, _T]:
    """Number the names that python-control gives, ``sys[7]``, by where they stand."""
    # It counts the systems of a process.
    every = " ".join(place.system.name for place in places(system))
    numbers = {name: f"sys {i}" for i, name in enumerate(dict.fromkeys(GIVEN.findall(every)))}
    return {GIVEN.sub(lambda m: numbers.get(m[0], m[0]), k): v for k, v in content.items()}


def short_key(*things: object) -> str:
    """Return a key of functions, and of all that they reach, short enough to be read."""
    return content_key(*things)[:16]


def unseen_parts(system: ct.InputOutputSystem) -> dict[str, list[str]]:
    """Return what the keys of a diagram's blocks cannot see: they may differ in it unnoticed."""
    return facts_and_unseen(system)[1]


def _read(system: System) -> tuple[str, list[str]]:
    """Return a key of a block's equations, and what it cannot see; values are not in it."""
    if isinstance(system, Sampled):
        equations = short_key(_read(system.inner)[0], *_parts(system)[1:])
        return equations, unseen_in(*_parts(system))
    key, unseen = content_of(*_parts(system))
    return key[:16], unseen


def _parts(system: System) -> list[Any]:
    """Return all that a block's equations are made of, its parameters aside."""
    timebase = repr(system.dt)
    if isinstance(system, Sampled):
        spec = system.sampling.spec
        kind = (system.euler, system.delays, system.converters, spec.waiting, spec.own_time)
        return [_parts(system.inner), repr(kind)]
    if isinstance(system, Block):
        spec, known = system.spec, declared_params(system.spec)
        held = {k: v for k, v in getattr(spec, "__dict__", {}).items() if k not in known}
        parts = [getattr(spec, name, None) for name in (*_EQUATIONS, *SHAPE)]
        return [type(spec), held, parts, timebase]
    if isinstance(system, ct.StateSpace):
        return [[system.A, system.B, system.C, system.D], timebase]
    if isinstance(system, ct.TransferFunction):
        arrays: Any = system.num_array, system.den_array
        return [*([np.asarray(p).tolist() for p in np.ravel(a)] for a in arrays), timebase]
    functions = [getattr(system, name, None) for name in ("updfcn", "outfcn")]
    signals = [system.input_labels, system.output_labels, system.state_labels]
    return [type(system).__qualname__, functions, signals, timebase]


def _wiring(diagram: Any) -> str:
    maps = [np.asarray(m) for m in (diagram.connect_map, diagram.input_map, diagram.output_map)]
    parts = [[s.input_labels, s.output_labels] for s in diagram.syslist]
    return short_key(maps, parts, diagram.input_labels, diagram.output_labels, repr(diagram.dt))


def _parameters(system: Any) -> dict[str, str]:
    """Return all values, of blocks of any kind."""
    values = {
        f"{place.path or place.system.name}.{name}": value
        for place in leaves(system)
        if not isinstance(within(place.system), Block)
        for name, value in dict(place.system.params or {}).items()
    }
    values |= dict(system.params or {})
    values |= {row.name: row.value for row in all_parameter_rows(system)}
    return {name: value_text(value) for name, value in values.items()}


def value_text(value: object) -> str:
    """Return a text that differs where values of a parameter differ."""
    if isinstance(value, bool | int | float | str | np.generic):
        return repr(value.item() if isinstance(value, np.generic) else value)
    try:
        return array_text(value)
    except (TypeError, ValueError):  # no numbers
        return short_key(value)


def array_text(values: object) -> str:
    """Return a text that differs where arrays of numbers differ."""
    array = np.asarray(values, dtype="<f8")
    return f"{hashlib.sha256(array.tobytes()).hexdigest()[:16]} of shape {array.shape}"


def text_key(text: str) -> str:
    """Return a key of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def loop_values(system: Any, end: float) -> dict[str, float | str]:
    """Return rates of states and outputs, each summed with weights over some points."""
    start, width, simulated = initial_state(system), system.ninputs or 0, overridden(system)
    reach = np.maximum(1.0, abs(start)) / 4
    rates, outputs, raised = np.zeros(start.size), np.zeros(system.noutputs or 0), []
    clocks = clocks_of(place.system for place in leaves(simulated))
    everything = happening(frozenset(moments(clocks)))  # sampled blocks' next states as well
    with warnings.catch_warnings(), np.errstate(all="ignore"), everything:
        warnings.simplefilter("ignore")
        for k in range(_POINTS):
            spread = (GOLDEN * np.arange(1, start.size + width + 1) * (k + 1)) % 1 - 0.5
            x = start + reach * spread[: start.size] * (k > 0)
            t, u = end * k / (_POINTS - 1), spread[start.size :]
            try:
                rate, output = values_now(simulated, (t, x, u))
            except Exception as error:  # whatever a function of the user's raises
                raised.append(f"{type(error).__name__} at point {k}")
                continue
            if not np.isfinite([*rate, *output]).all():  # one point would hide all others
                raised.append(f"no finite values at point {k}")
                continue
            outputs += (1 + k % 3) * output
            rates += (1 + k % 3) * rate
    names = [*(f"{name}'" for name in state_names(system)), *system.output_labels]
    values = dict(zip(names, [*rates.tolist(), *outputs.tolist()], strict=True))
    return _steady(system, values) | ({"raises": ", ".join(raised)} if raised else {})


def values_differ(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return the names of values in two records that rounding does not explain."""
    names = dict.fromkeys([*before, *now])
    return [name for name in names if not _close(before.get(name), now.get(name))]


def _close(one: object, other: object) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        both_nan = math.isnan(one) and math.isnan(other)
        relative, absolute = OTHER_VERSIONS
        return both_nan or bool(agree(one, other, absolute, relative))
    return one == other


def fact_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """Yield in words what differs between two records of `loop_facts`."""
    for part, words in (("blocks", "the equations of '{}'"), ("wiring", "the wiring of '{}'")):
        for name in _changed(old[part], new[part]):
            here, there = name in old[part], name in new[part]
            words_of_part = words.format(name) if here and there else f"'{name}'"
            yield words_of_part + ("" if here and there else " is gone" if here else " is new")
    for part, words, default in (("parameters", "{}", "absent"), ("initial_state", "{}(0)", "0.0")):
        for name in _changed(old[part], new[part]):
            was, now = (content.get(name, default) for content in (old[part], new[part]))
            yield f"{words.format(name)} was {was}, now {now}"


def _changed(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    return [name for name in dict.fromkeys([*old, *new]) if old.get(name) != new.get(name)]


def difference_text(texts: Sequence[str]) -> str:
    """Return differences as one text; of many the first."""
    more = f"; and {len(texts) - _MOST} more" if len(texts) > _MOST else ""
    return "; ".join(texts[:_MOST]) + more
