"""FMUs as blocks: the Reference FMUs move as published, and as their equations say."""

import subprocess
import sys
import zipfile
from pathlib import Path

import control as ct
import numpy as np
import pytest
from extras import needed, needed_program
from fmi_models import MODELS
from places import ROOT

import nlctl
from nlctl.errors import ParameterError, UnknownNameError, UsageError

SOURCES = ROOT / "tests" / "fmi" / "reference_fmus"
STEPS = {"Dahlquist": 0.1, "VanDerPol": 0.01, "BouncingBall": 0.01, "Stair": 0.2, "Resource": 1.0}
REFERENCE = {"engine": "python-control"}


@pytest.fixture(scope="module", autouse=True)
def _needed():
    needed("fmpy", "export")
    needed("ziglang", "export")


@pytest.fixture(scope="module")
def reference_fmu(tmp_path_factory):
    """A function that compiles one of the Reference FMUs."""
    folder = tmp_path_factory.mktemp("reference")
    headers = Path(needed("fmpy", "export").__file__).parent / "c-code"

    def build(name, version):
        path = folder / f"{name}_{version}.fmu"
        if path.exists():
            return path
        command = [
            needed_program(("gcc", "clang")), "-shared", "-fPIC", "-O1", "-w",
            f"-DFMI_VERSION={version}", "-DDISABLE_PREFIX", "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
            *(f"-I{f}" for f in (SOURCES / name, SOURCES / "include", headers)),
            SOURCES / name / "model.c", SOURCES / "src" / f"fmi{version}Functions.c",
            SOURCES / "src" / "cosimulation.c", "-lm", "-o", folder / f"{name}.so",
        ]  # fmt: skip
        subprocess.run(command, check=True, capture_output=True)
        place = {2: "linux64", 3: "x86_64-linux"}[version]
        with zipfile.ZipFile(path, "w") as archive:
            archive.write(SOURCES / name / f"FMI{version}.xml", "modelDescription.xml")
            archive.write(folder / f"{name}.so", f"binaries/{place}/{name}.so")
            for extra in SOURCES.joinpath(name).glob("*.txt"):
                archive.write(extra, f"resources/{extra.name}")
        return path

    return build


def published(name):
    """Return the published results: the last row of each time."""
    table = np.genfromtxt(SOURCES / name / f"{name}_out.csv", delimiter=",", names=True)
    return table[np.append(np.diff(table["time"]) > 0, True)]


def moves_as_published(path, name):
    table = published(name)
    table = (
        table[table["time"] < 8.7] if name == "Stair" else table
    )  # it ends itself by the step to 9 s
    model = nlctl.FMU(path, "model", kind="CoSimulation", dt=STEPS[name])
    times = table["time"] if len(table) > 1 else np.array([0.0, 1.0])
    run = nlctl.input_output_response(model, times, 0, squeeze=False, **REFERENCE)
    for label in table.dtype.names[1:]:
        at = list(model.output_labels).index(label)
        found = np.asarray(run.outputs)[at].reshape(-1)[: len(table)]
        np.testing.assert_allclose(found, table[label], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["BouncingBall", "Stair"])
def test_co_simulation_moves_as_published(reference_fmu, name):
    moves_as_published(reference_fmu(name, 3), name)


@pytest.mark.ci
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", STEPS)
def test_all_of_both_versions_move_as_published(reference_fmu, name, version):
    moves_as_published(reference_fmu(name, version), name)


@pytest.mark.parametrize("version", [2, 3])
def test_the_ball_bounces_when_it_must(reference_fmu, version):
    """It falls from 1 m and keeps 0.7 of its speed."""
    ball = nlctl.FMU(reference_fmu("BouncingBall", version), "ball")
    run = nlctl.input_output_response(ball, [0.0, 1.5], 0, **REFERENCE)
    first = np.sqrt(2.0 / 9.81)
    exact = first * (1.0 + 2.0 * np.cumsum([0.0, 0.7, 0.7**2]))
    falls = run.events["time"][run.events["direction"] == "falling"].unique()
    assert all(np.abs(falls - t).min() < 1e-8 for t in exact[exact < 1.5])


def test_its_parameters_are_those_of_the_block(reference_fmu):
    ball = nlctl.FMU(reference_fmu("BouncingBall", 3), "ball")
    assert nlctl.diagrams.parameters(ball)["value"]["ball.e"] == 0.7
    times = [0.0, 0.4, 0.6]
    run = nlctl.input_output_response(
        ball, times, 0, {"ball.h": 2.0}, params={"ball.g": -1.0}, **REFERENCE
    )
    np.testing.assert_allclose(run.outputs[0], 2.0 - 0.5 * np.square(times), atol=1e-7)


def test_a_linear_decay_is_an_exponential(reference_fmu):
    model = nlctl.FMU(reference_fmu("Dahlquist", 3))
    times = np.linspace(0.0, 5.0, 11)
    run = nlctl.input_output_response(model, times, 0, **REFERENCE)
    np.testing.assert_allclose(run.outputs[0], np.exp(-times), rtol=1e-6, atol=1e-8)


def test_time_events_count_the_seconds(reference_fmu):
    model = nlctl.FMU(reference_fmu("Stair", 3))
    run = nlctl.input_output_response(model, [0.0, 0.5, 1.5, 2.5, 3.5], 0, **REFERENCE)
    np.testing.assert_array_equal(run.outputs[0], [1.0, 1.0, 2.0, 3.0, 4.0])


@pytest.mark.ci
@pytest.mark.parametrize("version", [2, 3])
def test_van_der_pol_is_its_equations(reference_fmu, version):
    def rates(t, x, u, params):
        return [x[1], (1.0 - x[0] ** 2) * x[1] - x[0]]

    exact = ct.nlsys(rates, lambda t, x, u, p: x, inputs=0, outputs=2, states=2, name="exact")
    model = nlctl.FMU(reference_fmu("VanDerPol", version))
    times = np.linspace(0.0, 10.0, 21)
    run = nlctl.input_output_response(model, times, 0, **REFERENCE)
    other = nlctl.input_output_response(exact, times, 0, [2.0, 0.0])
    np.testing.assert_allclose(run.outputs, other.outputs, atol=1e-5)


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
def test_what_is_not_supported_is_refused_by_name(reference_fmu, tmp_path, what):
    change, keywords, words = REFUSED[what]
    path = edited(reference_fmu("BouncingBall", 3), tmp_path, change)
    with pytest.raises((UsageError, ParameterError, UnknownNameError)) as error:
        nlctl.FMU(path, **keywords)
    assert words in str(error.value)


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


def test_an_end_that_the_fmu_asks_for_is_an_error_by_name(reference_fmu):
    for version in (2, 3):
        model = nlctl.FMU(reference_fmu("Stair", version), kind="CoSimulation")
        with pytest.raises(UsageError, match=f"Stair_{version}.fmu"):
            nlctl.input_output_response(model, [0.0, 12.0], 0, **REFERENCE)


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
