"""A cheap loop and a study of it, for the tests of study files."""

from pathlib import Path

LOOP = '''
"""x' = -rate x + gain x^3, from x(0)."""

import nlctl


@nlctl.record
class Lag:
    """x' = -rate x + gain x^3."""

    rate: float = nlctl.param(1.0, unit="1/s", meaning="decay", above=0)
    gain: float = nlctl.param(0.0, unit="1/s", meaning="growth")
    inputs, outputs, states, initial = (), ("y", "z"), ("x",), {"x": 1.0}
    feedthrough = False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (-p.rate * x[0] + p.gain * x[0] ** 3,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return x[0], 2 * x[0]


def loop(lag=None, name="loop"):
    return nlctl.interconnect({"lag": lag or Lag()}, outputs=["y", "z"], name=name)


def lags():
    return {"calm": Lag(gain=0.0), "lively": Lag(gain=0.2), "wild": Lag(gain=0.4)}


def broken():
    raise RuntimeError("no such luck")
'''

HEAD = """\
loop = "loop.py:loop"

[study]
title = "A lag"
seed = 3

[space]
"lag.rate" = { uniform = [0.5, 2.5] }
"lag.x(0)" = { bounds = [0.5, 1.5], nominal = 1.0 }

[spec]
decays = "always from 1 s on y <= 0.5"
small = { formula = "always |z| <= 4", meaning = "the range of the sensor" }

[time]
end = 2.0
step = 0.02

[metrics]
error = "y"
control = "z"
band = 0.1
"""

ROWS = """
[runs]
size = 200

[[analysis]]
kind = "probability"
limit = 0.5
"""


def write(folder: Path, *parts: str, name: str = "study.toml") -> Path:
    """Write a study and its loop into a folder; return the study's path."""
    (folder / "loop.py").write_text(LOOP, encoding="utf-8")
    path = folder / name
    path.write_text("\n".join(parts or (HEAD, ROWS)), encoding="utf-8")
    return path
