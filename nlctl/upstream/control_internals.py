"""python-control's private names; ``tests/upstream/test_control_internals.py`` has a test of each.

- ``NonlinearIOSystem._update_params(params)``: takes the overrides of a run; a diagram hands them
  to its parts.  ``dynamics`` and ``output`` call it first.
- ``NonlinearIOSystem._current_params``: what the equations get from then on.
- ``NonlinearIOSystem._rhs(t, x, u)`` and ``_out(t, x, u)``: the equations with these parameters.
- ``InterconnectedSystem._compute_static_io(t, x, u)``: inputs of its parts, one after the other.
- ``InputOutputSystem`` reads its own ``name``, ``dt``, sizes and ``*_index`` and writes them in its
  ``__init__`` only: a subclass can have them as properties.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import control as ct
import numpy as np

from .systems import System

RESOLVED = ("_current_params",)
"""Attributes that a run writes into a system."""


def set_parameters(system: ct.NonlinearIOSystem, params: Mapping[str, Any] | None) -> None:
    """Let a system's equations have these overrides from now on; None for its own values."""
    system._update_params(params)


def current_parameters(system: Any) -> Any:
    """Return the parameters that a block's equations have now."""
    return system._current_params


def rates_now(system: Any, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return derivatives, or next states, with the parameters that a system has now."""
    if not _is_plain_diagram(system):
        return np.asarray(system._rhs(t, x, u)).reshape(-1)
    return _rates_of_parts(system, t, x, _signals_now(system, t, x, u)[0])


def outputs_now(system: Any, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return outputs with the parameters that a system has now."""
    if not _is_plain_diagram(system):
        return np.asarray(system._out(t, x, u)).reshape(-1)
    return _without_zeros(system.output_map, _signals_now(system, t, x, u)[1])


def rates_and_outputs_now(
    system: Any, t: float, x: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return both, as `rates_now` and `outputs_now` do; a diagram's signals are computed once."""
    if not _is_plain_diagram(system):
        return (
            rates_now(system, t, x, u) if system.nstates else np.empty(0),
            outputs_now(system, t, x, u) if system.noutputs else np.empty(0),
        )
    inputs, outputs = _signals_now(system, t, x, u)
    return _rates_of_parts(system, t, x, inputs), _without_zeros(system.output_map, outputs)


def _is_plain_diagram(system: object) -> bool:
    if not isinstance(system, ct.InterconnectedSystem):
        return False
    names = ("_rhs", "_out", "_compute_static_io")
    return all(
        getattr(getattr(system, name), "__func__", None) is getattr(ct.InterconnectedSystem, name)
        for name in names
    )


def _rates_of_parts(
    system: ct.InterconnectedSystem, t: float, x: np.ndarray, inputs: np.ndarray
) -> np.ndarray:
    rates = np.zeros(system.nstates or 0)
    for part, states, given, _ in _places_of_parts(system):
        if part.nstates:
            rates[states] = rates_now(part, t, x[states], inputs[given])
    return rates


def _signals_now(
    system: ct.InterconnectedSystem, t: float, x: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs and outputs of all parts: python-control's, or ours where it finds none."""
    # python-control's first pass has inputs of 0, and it multiplies every output by every
    # element of its maps: 0/0 in one part makes every signal 0 * NaN for good, which it calls
    # a loop.
    signals = _settled_signals(system, t, x, u)
    if signals is not None:
        return signals
    try:
        return system._compute_static_io(t, x, u)
    except RuntimeError:
        signals = _settled_signals(system, t, x, u, outputs_now, _without_zeros, equal_nan=True)
        if signals is None:
            raise
        return signals


def _outputs_if_settled(part: Any, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray | None:
    if not _is_plain_diagram(part):
        return part._out(t, x, u).reshape(-1)
    signals = _settled_signals(part, t, x, u)
    return None if signals is None else part.output_map @ signals[1]


def _settled_signals(
    system: ct.InterconnectedSystem, t: float, x: np.ndarray, u: np.ndarray,
    answer: Callable[[Any, float, np.ndarray, np.ndarray], np.ndarray | None] = _outputs_if_settled,
    product: Callable[[Any, Any], np.ndarray] = np.matmul, equal_nan: bool = False,
) -> tuple[np.ndarray, np.ndarray] | None:  # fmt: skip
    """Return what the passes of ``_compute_static_io`` come to, None where they come to no end."""
    # Parts whose inputs are as they were a pass before are not asked again.
    outside = product(system.input_map, u)
    inputs, places = outside, [*_places_of_parts(system)]
    count, outputs = system.connect_map.shape[1], np.zeros(sum(system.connect_map.shape))
    before: list[bytes | None] = [None] * len(places)
    for _ in range(len(places) + 1):
        for i, (part, states, given, places_of_outputs) in enumerate(places):
            asked = inputs[given].tobytes()
            if asked != before[i]:
                values = answer(part, t, x[states], inputs[given])
                if values is None:
                    return None
                outputs[places_of_outputs], before[i] = values, asked
        now = product(system.connect_map, outputs[:count]) + outside
        if np.array_equal(inputs, now, equal_nan=equal_nan):
            outputs[count:] = inputs
            return inputs, outputs
        inputs = now
    return None


def _places_of_parts(system: ct.InterconnectedSystem) -> Iterator[tuple[Any, slice, slice, slice]]:
    """Yield the parts of a diagram, with the places of their states, inputs and outputs."""
    n = m = k = 0
    for part in system.syslist:
        ends = n + (part.nstates or 0), m + (part.ninputs or 0), k + (part.noutputs or 0)
        yield part, slice(n, ends[0]), slice(m, ends[1]), slice(k, ends[2])
        n, m, k = ends


def _without_zeros(matrix: object, values: object) -> np.ndarray:
    """Return a product with a matrix whose zeros stay zeros, also times NaN."""
    matrix = np.asarray(matrix)
    return np.sum(np.where(matrix == 0, 0.0, matrix * np.asarray(values)), axis=1)


def parts_now(
    system: System, t: float, x: np.ndarray, u: np.ndarray
) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """Yield the blocks of a diagram, nested ones flattened, with their states and inputs."""
    if not isinstance(system, ct.InterconnectedSystem):
        yield system, x, u
        return
    inputs, _ = _signals_now(system, t, x, u)
    for part, states, given, _ in _places_of_parts(system):
        yield from parts_now(part, t, x[states], inputs[given])


class OwnParameters(ct.NonlinearIOSystem):
    """A system that makes what its equations get of the overrides that python-control has."""

    reads_a_dict = False

    def _taken(self, params: Mapping[str, Any]) -> Any:
        """Return what the equations get, of the overrides of a run."""
        raise NotImplementedError

    def _answer(self, t: float, x: object, u: object) -> Any:
        """Return its outputs, with the parameters that it has now."""
        return super()._out(t, x, u)

    def _update_params(self, params: Mapping[str, Any] | None) -> None:
        self._current_params = type(self)._taken(self, params or {})

    def _out(self, t: float, x: object, u: object) -> Any:
        return type(self)._answer(self, t, x, u)  # an object of others may have one of its own


class Around(ct.NonlinearIOSystem):
    """A system around another one, ``inner``, with its parameters and equations of its own.

    ``sampling`` is the block with the parameters of its clock.
    """

    inner: Any
    sampling: Any

    def rates(self, t: float, x: object, u: object) -> np.ndarray:
        """Return its derivatives."""
        raise NotImplementedError

    def _answer(self, t: float, x: object, u: object) -> np.ndarray:
        """Return its outputs."""
        raise NotImplementedError

    def override(self, params: Mapping[str, Any] | None) -> None:
        """Let the system inside have these overrides from now on."""
        set_parameters(self.inner, params)

    def _update_params(self, params: Mapping[str, Any] | None) -> None:
        self.override(params)

    @property
    def _current_params(self) -> Any:
        return current_parameters(self.inner)

    @_current_params.setter
    def _current_params(self, values: object) -> None:
        """Nothing: they are those of the system inside, which has them already."""

    def _rhs(self, t: float, x: object, u: object) -> np.ndarray:
        return self.rates(t, x, u)

    def _out(self, t: float, x: object, u: object) -> np.ndarray:
        return self._answer(t, x, u)


class StandIn(ct.InputOutputSystem):
    """What python-control takes for another system: with its names, sizes and equations.

    ``ct.linearize`` asks for the type before it asks the system.
    """

    system: Any
    name = property(lambda self: self.system.name)
    dt = property(lambda self: self.system.dt)
    params = property(lambda self: self.system.params)
    ninputs = property(lambda self: self.system.ninputs)
    noutputs = property(lambda self: self.system.noutputs)
    nstates = property(lambda self: self.system.nstates)
    input_index = property(lambda self: self.system.input_index)
    output_index = property(lambda self: self.system.output_index)
    state_index = property(lambda self: self.system.state_index)

    def _update_params(self, params: Mapping[str, Any] | None) -> None:
        set_parameters(self.system, params)

    def _rhs(self, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return rates_now(self.system, t, x, u)

    def _out(self, t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return outputs_now(self.system, t, x, u)


def is_system(thing: object) -> bool:
    """Whether a thing is a system itself, and does not stand for one."""
    return isinstance(thing, ct.InputOutputSystem) and not isinstance(thing, StandIn)


def takes_a_dict(system: Any) -> bool:
    """Whether a system's equations get its parameters as python-control has them, in a dict."""
    usual = type(system)._update_params is ct.NonlinearIOSystem._update_params
    return usual or (isinstance(system, OwnParameters) and type(system).reads_a_dict)


def state_space(
    matrices: tuple[np.ndarray, ...], dt: object, names: Mapping[str, Any]
) -> ct.StateSpace:
    """Return the linear system of A, B, C and D; control.StateSpace refuses most without inputs."""
    A, B, C, D = matrices
    if B.shape[1]:
        return ct.StateSpace(A, B, C, D, dt, remove_useless_states=False, **names)
    given = {name: value for name, value in names.items() if name != "inputs"}
    one = np.zeros((len(A), 1)), C, np.zeros((len(C), 1))
    linear = ct.StateSpace(A, *one, dt, remove_useless_states=False, **given)
    linear.B, linear.D = B, D
    linear.set_inputs([])
    return linear
