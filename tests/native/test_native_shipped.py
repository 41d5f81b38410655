"""Functions that come with nlctl as bitcode: of these sources, computing what numba's do."""

import hashlib
import json
import lzma
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import control as ct
import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import types
from numba.core import config, event

import nlctl
from nlctl import paper
from nlctl.analysis.metrics import in_machine_code, settling_time
from nlctl.native import driver, ship
from nlctl.native.integrators import INTEGRATORS
from nlctl.native.machine.export import AS_SHIPPED
from nlctl.native.machine.machine_code import Wanted
from nlctl.native.machine.shipped import Shipped, bitcode, callable_at, functions_of, sources_key
from nlctl.native.ship import SHIPPED, group_by_name, source_files

pytestmark = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="without JIT the sources run as they stand"
)
REMEDY = "what is shipped was changed: run python -m nlctl.native.ship, and commit what it writes"
CONTENT = INTEGRATORS.path.read_bytes()
ALL = pytest.mark.parametrize("name", SHIPPED)


def header(group):
    return json.loads(group.path.read_bytes().partition(b"\n")[0])


def text_of(group):
    """The IR that is shipped."""
    code = bitcode(group)
    if code is None:
        pytest.skip("another LLVM")
    return str(llvm.parse_bitcode(lzma.decompress(code)))


@ALL
def test_what_is_shipped_is_of_these_sources(name):
    group = group_by_name(name)
    assert header(group)["files"] == source_files(group), REMEDY
    assert header(group)["sources"] == sources_key(source_files(group)), REMEDY
    if header(group)["llvm"] <= list(llvm.llvm_version_info):
        assert bitcode(group) is not None


NEEDED = {
    "INTEGRATORS": {
        "accumulation.py",  # constants, and functions, from elsewhere
        "expressions/sharp.py",
        *(
            f"native/integrate/{name}.py"
            for name in ("methods/explicit", "methods/rodas5p", "memory", "samples")
        ),
        *(f"native/integrate/events/{n}.py" for n in ("location", "excursions", "near_side")),
    },
    "BOX_SEARCH": {"native/enclosures/search.py", "native/machine/address.py"},
    "TUBES": {f"native/tubes/{name}.py" for name in ("intervals", "sets", "steps", "tube")},
    "SAMPLE_FUNCTIONS": {
        f"analysis/metrics/{name}.py" for name in ("curves", "extremes", "integrals", "travel")
    },
}


@ALL
def test_all_that_is_compiled_belongs_to_these_sources(name):
    """Also by what the functions are, not by their imports only."""
    group = group_by_name(name)
    modules = {each.function.__module__ for each in group.wanted}
    files = {f"{'/'.join(name.split('.')[1:])}.py" for name in modules}
    needed = NEEDED[name.rpartition(":")[2]] | {"native/machine/export.py"}
    assert files | needed <= set(source_files(group))


TREE = {
    "native/integrate/advance.py": "from ...outer import A, helper as h\nstart = A\n",
    "native/integrate/start.py": "from .. import near\nfrom nlctl.far import B\nstart = B\n",
    "native/machine/export.py": "def exported():\n    return 1\n",
    "native/near.py": "K = 1\n",
    "far.py": "B = 1\n",
    "outer.py": "from .inner import B as C, unused\nfrom .third import f\n"
    "from .other import X\n"
    "A = 2 * D\nD = C + 1\ndef helper(x):\n    return f(x)\n"
    "def another():\n    f = D = X\n    return f\n",
    "inner.py": "from .last import B\n",
    "last.py": "B = 1.0\n",
    "third.py": "def f(x):\n    return x\n",
    "other.py": "X = 1\n",
}


def test_what_an_imported_constant_is_made_of_belongs_to_them(tmp_path, monkeypatch):
    """In any number of steps, by any name; what else those files have does not count."""
    for name, text in TREE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(ship, "file_of_nlctl", lambda name: tmp_path / name)
    whole = tuple(f"native/integrate/{name}.py" for name in ("advance", "start"))
    group = Shipped(path=tmp_path, wanted=(), whole=whole)
    assert set(source_files(group)) == set(TREE) - {"other.py"}


def changed(**entries):
    first, _, code = CONTENT.partition(b"\n")
    return json.dumps(json.loads(first) | entries).encode() + b"\n" + code


