"""LLVM's IR -> object code for WebAssembly: a script of a process of its own, which LLVM may end.

``python wasm_object.py SOURCE.ll ...`` writes SOURCE.o next to each.
"""

import sys
from pathlib import Path

import llvmlite.binding as llvm

TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+simd128,+bulk-memory,+nontrapping-fptoint,+sign-ext,+mutable-globals"


def main(*paths: str) -> None:
    """Write object code next to each file of IR."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(
        cpu="", features=FEATURES, opt=2, reloc="static"
    )
    options = llvm.create_pipeline_tuning_options(2)
    options.loop_vectorization = options.slp_vectorization = options.loop_unrolling = False
    for path in map(Path, paths):
        module = llvm.parse_assembly(path.read_text(encoding="utf-8"))
        module.triple, module.data_layout = TRIPLE, str(machine.target_data)
        module.verify()
        builder = llvm.create_pass_builder(machine, options)
        builder.getModulePassManager().run(module, builder)
        path.with_suffix(".o").write_bytes(machine.emit_object(module))


if __name__ == "__main__":
    main(*sys.argv[1:])
