"""FMUs: FMPy runs them, and they move as the diagram that they were."""

import ctypes
import subprocess
import sys
import zipfile

import control as ct
import numpy as np
import pytest
from exported import halved
from extras import needed
from fmi_models import MODELS, linear, simulated

import nlctl
from nlctl.errors import CompileError, ParameterError, UnknownNameError, UsageError
from nlctl.export import fmu
from nlctl.export.fmi.archive import read_model
from nlctl.export.fmi.source import sources, token_of

pytestmark = pytest.mark.export

KINDS = ("ModelExchange", "CoSimulation")


@pytest.fixture(scope="module", autouse=True)
def _needed():
    needed("fmpy", "export")
    needed("ziglang", "export")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A function that writes a model once: its file, its diagram, its start and its end."""
    folder = tmp_path_factory.mktemp("models")

    def write(name, version=3):
        diagram, start, end = MODELS[name]()
        path = folder / f"{name}_{version}.fmu"
        if not path.exists():
            fmu(
                diagram, path, version=version, name="model", platforms=["linux"], stop_time=end,
                initial_state=start,
            )  # fmt: skip
        return path, diagram, start, end

    return write


def ours(diagram, start, end, points=200):
    grid = np.linspace(0.0, end, points + 1)
    return nlctl.input_output_response(
        diagram, grid, 0, start or None, rtol=1e-12, atol=1e-13, squeeze=False
    )


def errors(path, kind, run, end, **more):
    """Return the largest difference of each output, in parts of its largest value above 1."""
    theirs, names = simulated(path, kind, end, **more)
    expected = np.asarray(run.outputs).reshape(len(names), -1)
    return [
        np.abs(theirs[name] - y).max() / max(1.0, np.abs(y).max())
        for name, y in zip(names, expected, strict=True)
    ]


@pytest.mark.parted
@pytest.mark.parametrize("name", ["bouncing ball", "sampled PID", "backlash", "kicked", "relay"])
def test_fmpy_moves_it_as_nlctl_does(written, name):
    path, diagram, start, end = written(name)
    run = ours(diagram, start, end)
    for kind in KINDS:
        assert max(errors(path, kind, run, end)) < 1e-8, kind


@pytest.mark.parted
@pytest.mark.ci
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", MODELS)
def test_both_versions_have_no_findings_and_move_alike(written, name, version):
    validation = needed("fmpy.validation", "export")
    path, diagram, start, end = written(name, version)
    assert validation.validate_fmu(str(path)) == []
    run = ours(diagram, start, end)
    for kind in KINDS:
        found = errors(path, kind, run, end)
        if name == "example 2":  # u of our own runs at 1e-10 and at 1e-12 differs by 3e-8
            assert found.pop(4) < 1e-7
        assert max(found) < 1e-8, kind


def test_co_simulation_steps_over_no_pulse_of_a_state(tmp_path):
    """x0 = t: areas of a Gaussian, of cosh^-2 = tanh', of 1 / (1 + s^2), each 1e-3 wide, to 3 s."""

    def pulses(t, x, u, p):
        s = (x[0] - np.array([0.7, 1.4, 2.1])) / 1e-3
        return [
            1.0, np.exp(-(s[0] ** 2)), 1 - np.tanh(s[1]) ** 2, 1 / (1 + s[2] ** 2),
            1.0 if np.exp(-(((x[0] - 2.5) / 1e-3) ** 2)) > 0.5 else 0.0,
        ]  # fmt: skip

    block = ct.nlsys(
        pulses, lambda t, x, u, p: x[1:], inputs=0, states=5, outputs=["a", "b", "c", "d"],
        name="pulses",
    )  # fmt: skip
    fmu(block, tmp_path / "m.fmu", name="model", platforms=["linux"], stop_time=3.0)
    run, _ = simulated(tmp_path / "m.fmu", "CoSimulation", 3.0, points=2, tolerance=1e-9)
    areas = [
        np.sqrt(np.pi), 2.0, np.arctan(900.0) + np.arctan(2100.0), 2 * np.sqrt(np.log(2)),
    ]  # fmt: skip
    theirs = [run[name][-1] for name in "abcd"]
    np.testing.assert_allclose(theirs, 1e-3 * np.array(areas), rtol=1e-5)


