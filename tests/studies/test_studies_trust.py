"""Which code a study file may name: nothing else is imported, and nothing else is called."""

import sys

import pytest
from command_line import nlctl_here
from studies_example import HEAD, ROWS, write

from nlctl.analysis.studies import StudyError, read_study
from nlctl.analysis.studies.resolve import loop_function
from nlctl.errors import ParameterError

MARK = "import pathlib\npathlib.Path({mark!r}).touch()\n"
COMPARE = """
[[analysis]]
kind = "compare"
keyword = "lag"
options = {{ function = "{name}" }}
runs = 4
metrics = {{ iae = "smaller" }}
"""
SMALL = '[runs]\nsize = 4\n\n[[analysis]]\nkind = "probability"\n'


@pytest.fixture
def place(tmp_path):
    """A folder for the study, and code outside of it that leaves a mark when it is run."""
    folder, outside = tmp_path / "study", tmp_path / "outside"
    folder.mkdir()
    outside.mkdir()
    write(folder, HEAD, SMALL)
    lag = (folder / "loop.py").read_text(encoding="utf-8")
    mark = MARK.format(mark=str(outside / "ran"))
    (outside / "other.py").write_text(mark + lag, encoding="utf-8")
    (outside / "stray_module_of_a_test.py").write_text(mark + lag, encoding="utf-8")
    (folder / "linked.py").symlink_to(outside / "other.py")
    return folder, outside


def in_loop(name):
    return (HEAD.replace("loop.py:loop", name), SMALL)


def in_options(name):
    return (HEAD.replace("[study]", f'options.lag = {{ function = "{name}" }}\n[study]'), SMALL)


def in_choices(name):
    return (f'{HEAD}\n[choices.lag]\noptions.other = {{ function = "{name}" }}\n', SMALL)


def in_comparison(name):
    return (HEAD, SMALL, COMPARE.format(name=name))


def in_metrics(name):
    return (f'{HEAD}more = [{{ function = "{name}" }}]\n', SMALL)


def in_kind(name):
    return (HEAD, SMALL, f'[[analysis]]\nkind = "{name}"\n')


def nested(name):
    return (HEAD.replace("[study]", f'options.lag = {{ block = "DeadZone", b_r = {{ function = "{name}" }} }}\n[study]'), SMALL)  # fmt: skip  # noqa: E501


PLACES = [in_loop, in_options, in_choices, in_comparison, in_metrics, in_kind, nested]


@pytest.mark.slow
@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("name", ["../outside/other.py:loop", "{outside}/other.py:loop",
                                  "linked.py:loop", "stray_module_of_a_test:loop"])  # fmt: skip
def test_code_from_elsewhere_needs_trust(place, monkeypatch, where, name):
    """Its file is not even read; the message says where it is named, and what to do."""
    folder, outside = place
    monkeypatch.syspath_prepend(outside)
    name = name.format(outside=outside.as_posix())
    path = write(folder, *where(name))
    told = nlctl_here("validate", path, cwd=folder)
    assert told.returncode == 2, told
    assert "reading this study would run it. Trust it with --trust" in told.stderr
    assert not (outside / "ran").exists()
    assert "stray_module_of_a_test" not in sys.modules


@pytest.mark.slow
@pytest.mark.parametrize("name", ["../outside/other.py:loop", "stray_module_of_a_test:loop"])
def test_who_trusts_it_may_run_it(place, monkeypatch, name):
    """With --trust, at every command that reads the study."""
    folder, outside = place
    monkeypatch.syspath_prepend(outside)
    path = write(folder, *in_loop(name))
    for command in (
        ("validate", path),
        ("run", path, "--out", "out"),
        ("replay", "out", 1),
        ("report", "out"),
    ):
        assert nlctl_here(*command, "--trust", cwd=folder).returncode == 0
    assert (outside / "ran").exists()
    assert nlctl_here("replay", "out", 1, cwd=folder).returncode == 0  # it is what was trusted
    for changed in outside.glob("*.py"):
        changed.write_text("# another content\n" + changed.read_text())
    sys.modules.pop("stray_module_of_a_test", None)
    (outside / "ran").unlink()
    for command in (("validate", path), ("replay", "out", 1)):
        assert nlctl_here(*command, cwd=folder).returncode == 2
    drawn = nlctl_here("report", "out", cwd=folder)
    assert (drawn.returncode, "no fans" in drawn.stderr) == (0, True)
    assert not (outside / "ran").exists()


@pytest.mark.parametrize("trust", [False, True])
@pytest.mark.parametrize("where", [in_loop, in_options, in_kind])
@pytest.mark.parametrize(
    "name",
    ["subprocess:run", "os:system", "os.path:exists", "builtins:eval", "antigravity:geohash",
     "shutil:rmtree", "__main__:main"],
)  # fmt: skip
def test_the_standard_library_makes_no_loops(place, where, name, trust):
    """Whoever is trusted: there is no diagram in it."""
    folder, _ = place
    with pytest.raises(StudyError, match="Python's standard library"):
        read_study(write(folder, *where(name)), trust=trust)
    assert "antigravity" not in sys.modules


