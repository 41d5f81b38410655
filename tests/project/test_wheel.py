"""What a user installs: the wheel, in a fresh environment, from an empty folder; and the sdist."""

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path

import numpy
import pytest
from extras import needed
from places import ROOT

pytestmark = pytest.mark.ci

SAFELY = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # Python 3.11.4 and later


def run(*command, cwd):
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "COV_"))}
    return subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, check=True, timeout=600
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, by way of the sdist, built from a copy of the sources, which stay as they are."""
    needed("build", "dev")
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    ignored = shutil.ignore_patterns(".git", ".venv*", "__pycache__", ".*_cache", "*.egg-info")
    shutil.copytree(ROOT, source, ignore=ignored)
    run(sys.executable, "-m", "build", "--outdir", str(folder), str(source), cwd=folder)
    (made,) = folder.glob("*.whl")
    return made


def test_wheel_holds_both_packages_and_their_data(wheel):
    """Templates, expected figures, type information, licence."""
    names = set(zipfile.ZipFile(wheel).namelist())
    for name in (
        *("nlctl/__init__.py", "nlctl/__init__.pyi", "nlctl/py.typed", "nlctl/controllers/rbf.py"),
        *("nlctl/export/fmi/c/machine.c", "nlctl/export/fmi/templates/modelDescription3.xml.j2"),
        *("nlctl/analysis/py.typed", "nlctl/analysis/paper/expected.csv"),
        *(
            "nlctl/analysis/report/templates/report.html",
            "nlctl/analysis/report/templates/report.css",
        ),
        *(
            "nlctl/analysis/report/templates/report.js",
            "nlctl/analysis/report/templates/gallery.html",
        ),
        "nlctl/analysis/studies/reports/example-1-quick.toml",
        "nlctl/analysis/paper/example-2-burst.csv",
        *("nlctl/analysis/report/fonts/nlctl-math.woff2", "nlctl/analysis/report/fonts/OFL.txt"),
        *(
            "nlctl/analysis/report/templates/history.js",
            "nlctl/analysis/report/templates/history.css",
        ),
        *(
            "nlctl/analysis/report/vendor/uplot/uPlot.iife.min.js",
            "nlctl/analysis/report/vendor/uplot/LICENSE",
        ),
        "nlctl/analysis/report/vendor/uplot/uPlot.min.css",
    ):
        assert name in names
    assert any(name.endswith("LICENSE") for name in names)
    others = {name for name in names if not name.startswith(("nlctl/", "nlctl-"))}
    assert others == {"analysis/__init__.py"}  # the former name: no tests, no second copy
    sources = {path.relative_to(ROOT).as_posix() for path in (ROOT / "analysis").rglob("*.py")}
    assert {name for name in names if name.startswith("nlctl/analysis/")} >= {
        f"nlctl/{name}" for name in sources
    }


@pytest.mark.weekly
def test_the_sdist_runs_its_own_tests(wheel, tmp_path):
    """All of them are collected there, and those of a release pass; the README's links lead on."""
    (sdist,) = wheel.parent.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, **SAFELY)
    (folder,) = tmp_path.iterdir()
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "COV_"))}
    environment["PYTHONPATH"] = str(folder)
    for what in (
        ["--collect-only"],
        ["tests/project/test_release.py", "tests/project/test_docs.py"],
    ):
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *what]
        told = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600
        )
        assert told.returncode == 0, told.stdout[-2000:]


def fresh_environment(folder, *what):
    """The interpreter of a new environment with nlctl and nothing else installed.

    Everything that it depends on is borrowed from the environment of the tests.
    """
    run(sys.executable, "-m", "venv", "--without-pip", str(folder), cwd=folder.parent)
    places = sysconfig.get_paths("venv", {"base": str(folder), "platbase": str(folder)})
    python = str(Path(places["scripts"]) / "python")
    command = (sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps")
    run(*command, *what, cwd=folder.parent)
    borrowed = Path(numpy.__file__).parents[1]  # comes after the environment's own packages
    (Path(places["purelib"]) / "borrowed.pth").write_text(f"{borrowed}\n", encoding="utf-8")
    return python, places


@pytest.mark.weekly
def test_wheel_runs_in_a_fresh_environment(wheel, tmp_path):
    """The console script lists, simulates and draws from an empty folder; the former name warns."""
    empty = tmp_path / "empty"
    empty.mkdir()
    python, places = fresh_environment(tmp_path / "fresh", str(wheel))
    where = run(python, "-c", "import nlctl.analysis as a; print(a.__file__)", cwd=empty).stdout
    assert Path(where).is_relative_to(Path(places["purelib"]) / "nlctl" / "analysis")
    former = "from analysis import metrics; import nlctl.analysis; print(metrics.__name__)"
    told = run(python, "-c", former, cwd=empty)
    assert told.stdout == "nlctl.analysis.metrics\n"
    assert told.stderr.count("FutureWarning: 'analysis' is 'nlctl.analysis' now") == 1
    script = str(Path(places["scripts"]) / "nlctl")
    assert "DeadZone" in run(script, "list", cwd=empty).stdout
    run(script, "simulate", "example-2", "--until", "0.1", "--csv", "out.csv", cwd=empty)
    run(script, "diagram", "example-1", "-o", "loop.svg", cwd=empty)
    assert sorted(p.name for p in empty.iterdir()) == ["loop.svg", "out.csv"]


@pytest.mark.weekly
def test_an_editable_install_is_of_its_checkout(wheel, tmp_path):
    """`nlctl.analysis` is the folder at the top of the checkout, for the command as well."""
    source = wheel.parent / "source"
    python, places = fresh_environment(tmp_path / "fresh", "-e", str(source))
    where = run(python, "-c", "import nlctl.analysis as a; print(a.__file__)", cwd=tmp_path).stdout
    assert where == f"{source / 'analysis' / '__init__.py'}\n"
    assert "DeadZone" in run(str(Path(places["scripts"]) / "nlctl"), "list", cwd=tmp_path).stdout