def test_bounces_are_located_to_a_nanosecond(written):
    """From a height of 1: at sqrt(2 / g) and then 2 * 0.8^k sqrt(2 / g) apart."""
    path, *_ = written("bouncing ball")
    run, _ = simulated(path, "ModelExchange", 2.4, record_events=True)
    jumps = run["time"][1:][np.diff(run["time"]) == 0.0]
    first = np.sqrt(2.0 / 9.81)
    exact = first * (1.0 + 2.0 * np.cumsum([0.0, 0.8, 0.8**2, 0.8**3]))
    np.testing.assert_allclose(np.unique(jumps)[:4], exact, rtol=0, atol=1e-9)


@pytest.mark.ci
@pytest.mark.parametrize("name", ["kicked", "relay", "bouncing ball"])
def test_events_are_where_ours_are(written, name):
    """To a nanosecond: each of ours is where FMPy has recorded one."""
    path, diagram, start, end = written(name)
    end = 2.0 if name == "bouncing ball" else end
    run, _ = simulated(path, "ModelExchange", end, record_events=True, tolerance=1e-12)
    theirs = np.unique(run["time"][1:][np.diff(run["time"]) == 0.0])
    times = ours(diagram, start, end).events["time"].unique()
    times = times[times > 0.0]  # where it starts, friction leaves its 0
    assert len(times) >= 3
    assert max(np.abs(theirs - t).min() for t in times) < 1e-9


def test_parameters_have_units_bounds_and_meanings(written):
    fmpy = needed("fmpy", "export")
    path, *_ = written("backlash")
    found = {v.name: v for v in fmpy.read_model_description(str(path)).modelVariables}
    slope = found["gap.m_r"]
    assert (slope.unit, slope.causality, float(slope.start), float(slope.min)) == (
        "1", "parameter", 1.2, 0.0,
    )  # fmt: skip
    assert slope.description == "slope of the right (rising) side"
    assert found["gap.memory"].variability == "discrete"


def test_a_parameter_set_by_an_importer_is_that_of_our_run(written):
    path, diagram, start, end = written("backlash")
    run = nlctl.input_output_response(
        diagram, np.linspace(0, end, 201), 0, start or None, params={"gap.c_r": 0.2}, rtol=1e-12,
        atol=1e-13,
    )  # fmt: skip
    for kind in KINDS:
        assert max(errors(path, kind, run, end, start_values={"gap.c_r": 0.2})) < 1e-8


def test_a_parameter_out_of_its_bounds_is_refused_by_name(written, capfd):
    path, *_, end = written("backlash")
    with pytest.raises(Exception, match="Set"):
        simulated(path, "CoSimulation", end, start_values={"gap.m_r": -1.0})
    assert "parameter 'gap.m_r' cannot be -1" in "".join(capfd.readouterr())


def test_inputs_move_it(tmp_path):
    """A step of the input: the step response of python-control."""
    diagram, _, end = linear()
    path = fmu(diagram, tmp_path / "linear.fmu", platforms=["linux"])
    exact = ct.step_response(diagram, np.linspace(0, end, 201)).outputs
    for kind in KINDS:
        run, _ = simulated(path, kind, end, start_values={"u": 1.0})
        np.testing.assert_allclose(run["y"], exact, rtol=0, atol=1e-8)


def test_a_sampled_block_alone_has_no_rates(tmp_path):
    """x[k+1] = x[k] / 2 + u with u = 2: 4 (1 - 2^-k), held from sample to sample."""
    law = ct.ss([[0.5]], [[1.0]], [[1.0]], 0, 0.1, name="law", inputs="u", outputs="y")
    loop = nlctl.interconnect({"law": nlctl.sampled(law)}, inputs="u", outputs="y")
    path = fmu(loop, tmp_path / "law.fmu", name="law", platforms=["linux"])
    for kind in KINDS:
        run, _ = simulated(path, kind, 1.0, points=10, start_values={"u": 2.0})
        np.testing.assert_array_equal(run["y"], 4.0 * (1.0 - 0.5 ** np.arange(11)))


def test_the_same_diagram_is_the_same_file(tmp_path):
    one, other = (
        fmu(linear()[0], tmp_path / name, platforms=["linux"]) for name in ("a.fmu", "b.fmu")
    )
    assert one.read_bytes() == other.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.fmu", "b.fmu"]


