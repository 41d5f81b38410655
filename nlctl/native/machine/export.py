"""What numba makes of functions, as LLVM bitcode that llvmlite alone can finish on any machine.

numba optimises and emits each function with all that it calls, and again for each caller.  Here
its IR is taken before that, linked once, and simplified as far as no processor matters: function
by function, without vectorisation and inlining.  `finish` does the rest, in a tenth of the time.

Relied on in the IR that numba makes, and held by a test each:

- a function takes pointers for the result and for an exception, then the arguments, and returns
  `RETURNED` or `NONE`, or the number of an exception;
- memory of arrays is asked for by ``NRT_MemInfo_alloc_aligned`` and given back by
  ``NRT_MemInfo_call_dtor``; `_MEMORY` has both in terms of the C library, with numba's layout.
"""

from __future__ import annotations

import lzma
import re
from collections.abc import Iterable, Sequence
from typing import Any

import llvmlite.binding as llvm
import numba

from ...errors import CompileError
from ...upstream.numba_internals import called_libraries, name_and_library, own_ir
from .machine_code import Wanted

# of `numba.njit`: for functions that are exported, and for those that they call
AS_SHIPPED = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
RETURNED, NONE = 0, -2
RELEASE = "NRT_MemInfo_call_dtor"  # what gives memory back, can be called from outside as well
_ELSEWHERE = ("NRT_", "numba_", "Py")  # functions that only a process with numba and Python has
_LONG = 80  # lines of IR from which on a function is not inlined: twice the compile time, no gain
_MANGLED = r'@"?(_Z[\w.$]+)"?'
_MEMORY = """
declare ptr @malloc(i64)
declare void @free(ptr)

define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %most = add i64 %size, 128
  %info = call ptr @malloc(i64 %most)
  %none = icmp eq ptr %info, null
  br i1 %none, label %failed, label %made
made:
  %address = ptrtoint ptr %info to i64
  %behind = add i64 %address, 127
  %aligned = and i64 %behind, -64
  %data = inttoptr i64 %aligned to ptr
  store i64 1, ptr %info
  %place = getelementptr i8, ptr %info, i64 24
  store ptr %data, ptr %place
  ret ptr %info
failed:
  ret ptr null
}

define void @NRT_MemInfo_call_dtor(ptr %info) {
  call void @free(ptr %info)
  ret void
}
"""


def exported(requests: Sequence[Wanted]) -> bytes:
    """Return compressed bitcode of functions, each with its Python name."""
    names, libraries = {}, []
    with own_ir() as texts:
        for request in requests:
            code: Any = numba.njit(request.signature, **request.options)(request.function)
            name, library = name_and_library(code)
            names[name] = request.called
            libraries.append(library)
    reached: dict[int, Any] = {}
    for library in libraries:
        _reach(library, reached)
    linked = llvm.parse_assembly(_MEMORY)
    for key, library in reached.items():
        for text in texts.get(key) or [library.get_llvm_str()]:  # what was compiled before has none
            linked.link_in(llvm.parse_assembly(text))
    module = _named(linked, names)
    _simplify(module)
    return lzma.compress(_apart(module, names.values()).as_bitcode(), preset=9)


def _reach(library: object, reached: dict[int, Any]) -> None:
    """Add a library and all that it calls."""
    if id(library) not in reached:
        reached[id(library)] = library
        for other in called_libraries(library):
            _reach(other, reached)


def _named(module: Any, names: dict[str, str]) -> Any:
    """Return a module in which only functions of these names can be called from outside."""
    # What an exception says is left out: only its number is read, and it has the paths of the
    # machine that makes the module.
    for function in module.functions:
        if not function.is_declaration:
            is_called = function.name in names or function.name == RELEASE
            function.linkage = "external" if is_called else "internal"
    text = re.sub(r"store ptr @\.const\.picklebuf[\w.]+", "store ptr null", str(module))
    for mangled, name in names.items():
        text = re.sub(rf'@"?{re.escape(mangled)}"?(?![\w.$"])', f"@{name}", text)
    renamed = llvm.parse_assembly(text)
    renamed.verify()
    return renamed


def _simplify(module: Any) -> None:
    """Simplify each function; reference counts that cancel go."""
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(cpu="", features="", opt=3)
    builder = _builder(machine, 3)
    passes = builder.getFunctionPassManager()
    passes.add_refprune_pass()
    for function in module.functions:
        if not function.is_declaration:
            passes.run(function, builder)
    all_of_it = _builder(machine, 0)
    passes = all_of_it.getModulePassManager()
    passes.add_loop_rotate_pass()
    passes.add_instruction_combine_pass()
    passes.add_jump_threading_pass()
    passes.add_refprune_pass()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, all_of_it)
    module.verify()
    for function in module.functions:
        if function.name.startswith(_ELSEWHERE) and function.is_declaration:
            raise CompileError(f"code to be shipped calls '{function.name}', which only numba has")


def _apart(module: Any, entries: Iterable[str]) -> Any:
    """Return a module whose long functions are not inlined, by short names."""
    # As text: some versions of llvmlite give the attribute to the result.
    text = str(module)
    for function in module.functions:
        short = str(function).count("\n") < _LONG
        if not (function.is_declaration or short or function.name in entries):
            place = rf'(\ndefine [^\n]*@"?{re.escape(function.name)}"?\([^\n]*\)[^\n{{]*)\{{'
            text, count = re.subn(place, r"\1noinline {", text)
            assert count == 1, function.name
    # Mangled names are thousands of characters, and some have an address of this process. What
    # numba leaves for several modules to share is this one's.
    numbers: dict[str, str] = {}
    text = re.sub(_MANGLED, lambda m: f"@f{numbers.setdefault(m[1], str(len(numbers)))}", text)
    return llvm.parse_assembly(text.replace("= common ", "= internal "))


def _builder(machine: object, speed: int) -> Any:
    options = llvm.create_pipeline_tuning_options(speed)
    options.loop_vectorization = options.slp_vectorization = False
    return llvm.create_pass_builder(machine, options)