UNFIT = {
    "nothing": b"",
    "cut short": CONTENT[:-1],
    "one bit": CONTENT[:-1] + bytes([CONTENT[-1] ^ 1]),
    "no header": CONTENT.partition(b"\n")[2],
    "another header": b"[]\n" + CONTENT.partition(b"\n")[2],
    "other sources": changed(sources=hashlib.sha256(b"").hexdigest()),
    "a file less": changed(files=header(INTEGRATORS)["files"][1:]),
    "a file that is not there": changed(files=["_gone.py", *header(INTEGRATORS)["files"]]),
    "newer LLVM": changed(llvm=[llvm.llvm_version_info[0] + 1, 0, 0]),
}


@pytest.mark.parametrize("name", UNFIT)
def test_what_does_not_fit_is_not_used(name, tmp_path):
    path = tmp_path / "integrators.bitcode"
    path.write_bytes(UNFIT[name])
    assert bitcode(replace(INTEGRATORS, path=path)) is None


def test_without_the_file_there_is_none(tmp_path):
    assert bitcode(replace(INTEGRATORS, path=tmp_path / "none")) is None


def test_with_checked_indices_numba_makes_its_own(monkeypatch):
    monkeypatch.setattr(config, "BOUNDSCHECK", 1)
    assert bitcode(INTEGRATORS) is None


@pytest.mark.slow
def test_the_first_run_compiles_nothing_by_numba(tmp_path, monkeypatch):
    """With an empty cache; numba's compiler alone would take ten times as long as all the rest."""
    if bitcode(INTEGRATORS) is None:
        pytest.skip("another LLVM")
    monkeypatch.setenv("NLCTL_CACHE_DIR", str(tmp_path))
    code = functions_of.__wrapped__(INTEGRATORS)
    monkeypatch.setattr(driver, "integrators", lambda: code)
    with event.install_recorder("numba:compile") as recorded:
        nlctl.input_output_response(nlctl.compile(paper.example_1()), [0.0, 0.1])
        in_machine_code(settling_time)(np.arange(9.0), np.arange(9.0), 1.0)
    assert not recorded.buffer


def by_numba():
    """The integrators as numba itself compiles, optimises and loads them."""
    codes = {}
    for each in INTEGRATORS.wanted:
        code = numba.njit(each.signature, **each.options)(each.function)
        (compiled,) = code.overloads.values()
        address = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
        codes[each.called] = callable_at(address, each.signature, None, code)
    return codes


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


@ALL
def test_no_compiler_may_take_liberties_with_the_arithmetic(name):
    """Sums in another order, or rounded once less, would have other bits with other passes."""
    text = text_of(group_by_name(name))
    operations = re.findall(r" = (?:tail )?(f(?:add|sub|mul|div|cmp|neg)|call) ([a-z ]*)", text)
    assert {"fadd", "fsub", "fmul"} <= {name for name, _ in operations}
    taken = {f"{name} {flags}" for name, flags in operations if LIBERTIES & set(flags.split())}
    assert not taken


@ALL
def test_it_has_nothing_of_the_process_that_made_it(name):
    """No path, no address, and no function that only a process with numba has."""
    text = text_of(group_by_name(name))
    assert ".py" not in text
    assert not re.search("0x7f[0-9a-f]{6}", re.sub("double 0x[0-9A-F]{16}", "", text))
    assert not re.search(r"^declare .*@\"?(Py|NRT|numba|_Z)", text, re.MULTILINE)


@pytest.mark.weekly
@ALL
def test_made_anew_it_is_the_same_file(name, tmp_path):
    """Whoever makes it, on whatever machine, with the same numba."""
    group = group_by_name(name)
    if header(group)["numba"] != numba.__version__:
        pytest.skip("another numba")
    path = tmp_path / "code.bitcode"
    subprocess.run([sys.executable, "-m", "nlctl.native.ship", name, path], check=True)
    same = path.read_bytes() == group.path.read_bytes()
    assert same  # a difference of bytes would be printed for minutes


def total(values, factor):
    """Write multiples of some values, and return sums."""
    sums = 0.0
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[i, j] *= factor
            sums += values[i, j]
    return values.size, (sums, sums > 0.0)


def parts(values, first):
    """Return new memory, a part of it two times, and a part of an argument."""
    squares = values * values
    return squares, squares[first:], values[first:]