MAGIC = {
    "binaries/x86_64-linux/m.so": b"\x7fELF", "binaries/x86_64-windows/m.dll": b"MZ",
    "binaries/x86_64-darwin/m.dylib": b"\xcf\xfa\xed\xfe",
    "binaries/aarch64-darwin/m.dylib": b"\xcf\xfa\xed\xfe",
    "binaries/linux64/m.so": b"\x7fELF", "binaries/win64/m.dll": b"MZ",
    "binaries/darwin64/m.dylib": b"\xca\xfe\xba\xbe",
}  # fmt: skip


@pytest.mark.weekly
@pytest.mark.parametrize("version", [2, 3])
def test_all_platforms_have_all_functions(tmp_path, version):
    """In 300 kB; by the names in the libraries of those that do not run here."""
    path = fmu(
        nlctl.paper.example_1(), tmp_path / "m.fmu", name="m", version=version, stop_time=20.0
    )
    assert path.stat().st_size < 300_000
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    library = {name: code for name, code in content.items() if name.startswith("binaries/")}
    assert set(library) == {
        name for name in MAGIC if ("_64-" in name or "aarch64" in name) == (version == 3)
    }
    source = content[f"sources/fmi{version}Functions.h"].decode()
    declared = {line.split()[1] for line in source.splitlines()
                if line.startswith(f"#define fmi{version}") and "FullName(" in line
                and not line.split()[1].startswith(f"fmi{version}FullName")}  # fmt: skip
    assert len(declared) > 30
    for name, code in library.items():
        assert code.startswith(MAGIC[name])
        assert not [f for f in declared if f.encode() + b"\0" not in code], name
    again = fmu(
        nlctl.paper.example_1(), tmp_path / "n.fmu", name="m", version=version, stop_time=20.0
    )
    assert again.read_bytes() == path.read_bytes()


# -- what is refused -------------------------------------------------------------------------------


def closed(block, **more):
    plant = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="plant")
    return nlctl.interconnect({"plant": plant, "law": block}, outputs="y", **more)


REFUSED = {
    "a transport delay": (
        lambda: closed(
            nlctl.block(nlctl.TransportDelay(delay=0.1), "law", inputs="y", outputs="u")
        ),
        "transport delays",
    ),
    "an opaque function": (
        lambda: closed(ct.nlsys(None, halved, inputs="y", outputs="u", name="law")),
        "a function of it is called",
    ),
    "an ideal relay": (
        lambda: closed(
            nlctl.block(nlctl.IdealRelay(), "law", inputs={"u": "y"}, outputs={"v": "u"})
        ),
        "block 'law' is an ideal relay",
    ),
    "jitter": (
        lambda: closed(nlctl.sampled(ct.ss([], [], [], -1.0, 0.1, inputs="y", outputs="u",
                                           name="law"), jitter=0.01)),
        "jitter of 0.01 s",
    ),
    "discrete time": (lambda: ct.ss(0.5, 1, 1, 0, 0.1, name="law"), "in discrete time"),
}  # fmt: skip


@pytest.mark.parametrize(
    "what", [pytest.param(k, marks=[pytest.mark.ci] * ("opaque" in k)) for k in REFUSED]
)
def test_what_an_fmu_cannot_say_is_refused_before_a_file_is_written(tmp_path, what):
    make, words = REFUSED[what]
    with pytest.raises(CompileError, match=words):
        fmu(make(), tmp_path / "model.fmu", name="model")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"version": 1}, "version 2 or 3, got 1"),
        ({"path": "nowhere/model.fmu"}, "in a folder that exists"),
        ({"name": "my-loop"}, "is not a name in C"),
        ({"stop_time": 0.0}, "stop_time > 0"),
        ({"platforms": ["amiga"]}, "unknown platform 'amiga'"),
        ({"initial_state": {"linear.x[7]": 1.0}}, "unknown state"),
    ],
)
def test_bad_arguments_are_refused_before_a_file_is_written(tmp_path, keywords, words):
    with pytest.raises((ParameterError, UnknownNameError)) as error:
        fmu(linear()[0], **{"path": tmp_path / "model.fmu", **keywords})
    assert words in str(error.value)
    assert not list(tmp_path.iterdir())


def test_a_run_past_what_is_known_of_the_time_is_an_error(written, capfd):
    path, *_, end = written("kicked")
    with pytest.raises(Exception, match=r"status 3|error"):
        simulated(path, "CoSimulation", 2.0 * end)
    assert "known from 0 until stop_time alone" in "".join(capfd.readouterr())


