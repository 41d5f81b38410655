"""The stiff method's Jacobian of a function that is called as it stands."""

import control as ct
import numpy as np
from scipy.integrate import quad_vec

import nlctl
from nlctl.native.along import derivatives


def update(t, x, u, p):
    return [-p["a"] * x[0] + quad_vec(lambda s: np.cos(s * x[0]), 0, 1)[0]]


def test_one_result():
    """x' = -a x + sin(x) / x has the derivative -a + (x cos x - sin x) / x^2."""
    plant = ct.nlsys(
        update, lambda t, x, u, p: x, inputs=0, outputs=["x"], states=["x"], params={"a": 1.0},
        name="plant",
    )  # fmt: skip
    compiled = nlctl.compile(plant)
    made = derivatives(compiled, compiled.parameter_vector())
    assert made is not None
    lanes = made.c.shape[1]
    t, x, u = np.zeros(lanes), np.full((1, lanes), 0.3), np.zeros((0, lanes))
    direction, rate = np.zeros((2, lanes)), np.zeros((1, lanes))
    direction[0] = 1.0
    made.point(t, x, u, made.c)
    made.function(t, x, u, made.c, direction, rate)
    known = -1 + (0.3 * np.cos(0.3) - np.sin(0.3)) / 0.09
    assert np.allclose(rate, known, rtol=0, atol=1e-9)
