"""Object code of a controller for other machines: LLVM makes it of the IR that was simulated."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import llvmlite.binding as llvm

from ..annotations import as_annotated
from ..attributes import described_record
from ..errors import CompileError
from ..names import unknown
from ..native.codegen.ir.program import COPY, program_text
from ..native.codegen.ir.text import float_text
from ..native.machine.finish import program_code
from .source import ExportedController


@described_record
class Target:
    """A machine that object code is made for.

    Examples
    --------
    >>> TARGETS["thumbv7em-none-eabihf"].cpu
    'cortex-m7'
    """

    cpu: str  # As LLVM calls it.
    meaning: str  # What has it.
    features: str = ""  # As LLVM calls them.
    abi: str = ""


TARGETS: Mapping[str, Target] = MappingProxyType({
    "thumbv7em-none-eabihf": Target(cpu="cortex-m7", meaning="Cortex-M7 with doubles"),
    "armv7a-none-eabihf": Target(cpu="cortex-a7", meaning="Cortex-A, 32 bits"),
    "aarch64-none-elf": Target(cpu="", meaning="ARM, 64 bits"),
    "riscv32-none-elf": Target(
        cpu="", features="+m,+a,+f,+d", abi="ilp32d", meaning="RISC-V, 32 bits, with doubles"
    ),
    "riscv64-none-elf": Target(
        cpu="", features="+m,+a,+f,+d", abi="lp64d", meaning="RISC-V, 64 bits, with doubles"
    ),
    "x86_64-none-elf": Target(cpu="x86-64", meaning="x86 with SSE2"),
})  # fmt: skip
"""Machines by LLVM's name of them."""


@as_annotated
def object_code(controller: ExportedController, target: str) -> bytes:
    """Return object code with the functions of the header, an ELF file to be linked.

    Parameters
    ----------
    controller : ExportedController
        As `export_controller` returns it.
    target : str
        One of `TARGETS`.

    Returns
    -------
    bytes
        Content of an object file. Of libraries it calls ``memcpy``, ``memset``, and of math.h what
        the processor has no instruction for.

    Raises
    ------
    UnknownNameError
        If the target is unknown.
    CompileError
        If this version of LLVM writes other attributes than known.

    Examples
    --------
    >>> loop = nlctl.paper.example_1()
    >>> law = nlctl.export.export_controller(loop, "controller", dt=0.01, method="euler")
    >>> object_code(law, "thumbv7em-none-eabihf")[:4]
    b'\\x7fELF'
    """
    if target not in TARGETS:
        raise unknown("target", target, TARGETS, "of object code")
    code = program_code(module_text(controller), _machine(target))
    return _with_float_abi(code, target)


def _machine(target: str) -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    triple, which = llvm.Target.from_triple(target), TARGETS[target]
    return triple.create_target_machine(
        cpu=which.cpu, features=which.features, opt=2, abiname=which.abi
    )


def _with_float_abi(code: bytes, target: str) -> bytes:
    """Say in ARM's attributes that doubles are passed in registers, which linkers compare.

    LLVM does so and writes it for its own option alone, which llvmlite has not: the place of the
    version of the attributes' standard is taken for it, filled with what is there already.
    """
    if not target.endswith("eabihf"):
        return code
    version, instead = b"\x43" + b"2.09\0", b"\x1c\x01" + b"\x0e\x00" * 2
    if code.count(version) != 1:
        raise CompileError(f"the attributes of object code for {target} are not those known")
    return code.replace(version, instead)


def module_text(controller: ExportedController) -> str:
    """Return the IR: the functions of the plan, and those of the header around them."""
    plan = controller.lowered
    functions = {name: plan.functions[name] for name in ("prepare", "sample0", "out")}
    text = program_text(functions, 1, plan.exact, portable=functions)
    text = text.replace("preserve_allcc ", "")  # x86 alone has it
    text = re.sub(r"^define void @(prepare|sample0|out)\(", r"define internal void @\1(", text,
                  flags=re.MULTILINE)  # fmt: skip
    if COPY not in text:
        text = f"{COPY}\n{text}"
    return text + _around(controller)


def _around(controller: ExportedController) -> str:
    """Return the IR of reset and step, as the C source has them."""
    name, places = controller.name, controller.sampled_states
    states, rows = max(len(controller.states), 1), controller.lowered.size
    t, time = ("double %t, ", "%t") if controller.takes_time else ("", "0.0")
    start, count = [float_text(float(v)) for v in controller.initial_state], len(controller.states)
    values = [float_text(v) for v in controller.parameters.values()]
    taken = "".join(
        f"  %s{k} = getelementptr double, ptr %s, i64 {k}\n"
        f"  %v{k} = load double, ptr %s{k}, align 8\n"
        f"  %x{k} = getelementptr double, ptr %self, i64 {i}\n"
        f"  store double %v{k}, ptr %x{k}, align 8\n"
        for k, i in enumerate(places)
    )
    return f"""
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
@{name}_parameters = constant {_array(values)}, align 8
@initial = private constant {_array(start)}, align 8

define void @{name}_reset(ptr %self, ptr %parameters) nounwind {{
  call void @llvm.memset.p0.i64(ptr %self, i8 0, i64 {8 * (states + rows)}, i1 0)
  call void @llvm.memcpy.p0.p0.i64(ptr %self, ptr @initial, i64 {8 * count}, i1 0)
  %c = getelementptr double, ptr %self, i64 {states}
  call void @prepare(ptr %parameters, ptr %c)
  ret void
}}

define void @{name}_step(ptr %self, {t}ptr %inputs, ptr %outputs) nounwind {{
  %s = alloca [{max(len(places), 1)} x double], align 8
  %now = alloca double, align 8
  store double {time}, ptr %now, align 8
  %c = getelementptr double, ptr %self, i64 {states}
  call void @sample0(ptr %now, ptr %self, ptr %inputs, ptr %c, ptr %s)
{taken}  call void @out(ptr %now, ptr %self, ptr %inputs, ptr %c, ptr %outputs)
  ret void
}}
"""


def _array(values: list[str]) -> str:
    """Return an array of numbers; one zero where there are none."""
    inside = ", ".join(f"double {value}" for value in values or [float_text(0.0)])
    return f"[{max(len(values), 1)} x double] [{inside}]"
