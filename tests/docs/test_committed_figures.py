"""The figures that pages of the repository show are those that their commands draw today."""

import re
import subprocess
import sys
from collections import Counter

import numpy as np
import pandas as pd
import pytest
from actuator_limits import ACTUATOR_RECORD, figure_files
from matplotlib import __version__
from places import ROOT
from typer.testing import CliRunner

from nlctl.analysis.cli.main import app

DOCS = ROOT / "docs"
NUMBER = re.compile(r"-?\d+\.\d+|-?\d+")


def colours_and_texts(svg):
    """Count colours, and the texts that Matplotlib names above their letters."""
    return Counter(re.findall(r"#[0-9a-f]{6}\b|<!-- .* -->", svg))


def places(svg):
    """Return the coordinates of curves and marks, whatever their shapes are called."""
    paths = re.findall(r' (?:d|x|y|transform)="([^"]*)"', svg)
    return np.array([float(n) for path in paths for n in NUMBER.findall(path)])


def drawn_by_the_command_line(folder, *words):
    path = folder / "drawn.svg"
    result = CliRunner().invoke(app, [*words, str(path)])
    assert result.exit_code == 0, result.output
    return path.read_text(encoding="utf-8")


def drawn_by_the_script(folder):
    script = DOCS / "explanation" / "between_steps.py"
    subprocess.run([sys.executable, "-W", "error", str(script), str(folder)], check=True)
    return (folder / "between-steps.svg").read_text(encoding="utf-8")


def test_every_committed_figure_is_drawn_again_here():
    committed = {str(path.relative_to(DOCS)) for path in DOCS.glob("[!_]*/*.svg")}
    committed |= {path.name for path in DOCS.glob("*.svg")}
    assert committed == {
        "example-1.svg", "diagram-1.svg", "explanation/between-steps.svg",
        *(f"explanation/{name}" for name in figure_files(pd.read_csv(ACTUATOR_RECORD))),
    }  # fmt: skip


@pytest.mark.parametrize("name", ["actuators-1.svg", "actuators-2.svg"])
def test_figures_of_the_actuators_are_those_of_the_record(name):
    """Also each mark's place, with the version of Matplotlib that the file was drawn by."""
    kept = (DOCS / "explanation" / name).read_text(encoding="utf-8")
    today = figure_files(pd.read_csv(ACTUATOR_RECORD))[name].decode()
    assert colours_and_texts(kept) == colours_and_texts(today)
    if f"Matplotlib v{__version__}," in kept:
        np.testing.assert_allclose(places(kept), places(today), atol=1e-3)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "drawn"),
    [
        (
            "example-1.svg",
            lambda folder: drawn_by_the_command_line(folder, "simulate", "example-1", "--plot"),
        ),
        (
            "diagram-1.svg",
            lambda folder: drawn_by_the_command_line(
                folder, "diagram", "example-1", "--expand", "-o"
            ),
        ),
        ("explanation/between-steps.svg", drawn_by_the_script),
    ],
)
def test_figures_are_what_their_commands_draw(tmp_path, name, drawn):
    """The commands stand below the figures; the script checks each curve against closed forms."""
    kept = (DOCS / name).read_text(encoding="utf-8")
    assert colours_and_texts(kept) == colours_and_texts(drawn(tmp_path))
