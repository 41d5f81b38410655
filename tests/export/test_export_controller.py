"""Exported controllers compute what the simulation of their loop computed, bit by bit."""

import ctypes

import control as ct
import numpy as np
import pytest
from exported import halved, recorded, run_here, run_on_chip, written

import nlctl
from nlctl.errors import CompileError, ParameterError
from nlctl.export import TARGETS, c_files, export_controller, object_code
from nlctl.export.objects import module_text
from nlctl.expressions.functions import FUNCTIONS
from nlctl.native.codegen.ir.functions import CALLED, INLINE
from nlctl.native.machine.finish import finished

DT = 2e-4


def with_sampled(loop, name, method="euler"):
    """Return the blocks of a loop, one of them sampled."""
    parts = {part.name: part for part in loop.syslist}
    return [
        *(p for k, p in parts.items() if k != name),
        nlctl.sampled(parts[name], DT, method=method),
    ]


def of_example(example, controller=None):
    return lambda: (with_sampled(example(*filter(None, [controller])), "controller"), "controller")


def extremum_seeking():
    """Its equations read the time."""
    plant = ct.nlsys(
        lambda t, x, u, p: [-x[0] + 1.0 - (u[0] - 2.0) ** 2], lambda t, x, u, p: x[:1],
        inputs="u", outputs="y", states=1, name="plant",
    )  # fmt: skip
    law = nlctl.block(nlctl.controllers.ExtremumSeeking(), "law")
    return law, plant


