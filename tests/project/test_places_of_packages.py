"""`nlctl.analysis` wherever it lies, a user's own `analysis` next to it, and its former name."""

import math
import os
import pickle
import shutil
import subprocess
import sys

import cloudpickle
import pytest
from places import ROOT

from nlctl.analysis.metrics import Metric, peak
from nlctl.analysis.studies import StudyError, read_study
from nlctl.host.checkout import SOURCES

OWN = "def answer():\n    return 42\n"
LOOP = """
import control as ct
import nlctl
import analysis

def make() -> ct.InputOutputSystem:
    return nlctl.actuators.cascade({"lag": nlctl.Lag(T=float(analysis.answer()))})
"""


def python(*arguments, cwd, path=None, check=True):
    """What Python prints, and its warnings as they come without any options."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONWARNINGS"}
    environment |= {} if path is None else {"PYTHONPATH": str(path)}
    return subprocess.run(
        [sys.executable, *arguments], cwd=cwd, env=environment, check=check,
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip


def test_a_script_has_its_own_analysis_next_to_nlctls(tmp_path):
    """A file ``analysis.py`` in the folder of a script is what it imports, without a warning."""
    (tmp_path / "analysis.py").write_text(OWN, encoding="utf-8")
    script = tmp_path / "script.py"
    script.write_text(
        "import analysis, nlctl\nfrom nlctl.analysis import metrics\n"
        "print(analysis.answer(), metrics.__name__)\n",
        encoding="utf-8",
    )
    said = python(str(script), cwd=tmp_path)
    assert (said.stdout, said.stderr) == ("42 nlctl.analysis.metrics\n", "")


@pytest.mark.weekly
def test_the_command_line_hides_no_analysis_of_the_users(tmp_path):
    """The file with the loop imports its neighbour, whose answer is a time constant of 42 s.

    Its folder is on ``sys.path`` with ``python -m``, and is not for the script ``nlctl``.
    """
    (tmp_path / "analysis.py").write_text(OWN, encoding="utf-8")
    (tmp_path / "loop.py").write_text(LOOP, encoding="utf-8")
    for options in ((), ("-P",)):
        command = ("-m", "nlctl", "simulate", "loop.py:make", "--until", "1", "--input", "u=1")
        said = python(*options, *command, "--csv", "out.csv", cwd=tmp_path)
        assert said.stderr == ""
        *_, last = (tmp_path / "out.csv").read_text(encoding="utf-8").split()
        assert float(last.split(",")[-1]) == pytest.approx(1 - math.exp(-1 / 42), rel=1e-6)


def test_the_former_name_warns_once_and_is_the_same(tmp_path):
    """One warning at the line that imports; modules, classes and functions are no second copies."""
    script = tmp_path / "script.py"
    script.write_text(
        "import pickle\n"
        "from analysis import lyapunov\n"
        "import analysis.lyapunov.ledger\n"
        "import analysis.metrics as metrics\n"
        "from analysis.metrics import Metric, peak\n"
        "import nlctl.analysis.metrics\n"
        "from nlctl.analysis.lyapunov import ledger\n"
        "assert lyapunov.ledger is ledger and callable(ledger)\n"  # not the module of this name
        "assert metrics is nlctl.analysis.metrics and analysis is nlctl.analysis\n"
        "assert metrics.__spec__.name == metrics.__name__ == 'nlctl.analysis.metrics'\n"
        "made = Metric(key='peak', signal='e', unit='1', meaning='', function=peak)\n"
        "assert isinstance(made, nlctl.analysis.metrics.Metric)\n"
        "former = pickle.dumps(peak, 0).replace(b'nlctl.analysis.', b'analysis.')\n"
        "assert b'canalysis.metrics' in former and pickle.loads(former) is peak\n"
        "assert type(pickle.loads(pickle.dumps(made))) is Metric\n"
        "try: import analysis.no_such\n"
        "except ModuleNotFoundError: print('refused')\n",
        encoding="utf-8",
    )
    said = python(str(script), cwd=tmp_path)
    assert said.stdout == "refused\n"
    assert said.stderr.count("Warning") == 1
    assert f"{script}:2: FutureWarning: 'analysis' is 'nlctl.analysis' now" in said.stderr
    assert "the old name goes in version 0.2" in said.stderr


def test_the_former_command_still_runs(tmp_path):
    said = python("-m", "analysis.recheck", cwd=tmp_path, check=False)
    assert said.stdout == "usage: python -m nlctl.analysis.recheck FILE\n"
    assert said.returncode == 2
    assert said.stderr.count("FutureWarning") == 1


def test_what_is_pickled_has_the_present_name():
    """So that other processes find it, by pickle and by what goes to workers of a sweep."""
    made = Metric(key="peak", signal="e", unit="1", meaning="", function=peak)
    for dumps in (pickle.dumps, cloudpickle.dumps):
        assert pickle.loads(dumps(made)) == made
        assert b"nlctl.analysis.metrics" in dumps(made)


@pytest.mark.weekly
@pytest.mark.skipif(len(SOURCES) == 1, reason="installed, and not run from a checkout")
def test_a_checkout_has_its_own_analysis_whatever_is_installed(tmp_path):
    """PYTHONPATH names one of two checkouts: everything is of that one, in processes as well."""
    for name in ("nlctl", "analysis"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, tmp_path / name, ignore=ignored)
    program = (
        "import nlctl, nlctl.analysis.metrics as m, importlib.util as u;"
        "print(nlctl.__file__, m.__file__, u.find_spec('nlctl.tests'), u.find_spec('nlctl.nlctl'))"
    )
    home, metrics, *others = python("-c", program, cwd="/", path=tmp_path).stdout.split()
    assert home == str(tmp_path / "nlctl" / "__init__.py")
    assert metrics == str(tmp_path / "analysis" / "metrics" / "__init__.py")
    assert others == ["None", "None"]
    shutil.rmtree(tmp_path / "analysis")  # and none of another checkout, in silence
    said = python("-c", "import nlctl.analysis", cwd="/", path=tmp_path, check=False)
    assert "ModuleNotFoundError: No module named 'nlctl.analysis'" in said.stderr


def test_nlctl_itself_imports_nothing_of_its_analysis(tmp_path):
    """All of its other modules can be imported without."""
    program = (
        "import importlib, pkgutil, sys, nlctl\n"
        "def walk(package):\n"  # pkgutil's own imports every package that it comes to
        "    for place in pkgutil.iter_modules(package.__path__, package.__name__ + '.'):\n"
        "        if place.name != 'nlctl.analysis' and '__main__' not in place.name:\n"
        "            module = importlib.import_module(place.name)\n"
        "            if place.ispkg:\n"
        "                walk(module)\n"
        "walk(nlctl)\n"
        "print([m for m in sys.modules if m.startswith('nlctl.analysis.')])"
    )
    assert python("-c", program, cwd=tmp_path).stdout == "[]\n"


@pytest.mark.weekly
def test_a_study_with_the_former_name_is_read_and_warned_of(tmp_path):
    """The rule of what may run is that of the present name."""
    path = tmp_path / "study.toml"
    text = (ROOT / "reports" / "example-1-long.toml").read_text(encoding="utf-8")
    assert text.count("nlctl.analysis.") == 2
    former = text.replace("nlctl.analysis.", "analysis.")
    path.write_text(former, encoding="utf-8")
    said = python("-m", "nlctl", "validate", "study.toml", cwd=tmp_path)
    assert said.stdout.startswith("study.toml is a valid study.\n")
    assert said.stderr.count("'analysis' is 'nlctl.analysis' now") == 1
    path.write_text(former.replace("paper.loops:example_1", "cli.main:main"), encoding="utf-8")
    with pytest.raises(StudyError, match=r"'nlctl\.analysis\.cli\.main' does nothing with a loop"):
        read_study(path)
