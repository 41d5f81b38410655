"""A study's file imports what lies next to it, by its plain name, as a script does."""

import sys

import pandas as pd
import pytest
from command_line import nlctl
from studies_example import HEAD, LOOP, write

from nlctl.analysis.studies import StudyError, read_study, replay, run
from nlctl.analysis.studies.code.loading import load_file, loaded_with
from nlctl.errors import ParameterError

SMALL = "[runs]\nsize = 8\n"
NEIGHBOUR = '''
import nlctl
from constants import POWER
from parts import shapes
from parts.shapes import cubic


@nlctl.equation
def bent(x):
    """x^3, from a neighbour of a neighbour."""
    return cubic(x) * shapes.ONE + 0.0 * POWER
'''
FILES = {
    "bending.py": NEIGHBOUR,
    "constants.py": "POWER = 3\n",
    "parts/__init__.py": "from . import numbers\nfrom .numbers import ONE\n",
    "parts/numbers.py": "import constants\nONE = constants.POWER / 3\n",
    "parts/shapes.py": (
        "import nlctl\nfrom .numbers import ONE\nfrom . import numbers\n\n\n"
        "@nlctl.equation\ndef cubic(x):\n    return numbers.ONE * x ** 3\n"
    ),
}


def written(folder, files, imports="import bending", call="bending.bent(x[0])"):
    folder.mkdir(exist_ok=True)
    path = write(folder, HEAD, SMALL)
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    assert "x[0] ** 3" in LOOP
    loop = LOOP.replace("x[0] ** 3", call).replace(
        "import nlctl\n", f"import nlctl\n{imports}\n", 1
    )
    (folder / "loop.py").write_text(loop, encoding="utf-8")
    return path


WAYS = [
    ("import bending", "bending.bent(x[0])"),
    ("from bending import bent", "bent(x[0])"),
    ("import bending as b", "b.bent(x[0])"),
    ("import parts.shapes", "parts.shapes.cubic(x[0])"),
    ("from parts import shapes", "shapes.cubic(x[0])"),
    ("from parts.shapes import cubic as third", "third(x[0])"),
    ("from bending import *", "bent(x[0])"),
]


@pytest.mark.parted
@pytest.mark.parametrize(("imports", "call"), WAYS)
def test_every_way_to_import_a_neighbour(tmp_path, imports, call):
    """Modules, packages, names, relative imports inside of a package; the numbers are the same."""
    alone = run(read_study(write_alone(tmp_path)), tmp_path / "alone" / "out", threads=1)
    path = written(tmp_path / "beside", FILES, imports, call)
    made = run(read_study(path), tmp_path / "beside" / "out", threads=1)
    one, other = (r.rows.table.select_dtypes("number") for r in (alone, made))
    pd.testing.assert_frame_equal(*(t.drop(columns="wall_time") for t in (one, other)), atol=1e-9)
    assert replay(tmp_path / "beside" / "out", 3).differences == ()


def write_alone(folder):
    (folder / "alone").mkdir()
    return write(folder / "alone", HEAD, SMALL)


