"""The integrators that are shipped are those of the sources, and compute what numba's do."""

import hashlib
import json
import lzma
import re
import subprocess
import sys

import control as ct
import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from numba.core import config, event

import nlctl
from nlctl import paper
from nlctl.native import driver, integrators, ship
from nlctl.native.integrators import SHIPPED, WANTED, shipped_bitcode, sources_key
from nlctl.native.ship import source_files

pytestmark = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="without JIT the sources run as they stand"
)
REMEDY = "the integrators were changed: run python -m nlctl.native.ship, and commit what it writes"


def header():
    return json.loads(SHIPPED.read_bytes().partition(b"\n")[0])


def test_what_is_shipped_is_of_these_sources():
    assert header()["files"] == source_files(), REMEDY
    assert header()["sources"] == sources_key(source_files()), REMEDY
    if header()["llvm"] <= list(llvm.llvm_version_info):
        assert shipped_bitcode() is not None


def test_all_that_is_compiled_belongs_to_these_sources():
    """Also by what the functions are, not by their imports only."""
    modules = {each.function.__module__ for each in WANTED}
    files = {f"{'/'.join(name.split('.')[2:])}.py" for name in modules}
    assert files <= set(source_files())
    constants = {"../accumulation.py", "../expressions/sharp.py"}  # and functions, from elsewhere
    assert constants <= set(source_files())
    needed = ("methods/explicit", "methods/rodas5p", "memory", "samples")
    needed += ("events/location", "events/excursions", "events/near_side")
    assert {f"integrate/{name}.py" for name in needed} <= set(source_files())


