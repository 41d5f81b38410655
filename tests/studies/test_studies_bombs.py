"""Whatever stands in a study file, it is read or refused in a sentence at once."""

import functools
import hashlib
import json
import time

import pytest
from command_line import nlctl_here
from studies_example import HEAD, ROWS, write

from nlctl.analysis.studies import RunFolderError
from nlctl.analysis.studies.file.toml import DEEPEST, line_numbers, statements
from nlctl.analysis.studies.sealed import RUN_FORMAT, read_json

DOTS = ".".join(["a"] * 3000)
MANY = ", ".join(f"o{i} = {i}" for i in range(10))
CHOICES = "\n".join(f"[choices.k{i}]\noptions = {{ {MANY} }}" for i in range(20))


def analysis(**keys):
    text = "\n".join(f"{key} = {value}" for key, value in keys.items())
    return f"{HEAD}\n[runs]\nsize = 20\n\n[[analysis]]\n{text}\n"


def rows(text):
    return f"{HEAD}\n[runs]\n{text}\n"


BOMBS = {
    "nested lists": (HEAD + "x = " + "[" * 3000 + "]" * 3000, "inside of each other"),
    "more lists": (HEAD + "x = " + "[" * 5000 + "]" * 5000, "characters in line"),
    "lists over lines": (HEAD + "x = " + "[\n" * 5000 + "]\n" * 5000, "inside of each other"),
    "nested lists that do not end": (HEAD + "x = " + "[" * 5000, "TOML|inside of each other"),
    "nested tables": (HEAD + "x = " + "{ a = " * 1000 + "1" + "}" * 1000, "inside of each other"),
    "dotted keys": (HEAD + f"{DOTS} = 1\n", "deeper than 20, in 'time'|deeper than 20"),
    "a dotted header": (f"{HEAD}[{DOTS}]\nx = 1\n", "deeper than 20"),
    "a dotted list header": (f"{HEAD}[[{DOTS}]]\nx = 1\n", "deeper than 20"),
    "the most dots": (HEAD + ".".join(["a"] * 3_800) + " = 1\n", "deeper than 20"),
    "more dots": (HEAD + ".".join(["a"] * 60_000) + " = 1\n", "characters in line"),
    "a long integer": (HEAD.replace("seed = 3", "seed = " + "1" * 5000), "thousands of digits"),
    "an integer of 4000 digits": (
        HEAD.replace("end = 2.0", "end = " + "1" * 4000), "time.end|time"),
    "a size of 4000 digits": (rows("size = " + "1" * 4000), "at most 10,000,000 rows"),
    "a float out of range": (HEAD.replace("end = 2.0", "end = 1e999"), "time.end"),
    "a large file": (HEAD + "# x\n" * 100_000, "characters"),
    "many lines": (HEAD + "x = [\n" + "[1, 2],\n" * 20_000 + "]\n", "unknown key 'x'"),
    "many strings": (HEAD + "x = [\n" + '"a[b",\n' * 20_000 + "]\n", "unknown key 'x'"),
    "NUL in a path": (HEAD.replace("loop.py:loop", "lo\\u0000op.py:loop"), "can be printed"),
    "NUL in a module": (HEAD.replace("loop.py:loop", "os\\u0000path:loop"), "can be printed"),
    "a long path": (HEAD.replace("loop.py:loop", "a" * 5000 + ".py:loop"), "at most 500 char"),
    "a long name": (HEAD.replace('"lag.rate" =', f'"{"a" * 5000}" ='), "unknown parameter"),
    "a relative module": (HEAD.replace("loop.py:loop", "..lag:loop"), "separated by dots"),
    "a deep formula": (HEAD.replace("always |z| <= 4", "(" * 5000), "levels"),
    "a Sobol' design": (rows("design = \"Sobol'\"\nsize = 1099511627776"), "at most 10,000,000"),
    "a Latin hypercube": (rows('design = "Latin hypercube"\nsize = 1000000000000'), "at most"),
    "independent rows": (rows("size = 1000000000000000000"), "got about 10^18"),
    "a grid": (rows('design = "grid"\nlevels = 1000000000'), "got about 10^18"),
    "a long run": (HEAD.replace("step = 0.02", "step = 1e-300"), "samples"),
    "Sobol' indices": (analysis(kind='"sobol"', size=2**40), "at most 10,000,000 runs"),
    "Morris": (analysis(kind='"morris"', trajectories=10**12), "at most 10,000,000 runs"),
    "levels of Morris": (analysis(kind='"morris"', levels=10**12), "at most 10,000,000 runs"),
    "a search": (analysis(kind='"worst case"', runs=10**15), "at most 10,000,000 runs"),
    "draws": (analysis(kind='"radius"', draws=10**15), "at most 10,000,000 runs"),
    "cells": (analysis(kind='"failure map"', x='"lag.rate"', y='"lag.x(0)"', cells=10**9),
              "at most 10,000,000 runs"),
    "sizes": (analysis(kind='"degradation"', factors="[0.5, 1.0]", runs=10**15),
              "at most 10,000,000 runs"),
    "a comparison": (analysis(kind='"compare"', keyword='"name"', options='{ a = "a" }',
                              runs=10**15, metrics='{ iae = "smaller" }'), "at most 10,000,000"),
    "choices": (HEAD + CHOICES.replace("k0", "name"), "unknown keyword|at most 1,000 diagrams"),
    "steps": (HEAD + "[solver]\nmax_steps = " + "1" * 30 + "\n", "max_steps"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_bombs_end_in_a_sentence_at_once(tmp_path, name):
    """Neither a traceback nor a wait; the sentence is short, whatever it quotes."""
    text, words = BOMBS[name]
    path = write(tmp_path, text)
    start = time.perf_counter()
    told = nlctl_here("validate", path, cwd=tmp_path)
    spent = time.perf_counter() - start
    assert told.returncode == 2, told.stderr[-2000:]
    assert any(part in told.stderr for part in words.split("|")), told.stderr[:2000]
    assert "Traceback" not in told.stderr
    assert len(told.stderr) < 5000
    assert spent < 30  # not minutes


@pytest.mark.slow
@pytest.mark.parametrize(
    "setting",
    [f"{DOTS}=1", "runs.size=" + "1" * 5000, "x=" + "[" * 5000, "study.seed=" + "9" * 4200],
)
def test_settings_of_the_command_line_are_no_way_round(tmp_path, setting):
    """They pass the same gate."""
    path = write(tmp_path, HEAD, ROWS)
    told = nlctl_here("validate", path, "--set", setting, cwd=tmp_path)
    if setting.startswith("study.seed"):
        assert told.returncode == 0, told.stderr
        return
    assert told.returncode == 2
    assert "Traceback" not in told.stderr
    assert len(told.stderr) < 3000


def test_statements_are_those_of_toml():
    """Brackets, quotes and hashes in texts, lists over lines, comments, long strings."""
    text = '''a = 1 # [
b = "[ \\" # {"
c = [ # ]
  "]", [1,
  2],
]

[table."x]y"]
d = """
[not.a.header]
"" \\""" e = 3
"""
f = '[' # a comment
[[list]]
g = { h = ["}"] }'''
    found = list(statements(text))
    assert [line for line, _ in found] == [0, 1, 2, 7, 8, 12, 13, 14]
    numbers = line_numbers(text)
    assert numbers["c",] == 3
    assert numbers["table", "x]y", "d"] == 9
    assert numbers["list", 0, "g"] == 15
    assert DEEPEST >= 10


def test_a_sealed_file_of_a_run_that_is_nested_too_deeply_is_refused(tmp_path):
    """Whoever sends a folder can seal it: what Python cannot follow ends in one sentence."""
    deep = functools.reduce(lambda inner, _: [inner], range(700), 1)
    plain = {"format": RUN_FORMAT, "deep": deep}
    key = hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()
    (tmp_path / "run.json").write_text(json.dumps(plain | {"sha256": key}))
    with pytest.raises(RunFolderError, match="it is nested too deeply"):
        read_json(tmp_path / "run.json")