def test_jumps_without_end_are_an_error(written, capfd):
    path, *_ = written("bouncing ball")
    with pytest.raises(Exception, match=r"status 3|error"):
        simulated(path, "CoSimulation", 6.0)
    assert "Zeno" in "".join(capfd.readouterr())


@pytest.mark.parametrize("module", ["fmpy", "ziglang"])
def test_without_the_extra_it_is_said_what_to_install(tmp_path, monkeypatch, module):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(UsageError, match=r"nlctl\[export\]"):
        fmu(linear()[0], tmp_path / "model.fmu")
    assert not list(tmp_path.iterdir())


def test_another_binary_has_another_token():
    """Importers know by it that they have a binary already: with other equations or numbers."""
    tokens = set()
    for gain, stop_time, tolerance in ((1, 10, 1e-6), (2, 10, 1e-6), (1, 20, 1e-6), (1, 10, 1e-3)):
        lag = ct.ss(-1, gain, 1, 0, name="lag")
        model = read_model(lag, None, None, "lag", stop_time, tolerance)
        assert token_of(sources(model, 3)) == token_of(sources(model, 3))
        tokens.add(token_of(sources(model, 3)))
    assert len(tokens) == 4


def test_a_state_is_kept_and_taken_up_again(written):
    """Steps from a state that was serialized lead where they led before, bit by bit."""
    fmpy = needed("fmpy", "export")
    path, *_ = written("sampled PID")
    found = fmpy.read_model_description(str(path))
    model = fmpy.fmi3.FMU3Slave(
        guid=found.guid, modelIdentifier="model", unzipDirectory=fmpy.extract(str(path)),
        instanceName="one",
    )  # fmt: skip
    model.instantiate()
    model.enterInitializationMode(startTime=0.0)
    model.exitInitializationMode()
    reference = next(v.valueReference for v in found.modelVariables if v.name == "y")

    def steps(begin):
        return [
            model.doStep(currentCommunicationPoint=begin + k * 0.03, communicationStepSize=0.03)
            and model.getFloat64([reference])[0]
            for k in range(20)
        ]

    steps(0.0)
    kept = model.getFMUState()
    content = model.serializeFMUState(kept)
    once = steps(0.6)
    model.setFMUState(model.deserializeFMUState(content))
    assert steps(0.6) == once
    assert len(set(once)) == 20


@pytest.mark.weekly  # it compiles a model once more
def test_wide_registers_compute_the_same_bits(written, tmp_path):
    """A processor without FMA has the numbers of one that has it."""
    zipfile.ZipFile(written("example 1")[0]).extractall(tmp_path)
    folder = tmp_path / "sources"
    code = [str(folder / name) for name in ("model.c", "wide.c", "tables.c")]
    command = [sys.executable, "-m", "ziglang", "cc", "-shared", "-fPIC", "-O2", "-std=c99"]
    zig = [*command, "-target", "x86_64-linux-gnu.2.17", *code, "-lm", "-o", tmp_path / "both.so"]
    subprocess.run(zig, check=True, timeout=120)
    library = ctypes.CDLL(str(tmp_path / "both.so"))
    rng, numbers = np.random.default_rng(1), []
    p = (ctypes.c_double * 88).in_dll(library, "model_parameters")
    states = rng.normal(size=(200, 31))
    for name in ("plain", "wide"):
        c, dx, rest, computed = (np.zeros(n) for n in (1000, 32, 100, (200, 31)))
        pointers = [ctypes.c_void_p(v.ctypes.data) for v in (rest, c, dx, rest, rest)]
        getattr(library, f"model_prepare_{name}")(p, pointers[1])
        for k, x in enumerate(states):
            at = ctypes.c_double(0.1 * k), ctypes.c_void_p(x.ctypes.data)
            getattr(library, f"model_rates_{name}")(*at, *pointers)
            computed[k] = dx[:31]
        numbers.append(computed)
    assert np.isfinite(numbers[0]).mean() > 0.9
    np.testing.assert_array_equal(*numbers)


def test_what_the_compiler_refuses_leaves_no_file(tmp_path, monkeypatch):
    """A compiler that fails: its words are reported, and there is no half-written file."""
    from nlctl.export.fmi import archive as binaries

    monkeypatch.setattr(binaries, "_COMMAND", ("-no-such-option",))
    with pytest.raises(CompileError, match="ziglang did not compile"):
        fmu(linear()[0], tmp_path / "model.fmu", platforms=["linux"])
    assert not list(tmp_path.iterdir())
