"""What is relied on of numba although it does not document it: one test for each name."""

import ctypes
import ctypes.util
import pickle
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core import config, event

from nlctl.native.integrate.memory import Places2, Reals2, type_of, with_table
from nlctl.upstream import numba_internals as internals

REAL = numba.float64(numba.float64)
pytestmark = pytest.mark.skipif(
    internals.is_jit_disabled(), reason="nothing is compiled without JIT"
)


def cubed(x):
    return x**3 - 2.0


class Recording(internals.CodeCache):
    """Keeps what it is told, and what it is asked."""

    def __init__(self, data=None):
        self.data, self.asked = data, []

    def load(self, signature):
        self.asked.append(signature)
        return self.data

    def save(self, signature, data):
        self.data = data


def compiled(function, cache):
    """A compiled function that has this cache."""
    made = numba.njit(function)
    internals.give_cache(made, cache)
    made.compile(REAL)
    return made


def test_a_dispatcher_asks_its_cache():
    """``_cache``, ``load_overload``, ``save_overload``: asked before, told after."""
    cache = Recording()
    compiled(cubed, cache)
    assert cache.asked == [REAL]
    assert cache.data is not None


def test_code_is_plain_data_and_back():
    """``_reduce`` and ``_rebuild``: the machine code itself, nothing is compiled."""
    first = Recording()
    compiled(cubed, first)
    data = pickle.loads(pickle.dumps(first.data))
    with event.install_recorder("numba:compile") as recorder:
        back = compiled(cubed, Recording(data))
    assert not recorder.buffer
    assert back(2.0) == 6.0


def test_code_that_cannot_be_rebuilt_is_compiled():
    """Data of another version of numba, say."""
    assert compiled(cubed, Recording(data=("nonsense",)))(2.0) == 6.0


def test_code_with_addresses_of_this_process_is_not_kept():
    """``library.has_dynamic_globals``: a function of C by its address."""
    function = ctypes.CDLL(ctypes.util.find_library("m")).cos
    function.argtypes, function.restype = [ctypes.c_double], ctypes.c_double
    cache = Recording()
    made = compiled(lambda x: function(x), cache)
    assert made(0.0) == 1.0
    assert cache.data is None


def test_code_with_loops_of_its_own_is_not_kept():
    """``lifted``: loops that numba has compiled apart are no data of the function's."""
    made = numba.njit(cubed)
    made.compile(REAL)
    (result,) = made.overloads.values()
    assert not result.lifted
    cache = Recording()
    cache.save_overload(REAL, result)
    assert cache.data is not None
    kept, cache = result._replace(lifted=(object(),)), Recording()
    cache.save_overload(REAL, kept)
    assert cache.data is None


def test_the_processor_has_a_name_and_features():
    """``codegen().magic_tuple()``: triple, name, features."""
    triple, name, features = internals.processor()
    assert triple
    assert name
    assert isinstance(features, str)


def test_a_compiled_function_has_an_address():
    """``overloads``, ``llvm_cfunc_wrapper_name``, ``get_pointer_to_function``."""
    made = numba.njit(cubed)
    made.compile(REAL)
    call = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(internals.address_of(made, REAL))
    assert call(3.0) == 25.0


def test_the_ir_of_a_function_is_its_own():
    """``add_ir_module``, ``_linking_libraries``, ``llvm_func_name``: each function once."""
    inner = numba.njit(cubed)
    with internals.own_ir() as texts:
        outer = numba.njit(REAL)(lambda x: inner(x) + 1.0)
        inner_name, inner_library = internals.name_and_library(inner)
        name, library = internals.name_and_library(outer)
    assert inner_library in internals.called_libraries(library)
    for mine, other, of in ((name, inner_name, library), (inner_name, name, inner_library)):
        lines = "\n".join(texts[id(of)]).splitlines()
        defined = [line for line in lines if line.startswith("define ")]
        assert any(f'"{mine}"(' in line for line in defined)
        assert not any(f'"{other}"(' in line for line in defined)


def test_threads_wait_for_each_other():
    """`global_compiler_lock`: one that its holder may take again."""
    lock = internals.global_compiler_lock
    with lock, lock:
        assert lock.is_locked()


def test_what_njit_makes_is_a_dispatcher():
    """`CPUDispatcher`, which has the function that it was made of as ``py_func``."""
    made = numba.njit(cubed)
    assert isinstance(made, internals.CPUDispatcher)
    assert not isinstance(cubed, internals.CPUDispatcher)
    assert made.py_func is cubed


def place(x):
    """Where it runs."""
    return "Python"


def test_a_plain_function_can_be_an_intrinsic():
    """`infer_global` and `make_intrinsic_template`: in machine code it is IR."""

    def definition(typing_context, x):
        return numba.float64(numba.float64), lambda context, builder, sig, args: builder.fmul(
            args[0], args[0]
        )

    template = internals.make_intrinsic_template(place, definition, "place", prefer_literal=False)
    internals.infer_global(place, numba.types.Function(template))
    assert numba.njit(lambda x: place(x))(3.0) == 9.0
    assert place(3.0) == "Python"


class Pair(NamedTuple):
    factor: float
    rows: Reals2
    table: Places2


def test_the_attributes_of_a_type_can_be_read_from_memory():
    """`AttributeTemplate`, `infer_getattr`, `populate_array`, `pack_array`, `as_dtype`."""
    rows = np.arange(6.0).reshape(2, 3)
    record = with_table(Pair, factor=2.0, rows=rows)
    kind = type_of(Pair)
    assert {name: str(dtype) for name, (dtype, _) in kind.formats.items()} == {
        "factor": "float64", "rows": "float64",
    }  # fmt: skip

    signature = numba.void(kind)

    def scaled(pair):
        for i in range(pair.rows.shape[0]):
            for j in range(pair.rows.shape[1]):
                pair.rows[i, j] *= pair.factor

    code = numba.njit(signature, no_cpython_wrapper=True)(scaled)
    call = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(internals.address_of(code, signature))
    call(record.table.ctypes.data)
    np.testing.assert_array_equal(rows, 2.0 * np.arange(6.0).reshape(2, 3))


def test_what_numba_refuses_is_a_numba_error():
    """`NumbaError`."""
    with pytest.raises(internals.NumbaError):
        numba.njit(lambda x: x.nothing)(1.0)


@pytest.mark.slow
def test_what_numba_warns_of_is_a_numba_warning():
    """`NumbaWarning`: here of a matrix that is not contiguous."""
    matrix = np.ones((4, 4))[::2, ::2]
    with pytest.warns(internals.NumbaWarning):
        numba.njit(lambda a: a @ a)(matrix)


@pytest.mark.parametrize("name", [*internals.SETTINGS, "DISABLE_JIT"])
def test_the_settings_exist(name):
    """A setting that numba has renamed would no longer be in the key."""
    assert hasattr(config, name)
