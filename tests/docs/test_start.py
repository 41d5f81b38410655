"""Pages for newcomers: their code runs, and what they say of files and variables is so."""

import ast
import importlib
import linecache
import re
import tomllib
import zlib

import matplotlib as mpl
import pytest
from places import ROOT
from rows import each_row

DOCS = ROOT / "docs"
PAGES = [
    *(f"start/{name}" for name in ("installation", "quick-start", "from-matlab")),
    "reference/configuration",
]
ROW = re.compile(r"^\| (.+?) \| `(.+)` \|$", re.MULTILINE)


def text(page):
    return (DOCS / f"{page}.md").read_text(encoding="utf-8")


def blocks(page):
    return re.findall(r"```python\n(.*?)```", text(page), flags=re.DOTALL)


@pytest.fixture(autouse=True)
def figures_without_a_screen():
    """Figures are closed when a test is over."""
    with mpl.rc_context({"backend": "agg", "figure.max_open_warning": 0}):
        yield
    importlib.import_module("matplotlib.pyplot").close("all")


@pytest.mark.slow
@each_row("page", PAGES)
def test_code_of_the_page_runs(page):
    """Block after block, as one reads them."""
    names = {}
    for place, code in enumerate(blocks(page), 1):
        file = f"<{page}, block {place}>"
        linecache.cache[file] = (len(code), None, code.splitlines(True), file)  # functions are read
        exec(compile(code, file, "exec"), names)
    assert names


LINES = [code for _, code in ROW.findall(text("start/from-matlab"))]


@pytest.mark.slow
@each_row("code", LINES)
def test_every_line_of_the_tables_for_matlab_runs(code):
    """Each by itself, below the lines that the page begins with."""
    names = {}
    exec(blocks("start/from-matlab")[0], names)
    exec(compile(code, f"<{code}>", "exec"), names)


def test_no_line_of_the_tables_is_left_out():
    """Every row but the two headings and the lines below them."""
    rows = re.findall(r"^\|", text("start/from-matlab"), flags=re.MULTILINE)
    assert len(LINES) == len(rows) - 4


def test_the_extras_of_the_installation_are_those_of_the_project():
    """Each is in the table."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    told = re.findall(r"^\| (`[^|]+) \|", text("start/installation"), flags=re.MULTILINE)
    assert {name for row in told for name in re.findall(r"`(\w+)`", row)} == set(extras)


def read_variables():
    """Yield the variables of the environment that the packages read by name."""
    for path in [*(ROOT / "nlctl").rglob("*.py"), *(ROOT / "analysis").rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Call):
                of, arguments = ast.unparse(node.func), node.args
            elif isinstance(node, ast.Subscript):
                of, arguments = ast.unparse(node.value), [node.slice]
            else:
                continue
            reads = of.startswith(("os.environ", "environ")) or of.endswith("getenv")
            if reads and arguments and isinstance(arguments[0], ast.Constant):
                yield arguments[0].value


def test_every_variable_of_the_environment_is_on_the_page_and_no_other():
    """The first column of its table is what the code reads."""
    told = re.findall(r"^\| `([A-Z_]+)` \|", text("reference/configuration"), flags=re.MULTILINE)
    assert sorted(told) == sorted(set(read_variables()))
    assert "NLCTL_CACHE_DIR" in told


@each_row("library", ["control", "numpy", "scipy"])
def test_the_stored_inventories_have_names_that_there_are(library):
    """So that a link leads to a page; `docs/inventories/make.py` makes them again."""
    packed = (DOCS / "inventories" / f"{library}.inv").read_bytes().partition(b"zlib.\n")[2]
    names = [line.split()[0] for line in zlib.decompress(packed).decode().splitlines()]
    assert len(names) > 5
    for name in names:
        home, _, last = name.rpartition(".")
        assert hasattr(importlib.import_module(home), last), name
