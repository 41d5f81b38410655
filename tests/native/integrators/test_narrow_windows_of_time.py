"""Windows of t alone whose edges lie a millionth apart, in three forms: each as wide as it is."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

R, END = 1e-6, 9.0
FORMS = {
    "size": lambda z: np.abs(z) < R,
    "square": lambda z: z**2 < R * R,
    "two sides": lambda z: (z > -R) & (z < R),
    "sizes": lambda z: np.abs(np.abs(z) - 2 * R) < R,  # two windows, from r to 3 r
}


def waves(level):
    """Times in the run at which sin 3t is at a level."""
    first, turns = np.arcsin(level) / 3, 2 * np.pi / 3 * np.arange(-1, 6)
    every = np.concatenate([first + turns, np.pi / 3 - first + turns])
    return np.sort(every[(every > 0) & (every < END)])


def quotients(level):
    """Where t / (1 + t^2) is at a level."""
    root = np.sqrt(1 - 4 * level**2)
    return np.array([(1 - root) / (2 * level), (1 + root) / (2 * level)])


FUNCTIONS = {  # of t, their levels, and where they are at a level
    "wave": (lambda t: np.sin(3 * t), 0.5, waves),
    "quotient": (lambda t: t / (1 + t * t), 0.3, quotients),
    "tanh": (lambda t: np.tanh(3 * (t - 2)), 0.3, lambda c: np.array([2 + np.arctanh(c) / 3])),
    "square": (lambda t: t * t - 1.3 * t, 2.0, lambda c: np.array([0.65 + np.sqrt(0.4225 + c)])),
}


@pytest.mark.parametrize(
    ("how", "form", "name"),
    crossed(
        [
            {"method": "tsit5"},
            {"method": "rodas5p"},
            {"method": "taylor"},
            {"engine": "python-control"},
        ],
        [*FORMS],
        [*FUNCTIONS],
    ),
)
def test_how_long_windows_are_open(name, form, how):
    function, level, places = FUNCTIONS[name]
    pulsed = ct.nlsys(
        lambda t, x, u, p: [np.where(FORMS[form](function(t) - level), 1 / R, 0.0)],
        lambda t, x, u, p: x, inputs=0, outputs=1, states=1, name="pulsed",
    )  # fmt: skip
    run = nlctl.input_output_response(
        pulsed, [0, END], 0, [0.0], squeeze=True, rtol=1e-9, atol=1e-11, **how
    )
    width = np.abs(places(level + R) - places(level - R)).sum()
    if form == "sizes":
        width = np.abs(places(level + 3 * R) - places(level - 3 * R)).sum() - width
    assert run.outputs[-1] == pytest.approx(width / R, rel=1e-6)
