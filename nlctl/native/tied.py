"""What a run watches, and is 0 just where a kink or a relay of a condition is.

A tank that runs empty stays within rounding of 0, and a mass that friction holds slides along
v = 0: neither is exactly 0, nor of one sign.  Whether a function that is watched is 0 there is
decided by the kink or the relay that has the same zeros.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ..expressions.evaluate import evaluate_expressions
from ..expressions.graph import Expr, Untraceable
from .diagram.program import count_switching_functions
from .equations.blocks import Equations
from .equations.slides import declared_functions
from .reading import Reading

_NONE = -1
_POINTS = 256
_SIZES = -16.0, 2.0  # decades of states and inputs: next to 0 what differs has another sign
_NEAR = 0.1  # of a parameter
_SMALL = 0.01  # of a function: what is never as near to 0 jumps over it


def tied(reading: Reading) -> np.ndarray:
    """Return for each function that a run watches what it is 0 with.

    A row of a kink, -2 - m for the relay whose mode is state m, or -1.
    """
    count = len(reading.schedule.watched)
    ties = np.full(count, _NONE, dtype=np.int64)
    if not count:
        return ties
    read = reading.equations
    watched = [one.function for one in read.conditions.located[-count:]]
    relays = _relays(reading, read)
    places = {**_kinks(reading, read), **relays}
    for place, function in places.items():
        for k, one in enumerate(watched):
            if one is function:
                ties[k] = place
    try:
        values = _values([*watched, *places.values()], _points(reading, relays))
    except Untraceable:  # there is what is called unchanged
        return ties
    for place, other in zip(places, values[count:], strict=True):
        for k in np.flatnonzero(ties == _NONE):
            jumps = np.abs(values[k]).min() > _SMALL * np.abs(values[k]).max()
            if _have_equal_zeros(np.sign(values[k]), np.sign(other)) and (place < 0 or not jumps):
                ties[k] = place
    return ties


def _kinks(reading: Reading, read: Equations) -> dict[int, Expr]:
    """Return the functions of the blocks' conditions at which nothing jumps, by their rows."""
    kinks, row = {}, reading.program.switching
    for one in read.conditions.located:
        if one.bends and one.block and one.function.size is None:
            kinks[row] = one.function
        row += one.rows
    return kinks


def _relays(reading: Reading, read: Equations) -> dict[int, Expr]:
    """Return what relays of conditions switch at, by their modes."""
    relays, row = {}, 0
    functions = declared_functions(read.results, reading.program.switching)
    for node in reading.schedule.nodes:
        if node.slide is not None and not node.slide.integers:
            relays[-2 - node.state_offset] = functions[row]
        row += count_switching_functions(node)
    return relays


def _values(exprs: Sequence[Expr], arrays: dict[str, np.ndarray]) -> np.ndarray:
    values = evaluate_expressions(exprs, arrays)
    return np.array([np.broadcast_to(value, (_POINTS,)) for value in values])


def _points(reading: Reading, relays: Mapping[int, Expr]) -> dict[str, np.ndarray]:
    """Return random points, with parameters near the run's own; no relay slides there."""
    rng, p = np.random.default_rng(0), reading.parameter_vector()
    states, inputs = reading.system.nstates or 0, reading.schedule.ninputs
    t, x, u, near = (rng.normal(size=(n, _POINTS)) for n in (1, states, inputs, p.size))
    x *= 10.0 ** rng.uniform(*_SIZES, x.shape)
    u *= 10.0 ** rng.uniform(*_SIZES, u.shape)
    modes = [-2 - place for place in relays]
    x[modes] = 1.0
    arrays = {"t": t, "x": x, "u": u, "p": p[:, None] * (1.0 + _NEAR * near)}
    x[modes] = np.sign(_values([*relays.values()], arrays)).reshape(len(modes), _POINTS)
    return arrays


def _have_equal_zeros(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two functions have equal signs everywhere, or opposite ones everywhere, and both."""
    both = one.min() < 0.0 < one.max() and np.all(one != 0.0)
    return bool(both and abs(np.sum(one * other)) == one.size)
