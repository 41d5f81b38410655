"""What a first script gets wrong: the error says what to write instead."""

from typing import Any

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis import robustness
from nlctl.analysis.lyapunov import certify
from nlctl.errors import BlockError, DiagramError, ParameterError, UnknownNameError

LAG = nlctl.block(nlctl.Lag(), "lag")
T = [0.0, 0.5, 1.0]


def undecorated():
    """A record whose equation lacks its decorator."""

    @nlctl.record
    class Twice:
        inputs, outputs = ("u",), ("v",)

        def output(t, x, u, p):  # noqa: N805 (what is wrong with it)
            return (2.0 * u[0],)

    return nlctl.block(Twice(), "twice")


def lead_of_nothing():
    """A diagram whose reference comes from outside."""
    plant = ct.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]], inputs="r", outputs="y", name="plant")
    return nlctl.interconnect([plant], outputs="y")


def ensemble(**options):
    return nlctl.ensemble_response(LAG, T, 1.0, params={"lag.T": [0.5, 1.0]}, **options)


anything: Any = nlctl
spec_of: Any = robustness.Spec
SAID: dict[str, tuple[Any, type[Exception], str]] = {
    "a decorator": (undecorated, BlockError, "write @nlctl.equation above output"),
    "an input from outside": (lead_of_nothing, DiagramError, r"inputs=\['r'\]"),
    "an input by name": (
        lambda: nlctl.input_output_response(LAG, T, {"u": 1.0}),
        ParameterError,
        r"give their samples, a row for each of \['u'\]",
    ),
    "a method of MATLAB": (
        lambda: nlctl.input_output_response(LAG, T, method="ode45"),
        UnknownNameError,
        "those of SciPy, 'RK45' say",
    ),
    "a signal that was not kept": (
        lambda: ensemble().signals["v"],
        UnknownNameError,
        r"ensemble_response\(..., keep=\[...\]\); known: none",
    ),
    "members as columns": (
        lambda: nlctl.ensemble_response(LAG, T, 1.0, X0=np.zeros((1, 3))),
        ParameterError,
        r"\(member 0\); a row is a member",
    ),
    "a field by its place": (
        lambda: spec_of("always |v| <= 1"),
        TypeError,
        r"by name: Spec\(requirements=...\)",
    ),
    "a function of the analysis": (
        lambda: anything.certify,
        AttributeError,
        "it is nlctl.analysis.lyapunov.certify",
    ),
    "a loop of the paper": (
        lambda: certify(nlctl.paper.example_1()),
        DiagramError,
        "nlctl.mrac, nlctl.sliding_mode and nlctl.adaptive_neural",
    ),
}


@pytest.mark.parametrize("what", SAID)
def test_the_error_says_the_next_step(what):
    """Nobody has to look it up."""
    attempt, error, words = SAID[what]
    with pytest.raises(error, match=words):
        attempt()


def test_a_signal_that_was_kept_is_an_array_as_before():
    """Only what is missing has another answer: a lag of 1 is 1 - exp(-t)."""
    signals = ensemble(keep=["v"]).signals
    assert list(signals) == ["v"]
    assert "u" not in signals
    assert signals.get("u") is None
    assert np.allclose(signals["v"][1], 1.0 - np.exp(-np.asarray(T)), atol=1e-6)


def test_a_name_that_is_none_in_c_is_made_one():
    """A diagram may be called as its folder; what was asked for by name is not changed."""
    loop = nlctl.interconnect([LAG], inputs="u", outputs="v", name="my-lag")
    assert nlctl.export.export_equations(loop).name == "my_lag"
    with pytest.raises(ParameterError, match="'my-lag' is not a name in C"):
        nlctl.export.export_equations(loop, name="my-lag")
