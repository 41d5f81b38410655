"""Small mistakes of a newcomer: one sentence each, with the culprit and the next step."""

import re

import numpy as np
import pytest
from command_line import nlctl_here

import nlctl
from nlctl.analysis.loop_checks import checks_of

LOOPS = """
import control as ct
import nlctl


def make():
    lag = ct.ss(-1, 1, 2, 0, inputs="v", outputs="y", name="lag")
    zone = nlctl.block(nlctl.DeadZone(), "zone")
    return nlctl.interconnect([zone, lag], inputs=["u"], outputs=["y"])


def needs(gain):
    return make()


def rational():
    return ct.tf([1], [1, 1], inputs="r", outputs="y", name="rational")


def discrete():
    return ct.ss(0.5, 1, 1, 0, 0.1, inputs="r", outputs="y", name="discrete")


def short():
    return ct.nlsys(lambda t, x, u: [-x[0]], None, inputs=1, outputs=1, states=1, name="short")


def forgets():
    return ct.nlsys(
        lambda t, x, u, params: None, None, inputs=1, outputs=1, states=1, name="forgets"
    )


def misspelt():
    return nlctl.DedZone()
"""
FILES = {
    "loops.py": LOOPS.encode(), "größe und mehr.py": LOOPS.replace("\n", "\r\n").encode(),
    "empty.py": b"", "text.py": b"{\\rtf1 hello}", "wide.py": "x = 1".encode("utf-16"),
}  # fmt: skip
REFUSED = [
    ("loops.py:needs", r"'?loops.py:needs'? needs a function without arguments, got needs\(gain\)"),
    ("loops.py:maek", r"unknown function 'maek' in 'loops.py'; nearest: 'make'"),
    ("loops.py", r"'loops.py' lacks the function that returns the loop: loops.py:make"),
    ("loops:make", r"there is no module 'loops'.*; there is a file: loops.py:NAME"),
    ("empty.py:make", r"unknown function 'make' in 'empty.py'"),
    ("text.py:make", r"text.py' is not Python: line 1: "),
    ("wide.py:make", r"wide.py' is not Python: "),
    ("loops.py:short", r"'short' needs update\(t, x, u, params\), got update\(t, x, u\)"),
    ("loops.py:forgets", r"'forgets' returns 'None' from its update function, needs numbers"),
    ("loops.py:discrete --step 0.02", r"'discrete' is sampled every 0.1 s: leave --step out"),
]


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "mein Ordner"
    made.mkdir()
    for name, content in FILES.items():
        (made / name).write_bytes(content)
    return made


def test_each_is_one_sentence(folder):
    for words, told in REFUSED:
        result = nlctl_here("simulate", *words.split(" "), "--until", "1", cwd=folder)
        (line,) = [one for one in result.stderr.splitlines() if one.startswith("nlctl: ")]
        assert "Traceback" not in result.stderr
        assert re.search(told, line), line
        assert result.returncode == 2
    said = nlctl_here("simulate", "loops.py:misspelt", cwd=folder).stderr
    assert said.startswith(
        "nlctl: AttributeError: module 'nlctl' has no attribute 'DedZone'; nearest: nlctl.DeadZone"
    )


@pytest.mark.parametrize("option", ["--until", "--step"])
def test_nothing_is_not_taken_for_the_usual(folder, option):
    """0 s is refused of a page as of a run."""
    for command in ("simulate", "report"):
        result = nlctl_here(command, "loops.py:make", option, "0", cwd=folder)
        assert (result.returncode, "needs 0 < step < until" in result.stderr) == (2, True)


@pytest.mark.parametrize("name", ["make", "rational", "discrete"])
def test_paths_with_spaces_and_umlauts_and_every_kind_of_loop_run(folder, name):
    """A transfer function too, and a loop in discrete time at its own samples."""
    loop = f"{folder}/größe und mehr.py:{name}"
    result = nlctl_here("simulate", loop, "--until", "1", "--csv", "größe.csv", cwd=folder)
    assert result.returncode == 0, result.stderr
    assert "-0 " not in result.stdout
    rows = (folder / "größe.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + (11 if name == "discrete" else 101)


def closed(between):
    """A lag behind a block, in feedback."""
    import control as ct

    (u,), (v,) = between.input_labels, between.output_labels
    lag = ct.ss(-1, 1, 2, 0, inputs=v, outputs="y", name="lag")
    error = ct.summing_junction(["r", "-y"], u, name="error")
    return nlctl.interconnect([lag, between, error], inputs=["r"], outputs=["y", u])


def checked(between):
    """What is found of whether the loop is at rest in the end."""
    loop = closed(between)
    run = nlctl.input_output_response(loop, np.linspace(0, 20, 2001), 1.0)
    return {one.what: one for one in checks_of(loop, run, {})}[
        "The state at the end is a stable equilibrium"
    ]


def test_a_page_of_what_samples_delays_or_slides_says_what_applies():
    """The hold of y' = 2 v - y over h has the eigenvalue exp(-h) - 2 (1 - exp(-h)) with v = -y."""
    import control as ct

    h = 0.07
    gain = ct.ss([], [], [], 1.0, h, inputs="e", outputs="v", name="gain")
    sampled = checked(nlctl.sampled(gain))
    pole = abs(np.exp(-h) - 2 * (1 - np.exp(-h)))
    assert sampled.status == "pass"
    assert f"eigenvalue of its linearisation is {pole:.4g}, per {h:g} s" in sampled.found
    wire = nlctl.TransportDelay(delay=0.3, inputs=("u",), outputs=("v",))
    delayed = checked(nlctl.block(wire, "wire"))
    assert delayed.status == "not applicable"
    assert "'wire' delays its signals" in delayed.found
    assert checked(nlctl.block(nlctl.IdealRelay(), "relay")).status in ("pass", "not applicable")
