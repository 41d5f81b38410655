"""What a user installs: the wheel, in a fresh environment, from an empty folder."""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import numpy
import pytest
from extras import needed
from places import ROOT

pytestmark = pytest.mark.ci


def run(*command, cwd):
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "COV_"))}
    return subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, check=True, timeout=600
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel built from a copy of the sources, which stay as they are."""
    needed("build", "dev")
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    ignored = shutil.ignore_patterns(".git", ".venv*", "__pycache__", ".*_cache", "*.egg-info")
    shutil.copytree(ROOT, source, ignore=ignored)
    run(sys.executable, "-m", "build", "--wheel", "--outdir", str(folder), str(source), cwd=folder)
    (made,) = folder.glob("*.whl")
    return made


def test_wheel_holds_both_packages_and_their_data(wheel):
    """Templates, expected figures, type information, licence."""
    names = set(zipfile.ZipFile(wheel).namelist())
    for name in (
        *("nlctl/__init__.py", "nlctl/__init__.pyi", "nlctl/py.typed", "nlctl/controllers/rbf.py"),
        *("analysis/py.typed", "analysis/paper/expected.csv"),
        *("analysis/report/templates/report.html", "analysis/report/templates/report.css"),
        *("analysis/report/templates/report.js", "analysis/report/templates/gallery.html"),
        "analysis/studies/reports/example-1-quick.toml",
        "analysis/paper/example-2-burst.csv",
        *("analysis/report/fonts/nlctl-math.woff2", "analysis/report/fonts/OFL.txt"),
        *("analysis/report/templates/history.js", "analysis/report/templates/history.css"),
        *("analysis/report/vendor/uplot/uPlot.iife.min.js", "analysis/report/vendor/uplot/LICENSE"),
        "analysis/report/vendor/uplot/uPlot.min.css",
    ):
        assert name in names
    assert any(name.endswith("LICENSE") for name in names)
    assert not any(name.startswith(("tests", "reports")) for name in names)


def test_wheel_runs_in_a_fresh_environment(wheel, tmp_path):
    """The console script lists, simulates and draws from an empty folder.

    Everything that it depends on is borrowed from the environment of the tests.
    """
    fresh, empty = tmp_path / "fresh", tmp_path / "empty"
    empty.mkdir()
    run(sys.executable, "-m", "venv", "--without-pip", str(fresh), cwd=tmp_path)
    places = sysconfig.get_paths("venv", {"base": str(fresh), "platbase": str(fresh)})
    python = str(Path(places["scripts"]) / "python")
    command = (sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps")
    run(*command, str(wheel), cwd=empty)
    borrowed = Path(numpy.__file__).parents[1]  # comes after the environment's own packages
    (Path(places["purelib"]) / "borrowed.pth").write_text(f"{borrowed}\n", encoding="utf-8")
    where = run(python, "-c", "import nlctl; print(nlctl.__file__)", cwd=empty).stdout
    assert Path(where).is_relative_to(fresh)
    script = str(Path(places["scripts"]) / "nlctl")
    assert "DeadZone" in run(script, "list", cwd=empty).stdout
    run(script, "simulate", "example-2", "--until", "0.1", "--csv", "out.csv", cwd=empty)
    run(script, "diagram", "example-1", "-o", "loop.svg", cwd=empty)
    assert sorted(p.name for p in empty.iterdir()) == ["loop.svg", "out.csv"]
