"""numba's private names; ``tests/upstream/test_numba_internals.py`` has a test of each.

- ``Dispatcher._cache`` with ``load_overload`` and ``save_overload``: asked before a signature is
  compiled, and reported afterwards.
- ``CompileResult._reduce`` and ``_rebuild``: compiled code as plain data.
- ``library.has_dynamic_globals`` and ``lifted``: code that holds addresses of this process.
- ``codegen().magic_tuple()``: the processor that code is made for.
- ``overloads``, ``fndesc.llvm_cfunc_wrapper_name``, ``get_pointer_to_function``: addresses.
- ``CPUCodeLibrary.add_ir_module``: is given each function's own IR; ``_linking_libraries`` are the
  libraries that it calls, ``fndesc.llvm_func_name`` is what LLVM calls it.
- `global_compiler_lock`: several threads may ask at the same time.
- `CPUDispatcher`: what `numba.njit` makes of a function.
- `infer_global`, `make_intrinsic_template`: a plain function that is an intrinsic in machine code.
- `AttributeTemplate`, `infer_getattr`, `populate_array`, `pack_array`, `as_dtype`: a type whose
  attributes are read from memory.
- `NumbaError`, `NumbaWarning`: what it raises and warns of.
- the settings in `SETTINGS`, and ``DISABLE_JIT``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import config
from numba.core.caching import NullCache
from numba.core.cgutils import normalize_ir_text, pack_array
from numba.core.codegen import CPUCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import NumbaError, NumbaWarning
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.typing.templates import (
    AttributeTemplate,
    infer_getattr,
    infer_global,
    make_intrinsic_template,
)
from numba.np.arrayobj import populate_array
from numba.np.numpy_support import as_dtype

__all__ = [
    "SETTINGS", "AttributeTemplate", "CPUDispatcher", "CodeCache", "NumbaError", "NumbaWarning",
    "address_of", "as_dtype", "called_libraries", "checks_indices", "give_cache",
    "global_compiler_lock", "infer_getattr", "infer_global", "is_jit_disabled",
    "make_intrinsic_template", "name_and_library", "own_ir", "pack_array", "populate_array",
    "processor", "settings",
]  # fmt: skip

# settings of numba that change the code
SETTINGS = ("OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "USING_SVML")
SETTINGS += ("DEBUGINFO_DEFAULT", "LLVM_REFPRUNE_PASS", "LLVM_REFPRUNE_FLAGS")


def is_jit_disabled() -> bool:
    """Whether numba compiles nothing (NUMBA_DISABLE_JIT=1)."""
    return bool(getattr(config, "DISABLE_JIT", False))


def checks_indices() -> bool:
    """Whether numba checks all indices (NUMBA_BOUNDSCHECK=1)."""
    return bool(getattr(config, "BOUNDSCHECK", False))


def settings() -> dict[str, Any]:
    """Return numba's settings that change the code."""
    return {name: getattr(config, name, None) for name in SETTINGS}


def processor() -> tuple[Any, ...]:
    """Return the triple, the name and the features of the processor that code is made for."""
    target: Any = cpu_target.target_context
    return target.codegen().magic_tuple()


class CodeCache(NullCache):
    """What a dispatcher asks for code before it compiles a signature, and gives it afterwards."""

    def load(self, signature: object) -> Any:
        """Return what `save` was given for a signature, None if there is nothing."""
        raise NotImplementedError

    def save(self, signature: object, data: object) -> None:
        """Keep code that means the same in another process; it is plain data."""
        raise NotImplementedError

    def load_overload(self, sig: object, target_context: object) -> CompileResult | None:
        """Return code for numba."""
        data = self.load(sig)
        return None if data is None else _rebuilt(data, target_context)

    def save_overload(self, sig: object, cres: CompileResult) -> None:
        """Take code from numba; that with addresses of this process is not kept."""
        if not cres.library.has_dynamic_globals and not cres.lifted:
            self.save(sig, cres._reduce())


def give_cache(code: Any, cache: CodeCache) -> None:
    """Let a compiled function ask this cache."""
    code._cache = cache


def _rebuilt(data: Any, target_context: Any) -> CompileResult | None:
    target_context.refresh()  # numba's own functions, as for compiling
    try:
        return CompileResult._rebuild(target_context, *data)
    except Exception:  # LLVM does not find here what the code calls: it is compiled again
        return None


def address_of(code: Any, signature: Any) -> int:
    """Return the address of a compiled function as a C function; it holds as long as the code."""
    compiled = code.overloads[signature.args]
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)


def name_and_library(code: Any) -> tuple[str, Any]:
    """Return what LLVM calls a function of one signature, and the library that has it."""
    (compiled,) = code.overloads.values()
    return compiled.fndesc.llvm_func_name, compiled.library


def called_libraries(library: Any) -> list[Any]:
    """Return the libraries that one calls."""
    return list(library._linking_libraries)


@contextmanager
def own_ir() -> Iterator[dict[int, list[str]]]:
    """Keep the IR of each function that is compiled inside, by the identity of its library."""
    texts: dict[int, list[str]] = {}
    add = CPUCodeLibrary.add_ir_module

    def keep(self: Any, module: object) -> None:
        texts.setdefault(id(self), []).append(normalize_ir_text(str(module)))
        add(self, module)

    with global_compiler_lock:  # nobody else compiles
        CPUCodeLibrary.add_ir_module = keep  # type: ignore[method-assign]
        try:
            yield texts
        finally:
            CPUCodeLibrary.add_ir_module = add  # type: ignore[method-assign]