def filter_of_transfer_function():
    """python-control's own, in discrete time."""
    law = ct.ss(ct.sample_system(ct.tf([8.0, 4.0], [1.0, 3.0, 9.0]), DT, "tustin"))
    law = ct.ss(law.A, law.B, -law.C, -law.D, DT, inputs="y", outputs="u", name="law")
    plant = ct.ss(
        [[0, 1], [-1, -0.2]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y", name="plant"
    )
    return [plant, nlctl.sampled(law)], "law"


CONTROLLERS = {
    "adaptive neural, example 1": of_example(nlctl.paper.example_1),
    "adaptive neural, example 2": of_example(nlctl.paper.example_2),
    "PID": lambda: (
        with_sampled(nlctl.paper.example_1(controller=nlctl.block(nlctl.PID(), "controller")),
                     "controller"), "controller",
    ),
    "sliding mode": lambda: (
        with_sampled(nlctl.paper.example_1(controller=nlctl.sliding_mode()), "controller"),
        "controller",
    ),
    "transfer function": filter_of_transfer_function,
}  # fmt: skip


@pytest.fixture(scope="module", params=CONTROLLERS)
def case(request, tmp_path_factory):
    """A controller, its files, and 100,000 samples of it in the simulation of its loop."""
    parts, name = CONTROLLERS[request.param]()
    start = {"plant.x[0]": 1.0} if request.param == "transfer function" else {}
    loop, times, inputs, outputs = recorded(parts, name, DT, 100_000, start)
    controller = export_controller(loop, name)
    folder = tmp_path_factory.mktemp("export")
    return controller, folder, written(folder, controller), inputs, outputs, times


@pytest.mark.parted
@pytest.mark.ci
@pytest.mark.parametrize("optimised", ["-O0", "-O3"])
def test_c_is_the_simulation_bit_by_bit(case, optimised):
    controller, folder, defined, inputs, outputs, times = case
    found = run_here(folder, defined, f"{controller.name}.c", inputs, times, optimised)
    np.testing.assert_array_equal(found, outputs)
    assert np.ptp(outputs, axis=0).max() > 0.01


@pytest.mark.ci
def test_object_code_is_the_simulation_bit_by_bit(case):
    controller, folder, defined, inputs, outputs, times = case
    (folder / "code.o").write_bytes(object_code(controller, "x86_64-none-elf"))
    np.testing.assert_array_equal(run_here(folder, defined, "code.o", inputs, times), outputs)


@pytest.mark.parted
@pytest.mark.ci
@pytest.mark.parametrize("kind", ["c", "object code"])
def test_a_microcontroller_computes_the_simulation_bit_by_bit(case, kind):
    """Cortex-M7, emulated; the code takes at most 40 kB."""
    controller, folder, defined, inputs, outputs, times = case
    code = f"{controller.name}.c"
    if kind == "object code":
        code = "chip.o"
        (folder / code).write_bytes(object_code(controller, "thumbv7em-none-eabihf"))
        assert (folder / code).stat().st_size < 40_000
    np.testing.assert_array_equal(run_on_chip(folder, defined, code, inputs, times), outputs)


@pytest.mark.parametrize("target", TARGETS)
def test_every_target_can_be_had(target):
    controller = export_controller(nlctl.paper.example_1(), "controller", dt=0.01, method="euler")
    code = object_code(controller, target)
    assert code[:4] == b"\x7fELF"
    assert code[4] == (2 if "64" in target else 1)


# -- functions -------------------------------------------------------------------------------------


WRITTEN = [*CALLED, *INLINE, *(n for n in FUNCTIONS if FUNCTIONS[n].code.startswith("llvm."))]


def every_function(t, x, u, params):
    """Return every function that nlctl writes out, or that rounds alike everywhere."""
    a, b = u
    return np.array([
        np.exp(a), np.exp2(a), np.tanh(a), np.sin(a), np.cos(a), np.minimum(a, b), np.maximum(a, b),
        np.logaddexp(a, b), np.sign(a), np.heaviside(a, b), np.remainder(a, b),
        np.floor_divide(a, b), np.sqrt(a),
        np.absolute(a), np.floor(a), np.copysign(a, b), np.ceil(a), np.trunc(a), np.rint(a),
    ])  # fmt: skip


@pytest.mark.ci
def test_functions_are_those_of_machine_code_for_all_numbers(tmp_path):
    """exp, sin, ... in C and in machine code: equal to the last bit, NaN and infinities too."""
    law = ct.nlsys(None, every_function, inputs=2, outputs=len(WRITTEN), dt=0.1, name="law")
    loop = ct.interconnect([nlctl.sampled(law)], inplist=["law"], inputs=2, outlist=["law"],
                           outputs=len(WRITTEN))  # fmt: skip
    controller = export_controller(loop, "law")
    rng = np.random.default_rng(1)
    special = [0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, -1e-310, 709.9, -745.2, 1.0, -1.0, 0.5]
    pairs = np.array([(a, b) for a in special for b in special])
    drawn = rng.normal(size=(20_000, 2)) * 10.0 ** rng.uniform(-8, 5, (20_000, 2))
    inputs = np.vstack([pairs, drawn, rng.normal(size=(20_000, 2))])
    found = run_here(
        tmp_path, written(tmp_path, controller), "law.c", inputs, np.zeros(len(inputs))
    )
    expected = stepped(controller, inputs)
    same = (found == expected) | (np.isnan(found) & np.isnan(expected))
    assert not [name for name, ok in zip(WRITTEN, same.all(axis=0), strict=True) if not ok]
    with np.errstate(all="ignore"):
        exact = np.array([every_function(0, 0, u, {}) for u in inputs[-2000:]])
    np.testing.assert_allclose(expected[-2000:], exact, rtol=1e-14, atol=1e-300)


def stepped(controller, inputs):
    """Return the outputs of its machine code in this process."""
    names = [f"{controller.name}_{what}" for what in ("reset", "step")]
    code = finished(module_text(controller), names)
    pointer = ctypes.c_void_p
    reset, step = (
        ctypes.CFUNCTYPE(None, *[pointer] * count)(code.addresses[name])
        for name, count in zip(names, (2, 3), strict=True)
    )
    state = np.zeros(len(controller.states) + controller.lowered.size + 1)
    parameters = np.array([*controller.parameters.values()])
    outputs = np.zeros((len(inputs), len(controller.outputs)))
    reset(state.ctypes.data, parameters.ctypes.data)
    for u, y in zip(inputs, outputs, strict=True):
        step(state.ctypes.data, u.ctypes.data, y.ctypes.data)
    return outputs


# -- what is refused -------------------------------------------------------------------------------


def a_loop(law):
    plant = ct.ss(-1, [[1, 1]], 1, 0, inputs=["u", "w"], outputs="y", name="plant")
    return nlctl.interconnect([plant, law], inputs="w", outputs="y")


def a_gain(**keywords):
    return nlctl.sampled(
        ct.ss([], [], [], -2.0, 0.1, inputs="y", outputs="u", name="law"), **keywords
    )


REFUSED = {
    "an unknown block": (a_gain, {"block": "lav"}, "unknown block 'lav' of the loop"),
    "a delay": (lambda: a_gain(delay=0.02), {}, "delay of 0.02 s"),
    "jitter": (lambda: a_gain(jitter=0.02), {}, "jitter of 0.02 s"),
    "sampled already": (a_gain, {"dt": 0.1}, "sampled already"),
    "a word of C": (a_gain, {"name": "double"}, "'double' is not a name in C"),
    "no name in C": (a_gain, {"name": "my-law"}, "is not a name in C"),
    "another block's parameter": (a_gain, {"params": {"plant.a": 1.0}}, "unknown parameter"),
    "an opaque function": (
        lambda: nlctl.sampled(
            ct.nlsys(None, halved, inputs="y", outputs="u", dt=0.1, name="law")
        ),
        {}, "a function of it is called",
    ),
    "continuous time": (
        lambda: ct.ss(-1, 1, -1, 0, inputs="y", outputs="u", name="law"), {}, "give dt in s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_target_cannot_hold_is_refused_by_name(name):
    law, keywords, words = REFUSED[name]
    with pytest.raises((ParameterError, CompileError, nlctl.errors.UnknownNameError)) as error:
        export_controller(a_loop(law()), **{"block": "law", **keywords})
    assert words in str(error.value)


def test_two_clocks_are_refused():
    slow = nlctl.sampled(ct.ss([], [], [], 1.0, 0.2, inputs="y", outputs="v", name="slow"))
    fast = nlctl.sampled(ct.ss([], [], [], -1.0, 0.1, inputs="v", outputs="u", name="fast"))
    both = ct.interconnect([slow, fast], inputs="y", outputs="u", name="law")
    with pytest.raises(CompileError, match="2 clocks"):
        export_controller(a_loop(both), "law")


def test_nan_travels_into_the_outputs_and_stays_in_the_states(tmp_path):
    integral = ct.ss(1, 0.1, -1, 0, 0.1, inputs="y", outputs="u", name="law")
    controller = export_controller(a_loop(nlctl.sampled(integral)), "law")
    inputs = np.array([[1.0], [np.nan], [1.0], [1.0]])
    found = run_here(tmp_path, written(tmp_path, controller), "law.c", inputs, np.zeros(4))
    np.testing.assert_array_equal(found[:, 0], [0.0, -0.1, np.nan, np.nan])


def test_parameters_of_the_loop_are_those_of_the_code():
    """Given ones, in the file; the digest is another."""
    loop = nlctl.paper.example_1()
    one = export_controller(loop, "controller", dt=0.01, method="euler")
    other = export_controller(
        loop, "controller", dt=0.01, method="euler", params={"controller.law.beta": 3.5},
        initial_state={"controller.law.zeta": 0.25},
    )  # fmt: skip
    assert one.parameters["controller.law.beta"] != 3.5 == other.parameters["controller.law.beta"]
    assert "3.5 /* controller.law.beta */" in c_files(other)["controller.c"]
    assert 0.25 in other.initial_state
    assert one.digest != other.digest
    again = export_controller(loop, "controller", dt=0.01, method="euler")
    assert c_files(again) == c_files(one)