@pytest.mark.weekly
@pytest.mark.parametrize("executor", ["processes", "threads"])
def test_in_processes_of_its_own(tmp_path, executor):
    """On the command line, and in worker processes, which cannot import a neighbour."""
    written(tmp_path, FILES)
    told = nlctl("run", "study.toml", "--out", "out", "--executor", executor, cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    assert nlctl("replay", "out", 3, cwd=tmp_path).returncode == 0


def test_two_studies_have_neighbours_of_one_name(tmp_path):
    """In one process each gets its own, in whichever order they are read."""
    values = {}
    for name in ("one", "other"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "main.py").write_text("import near\nfrom deep.inner import WHO as inner\n")
        (folder / "near.py").write_text(f"WHO = {name!r}\n")
        (folder / "deep").mkdir()
        (folder / "deep" / "__init__.py").touch()
        (folder / "deep" / "inner.py").write_text(f"WHO = {name!r}\n")
        values[name] = load_file(folder / "main.py")
    assert {name: (m.near.WHO, m.inner) for name, m in values.items()} == {
        "one": ("one", "one"),
        "other": ("other", "other"),
    }
    assert "near" not in sys.modules
    assert "deep" not in sys.modules
    names = {p.name for p in loaded_with(tmp_path / "one" / "main.py")}
    assert names == {"main.py", "near.py", "__init__.py", "inner.py"}


@pytest.mark.parametrize("name", ["numpy", "statistics", "nlctl", "control", "math"])
def test_installed_packages_and_pythons_own_come_first(tmp_path, name):
    """A file that has the name of a package replaces it for nobody."""
    (tmp_path / f"{name}.py").write_text("raise SystemExit\n")
    (tmp_path / "main.py").write_text(f"import {name}\nfrom {name} import __name__ as told\n")
    assert load_file(tmp_path / "main.py").told == name


def test_imports_inside_of_functions_and_in_a_ring(tmp_path):
    """As Python does it."""
    (tmp_path / "main.py").write_text("import a\n\n\ndef late():\n    import c\n    return c.C\n")
    (tmp_path / "a.py").write_text("A = 1\nimport b\n")
    (tmp_path / "b.py").write_text("import a\nB = a.A + 1\n")
    (tmp_path / "c.py").write_text("C = 3\n")
    main = load_file(tmp_path / "main.py")
    assert (main.a.b.B, main.late()) == (2, 3)


def test_what_is_not_there_is_told_as_ever(tmp_path):
    """The name of the module that is missing; a file that fails leaves nothing behind."""
    (tmp_path / "main.py").write_text("import nearly\n")
    with pytest.raises(ModuleNotFoundError, match="No module named 'nearly'"):
        load_file(tmp_path / "main.py")
    (tmp_path / "main.py").write_text("from near import missing\n")
    (tmp_path / "near.py").write_text("X = 1\n")
    with pytest.raises(ImportError, match="cannot import name 'missing'"):
        load_file(tmp_path / "main.py")
    (tmp_path / "near.py").write_text("missing = 1\n")
    for name in [name for name in sys.modules if name.startswith("near_")]:
        del sys.modules[name]
    assert load_file(tmp_path / "main.py").missing == 1
    with pytest.raises(ParameterError, match="there is no file"):
        load_file(tmp_path / "no.py")


def test_a_neighbour_counts_as_the_loop(tmp_path):
    """Another one is another loop; a moved folder is the same one."""
    path = written(tmp_path / "here", FILES)
    run(read_study(path), tmp_path / "here" / "out", threads=1)
    (tmp_path / "here").rename(tmp_path / "there")
    assert replay(tmp_path / "there" / "out", 1).differences == ()
    moved = read_study(tmp_path / "there" / "study.toml")
    assert run(moved, tmp_path / "there" / "out", resume=True, threads=1).complete
    changed = {**FILES, "parts/shapes.py": FILES["parts/shapes.py"].replace("x ** 3", "x ** 2")}
    other = read_study(written(tmp_path / "other", changed))
    with pytest.raises(ParameterError.__base__, match="the equations of 'lag'"):
        run(other, tmp_path / "there" / "out", resume=True, threads=1)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("é".encode("latin-1"), "is not UTF-8, as TOML is: byte 0xe9 in line 2"),
        ("é".encode("utf-16"), "is not UTF-8"),
        (b"\x80", "byte 0x80 in line 2"),
        (b"\xed\xa0\x80", "is not UTF-8"),
    ],
)
def test_a_study_that_is_not_utf_8_is_refused(tmp_path, content, words):
    """Nothing is read with other names than those that stand there."""
    text = b'loop = "loop.py:loop"\n# ' + content + b"\n" + HEAD.partition("\n")[2].encode()
    path = write(tmp_path, HEAD, SMALL)
    path.write_bytes(text)
    with pytest.raises(StudyError, match=words):
        read_study(path)


@pytest.mark.parametrize(
    "mark", ["\\u001b]0;owned\\u0007", "\\u009b2J", "\\u007f", "\\u202e", "\\b"]
)
@pytest.mark.parametrize("place", ['title = "A lag', '"x', 'meaning = "the'])
def test_texts_of_a_study_give_no_orders_to_a_terminal(tmp_path, mark, place):
    """In titles, names, meanings: the mistake is told, printably."""
    head = HEAD.replace("[space]", '[space]\n"x" = { bounds = [0.0, 1.0] }')
    assert head.count(place) >= 1
    path = write(tmp_path, head.replace(place, place + mark, 1), SMALL)
    with pytest.raises(StudyError, match=r"has a control character, U\+") as told:
        read_study(path)
    assert str(told.value).replace("\n", "").isprintable()