FUNCTIONS = """
import functools
import subprocess
from shutil import rmtree
from subprocess import run
import control as ct

CALLED = __import__("pathlib").Path(__file__).with_name("called")

def remove():
    CALLED.touch()

def indirect():
    return remove()

def annotated() -> None:
    CALLED.touch()
    return loop()

def texts() -> "list[ct.InputOutputSystem]":
    CALLED.touch()
    return [loop()]

def yields():
    CALLED.touch()
    yield loop()

async def waits():
    CALLED.touch()
    return loop()

class Maker:
    def __init__(self):
        CALLED.touch()
        loop()

def lies() -> ct.InputOutputSystem:
    return 5

removed = functools.partial(remove)
echo = functools.partial(subprocess.run, ["touch", str(CALLED)])

@functools.cache
def cached(lag=None):
    return loop(lag)

def promised(lag=None) -> "ct.InputOutputSystem":
    return globals()["loop"](lag)

def later(lag=None):
    import nlctl
    return nlctl.interconnect({"lag": lag or Lag()}, outputs=["y", "z"])

def deep(lag=None):
    return (lambda: through(lag))()

def through(lag):
    return Built().make(lag)

class Built:
    def make(self, lag):
        return loop(lag)

given = functools.partial(loop, name="given")
nameless = lambda lag=None: loop(lag)
"""


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("run", "got one of 'subprocess'"),
        ("rmtree", "got one of 'shutil'"),
        ("echo", "got one of 'subprocess'"),
        ("remove", "nothing shows that 'loop.py:remove' returns a diagram, so it is not called"),
        ("indirect", "nothing shows that"),
        ("removed", "nothing shows that"),
        ("annotated", "it returns None"),
        ("texts", "it returns list[ct.InputOutputSystem]"),
        ("yields", "needs a function that returns a diagram"),
        ("waits", "needs a function that returns a diagram"),
        ("Maker", "needs a function that returns a diagram"),
        ("lies", "'loop.py:lies' returns int, and not a diagram"),
        ("CALLED", "unknown function 'CALLED'"),
    ],
)
def test_what_returns_no_diagram_is_not_called(place, name, words):
    """Functions of the study's own file are looked at before they are called."""
    folder, _ = place
    with pytest.raises(StudyError) as error:
        read_study(with_functions(folder, name))
    assert words in str(error.value)
    assert not (folder / "called").exists()


@pytest.mark.parametrize(
    "name", ["loop", "cached", "promised", "later", "deep", "given", "nameless"]
)
def test_whatever_makes_a_diagram_is_called(place, name):
    """By annotation, by what it uses, or by what it calls."""
    folder, _ = place
    assert read_study(with_functions(folder, name)).experiment.space.names


def with_functions(folder, name):
    path = write(folder, *in_loop(f"loop.py:{name}"))
    with (folder / "loop.py").open("a", encoding="utf-8") as file:
        file.write(FUNCTIONS)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["numpy:save", "_pytest.config:main", "pandas:read_pickle", "matplotlib.pyplot:savefig",
             "nlctl.analysis.cli.main:main", "nlctl.analysis.cli.report:write_gallery_of"]
)  # fmt: skip
def test_installed_packages_make_loops_or_are_not_called(place, name):
    """What is not built on nlctl needs trust; whoever is trusted offers mostly no diagram."""
    folder, _ = place
    with pytest.raises(
        StudyError, match=r"reading this study would run it\. Trust it with --trust"
    ):
        read_study(write(folder, *in_loop(name)))
    with pytest.raises(StudyError, match=r"nothing shows|returns a diagram"):
        read_study(write(folder, *in_loop(name)), trust=True)


def test_installed_packages_and_nlctl_are_trusted(place):
    """The studies that come with nlctl name its own modules."""
    folder, _ = place
    head = HEAD.replace("loop.py:loop", "nlctl.analysis.paper.loops:example_1")
    head = head.replace('"lag.rate" = { uniform = [0.5, 2.5] }', "").replace("y <=", "e <=")
    head = head.replace('"lag.x(0)"', '"plant.x1(0)"').replace("|z|", "|u|").replace("1 s", "0 s")
    head = head.replace('error = "y"\ncontrol = "z"\n', "")
    assert read_study(write(folder, head, ROWS)).study.loop.startswith("nlctl.")


@pytest.mark.parametrize("command", ["run", "validate", "replay", "report"])
def test_help_says_that_code_is_run(command):
    """Where people look before they try."""
    told = " ".join(nlctl_here(command, "--help").stdout.split())
    assert "--trust" in told
    assert "run" in told
    assert "code" in told


def test_a_diagram_in_the_place_of_its_function_is_told_so(tmp_path):
    """With what to write instead: a script with `loop = nlctl.interconnect(...)` is a first try."""
    (tmp_path / "loop.py").write_text("import nlctl\nloop = nlctl.paper.example_1()\n")
    with pytest.raises(ParameterError, match="needs a function that returns a diagram, got the"):
        loop_function("loop.py:loop", tmp_path)