def switched(first, values, second):
    """Take a tuple on both sides of an array, and something that may be left out."""
    if second is None:
        return first[0] * values[0] + first[1]
    return first[0] * values[0] + second


ROW, TABLE, PAIR = (
    types.float64[::1],
    types.float64[:, ::1],
    types.Tuple((types.float64, types.int64)),
)
SUMS = types.Tuple((types.int64, types.Tuple((types.float64, types.boolean))))
REAL = types.float64
SIGNATURES = {
    "total": (total, SUMS(TABLE, REAL)),
    "parts": (parts, types.UniTuple(ROW, 3)(ROW, types.int64)),
    "without": (switched, REAL(PAIR, ROW, types.none)),
    "switched": (switched, REAL(PAIR, ROW, REAL)),
}
SMALL = Shipped(
    path=Path("none"),
    wanted=tuple(
        Wanted(function=function, signature=signature, options=AS_SHIPPED, name=name)
        for name, (function, signature) in SIGNATURES.items()
    ),
)


@pytest.fixture(scope="module")
def small():
    return SMALL.functions


def test_arrays_are_written_and_tuples_are_returned(small):
    values = np.arange(6.0).reshape(2, 3)
    expected = values * -2.0
    assert small["total"](values, -2.0) == (6, (expected.sum(), False))
    np.testing.assert_array_equal(values, expected)


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40), st.integers(0, 39))
def test_arrays_are_returned_whatever_memory_they_are_in(values, first):
    function, array = SMALL.functions["parts"], np.array(values)
    first = min(first, len(values))
    results = function(array, first)
    for value, expected in zip(results, (array**2, array[first:] ** 2, array[first:]), strict=True):
        np.testing.assert_array_equal(value, expected)
    results[2][:] = 0.0  # a copy
    np.testing.assert_array_equal(array, values)


def test_their_memory_is_given_back(small):
    """Each call needs 8 MB, and 1,000 of them would need more than most machines have."""
    resource = pytest.importorskip("resource")
    values = np.zeros(1_000_000)
    small["parts"](values, 5)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(300):
        small["parts"](values, 5)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB: 20 of them


def test_one_function_by_two_names(small):
    pair, row = (2.0, 7), np.array([3.0])
    assert small["without"](pair, row, None) == 13.0
    assert small["switched"](pair, row, 0.5) == 6.5


@pytest.mark.parametrize(
    "array", [np.zeros((3, 2)).T, np.zeros((2, 3), np.float32), np.zeros(6), np.zeros((2, 3), int)]
)
def test_other_arrays_are_refused(small, array):
    with pytest.raises(TypeError, match="C-contiguous array of 2 dimensions of float64, got"):
        small["total"](array, 1.0)


def test_what_only_numba_has_is_not_shipped():
    def largest(values):
        return np.max(values)

    group = Shipped(
        path=Path("none"),
        wanted=(Wanted(function=largest, signature=types.float64(ROW), options=AS_SHIPPED),),
    )
    with pytest.raises(nlctl.errors.CompileError, match="which only numba has"):
        functions_of(group)


@pytest.mark.weekly
def test_edited_sources_are_compiled_and_kept(tmp_path, monkeypatch):
    """Without what is shipped: numba once, then from the cache, and the same bits."""
    monkeypatch.setenv("NLCTL_CACHE_DIR", str(tmp_path / "cache"))
    script = (
        "import sys; from dataclasses import replace; from pathlib import Path\n"
        "from numba.core import event\n"
        "from nlctl.native import driver; from nlctl.native.integrators import INTEGRATORS\n"
        "from nlctl.native.machine.shipped import functions_of\n"
        "sys.path.insert(0, sys.argv[1]); import test_native_shipped as tests\n"
        "with event.install_recorder('numba:compile') as recorded:\n"
        "    code = functions_of(replace(INTEGRATORS, path=Path('none')))\n"
        "driver.integrators = lambda: code\n"
        "print(bool(recorded.buffer), tests.digest())"
    )
    command = [sys.executable, "-c", script, str(Path(__file__).parent)]
    for compiles in (True, False):  # in a process that has compiled nothing before
        run = subprocess.run(command, capture_output=True, text=True, check=True)
        assert run.stdout.split() == [str(compiles), digest()]


def digest():
    """A hash of all results."""
    return hashlib.sha256(b"".join(array.tobytes() for array in results())).hexdigest()
