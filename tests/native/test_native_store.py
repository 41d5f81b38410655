"""Machine code on disk: found again, never stale, never believed unseen."""

import ctypes
import os
import pickle
import shutil
import stat
import subprocess
import sys
import traceback
import warnings
from collections import namedtuple
from pathlib import Path
from types import ModuleType

import control as ct
import llvmlite
import numba
import numpy as np
import pytest
import scipy
import source_text
from hypothesis import given
from hypothesis import strategies as st
from numba.core import config, event
from scipy import constants as physics

import nlctl
from nlctl.errors import CacheWarning, CompileError
from nlctl.native.integrators import INTEGRATORS
from nlctl.native.machine import finish, store
from nlctl.native.machine import machine_code as machine_code_module
from nlctl.native.machine.calls import loaded
from nlctl.native.machine.fingerprint import function_key, module_key
from nlctl.native.machine.machine_code import TEACHERS, Wanted, machine_code
from nlctl.native.machine.shipped import shipped_key
from nlctl.native.opaque.called import Source

PACKAGE = Path(nlctl.__file__).parent
REAL = numba.float64(numba.float64)
BODY = bytes(range(256)) * 2
SIZE = len(store._entry("key", BODY))
with_jit = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="nothing is compiled without JIT"
)
with_owners = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
as_root = pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may give files away"
)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """An own, empty cache folder."""
    path = tmp_path / "cache"
    monkeypatch.setenv("NLCTL_CACHE_DIR", str(path))
    return path


@pytest.fixture(scope="module")
def entry_folder(tmp_path_factory):
    """A folder with one entry, for many examples."""
    path = tmp_path_factory.mktemp("entries")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NLCTL_CACHE_DIR", str(path))
        store.write("key", BODY)
    return path


