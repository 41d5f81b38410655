"""FMUs as blocks: what was exported moves as it did; what cannot be a block is refused."""

import functools
import sys
import zipfile

import control as ct
import numpy as np
import pytest
from extras import needed
from fmi_models import MODELS, check_bounces

import nlctl
from nlctl.errors import ParameterError, UnknownNameError, UsageError

pytestmark = pytest.mark.export

REFERENCE = {"engine": "python-control"}


@pytest.fixture(scope="module")
def ball_fmu(tmp_path_factory):
    """A function that exports a bouncing ball."""
    folder = tmp_path_factory.mktemp("ball")

    @functools.cache
    def build(version):
        ball, *_ = MODELS["bouncing ball"]()
        return nlctl.export.fmu(
            ball, folder / f"{version}.fmu", name="ball", version=version, platforms=["linux"]
        )

    return build


@pytest.fixture(scope="module", autouse=True)
def _needed():
    needed("fmpy", "export")
    needed("ziglang", "export")


@pytest.mark.parametrize("version", [2, 3])
def test_the_ball_bounces_when_it_must(ball_fmu, version):
    """It falls from 1 m and keeps 0.8 of its speed."""
    ball = nlctl.FMU(ball_fmu(version), "ball")
    check_bounces(ball, 0.8)


def test_its_parameters_are_those_of_the_block(tmp_path):
    lag = nlctl.block(nlctl.Lag(T=0.5), "lag")
    path = nlctl.export.fmu(lag, tmp_path / "lag.fmu", name="lag", platforms=["linux"])
    model = nlctl.FMU(path, "model")
    assert nlctl.parameters(model)["value"]["model.lag_T"] == 0.5
    times = np.linspace(0.0, 2.0, 5)
    run = nlctl.input_output_response(model, times, 1.0, params={"model.lag_T": 2.0}, **REFERENCE)
    np.testing.assert_allclose(run.outputs, 1.0 - np.exp(-times / 2.0), atol=1e-6)


def test_an_exported_plant_closes_the_loop_that_it_was_in(tmp_path):
    """Out by export, in by FMU: the loop moves as before, with either kind."""
    plant = ct.ss([[0, 1], [-2, -0.5]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y",
                  name="plant")  # fmt: skip
    law = ct.nlsys(lambda t, x, u, p: u[0] - x[0], lambda t, x, u, p: -3.0 * x[0], inputs="y",
                   outputs="u", states=1, name="law")  # fmt: skip
    path = nlctl.export.fmu(plant, tmp_path / "plant.fmu", platforms=["linux"],
                            initial_state={"plant.x[0]": 1.0}, tolerance=1e-10)  # fmt: skip
    times = np.linspace(0.0, 3.0, 13)
    whole = nlctl.interconnect({"plant": plant, "law": law}, outputs="y")
    expected = nlctl.input_output_response(whole, times, 0, {"plant.x[0]": 1.0}).outputs
    for kind, atol in (("ModelExchange", 1e-6), ("CoSimulation", 0.02)):
        more = {"dt": 0.01} if kind == "CoSimulation" else {}
        part = nlctl.FMU(path, "plant", kind=kind, **more)
        loop = nlctl.interconnect({"plant": part, "law": law}, outputs="y")
        found = nlctl.input_output_response(loop, times, 0, **REFERENCE).outputs
        np.testing.assert_allclose(found, expected, atol=atol)


# -- what is refused -------------------------------------------------------------------------------


def edited(path, folder, change):
    """Return an FMU with another description."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(folder / "edited.fmu", "w") as archive:
        for name, data in change(content).items():
            archive.writestr(name, data)
    return folder / "edited.fmu"


def replaced(old, new):
    def change(content):
        text = content["modelDescription.xml"].decode()
        assert old in text
        return content | {"modelDescription.xml": text.replace(old, new).encode()}

    return change


OF_1 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="m" modelIdentifier="m" guid="1"
  numberOfContinuousStates="0" numberOfEventIndicators="0"/>"""

REFUSED = {
    "no library": (
        lambda content: {k: v for k, v in content.items() if not k.startswith("binaries")},
        {}, "has no library for this platform",
    ),
    "states that cannot be kept": (
        replaced('canGetAndSetFMUState="true"', 'canGetAndSetFMUState="false"'), {},
        "its state cannot be read and written",
    ),
    "told of steps": (
        replaced("<ModelExchange", '<ModelExchange needsCompletedIntegratorStep="true"'), {},
        "completedIntegratorStep",
    ),
    "FMI 1.0": (lambda content: {"modelDescription.xml": OF_1.encode()}, {}, "FMI 1.0"),
    "no description": (lambda content: {"a": b""}, {}, "is not an FMU"),
    "dt in Model Exchange": (dict, {"dt": 0.1}, "dt in Co-Simulation alone"),
    "another kind": (dict, {"kind": "Modelica"}, "unknown kind 'Modelica'"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_not_supported_is_refused_by_name(ball_fmu, tmp_path, what):
    change, keywords, words = REFUSED[what]
    path = edited(ball_fmu(3), tmp_path, change)
    with pytest.raises((UsageError, ParameterError, UnknownNameError)) as error:
        nlctl.FMU(path, **keywords)
    assert words in str(error.value)


def test_who_does_not_mention_completed_steps_needs_them_in_fmi_2(ball_fmu, tmp_path):
    """So says FMI 2.0; its caller may know better."""
    silent = edited(ball_fmu(2), tmp_path, replaced(' completedIntegratorStepNotNeeded="true"', ""))
    with pytest.raises(UsageError, match="ignore_completed_steps=True"):
        nlctl.FMU(silent)
    assert nlctl.FMU(silent, ignore_completed_steps=True).nstates == 3


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="there is no file"):
        nlctl.FMU(tmp_path / "none.fmu")


@pytest.mark.ci
def test_exported_memories_are_refused_in_model_exchange(tmp_path):
    diagram, *_ = MODELS["backlash"]()
    path = nlctl.export.fmu(diagram, tmp_path / "m.fmu", name="m", platforms=["linux"])
    with pytest.raises(UsageError, match="completedIntegratorStep"):
        nlctl.FMU(path, kind="ModelExchange")
    model = nlctl.FMU(path, "m", kind="CoSimulation", dt=0.5)
    times = np.linspace(0.0, 5.0, 11)
    found = nlctl.input_output_response(model, times, 0, **REFERENCE).outputs
    expected = nlctl.input_output_response(diagram, times, 0).outputs
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_a_study_may_not_name_it_untrusted(tmp_path):
    """Running a library is trusting it: study files name it only where their user allows it."""
    from nlctl.analysis.studies.code.rule import Grant, check_defined, untrusted

    for reach in ("nlctl", "study"):
        grant = Grant(reach=reach, folder=tmp_path, study="")
        assert untrusted([(("loop",), "nlctl.fmi:FMU")], grant)
        with pytest.raises(ParameterError):
            check_defined(nlctl.FMU, "nlctl:FMU", grant)
    check_defined(nlctl.FMU, "nlctl:FMU", Grant(reach="all", folder=tmp_path, study=""))


def test_without_fmpy_it_is_said_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fmpy", None)
    with pytest.raises(UsageError, match=r"nlctl\[export\]"):
        nlctl.FMU(tmp_path / "none.fmu")
