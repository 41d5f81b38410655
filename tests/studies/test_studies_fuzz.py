"""Whatever stands in a study file, it is read, or refused by name: never a trace, never a wait."""

import contextlib
import copy
import random
import signal
import tomllib
import warnings
from collections import Counter

import pytest
import tomli_w
from studies_example import HEAD, write

from nlctl.analysis.studies import StudyError, plan, read_study
from nlctl.errors import UsageError

WHOLE = """
[choices.lag]
options.usual = "default"
options.other = { function = "loop.py:Lag", rate = 2.0 }
weights = { usual = 0.5, other = 0.5 }

[faults]
"lag.y" = { bias = 0.1, stuck = true }

[solver]
rtol = 1e-6
method = "auto"

[runs]
size = 4

[[analysis]]
kind = "probability"
limit = 0.5

[[analysis]]
kind = "worst case"
runs = 20

[[analysis]]
kind = "radius"
quantities = ["lag.rate"]
largest = 0.5
runs = 20
draws = 8

[[analysis]]
kind = "sobol"
size = 4

[[analysis]]
kind = "failure map"
x = "lag.rate"
y = "lag.x(0)"
cells = 3
levels = 2

[[analysis]]
kind = "compare"
keyword = "lag"
options = { function = "loop.py:lags" }
requirements = ["decays"]
runs = 4
metrics = { iae = "smaller" }
better = ["calm", "wild"]
"""
LEAVES = [
    None, True, False, 0, 1, -1, 10**6, 10**30, -(10**18), 0.0, -0.0, 1e-300, 1e300, -2.5,
    float("nan"), float("inf"), float("-inf"), "", " ", "x", "default", "nan", "lag.rate", "é",
    "\u202e", "a" * 3000, "always y <= 1", "always y <= 1 and z <= 2", "loop.py:loop",
    "loop.py:Lag", "loop.py:nothing", "../x.py:f", "numpy:load", "os:system", "a:b:c", ":", "x:",
    "nlctl:block", "example-1", [], [1], [1, 2], [2.0, 1.0], [[1]], ["a", 1], {}, {"a": 1},
    {"block": "DeadZone"}, {"block": "Nothing"}, {"block": "DeadZone", "b_r": -1},
    {"block": "SumOfSines"}, {"block": "PureFeedback", "order": 2}, {"function": "loop.py:Lag"},
    {"function": "loop.py:Lag", "rate": "x"}, {"function": "loop.py:Lag", "speed": 1},
    {"function": 1}, {"function": "loop.py:lags"}, {"block": "Lag", "function": "loop.py:Lag"},
    {"law": "norm"}, {"law": "lognorm", "parameters": {"s": -1.0}}, {"uniform": [0.0, 1.0]},
    {"formula": "always y <= 1", "until": -1}, {"stuck": False}, {"dropout": 0.0},
]  # fmt: skip
WORDS = ["loop", "study", "space", "spec", "time", "metrics", "runs", "analysis", "kind", "key",
         "options", "title", "seed", "size", "limit", "uniform", "bounds", "law", "x"]  # fmt: skip
RAW = 0
"""How many of the mutants may end otherwise; it may only fall."""
LONGEST = 20  # s


def places(data, place=()):
    yield place
    parts = (
        data.items()
        if isinstance(data, dict)
        else enumerate(data)
        if isinstance(data, list)
        else ()
    )
    for key, part in parts:
        yield from places(part, (*place, key))


def mutated(data, rng):
    """One or two changes of a study, as data."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        every = [place for place in places(data) if place]
        if not every:
            break
        *way, last = rng.choice(every)
        here = data
        for key in way:
            here = here[key]
        how = rng.choice(["set", "set", "set", "drop", "copy", "rename", "move"])
        if how == "drop":
            del here[last]
        elif how == "set":
            here[last] = copy.deepcopy(rng.choice(LEAVES))
        elif isinstance(here, list):
            here.insert(0, copy.deepcopy(here[last]))
        elif how == "copy":
            here[rng.choice(WORDS)] = copy.deepcopy(here[last])
        elif how == "rename":
            here[rng.choice([str(last) + "x", rng.choice(WORDS), "", "a.b", "ü"])] = here.pop(last)
        else:
            data[rng.choice(WORDS)] = copy.deepcopy(here[last])
    return data


def without_none(data):
    if isinstance(data, dict):
        return {key: without_none(part) for key, part in data.items() if part is not None}
    return [without_none(p) for p in data if p is not None] if isinstance(data, list) else data


def noise(text, rng):
    """A study with bytes that are wrong."""
    content = bytearray(text.encode())
    for _ in range(rng.choice([1, 2, 8])):
        place = rng.randrange(len(content))
        how = rng.choice(["flip", "cut", "add", "swap"])
        if how == "flip":
            content[place] ^= 1 << rng.randrange(8)
        elif how == "cut":
            del content[place : place + rng.choice([1, 5, 200])]
        elif how == "add":
            content[place:place] = rng.choice(
                [b"\0", b"\xff", b"\n", b'"', b"[[", b"= =", b"\r", b"\x1b["]
            )
        else:
            content[place : place + 1] = content[place : place + 1][::-1] * 2
    return bytes(content)


@contextlib.contextmanager
def within(seconds):
    """End what takes too long."""

    def ended(number, frame):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ended)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def outcome(path, longest=LONGEST):
    """What becomes of a file: "read", "refused", or the error that it must not end with."""
    try:
        with within(longest), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file = read_study(path)
            if file.study.analysis:
                plan(file, threads=1)
        return "read"
    except StudyError as error:
        printable = str(error).replace("\n", "").isprintable()
        return "refused" if error.problems and printable else "StudyError without words"
    except UsageError as error:
        return "refused" if str(error) else "UsageError without words"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:80]}"


def mutants(folder, count, seed):
    """Write one mutant after the other; yield what was written, and what became of it."""
    rng = random.Random(seed)
    path = write(folder, HEAD, WHOLE)
    text = path.read_text(encoding="utf-8")
    data = tomllib.loads(text)
    assert outcome(path, 10 * LONGEST) == "read"  # compiles, perhaps
    for number in range(count):
        if number % 4 == 3:
            content = noise(text, rng)
        else:
            try:
                content = tomli_w.dumps(without_none(mutated(data, rng))).encode()
            except (TypeError, ValueError):
                continue
        path.write_bytes(content)
        yield content, outcome(path)


def raw_of(folder, count, seed):
    found, examples = Counter(), {}
    for content, told in mutants(folder, count, seed):
        found[told] += 1
        examples.setdefault(told, content)
    assert found["read"] > 0
    assert found["refused"] > count / 3
    bad = {told: n for told, n in found.items() if told not in ("read", "refused")}
    told = "\n\n".join(f"{t}:\n{examples[t].decode(errors='replace')}" for t in bad)
    return sum(bad.values()), f"{bad}\n{told}"


@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="alarms are POSIX's")
def test_some_mutants_of_a_study_are_read_or_refused(tmp_path):
    """A few of them every day."""
    count, told = raw_of(tmp_path, 60, seed=1)
    assert count == 0, told


@pytest.mark.weekly
@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="alarms are POSIX's")
@pytest.mark.parametrize("seed", range(4))
def test_mutants_of_a_study_are_read_or_refused(tmp_path, seed):
    """Many of them every week; the bound may only fall."""
    count, told = raw_of(tmp_path, 1000, seed=100 + seed)
    assert count <= RAW, told
