"""The C99 of a controller: header and source, with what every number means."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from .._version import __version__
from ..native.codegen.c.body import CModule, float_text
from ..native.codegen.c.program import function_text

if TYPE_CHECKING:
    from .controller import ExportedController

_CHECKS = """\
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || FLT_EVAL_METHOD != 0
#error "doubles of IEEE 754 are needed, evaluated as doubles"
#endif
#ifdef __FAST_MATH__
#error "compile without -ffast-math, with -std=c99 or -ffp-contract=off"
#endif
"""


def header_text(controller: ExportedController) -> str:
    """Return the header: sizes, indices, the state, three functions."""
    name, big = controller.name, controller.name.upper()
    t = "double t, " if controller.takes_time else ""
    return f"""\
/* {_comment(name)}: {len(controller.inputs)} inputs, {len(controller.outputs)} outputs, every \
{float_text(controller.dt)} s from {float_text(controller.offset)} s on.
   nlctl {__version__}, program {controller.digest} */
#ifndef {big}_H
#define {big}_H

#define {big}_DIGEST "{controller.digest}"
#define {big}_DT {float_text(controller.dt)} /* s */
{_enumeration(f"{big}_INPUT", controller.inputs)}
{_enumeration(f"{big}_OUTPUT", controller.outputs)}
{_enumeration(f"{big}_PARAMETER", controller.parameters, begins=True)}
typedef struct {{
  double x[{max(len(controller.states), 1)}];  /* states, and outputs that are held */
  double c[{controller.lowered.size}];  /* what depends on parameters alone, and room */
}} {name}_state;

extern const double {name}_parameters[{max(len(controller.parameters), 1)}];

/* Begin: initial states, and parameters, such as {name}_parameters. */
void {name}_reset({name}_state *self, const double parameters[]);

/* One sample: outputs of inputs, and the states of the next sample.{_time_words(t)} */
void {name}_step({name}_state *self, {t}const double inputs[], double outputs[]);

#endif
"""


def _time_words(t: str) -> str:
    return "  t: time of the sample (s)." if t else ""


def source_text(controller: ExportedController) -> str:
    """Return the source: what the plan says, and the functions of the header around it."""
    module, functions = CModule(), controller.lowered.functions
    labels = {f"x[{i}]": _comment(label) for i, label in enumerate(controller.states)}
    labels |= {f"u[{i}]": _comment(label) for i, label in enumerate(controller.inputs)}
    labels |= {
        f"{array}[{i}]": _comment(label)
        for array in "pc"
        for i, label in enumerate(controller.parameters)
    }
    prepare, sample, out = (
        function_text(module, name, functions[plan], labels)
        for name, plan in (("prepare", "prepare"), ("sample", "sample0"), ("out", "out"))
    )
    name = controller.name
    values = ",\n".join(
        f"  {float_text(value)} /* {_comment(label)} */"
        for label, value in controller.parameters.items()
    )
    start = ", ".join(map(float_text, controller.initial_state)) or "0.0"
    t = "double t, " if controller.takes_time else ""
    given = "&t" if controller.takes_time else "&no_time"
    no_time = "" if controller.takes_time else "  const double no_time = 0.0;\n"
    return f"""\
/* {_comment(name)}, written by nlctl {__version__} from the graph of its equations; \
program {controller.digest}.
   The operations and their order are those of nlctl's own simulation of it; each rounds alike on
   every processor with doubles of IEEE 754.  No memory is allocated; of libraries: math.h.
   A step takes at most {_operations(module.text() + prepare, sample + out)}. */
#include "{name}.h"

{_CHECKS}
const double {name}_parameters[{max(len(controller.parameters), 1)}] = {{
{values or "  0.0"}
}};
static const double initial[{max(len(controller.initial_state), 1)}] = {{{start}}};

{module.text()}
/* what depends on parameters p alone */
{prepare}
/* a sample: next states s of states x and inputs u */
{sample}
{out}
void {name}_reset({name}_state *self, const double parameters[])
{{
  memset(self, 0, sizeof *self);
  memcpy(self->x, initial, {len(controller.states)} * sizeof(double));
  prepare(parameters, self->c);
}}

void {name}_step({name}_state *self, {t}const double inputs[], double outputs[])
{{
{no_time}  double s[{max(len(controller.sampled_states), 1)}];
  sample({given}, self->x, inputs, self->c, s);
{_taken(controller.sampled_states)}  out({given}, self->x, inputs, self->c, outputs);
}}
"""


def _taken(places: Sequence[int]) -> str:
    """Return the lines that make what a sample computed the states."""
    if list(places) == list(range(len(places))):
        return f"  memcpy(self->x, s, {len(places)} * sizeof(double));\n"
    return "".join(f"  self->x[{i}] = s[{k}];\n" for k, i in enumerate(places))


def _enumeration(prefix: str, labels: Iterable[str], begins: bool = False) -> str:
    """Return the indices of an array as names; of parameters that are arrays, where they begin."""
    places = dict(enumerate(labels))
    count = len(places)
    if begins:
        places = {
            i: re.sub(r"(\[0\])+$", "", label)
            for i, label in places.items()
            if not re.search(r"\[\d*[1-9]\d*\]", label)
        }
    names = [f"{prefix}_{re.sub(r'[^A-Za-z0-9]+', '_', v).strip('_')}" for v in places.values()]
    if len(set(names)) < len(names):  # such as a.b and a_b
        names = [f"{name}_{i}" for i, name in zip(places, names, strict=True)]
    lines = [f"  {name} = {i}," for i, name in zip(places, names, strict=True)]
    return "\n".join(["enum {", *lines, f"  {prefix}S = {count}", "};"])


def _comment(text: str) -> str:
    """Return a text that ends no comment and is ASCII."""
    return text.encode("ascii", "replace").decode().replace("*/", "* /").replace("/*", "/ *")


def _operations(before: str, step: str) -> str:
    """Return how many operations a step takes in words; branches take one of their ways."""
    known = {name: _counts(body, {}) for name, body in _functions(before)}
    found = Counter[str]()
    for _, body in _functions(step):
        found += _counts(body, known)
    order = [name for name in _WORDS if found[name]]
    order += sorted(set(found) - set(_WORDS))
    return ", ".join(f"{found[name]} {_WORDS.get(name, name)}" for name in order) or "no operations"


_WORDS = {"+": "additions", "-": "subtractions", "*": "products", "/": "divisions", "fma": "fma"}
_OPERATION = re.compile(r" ([-+*/]) |\b([a-z]\w*)\(")


def _functions(text: str) -> list[tuple[str, str]]:
    """Return names and statements of the functions of a text."""
    return re.findall(r"^static \w+ (\w+)\([^)]*\)\n\{\n(.*?)^\}", text, re.MULTILINE | re.DOTALL)


def _counts(body: str, known: Mapping[str, Counter[str]]) -> Counter[str]:
    """Return how often statements do what, those of loops as often as these turn."""
    found, times = Counter[str](), 1
    for line in body.splitlines():
        turns = re.search(r"for \(int k = 0; k < (\d+)", line)
        if turns or line.strip() == "}":
            times = int(turns[1]) if turns else 1
            continue
        statement = re.sub(r"\[[^]]*\]|/\*.*?\*/", "", line).replace("+=", "= x +")
        for sign, name in _OPERATION.findall(statement.partition("=")[2]):
            if name in known:
                found += Counter({key: times * n for key, n in known[name].items()})
            elif name not in ("nlctl_bits", "nlctl_real", "sizeof"):
                found[sign or name] += times
    return found