def test_what_an_imported_constant_is_made_of_belongs_to_them(tmp_path, monkeypatch):
    """In any number of steps, by any name; what else those files have does not count."""
    files = {
        "native/integrate/advance.py": "from ...outer import A, helper as h\n",
        "native/integrate/start.py": "from .. import near\n",
        "native/integrate/workspace.py": "import math\n",
        "native/machine/export.py": "def exported():\n    return 1\n",
        "native/near.py": "K = 1\n",
        "outer.py": "from .inner import B as C, unused\nfrom .third import f\n"
        "from .other import X\n"
        "A = 2 * D\nD = C + 1\ndef helper(x):\n    return f(x)\ndef another():\n    return X\n",
        "inner.py": "from .last import B\n",
        "last.py": "B = 1.0\n",
        "third.py": "def f(x):\n    return x\n",
        "other.py": "X = 1\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(ship, "HERE", tmp_path / "native")
    names = {(tmp_path / "native" / name).resolve() for name in ship.source_files()}
    assert names == {tmp_path / name for name in files} - {tmp_path / "other.py"}


def changed(**entries):
    first, _, code = SHIPPED.read_bytes().partition(b"\n")
    return json.dumps(json.loads(first) | entries).encode() + b"\n" + code


UNFIT = {
    "nothing": b"",
    "cut short": SHIPPED.read_bytes()[:-1],
    "one bit": SHIPPED.read_bytes()[:-1] + bytes([SHIPPED.read_bytes()[-1] ^ 1]),
    "no header": SHIPPED.read_bytes().partition(b"\n")[2],
    "another header": b"[]\n" + SHIPPED.read_bytes().partition(b"\n")[2],
    "other sources": changed(sources=hashlib.sha256(b"").hexdigest()),
    "a file less": changed(files=header()["files"][1:]),
    "a file that is not there": changed(files=["_gone.py", *header()["files"]]),
    "newer LLVM": changed(llvm=[llvm.llvm_version_info[0] + 1, 0, 0]),
}


@pytest.mark.parametrize("name", UNFIT)
def test_what_does_not_fit_is_not_used(name, tmp_path, monkeypatch):
    path = tmp_path / "integrators.bitcode"
    path.write_bytes(UNFIT[name])
    monkeypatch.setattr(integrators, "SHIPPED", path)
    assert shipped_bitcode() is None


def test_without_the_file_there_is_none(tmp_path, monkeypatch):
    monkeypatch.setattr(integrators, "SHIPPED", tmp_path / "none")
    assert shipped_bitcode() is None


def test_with_checked_indices_numba_makes_its_own(monkeypatch):
    monkeypatch.setattr(config, "BOUNDSCHECK", 1)
    assert shipped_bitcode() is None


@pytest.mark.slow
def test_the_first_run_compiles_nothing_by_numba(tmp_path, monkeypatch):
    """With an empty cache; numba's compiler alone would take ten times as long as all the rest."""
    if shipped_bitcode() is None:
        pytest.skip("another LLVM")
    monkeypatch.setenv("NLCTL_CACHE_DIR", str(tmp_path))
    made = integrators._integrators.__wrapped__()
    monkeypatch.setattr(driver, "integrators", lambda: made)
    with event.install_recorder("numba:compile") as recorded:
        nlctl.input_output_response(nlctl.compile(paper.example_1()), [0.0, 0.1])
    assert not recorded.buffer


def by_numba():
    """The integrators as numba itself compiles, optimises and loads them."""
    found = {}
    for each in WANTED:
        code = numba.njit(each.signature, **each.options)(each.function)
        (made,) = code.overloads.values()
        address = made.library.get_pointer_to_function(made.fndesc.llvm_func_name)
        name, arguments = each.function.__name__, each.signature.args
        found[name] = integrators._callable(address, arguments, code)
    return found


def results():
    """States and outputs of runs of all kinds."""
    times = np.linspace(0, 3, 200)
    loops = [nlctl.compile(make()) for make in (paper.example_1, paper.example_2)]
    for loop in loops:
        for settings in ({}, {"rtol": 1e-5}, {"method": "rodas5p", "rtol": 1e-5}, {"step": 1e-3}):
            run = nlctl.input_output_response(loop, times, audit=False, **settings)
            yield run.states
            yield run.outputs
    varied = {"actuator.b_r": np.linspace(0.1, 1, 11)}
    kept = list(loops[0].system.output_labels)
    many = nlctl.ensemble_response(loops[0], times, params=varied, keep=kept, audit=False)
    yield from many.signals.values()
    loop = nlctl.compile(ct.ss([[0.0, 1.0], [-9.0, -0.1]], [[0.0], [1.0]], [[1.0, 0.0]], 0.0))
    u = np.sin(7 * times)
    yield nlctl.input_output_response(loop, times, u, audit=False).states


@pytest.mark.weekly
def test_the_same_bits_as_by_numba(monkeypatch):
    """Another order of passes and no vectors of the host, but no liberties with arithmetic."""
    ours = [array.tobytes() for array in results()]
    code = by_numba()
    monkeypatch.setattr(driver, "integrators", lambda: code)
    theirs = [array.tobytes() for array in results()]
    assert ours == theirs


LIBERTIES = {"fast", "reassoc", "contract", "nnan", "ninf", "nsz", "arcp", "afn"}


def test_no_compiler_may_take_liberties_with_the_arithmetic():
    """Sums in another order, or rounded once less, would have other bits with other passes."""
    if shipped_bitcode() is None:
        pytest.skip("another LLVM")
    text = str(llvm.parse_bitcode(lzma.decompress(shipped_bitcode())))
    operations = re.findall(r" = (?:tail )?(f(?:add|sub|mul|div|cmp|neg)|call) ([a-z ]*)", text)
    assert {"fadd", "fsub", "fmul", "fdiv"} <= {name for name, _ in operations}
    taken = {f"{name} {flags}" for name, flags in operations if LIBERTIES & set(flags.split())}
    assert not taken


def test_it_has_no_path_of_the_machine_that_made_it():
    code = lzma.decompress(SHIPPED.read_bytes().partition(b"\n")[2])
    assert b"integrate" in code
    assert b".py" not in code


@pytest.mark.weekly
def test_made_anew_it_is_the_same_file(tmp_path):
    """Whoever makes it, on whatever machine, with the same numba."""
    if header()["numba"] != numba.__version__:
        pytest.skip("another numba")
    path = tmp_path / "integrators.bitcode"
    subprocess.run([sys.executable, "-m", "nlctl.native.ship", path], check=True)
    same = path.read_bytes() == SHIPPED.read_bytes()
    assert same  # a difference of bytes would be printed for minutes


@pytest.mark.weekly
def test_edited_sources_are_compiled_and_kept(tmp_path, monkeypatch):
    """Without what is shipped: numba once, then from the cache, and the same bits."""
    expected = [array.tobytes() for array in results()]
    monkeypatch.setenv("NLCTL_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(integrators, "SHIPPED", tmp_path / "none")
    for compiles in (True, False):
        with event.install_recorder("numba:compile") as recorded:
            code = integrators._integrators.__wrapped__()
        assert bool(recorded.buffer) == compiles
        with monkeypatch.context() as context:
            context.setattr(driver, "integrators", lambda code=code: code)
            assert [array.tobytes() for array in results()] == expected
