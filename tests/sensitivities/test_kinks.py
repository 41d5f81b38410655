"""Which choices jump: what both ways are where a condition switches."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import block

import nlctl
from nlctl.sensitivities.response import _Kept


def jumps(law, params):
    """How many comparisons of a block count as jumps."""
    compiled = nlctl.compile(block(law, params, ("x", "y")))
    nlctl.sensitivity_response(compiled, [0, 1e-3], with_respect_to=["plant.a"])
    (kept,) = compiled.cache.of(_Kept)
    return len(kept.differentiated.sides.sides)


def dead_zone(t, x, u, p):
    right, left = p["m"] * (x[0] - p["a"]), p["m"] * (x[0] + p["a"])
    inner = np.where(x[0] > 0, right * np.cos(x[1]), left)  # jumps where nothing sees it
    return [1.0, np.where((x[0] > -p["a"]) & (x[0] < p["a"]), 0.0, inner)]


@pytest.mark.parted
@pytest.mark.parametrize(
    ("law", "count"),
    [
        (lambda t, x, u, p: [1.0, np.where(x[0] > p["a"], x[0] - p["a"], 0.0)], 0),
        (lambda t, x, u, p: [1.0, np.where(x[0] > p["a"], x[0] - p["m"], 0.0)], 1),
        (lambda t, x, u, p: [1.0, np.where(x[0] > p["a"], 1.0, 0.0)], 1),
        (lambda t, x, u, p: [1.0, np.where((x[0] > p["a"]) & (x[1] > 0), 1.0, 0.0)], 2),
        (lambda t, x, u, p: [1.0, np.where(x[0] > 0, x[0] * x[1], -x[0]) + np.abs(x[1])], 0),
        (lambda t, x, u, p: [1.0, np.sign(x[0]) + np.floor(x[1])], 2),
        (lambda t, x, u, p: [1.0, np.where(x[1] > 9, np.where(x[0] > p["a"], 1.0, 0.0), 0.0)], 2),
        (dead_zone, 0),
    ],
    ids=["kink", "jump of m", "step", "and", "at 0", "rounding", "rarely", "dead zone"],
)
def test_jumps(law, count):
    """With a = m = 0.5, which may be other numbers in the next run."""
    assert jumps(law, {"a": 0.5, "m": 0.5}) == count


def test_norm_at_0():
    """r = |(x, y)| = a t: by a it is t, but for t = 0, where nothing else is lost."""
    plant = ct.nlsys(
        lambda t, x, u, p: [0.6 * p["a"], 0.8 * p["a"]],
        lambda t, x, u, p: [np.sqrt(x[0] ** 2 + x[1] ** 2), x[0]], inputs=0, outputs=["r", "x"],
        states=["x", "y"], params={"a": 2.0}, name="plant",
    )  # fmt: skip
    made = nlctl.sensitivity_response(plant, [0, 0.5, 1], with_respect_to="plant.a")
    assert made.success
    assert np.array_equal(np.isnan(made["r", "plant.a"]), [True, False, False])
    assert np.allclose(made["r", "plant.a"][1:], [0.5, 1])
    assert np.allclose(made["x", "plant.a"], [0, 0.3, 0.6])