def found(folder, content):
    """What is read where an entry's file has this content."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NLCTL_CACHE_DIR", str(folder))
        store._path("key").write_bytes(content)
        return store.read("key")


def whole():
    return store._entry("key", BODY)


def cubed(x):
    return x**3 - 2.0


def code(key="cubed", function=cubed, **options):
    """A compiled function, and how many compilations it took."""
    wanted = Wanted(function=function, signature=REAL, options={"error_model": "numpy", **options})
    with event.install_recorder("numba:compile") as recorder:
        made = machine_code(key, wanted)
    return made, sum(e.is_start for _, e in recorder.buffer)


def only(folder):
    (file,) = folder.iterdir()
    return file


class TestEntries:
    """What is read is what was written, or nothing."""

    def test_what_was_written_is_read(self, folder):
        """Any bytes, in a folder that only its owner can look into."""
        for body in (b"", b"\0" * 10, os.urandom(100_000)):
            store.write("key", body)
            assert store.read("key") == body
        assert store.read("other") is None
        if sys.platform != "win32":
            assert stat.S_IMODE(folder.stat().st_mode) == 0o700

    @given(place=st.integers(0, SIZE - 1), bit=st.integers(0, 7))
    def test_one_flipped_bit_is_seen(self, entry_folder, place, bit):
        """Anywhere: mark, digest and content."""
        content = bytearray(whole())
        content[place] ^= 1 << bit
        assert found(entry_folder, bytes(content)) is None

    @given(size=st.integers(0, SIZE - 1))
    def test_an_entry_cut_short_is_seen(self, entry_folder, size):
        """At any length."""
        assert found(entry_folder, whole()[:size]) is None

    @given(content=st.binary(max_size=200), behind=st.binary(min_size=1, max_size=5))
    def test_other_content_is_seen(self, entry_folder, content, behind):
        """Random bytes, alone, in the place of the content, and behind an entry."""
        assert found(entry_folder, content) is None
        assert found(entry_folder, whole()[: len(store.MARK) + store.DIGEST] + content) is None
        assert found(entry_folder, whole() + behind) is None
        assert found(entry_folder, whole()) == BODY

    def test_the_entry_of_another_key_is_seen(self):
        """A file that was renamed."""
        store.write("other", BODY)
        os.replace(store._path("other"), store._path("key"))
        assert store.read("key") is None

    @pytest.mark.parametrize("kind", ["folder", "link", "pipe"])
    def test_what_is_no_file_is_not_read(self, folder, tmp_path, kind):
        """Nor waited for; links within the folder are not followed."""
        folder.mkdir(mode=0o700)
        if kind == "folder":
            store._path("key").mkdir()
        elif kind == "link":
            (tmp_path / "elsewhere").write_bytes(whole())
            store._path("key").symlink_to(tmp_path / "elsewhere")
        elif hasattr(os, "mkfifo"):
            os.mkfifo(store._path("key"))
        assert store.read("key") is None

    def test_the_folder_may_be_a_link(self, folder, tmp_path):
        """What counts is the folder that it leads to."""
        (tmp_path / "disk").mkdir(mode=0o700)
        folder.symlink_to(tmp_path / "disk")
        store.write("key", BODY)
        assert store.read("key") == BODY

    @pytest.mark.weekly
    @pytest.mark.ci
    def test_two_processes_may_write_at_the_same_time(self, folder):
        """Whoever reads finds a whole entry."""
        script = (
            "from nlctl.native.machine import store\n"
            "for i in range(60):\n"
            "    store.write('key', bytes([i % 7]) * 200_000)\n"
            "    body = store.read('key')\n"
            "    assert len(body) == 200_000 and len(set(body)) == 1\n"
        )
        writers = [subprocess.Popen([sys.executable, "-c", script]) for _ in range(2)]
        assert [writer.wait(timeout=120) for writer in writers] == [0, 0]
        assert [file.name for file in folder.iterdir()] == ["key.code"]


@with_owners
class TestOwners:
    """Machine code that others could have put there is not run."""

    def count(self, action):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result = action()
        return result, [w for w in caught if w.category is CacheWarning]

    @pytest.mark.parametrize("mode", [0o777, 0o1777, 0o770, 0o702])
    def test_a_folder_that_others_may_write_to(self, folder, mode):
        """One warning for the process, with folder and remedy; nothing is read or written."""
        store.write("key", BODY)
        folder.chmod(mode)
        result, caught = self.count(lambda: [store.read("key"), store.write("new", BODY)] * 2)
        assert result[0] is None
        assert len(caught) == 1
        assert "chmod go-w" in str(caught[0].message)
        assert f"'{folder}'" in str(caught[0].message)
        assert [file.name for file in folder.iterdir()] == ["key.code"]

    @pytest.mark.parametrize("mode", [0o666, 0o620])
    def test_a_file_that_others_may_write_to(self, mode):
        """Not used, and made anew."""
        store.write("key", BODY)
        store._path("key").chmod(mode)
        result, caught = self.count(lambda: store.read("key"))
        assert result is None
        assert len(caught) == 1
        store.write("key", BODY)
        assert store.read("key") == BODY

    @as_root
    @pytest.mark.parametrize("owned", ["folder", "file"])
    def test_what_belongs_to_somebody_else(self, folder, owned):
        """A valid entry, but of another user."""
        store.write("key", BODY)
        os.chown(folder if owned == "folder" else store._path("key"), 12345, -1)
        result, caught = self.count(lambda: store.read("key"))
        assert result is None
        assert len(caught) == 1
        assert "belongs to another user" in str(caught[0].message)

    @with_jit
    def test_work_goes_on_in_memory(self, folder):
        """Right numbers and one warning, however many functions are compiled."""
        folder.mkdir()
        folder.chmod(0o777)

        def both():
            return code("one")[0](2.0), code("two")[0](2.0)

        result, caught = self.count(both)
        assert result == (6.0, 6.0)
        assert len(caught) == 1
        assert not list(folder.iterdir())


@with_jit
class TestMachineCode:
    """Compiled functions survive the way to disk and back."""

    def test_it_is_compiled_once(self, folder):
        """The second time nothing is compiled, and the numbers are the same bits."""
        first, compilations = code()
        assert compilations == 1
        second, compilations = code()
        assert compilations == 0
        for x in (0.1, -3.0, 1e200, np.nan, np.inf):
            np.testing.assert_array_equal(first(x), second(x))
        assert not second._can_compile  # other arguments are refused, as by a given signature
        assert len(list(folder.iterdir())) == 1

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "damage", ["flip", "truncate", "empty", "random", "rename", "pickle", "library"]
    )
    def test_a_damaged_entry_is_made_anew_without_a_word(self, folder, damage):
        """Right numbers, and an entry that is whole again."""
        code()
        file = only(folder)
        content = file.read_bytes()
        if damage == "rename":
            code("other", lambda x: -x)
            other = next(f for f in folder.iterdir() if f != file)
            os.replace(other, file)
        elif damage == "pickle":  # whole, but names what does not exist here
            store.write(file.stem, b"cmissing_module\nname\n.")
        elif damage == "library":  # whole, but no code that LLVM can read
            library, *rest = pickle.loads(store.read(file.stem))
            broken = (*library[:2], (library[2][0], b"no bitcode"))
            store.write(file.stem, pickle.dumps((broken, *rest)))
        else:
            flipped = bytearray(content)
            flipped[len(content) // 2] ^= 1
            changed = {"flip": bytes(flipped), "truncate": content[:-1], "empty": b""}
            file.write_bytes(changed.get(damage, np.random.default_rng(0).bytes(1000)))
        function, compilations = code()
        assert compilations == 1
        assert function(2.0) == 6.0
        assert code()[1] == 0
        assert store.read(file.stem) is not None

    def test_options_and_types_have_entries_of_their_own(self, folder):
        """The key that is given stands for the functions alone."""
        code()
        code(fastmath=True)
        wanted = Wanted(function=cubed, signature=numba.float32(numba.float32), options={})
        machine_code("cubed", wanted)
        assert len(list(folder.iterdir())) == 3

    def test_what_holds_an_address_is_not_kept(self, folder):
        """A C function of this process: compiled in every session."""
        c_function = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(lambda x: 2.0 * x)

        def calling(x):
            return c_function(x)

        assert code("calling", calling)[0](1.5) == 3.0
        assert not list(folder.iterdir()) if folder.exists() else True

    def test_a_program_runs_from_its_own_source(self, folder):
        """Sources on disk are not looked at, and a traceback shows the line."""
        program = Source(source="def rhs(t):\n    return np.sin(t[0])\n", names={"np": np})
        folder.mkdir(mode=0o700)
        key = function_key(program.source, program.names)
        (folder / f"nlctl_program_{key}.py").write_text("raise SystemExit")
        module = loaded(program)
        assert module.__name__ in sys.modules
        with pytest.raises(TypeError) as caught:
            module.rhs(0.0)
        line = traceback.extract_tb(caught.value.__traceback__)[-1].line
        assert line
        assert line in program.source


@with_jit
class TestPrograms:
    """Object code of what was traced."""

    def run(self, sign=1.0):
        """The right-hand side of a block, and how often object code was made for it."""
        made, right = [], finish._object_code
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(finish, "_object_code", lambda text: made.append(text) or right(text))
            system = ct.nlsys(lambda t, x, u, params: sign * np.exp(x), None, inputs=0, outputs=1,
                              states=1, name="e")  # fmt: skip
            found = nlctl.compile(system).dynamics(0.0, [1.0])
        np.testing.assert_allclose(found, sign * np.e, rtol=1e-15)
        return len(made)

    def test_it_is_made_once(self, folder):
        """Found again in this folder; another sign is another program."""
        assert [self.run(), self.run(), self.run(-1.0), self.run(-1.0)] == [1, 0, 1, 0]
        assert len(list(folder.iterdir())) == 2

    @pytest.mark.slow
    @pytest.mark.parametrize("damage", ["flip", "truncate", "empty", "random", "rename"])
    def test_a_damaged_entry_is_made_anew_without_a_word(self, folder, damage):
        """The code of another program under this one's name is not run either."""
        self.run()
        file = only(folder)
        content = file.read_bytes()
        if damage == "rename":
            self.run(-1.0)
            os.replace(next(f for f in folder.iterdir() if f != file), file)
        else:
            flipped = bytearray(content)
            flipped[len(content) // 2] ^= 1
            changed = {"flip": bytes(flipped), "truncate": content[:-1], "empty": b""}
            file.write_bytes(changed.get(damage, np.random.default_rng(0).bytes(1000)))
        assert [self.run(), self.run()] == [1, 0]
        assert file.read_bytes() == content

    def test_another_processor_or_llvm_has_its_own_entry(self, monkeypatch):
        """The key has both in it, and the passes."""
        text = "define void @f() { ret void }"
        keys = {finish._key(text), finish._key(text + " ")}
        with monkeypatch.context() as patch:
            patch.setattr(finish, "_processor", lambda: ("x86_64-linux-gnu", "generic", ""))
            keys.add(finish._key(text))
        with monkeypatch.context() as patch:
            patch.setattr(finish.llvmlite, "__version__", "0.0")
            keys.add(finish._key(text))
        monkeypatch.setattr(finish, "PASSES", ())
        keys.add(finish._key(text))
        assert len(keys) == 5

    def test_what_is_nowhere_is_an_error(self):
        """Not the end of the process."""
        text = (
            "declare void @no_such_function()\n"
            "define void @f() {\n  call void @no_such_function()\n  ret void\n}\n"
        )
        with pytest.raises(CompileError, match="'no_such_function'"):
            finish.finished(text, ["f"], {})


def total(x):
    s = 0.0
    for value in x:
        s += value
    return s


def shifted(offset=1.0, function=None):
    """A function with a default argument."""

    def inner(x, by=offset):
        return x + by

    return function or inner


class TestKeys:
    """Another key for whatever makes other machine code."""

    def test_default_arguments_count(self):
        """They are constants of the function."""
        assert function_key(shifted(1.0)) == function_key(shifted(1.0))
        assert function_key(shifted(1.0)) != function_key(shifted(2.0))

    @with_jit
    def test_options_of_compiled_functions_count(self):
        """The user's own ``numba.njit``."""
        plain, fast = numba.njit(cubed), numba.njit(fastmath=True)(cubed)
        assert function_key(plain) != function_key(fast)

    def test_what_is_read_of_a_module_counts(self):
        """``constants.gain`` in a function; what the function does not read does not count."""
        constants = ModuleType("constants_of_a_user")

        def reading(x):
            return constants.gain * x

        keys = []
        for gain, other in ((1.0, 0), (2.0, 0), (1.0, 1)):
            constants.gain, constants.other = gain, other
            keys.append(function_key(reading))
        assert keys[0] != keys[1]
        assert keys[0] == keys[2]

    @pytest.mark.parametrize("kind", [float, int, complex])
    def test_numbers_of_a_class_of_ones_own_count(self, kind):
        """numba takes them for what they are derived from."""
        own = type("Own", (kind,), {})

        def keys(value):
            held = own(value)
            return function_key(lambda x: held * x)

        assert keys(2) == keys(2)
        assert keys(2) != keys(3)

    def test_numbers_of_libraries_count(self, monkeypatch):
        """``physics.c`` of another version, or set by somebody; other names do not."""

        def reading(x):
            return physics.c * x

        keys = []
        for c, other in ((1.0, 0), (2.0, 0), (1.0, 1)):
            monkeypatch.setattr(physics, "c", c)
            monkeypatch.setattr(physics, "h", other)
            keys.append(function_key(reading))
        assert keys[0] != keys[1]
        assert keys[0] == keys[2]

    def test_what_is_found_by_a_text_counts(self):
        """``getattr(constants, "gain")``."""
        constants = ModuleType("constants_of_a_user")

        def reading(x):
            return getattr(constants, "gain") * x  # noqa: B009 (that is the case)

        keys = []
        for constants.gain in (1.0, 2.0):
            keys.append(function_key(reading))
        assert keys[0] != keys[1]

    def test_versions_of_what_may_be_called_count(self, monkeypatch):
        """Functions of these are named in keys, and not read."""
        keys = {machine_code_module._compiler.__wrapped__()}
        for library in (numba, llvmlite, np, scipy, ct):
            with monkeypatch.context() as patch:
                patch.setattr(library, "__version__", "0.0")
                keys.add(machine_code_module._compiler.__wrapped__())
        assert len(keys) == 6

    def test_what_makes_object_code_counts(self, monkeypatch):
        """Passes and options, and functions that have them."""
        keys = {finish._key("text")}
        for name in ("program_code", "_emitted", "_machine"):
            with monkeypatch.context() as patch:
                patch.setattr(finish, name, lambda *given: given)
                keys.add(finish._key("text"))
        assert len(keys) == 4

    def test_names_of_fields_count(self):
        """Two records with the same values in another order."""
        one, other = namedtuple("Point", "a b")(1.0, 2.0), namedtuple("Point", "b a")(1.0, 2.0)
        assert function_key(one) != function_key(other)

    @pytest.mark.weekly
    @pytest.mark.ci
    def test_a_key_is_the_same_in_every_process(self):
        """Whatever the order of sets and the addresses of objects there are."""
        script = (
            "import hashlib, nlctl\n"
            "from nlctl.native.lower import lower\n"
            "compiled = nlctl.compile(nlctl.paper.example_2())\n"
            "lowered = lower(compiled.schedule, compiled.program)\n"
            "text = hashlib.sha256(lowered.text.encode()).hexdigest()\n"
            "print(text, len(lowered.text))\n"
        )
        keys = [
            subprocess.run(
                [sys.executable, "-c", script], env=os.environ | {"PYTHONHASHSEED": seed},
                capture_output=True, text=True, check=True,
            ).stdout.split()
            for seed in ("1", "2")
        ]  # fmt: skip
        assert len(set(keys[0])) == 2
        assert keys[0] == keys[1]

    def test_what_contains_itself_has_a_key(self):
        """A list in itself, and functions that call each other."""
        ring: list = []
        ring.append(ring)
        assert function_key(ring) == function_key(ring)

    @pytest.mark.parametrize("sign", ["+", "-"])
    def test_a_program_with_another_source(self, sign):
        """The sign of one term."""
        made = source_text.run(f"def f(t, x, u, params):\n    return [x[0] {sign} u[0]]\n")
        system = ct.nlsys(made["f"], inputs=1, states=1, outputs=1, name="signed")
        base = ct.nlsys(lambda t, x, u, params: [x[0] * u[0]], inputs=1, states=1, name="signed")
        assert nlctl.compile(system).lowered.text != nlctl.compile(base).lowered.text


EDITS = {  # module -> what is edited there
    "integrate/control.py": ("SMALLEST = 4e-16", "SMALLEST = 5e-16"),
    "integrate/methods/explicit.py": ("if E.size == 7", "if E.size == 8"),
    "integrate/memory.py": ("_ENTRY = 5", "_ENTRY = 6"),
    "machine/export.py": ('"error_model": "numpy"', '"error_model": "python"'),
    "machine/address.py": ("ir.VoidType()", "ir.IntType(32)"),
}


DAILY = "integrate/memory.py", "machine/address.py"  # the others' way into the key is the same


def keys_of_copy(path, edits):
    """The integrators' key of an edited copy of the package, and that of code that numba is taught.

    They come from a process of its own.
    """
    shutil.copytree(PACKAGE, path / "nlctl", ignore=shutil.ignore_patterns("__pycache__"))
    for name, (before, after) in edits.items():
        module = path / "nlctl" / "native" / name
        source = module.read_text(encoding="utf-8")
        assert source.count(before) == 1
        module.write_text(source.replace(before, after), encoding="utf-8")
    script = (
        "import nlctl; from nlctl.native.integrators import INTEGRATORS\n"
        "from nlctl.native.machine.shipped import shipped_key\n"
        "from nlctl.native.machine.machine_code import TEACHERS\n"
        "from nlctl.native.machine.fingerprint import module_key\n"
        "print(nlctl.__file__, shipped_key(INTEGRATORS), module_key(*TEACHERS))"
    )
    run = subprocess.run(
        [sys.executable, "-c", script], cwd=path, env=os.environ | {"PYTHONPATH": str(path)},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    file, *keys = run.stdout.split()
    assert Path(file).is_relative_to(path)
    return keys


@with_jit
class TestSources:
    """Machine code follows the sources of the package."""

    @pytest.mark.slow
    def test_a_copy_has_the_same_keys(self, tmp_path):
        """Paths and processes do not count."""
        assert keys_of_copy(tmp_path, {}) == [shipped_key(INTEGRATORS), module_key(*TEACHERS)]

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "name",
        [name if name in DAILY else pytest.param(name, marks=pytest.mark.weekly) for name in EDITS],
    )
    def test_an_edit_of_any_module_of_the_integrators(self, tmp_path, name):
        """Constants, coefficients, generated code, options."""
        before = [shipped_key(INTEGRATORS), module_key(*TEACHERS)]
        assert keys_of_copy(tmp_path, {name: EDITS[name]}) != before

    def test_use_does_not_change_a_key(self):
        """What a code generator remembers is not a part of it."""
        before = module_key(*TEACHERS), shipped_key(INTEGRATORS)
        for k in range(3):
            scope = source_text.run(
                f"def helper(v):\n    return {k} * v\n\n\n"
                "function = lambda t, x, u, params: [helper(x[0])]\n"
            )
            system = ct.nlsys(scope["function"], None, inputs=0, outputs=1, states=1, name="used")
            nlctl.compile(system).native  # noqa: B018
        assert (module_key(*TEACHERS), shipped_key(INTEGRATORS)) == before

    @pytest.mark.weekly
    def test_an_edit_of_a_code_generator(self, tmp_path):
        """Machine code of programs: nothing in them names what generates it."""
        first = "from __future__ import annotations\n"
        edits = {"purity/dicts.py": (first, f"{first}\nEDITED = True\n")}
        integrators, taught = keys_of_copy(tmp_path, edits)
        assert integrators == shipped_key(INTEGRATORS)
        assert taught != module_key(*TEACHERS)
