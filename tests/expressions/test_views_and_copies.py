"""Which arrays are views of others and which are copies: what is written into one tells them apart.

NumPy decides it in python-control's calls, so that a traced function must decide it alike.
"""

import control as ct
import numpy as np
import pytest
from user_function_checks import Plain, Points, agrees, expected

import nlctl

COPIES = (
    lambda a: +a,
    lambda a: np.positive(a),
    lambda a: np.conj(a),
    lambda a: a.astype(float),
    lambda a: a[::2].ravel(),
    lambda a: np.ravel(a[::2]),
    lambda a: a[::-1].ravel(),
    lambda a: a.reshape(2, 2)[:, 0].ravel(),
    lambda a: a.reshape(2, 2).T.ravel(),
    lambda a: np.hsplit(a.reshape(2, 2), 2)[0].ravel(),
    lambda a: np.dsplit(a.reshape(1, 2, 2), 2)[0].ravel(),
    lambda a: np.ascontiguousarray(a[::2]),
    lambda a: np.ascontiguousarray(a.reshape(2, 2).T)[0],
    lambda a: a.reshape(1, 4).sum(axis=0),
    lambda a: np.sum(a.reshape(1, 4), axis=0, keepdims=True)[0],
    lambda a: np.add.reduce(a.reshape(1, 4)),
    lambda a: a.reshape(1, 4).max(axis=0),
    lambda a: a.reshape(1, 4).prod(axis=0),
    lambda a: np.einsum("ij->i", a.reshape(2, 2)),
    lambda a: a.reshape(2, 2).ravel("F"),
)
VIEWS = (
    lambda a: a.conj(),
    lambda a: a.astype(float, copy=False),
    lambda a: np.array(a, copy=None),
    lambda a: np.asarray(a, dtype=float),
    lambda a: np.ascontiguousarray(a[1:3]),
    lambda a: np.ravel(a[1:3]),
    lambda a: a[::2].reshape(-1),
    lambda a: a.reshape(2, 2).ravel(),
    lambda a: a.reshape(2, 2).T.ravel("F"),
    lambda a: np.vsplit(a.reshape(2, 2), 2)[0].ravel(),
    lambda a: np.einsum("i->i", a),
    lambda a: np.einsum("ij->ji", a.reshape(2, 2))[0],
    lambda a: np.einsum("ii->i", a.reshape(2, 2)),
)


@pytest.mark.parametrize("size", [4, 48])
@pytest.mark.parametrize("part", [*COPIES, *VIEWS], ids=lambda f: f.__code__.co_firstlineno)
def test_what_is_written_into_one_array_is_seen_in_another_as_in_numpy(part, size):
    """Both arrays are written to, and both are returned; 48 elements are a long array."""

    def update(t, x, u, params):
        a = 2.0 * x
        b = part(a[:4])
        b[0] = 5.0
        b[-1] += x[1]
        a[:3] += 2.0
        return a + 10.0 * np.resize(b, x.size)

    a = np.arange(4.0)
    assert np.shares_memory(part(a), a) == (part in VIEWS)
    system = ct.nlsys(update, None, states=size, inputs=0, outputs=size, name="block")
    compiled = nlctl.compile(system)
    rng = np.random.default_rng(size)
    at = Points(np.zeros(5), rng.normal(size=(size, 5)), np.zeros((0, 5)))
    if compiled.equations.calls:
        assert size > 4  # parts of long arrays are called as they stand where views are not known
        return
    rates, _ = Plain(compiled).run(at)
    for lane in range(5):
        want, _ = expected(system, at.at(lane))
        assert agrees(rates[:, lane], want)
