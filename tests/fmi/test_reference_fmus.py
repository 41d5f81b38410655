"""The Reference FMUs of the Modelica Association move as published, and as their equations say.

`NLCTL_REFERENCE_FMUS` names a checkout of https://github.com/modelica/Reference-FMUs; without it
these tests are skipped.
"""

import os
import subprocess
import zipfile
from pathlib import Path

import control as ct
import numpy as np
import pytest
from extras import needed, needed_program
from fmi_models import check_bounces

import nlctl
from nlctl.errors import UsageError

pytestmark = pytest.mark.ci
SOURCES = Path(os.environ.get("NLCTL_REFERENCE_FMUS", "."))
STEPS = {"Dahlquist": 0.1, "VanDerPol": 0.01, "BouncingBall": 0.01, "Stair": 0.2, "Resource": 1.0}
REFERENCE = {"engine": "python-control"}


@pytest.fixture(scope="module")
def reference_fmu(tmp_path_factory):
    """A function that compiles one of the Reference FMUs."""
    if "NLCTL_REFERENCE_FMUS" not in os.environ:
        pytest.skip("NLCTL_REFERENCE_FMUS names no checkout of the Reference FMUs")
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
    if name == "Stair":
        table = table[table["time"] < 8.7]  # it ends itself by the step to 9 s
    model = nlctl.FMU(path, "model", kind="CoSimulation", dt=STEPS[name])
    times = table["time"] if len(table) > 1 else np.array([0.0, 1.0])
    run = nlctl.input_output_response(model, times, 0, squeeze=False, **REFERENCE)
    for label in table.dtype.names[1:]:
        at = list(model.output_labels).index(label)
        moved = np.asarray(run.outputs)[at].reshape(-1)[: len(table)]
        np.testing.assert_allclose(moved, table[label], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", STEPS)
def test_all_of_both_versions_move_as_published(reference_fmu, name, version):
    moves_as_published(reference_fmu(name, version), name)


@pytest.mark.parametrize("version", [2, 3])
def test_the_ball_bounces_when_it_must(reference_fmu, version):
    """It falls from 1 m and keeps 0.7 of its speed."""
    ball = nlctl.FMU(reference_fmu("BouncingBall", version), "ball", ignore_completed_steps=True)
    check_bounces(ball, 0.7)


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


@pytest.mark.parametrize("version", [2, 3])
def test_van_der_pol_is_its_equations(reference_fmu, version):
    def rates(t, x, u, params):
        return [x[1], (1.0 - x[0] ** 2) * x[1] - x[0]]

    exact = ct.nlsys(rates, lambda t, x, u, p: x, inputs=0, outputs=2, states=2, name="exact")
    model = nlctl.FMU(reference_fmu("VanDerPol", version), ignore_completed_steps=True)
    times = np.linspace(0.0, 10.0, 21)
    run = nlctl.input_output_response(model, times, 0, **REFERENCE)
    other = nlctl.input_output_response(exact, times, 0, [2.0, 0.0])
    np.testing.assert_allclose(run.outputs, other.outputs, atol=1e-5)


def test_who_does_not_mention_completed_steps_is_taken_only_if_told(reference_fmu):
    """FMI 2.0 says that these need them, FMI 3.0 that they do not."""
    with pytest.raises(UsageError, match="ignore_completed_steps"):
        nlctl.FMU(reference_fmu("BouncingBall", 2))
    assert nlctl.FMU(reference_fmu("BouncingBall", 3)).nstates == 3


def test_an_end_that_the_fmu_asks_for_is_an_error_by_name(reference_fmu):
    for version in (2, 3):
        model = nlctl.FMU(reference_fmu("Stair", version), kind="CoSimulation")
        with pytest.raises(UsageError, match=f"Stair_{version}.fmu"):
            nlctl.input_output_response(model, [0.0, 12.0], 0, **REFERENCE)
