"""A user's own class of systems is not taken for one of ours, whatever its attributes' names."""

from typing import Any

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.robustness import Requirement, Space, Spec, Uncertain, always, in_band
from nlctl.analysis.robustness.runs.experiment import Experiment
from nlctl.analysis.studies import read_study
from nlctl.native import Settings

T = np.linspace(0.0, 1.0, 11)


class Own(ct.NonlinearIOSystem):
    """A lag, as a class of somebody's with attributes of its own."""

    def __init__(self, **attributes):
        vars(self).update(attributes)
        super().__init__(
            lambda t, x, u, p: [-p["k"] * x[0] + u[0]], lambda t, x, u, p: x,
            inputs=["u"], outputs=["y"], states=["x"], name="own", params={"k": 1.0},
        )  # fmt: skip


ATTRIBUTES = ("inner", "sampling", "spec", "current_spec", "clock", "sampled", "euler", "delays",
              "system", "schedule", "taken", "answer", "override", "rates", "own", "kind", "block",
              "parts", "acts", "samples", "default_state", "plant_order", "memory", "commit",
              "delayed", "sliding", "source", "linearize", "overrides", "scope", "owners",
              "table")  # fmt: skip
VALUES = (0.1, "datasheet 4", {"delayed": 1}, None, ct.ss(-1, 1, 1, 0), nlctl.Lag(), [1, 2],
          lambda *given: 7)  # fmt: skip
USES = {
    "run": lambda s: nlctl.input_output_response(s, T, 1.0, rtol=1e-9).outputs[-1],
    "python-control": lambda s: nlctl.input_output_response(
        s, T, 1.0, engine="python-control", rtol=1e-9).outputs[-1],
    "connected": lambda s: nlctl.input_output_response(
        nlctl.interconnect([s], inputs=["u"]), T, 1.0, rtol=1e-9).outputs[-1],
    "overridden": lambda s: nlctl.input_output_response(
        nlctl.interconnect([s], inputs=["u"]), T, 1.0, params={"own.k": 1.0}, rtol=1e-9
    ).outputs[-1],
    "linearized": lambda s: 1 - np.exp(nlctl.linearize(s, 0).A[0, 0]),
    "ensemble": lambda s: nlctl.ensemble_response(
        s, T, 1.0, keep=["y"], rtol=1e-9).signals["y"][0, -1],
}  # fmt: skip


@pytest.mark.parted(part=6)
@pytest.mark.parametrize("name", ATTRIBUTES)
@pytest.mark.parametrize("use", USES.values(), ids=USES)
def test_attributes_of_a_users_class_mean_nothing(name, use):
    """Every name that classes of nlctl have, with values that they might have."""
    for value in VALUES:
        np.testing.assert_allclose(use(Own(**{name: value})), 1 - np.exp(-1.0), rtol=1e-6)


def test_it_is_printed_drawn_and_typeset():
    loop = nlctl.interconnect([Own(spec="datasheet 4", inner=3)], inputs=["u"])
    assert "own: Own, no feedthrough" in str(nlctl.compile(loop))
    assert "<svg" in nlctl.draw(loop)._repr_svg_()
    assert nlctl.typeset(loop)[0].block == "own"
    assert nlctl.parameters(loop)["value"].to_dict() == {"own.k": 1.0}


study_file: Any = None  # of the fixture below
SPACE = Space(quantities=(Uncertain(name="own.k", bounds=(0.5, 2.0), nominal=1.0),))
SPEC = Spec(
    requirements=(Requirement(key="a", formula=always(in_band("y", upper=1.0)), until=1.0),)
)
ENTRIES = {
    "run": lambda rtol: nlctl.input_output_response(Own(), T, rtol=rtol),
    "python-control": lambda rtol: nlctl.input_output_response(
        Own(), T, rtol=rtol, engine="python-control"),
    "solve_ivp_kwargs": lambda rtol: nlctl.input_output_response(
        Own(), T, solve_ivp_kwargs={"rtol": rtol}),
    "its keywords in python-control": lambda rtol: nlctl.input_output_response(
        Own(), T, solve_ivp_kwargs={"rtol": rtol}, engine="python-control"),
    "ensemble": lambda rtol: nlctl.ensemble_response(Own(), T, rtol=rtol),
    "settings": lambda rtol: Settings(rtol=rtol),
    "experiment": lambda rtol: Experiment(
        build=Own, space=SPACE, spec=SPEC, timepts=T, rtol=rtol),
    "study": lambda rtol: read_study(study_file(rtol)),
}  # fmt: skip


@pytest.fixture
def file(tmp_path):
    def made(rtol):
        path = tmp_path / "study.toml"
        path.write_text(
            'loop = "example-1"\nstudy = { title = "t", seed = 1 }\nspec.a = "always |e| <= 10"\n'
            f"time = {{ end = 1.0, step = 0.1 }}\nsolver.rtol = {rtol}\n"
            '[[quantities]]\nname = "actuator.b_r"\nbounds = [0.4, 0.6]\n'
        )
        return path

    return made


@pytest.mark.parametrize("rtol", [1.0, 1, 10.0, 1e308, True])
@pytest.mark.parametrize("name", ENTRIES)
def test_a_relative_tolerance_of_one_is_refused(name, rtol, file, monkeypatch):
    """With it no digit of a state need be right; such a run returned -1e11 for -1.9."""
    monkeypatch.setitem(globals(), "study_file", file)
    if name == "study" and rtol is True:
        rtol = 1.0
    with pytest.raises(nlctl.errors.UsageError, match=r"rtol|less than 1"):
        ENTRIES[name](rtol)
