"""From LLVM IR to code that can be called: optimised, made for this processor, kept on disk.

For diagrams seven passes are enough: what O2 does beyond them takes five times as long and gains
nothing on straight arithmetic.  Bitcode of `export` has loops, and gets O3 without unrolling and
interleaving, which take twice as long and gain nothing.  The object code is kept under a key of
all that it is made from.

Relied on in llvmlite: text is parsed by `parse_assembly`, which reads what other versions of LLVM
write; symbols that are added to the process are found by MCJIT before those of libraries.
"""

import functools
import hashlib
import lzma
import re
import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from ...errors import CompileError
from . import store
from .fingerprint import function_key

PASSES = (
    "always_inliner", "sroa", "instruction_combine", "simplify_cfg", "new_gvn",
    "dead_code_elimination", "global_dead_code_eliminate",
)  # fmt: skip
TUNING = {
    "loop_vectorization": True, "slp_vectorization": False, "loop_unrolling": False,
    "loop_interleaving": False,
}  # fmt: skip
_ONE_AT_A_TIME = threading.Lock()  # symbols are the process's


@dataclass(frozen=True, kw_only=True)
class Loaded:
    """Code in memory."""

    addresses: Mapping[str, int]  # of its functions, by name
    owners: tuple[Any, ...]  # what must not be forgotten while these are used


def finished(
    source: str | bytes,
    names: Iterable[str],
    symbols: Mapping[str, int] = MappingProxyType({}),
    owners: Iterable[Any] = (),
) -> Loaded:
    """Return the functions of some IR, ready to be called."""
    with _ONE_AT_A_TIME:
        key = _key(source)
        code = store.read(key)
        if code is None:
            code = _object_code(source)
            store.write(key, code)
        for name, address in symbols.items():
            llvm.add_symbol(name, address)
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
        if isinstance(source, str):
            _check_symbols(source)  # now LLVM looks into this process too
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        addresses = {name: engine.get_function_address(name) for name in names}
    return Loaded(addresses=addresses, owners=(engine, *owners))


def _check_symbols(text: str) -> None:
    """Check that all that is called is there: LLVM would end the process."""
    for name in re.findall(r"^declare .*?@(\w+)\(", text, re.MULTILINE):  # LLVM's have a dot
        if not llvm.address_of_symbol(name):
            raise CompileError(f"this machine's C library has no function '{name}'")


def _object_code(source: str | bytes) -> bytes:
    machine = _machine()
    if isinstance(source, str):
        return program_code(source, machine)
    options = llvm.create_pipeline_tuning_options(3)
    for name, value in TUNING.items():
        setattr(options, name, value)
    builder = llvm.create_pass_builder(machine, options)
    passes = builder.getModulePassManager()
    passes.add_refprune_pass()
    return _emitted(llvm.parse_bitcode(lzma.decompress(source)), machine, passes, builder)


def program_code(text: str, machine: object) -> bytes:
    """Return the IR of a program as object code for a machine of LLVM's."""
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options())
    passes = llvm.create_new_module_pass_manager()
    for name in PASSES:
        getattr(passes, f"add_{name}_pass")()
    return _emitted(llvm.parse_assembly(text), machine, passes, builder)


def _emitted(module: Any, machine: Any, passes: Any, builder: Any) -> bytes:
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    module.verify()
    passes.run(module, builder)
    return machine.emit_object(module)


_MAKER = _object_code  # with all that it calls and reads: passes and options


def _key(source: str | bytes) -> str:
    """Return a key of IR and of what object code is made of and made by besides."""
    versions = llvmlite.__version__, llvm.llvm_version_info
    parts = (source, *_processor(), *versions, function_key(_MAKER))
    return hashlib.sha256(repr(parts).encode()).hexdigest()


@functools.cache
def _processor() -> tuple[str, str, str]:
    """Return the triple of this process, and the processor's name and features."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features().flatten()
    return llvm.get_process_triple(), llvm.get_host_cpu_name(), features


def _machine() -> Any:
    triple, name, features = _processor()
    return llvm.Target.from_triple(triple).create_target_machine(
        cpu=name, features=features, opt=2, reloc="default", codemodel="jitdefault", jit=True
    )
